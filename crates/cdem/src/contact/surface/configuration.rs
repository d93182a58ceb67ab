//! Positions of all nodes, with their geometry cache.

use crate::contact::surface::geometry_cache::GeometryCache;
use crate::model::positions::Positions;

/// Positions of all nodes, and the geometry cache of these positions, if any.
#[derive(Clone, Copy)]
pub(crate) struct Configuration<'a, const D: usize> {
    positions: Positions<'a, D>,
    cache: Option<&'a GeometryCache<D>>,
}

impl<'a, const D: usize> From<Positions<'a, D>> for Configuration<'a, D> {
    /// Makes a configuration without a cache.
    fn from(positions: Positions<'a, D>) -> Self {
        Self {
            positions,
            cache: None,
        }
    }
}

impl<'a, const D: usize> Configuration<'a, D> {
    /// Makes a configuration of rest positions plus displacements, m, without a cache.
    ///
    /// # Panics
    /// If the numbers of both differ.
    pub(crate) fn new(rest: &'a [[f64; D]], displacement: &'a [[f64; D]]) -> Self {
        Positions::new(rest, displacement).into()
    }

    /// Makes a configuration of rest positions, m, without a cache.
    pub(crate) fn at_rest(rest: &'a [[f64; D]]) -> Self {
        Positions::at_rest(rest).into()
    }

    /// Returns the geometry cache, if any.
    pub(crate) fn cache(&self) -> Option<&'a GeometryCache<D>> {
        self.cache
    }

    /// Returns the same positions with a cache. The cache is empty, or was filled for this surface
    /// at these positions alone.
    pub(crate) fn with<'b>(self, cache: Option<&'b GeometryCache<D>>) -> Configuration<'b, D>
    where
        'a: 'b,
    {
        Configuration { cache, ..self }
    }

    /// Returns the configuration after `time` seconds at constant velocities, m/s, without a cache.
    pub(crate) fn after(self, velocity: &'a [[f64; D]], time: f64) -> Self {
        self.positions.after(velocity, time).into()
    }

    /// Returns the configuration at a fraction of the way to a `later` one of the same drift,
    /// without a cache.
    pub(crate) fn towards(self, later: Self, fraction: f64) -> Self {
        self.positions.towards(later.positions, fraction).into()
    }

    /// Returns the position of a node, m.
    #[inline]
    pub(crate) fn at(&self, node: u32) -> [f64; D] {
        self.positions.at(node)
    }
}
