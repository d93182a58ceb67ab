//! How fast nodes may move in the coarse step to come: what the search for
//! contacts must reach.

use super::Run;
use crate::model::prescribed::Prescribed;
use crate::vector::{add_scaled, norm, scale, sub};

impl<const D: usize> Run<D> {
    /// Largest speed to reckon with in the step to come, m/s: `fastest` of now, and
    /// what the last step's accelerations, loads and gravity add, or what is
    /// prescribed.
    pub(super) fn fastest_ahead(&mut self, fastest: f64) -> f64 {
        let step = self.model.step;
        let gained = step * (self.acceleration() + self.change_of_forces());
        fastest.max(self.fastest_prescribed()) + gained
    }

    /// Largest speed of now, m/s.
    pub(super) fn fastest(&self) -> f64 {
        self.state.velocity.iter().map(norm).fold(0.0, f64::max)
    }

    /// Largest acceleration of the last kicks, m/s².
    fn acceleration(&self) -> f64 {
        let nodes = 0..self.state.velocity.len();
        let kicked = nodes.filter(|&node| self.impulses.interval[node] > 0.0);
        let of = |node: usize| {
            let change = sub(&self.state.velocity[node], &self.impulses.before[node]);
            norm(&change) / self.impulses.interval[node]
        };
        kicked.map(of).fold(0.0, f64::max)
    }

    /// Largest speed that prescribed motions ask for over the step, m/s.
    fn fastest_prescribed(&self) -> f64 {
        let (time, step) = (self.time(), self.model.step);
        let at = self.model.positions(&self.state);
        let acting = |motion: &&Prescribed| motion.acts(time);
        let mut fastest = 0.0_f64;
        for motion in self.model.prescribed.iter().filter(acting) {
            for &node in &motion.nodes {
                let mut wanted = [0.0; D];
                motion.set((time, step), &at.at(node), &mut wanted);
                fastest = fastest.max(norm(&wanted));
            }
        }
        fastest
    }

    /// Largest change of the acceleration by loads and gravity over the step,
    /// m/s²; from nothing at t = 0.
    fn change_of_forces(&mut self) -> f64 {
        let (start, end) = (self.time(), self.time() + self.model.step);
        let begins = self.state.number == 0;
        let gravity = |time| self.model.gravity_at(time);
        let before = if begins { [0.0; D] } else { gravity(start) };
        let heavier = norm(&sub(&gravity(end), &before));
        let at = self.model.positions(&self.state);
        let (load, mass) = (&mut self.impulses.load, self.model.inertia.mass());
        let mut loaded = Vec::new();
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
        let mut pushed = 0.0_f64;
        for node in loaded {
            let force = std::mem::replace(&mut load[node], [0.0; D]);
            pushed = pushed.max(norm(&scale(1.0 / mass[node], &force)));
        }
        heavier + pushed
    }
}
