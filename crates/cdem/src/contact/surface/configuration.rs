//! Positions of all nodes, with the surface geometry that is cached for them.

use crate::contact::surface::geometry_cache::GeometryCache;
use crate::model::positions::Positions;

/// Positions, and the geometry cache of these positions if one is kept.
#[derive(Clone, Copy)]
pub(crate) struct Configuration<'a, const D: usize> {
    positions: Positions<'a, D>,
    cache: Option<&'a GeometryCache<D>>,
}

impl<'a, const D: usize> From<Positions<'a, D>> for Configuration<'a, D> {
    /// Without a cache.
    fn from(positions: Positions<'a, D>) -> Self {
        Self {
            positions,
            cache: None,
        }
    }
}

impl<'a, const D: usize> Configuration<'a, D> {
    /// Rest positions plus displacements, m, without a cache.
    ///
    /// # Panics
    /// If there are not as many of both.
    pub(crate) fn new(rest: &'a [[f64; D]], displacement: &'a [[f64; D]]) -> Self {
        Positions::new(rest, displacement).into()
    }

    /// Rest positions, m, without a cache.
    pub(crate) fn at_rest(rest: &'a [[f64; D]]) -> Self {
        Positions::at_rest(rest).into()
    }

    /// The geometry cache, if there is one.
    pub(crate) fn cache(&self) -> Option<&'a GeometryCache<D>> {
        self.cache
    }

    /// The same positions with a cache: an empty one, or one that was filled at these positions
    /// of this surface alone.
    pub(crate) fn with<'b>(self, cache: Option<&'b GeometryCache<D>>) -> Configuration<'b, D>
    where
        'a: 'b,
    {
        Configuration { cache, ..self }
    }

    /// The configuration after `time` seconds at constant velocities, m/s; without a cache.
    pub(crate) fn after(self, velocity: &'a [[f64; D]], time: f64) -> Self {
        self.positions.after(velocity, time).into()
    }

    /// The configuration at a fraction of the way to a `later` one of the same drift; without a
    /// cache.
    pub(crate) fn towards(self, later: Self, fraction: f64) -> Self {
        self.positions.towards(later.positions, fraction).into()
    }

    /// Position of a node, m.
    #[inline]
    pub(crate) fn at(&self, node: u32) -> [f64; D] {
        self.positions.at(node)
    }
}
