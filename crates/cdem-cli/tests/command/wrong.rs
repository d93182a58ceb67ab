//! Wrong calls and scenes: exit status 2, and nothing written.

use std::fs;

use crate::place::{FALL, Place};

/// Runs a wrong scene; it must fail and leave no folder.
fn refused(scene: &str) -> String {
    let place = Place::with_scene(scene);
    let ended = place.cdem("run scene.toml");
    assert_eq!(ended.status(), 2, "{}", ended.told());
    assert_eq!(place.names("."), ["scene.toml"], "nothing may be written");
    assert_eq!(
        place.cdem("check scene.toml").told(),
        ended.told(),
        "check and run agree"
    );
    ended.told()
}

#[test]
fn a_slip_in_a_scene_is_shown_where_it_is() {
    insta::assert_snapshot!(refused(&FALL.replace("poisson_ratio", "poison_ratio")));
}

#[test]
fn several_slips_are_shown_at_once() {
    let scene = FALL.replace("2700.0", "-1.0").replace("20 ms", "20 kg");
    insta::assert_snapshot!(refused(&scene));
}

#[test]
fn a_mesh_that_is_not_there_is_shown_where_it_is_named() {
    let scene = FALL.replace(
        "shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }\nelement = \"quad4\"",
        "mesh = \"stone.msh\"",
    );
    insta::assert_snapshot!(refused(&scene));
}

#[test]
fn a_group_that_is_not_there_is_shown_where_it_is_named() {
    let scene = format!("{FALL}\n[[boundary]]\ngroup = \"stone.xmn\"\nvelocity = {{ x = 0.0 }}\n");
    insta::assert_snapshot!(refused(&scene));
}

#[test]
fn blocks_that_overlap_are_named() {
    insta::assert_snapshot!(refused(&FALL.replace("[0.0, 0.001]", "[0.0, -0.1]")));
}

#[test]
fn a_block_faster_than_light_is_shown_where_it_is() {
    insta::assert_snapshot!(refused(&FALL.replace("[0.0, -1.0]", "[0.0, -1e300]")));
}

#[test]
fn where_nothing_moves_a_block_is_shown() {
    insta::assert_snapshot!(refused(
        &FALL.replace("velocity = [0.0, -1.0]", "fixed = true")
    ));
}

#[test]
fn blocks_that_could_meet_in_space_are_shown() {
    insta::assert_snapshot!(refused(SPACE));
}

#[test]
fn a_tolerance_as_long_as_edges_is_refused() {
    insta::assert_snapshot!(refused(
        &FALL.replace("[contact]", "[contact]\ntolerance = 0.2")
    ));
}

#[test]
fn boundary_conditions_that_contradict_each_other_are_named() {
    let two = "[[boundary]]\ngroup = \"stone.xmin\"\nvelocity = { x = 0.0, y = 0.0 }\n\n\
               [[boundary]]\ngroup = \"stone.ymin\"\nvelocity = { x = 0.0, y = 1.0 }\n";
    insta::assert_snapshot!(refused(&format!("{FALL}\n{two}")));
    // One after the other they may.
    let place = Place::with_scene(&format!(
        "{FALL}\n{}start = \"1 ms\"\n",
        two.replacen("y = 0.0 }", "y = 0.0 }\nend = \"1 ms\"", 1)
    ));
    place.cdem("check scene.toml").done();
}

#[test]
fn a_load_on_a_block_is_pointed_to_its_groups() {
    insta::assert_snapshot!(refused(&format!(
        "{FALL}\n[[load]]\nblock = \"stone\"\npressure = 1.0\n"
    )));
}

#[test]
fn counts_and_sizes_beyond_reason_are_refused_at_once() {
    let box_of_stone = "shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }\nelement = \"quad4\"";
    let polygon = "shape = { polygon = [[0.0, 0.001], [1e200, 0.001], [0.0, 1e200]], size = 0.1 }";
    insta::assert_snapshot!(refused(&FALL.replace(box_of_stone, polygon)));
    insta::assert_snapshot!(refused(&FALL.replace("frames = 4", "frames = 99999999999")));
    insta::assert_snapshot!(refused(&FALL.replace("20 ms", "1e300 s")));
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_printed_is_no_success() {
    let place = Place::with_scene(FALL);
    let full = fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("Linux has it");
    let output = place.command(["check", "scene.toml"]).stdout(full).output();
    let output = output.expect("the command runs");
    assert_eq!(output.status.code(), Some(3));
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("cannot write to standard output"), "{told}");
}

/// Two blocks in space.
const SPACE: &str = r#"
version = 1
dimension = 3

[time]
end = "1 ms"

[[material]]
name = "rock"
young_modulus = "1 GPa"
poisson_ratio = 0.2
density = 2700.0

[[block]]
name = "below"
shape = { box = { min = [0.0, 0.0, 0.0], max = [1.0, 1.0, 1.0], divisions = [1, 1, 1] } }
material = "rock"

[[block]]
name = "above"
shape = { box = { min = [0.0, 0.0, 2.0], max = [1.0, 1.0, 3.0], divisions = [1, 1, 1] } }
material = "rock"
"#;

#[test]
fn a_scene_that_is_not_there_is_named() {
    let place = Place::new();
    insta::assert_snapshot!(place.cdem("run nowhere.toml").told());
    assert!(place.names(".").is_empty());
}

#[test]
fn no_threads_are_too_few() {
    let place = Place::with_scene(FALL);
    insta::assert_snapshot!(place.cdem("run scene.toml --threads 0").told());
}

#[test]
fn a_folder_with_something_in_it_is_refused_even_by_force() {
    let place = Place::with_scene(FALL);
    fs::create_dir(place.path("thesis")).expect("made");
    place.write("thesis/chapter.tex", "years of work");
    for force in ["", "--force"] {
        let told = place
            .cdem(&format!("run scene.toml -o thesis {force}"))
            .told();
        insta::assert_snapshot!("a_foreign_folder", told);
        assert_eq!(place.names("thesis"), ["chapter.tex"]);
    }
}

#[test]
fn an_earlier_run_is_kept_without_force() {
    let place = Place::with_scene(FALL);
    place.cdem("run scene.toml").done();
    let before = place.read("scene-results/summary.json");
    insta::assert_snapshot!(place.cdem("run scene.toml").told());
    assert_eq!(place.read("scene-results/summary.json"), before);
    place.cdem("run scene.toml --force").done();
    assert_ne!(
        place.read("scene-results/summary.json"),
        before,
        "it has new timings"
    );
}

#[test]
fn a_wrong_scene_does_not_replace_an_earlier_run() {
    let place = Place::with_scene(FALL);
    place.cdem("run scene.toml").done();
    let before = place.names("scene-results");
    place.write("scene.toml", &FALL.replace("[0.0, 0.001]", "[0.0, -0.1]"));
    assert_eq!(place.cdem("run scene.toml --force").status(), 2);
    assert_eq!(place.names("scene-results"), before);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let place = Place::with_scene(FALL);
    let ended = place.cdem("run scene.toml -o scene.toml/results");
    assert_eq!(ended.status(), 2, "{}", ended.told());
    assert!(
        ended.stderr().contains("scene.toml/results"),
        "{}",
        ended.told()
    );
}
