//! Coupling of contact to the blocks behind the surfaces.

use crate::contact::energy::ImpulseReceiver;
use crate::contact::rollback::Rollback;
use crate::model::kinematics::NodalMotion;

/// A touch in the middle of a drift, as the bodies see it.
pub(crate) struct VelocityJump<'a, const D: usize> {
    /// Nodes of the island, sorted, and their velocities before the touch, m/s.
    pub(crate) nodes: &'a [u32],
    pub(crate) before: &'a [[f64; D]],
    /// Whether a node moves with an island, this or another.
    pub(crate) taken: &'a [bool],
    /// What is left of the drift, s.
    pub(crate) remaining: f64,
}

/// What lies behind the surfaces.
pub(crate) trait BodyCoupling<const D: usize>: Sync {
    /// What is known of a touch while it is in hand; its storage is kept for the next.
    type Touch: Default;

    /// A touch has changed the velocities of an island: takes it in hand. Nodes beyond the
    /// island that it may move are on the trail then.
    fn begin_impact(
        &self,
        motion: &mut NodalMotion<D>,
        jump: &VelocityJump<D>,
        rollback: &mut Rollback<D>,
        touch: &mut Self::Touch,
    );

    /// Impulses of elements that go with it, N·s, on nodes of the island and others.
    fn impulses(touch: &Self::Touch) -> &[(u32, [f64; D])];

    /// The same touch with these impulses. Returns the factor on them that
    /// balances the energy.
    fn balance(&self, touch: &Self::Touch, motion: &NodalMotion<D>) -> f64;

    /// The same touch so many seconds before the end of the drift, with these impulses so many
    /// times; tells the impulses on nodes that are held. Returns how much less it has taken
    /// than the impulses of the contacts have, J.
    fn finish_impact(
        &self,
        touch: &Self::Touch,
        motion: &mut NodalMotion<D>,
        remaining_and_times: (f64, f64),
        on_held: ImpulseReceiver<D>,
    ) -> f64;
}

/// Visits the nodes that share an element and their level with a node.
pub(crate) type NeighbourNodes<'a> = &'a dyn Fn(u32, &mut dyn FnMut(u32));

/// Drift of a node that is due, s.
pub(crate) type DriftDurations<'a> = &'a dyn Fn(u32) -> Option<f64>;

/// Kick interval and drift of a node that is due, s.
pub(crate) type KickTiming<'a> = &'a (dyn Fn(u32) -> Option<(f64, f64)> + Sync);
