//! JSON Schema of a scene, for editors and for other programs.

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::Value;

use crate::scene::{Help, input};

/// Returns the JSON Schema (draft 2020-12) of a scene file, with units and defaults.
#[must_use]
pub fn json_schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<input::SceneInput>();
    RecursiveTransform(tidy).transform(&mut schema);
    schema.to_value()
}

/// Removes null from the schema: TOML has no null, so a key that is left out is absent. Removes
/// defaults of whole tables, which repeat those of their keys.
fn tidy(schema: &mut Schema) {
    if schema
        .get("default")
        .is_some_and(|value| value.is_null() || value.is_object())
    {
        schema.remove("default");
    }
    // Line breaks in doc comments are for the source, not for editors.
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace('\n', " ");
    }
    if let Some(Value::Array(types)) = schema.get_mut("type") {
        types.retain(|name| name != "null");
        if let [single] = types.as_slice() {
            let single = single.clone();
            schema.insert("type".to_owned(), single);
        }
    }
    if let Some(Value::Array(forms)) = schema.get_mut("anyOf") {
        forms.retain(|form| form.get("type").is_none_or(|name| name != "null"));
        if let [Value::Object(single)] = forms.as_slice() {
            let single = single.clone();
            schema.remove("anyOf");
            for (key, value) in single {
                schema.ensure_object().entry(key).or_insert(value);
            }
        }
    }
}

/// Returns advice on the table that a key belongs to: keys often end up below the header of another
/// table.
pub(super) fn home(key: &str) -> Option<Help> {
    let schema = json_schema();
    let has = |table: &Value| table["properties"].get(key).is_some();
    if has(&schema) {
        return Some(Help {
            in_file: "it belongs at the top, before the first [table]".to_owned(),
            in_program: "it belongs to the scene itself".to_owned(),
        });
    }
    let tables = [
        ("Time", "[time]", "`time`"),
        ("Material", "[[material]]", "`material`"),
        ("Block", "[[block]]", "`block`"),
        ("Boundary", "[[boundary]]", "`boundary`"),
        ("Load", "[[load]]", "`load`"),
        ("Contact", "[contact]", "`contact`"),
        ("Output", "[output]", "`output`"),
        ("Probe", "[[probe]]", "`probe`"),
    ];
    let found = tables
        .iter()
        .filter(|(name, ..)| has(&schema["$defs"][name]));
    let (headers, names): (Vec<_>, Vec<_>) = found
        .map(|(_, header, name)| (format!("in {header}"), format!("in {name}")))
        .unzip();
    (!names.is_empty()).then(|| Help {
        in_file: format!("it belongs {}", headers.join(" or ")),
        in_program: format!("it belongs {}", names.join(" or ")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_a_home() {
        for (key, in_file, in_program) in [
            (
                "gravity",
                "at the top, before the first [table]",
                "to the scene itself",
            ),
            ("safety", "in [time]", "in `time`"),
            ("checkpoint", "in [output]", "in `output`"),
            (
                "model",
                "in [[material]] or in [contact]",
                "in `material` or in `contact`",
            ),
        ] {
            let help = home(key).expect(key);
            assert_eq!(help.in_file, format!("it belongs {in_file}"));
            assert_eq!(help.in_program, format!("it belongs {in_program}"));
        }
        assert_eq!(home("colour"), None);
    }

    /// Visits all values at any depth.
    fn walk<'a>(value: &'a Value, see: &mut dyn FnMut(&'a Value)) {
        see(value);
        match value {
            Value::Array(items) => items.iter().for_each(|item| walk(item, see)),
            Value::Object(table) => table.values().for_each(|item| walk(item, see)),
            _ => {}
        }
    }

    #[test]
    fn every_key_is_described_and_none_is_null() {
        let schema = json_schema();
        let mut keys = 0;
        walk(&schema, &mut |value| {
            assert!(!value.is_null() && value != "null");
            let Some(Value::Object(properties)) = value.get("properties") else {
                return;
            };
            for (key, property) in properties {
                let described =
                    property.get("description").is_some() || property.get("$ref").is_some();
                assert!(described, "{key}: {property}");
                keys += 1;
            }
            assert_eq!(value.get("additionalProperties"), Some(&Value::Bool(false)));
        });
        assert!(keys > 90, "{keys} keys");
    }
}
