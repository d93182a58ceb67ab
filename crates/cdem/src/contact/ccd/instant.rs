//! The instant at which a gap closes.

use crate::contact::surface::{ConstantMotion, Pair, Surface};

/// Returns the instant at which the gap of a pair closes, s, from its time of impact within
/// `duration`, s, by a Newton step.
///
/// A [time of impact](crate::contact::surface::TimeOfImpact::time_of_impact) is early by the
/// round-off of a volume over the area of the features, which is small between nearly parallel
/// edges. The gap between the two feet has only the round-off of the positions. A feature that comes
/// in from behind, or touches already, keeps its time.
pub(crate) fn instant_of_touch<const D: usize>(
    surface: &dyn Surface<D>,
    pair: Pair,
    motion: ConstantMotion<D>,
    time: f64,
    duration: f64,
) -> f64 {
    if time <= 0.0 {
        return time;
    }
    let then = motion.after(time);
    let foot = surface.project(pair, then).foot;
    let jacobian = surface.jacobian(pair, &foot, then);
    let gap = jacobian.offset[0];
    let speed = -jacobian.relative_velocity(0, motion.velocity);
    if gap <= 0.0 || speed <= 0.0 {
        return time;
    }
    let closed = duration.min(time + gap / speed);
    // Features that turn or graze may be deep by then.
    let left = surface.gap(pair, motion.after(closed), Some(&jacobian.frame[0]));
    if left.is_some_and(|left| left >= -gap) {
        closed
    } else {
        time
    }
}
