//! Contact history: what a contact has done so far, a row of `contacts.csv`.

use serde::{Deserialize, Serialize};

use crate::contact::constraint::contact_constraint::shear_norm;
use crate::contact::surface::contact_kind::ContactKind;

/// Contact history of a contact point so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct ContactHistory {
    pub(crate) kind: ContactKind,
    /// Time of the beginning, s.
    pub(crate) time_on: f64,
    /// Time of the end, s; `None` while the contact lasts.
    pub(crate) time_off: Option<f64>,
    /// Position of the contact, m.
    pub(crate) position: [f64; 3],
    /// Tributary area, m².
    pub(crate) area: f64,
    /// Normal impulse of the present coarse step, N·s.
    pub(crate) step_impulse: f64,
    /// Impact loss of the present coarse step by normal impulses, J.
    pub(crate) step_loss: f64,
    /// Largest normal impulse of a coarse step over the step, N.
    pub(crate) peak_normal_force: f64,
    /// Sum of normal impulses, N·s.
    pub(crate) normal_impulse: f64,
    /// Path length of shear impulses, N·s.
    pub(crate) shear_impulse: f64,
    /// Path length of the slip, m.
    pub(crate) slip: f64,
    /// Halvings of its elements.
    pub(crate) level: u32,
    pub(crate) blocks: [u32; 2],
}

impl ContactHistory {
    /// Returns the history of a contact that ends at `time`, s.
    pub(crate) fn ended(&self, time: f64) -> Self {
        Self {
            time_off: Some(time),
            ..self.clone()
        }
    }

    /// Adds an impulse in the frame, N·s, less the part `before` that was added already.
    pub(crate) fn count<const D: usize>(&mut self, before: &[f64; D], impulse: &[f64; D]) {
        self.step_impulse += impulse[0] - before[0];
        self.normal_impulse += impulse[0] - before[0];
        self.shear_impulse += shear_norm(impulse) - shear_norm(before);
    }

    /// Ends a coarse step of `step` seconds.
    pub(crate) fn end_step(&mut self, step: f64) {
        self.peak_normal_force = self.peak_normal_force.max(self.step_impulse / step);
        self.step_impulse = 0.0;
        self.step_loss = 0.0;
    }
}
