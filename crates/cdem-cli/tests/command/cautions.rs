//! Warnings about scenes that run but probably contain a mistake.

use crate::place::{FALL, Place};

/// Returns the warnings of a scene; `check` and `run` must give the same.
fn warned(place: &Place) -> String {
    let told = place.cdem("check scene.toml").done().stderr();
    let run = place.cdem("run scene.toml").done().stderr();
    assert!(
        run.starts_with(&told),
        "check and run agree:\n{told}\n{run}"
    );
    let summary = place.read("scene-results/summary.json");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let kept = summary["warnings"].as_array().map_or(0, Vec::len);
    assert_eq!(kept, run.matches("warning:").count(), "{summary}");
    told
}

fn of(scene: &str) -> String {
    warned(&Place::with_scene(scene))
}

#[test]
fn a_good_scene_is_not_warned_of() {
    assert_eq!(of(FALL), "");
}

#[test]
fn a_key_of_a_model_that_is_not_chosen_is_told() {
    let model = "model = \"unified-node\"";
    let scene = FALL.replace(model, &format!("{model}\nmax_level = 3"));
    assert_ne!(scene, FALL);
    insta::assert_snapshot!(of(&scene));
}

/// A lumped quadrilateral alone has three times its moment of inertia.
#[test]
fn many_blocks_with_wrong_inertia_are_told_once() {
    let element = "element = \"quad4\"\nmaterial = \"rock\"\nvelocity";
    let split = |mass: &str| {
        let keys = format!("split = \"cells\"\nmass = \"{mass}\"\n{element}");
        let scene = FALL
            .replace(element, &keys)
            .replace("\"stone\"\npoint", "\"stone.1\"\npoint");
        assert_ne!(scene, FALL);
        scene
    };
    insta::assert_snapshot!(of(&split("lumped")));
    assert_eq!(of(&split("auto")), "");
}

#[test]
fn equal_warnings_of_many_tables_are_one_line() {
    let at = FALL.find("[contact]").expect("a table");
    let brick = |number: usize| {
        let (low, high) = (2.0 + number as f64, 2.5 + number as f64);
        format!(
            "[[block]]\nname = \"b{number}\"\n\
             shape = {{ box = {{ min = [{low}, 1.0], max = [{high}, 1.5], divisions = [1, 1] }} }}\n\
             element = \"quad4\"\nmaterial = \"rock\"\nmass = \"lumped\"\n\n"
        )
    };
    let with = |count: usize| {
        let bricks: String = (1..=count).map(brick).collect();
        of(&format!("{}{bricks}{}", &FALL[..at], &FALL[at..]))
    };
    insta::assert_snapshot!(with(34));
    insta::assert_snapshot!(with(3));
}

#[test]
fn fixed_blocks_may_overlap_each_other() {
    let wall = "[[block]]\nname = \"wall\"\n\
                shape = { box = { min = [1.5, -1.0], max = [2.0, 2.0], divisions = [1, 6] } }\n\
                material = \"rock\"\nfixed = true\n\n[contact]";
    assert_eq!(of(&FALL.replace("[contact]", wall)), "");
}

/// Two triangles without a common node, as Gmsh 2.2 writes them.
const APART: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
    $Nodes\n6\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 2 0 0\n5 3 0 0\n6 3 1 0\n$EndNodes\n\
    $Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 4 5 6\n$EndElements\n";

#[test]
fn parts_of_a_block_that_do_not_touch_each_other_are_told() {
    let shape = "shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }\nelement = \"quad4\"";
    let scene = FALL.replace(shape, "mesh = \"stone.msh\"\ntranslate = [0.0, 0.001]");
    assert_ne!(scene, FALL);
    let place = Place::with_scene(&scene);
    place.write("stone.msh", APART);
    insta::assert_snapshot!(warned(&place));

    let split = scene.replace("stone.msh\"", "stone.msh\"\nsplit = \"components\"");
    let place = Place::with_scene(&split);
    place.write("stone.msh", APART);
    assert_eq!(place.cdem("check scene.toml").done().stderr(), "");
}

#[test]
fn a_probe_far_from_its_block_is_told_with_the_distance() {
    insta::assert_snapshot!(of(
        &FALL.replace("point = [0.0, 0.0]", "point = [0.5, 3.501]")
    ));
    // Elements of 0.25 m, and a probe in the middle of one, or 0.2 m away.
    assert_eq!(
        of(&FALL.replace("point = [0.0, 0.0]", "point = [0.125, 0.126]")),
        ""
    );
    assert_eq!(
        of(&FALL.replace("point = [0.0, 0.0]", "point = [-0.2, 0.001]")),
        ""
    );
}

#[test]
fn a_tolerance_far_above_the_default_is_told() {
    // The shortest edge is 0.25 m; the default is a 1e-4th of it.
    let tolerant = |tolerance: &str| {
        let scene = FALL.replace(
            "[contact]",
            &format!("[contact]\ntolerance = \"{tolerance}\""),
        );
        assert_ne!(scene, FALL);
        of(&scene)
    };
    insta::assert_snapshot!(tolerant("0.5 mm"));
    assert_eq!(tolerant("0.2 mm"), "");
}

#[test]
fn contact_springs_too_stiff_for_the_step_are_told() {
    // The lightest nodes, at the corners of the stone, have 42 kg.
    let stiff = |normal: &str| {
        let springs =
            format!("model = \"penalty\"\nnormal_stiffness = {normal}\nshear_stiffness = 1e8");
        let scene = FALL.replace("model = \"unified-node\"", &springs);
        assert_ne!(scene, FALL);
        of(&scene)
    };
    insta::assert_snapshot!(stiff("1e11"));
    assert_eq!(stiff("1e8"), "");
}

#[test]
fn what_starts_after_the_end_is_told() {
    let late = "[[boundary]]\ngroup = \"stone.xmin\"\nvelocity = { x = 0.0 }\nstart = 0.5\n\n\
                [[load]]\ngroup = \"stone.ymax\"\npressure = 1e3\nstart = \"20 ms\"\n";
    insta::assert_snapshot!(of(&format!("{FALL}\n{late}")));
    let in_time = late.replace("0.5", "\"19 ms\"").replace("20 ms", "19 ms");
    assert_eq!(of(&format!("{FALL}\n{in_time}")), "");
}

#[test]
fn output_more_often_than_there_are_steps_is_told() {
    let often = FALL
        .replace("frames = 4", "frame_interval = \"0.5 ms\"")
        .replace("history = 10", "history_interval = \"1 us\"");
    insta::assert_snapshot!(of(&often));
}

#[test]
fn damping_that_shortens_the_step_is_named_as_the_reason() {
    let damped = |stiffness: &str| {
        let damping = format!("density = 2700.0\ndamping = {{ stiffness = {stiffness} }}");
        of(&FALL.replace("density = 2700.0", &damping))
    };
    insta::assert_snapshot!(damped("0.1"));
    assert_eq!(damped("1e-4"), "");
}

#[test]
fn waves_slower_or_faster_than_in_any_solid_are_told() {
    // Weight would crush such a soft block. So there is no gravity, and the scene is only checked.
    let floating = FALL.replace("[0.0, -9.81]", "[0.0, 0.0]");
    let mut told = String::new();
    for young_modulus in ["40.0", "\"40e4 GPa\""] {
        let scene = floating.replace("\"1 GPa\"", young_modulus);
        let place = Place::with_scene(&scene);
        told.push_str(&place.cdem("check scene.toml").done().stderr());
    }
    insta::assert_snapshot!(told);
}

#[test]
fn tensile_strength_without_cohesion_is_told() {
    let strong = |strengths: &str| FALL.replace("[contact]", &format!("[contact]\n{strengths}"));
    insta::assert_snapshot!(of(&strong("tensile_strength = 1e6")));
    assert_eq!(of(&strong("tensile_strength = 1e6\ncohesion = 1e6")), "");
}
