//! Current positions of the nodes.

use crate::math::vector::{add, add_scaled};

/// Current positions, m: rest positions plus displacements, and what constant
/// velocities have added since.
#[derive(Clone, Copy)]
pub(crate) struct Positions<'a, const D: usize> {
    rest: &'a [[f64; D]],
    /// Empty where all nodes are at rest.
    displacement: &'a [[f64; D]],
    /// Velocities, m/s, and for how long, s.
    drift: Option<(&'a [[f64; D]], f64)>,
}

impl<'a, const D: usize> Positions<'a, D> {
    /// Positions from rest positions and displacements.
    ///
    /// # Panics
    /// If there are not as many of both.
    pub(crate) fn new(rest: &'a [[f64; D]], displacement: &'a [[f64; D]]) -> Self {
        assert_eq!(rest.len(), displacement.len());
        Self {
            displacement,
            ..Self::at_rest(rest)
        }
    }

    /// Rest positions.
    pub(crate) fn at_rest(rest: &'a [[f64; D]]) -> Self {
        Self {
            rest,
            displacement: &[],
            drift: None,
        }
    }

    /// Where the nodes will be after `time` at constant velocities.
    pub(crate) fn after(self, velocity: &'a [[f64; D]], time: f64) -> Self {
        Self {
            drift: Some((velocity, time)),
            ..self
        }
    }

    /// A share of the way from here to where the nodes are `later` in the same drift.
    pub(crate) fn towards(self, later: Self, share: f64) -> Self {
        let time = |of: Self| of.drift.map_or(0.0, |(_, time)| time);
        let [from, to] = [self, later].map(time);
        let drift = later.drift.or(self.drift);
        Self {
            drift: drift.map(|(velocity, _)| (velocity, from + share * (to - from))),
            ..later
        }
    }

    /// Position of a node.
    #[inline]
    pub(crate) fn at(&self, node: u32) -> [f64; D] {
        let node = node as usize;
        let mut position = self.rest[node];
        if let Some(displacement) = self.displacement.get(node) {
            position = add(&position, displacement);
        }
        if let Some((velocity, time)) = self.drift {
            add_scaled(&mut position, time, &velocity[node]);
        }
        position
    }
}
