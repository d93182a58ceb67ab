//! Good scenes: their meaning, and that they are unchanged by writing and reading.

use std::path::Path;

use cdem::scene::{
    Cadence, ContactModel, Geometry, LoadKind, Motion, Rotation, Scene, Schedule, Strength,
    ZoneExtent, from_value, json_schema,
};
use cdem_io::scene::{SceneFile, parse, read, write};
use proptest::prelude::*;
use serde_json::Value;

fn scene_file(name: &str) -> SceneFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/scenes")
        .join(name);
    read(&path).unwrap_or_else(|error| panic!("{}", error.render(false)))
}

fn reread(scene: &Scene) -> Scene {
    let text = write(scene);
    let file = parse(&text, Path::new("written.toml"));
    file.unwrap_or_else(|error| panic!("{}\n{text}", error.render(false)))
        .scene
}

#[test]
fn units_and_forms_of_a_2d_scene_are_understood() {
    let scene = scene_file("everything-2d.toml").scene;
    assert_eq!(scene.thickness, 0.02);
    assert_eq!(scene.gravity.value(0.05), [0.0, -4.905]);
    assert_eq!(scene.time.step, Some(5e-4));
    let [rock, ice] = scene.material.as_slice() else {
        panic!("two materials")
    };
    assert_eq!(
        (rock.young_modulus, rock.density, rock.damping.stiffness),
        (40e9, 2700.0, 1e-6)
    );
    assert_eq!((ice.poisson_ratio, ice.density), (0.33, 917.0));
    let pile = &scene.block[0];
    assert_eq!(pile.translate, [0.05, 0.25]);
    assert_eq!(pile.rotate.angle, 33.7_f64.to_radians());
    assert_eq!(pile.rotate.axis, [0.0, 0.0, 1.0]);
    let Motion::Turn { point, .. } = &scene.boundary[1].motion else {
        panic!("a turn")
    };
    assert_eq!(*point, [1.0, 2.0, 0.0]);
    let LoadKind::Pressure(pressure) = &scene.load[0].kind else {
        panic!("a pressure")
    };
    assert_eq!(*pressure, Schedule::Table(vec![(0.0, 0.0), (0.1, 1e5)]));
    assert_eq!(
        scene.contact.pair[0].friction_angle,
        Some(20_f64.to_radians())
    );
    assert_eq!(scene.output.history, Cadence::Interval(1e-3));
    assert_eq!(scene.output.checkpoint, 300.0);
}

#[test]
fn forms_of_a_3d_scene_are_understood() {
    let scene = scene_file("everything-3d.toml").scene;
    let Rotation { axis, angle } = &scene.block[0].rotate;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Two roundings of the length, one of the quotient.
    assert!(
        axis.iter()
            .zip([half, half, 0.0])
            .all(|(a, b)| (a - b).abs() < 4e-16)
    );
    assert_eq!(*angle, 30_f64.to_radians());
    let Motion::Turn { axis, .. } = &scene.boundary[1].motion else {
        panic!("a turn")
    };
    assert_eq!(*axis, [0.0, 0.0, 1.0]);
    assert_eq!(scene.contact.strength.friction_angle, 0.35);
    // The keys of the default model need no `model` beside them.
    assert_eq!(scene.contact.model, ContactModel::TwoScale);
    assert_eq!(scene.contact.energy_loss, 0.005);
    assert_eq!(scene.contact.max_level, 3);
    assert_eq!(scene.contact.zone, ZoneExtent::Wavefront);
}

#[test]
fn what_is_left_out_has_the_documented_default() {
    let text = "version = 1\ndimension = 2\n[time]\nend = 1\n\
        [[material]]\nname = \"m\"\nyoung_modulus = 1\npoisson_ratio = 0\ndensity = 1\n\
        [[block]]\nname = \"b\"\nmesh = \"b.msh\"\nmaterial = \"m\"\n";
    let scene = parse(text, Path::new("small.toml")).expect("a scene").scene;
    assert_eq!(scene.contact.strength, Strength::default());
    assert_eq!(scene.contact.tolerance, None);
    assert!(matches!(
        &scene.block[0].geometry,
        Geometry::Mesh { group: None, .. }
    ));

    // The written scene contains each schema default that has a value.
    let written: Value = toml::from_str(&write(&scene)).expect("TOML");
    let schema = json_schema();
    let mut compared = 0;
    let tables = [
        ("", ""),
        ("/time", "/$defs/Time"),
        ("/material/0", "/$defs/Material"),
        ("/material/0/damping", "/$defs/Damping"),
        ("/block/0", "/$defs/Block"),
        ("/contact", "/$defs/Contact"),
        ("/output", "/$defs/Output"),
    ];
    for (at, definition) in tables {
        let table = written.pointer(at).expect(at);
        let properties = schema
            .pointer(definition)
            .and_then(|d| d["properties"].as_object());
        for (key, property) in properties.expect(definition) {
            let (Some(default), Some(value)) = (property.get("default"), table.get(key)) else {
                continue;
            };
            assert_eq!(default, value, "{at}/{key}");
            compared += 1;
        }
    }
    assert!(compared > 20, "{compared} defaults were compared");
}

#[test]
fn a_written_scene_is_the_same_scene() {
    for name in ["everything-2d.toml", "everything-3d.toml"] {
        let scene = scene_file(name).scene;
        assert_eq!(reread(&scene), scene, "{name}");
    }
}

/// Returns a number of any size that every key below accepts.
fn number() -> impl Strategy<Value = f64> {
    (1.0..10.0_f64, -12..12_i32).prop_map(|(digits, tens)| digits * 10_f64.powi(tens))
}

/// Returns texts of a scene in either dimension, with random numbers and forms.
fn scene_text() -> impl Strategy<Value = String> {
    let numbers = prop::collection::vec(number(), 12);
    let parts = (
        0.001..0.499,
        -89.0..0.0,
        0.0..1.5,
        any::<[bool; 4]>(),
        "[a-zA-Zé ]{0,8}",
    );
    (2..=3_usize, numbers, parts).prop_map(
        |(dimension, n, (poisson, turn, friction, forms, title))| {
            let vector = |n: &[f64]| format!("{:?}", &n[..dimension]);
            let either = |i: usize, a: String, b: String| if forms[i] { a } else { b };
            let plane = dimension == 2;
            let rotate = if plane {
                format!("{turn}")
            } else {
                format!("{{ axis = {}, angle = {turn} }}", vector(&n))
            };
            let axis = if plane {
                String::new()
            } else {
                format!("axis = {}", vector(&n[2..]))
            };
            [
                format!("version = 1\ntitle = \"{title}\"\ndimension = {dimension}"),
                either(
                    0,
                    format!("gravity = {}", vector(&n)),
                    format!(
                        "gravity = [[0, {}], [{}, {}]]",
                        vector(&n),
                        n[3],
                        vector(&n[4..])
                    ),
                ),
                format!("[time]\nend = {}\nsafety = {poisson}", n[0]),
                format!(
                    "[[material]]\nname = \"m\"\nyoung_modulus = {}\npoisson_ratio = {poisson}",
                    n[1]
                ),
                format!(
                    "density = {}\ndamping = {{ mass = {}, local = {poisson} }}",
                    n[2], n[3]
                ),
                format!(
                    "[[block]]\nname = \"b\"\nmaterial = \"m\"\nvelocity = {}",
                    vector(&n[4..])
                ),
                format!(
                    "rotate = {rotate}\ntranslate = {}\nscale = {}",
                    vector(&n[7..]),
                    n[11]
                ),
                either(
                    1,
                    "mesh = \"a/b.msh\"\ngroup = \"g\"".to_owned(),
                    format!(
                        "shape = {{ box = {{ min = {}, max = {}, divisions = {:?} }} }}",
                        vector(&[-1.0, -2.0, -3.0]),
                        vector(&n[5..]),
                        vec![3; dimension]
                    ),
                ),
                either(
                    2,
                    format!(
                        "[[boundary]]\nblock = \"b\"\nangular_velocity = {}\n{axis}",
                        n[6]
                    ),
                    format!(
                        "[[boundary]]\ngroup = \"g\"\nvelocity = {{ y = [[0, {}], [1, {}]] }}",
                        n[0], n[1]
                    ),
                ),
                format!(
                    "[[load]]\ngroup = \"g\"\npressure = {}\nstart = {}",
                    n[8], n[9]
                ),
                format!(
                    "[contact]\nfriction_angle = \"{friction} rad\"\ntolerance = {}",
                    n[10]
                ),
                either(
                    3,
                    "[output]\nframes = 7".to_owned(),
                    format!("[output]\nframe_interval = {}", n[4]),
                ),
            ]
            .join("\n")
        },
    )
}

proptest! {
    #[test]
    fn any_written_scene_is_the_same_scene(text in scene_text()) {
        let file = parse(&text, Path::new("random.toml"));
        let scene = file.map_err(|error| TestCaseError::fail(error.render(false)))?.scene;
        prop_assert_eq!(reread(&scene), scene);
    }
}

#[test]
fn scenes_of_other_programs_are_read_the_same_way() {
    let file = scene_file("everything-2d.toml");
    let text = std::fs::read_to_string(file.path()).expect("it has been read");
    let tree: Value = toml::from_str(&text).expect("TOML");
    assert_eq!(from_value(tree), Ok(file.scene));
}

#[test]
fn later_errors_are_shown_in_the_file() {
    use cdem::scene::{KeyPath, Problem};
    let file = scene_file("everything-2d.toml");
    let path = KeyPath::root().key("boundary").index(0).key("group");
    let error = file.error(vec![Problem::new(
        path,
        "the mesh has no group \"support\"",
    )]);
    let text = error.to_string();
    assert!(
        text.ends_with(
            "everything-2d.toml:58:9: boundary[0].group: the mesh has no group \"support\""
        ),
        "{text}"
    );
}

/// To update it: `UPDATE_SCHEMA=1 cargo test --package cdem-io schema`.
#[test]
fn the_committed_schema_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schema/scene.schema.json");
    let schema = format!("{:#}\n", json_schema());
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        std::fs::write(&path, &schema).expect("schema/scene.schema.json is written");
    }
    let committed = std::fs::read_to_string(&path).expect("schema/scene.schema.json");
    assert!(
        committed == schema,
        "the keys of a scene have changed: UPDATE_SCHEMA=1 cargo test --package cdem-io schema"
    );
}
