//! Current positions of the nodes.

use crate::math::vector::{add, add_scaled};

/// Current positions, m: rest positions plus displacements, plus the way of a drift at constant
/// velocities.
#[derive(Clone, Copy)]
pub(crate) struct Positions<'a, const D: usize> {
    rest: &'a [[f64; D]],
    /// Empty if all nodes are at rest.
    displacement: &'a [[f64; D]],
    /// Velocities, m/s, and the time since the displacements, s.
    drift: Option<(&'a [[f64; D]], f64)>,
}

impl<'a, const D: usize> Positions<'a, D> {
    /// Creates positions from rest positions and displacements.
    ///
    /// # Panics
    /// If the two differ in length.
    pub(crate) fn new(rest: &'a [[f64; D]], displacement: &'a [[f64; D]]) -> Self {
        assert_eq!(rest.len(), displacement.len());
        Self {
            displacement,
            ..Self::at_rest(rest)
        }
    }

    /// Creates rest positions.
    pub(crate) fn at_rest(rest: &'a [[f64; D]]) -> Self {
        Self {
            rest,
            displacement: &[],
            drift: None,
        }
    }

    /// Returns the positions after `time`, s, at constant velocities.
    pub(crate) fn after(self, velocity: &'a [[f64; D]], time: f64) -> Self {
        Self {
            drift: Some((velocity, time)),
            ..self
        }
    }

    /// Returns the positions at a `fraction` of the way to the positions `later` in the same drift.
    pub(crate) fn towards(self, later: Self, fraction: f64) -> Self {
        let time = |of: Self| of.drift.map_or(0.0, |(_, time)| time);
        let [from, to] = [self, later].map(time);
        let drift = later.drift.or(self.drift);
        Self {
            drift: drift.map(|(velocity, _)| (velocity, from + fraction * (to - from))),
            ..later
        }
    }

    /// Returns the position of a node.
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
