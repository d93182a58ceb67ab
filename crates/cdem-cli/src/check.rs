//! `cdem check`: all checks of a run, then a summary.

use std::path::Path;

use cdem::{CollisionOverview, Overview, Simulation, significant};
use indicatif::HumanBytes;

use crate::drive::use_threads;
use crate::failure::{Failure, Outcome};
use crate::forecast::expected_time;
use crate::quantity::{columns, count, counted, quantity};
use crate::setup;
use crate::terminal::{print, strong, warn};

/// Largest number of blocks with a line of their own.
const BLOCKS: usize = 20;

pub(crate) fn check(scene: &Path) -> Result<Outcome, Failure> {
    let file = setup::read(scene)?;
    use_threads(None)?;
    let mut built = setup::build(&file)?;
    let overview = built.simulation.overview();
    print(format_args!("{}  {}", strong("scene"), scene.display()));
    let title = &built.simulation.scene().title;
    if !title.is_empty() {
        print(format_args!("       {title}"));
    }
    print("");
    for row in blocks(&overview) {
        print(format_args!("  {row}"));
    }
    print("");
    for row in figures(&overview, &mut built.simulation) {
        print(format_args!("  {row}"));
    }
    for warning in &built.warnings {
        warn(warning);
    }
    print("");
    print(match built.warnings.len() {
        0 => "the scene has no errors".to_owned(),
        1 => "the scene has no errors, but 1 warning".to_owned(),
        count => format!("the scene has no errors, but {count} warnings"),
    });
    Ok(Outcome::Done)
}

fn blocks(overview: &Overview) -> Vec<String> {
    let header = [
        "block",
        "material",
        "elements",
        "nodes",
        "mass",
        "inertia error",
        "mass matrix",
    ];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for block in overview.blocks.iter().take(BLOCKS) {
        let kind = format!("{:?}", block.mass_kind).to_lowercase();
        rows.push(vec![
            block.name.clone(),
            block.material.clone(),
            count(block.elements as u64),
            count(block.nodes as u64),
            mass(block.mass),
            percent(block.inertia_error),
            if block.fixed {
                "fixed".to_owned()
            } else {
                kind
            },
        ]);
    }
    rows.push(vec![
        format!("{} in total", count(overview.blocks.len() as u64)),
        String::new(),
        count(overview.elements as u64),
        count(overview.nodes as u64),
        mass(overview.blocks.iter().map(|block| block.mass).sum()),
    ]);
    let mut lines = columns(&rows);
    if overview.blocks.len() > BLOCKS {
        let more = overview.blocks.len() - BLOCKS;
        lines.insert(lines.len() - 1, format!("… and {more} more"));
    }
    lines
}

fn mass(kilogram: f64) -> String {
    format!("{} kg", significant(kilogram, 4))
}

/// Formats a fraction in per cent; round-off counts as zero.
fn percent(share: f64) -> String {
    let share = if share.abs() < 1e-9 { 0.0 } else { share };
    format!("{} %", significant(100.0 * share, 2))
}

fn figures(overview: &Overview, simulation: &mut Simulation) -> Vec<String> {
    let [smallest, largest] = overview.stable_step;
    let mut lines = vec![
        format!(
            "stable step   {} to {}, by element",
            quantity(smallest, "s"),
            quantity(largest, "s")
        ),
        format!(
            "coarse step   {}, number of steps {}",
            quantity(overview.step, "s"),
            count(overview.step_count)
        ),
    ];
    let levels: Vec<String> = overview
        .levels
        .iter()
        .enumerate()
        .filter(|(_, elements)| **elements > 0)
        .map(|(level, elements)| format!("{} on level {level}", count(*elements)))
        .collect();
    lines.push(format!("levels        {}", levels.join(", ")));
    lines.push(format!(
        "contacts      {} closed at the start",
        overview.contacts
    ));
    let foreseen = simulation.foresee_collision();
    lines.extend(foreseen.as_ref().map(collision));
    lines.push(format!(
        "memory        about {}",
        HumanBytes(overview.memory_bytes)
    ));
    lines.push(format!(
        "time          {}",
        expected_time(overview, simulation, foreseen.as_ref())
    ));
    lines
}

/// Describes the cost of one collision, which the trial steps do not include.
fn collision(collision: &CollisionOverview) -> String {
    let [then, now] = collision.updates_per_step;
    let what = match collision.elements {
        None => "cannot be refined with this `max_level`".to_owned(),
        Some(elements) => format!(
            "has {}, {} per coarse step instead of {}; \
             edges and faces take many times more",
            counted(elements as u64, "element"),
            counted(then, "update"),
            count(now)
        ),
    };
    format!(
        "refinement    for the impact of one corner at {}: block \"{}\" {what}",
        quantity(collision.speed, "m/s"),
        collision.block
    )
}
