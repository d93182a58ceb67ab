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
