//! The help and version texts of the command.

use crate::place::Place;

#[test]
fn help_is_given() {
    let place = Place::new();
    for command in ["", "run", "check", "resume", "new", "report", "schema"] {
        let told = place.cdem(&format!("{command} --help")).done().stdout();
        insta::assert_snapshot!(format!("help_{command}"), told);
    }
}

#[test]
fn no_command_is_answered_with_help() {
    let ended = Place::new().cdem("");
    assert_eq!(ended.status(), 2);
    assert!(
        ended.stderr().contains("Usage: cdem <COMMAND>"),
        "{}",
        ended.stderr()
    );
}

#[test]
fn a_slip_in_a_command_is_answered_with_the_nearest() {
    insta::assert_snapshot!(Place::new().cdem("runn scene.toml").told());
}

#[test]
fn the_version_is_told() {
    let told = Place::new().cdem("--version").done().stdout();
    assert_eq!(told, format!("cdem {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn the_schema_is_json() {
    let told = Place::new().cdem("schema").done().stdout();
    let schema: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    assert!(schema["properties"]["block"].is_object(), "{told}");
}
