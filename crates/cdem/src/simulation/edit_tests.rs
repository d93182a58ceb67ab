//! Tests of queries and changes between steps.

use crate::scene::{Schedule, from_value};
use crate::simulation::edit::*;
use crate::{AnyMesh, mesh};

/// Returns a bar of ten squares, free or fixed at its left end, pulled by `traction` at its right
/// end.
fn bar(is_held: bool, traction: f64) -> Simulation {
    let held = serde_json::json!([{ "group": "bar.xmin", "velocity": { "x": 0.0, "y": 0.0 } }]);
    let scene = from_value(serde_json::json!({
        "version": 1, "dimension": 2,
        "time": { "end": 1e-3 },
        "material": [{ "name": "m", "young_modulus": 1e9, "poisson_ratio": 0.25, "density": 1000.0 }],
        "block": [{ "name": "bar", "material": "m", "element": "quad4", "shape": { "box":
            { "min": [0.0, 0.0], "max": [1.0, 0.1], "divisions": [10, 1] } } }],
        "boundary": if is_held { held } else { serde_json::json!([]) },
        "load": [{ "group": "bar.xmax", "traction": [traction, 0.0] }],
    }))
    .expect("a scene");
    let none = &mut |_: &std::path::Path| unreachable!("a box has no file");
    let mesh = mesh::assemble::<2>(&scene, none).expect("a mesh");
    Simulation::new(&scene, AnyMesh::Plane(mesh)).expect("a model")
}

fn step(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step().expect("a sound step");
    }
}

#[test]
fn velocities_are_what_they_are_set_to_and_the_ledger_closes() {
    let mut run = bar(false, 2e5);
    step(&mut run, 20);
    let before = run.history();
    let wanted: Vec<_> = run
        .positions()
        .iter()
        .map(|x| [3.0, 2.0 - x[0], 0.0])
        .collect();
    run.set_velocities(&wanted);
    let FrameField { values, .. } = run.field(Field::Velocity);
    let crate::simulation::output::FieldValues::Real(values) = values else {
        panic!("velocities are real");
    };
    for (is, wanted) in values.as_chunks::<3>().0.iter().zip(&wanted) {
        for c in 0..3 {
            // Two roundings of the sum with the old velocity.
            assert!((is[c] - wanted[c]).abs() < 1e-14, "{is:?}, {wanted:?}");
        }
    }
    let after = run.history();
    // The mass is 100 kg. The change in energy and momentum is external.
    assert!((after.momentum[0] - 300.0).abs() < 1e-10);
    for c in 0..2 {
        let came = after.momentum[c] - before.momentum[c];
        assert!((after.impulse[c] - before.impulse[c] - came).abs() < 1e-10 * came.abs());
    }
    let came = after.kinetic_energy - before.kinetic_energy;
    assert!(came > 400.0);
    assert!((after.external_work - before.external_work - came).abs() < 1e-10 * came);
    step(&mut run, 40);
    let end = run.history();
    assert!(
        end.energy_residual.abs() < 1e-3 * end.kinetic_energy,
        "{end:?}"
    );
}

#[test]
fn held_nodes_keep_their_velocity() {
    let mut run = bar(true, 0.0);
    let count = run.positions().len();
    run.set_velocities(&vec![[1.0, 0.0, 0.0]; count]);
    let places = run.positions();
    step(&mut run, 30);
    for (old, new) in places.iter().zip(run.positions()) {
        assert_eq!(old[0] == 0.0, old == &new, "{old:?}, {new:?}");
    }
}

#[test]
fn a_load_that_is_set_pushes_and_its_work_is_counted() {
    let mut run = bar(true, 0.0);
    step(&mut run, 5);
    assert_eq!(run.history().external_work, 0.0);
    run.set_load(0, &LoadKind::Traction(Schedule::Constant(vec![1e5, 0.0])));
    step(&mut run, 40);
    let row = run.history();
    assert!(row.external_work > 0.0);
    assert!(
        row.energy_residual.abs() < 1e-2 * row.external_work,
        "{row:?}"
    );
    let LoadKind::Traction(traction) = &run.scene().load[0].kind else {
        panic!("a traction stays one");
    };
    let step = run.overview().step;
    assert_eq!(traction.value(4.0 * step), [0.0, 0.0]);
    assert_eq!(traction.value(5.0 * step), [1e5, 0.0]);
}

#[test]
fn a_run_resumed_with_the_scene_as_it_became_goes_on_alike() {
    let mut whole = bar(true, 1e4);
    step(&mut whole, 7);
    whole.set_load(0, &LoadKind::Traction(Schedule::Constant(vec![-3e4, 1e3])));
    step(&mut whole, 3);
    let checkpoint = whole.checkpoint();
    let mesh = whole.mesh();
    let again = Simulation::new(whole.scene(), mesh).expect("a model");
    let mut again = again.resumed(&checkpoint).expect("a checkpoint");
    step(&mut whole, 20);
    step(&mut again, 20);
    assert_eq!(whole.positions(), again.positions());
    assert_eq!(whole.history(), again.history());
}

#[test]
fn looking_at_blocks_goes_on_averaging() {
    let [mut looked, mut left] = [bar(true, 1e5), bar(true, 1e5)];
    for _ in 0..10 {
        step(&mut looked, 1);
        assert_eq!(looked.blocks().len(), 1);
        step(&mut left, 1);
    }
    assert_eq!(looked.block_rows(), left.block_rows());
}
