//! Wrong calls and scenes: exit status 2, and nothing written.

use std::fs;
use std::path::Path;

use crate::place::{FALL, Place, names};

/// Runs a wrong scene, which must fail and leave no folder.
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

/// Every bad scene of the reader's tests, run by the command.
#[test]
fn every_bad_scene_ends_with_status_2_its_place_and_no_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cdem-io/tests/bad-scenes");
    let scenes = names(&folder);
    assert!(scenes.len() >= 90, "{} scenes", scenes.len());
    for name in scenes {
        let text = fs::read_to_string(folder.join(&name)).expect(&name);
        let told = refused(&text);
        let mut places = told.split("scene.toml:").skip(1);
        let is_place = |place: &str| {
            let mut numbers = place.split(|c: char| !c.is_ascii_digit());
            (0..2).all(|_| {
                numbers
                    .next()
                    .is_some_and(|n| n.parse::<u32>().is_ok_and(|n| n > 0))
            })
        };
        assert!(places.any(is_place), "{name}: line and column\n{told}");
        assert!(!told.contains("panicked"), "{name}:\n{told}");
    }
}

/// Two triangles of a square, as Gmsh 2.2 writes them.
const SQUARE: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
    $Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n\
    $Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n";

#[test]
fn bad_meshes_end_with_status_2_their_place_and_no_folder() {
    let scene = FALL.replace(
        "shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }\nelement = \"quad4\"",
        "mesh = \"stone.msh\"\ntranslate = [0.0, 0.001]",
    );
    let place = Place::with_scene(&scene);
    place.write("stone.msh", SQUARE);
    place.cdem("check scene.toml").done();
    let mut told = String::new();
    for (mistake, from, to) in [
        ("a flat element", "3 1 1 0", "3 2 0 0"),
        ("elements over each other", "1 1 3 4", "1 1 2 4"),
        ("a node of no element", "1 1 3 4", "1 1 3 2"),
        ("two nodes at one place", "4 0 1 0", "4 0 0 0"),
        ("out of the plane", "4 0 1 0", "4 0 1 0.5"),
        ("a node that is not there", "1 1 3 4", "1 1 3 5"),
        ("a node twice in an element", "1 1 3 4", "1 1 3 3"),
        ("a place that is none", "4 0 1 0", "4 0 nan 0"),
        ("a place beyond reason", "4 0 1 0", "4 0 1e300 0"),
        ("cut off", "$EndElements", ""),
        ("no element of the dimension", SQUARE, NO_ELEMENTS),
        ("another format", "2.2 0 8", "4.0 0 8"),
        ("second order", "1 2 2 1 1 1 2 3", "1 9 2 1 1 1 2 3 1 2 3"),
        ("a geometry", SQUARE, "Point(1) = {0, 0, 0};\n"),
    ] {
        assert!(SQUARE.contains(from), "{mistake}");
        place.write("stone.msh", &SQUARE.replacen(from, to, 1));
        let ended = place.cdem("run scene.toml");
        told.push_str(&format!("{mistake}: {}\n", ended.told()));
        assert_eq!(place.names("."), ["scene.toml", "stone.msh"], "{told}");
    }
    insta::assert_snapshot!(told);
}

/// A mesh of nodes without elements.
const NO_ELEMENTS: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
    $Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n0\n$EndElements\n";

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
fn parts_that_a_split_does_not_give_are_shown_where_they_are_named() {
    let names = [
        (
            "[contact]",
            "[[boundary]]\nblock = \"stone.9\"\nvelocity = { x = 0.0 }\n\n[contact]",
        ),
        (
            "[output]",
            "[[contact.pair]]\nbetween = [\"stone.1\", \"stone.55\"]\n\n\
             [output]\nblock_list = [\"ground\", \"stone.8\", \"stone.88\"]",
        ),
        ("block = \"stone\"\npoint", "block = \"stone.123\"\npoint"),
        (
            "velocity = [0.0, -1.0]",
            "velocity = [0.0, -1.0]\nsplit = \"cells\"",
        ),
    ];
    let scene = names
        .iter()
        .fold(FALL.to_owned(), |scene, (from, to)| scene.replace(from, to));
    insta::assert_snapshot!(refused(&scene));
}

#[test]
fn a_physical_group_that_is_not_there_is_shown_where_it_is_named() {
    let scene = FALL.replace(
        "shape = { box = { min = [0.0, 0.001], max = [1.0, 0.501], divisions = [4, 2] } }\nelement = \"quad4\"",
        "mesh = \"stone.msh\"\ngroup = \"crade\"",
    );
    let place = Place::with_scene(&scene);
    let mut told = String::new();
    let named =
        "$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"cradle\"\n1 2 \"crade\"\n$EndPhysicalNames\n";
    for (mistake, mesh) in [
        (
            "a slip",
            SQUARE.replace("$EndMeshFormat\n", &named.replace("\"crade\"", "\"base\"")),
        ),
        ("of curves", SQUARE.replace("$EndMeshFormat\n", named)),
        (
            "no groups",
            SQUARE
                .replace("2 2 1 1", "2 2 0 1")
                .replace("2 2 1 1", "2 2 0 1"),
        ),
    ] {
        place.write("stone.msh", &mesh);
        told.push_str(&format!(
            "{mistake}: {}\n",
            place.cdem("check scene.toml").told()
        ));
    }
    insta::assert_snapshot!(told);
}

#[test]
fn blocks_that_overlap_are_named() {
    insta::assert_snapshot!(refused(&FALL.replace("[0.0, 0.001]", "[0.0, -0.1]")));
    // If the overlap is a small part of an edge, the tolerance may be too tight.
    insta::assert_snapshot!(refused(
        &FALL.replace("[0.0, 0.001]", "[0.0, -0.012345678]")
    ));
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
    // In sequence they are allowed.
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
    let tiny = "shape = { polygon = [[0.0, 0.001], [1.0, 0.001], [0.0, 1.0]], size = 1.1e-4 }";
    insta::assert_snapshot!("tiny_elements", refused(&FALL.replace(box_of_stone, tiny)));
    // Very thin, with sides divided into a billion pieces.
    let thin =
        "shape = { polygon = [[0.0, 0.001], [1.0, 0.001], [1.0, 0.001000001]], size = 1e-9 }";
    insta::assert_snapshot!("thin_polygon", refused(&FALL.replace(box_of_stone, thin)));
    insta::assert_snapshot!(refused(&FALL.replace("frames = 4", "frames = 99999999999")));
    insta::assert_snapshot!(refused(&FALL.replace("20 ms", "1e300 s")));
}

#[test]
fn materials_for_which_no_step_is_short_enough_are_refused_at_once() {
    let stiff = |modulus: &str| {
        let damped = "2700.0\ndamping = { stiffness = 1e20 }";
        let scene = FALL.replace("\"1 GPa\"", modulus);
        refused(&scene.replace("2700.0", damped))
    };
    insta::assert_snapshot!(stiff("1e306"));
    // One element has a dense mass matrix.
    let scene = FALL.replace("divisions = [4, 2]", "divisions = [1, 1]");
    insta::assert_snapshot!(refused(&scene.replace("\"1 GPa\"", "1.7e308")));
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
