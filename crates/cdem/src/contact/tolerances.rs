//! Numerical constants of contact.

/// How far the gaps of closed contacts may miss what they are to be at the end of
/// a drift, over the tolerance, and how often the island is solved again for it.
/// Gaps are asked for along their present gradients; those of points that slide
/// along a turning edge change besides, by the square of the drift.
pub(crate) const MISS: f64 = 0.1;
pub(crate) const AGAIN: usize = 2;

/// Gap, over the tolerance, at which a pair that is about to touch, and no farther aside of
/// its target than the tolerance, joins an event that comes before: a 1e-8th of the smallest boundary edge by default.
pub(crate) const EARLY: f64 = 1e-4;

/// Overlap, over the tolerance, that is none: a 1e-6th of the smallest boundary edge
/// by default. A pair too slow to come deeper in a drift waits for the next kick,
/// which holds it: stones that settle would open and close one after the other, each
/// touch an impact of the whole pile.
pub(crate) const SHALLOW: f64 = 1e-2;

/// Relative move that is round-off, over the tolerance: a 1e-14th of the smallest
/// boundary edge by default.
pub(crate) const LEAST_MOVE: f64 = 1e-10;

/// Residual of a solve of which the user should know: forces of contacts are
/// wrong by as much, until the next step goes on from there.
pub(crate) const UNSOLVED: f64 = 1e-2;

/// First touches within one substep that are taken at their own instants. Where
/// there are more, as when long faces meet at a small angle, those of the next
/// 1/16 of the substep become one event: closed a little early, never late.
pub(crate) const EVENTS: usize = 16;

/// Touches closer in time than this share of the substep are one event.
pub(crate) const SIMULTANEOUS: f64 = 1e-9;

/// Round-off of a gap, over the coordinates of its nodes.
pub(crate) const GAP_ROUND_OFF: f64 = 8.0 * f64::EPSILON;
