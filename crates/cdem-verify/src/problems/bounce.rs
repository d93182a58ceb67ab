//! An elastic block that bounces on a floor.

use crate::plot::{Plot, Style};
use crate::problem::Findings;
use crate::{Balance, load, run};

/// Height of the centre before the drop, and at rest on the floor, m.
const DROP: f64 = 0.8;
const FLAT: f64 = 0.5;

/// V17: an elastic block never bounces back to the height of the drop.
pub(super) fn bouncing_block() -> Findings {
    let mut findings = Findings::default();
    let mut simulation = load("bouncing-block").start();
    let mut balance = Balance::new(&mut simulation);
    let (mut peaks, mut path) = (Vec::new(), Vec::new());
    let mut last = [DROP, DROP];
    run(&mut simulation, |simulation| {
        balance.look(simulation);
        let height = simulation.block_rows()[0].position[1];
        if last[1] > last[0] && last[1] > height && last[1] > FLAT + 0.02 {
            peaks.push(last[1]);
        }
        last = [last[1], height];
        path.push([simulation.time(), height - FLAT]);
    });
    findings
        .figure("bounces within 3 s", peaks.len() as f64)
        .between(
            6.0,
            f64::INFINITY,
            "the longest bounce lasts as long as a free fall of 0.3 m and back, 0.5 s",
        );
    for (k, peak) in peaks.iter().enumerate().take(4) {
        findings
            .figure(
                format!("height of bounce {}, over that of the drop", k + 1),
                (peak - FLAT) / (DROP - FLAT),
            )
            .at_most(1.0, "no bounce reaches the height of the drop");
    }
    findings
        .figure(
            "largest excess over the energy at the start, over the energy exchanged",
            balance.growth.max(0.0),
        )
        .at_most(
            1e-12,
            "the loss of the first touch is far above the residual; round-off",
        );
    findings.energy(str::to_owned, &balance);
    let end = path.last().map_or(0.0, |row| row[0]);
    let drop = vec![[0.0, DROP - FLAT], [end, DROP - FLAT]];
    let plot = Plot::new("time, s", "height of the centre over rest, m")
        .with("cdem", Style::Line, path)
        .with("the drop", Style::Known, drop);
    findings.plots.push(plot);
    findings
}
