//! What readers make of files that are wrong, cut short, or changed: the seeds of the fuzz
//! targets in `fuzz/`.

use std::path::Path;

use cdem_verify::{Random, readers};

/// Files of a folder of the repository with an ending, in order.
fn files(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(folder);
    let entries = std::fs::read_dir(&folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let wanted = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == ending);
    let mut paths: Vec<_> = paths.filter(wanted).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{}", folder.display());
    let read = |path| std::fs::read(path).expect("a file");
    paths.into_iter().map(read).collect()
}

/// Gives a reader files as they are, cut short, and with some bytes changed.
fn tease(files: &[Vec<u8>], read: fn(&[u8])) {
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
        &files("crates/cdem-io/tests/bad-scenes", "toml"),
        readers::scene,
    );
    tease(
        &files("crates/cdem-io/tests/scenes", "toml"),
        readers::scene,
    );
}

#[test]
fn any_mesh_is_a_mesh_or_an_error() {
    tease(&files("crates/cdem-io/tests/meshes", "msh"), readers::mesh);
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
