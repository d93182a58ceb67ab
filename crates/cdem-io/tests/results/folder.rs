//! The folders that a run may write to.

use std::fs;

use cdem::scene::Cadence;
use cdem_io::results::{Folder, Recorder, ResultsError};

use crate::fake::{Place, names, scene};

fn claim(place: &Place, force: bool) -> Result<Folder, ResultsError> {
    Folder::claim(&place.results(), &place.scene(), force)
}

fn refused(place: &Place, force: bool) -> String {
    let error = claim(place, force).expect_err("must be refused");
    error
        .to_string()
        .replace(&place.results().display().to_string(), "DIR")
}

#[test]
fn results_lie_beside_the_scene() {
    let beside = |scene: &str| Folder::beside(scene.as_ref()).display().to_string();
    assert_eq!(beside("a/b/scene.toml"), "a/b/scene-results");
    assert_eq!(beside("wall.v2.toml"), "wall.v2-results");
}

#[test]
fn claiming_touches_nothing() {
    let place = Place::new();
    claim(&place, false).expect("free");
    assert!(!place.results().exists());
    fs::create_dir(place.results()).expect("made");
    claim(&place, false).expect("an empty folder is free");
    assert!(names(&place.results()).is_empty());
}

#[test]
fn an_earlier_run_is_replaced_only_by_force() {
    let place = Place::new();
    let scene = scene(Cadence::Count(10), Cadence::Count(5));
    place.run(&scene, false);
    fs::write(place.results().join("report.html"), "").expect("written");
    let before = names(&place.results());
    assert_eq!(
        refused(&place, false),
        "the results folder DIR contains an earlier run"
    );
    claim(&place, true).expect("an earlier run may be replaced");
    assert_eq!(names(&place.results()), before, "claiming touches nothing");

    drop(place.recorder(&scene, true));
    assert_eq!(place.read("history.csv").lines().count(), 1);
    assert!(names(&place.results().join("frames")).is_empty());
    assert!(!names(&place.results()).contains(&"summary.json".to_owned()));
}

#[test]
fn a_killed_run_may_be_replaced() {
    let place = Place::new();
    drop(place.recorder(&scene(Cadence::Count(10), Cadence::Count(5)), false));
    fs::write(place.results().join("frames/00000.vtu.unfinished"), "").expect("written");
    fs::write(place.results().join("frames.pvd.unfinished"), "").expect("written");
    claim(&place, true).expect("an earlier run may be replaced");
}

#[test]
fn nothing_but_a_run_is_ever_replaced() {
    let place = Place::new();
    let foreign = |entry: &str| {
        let because = format!("the results folder DIR is not empty: {entry} is no file of a run");
        for force in [false, true] {
            assert_eq!(refused(&place, force), because);
        }
    };
    let results = place.results();
    fs::create_dir(&results).expect("made");
    fs::write(results.join("thesis.tex"), "years of work").expect("written");
    foreign("thesis.tex");

    // File names of a run do not make a folder a results folder.
    fs::remove_file(results.join("thesis.tex")).expect("removed");
    fs::write(results.join("history.csv"), "year,battle\n1066,Hastings\n").expect("written");
    foreign("history.csv");
    fs::remove_file(results.join("history.csv")).expect("removed");

    // Other entries in a results folder are not part of the run.
    place.run(&scene(Cadence::Count(10), Cadence::Count(5)), false);
    for entry in [
        "notes.txt",
        "frames/picture.png",
        "frames/1.vtu",
        "contacts/00000.vtu",
    ] {
        fs::write(results.join(entry), "").expect("written");
        foreign(entry);
        fs::remove_file(results.join(entry)).expect("removed");
    }
    for entry in ["sub", "frames/00007.vtu", "probes.csv"] {
        let path = results.join(entry);
        let _ = fs::remove_file(&path);
        fs::create_dir(&path).expect("made");
        foreign(entry);
        fs::remove_dir(&path).expect("removed");
    }
}

#[cfg(unix)]
#[test]
fn links_out_of_a_run_are_not_followed() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(10), Cadence::Count(0)), false);
    let outside = place.results().with_file_name("outside");
    fs::create_dir(&outside).expect("made");
    fs::write(outside.join("00000.vtu"), "precious").expect("written");
    fs::remove_dir(place.results().join("frames")).expect("removed");
    std::os::unix::fs::symlink(&outside, place.results().join("frames")).expect("linked");
    assert_eq!(
        refused(&place, true),
        "the results folder DIR is not empty: frames is no file of a run"
    );
}

#[test]
fn a_file_is_no_folder() {
    let place = Place::new();
    fs::write(place.results(), "").expect("written");
    assert_eq!(refused(&place, true), "the results folder DIR is a file");
}

#[test]
fn the_scene_is_never_replaced_by_its_run() {
    let place = Place::new();
    place.run(&scene(Cadence::Count(10), Cadence::Count(5)), false);
    let scene = place.results().join("scene.toml");
    let error = Folder::claim(&place.results(), &scene, true).expect_err("must be refused");
    assert!(
        error.to_string().ends_with("contains the scene itself"),
        "{error}"
    );
}

#[cfg(unix)]
#[test]
fn a_disk_that_refuses_is_named() {
    let place = Place::new();
    // Nobody can create a folder inside a file.
    let inside = place.scene().join("results");
    let error = Folder::claim(&inside, &place.scene(), false).expect_err("must be refused");
    assert!(
        error.to_string().contains(&inside.display().to_string()),
        "{error}"
    );
}

#[test]
fn a_folder_that_cannot_be_prepared_says_whether_it_was_touched() {
    let place = Place::new();
    let scene = scene(Cadence::Count(10), Cadence::Count(5));
    let create = |folder: &Folder| {
        let folder = Recorder::create(folder, &scene, &place.scene());
        folder.err().expect("must fail").touched
    };
    let free = claim(&place, false).expect("free");
    fs::write(place.results(), "in the way").expect("written");
    assert!(!create(&free));
    fs::remove_file(place.results()).expect("removed");
    fs::create_dir_all(place.results().join("history.csv")).expect("made");
    assert!(!create(&free));
    fs::remove_dir(place.results().join("history.csv")).expect("removed");
    fs::create_dir(place.results().join("blocks.csv")).expect("made");
    assert!(create(&free));

    fs::remove_dir_all(place.results()).expect("removed");
    place.run(&scene, false);
    let earlier = claim(&place, true).expect("an earlier run may be replaced");
    fs::write(place.results().join("frames/late.txt"), "").expect("written");
    assert!(create(&earlier), "files of the earlier run are gone");
}
