//! Bad scenes with one mistake each, and their messages. To accept new messages:
//! `INSTA_UPDATE=always cargo test --package cdem-io --test bad_scenes`.

use std::path::{Path, PathBuf};

use cdem::scene::Scene;
use cdem_io::scene::{SceneError, parse, read, write};
use proptest::prelude::*;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests")
        .join(name)
}

fn scenes(name: &str) -> Vec<(String, String)> {
    let entries = std::fs::read_dir(folder(name)).expect(name);
    let read = |path: PathBuf| {
        let name = path.file_name()?.to_str()?.to_owned();
        Some((name, std::fs::read_to_string(path).ok()?))
    };
    let mut scenes: Vec<_> = entries
        .filter_map(|entry| read(entry.ok()?.path()))
        .collect();
    scenes.sort();
    scenes
}

#[test]
fn each_mistake_is_shown_where_it_is() {
    let (mut all, mut miscounted) = (String::new(), Vec::new());
    let scenes = scenes("bad-scenes");
    assert!(scenes.len() >= 90, "{} scenes", scenes.len());
    for (name, text) in scenes {
        let error = parse(&text, Path::new(&name)).expect_err(&name);
        let SceneError::Invalid(problems) = &error else {
            panic!("{name}: {error}")
        };
        let expected = match name.as_str() {
            "unit-of-another-country.toml" => 2,
            "keys-of-textbooks.toml" => 3,
            "several-at-once.toml" => 4,
            _ => 1,
        };
        if problems.len() != expected {
            miscounted.push(name);
        }
        all.push_str(&error.render(false));
        all.push('\n');
    }
    insta::assert_snapshot!(all);
    assert!(miscounted.is_empty(), "one mistake in each: {miscounted:?}");
}

#[test]
fn keys_of_a_model_that_is_not_chosen_are_warnings() {
    let text = |contact: &str| {
        format!(
            "dimension = 2\n[time]\nend = 1\n\
             [[material]]\nname = \"rock\"\nyoung_modulus = 1e9\npoisson_ratio = 0.2\n\
             density = 2e3\n\
             [[block]]\nname = \"a\"\nmaterial = \"rock\"\n\
             shape = {{ box = {{ min = [0, 0], max = [1, 1], divisions = [1, 1] }} }}\n\
             [contact]\n{contact}"
        )
    };
    let told = |contact: &str| {
        let scene = parse(&text(contact), Path::new("a.toml"))
            .expect("valid")
            .scene;
        assert_eq!(scene.version, 1);
        let written = parse(&write(&scene), Path::new("a.toml"))
            .expect("valid")
            .scene;
        let lines = scene.warnings.iter().map(ToString::to_string);
        let lines = lines.collect::<Vec<_>>();
        let read = Scene {
            warnings: Vec::new(),
            ..scene
        };
        assert_eq!(written, read, "keys without effect are not written");
        lines
    };
    assert_eq!(told("max_level = 2"), [""; 0]);
    assert_eq!(
        told(
            "model = \"unified-node\"\nmax_level = 2\nzone = \"wavefront\"\n\
             normal_stiffness = 1e9\n\
             [[contact.pair]]\nbetween = [\"rock\", \"rock\"]\nshear_stiffness = 1e9\n"
        ),
        [
            "contact.max_level: has no effect unless contact.model = \"two-scale\"",
            "contact.zone: has no effect unless contact.model = \"two-scale\"",
            "contact.normal_stiffness: has no effect unless contact.model = \"penalty\"",
            "contact.pair[0].shear_stiffness: has no effect unless contact.model = \"penalty\"",
        ]
    );
}

#[test]
fn the_short_form_is_a_line_for_each_problem() {
    let text =
        "version = 1\ndimension = 2\n[time]\nend = -1\nsafety = 3\n[[block]]\nname = \"a\"\n";
    let error = parse(text, Path::new("a.toml")).expect_err("wrong");
    let lines: Vec<String> = error.to_string().lines().map(str::to_owned).collect();
    assert_eq!(
        lines,
        [
            "a.toml:4:7: time.end: must be larger than 0, got -1 s",
            "a.toml:5:10: time.safety: must be larger than 0 and at most 1, got 3",
            "a.toml:6:1: block[0]: needs `mesh` or `shape`",
            "a.toml:6:1: block[0].material: this key is missing (for example: material = \"rock\")",
        ]
    );
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = read(Path::new("no-such-scene.toml")).expect_err("no file");
    assert!(
        error
            .to_string()
            .starts_with("cannot read the scene no-such-scene.toml: "),
        "{error}"
    );
    assert_eq!(error.render(true), format!("{error}\n"));
}

#[test]
fn a_folder_with_a_scene_is_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("scene.toml"), "").expect("written");
    let error = read(folder.path()).expect_err("a folder").to_string();
    let hint = folder.path().join("scene.toml").display().to_string();
    assert!(error.ends_with(&format!("did you mean {hint}?")), "{error}");
}

/// A random change, as typing errors and disk errors make.
#[derive(Clone, Debug)]
enum Change {
    Remove(usize, usize),
    Insert(usize, String),
    Repeat(usize, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let piece = prop_oneof![
        Just("-1".to_owned()),
        Just("\"5 mm\"".to_owned()),
        Just("[[block]]\n".to_owned()),
        Just("[".to_owned()),
        Just("nan".to_owned()),
        Just("é\u{0}".to_owned()),
        "\\PC{0,6}",
    ];
    prop_oneof![
        (any::<usize>(), 1..40_usize).prop_map(|(at, length)| Change::Remove(at, length)),
        (any::<usize>(), piece).prop_map(|(at, text)| Change::Insert(at, text)),
        (any::<usize>(), 1..60_usize).prop_map(|(at, length)| Change::Repeat(at, length)),
    ]
}

fn changed(text: &str, changes: &[Change]) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for change in changes {
        let place = |at: usize| at % (chars.len() + 1);
        let end = |at: usize, length: usize| (at + length).min(chars.len());
        match change {
            Change::Remove(at, length) => {
                let at = place(*at);
                drop(chars.drain(at..end(at, *length)));
            }
            Change::Insert(at, text) => {
                let at = place(*at);
                drop(chars.splice(at..at, text.chars()));
            }
            Change::Repeat(at, length) => {
                let at = place(*at);
                let copy = chars[at..end(at, *length)].to_vec();
                drop(chars.splice(at..at, copy));
            }
        }
    }
    chars.into_iter().collect()
}

proptest! {
    #[test]
    fn damaged_scenes_never_panic(
        which in 0..2_usize, changes in prop::collection::vec(change(), 1..6),
    ) {
        let (_, text) = &scenes("scenes")[which];
        let text = changed(text, &changes);
        if let Err(error) = parse(&text, Path::new("damaged.toml")) {
            prop_assert!(error.to_string().contains("damaged.toml:"));
            prop_assert!(!error.render(false).is_empty());
        }
    }
}
