//! Closing summary of a run.

use std::path::Path;
use std::time::Duration;

use cdem::output::{BlockRow, HistoryRow};
use cdem::{Stage, significant};
use cdem_io::results::{Status, Summary};
use console::Style;

use crate::drive::{Observation, Times};
use crate::quantity::{columns, count, counted, quantity};
use crate::terminal::{print as line, strong};

/// Largest number of blocks whose velocities are listed: those that are fastest at the end.
const BLOCKS: usize = 8;

/// Duration of each stage of the steps.
type StageTimes = [(Stage, Duration); Stage::ALL.len()];

pub(crate) struct Closing<'a> {
    pub(crate) dimension: usize,
    /// Mass of all blocks that can move, kg.
    pub(crate) mass: f64,
    pub(crate) summary: &'a Summary,
    pub(crate) start: &'a Observation,
    pub(crate) end: &'a Observation,
    /// Reference of the energy residual, J.
    pub(crate) exchanged: f64,
    pub(crate) folder: &'a Path,
    /// True if the run can be continued.
    pub(crate) goes_on: bool,
    pub(crate) profile: Option<(Times, StageTimes)>,
}

/// Prints duration, contacts, energy, momentum, velocities, and the paths of the results.
pub(crate) fn print(closing: &Closing<'_>) {
    line(headline(closing.summary));
    let (start, end) = (&closing.start.history, &closing.end.history);
    let possible = (2.0 * closing.mass * closing.exchanged).sqrt();
    let sections = [
        effort(closing.summary),
        contacts(closing.summary, closing.end),
        energy(start, end, closing.exchanged),
        momentum(start, end, possible),
    ];
    for section in sections.into_iter().flatten() {
        line(section);
    }
    line("");
    for row in velocities(closing) {
        line(format_args!("  {row}"));
    }
    line("");
    if let Some((times, stages)) = &closing.profile {
        for row in profile(times, stages) {
            line(format_args!("  {row}"));
        }
        line("");
    }
    let frames = closing.folder.join("frames.pvd");
    line(format_args!(
        "results   {}",
        strong(&closing.folder.display().to_string())
    ));
    line(format_args!(
        "ParaView  open {}, then click Apply",
        frames.display()
    ));
    if closing.goes_on {
        let folder = closing.folder.display();
        line(format_args!("resume    cdem resume {folder}"));
    }
}

fn headline(summary: &Summary) -> String {
    let style = Style::new().bold();
    let word = match summary.status {
        Status::Done => style.green().apply_to("done"),
        Status::Stopped => style.red().apply_to("stopped"),
        Status::Interrupted => style.yellow().apply_to("interrupted"),
    };
    let when = format!(
        "{word} at t = {} after {}",
        quantity(summary.time, "s"),
        counted(summary.steps, "step"),
    );
    match summary.status {
        // The reason is in an error message already, or the user knows it.
        Status::Stopped | Status::Interrupted => when,
        Status::Done => format!("{when}: {}", summary.reason),
    }
}

fn effort(summary: &Summary) -> Vec<String> {
    vec![format!(
        "effort    {}, {} element updates, {}",
        seconds(summary.wall_seconds),
        count(summary.element_updates),
        quantity(summary.updates_per_second, "updates/s"),
    )]
}

fn contacts(summary: &Summary, end: &Observation) -> Vec<String> {
    if summary.contacts_begun == 0 {
        return vec!["contacts  none".to_owned()];
    }
    let deepest = match summary.max_penetration {
        depth if depth < NO_PENETRATION => "none".to_owned(),
        depth => quantity(depth, "m"),
    };
    vec![format!(
        "contacts  {} begun, {} at the end, deepest penetration {deepest}",
        count(summary.contacts_begun),
        count(end.history.contacts),
    )]
}

/// Penetration up to which it is round-off of positions, m.
const NO_PENETRATION: f64 = 1e-12;

/// Fraction of the energy up to which a value is round-off of sums.
const ROUND_OFF: f64 = 1e-12;

/// Lists the distribution of the energy at the end, in per cent of the exchanged energy. Energy
/// that blocks have given back to loads and gravity counts as work done.
fn energy(start: &HistoryRow, end: &HistoryRow, exchanged: f64) -> Vec<String> {
    if exchanged <= 0.0 || end.energy_residual.is_nan() {
        return vec![];
    }
    let there = start.kinetic_energy + start.strain_energy;
    let shares = [
        ("kinetic", end.kinetic_energy),
        ("strain", end.strain_energy),
        ("impact loss", end.impact_loss),
        ("friction loss", end.friction_loss),
        ("damping loss", end.damping_loss),
        ("fracture loss", end.fracture_loss),
        ("remesh loss", end.remesh_loss),
        ("correction loss", end.correction_loss),
        (
            "work done",
            exchanged - there - end.external_work - end.gravity_work,
        ),
    ];
    let text: Vec<String> = shares
        .iter()
        .filter(|(_, joule)| (joule / exchanged).abs() >= ROUND_OFF)
        .map(|(name, joule)| format!("{name} {}", percent(joule / exchanged)))
        .collect();
    let mut lines = vec![format!(
        "energy    {}: {}",
        quantity(exchanged, "J"),
        text.join(", ")
    )];
    let residual = percent(end.energy_residual / exchanged);
    lines.push(format!(
        "          residual of the energy ledger {residual}"
    ));
    lines
}

/// Formats a fraction in per cent, with three digits at most and no exponent.
fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "0 %".to_owned(),
        small if small.abs() < 0.001 => "< 0.001 %".to_owned(),
        large if large.abs() >= 1000.0 => format!("{large:.0} %"),
        other => format!("{} %", significant(other, 3)),
    }
}

/// Returns the change of momentum that no external impulse explains. The reference is the larger of
/// that impulse and the momentum √(2mE) that would be `possible` if all the energy moved the mass,
/// because blocks that spin or vibrate have no momentum of their own.
fn momentum(start: &HistoryRow, end: &HistoryRow, possible: f64) -> Vec<String> {
    let impulse: [f64; 3] = std::array::from_fn(|i| end.impulse[i] - start.impulse[i]);
    let unexplained: [f64; 3] =
        std::array::from_fn(|i| end.momentum[i] - start.momentum[i] - impulse[i]);
    let scale = norm(&impulse).max(possible);
    if scale.is_nan() || scale <= 0.0 {
        return vec![];
    }
    let share = percent(norm(&unexplained) / scale);
    vec![format!(
        "momentum  not explained by external forces: {share}"
    )]
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn velocities(closing: &Closing<'_>) -> Vec<String> {
    let Closing { start, end, .. } = closing;
    // In 2-D, velocities have two components and angular velocities one.
    let (moving, turning) = match closing.dimension {
        2 => (0..2, 2..3),
        _ => (0..3, 0..3),
    };
    let header = ["block", "start, m/s", "end, m/s", "rotation, rad/s"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    let fastest = fastest(&end.blocks, BLOCKS);
    let told = start.blocks.iter().zip(&end.blocks).zip(&fastest);
    for ((before, after), _) in told.filter(|(_, told)| **told) {
        rows.push(vec![
            after.block.clone(),
            components(&before.velocity[moving.clone()]),
            components(&after.velocity[moving.clone()]),
            components(&after.angular_velocity[turning.clone()]),
        ]);
    }
    let mut lines = columns(&rows);
    if end.blocks.len() > BLOCKS {
        lines.push(format!(
            "the {BLOCKS} fastest of {} blocks; all are in blocks.csv",
            count(end.blocks.len() as u64)
        ));
    }
    lines
}

/// Marks the `most` fastest blocks; among equals, the first.
fn fastest(blocks: &[BlockRow], most: usize) -> Vec<bool> {
    let speed = |&block: &usize| norm(&blocks[block].velocity);
    let mut order: Vec<usize> = (0..blocks.len()).collect();
    order.sort_by(|a, b| speed(b).total_cmp(&speed(a)));
    let mut told = vec![false; blocks.len()];
    for block in order.into_iter().take(most) {
        told[block] = true;
    }
    told
}

/// Formats components with four decimals; a component that rounds to zero has no sign.
fn components(vector: &[f64]) -> String {
    let text = |x: &f64| match (x * 1e4).round() / 1e4 + 0.0 {
        rounded if rounded.abs() < 1e9 => format!("{rounded:9.4}"),
        _ => format!("{x:9.4e}"),
    };
    vector.iter().map(text).collect::<Vec<_>>().join(" ")
}

/// Lists the durations of this process and their fractions.
fn profile(times: &Times, stages: &StageTimes) -> Vec<String> {
    let whole = times.setup + times.wall;
    let share = |name: &str, time: Duration| {
        let share = time.as_secs_f64() / whole.as_secs_f64().max(f64::MIN_POSITIVE);
        vec![name.to_owned(), seconds(time.as_secs_f64()), percent(share)]
    };
    let stepping = times.wall.saturating_sub(times.output);
    let of_stages = stages.iter().map(|(_, time)| *time).sum();
    let mut rows = vec![
        share("all up to the last step", whole),
        share("setup", times.setup),
        share("steps", stepping),
    ];
    let stages = stages.iter().filter(|(_, time)| !time.is_zero());
    rows.extend(stages.map(|(stage, time)| share(&format!("  {}", stage.name()), *time)));
    rows.push(share("  other", stepping.saturating_sub(of_stages)));
    rows.push(share("output", times.output));
    columns(&rows)
}

/// Formats a duration with a suitable number of digits.
fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => quantity(s, "s"),
        s if s < 3600.0 => format!("{} min {:02.0} s", (s / 60.0).floor(), s % 60.0),
        s => format!(
            "{} h {:02.0} min",
            (s / 3600.0).floor(),
            (s % 3600.0) / 60.0
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(kinetic_energy: f64, momentum: f64, impulse: f64) -> HistoryRow {
        HistoryRow {
            kinetic_energy,
            momentum: [momentum, 0.0, 0.0],
            impulse: [impulse, 0.0, 0.0],
            ..HistoryRow::default()
        }
    }

    #[test]
    fn momentum_of_a_block_that_spins_is_held_against_its_energy() {
        // 2 kg with 100 J could have 20 N s, so 2e-15 N s is round-off.
        let told = momentum(&row(100.0, 0.0, 0.0), &row(100.0, 2e-15, 0.0), 20.0);
        assert!(told[0].ends_with("forces: < 0.001 %"), "{told:?}");
    }

    #[test]
    fn a_cycle_that_ends_at_rest_is_held_against_what_went_through() {
        let end = HistoryRow {
            external_work: 1e-3,
            energy_residual: -1e-3,
            ..HistoryRow::default()
        };
        let told = energy(&HistoryRow::default(), &end, 100.0).join("\n");
        assert!(told.contains("100 J: work done 100 %"), "{told}");
        assert!(told.contains("ledger -0.001 %"), "{told}");
    }

    #[test]
    fn shares_are_told_without_exponents() {
        for (share, text) in [
            (0.0, "0 %"),
            (5.7e-13, "< 0.001 %"),
            (-9.9e-6, "< 0.001 %"),
            (1.234_5e-5, "0.00123 %"),
            (-0.123_45, "-12.3 %"),
            (0.999_96, "100 %"),
            (12_345.678, "1234568 %"),
        ] {
            assert_eq!(percent(share), text);
        }
    }

    #[test]
    fn the_fastest_blocks_are_told_in_their_order() {
        let block = |speed: f64| BlockRow {
            velocity: [0.0, speed, 0.0],
            ..BlockRow::default()
        };
        let blocks = [1.0, -5.0, 0.0, 3.0, 3.0].map(block);
        assert_eq!(fastest(&blocks, 3), [false, true, false, true, true]);
        assert_eq!(fastest(&blocks, 2), [false, true, false, true, false]);
        assert_eq!(fastest(&blocks, 9), [true; 5]);
    }

    #[test]
    fn the_impulse_of_the_first_row_was_there_before() {
        let told = momentum(&row(0.0, 1.0, 1.0), &row(0.0, 4.0, 4.0), 0.0);
        assert!(told[0].ends_with("forces: 0 %"), "{told:?}");
        let told = momentum(&row(0.0, 1.0, 1.0), &row(0.0, 4.0, 3.0), 0.0);
        assert!(told[0].ends_with("forces: 50 %"), "{told:?}");
    }

    #[test]
    fn nothing_is_said_of_what_does_not_move() {
        assert!(momentum(&row(0.0, 0.0, 0.0), &row(0.0, 0.0, 0.0), 0.0).is_empty());
    }
}
