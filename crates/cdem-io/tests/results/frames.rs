//! Frames as read by VTK and meshio.

use std::path::Path;
use std::process::Command;

use cdem::output::{FieldValues, Frame, FrameField};
use cdem::scene::Cadence;
use cdem_io::results::{Status, Summary};
use serde_json::Value;

use crate::fake::{Fake, Place, STEPS, contact_frame, frame, scene, summary};

/// Returns the contents of files as read by independent programs. Prints a notice and returns
/// `None` if there is no Python with them: `./test` sets `CDEM_PYTHON`.
fn read(paths: &[&Path]) -> Option<Vec<Value>> {
    let Some(python) = std::env::var_os("CDEM_PYTHON") else {
        #[allow(clippy::print_stdout)] // the notice is for whoever runs the test
        {
            println!("left out: CDEM_PYTHON names no Python with vtk and meshio; ./test does");
        }
        return None;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/results/read_frames.py");
    let output = Command::new(python)
        .arg(script)
        .args(paths)
        .output()
        .expect("Python runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(serde_json::from_slice(&output.stdout).expect("the script prints JSON"))
}

/// Asserts equality to the last bit; names the first number that differs.
fn assert_numbers(found: &Value, wanted: &[f64], what: &str) {
    let found = numbers(found);
    assert_eq!(found.len(), wanted.len(), "{what}");
    for (i, (found, wanted)) in found.iter().zip(wanted).enumerate() {
        assert_eq!(
            found.to_bits(),
            wanted.to_bits(),
            "{what} {i}: {found:e} for {wanted:e}"
        );
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value
        .as_array()
        .unwrap_or_else(|| panic!("no list: {value}"));
    list.iter().map(|v| v.as_f64().expect("a number")).collect()
}

fn field_numbers(field: &FrameField) -> Vec<f64> {
    match &field.values {
        FieldValues::Real(values) => values.clone(),
        FieldValues::Whole(values) => values.iter().map(|&v| v.into()).collect(),
    }
}

fn assert_fields(found: &Value, fields: &[FrameField]) {
    assert_eq!(
        found.as_object().map(serde_json::Map::len),
        Some(fields.len())
    );
    for field in fields {
        let array = &found[field.name];
        assert_numbers(&array["values"], &field_numbers(field), "values");
        assert_eq!(
            array["components"],
            serde_json::json!(field.components),
            "{}",
            field.name
        );
    }
}

fn assert_same(found: &Value, frame: &Frame) {
    let vtk = &found["vtk"];
    assert_numbers(&vtk["points"], frame.points.as_flattened(), "points");
    let connectivity: Vec<f64> = frame.connectivity.iter().map(|&p| p.into()).collect();
    // VTK's wedge has the triangle 0 1 2 facing outward; meshio turns it back.
    let mut turned = connectivity.clone();
    turned.swap(12, 13);
    turned.swap(15, 16);
    assert_numbers(&vtk["connectivity"], &turned, "connectivity");
    assert_eq!(vtk["offsets"], serde_json::json!([0, 3, 7, 11, 17, 25]));
    assert_eq!(vtk["types"], serde_json::json!([5, 9, 10, 13, 12]));
    assert_eq!(vtk["time"], frame.time);
    assert_fields(&vtk["point_data"], &frame.point_fields);
    assert_fields(&vtk["cell_data"], &frame.cell_fields);

    let meshio = &found["meshio"];
    let kinds = ["triangle", "quad", "tetra", "wedge", "hexahedron"];
    assert_eq!(meshio["kinds"], serde_json::json!(kinds));
    assert_numbers(&meshio["points"], frame.points.as_flattened(), "points");
    assert_numbers(&meshio["connectivity"], &connectivity, "connectivity");
    for (data, fields) in [
        ("point_data", &frame.point_fields),
        ("cell_data", &frame.cell_fields),
    ] {
        for field in fields {
            assert_numbers(&meshio[data][field.name], &field_numbers(field), field.name);
        }
    }
}

#[test]
fn independent_programs_read_the_same_numbers() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(1), Cadence::Count(1)), false);
    let file = |name: &str| place.results().join(name);
    let paths = [
        "frames/00000.vtu",
        "frames/00001.vtu",
        "contacts/00000.vtp",
        "contacts/00001.vtp",
    ]
    .map(file);
    let Some(found) = read(&paths.each_ref().map(|path| path.as_path())) else {
        return;
    };
    assert_same(&found[0], &frame(0.0));
    assert_same(&found[1], &frame(1.0));
    // At the start there are no contacts, which must also give a readable frame.
    for (found, count) in [(&found[2]["vtk"], 0), (&found[3]["vtk"], STEPS as usize)] {
        let frame = contact_frame(found["time"].as_f64().expect("a time"), count);
        assert_numbers(&found["points"], frame.points.as_flattened(), "points");
        assert_eq!(found["types"], serde_json::json!(vec![1; count]));
        let data = &found["point_data"];
        assert_numbers(
            &data["normal"]["values"],
            frame.normals.as_flattened(),
            "normal",
        );
        assert_numbers(
            &data["force"]["values"],
            frame.forces.as_flattened(),
            "force",
        );
        assert_eq!(
            data["force"]["components"],
            serde_json::json!(["x", "y", "z"])
        );
        assert_numbers(&data["slip"]["values"], &frame.slips, "slip");
        assert_numbers(&data["area"]["values"], &frame.areas, "area");
    }
}

#[test]
fn frames_of_many_compression_blocks_are_read() {
    // 60 000 points: 1.4 MB, or eleven full blocks of 128 KiB less a rest. A further 16 384 numbers
    // fill one block exactly.
    let points: Vec<[f64; 3]> = (0..60_000)
        .map(|i| [f64::from(i).sqrt(), f64::from(i), 0.0])
        .collect();
    let whole_block = FrameField {
        name: "von_mises",
        components: &[],
        values: FieldValues::Real((0..16_384).map(|i| f64::from(i).cos()).collect()),
    };
    let frame = Frame {
        time: 0.5,
        points,
        kinds: vec![cdem::mesh::ElementKind::Tri3; 16_384],
        connectivity: (0..3 * 16_384).collect(),
        point_fields: vec![],
        cell_fields: vec![whole_block],
    };
    let place = Place::new();
    let path = place.results().with_extension("vtu");
    cdem_io::results::write_frame(&path, &frame).expect("written");
    let Some(found) = read(&[&path]) else {
        return;
    };
    assert_numbers(
        &found[0]["vtk"]["points"],
        frame.points.as_flattened(),
        "points",
    );
    assert_numbers(
        &found[0]["meshio"]["points"],
        frame.points.as_flattened(),
        "points",
    );
    assert_fields(&found[0]["vtk"]["cell_data"], &frame.cell_fields);
}

#[test]
fn files_do_not_depend_on_the_number_of_threads() {
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let place = Place::new();
        pool.install(|| place.run(&scene(Cadence::Count(1), Cadence::Count(1)), false));
        std::fs::read(place.results().join("frames/00001.vtu")).expect("a frame")
    };
    assert_eq!(bytes(1), bytes(3));
}

#[test]
fn a_disk_that_refuses_the_last_frame_still_gets_its_summary() {
    let place = Place::new();
    let mut recorder = place.recorder(&scene(Cadence::Count(10), Cadence::Count(5)), false);
    let mut run = Fake::default();
    recorder.observe(&mut run).expect("written");
    recorder.wait().expect("written beside");
    std::fs::remove_dir_all(place.results().join("frames")).expect("removed");
    run.step = 1;
    let summary = Summary {
        status: Status::Done,
        ..summary()
    };
    let error = recorder.finish(&mut run, &summary).expect_err("no folder");
    assert!(error.to_string().contains("00001.vtu"), "{error}");
    let written = place.read("summary.json");
    assert!(written.contains("\"status\": \"stopped\""), "{written}");
    assert!(written.contains("00001.vtu"), "the reason: {written}");
    // Data that do not need the folder are complete: the contact that lasts.
    assert_eq!(place.read("contacts.csv").lines().count(), 2);
    assert_eq!(place.read("history.csv").lines().count(), 3);
}
