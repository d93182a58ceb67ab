//! Nodes in a kick: fixed positions, changing velocities.

use crate::contact::surface::Configuration;
use crate::contact::surface::geometry_cache::Formed;
use crate::model::kinematics::Motion;

/// Nodes between a kick and the drift after it: where they are, and how they are about to move.
pub(crate) struct Kicked<'a, const D: usize> {
    /// Current positions.
    at: Configuration<'a, D>,
    /// Velocities, m/s.
    pub(crate) velocity: &'a mut [[f64; D]],
}

impl<'a, const D: usize> Kicked<'a, D> {
    /// Nodes at their present positions, with a geometry cache of these if one is kept.
    pub(crate) fn new(motion: &'a mut Motion<D>, cache: Option<&'a Formed<D>>) -> Self {
        Self {
            at: Configuration::new(motion.rest, motion.displacement).with(cache),
            velocity: motion.velocity,
        }
    }

    /// Other velocities at the same positions.
    pub(crate) fn with<'b>(&self, velocity: &'b mut [[f64; D]]) -> Kicked<'b, D>
    where
        'a: 'b,
    {
        Kicked {
            at: self.at,
            velocity,
        }
    }

    /// Current positions.
    pub(crate) fn positions(&self) -> Configuration<'a, D> {
        self.at
    }
}
