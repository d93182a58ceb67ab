//! Stress tests of the time levels: level changes must not add energy, nor must the steps of joined
//! blocks (design, section 3).

#![allow(clippy::print_stdout)] // the tests report figures

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::mesh::{ElementKind, tests};
use crate::model::Model;
use crate::refinement::dimension::PLANE;
use crate::scene::{
    Block, Boundary, BoundaryTarget, ContactModel, Damping, Geometry, Mass, Material,
    MaterialModel, Motion, Scene, Schedule,
};
use crate::step::Run;
use fastrand::Rng;

/// Builds a scene in which the wave speed, m/s, and the length of the blocks, m, are 1.
fn scene(blocks: Vec<Block>, safety: f64) -> Scene {
    let mut scene = tests::scene(2, blocks);
    scene.material.push(Material {
        name: "rock".to_owned(),
        model: MaterialModel::Elastic,
        young_modulus: 1.0,
        poisson_ratio: 0.2,
        density: 1.0,
        damping: Damping::default(),
    });
    scene.time.end = 1e6;
    scene.time.safety = safety;
    scene.contact.model = ContactModel::UnifiedNode;
    scene.contact.strength.cohesion = 1e9;
    scene.contact.strength.tensile_strength = 1e9;
    scene
}

/// Returns a box from `min` to `max`.
fn bar(name: &str, min: [f64; 2], max: [f64; 2], cells: [usize; 2], element: ElementKind) -> Block {
    let geometry = Geometry::Box {
        min: min.to_vec(),
        max: max.to_vec(),
        divisions: cells.to_vec(),
        element,
    };
    let mut block = tests::block(name, geometry);
    block.mass = Mass::Lumped;
    block
}

fn run_of(scene: &Scene) -> Run<2> {
    let mut scene = scene.clone();
    let mesh = tests::shapes(scene.block.clone()).expect("boxes mesh");
    let built = Model::build(&mut scene, mesh, PLANE).expect("the scene is whole");
    Run::new(built)
}

/// Returns a number in −1 … 1.
fn noise(random: &mut Rng) -> f64 {
    2.0 * random.f64() - 1.0
}

/// Returns velocities of the ten lowest vibration modes, of equal energy and random signs, for
/// lumped masses.
fn lowest_ten_modes(run: &Run<2>, random: &mut Rng) -> Vec<[f64; 2]> {
    let model = &run.model;
    let count = 2 * model.mesh.nodes.len();
    let root: Vec<f64> = (0..count)
        .map(|i| model.inertia.mass()[i / 2].sqrt())
        .collect();
    let mut matrix = DMatrix::<f64>::zeros(count, count);
    for set in &model.sets {
        for i in 0..set.len() {
            let nodes = set.nodes(&model.mesh, i);
            let size = 2 * nodes.len();
            let mut stiffness = vec![0.0; size * size];
            set.stiffness(i, &mut stiffness);
            let place = |k: usize| 2 * nodes[k / 2] as usize + k % 2;
            for row in 0..size {
                for column in 0..size {
                    let (r, c) = (place(row), place(column));
                    matrix[(r, c)] += stiffness[row * size + column] / (root[r] * root[c]);
                }
            }
        }
    }
    let modes = SymmetricEigen::new(matrix);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| modes.eigenvalues[a].total_cmp(&modes.eigenvalues[b]));
    let mut sum = DVector::<f64>::zeros(count);
    // The first three modes are rigid.
    for &mode in &order[3..13] {
        let sign = noise(random).signum();
        sum += sign * modes.eigenvectors.column(mode);
    }
    let velocity = |node: usize| std::array::from_fn(|c| sum[2 * node + c] / root[2 * node]);
    (0..count / 2).map(velocity).collect()
}

/// Returns the mean energy after `changes` of the levels of a third of the block over that before.
/// The levels alternately rise and fall by two. `velocities` are scaled to small strains. Times
/// between changes are random around `dwell` steps: at a constant ten steps a few frequencies
/// resonate with the changes.
fn energy_after_level_changes(
    run: &mut Run<2>,
    velocities: &[[f64; 2]],
    changes: usize,
    dwell: f64,
) -> f64 {
    for (velocity, wanted) in run.state.velocity.iter_mut().zip(velocities) {
        *velocity = wanted.map(|v| 1e-7 * v);
    }
    let mesh = &run.model.mesh;
    let zone: Vec<usize> = (0..mesh.elements.len())
        .filter(|&e| mesh.nodes[mesh.elements[e].nodes()[0] as usize][0] < 0.3)
        .collect();
    let mean_of_a_while = |run: &mut Run<2>| {
        let mut sum = 0.0;
        for _ in 0..400 {
            run.step();
            let instant = run.instant();
            sum += run.energy(&instant);
        }
        sum / 400.0
    };
    let before = mean_of_a_while(run);
    let mut random = Rng::with_seed(7);
    for change in 0..changes {
        for &element in &zone {
            run.model.base_level[element] = if change % 2 == 0 { 2 } else { 0 };
        }
        run.assign_levels();
        for _ in 0..(dwell * (1.0 + 0.5 * noise(&mut random))) as usize {
            run.step();
        }
    }
    mean_of_a_while(run) / before
}

/// Returns the largest relative energy change of smooth vibrations after this number of level
/// changes.
fn change_levels(changes: usize, dwell: f64) -> f64 {
    let mut worst = 0.0_f64;
    for element in [ElementKind::Tri3, ElementKind::Quad4] {
        let block = bar("bar", [0.0; 2], [1.0, 0.4], [15, 6], element);
        let scene = scene(vec![block], 0.5);
        let mut random = Rng::with_seed(1);
        let mut smooth = run_of(&scene);
        let modes = lowest_ten_modes(&smooth, &mut random);
        let smooth = energy_after_level_changes(&mut smooth, &modes, changes, dwell);
        let rough: Vec<[f64; 2]> = modes
            .iter()
            .map(|_| [noise(&mut random), noise(&mut random)])
            .collect();
        let rough = energy_after_level_changes(&mut run_of(&scene), &rough, changes, dwell);
        println!(
            "{changes} changes of levels about every {dwell} steps, {}: energy of \
             the lowest ten modes × {smooth:.4}, of grid-scale noise × {rough:.3}",
            element.name()
        );
        worst = worst.max((smooth - 1.0).abs());
    }
    worst
}

/// The design requires 5 % at safety 0.5, which is used for elements whose levels change.
#[test]
fn raising_and_lowering_levels_hardly_pumps_energy() {
    assert!(change_levels(200, 20.0) < 0.05);
}

#[test]
#[ignore = "slow study: a thousand raisings and lowerings"]
fn a_thousand_raisings_and_lowerings_hardly_pump_energy() {
    assert!(change_levels(2000, 60.0) < 0.05);
}

/// Returns the mean energy after this number of coarse steps over that before, of random velocities
/// of all nodes, and the number of levels.
fn energy_after_steps(scene: &Scene, steps: usize) -> (f64, usize) {
    let mut run = run_of(scene);
    let mut random = Rng::with_seed(3);
    for (node, velocity) in run.state.velocity.iter_mut().enumerate() {
        let prescribed = run.model.inertia.prescribed(node);
        for (value, prescribed) in velocity.iter_mut().zip(prescribed) {
            *value = if prescribed {
                0.0
            } else {
                1e-7 * noise(&mut random)
            };
        }
    }
    run.prepare();
    let mut mean = |steps: usize| {
        let mut sum = 0.0;
        for _ in 0..steps {
            run.step();
            let instant = run.instant();
            sum += run.energy(&instant);
        }
        (sum / steps as f64, run.workspace.schedule.histogram().len())
    };
    let (before, _) = mean(1000);
    mean(steps);
    let (after, levels) = mean(1000);
    (after / before, levels)
}

/// Prescribes the motion of a group.
fn hold(scene: &mut Scene, group: &str) {
    let zero = || Some(Schedule::Constant(0.0));
    scene.boundary.push(Boundary {
        target: BoundaryTarget::Group(group.to_owned()),
        motion: Motion::Velocity([zero(), zero(), None]),
        start: 0.0,
        end: None,
    });
}

/// Vibrations of joined blocks of unequal meshes and levels gain no energy. A kick goes on from the
/// impulses of the last one, so only many steps show it. A growth of amplitudes by 2e-6 in a step
/// would exceed the limit.
#[test]
fn no_pair_of_joined_blocks_gains_energy() {
    use ElementKind::{Quad4, Tri3};
    let pairs = [
        ([2, 1], [4, 2], Tri3, Tri3, 0.0),
        ([2, 1], [5, 3], Tri3, Quad4, 0.0),
        ([1, 1], [6, 4], Quad4, Quad4, 0.07),
        ([2, 2], [4, 3], Quad4, Tri3, 0.03),
    ];
    for (left, right, one, other, shift) in pairs {
        let blocks = vec![
            bar("left", [-0.5, 0.0], [0.0, 0.3], left, one),
            bar("right", [0.0, shift], [0.5, shift + 0.3], right, other),
        ];
        let mut scene = scene(blocks, 0.9);
        hold(&mut scene, "left.xmin");
        let (ratio, levels) = energy_after_steps(&scene, 5000);
        println!("{left:?} {right:?} shifted by {shift}: energy × {ratio:.4}, {levels} levels");
        assert!(levels > 1 && ratio < 1.02, "{ratio}");
    }
}
