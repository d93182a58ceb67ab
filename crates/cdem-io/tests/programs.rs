//! Scenes and meshes built by a program: no file, but the same messages.

use std::collections::BTreeMap;
use std::path::Path;

use cdem::mesh::{CellKind, ElementKind, RawMesh};
use cdem_io::scene::{SceneError, check};
use cdem_io::setup::{SetupError, build};
use serde_json::{Value, json};

/// Builds a square of two triangles.
fn square() -> RawMesh {
    let mut mesh = RawMesh::new("a square");
    mesh.points = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    mesh.point_tags = (0..4).collect();
    let cells = mesh.cells_mut(CellKind::Element(ElementKind::Tri3));
    cells.nodes = vec![0, 1, 2, 0, 2, 3];
    cells.tags = vec![0, 1];
    cells.sets = vec![0, 0];
    mesh
}

fn scene() -> Value {
    json!({
        "version": 1, "dimension": 2,
        "time": { "end": 1e-3 },
        "material": [{ "name": "m", "young_modulus": 1e9, "poisson_ratio": 0.25, "density": 1e3 }],
        "block": [{ "name": "a", "material": "m", "mesh": "a square" }],
    })
}

#[test]
fn what_is_wrong_is_told_by_its_key() {
    let mut wrong = scene();
    wrong["titel"] = json!("a");
    let error = check(wrong, Path::new("")).expect_err("an unknown key");
    assert!(matches!(error, SceneError::Unwritten(_)));
    let told = "titel: unknown key (did you mean `title`?)";
    assert_eq!(error.to_string(), told);
    assert_eq!(error.render(false), format!("{told}\n"));
}

#[test]
fn a_mesh_at_hand_is_taken_instead_of_a_file() {
    let file = check(scene(), Path::new("nowhere")).expect("a scene");
    let mut at_hand = BTreeMap::from([("a square".into(), square())]);
    let built = build(&file, &mut at_hand).map_err(|error| error.to_string());
    let overview = built.map(|built| built.simulation.overview());
    assert_eq!(overview.map(|overview| overview.elements), Ok(2));
}

#[test]
fn a_mesh_that_is_wrong_is_told_of_at_its_block() {
    let mut wrong = scene();
    wrong["block"][0]["group"] = json!("b");
    let file = check(wrong, Path::new("nowhere")).expect("a scene");
    let mut at_hand = BTreeMap::from([("a square".into(), square())]);
    let Err(SetupError::Mesh(blame)) = build(&file, &mut at_hand) else {
        panic!("there is no such group");
    };
    let told = blame.to_string();
    assert!(told.starts_with("block[0].group: "), "{told}");
}

#[test]
fn a_file_that_is_not_there_is_looked_for_in_the_folder() {
    let file = check(scene(), Path::new("nowhere")).expect("a scene");
    let Err(SetupError::Mesh(blame)) = build(&file, &mut BTreeMap::new()) else {
        panic!("there is no such file");
    };
    let path = Path::new("nowhere").join("a square");
    let told = blame.to_string();
    assert!(told.contains(&path.display().to_string()), "{told}");
}
