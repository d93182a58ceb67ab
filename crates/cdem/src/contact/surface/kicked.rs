//! Nodes in a kick: fixed positions, changing velocities.

use crate::contact::surface::Configuration;
use crate::contact::surface::geometry_cache::GeometryCache;
use crate::model::kinematics::NodalMotion;

/// Positions and constant velocities of the nodes in a drift.
#[derive(Clone, Copy)]
pub(crate) struct ConstantMotion<'a, const D: usize> {
    pub(crate) at: Configuration<'a, D>,
    /// Velocities, m/s.
    pub(crate) velocity: &'a [[f64; D]],
}

impl<'a, const D: usize> ConstantMotion<'a, D> {
    /// Returns the motion at the present velocities, without a cache.
    pub(crate) fn of(motion: &'a NodalMotion<D>) -> Self {
        Self {
            at: motion.positions().into(),
            velocity: motion.velocity,
        }
    }

    /// Returns the configuration after `time` seconds, without a cache.
    pub(crate) fn after(&self, time: f64) -> Configuration<'a, D> {
        self.at.after(self.velocity, time)
    }
}

/// Positions and velocities of the nodes between a kick and the drift after it.
pub(crate) struct KickedView<'a, const D: usize> {
    /// Current positions.
    at: Configuration<'a, D>,
    /// Velocities, m/s.
    pub(crate) velocity: &'a mut [[f64; D]],
}

impl<'a, const D: usize> KickedView<'a, D> {
    /// Makes a view of the nodes at their present positions, with the geometry cache of these, if
    /// any.
    pub(crate) fn new(motion: &'a mut NodalMotion<D>, cache: Option<&'a GeometryCache<D>>) -> Self {
        Self {
            at: Configuration::new(motion.rest, motion.displacement).with(cache),
            velocity: motion.velocity,
        }
    }

    /// Returns a view of other velocities at the same positions.
    pub(crate) fn with<'b>(&self, velocity: &'b mut [[f64; D]]) -> KickedView<'b, D>
    where
        'a: 'b,
    {
        KickedView {
            at: self.at,
            velocity,
        }
    }

    /// Returns the current positions.
    pub(crate) fn positions(&self) -> Configuration<'a, D> {
        self.at
    }

    /// Returns the motion at the present velocities.
    pub(crate) fn constant(&self) -> ConstantMotion<'_, D> {
        ConstantMotion {
            at: self.at,
            velocity: self.velocity,
        }
    }
}
