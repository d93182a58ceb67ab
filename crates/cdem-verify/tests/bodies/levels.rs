//! Time levels: their savings, and conservation of energy.

use std::time::Instant;

use cdem::Simulation;
use cdem::mesh::ElementKind;
use cdem::scene::{Geometry, Mass, Schedule};
use cdem_verify::{Case, Random, fit, load};

use crate::shared::{LameMode, displacements};

fn energy(simulation: &mut Simulation) -> f64 {
    let row = simulation.history();
    row.kinetic_energy + row.strain_energy
}

#[test]
fn slivers_alone_pay_for_their_small_steps() {
    let flight = |step: Option<f64>| {
        let mut case = load("slivers");
        case.scene.time.step = step;
        let mode = LameMode::new(&case);
        let mut simulation = mode.start(&mut case);
        let clock = Instant::now();
        while !simulation.finished() {
            simulation.step().expect("small vibrations go on");
        }
        let seconds = clock.elapsed().as_secs_f64();
        let error = mode.error(&mut simulation);
        (simulation, seconds, error)
    };
    let (mut levels, seconds, error) = flight(None);
    let overview = levels.overview();
    let smallest = 0.8 * overview.stable_step[0];
    let (mut single, seconds_single, error_single) = flight(Some(smallest));
    assert_eq!(single.overview().levels.len(), 1);
    let updates = single.element_updates() as f64 / levels.element_updates() as f64;
    println!(
        "levels {:?}: {updates:.1} × fewer element updates, {:.1} × less time ({seconds:.2} s), \
         errors {error:.2e} and {error_single:.2e} at the smallest step",
        overview.levels,
        seconds_single / seconds
    );
    let mut apart = [0.0; 2];
    for ((_, u), (_, v)) in displacements(&mut levels)
        .iter()
        .zip(displacements(&mut single))
    {
        for c in 0..2 {
            apart[0] += (u[c] - v[c]).powi(2);
            apart[1] += v[c].powi(2);
        }
    }
    let apart = (apart[0] / apart[1]).sqrt();
    println!("the two answers differ by {apart:.2e}");
    assert!(updates > 5.0);
    // Both are second order. The coarse step of the levels is the Courant step of the well-shaped
    // elements, whose error is that against the exact answer.
    assert!(apart < 5e-3 && error < 5e-3 && error_single < 5e-3);
}

/// Returns `count` energies during `steps` steps, over the first energy.
fn energies(simulation: &mut Simulation, steps: u64, count: u64) -> Vec<f64> {
    let start = energy(simulation);
    let mut all = Vec::new();
    for number in 1..=steps {
        simulation.step().expect("small vibrations go on");
        if number % (steps / count) == 0 {
            all.push(energy(simulation) / start);
        }
    }
    all
}

/// Returns the change of the energy by its linear trend, and its extremes.
fn trend(energies: &[f64]) -> (f64, [f64; 2]) {
    let points: Vec<_> = energies
        .iter()
        .enumerate()
        .map(|(i, &e)| (i as f64, e))
        .collect();
    let change = fit::slope(&points) * points.len() as f64;
    let low = energies.iter().copied().fold(f64::INFINITY, f64::min);
    let high = energies.iter().copied().fold(0.0, f64::max);
    (change, [low, high])
}

fn long_vibration(steps: u64) {
    let mut case = load("graded-block");
    case.scene.time.end = 1e3;
    let mode = LameMode::new(&case);
    let mut simulation = mode.start(&mut case);
    let levels = simulation.overview().levels;
    let energies = energies(&mut simulation, steps, 1000);
    let (change, [low, high]) = trend(&energies);
    println!(
        "levels {levels:?}, {steps} steps at safety 0.9: energy {low:.4} … {high:.4}, trend {change:.1e}"
    );
    assert!(levels.len() >= 3);
    // The energy of a mode at synchronised states oscillates by (ωΔt)²/8. The highest modes of this
    // coarse mesh take a small part in the vibration.
    assert!(low > 0.98 && high < 1.02, "band");
    assert!(change.abs() < 2e-3, "trend");
}

#[test]
fn a_vibration_on_several_levels_keeps_its_energy() {
    long_vibration(20_000);
}

#[test]
#[ignore = "slow study: a million coarse steps"]
fn a_vibration_on_several_levels_keeps_its_energy_for_a_million_steps() {
    long_vibration(1_000_000);
}

/// Runs a case to its end. Returns the kinetic energy over the strain energy.
fn motion_at_rest(case: &Case) -> f64 {
    let mut simulation = case.start();
    assert!(simulation.overview().levels.len() >= 3);
    while !simulation.finished() {
        simulation.step().expect("it rests");
    }
    let end = simulation.history();
    println!(
        "kinetic energy {:.1e} J, strain energy {:.3e} J",
        end.kinetic_energy, end.strain_energy
    );
    (end.kinetic_energy / end.strain_energy).abs()
}

/// Velocities of round-off: the square of 1e-13 of the speed of the first vibration.
const AT_REST: f64 = 1e-26;

/// Without steady forces at the borders of levels, its kinetic energy is 7e-4 of the strain energy,
/// below zero, for ever.
#[test]
fn a_graded_block_comes_to_rest() {
    assert!(motion_at_rest(&load("rest-under-levels")) < AT_REST);
}

#[test]
#[ignore = "slow study: a hundred graded blocks"]
fn any_graded_block_comes_to_rest() {
    let mut random = Random(23);
    for _ in 0..100 {
        let mut case = load("rest-under-levels");
        let material = &mut case.scene.material[0];
        material.young_modulus = 10.0_f64.powf(random.between(8.0, 11.0));
        material.density = random.between(1000.0, 8000.0);
        material.poisson_ratio = random.between(0.0, 0.4);
        // The same number of periods, and the same decay in each.
        let faster = (material.young_modulus / material.density / 4e5).sqrt();
        material.damping.mass *= faster;
        case.scene.time.end /= faster;
        let angle = random.between(0.0, std::f64::consts::TAU);
        let pull = 10.0_f64.powf(random.between(-1.0, 2.0));
        case.scene.gravity = Schedule::Constant(vec![pull * angle.sin(), -pull * angle.cos()]);
        let block = &mut case.scene.block[0];
        block.rotate.angle = random.between(0.0, std::f64::consts::TAU);
        let motion = motion_at_rest(&case);
        assert!(motion < AT_REST, "{motion:e} of {:?}", case.scene);
    }
}

/// Steady forces act at the rates of the nodes, not all at one instant.
#[test]
fn a_spinning_graded_block_keeps_its_momenta() {
    let mut case = load("graded-block");
    case.scene.time.end = 1e3;
    let block = &mut case.scene.block[0];
    block.angular_velocity = vec![100.0];
    block.velocity = vec![3.0, -2.0];
    let mut simulation = case.start();
    let start = simulation.history();
    let mut worst = [0.0_f64; 2];
    for number in 0..6_000 {
        simulation.step().expect("it spins");
        if number % 10 == 0 {
            let now = simulation.history();
            let change = (0..3).map(|c| now.momentum[c] - start.momentum[c]);
            let turn = now.angular_momentum[2] - start.angular_momentum[2];
            worst[0] = change.fold(worst[0], |worst, change| worst.max(change.abs()));
            worst[1] = worst[1].max(turn.abs());
        }
    }
    let scale = [start.momentum[0].abs(), start.angular_momentum[2].abs()];
    println!(
        "changes of momentum {:.1e}, of angular momentum {:.1e}",
        worst[0] / scale[0],
        worst[1] / scale[1]
    );
    assert!(worst[0] < 1e-12 * scale[0] && worst[1] < 1e-11 * scale[1]);
}

/// Builds a random pair of joined blocks of different element sizes.
fn joined_pair(random: &mut Random) -> Case {
    let mut case = load("joined-blocks");
    let shapes = [ElementKind::Tri3, ElementKind::Quad4];
    for block in 0..2 {
        let across = random.whole(1, 3);
        let along = across * random.whole(1, 3);
        let shape = shapes[random.whole(0, 1)];
        case.divide(["left", "right"][block], &[along, across], shape);
        let Geometry::Box { min, max, .. } = &mut case.scene.block[block].geometry else {
            panic!("the blocks are boxes");
        };
        let shift = if block == 0 {
            0.0
        } else {
            random.between(-0.2, 0.2)
        };
        let height = random.between(0.3, 0.7);
        (min[1], max[1]) = (shift, shift + height);
        case.scene.block[block].mass = [Mass::Auto, Mass::Lumped][random.whole(0, 1)];
    }
    case.scene.material[1].young_modulus *= 10.0_f64.powf(random.between(0.0, 1.0));
    case.scene.time.safety = random.between(0.5, 0.9);
    case.scene.time.end = 1e3;
    case
}

/// Runs a pair. Returns its number of levels and the trend of its energy, or the failure.
fn vibrate(case: &Case, steps: u64) -> Result<(usize, f64), String> {
    let mut simulation = case.start();
    let levels = simulation.overview().levels;
    // The first steps include first touch at t = 0 and its impact loss.
    for _ in 0..8 {
        simulation.step().map_err(|error| error.to_string())?;
    }
    let energies = energies(&mut simulation, steps, 200);
    let (change, [low, high]) = trend(&energies);
    let parted = simulation.ended_contacts().len();
    // A mean above 1.05 of the start would be growth. Single values oscillate more: at safety 0.9
    // by (ωΔt)²/8 of the energy of a vibration.
    if change > 0.05 || high > 1.2 || parted > 0 {
        return Err(format!(
            "levels {levels:?}, energy {low:.3} … {high:.3}, trend {change:.1e}, {parted} parted"
        ));
    }
    Ok((levels.len(), change))
}

/// Runs the pairs on all processors, independently of each other.
fn joined_pairs(pairs: usize, steps: u64) {
    let mut random = Random(1);
    let cases: Vec<Case> = (0..pairs).map(|_| joined_pair(&mut random)).collect();
    let workers = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let results: Vec<Result<(usize, f64), String>> = std::thread::scope(|scope| {
        let shares: Vec<_> = cases
            .chunks(pairs.div_ceil(workers))
            .map(|share| {
                let run = |case: &Case| vibrate(case, steps);
                scope.spawn(move || share.iter().map(run).collect::<Vec<_>>())
            })
            .collect();
        let ended = shares.into_iter();
        ended
            .flat_map(|share| share.join().expect("a share ends"))
            .collect()
    });
    let mut failed = Vec::new();
    let (mut worst, mut deepest) = (f64::NEG_INFINITY, 0);
    for (pair, result) in results.iter().enumerate() {
        match result {
            Ok((levels, change)) => {
                worst = worst.max(*change);
                deepest = deepest.max(*levels);
            }
            Err(why) => failed.push(format!("pair {pair}: {why}")),
        }
    }
    println!(
        "{pairs} joined pairs, {steps} steps, up to {deepest} levels: largest trend of the energy {worst:.1e}"
    );
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(deepest >= 3, "the pairs must need levels");
}

#[test]
fn levels_joined_by_contact_are_stable() {
    joined_pairs(20, 2_000);
}

#[test]
#[ignore = "slow study: 300 pairs for 1e5 steps"]
fn levels_joined_by_contact_are_stable_for_long() {
    joined_pairs(300, 100_000);
}
