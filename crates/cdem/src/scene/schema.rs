//! JSON Schema of a scene, for editors and for other programs.

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::Value;

use super::input;

/// JSON Schema (draft 2020-12) of a scene file, with units and defaults.
#[must_use]
pub fn json_schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<input::Scene>();
    RecursiveTransform(tidy).transform(&mut schema);
    schema.to_value()
}

/// A key that is left out is not there: TOML has no null. Defaults of whole
/// tables repeat those of their keys.
fn tidy(schema: &mut Schema) {
    if schema
        .get("default")
        .is_some_and(|value| value.is_null() || value.is_object())
    {
        schema.remove("default");
    }
    // Comments are broken into lines for the source, not for editors.
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

/// Where a key belongs: keys often slip below the header of another table.
pub(super) fn home(key: &str) -> Option<String> {
    let schema = json_schema();
    let has = |table: &Value| table["properties"].get(key).is_some();
    if has(&schema) {
        return Some("at the top, before the first [table]".to_owned());
    }
    let tables = [
        ("Time", "in [time]"),
        ("Material", "in [[material]]"),
        ("Block", "in [[block]]"),
        ("Boundary", "in [[boundary]]"),
        ("Load", "in [[load]]"),
        ("Contact", "in [contact]"),
        ("Output", "in [output]"),
        ("Probe", "in [[probe]]"),
    ];
    let found = tables
        .iter()
        .filter(|(name, _)| has(&schema["$defs"][name]));
    let places: Vec<&str> = found.map(|(_, place)| *place).collect();
    (!places.is_empty()).then(|| places.join(" or "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_a_home() {
        for (key, place) in [
            ("gravity", Some("at the top, before the first [table]")),
            ("safety", Some("in [time]")),
            ("checkpoint", Some("in [output]")),
            ("model", Some("in [[material]] or in [contact]")),
            ("colour", None),
        ] {
            assert_eq!(home(key).as_deref(), place);
        }
    }

    /// All values at any depth.
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
