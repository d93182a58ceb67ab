//! Bounds on the speeds of the blocks in the next coarse step, for the contact search.

use crate::math::vector::{add_scaled, dot, norm, scale, sub};
use crate::model::block_max::BlockMax;
use crate::model::boundary::{PrescribedMotion, VelocityTime};
use crate::model::kinematics::SPEED_OF_LIGHT;
use crate::model::{Model, State};
use crate::step::Run;

/// Bounds for the next coarse step.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpeedBounds {
    /// Upper bound of the nodal speeds of each block, m/s.
    speeds: Vec<f64>,
    /// Squares of the largest nodal speed of each block, m²/s², and of the largest acceleration in
    /// its last kick, m²/s⁴.
    squares: BlockMax<2>,
    /// Largest change of acceleration of each block by loads, or if its steady forces end, m/s²; and the nodes with loads.
    load_acceleration: Vec<f64>,
    loaded: Vec<usize>,
}

impl SpeedBounds {
    /// Returns the upper bound of the nodal speeds of each block, m/s.
    pub(crate) fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Returns true if all are below the speed of light. A run that has diverged cannot be searched
    /// for contacts; it is stopped after the step. Without contacts there are no bounds.
    pub(crate) fn is_physical(&self) -> bool {
        self.speeds.iter().all(|&speed| speed < SPEED_OF_LIGHT)
    }
}

impl<const D: usize> Run<D> {
    /// Bounds the speeds by those of now, or the prescribed ones, plus the gain over the step from
    /// the last acceleration and the changes of gravity and loads.
    pub(crate) fn bound_speeds(&mut self) {
        let ending = self.accelerations_of_ending_forces();
        let next = NextStep {
            model: &self.model,
            state: &self.state,
            time: self.time(),
        };
        let step = next.model.step;
        let heavier = next.change_of_gravity();
        let (velocity, last_kick) = (&next.state.velocity, &next.state.last_kick);
        let (before, interval) = (&last_kick.velocity_before, &last_kick.interval);
        let of_node = |node: u32| {
            let n = node as usize;
            let change = sub(&velocity[n], &before[n]);
            let gain = if interval[n] > 0.0 {
                dot(&change, &change) / (interval[n] * interval[n])
            } else {
                0.0
            };
            [dot(&velocity[n], &velocity[n]), gain]
        };
        let SpeedBounds {
            speeds,
            squares,
            load_acceleration,
            loaded,
        } = &mut self.workspace.speed_bounds;
        let blocks = next.model.blocks.len();
        let found = squares.find(&next.model.block_of, blocks, of_node);
        speeds.clear();
        speeds.extend(found.iter().map(|[speed, _]| speed.sqrt()));
        next.raise_to_prescribed(speeds);
        next.add_changes_of_loads(&mut self.workspace.impulses.load, loaded);
        next.take_load_accelerations(&mut self.workspace.impulses.load, loaded, load_acceleration);
        for (block, acceleration) in ending {
            let largest = &mut load_acceleration[block];
            *largest = largest.max(acceleration);
        }
        let added = squares.of_blocks().iter().zip(&*load_acceleration);
        for (speed, ([_, gain], load_acceleration)) in speeds.iter_mut().zip(added) {
            *speed += step * (gain.sqrt() + heavier + load_acceleration);
        }
    }
}

/// The coarse step that begins at `time`, s.
struct NextStep<'a, const D: usize> {
    model: &'a Model<D>,
    state: &'a State<D>,
    time: f64,
}

impl<const D: usize> NextStep<'_, D> {
    /// Raises the speeds to those that prescribed motions require over the step.
    fn raise_to_prescribed(&self, speeds: &mut [f64]) {
        let at = self.model.positions(self.state);
        let drift = VelocityTime::Drift {
            start: self.time,
            duration: self.model.step,
        };
        let acting = |motion: &&PrescribedMotion| motion.acts(self.time);
        for motion in self.model.boundaries.iter().filter(acting) {
            for &node in &motion.nodes {
                let mut wanted = [0.0; D];
                motion.set_velocity(drift, &at.at(node), &mut wanted);
                let speed = &mut speeds[self.model.block_of[node as usize] as usize];
                let wanted = norm(&wanted);
                // The comparison keeps a NaN; `max` would not.
                if wanted > *speed {
                    *speed = wanted;
                }
            }
        }
    }

    /// Returns the change of gravity over the step, m/s²; at t = 0 gravity counts as new.
    fn change_of_gravity(&self) -> f64 {
        let before = if self.state.number == 0 {
            [0.0; D]
        } else {
            self.model.gravity_at(self.time)
        };
        norm(&sub(
            &self.model.gravity_at(self.time + self.model.step),
            &before,
        ))
    }

    /// Adds the changes of the loads over the step to `load`, N; at t = 0 all loads count as new.
    /// Lists the nodes with loads.
    fn add_changes_of_loads(&self, load: &mut [[f64; D]], loaded: &mut Vec<usize>) {
        let (start, end) = (self.time, self.time + self.model.step);
        let begins = self.state.number == 0;
        let at = self.model.positions(self.state);
        loaded.clear();
        for surface in &self.model.loads {
            if !begins && !surface.changes(start, end) {
                continue;
            }
            for (time, sign) in [(start, -1.0), (end, 1.0)] {
                if sign > 0.0 || !begins {
                    let push = |node: u32, force: [f64; D]| {
                        add_scaled(&mut load[node as usize], sign, &force);
                        loaded.push(node as usize);
                    };
                    surface.forces(time, |node| at.at(node), push);
                }
            }
        }
    }

    /// Finds the largest acceleration of each block by `load`, m/s², and clears it at the nodes
    /// with loads.
    fn take_load_accelerations(
        &self,
        load: &mut [[f64; D]],
        loaded: &[usize],
        load_acceleration: &mut Vec<f64>,
    ) {
        let mass = self.model.inertia.mass();
        load_acceleration.clear();
        load_acceleration.resize(self.model.blocks.len(), 0.0);
        for &node in loaded {
            let force = std::mem::replace(&mut load[node], [0.0; D]);
            let largest = &mut load_acceleration[self.model.block_of[node] as usize];
            *largest = largest.max(norm(&scale(1.0 / mass[node], &force)));
        }
    }
}
