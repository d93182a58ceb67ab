//! The page of the book with every key of a scene, made from the schema.

use std::path::{Path, PathBuf};

use serde_json::Value;

const HEAD: &str = "# The scene, key by key

A scene is one [TOML](https://toml.io) file; [Scenes](../scenes.md) explains its parts. This page
is made from the schema that `cdem schema` prints, by
`cargo run --release -p cdem-verify -- --write`. Editors for TOML complete keys with the same
schema. A key without a default may be left out, unless it is *needed*. Quantities are plain
numbers in SI units, or text with a unit: `\"40 GPa\"`, `\"5 mm\"`.
";

/// Title of each table of the scene, and its name in the schema.
const TABLES: [(&str, &str); 15] = [
    ("At the top, before any table", ""),
    ("`[time]`", "Time"),
    ("`[time]`, `stop_when = { … }`", "StopWhen"),
    ("`[[material]]`", "Material"),
    ("`[[material]]`, `damping = { … }`", "Damping"),
    ("`[[block]]`", "Block"),
    ("`[[block]]`, `shape = { … }`", "Shape"),
    ("`[[block]]`, `shape = { box = { … } }`", "Cuboid"),
    ("`[[boundary]]`", "Boundary"),
    ("`[[boundary]]`, `velocity = { … }`", "Components"),
    ("`[[load]]`", "Load"),
    ("`[contact]`", "Contact"),
    ("`[[contact.pair]]`", "ContactPair"),
    ("`[output]`", "Output"),
    ("`[[probe]]`", "Probe"),
];

/// Returns the path and the text of the page.
#[must_use]
pub fn file() -> (PathBuf, String) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../book/src/reference");
    (folder.join("scene.md"), page(&cdem::scene::json_schema()))
}

fn page(schema: &Value) -> String {
    let mut text = HEAD.to_owned();
    for (title, name) in TABLES {
        let table = if name.is_empty() {
            schema
        } else {
            &schema["$defs"][name]
        };
        text.push_str(&section(title, table, schema));
    }
    text
}

fn section(title: &str, table: &Value, schema: &Value) -> String {
    let said = describe(table);
    let mut text = format!(
        "\n## {title}\n\n{said}\n\n| Key | Value | Default | Meaning |\n| --- | --- | --- | --- |\n"
    );
    let needed = table["required"].as_array().cloned().unwrap_or_default();
    let keys = table["properties"].as_object();
    for (key, value) in keys.into_iter().flatten() {
        let default = match &value["default"] {
            Value::Null if needed.contains(&Value::from(key.as_str())) => "*needed*".to_owned(),
            Value::Null => String::new(),
            default => format!("`{default}`"),
        };
        text.push_str(&format!(
            "| `{key}` | {} | {default} | {} |\n",
            kind(value, schema),
            in_a_cell(describe(value))
        ));
    }
    text
}

fn describe(value: &Value) -> &str {
    value["description"].as_str().unwrap_or_default()
}

/// Describes the values that a key accepts.
fn kind(value: &Value, schema: &Value) -> String {
    if let Some(reference) = value["$ref"].as_str() {
        let name = reference.rsplit('/').next().unwrap_or_default();
        let meant = &schema["$defs"][name];
        let choices = meant["oneOf"].as_array().or(meant["enum"].as_array());
        return match choices {
            Some(choices) => one_of(choices),
            None if meant["properties"].is_object() => "a table".to_owned(),
            None => in_a_cell(describe(meant)),
        };
    }
    if let Some(choices) = value["enum"].as_array() {
        return one_of(choices);
    }
    if let Some(ways) = value["anyOf"].as_array() {
        let ways = ways.iter().filter(|way| way["type"] != "null");
        let kinds: Vec<String> = ways.map(|way| kind(way, schema)).collect();
        return kinds.join("; or ");
    }
    match value["type"].as_str() {
        Some("array") => list(value, schema),
        Some("integer") => "a whole number".to_owned(),
        Some("number") => "a number".to_owned(),
        Some("string") => "text".to_owned(),
        Some("boolean") => "`true` or `false`".to_owned(),
        _ if !value["const"].is_null() => format!("`{}`", value["const"]),
        _ => "a table".to_owned(),
    }
}

fn list(value: &Value, schema: &Value) -> String {
    let items = &value["items"];
    if items["prefixItems"].is_array() {
        return "a table of `[time, value]`".to_owned();
    }
    let one = kind(items, schema);
    if one == "a table" {
        "tables".to_owned()
    } else {
        format!("a list, each {one}")
    }
}

/// Lists the choices, each as written in a scene, with its meaning if there is a description.
fn one_of(choices: &[Value]) -> String {
    let choice = |choice: &Value| {
        let written = choice.get("const").unwrap_or(choice);
        match describe(choice) {
            "" => format!("`{written}`"),
            said => format!("`{written}`: {}", in_a_cell(said.trim_end_matches('.'))),
        }
    };
    let all: Vec<String> = choices.iter().map(choice).collect();
    all.join("; ")
}

/// Escapes bars, which end cells, and brackets, which begin links.
fn in_a_cell(text: &str) -> String {
    text.replace('|', "\\|").replace('[', "\\[")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_of_the_schema_has_its_section() {
        let schema = cdem::scene::json_schema();
        let defs = schema["$defs"].as_object().expect("definitions");
        let tables = defs.iter().filter(|(_, def)| def["properties"].is_object());
        for (name, _) in tables {
            assert!(TABLES.iter().any(|(_, of)| of == name), "{name}");
        }
    }

    #[test]
    fn a_key_has_its_value_default_and_meaning() {
        let page = page(&cdem::scene::json_schema());
        let row = page.lines().find(|line| line.starts_with("| `safety` |"));
        let row = row.expect("a row of safety");
        assert!(row.contains("0.8") && row.contains("stable step"), "{row}");
    }
}
