//! Prescribed velocities: held components of nodes, and what they do.

use crate::math::vector::{cross, dot, pad, scale, sub, truncate};
use crate::scene::{Boundary, Motion};

/// A prescribed motion of some nodes.
pub(crate) struct Prescribed {
    /// The nodes, sorted.
    pub(crate) nodes: Vec<u32>,
    boundary: Boundary,
}

impl Prescribed {
    /// `boundary` on `nodes`.
    pub(crate) fn new(boundary: &Boundary, nodes: Vec<u32>) -> Self {
        Self {
            nodes,
            boundary: boundary.clone(),
        }
    }

    /// Whether it acts on a step that begins at `time`.
    pub(crate) fn acts(&self, time: f64) -> bool {
        time >= self.boundary.start && self.boundary.end.is_none_or(|end| time < end)
    }

    /// Components that it holds.
    pub(crate) fn holds<const D: usize>(&self) -> [bool; D] {
        match &self.boundary.motion {
            Motion::Velocity(components) => std::array::from_fn(|c| components[c].is_some()),
            Motion::Turn { .. } => [true; D],
        }
    }

    /// A component that both hold at some time, and not to the same velocity.
    pub(crate) fn contradicts<const D: usize>(&self, other: &Self) -> Option<usize> {
        let begins_before_end = |a: &Boundary, b: &Boundary| b.end.is_none_or(|end| a.start < end);
        let (a, b) = (&self.boundary, &other.boundary);
        if !begins_before_end(a, b) || !begins_before_end(b, a) || a.motion == b.motion {
            return None;
        }
        let held: [[bool; D]; 2] = [self.holds(), other.holds()];
        let same = |c: usize| match (&a.motion, &b.motion) {
            (Motion::Velocity(a), Motion::Velocity(b)) => a[c] == b[c],
            _ => false,
        };
        (0..D).find(|&c| held[0][c] && held[1][c] && !same(c))
    }

    /// Sets the held components of a velocity to their value at `time`.
    pub(crate) fn start<const D: usize>(
        &self,
        time: f64,
        position: &[f64; D],
        velocity: &mut [f64; D],
    ) {
        match &self.boundary.motion {
            Motion::Velocity(components) => {
                for (v, schedule) in velocity.iter_mut().zip(components) {
                    if let Some(schedule) = schedule {
                        *v = schedule.value(time);
                    }
                }
            }
            Motion::Turn {
                axis,
                point,
                angular_velocity,
            } => {
                let around = cross(axis, &sub(&pad(position), point));
                *velocity = truncate(&scale(angular_velocity.value(time), &around));
            }
        }
    }

    /// Sets the held components of the velocity of a node at `position` so
    /// that it ends where the exact motion takes it over `[time, time + drift]`.
    pub(crate) fn set<const D: usize>(
        &self,
        (time, drift): (f64, f64),
        position: &[f64; D],
        velocity: &mut [f64; D],
    ) {
        match &self.boundary.motion {
            Motion::Velocity(components) => {
                for (v, schedule) in velocity.iter_mut().zip(components) {
                    if let Some(schedule) = schedule {
                        *v = schedule.integral(time, time + drift) / drift;
                    }
                }
            }
            Motion::Turn {
                axis,
                point,
                angular_velocity,
            } => {
                let angle = angular_velocity.integral(time, time + drift);
                let arm = sub(&pad(position), point);
                // Rodrigues: the chord from here to the turned place.
                let around = cross(axis, &arm);
                let across = sub(&scale(dot(axis, &arm), axis), &arm);
                let chord: [f64; 3] = std::array::from_fn(|c| {
                    angle.sin() * around[c] + 2.0 * (0.5 * angle).sin().powi(2) * across[c]
                });
                *velocity = truncate(&scale(1.0 / drift, &chord));
            }
        }
    }
}
