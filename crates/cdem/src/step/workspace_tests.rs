//! Runs that drop their workspace between all steps against runs that keep it.

use serde_json::{Value, json};

use crate::mesh;
use crate::model::Model;
use crate::refinement::dimension::{PLANE, SOLID, Space};
use crate::scene::from_value;
use crate::step::Run;

/// Returns a box block of the scene.
fn block(name: &str, min: &[f64], max: &[f64], divisions: &[u32], element: &str) -> Value {
    json!({
        "name": name, "material": "rock", "element": element,
        "shape": { "box": { "min": min, "max": max, "divisions": divisions } }
    })
}

/// Returns the scene of these blocks: the first is fixed, the last moves to the left and turns.
fn scene(dimension: usize, mut blocks: Vec<Value>, contact: Value) -> Value {
    let last = blocks.len() - 1;
    blocks[0]["fixed"] = json!(true);
    blocks[last]["velocity"] = json!(&[-2.0, -1.0, 0.3][..dimension]);
    let mut gravity = vec![0.0; dimension];
    gravity[1] = -9.81;
    json!({
        "version": 1, "dimension": dimension, "gravity": gravity, "time": { "end": 1.0 },
        "material": [{
            "name": "rock", "young_modulus": 1e8, "poisson_ratio": 0.25, "density": 2500.0,
            "damping": { "mass": 0.5, "stiffness": 1e-6, "local": 0.1 }
        }],
        "block": blocks, "contact": contact
    })
}

fn run_of<const D: usize>(scene: &Value, space: Space<D>) -> Run<D> {
    let mut scene = from_value(scene.clone()).expect("a scene");
    let none = &mut |_: &std::path::Path| unreachable!("a box has no file");
    let mesh = mesh::assemble::<D>(&scene, none).expect("a mesh");
    Run::new(Model::build(&mut scene, mesh, space).expect("a model"))
}

/// Checks that a run has the same state, bit for bit, after each of `steps` steps with and without
/// its workspace, and that at least `contacts` contacts begin. Returns the largest numbers of
/// levels and elements.
fn compare<const D: usize>(
    scene: &Value,
    space: Space<D>,
    steps: usize,
    contacts: u64,
) -> [usize; 2] {
    let [mut kept, mut dropped] = [run_of(scene, space), run_of(scene, space)];
    let bits = |run: &Run<D>| postcard::to_stdvec(&run.stored()).expect("memory");
    let mut most = [0; 2];
    for step in 0..steps {
        dropped.rebuild_workspace();
        kept.step();
        dropped.step();
        assert!(bits(&kept) == bits(&dropped), "step {step}");
        let levels = kept.workspace.schedule.histogram().len();
        most = [
            most[0].max(levels),
            most[1].max(kept.model.mesh.elements.len()),
        ];
    }
    let begun = kept.contacts.as_ref().expect("blocks").contacts_begun();
    assert!(begun >= contacts, "{begun} contacts");
    most
}

/// A small block of smaller elements, so of a finer level, slides and turns on a row of blocks.
#[test]
fn a_plane_run_does_not_need_its_workspace() {
    let blocks = vec![
        block("floor", &[-2.0, -0.5], &[2.0, 0.0], &[4, 1], "quad4"),
        block("row", &[-0.6, 0.0], &[0.0, 0.4], &[2, 1], "tri3"),
        block("next", &[0.002, 0.0], &[0.6, 0.4], &[2, 2], "quad4"),
        block("stone", &[0.2, 0.41], &[0.5, 0.5], &[6, 3], "quad4"),
    ];
    let contact = json!({ "model": "unified-node", "friction_angle": 25.0 });
    let [levels, _] = compare(&scene(2, blocks, contact), PLANE, 400, 8);
    assert!(levels > 1, "one level");
}

/// Blocks of one element are refined around their impact, and coarsened after it.
#[test]
fn a_run_of_two_scales_does_not_need_its_workspace() {
    let mut blocks = vec![
        block("floor", &[-1.0, -0.5], &[1.0, 0.0], &[1, 1], "tri3"),
        block("stone", &[0.1, 0.1], &[0.5, 0.5], &[1, 1], "tri3"),
    ];
    blocks[1]["rotate"] = json!(20.0);
    let contact = json!({ "model": "two-scale", "friction_angle": 25.0, "max_level": 3 });
    let [levels, elements] = compare(&scene(2, blocks, contact), PLANE, 400, 1);
    assert!(levels > 1 && elements > 4, "no refinement");
}

#[test]
fn a_solid_run_does_not_need_its_workspace() {
    let blocks = vec![
        block(
            "floor",
            &[-1.0, -0.5, -1.0],
            &[1.0, 0.0, 1.0],
            &[2, 1, 2],
            "hex8",
        ),
        block(
            "stone",
            &[0.0, 0.002, -0.1],
            &[0.3, 0.3, 0.2],
            &[2, 2, 2],
            "tet4",
        ),
        block(
            "other",
            &[0.1, 0.305, 0.0],
            &[0.4, 0.5, 0.3],
            &[1, 1, 1],
            "hex8",
        ),
    ];
    let contact = json!({ "model": "unified-node", "friction_angle": 25.0 });
    compare(&scene(3, blocks, contact), SOLID, 150, 4);
}
