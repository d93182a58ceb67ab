//! Readers given wrong, truncated or changed files, which are the seeds of the fuzz targets in
//! `fuzz/`.

use std::path::{Path, PathBuf};

use cdem_verify::{Random, load, readers};

/// Reads the files of a folder of the repository, sorted; only those with the extension `ending`,
/// if given.
fn files(folder: &str, ending: Option<&str>) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    let entries = std::fs::read_dir(&folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let wanted = |path: &PathBuf| ending.is_none_or(|e| path.extension() == Some(e.as_ref()));
    let mut paths: Vec<_> = paths.filter(wanted).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{}", folder.display());
    let read = |path| std::fs::read(path).expect("a file");
    paths.into_iter().map(read).collect()
}

/// A reader under test.
type Read = fn(&[u8]);

/// Gives a reader the files unchanged, truncated, and with some bytes changed.
fn tease(files: &[Vec<u8>], read: Read) {
    let mut random = Random(5);
    for file in files {
        read(file);
        for _ in 0..20 {
            let mut bytes = file.clone();
            bytes.truncate(random.whole(0, file.len()));
            read(&bytes);
            let mut bytes = file.clone();
            for _ in 0..random.whole(1, 4).min(file.len()) {
                let place = random.whole(0, file.len() - 1);
                bytes[place] = random.whole(0, 255) as u8;
            }
            read(&bytes);
        }
    }
}

#[test]
fn any_scene_is_a_scene_or_an_error() {
    tease(
        &files("crates/cdem-io/tests/bad-scenes", Some("toml")),
        readers::scene,
    );
    tease(
        &files("crates/cdem-io/tests/scenes", Some("toml")),
        readers::scene,
    );
}

#[test]
fn any_mesh_is_a_mesh_or_an_error() {
    for folder in ["meshes", "bad-meshes"] {
        let folder = format!("crates/cdem-io/tests/{folder}");
        tease(&files(&folder, Some("msh")), readers::mesh);
    }
}

#[test]
fn any_mesh_of_a_start_is_one_of_a_run_or_an_error() {
    let meshes = ["shot", "shot-3d"].map(|name| load(name).start().mesh());
    let starts = meshes.map(|mesh| postcard::to_stdvec(&mesh).expect("bytes"));
    tease(&starts, readers::start);
}

#[test]
fn any_checkpoint_is_a_state_or_an_error() {
    let mut run = readers::run();
    let mut states = vec![run.checkpoint()];
    for _ in 0..680 {
        run.step().expect("a step");
    }
    states.push(run.checkpoint());
    tease(&states, readers::checkpoint);
}

/// Replays the inputs found by fuzzing; each takes a different path through a reader.
#[test]
fn inputs_that_fuzzing_has_found_are_read_or_refused() {
    let targets: [(&str, Read); 4] = [
        ("scene", readers::scene),
        ("mesh", readers::mesh),
        ("start", readers::start),
        ("checkpoint", readers::checkpoint),
    ];
    for (target, read) in targets {
        for input in files(&format!("fuzz/corpus/{target}"), None) {
            read(&input);
        }
    }
}
