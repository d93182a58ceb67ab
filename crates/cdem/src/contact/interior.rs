//! Coupling of contact to the elements behind the surfaces.

use crate::contact::rollback::Rollback;
use crate::model::kinematics::NodalMotion;

/// Change of velocities by a touch in the middle of a drift.
pub(crate) struct VelocityJump<'a, const D: usize> {
    /// Nodes of the island, sorted, and their velocities before the touch, m/s.
    pub(crate) nodes: &'a [u32],
    pub(crate) before: &'a [[f64; D]],
    /// For each node: true if it moves with any island.
    pub(crate) in_island: &'a [bool],
    /// Rest of the drift, s.
    pub(crate) remaining: f64,
}

/// Response of the bodies behind the surfaces to an impact in the middle of a drift.
pub(crate) trait BodyCoupling<const D: usize>: Sync {
    /// Data of a touch while it is solved. Kept to reuse their memory.
    type Touch: Default;

    /// Prepares the response to a touch that has changed the velocities of an island. Adds
    /// nodes outside the island that the touch may move to the rollback log.
    fn begin_impact(
        &self,
        motion: &mut NodalMotion<D>,
        jump: &VelocityJump<D>,
        rollback: &mut Rollback<D>,
        touch: &mut Self::Touch,
    );

    /// Returns the impulses of elements that act at the touch, N·s, on nodes of the island and
    /// others.
    fn impulses(touch: &Self::Touch) -> &[(u32, [f64; D])];

    /// Returns the factor on the impulses that balances the energy, at the velocities with the
    /// impulses applied.
    fn balance(&self, touch: &Self::Touch, motion: &NodalMotion<D>) -> f64;

    /// Finishes a touch, given the time left in the drift, s, and the `factor` on the impulses.
    /// Adds the impulses on nodes with prescribed components to a list, N·s. Returns the energy
    /// that the bodies recover from the work of the contacts, J.
    fn finish_impact(
        &self,
        touch: &Self::Touch,
        motion: &mut NodalMotion<D>,
        remaining: f64,
        factor: f64,
        on_prescribed: &mut Vec<(u32, [f64; D])>,
    ) -> f64;
}
