//! What a run tells at its end.

use std::path::Path;
use std::time::Duration;

use cdem_io::results::{Status, Summary};
use console::Style;

use crate::quantity::{columns, count, quantity, significant};
use crate::run::{Observation, Times};
use crate::terminal::{print as line, strong};

/// Most blocks of which the velocities are told.
const BLOCKS: usize = 8;

pub(crate) struct Closing<'a> {
    pub(crate) dimension: usize,
    pub(crate) summary: &'a Summary,
    pub(crate) start: &'a Observation,
    pub(crate) end: &'a Observation,
    pub(crate) folder: &'a Path,
    pub(crate) profile: Option<&'a Times>,
}

/// Prints duration, contacts, energy, momentum, velocities, and where to look.
pub(crate) fn print(closing: &Closing<'_>) {
    line(headline(closing.summary));
    let sections = [
        effort(closing.summary),
        contacts(closing.summary, closing.end),
        energy(closing.start, closing.end),
        momentum(closing.start, closing.end),
    ];
    for section in sections.into_iter().flatten() {
        line(section);
    }
    line("");
    for row in velocities(closing) {
        line(format_args!("  {row}"));
    }
    line("");
    if let Some(times) = closing.profile {
        for row in profile(times) {
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
}

fn headline(summary: &Summary) -> String {
    let style = Style::new().bold();
    let word = match summary.status {
        Status::Done => style.green().apply_to("done"),
        Status::Stopped => style.red().apply_to("stopped"),
        Status::Interrupted => style.yellow().apply_to("interrupted"),
    };
    let when = format!(
        "{word} at t = {} after {} steps",
        quantity(summary.time, "s"),
        count(summary.steps),
    );
    match summary.status {
        // The error has said why, or the user knows.
        Status::Stopped | Status::Interrupted => when,
        Status::Done => format!("{when}: {}", summary.reason),
    }
}

fn effort(summary: &Summary) -> Vec<String> {
    vec![format!(
        "effort    {} on {} thread{}, {} element updates, {}",
        seconds(summary.wall_seconds),
        summary.threads,
        if summary.threads == 1 { "" } else { "s" },
        count(summary.element_updates),
        quantity(summary.updates_per_second, "updates/s"),
    )]
}

fn contacts(summary: &Summary, end: &Observation) -> Vec<String> {
    if summary.contacts_begun == 0 {
        return vec!["contacts  none".to_owned()];
    }
    vec![format!(
        "contacts  {} begun, {} last, deepest penetration {}",
        count(summary.contacts_begun),
        count(end.history.contacts),
        quantity(summary.max_penetration, "m"),
    )]
}

/// Where the energy that was there or came in has gone, in per cent of it.
fn energy(start: &Observation, end: &Observation) -> Vec<String> {
    let (start, end) = (&start.history, &end.history);
    let initial = start.kinetic_energy + start.strain_energy;
    let work = end.external_work + end.gravity_work;
    // Work that blocks do against loads and gravity counts as spent.
    let total = initial + work.max(0.0);
    if total.is_nan() || total <= 0.0 {
        return vec![];
    }
    let shares = [
        ("kinetic", end.kinetic_energy),
        ("strain", end.strain_energy),
        ("impact loss", end.impact_loss),
        ("friction loss", end.friction_loss),
        ("damping loss", end.damping_loss),
        ("fracture loss", end.fracture_loss),
        ("remesh loss", end.remesh_loss),
        ("correction loss", end.correction_loss),
        ("work done", (-work).max(0.0)),
    ];
    let text: Vec<String> = shares
        .iter()
        .filter(|(_, joule)| *joule != 0.0)
        .map(|(name, joule)| format!("{name} {}", percent(joule / total)))
        .collect();
    let mut lines = vec![format!(
        "energy    {}: {}",
        quantity(total, "J"),
        text.join(", ")
    )];
    let residual = percent(end.energy_residual / total);
    lines.push(format!("          residual of the ledger {residual}"));
    lines
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

/// Change of momentum that no external impulse explains, against Σ m|v|.
fn momentum(start: &Observation, end: &Observation) -> Vec<String> {
    let (from, to) = (&start.history, &end.history);
    let change: [f64; 3] =
        std::array::from_fn(|i| to.momentum[i] - from.momentum[i] - to.impulse[i]);
    let scale = [start, end]
        .map(|seen| {
            seen.blocks
                .iter()
                .map(|row| row.mass * norm(&row.velocity))
                .sum::<f64>()
        })
        .into_iter()
        .fold(0.0, f64::max);
    if scale == 0.0 {
        return vec![];
    }
    let error = significant(norm(&change) / scale, 2);
    vec![format!("momentum  unexplained change {error} of Σ m|v|")]
}

fn norm(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn velocities(closing: &Closing<'_>) -> Vec<String> {
    let Closing { start, end, .. } = closing;
    // In the plane, velocities have two components and turning one.
    let (moving, turning) = match closing.dimension {
        2 => (0..2, 2..3),
        _ => (0..3, 0..3),
    };
    let header = ["block", "start, m/s", "end, m/s", "turning, rad/s"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for (before, after) in start.blocks.iter().zip(&end.blocks).take(BLOCKS) {
        rows.push(vec![
            after.block.clone(),
            components(&before.velocity[moving.clone()]),
            components(&after.velocity[moving.clone()]),
            components(&after.angular_velocity[turning.clone()]),
        ]);
    }
    let mut lines = columns(&rows);
    if end.blocks.len() > BLOCKS {
        let more = end.blocks.len() - BLOCKS;
        lines.push(format!("… and {more} more: blocks.csv"));
    }
    lines
}

/// Components with four decimals; what rounds to zero has no sign.
fn components(vector: &[f64]) -> String {
    let rounded = vector.iter().map(|x| (x * 1e4).round() / 1e4 + 0.0);
    rounded
        .map(|x| format!("{x:9.4}"))
        .collect::<Vec<_>>()
        .join(" ")
}

fn profile(times: &Times) -> Vec<String> {
    let part = |name: &str, time: Duration| vec![name.to_owned(), seconds(time.as_secs_f64())];
    columns(&[
        part("reading, checking, building", times.setup),
        part("stepping", times.wall.saturating_sub(times.output)),
        part("writing rows and frames", times.output),
    ])
}

/// A duration with as much detail as it deserves.
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
