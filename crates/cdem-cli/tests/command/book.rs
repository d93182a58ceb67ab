//! Commands that the book tells a reader to type.

use std::fs;
use std::path::{Path, PathBuf};

use crate::place::Place;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns all pages below a folder, sorted.
fn pages(folder: &Path) -> Vec<PathBuf> {
    let mut pages = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the book") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            pages.extend(self::pages(&path));
        } else if path.extension().is_some_and(|ending| ending == "md") {
            pages.push(path);
        }
    }
    pages.sort();
    pages
}

/// Returns the `cdem` commands in the blocks marked `sh` of a page, without comments.
fn commands(text: &str) -> Vec<String> {
    let (mut commands, mut inside) = (Vec::new(), false);
    for line in text.lines() {
        if let Some(mark) = line.strip_prefix("```") {
            inside = mark == "sh" && !inside;
        } else if inside && let Some(command) = line.strip_prefix("cdem ") {
            let command = command.split(" #").next().unwrap_or_default();
            commands.push(command.trim().to_owned());
        }
    }
    commands
}

#[test]
fn commands_are_those_of_blocks_to_type() {
    let text = "```sh\ncdem new a b   # writes it\n./test\n```\n```sh,slow\ncdem run x\n```\n\
                ```toml\ncdem no\n```\n```sh\ncdem run b\n```\n";
    assert_eq!(commands(text), ["new a b", "run b"]);
}

/// `cargo run` needs a program name if there are several programs.
#[test]
fn the_first_command_of_the_readme_means_one_program() {
    let readme = fs::read_to_string(root().join("README.md")).expect("a file");
    assert!(readme.contains("\ncargo run --release -- run examples/"));
    let cargo = std::process::Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version=1"])
        .current_dir(root())
        .output()
        .expect("cargo");
    let workspace: serde_json::Value = serde_json::from_slice(&cargo.stdout).expect("JSON");
    let defaults = workspace["workspace_default_members"].as_array();
    let is_default = |package: &&serde_json::Value| {
        defaults.is_some_and(|members| members.contains(&package["id"]))
    };
    let packages = workspace["packages"].as_array().expect("packages");
    let targets = packages.iter().filter(is_default);
    let targets = targets.flat_map(|package| package["targets"].as_array().expect("targets"));
    let programs = targets.filter(|target| target["kind"][0] == "bin");
    let names: Vec<_> = programs.map(|program| &program["name"]).collect();
    assert_eq!(names, ["cdem"]);
}

/// Each page has a folder of its own; its commands run one after another. A run over old results
/// takes as long as the first one, so one page shows it for all.
#[test]
fn every_command_of_the_book_does_what_it_is_told() {
    let (mut count, mut has_overwritten) = (0, false);
    for page in pages(&root().join("book/src")) {
        let text = fs::read_to_string(&page).expect("a page");
        let place = Place::new();
        for command in commands(&text) {
            if command.ends_with("--force") && std::mem::replace(&mut has_overwritten, true) {
                continue;
            }
            place.cdem(&command).done();
            count += 1;
        }
    }
    assert!(count >= 20, "{count} commands");
}
