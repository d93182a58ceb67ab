//! Checks that hold in every run: momentum, angular momentum and energy.

use cdem::Simulation;
use cdem::output::{BlockRow, HistoryRow};

/// Worst errors in momentum, angular momentum and energy of a run so far.
#[derive(Clone, Debug)]
pub struct Balance {
    start: HistoryRow,
    /// Σ m|v|, N·s, and Σ m|x − x_c||v|, N·m·s, of the blocks at the start.
    scale: [f64; 2],
    /// Largest energy exchanged, and worst residual and growth, J.
    exchanged: f64,
    unbalanced: [f64; 2],
    /// Least K + U less all work done so far, and its largest rise above an earlier value, J.
    least: f64,
    raised: f64,
    /// Change of momentum less the impulse of external forces, over Σ m|v|.
    pub momentum: f64,
    /// Change of angular momentum about the origin, less the change that position corrections
    /// report, over Σ m|x − x_c||v|. Meaningful only without external forces.
    pub angular_momentum: f64,
    /// |energy residual| over the largest energy exchanged so far.
    pub residual: f64,
    /// K + U less all work done on the blocks, above its value at the start, over the energy
    /// exchanged. It is ≤ 0 except for the residual.
    pub growth: f64,
    /// K + U less all work done, above its least value so far, over the energy exchanged. This
    /// shows a gain that an earlier loss would hide in `growth`.
    pub rise: f64,
}

impl Balance {
    /// Begins at the present state. The scales of motion are taken from the blocks now.
    pub fn new(simulation: &mut Simulation) -> Self {
        Self {
            scale: scales(&simulation.block_rows()),
            start: simulation.history(),
            exchanged: f64::MIN_POSITIVE,
            unbalanced: [0.0, f64::NEG_INFINITY],
            least: f64::INFINITY,
            raised: 0.0,
            momentum: 0.0,
            angular_momentum: 0.0,
            residual: 0.0,
            growth: f64::NEG_INFINITY,
            rise: 0.0,
        }
    }

    /// Updates the errors from the present state and returns its history row.
    pub fn look(&mut self, simulation: &mut Simulation) -> HistoryRow {
        let row = simulation.history();
        let corrected = simulation.corrections().angular_momentum;
        let mut drift = [0.0_f64; 2];
        for c in 0..3 {
            let impulse = row.impulse[c] - self.start.impulse[c];
            let momentum = row.momentum[c] - self.start.momentum[c] - impulse;
            let turning = row.angular_momentum[c] - self.start.angular_momentum[c] - corrected[c];
            drift = [drift[0].max(momentum.abs()), drift[1].max(turning.abs())];
        }
        self.momentum = self.momentum.max(drift[0] / self.scale[0]);
        self.angular_momentum = self.angular_momentum.max(drift[1] / self.scale[1]);
        let exchanged = [
            self.start.kinetic_energy + self.start.strain_energy,
            row.external_work.abs(),
            row.gravity_work.abs(),
        ];
        self.exchanged = exchanged.into_iter().fold(self.exchanged, f64::max);
        let energy = |row: &HistoryRow| {
            row.kinetic_energy + row.strain_energy - row.external_work - row.gravity_work
        };
        let [residual, growth] = &mut self.unbalanced;
        *residual = residual.max(row.energy_residual.abs());
        *growth = growth.max(energy(&row) - energy(&self.start));
        self.least = self.least.min(energy(&row));
        self.raised = self.raised.max(energy(&row) - self.least);
        self.rise = self.raised / self.exchanged;
        self.residual = *residual / self.exchanged;
        self.growth = *growth / self.exchanged;
        row
    }
}

fn scales(rows: &[BlockRow]) -> [f64; 2] {
    let mass: f64 = rows.iter().map(|row| row.mass).sum();
    let centre: [f64; 3] = std::array::from_fn(|c| {
        rows.iter()
            .map(|row| row.mass * row.position[c])
            .sum::<f64>()
            / mass
    });
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut scale = [0.0; 2];
    for row in rows {
        let arm = std::array::from_fn(|c| row.position[c] - centre[c]);
        scale[0] += row.mass * length(row.velocity);
        scale[1] += row.mass * length(row.velocity) * length(arm);
    }
    scale.map(|scale| if scale > 0.0 { scale } else { 1.0 })
}
