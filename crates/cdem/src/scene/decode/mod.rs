//! Decodes a tree of values into typed input; errors carry the path of the value at fault.
//!
//! The deserializer walks a JSON tree, so scenes from TOML text and from a program's dictionaries
//! give the same messages.

pub(crate) mod fault;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde::forward_to_deserialize_any;
use serde_json::Value;

use crate::scene::decode::fault::{Count, Fault, quoted};
use crate::scene::key_path::Step;
use crate::scene::{Help, KeyPath, Problem};

/// Reads `value` as a `T`.
///
/// # Errors
/// All wrong keys and values. After each error the value at fault is removed and the rest is read
/// again.
pub(super) fn decode<T: DeserializeOwned>(mut value: Value) -> Result<T, Vec<Problem>> {
    let mut problems = Vec::new();
    loop {
        let problem = match T::deserialize(Node::root(&value)) {
            Ok(read) if problems.is_empty() => return Ok(read),
            Ok(_) => return Err(problems),
            Err(fault) => fault.into_problem(),
        };
        let removed = remove(&mut value, problem.path.steps());
        problems.push(problem);
        if !removed {
            return Err(problems);
        }
    }
}

/// Removes the innermost table entry on the path `steps`; returns true if there was one. Array
/// items stay, because later paths contain their indices.
fn remove(value: &mut Value, steps: &[Step]) -> bool {
    let inner = match (steps.first(), &mut *value) {
        (Some(Step::Key(key)), Value::Object(table)) => table.get_mut(key),
        (Some(Step::Index(index)), Value::Array(items)) => items.get_mut(*index),
        _ => None,
    };
    let Some(inner) = inner else { return false };
    if remove(inner, &steps[1..]) {
        return true;
    }
    match (&steps[0], value) {
        (Step::Key(key), Value::Object(table)) => table.remove(key).is_some(),
        _ => false,
    }
}

/// A value with its path, while it is deserialized.
struct Node<'a> {
    value: &'a Value,
    path: KeyPath,
}

impl<'a> Node<'a> {
    const fn root(value: &'a Value) -> Self {
        Self {
            value,
            path: KeyPath::root(),
        }
    }

    fn read<T: DeserializeSeed<'a>>(self, seed: T) -> Result<T::Value, Fault> {
        let path = self.path.clone();
        seed.deserialize(self).map_err(|fault| fault.at(&path))
    }

    fn unexpected(&self) -> Unexpected<'a> {
        match self.value {
            Value::Null => Unexpected::Unit,
            Value::Bool(value) => Unexpected::Bool(*value),
            Value::Number(number) => match (number.as_i64(), number.as_f64()) {
                (Some(whole), _) => Unexpected::Signed(whole),
                (None, value) => Unexpected::Float(value.unwrap_or(f64::NAN)),
            },
            Value::String(text) => Unexpected::Str(text),
            Value::Array(_) => Unexpected::Seq,
            Value::Object(_) => Unexpected::Map,
        }
    }

    fn wrong(&self, expected: &str) -> Fault {
        Fault::invalid_type(self.unexpected(), &expected).at(&self.path)
    }

    fn visit<V: Visitor<'a>>(&self, visitor: V) -> Result<V::Value, Fault> {
        match self.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(*value),
            Value::Number(number) => match (number.as_u64(), number.as_i64()) {
                (Some(value), _) => visitor.visit_u64(value),
                (None, Some(value)) => visitor.visit_i64(value),
                (None, None) => visitor.visit_f64(number.as_f64().unwrap_or(f64::NAN)),
            },
            Value::String(text) => visitor.visit_borrowed_str(text),
            Value::Array(values) => {
                let mut items = Items {
                    values,
                    next: 0,
                    path: &self.path,
                };
                let read = visitor.visit_seq(&mut items)?;
                if items.next == values.len() {
                    return Ok(read);
                }
                Err(Fault::invalid_length(values.len(), &Count(items.next)))
            }
            Value::Object(table) => visitor.visit_map(Entries {
                entries: table.iter(),
                value: None,
                path: &self.path,
            }),
        }
    }
}

impl<'a> Deserializer<'a> for Node<'a> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.visit(visitor).map_err(|fault| fault.at(&self.path))
    }

    fn deserialize_option<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    /// A list in place of a table would be read by position, so it is refused.
    fn deserialize_struct<V: Visitor<'a>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match self.value {
            Value::Object(_) => self.deserialize_any(visitor),
            Value::Array(_) => {
                let fault = self.wrong("a table");
                Err(match self.path.steps() {
                    [Step::Key(key)] => fault.help(Help {
                        in_file: format!("write [{key}], in single brackets"),
                        in_program: "there is one: write a dictionary, not a list".to_owned(),
                    }),
                    _ => fault,
                })
            }
            _ => Err(self.wrong("a table")),
        }
    }

    fn deserialize_seq<V: Visitor<'a>>(self, visitor: V) -> Result<V::Value, Fault> {
        let Value::Object(_) = self.value else {
            return self.deserialize_any(visitor);
        };
        let fault = self.wrong("an array");
        let list = match self.path.steps() {
            [Step::Key(key)] => key.clone(),
            [Step::Key(table), Step::Key(key)] => format!("{table}.{key}"),
            _ => return Err(fault),
        };
        Err(fault.help(Help {
            in_file: format!("write [[{list}]], in double brackets"),
            in_program: "there may be several: write a list of dictionaries".to_owned(),
        }))
    }

    fn deserialize_enum<V: Visitor<'a>>(
        self,
        _: &'static str,
        words: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let Value::String(word) = self.value else {
            return Err(self.wrong(&format!("one of {}", quoted(words))));
        };
        let word: StrDeserializer<'_, Fault> = word.as_str().into_deserializer();
        visitor
            .visit_enum(word)
            .map_err(|fault| fault.at(&self.path))
    }

    fn deserialize_newtype_struct<V: Visitor<'a>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Fault> {
        visitor.visit_newtype_struct(self)
    }

    forward_to_deserialize_any! {
        <V: Visitor<'a>>
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct tuple tuple_struct map identifier ignored_any
    }
}

struct Items<'a, 'p> {
    values: &'a [Value],
    next: usize,
    path: &'p KeyPath,
}

impl<'a> SeqAccess<'a> for Items<'a, '_> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'a>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Fault> {
        let Some(value) = self.values.get(self.next) else {
            return Ok(None);
        };
        let path = self.path.index(self.next);
        self.next += 1;
        Node { value, path }.read(seed).map(Some)
    }
}

struct Entries<'a, 'p> {
    entries: serde_json::map::Iter<'a>,
    value: Option<(&'a String, &'a Value)>,
    path: &'p KeyPath,
}

impl<'a> MapAccess<'a> for Entries<'a, '_> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'a>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Fault> {
        self.value = self.entries.next();
        let Some((key, _)) = self.value else {
            return Ok(None);
        };
        let key: StrDeserializer<'_, Fault> = key.as_str().into_deserializer();
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'a>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        let Some((key, value)) = self.value.take() else {
            return Err(Fault::custom("a value is read before its key"));
        };
        let path = self.path.key(key);
        Node { value, path }.read(seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::input;
    use serde_json::json;

    fn problems(value: Value) -> Vec<String> {
        let read: Result<input::SceneInput, _> = decode(value);
        let problems = read.expect_err("wrong");
        problems.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn all_that_is_wrong_is_told_at_once() {
        let scene = json!({
            "colour": "x",
            "dimension": "two",
            "material": [{ "density": "5 mm" }, { "density": true }],
            "boundary": [{ "velocity": { "y": [[0, 1], [1, "a"]] } }],
        });
        let found = problems(scene);
        for part in [
            "colour: unknown key",
            "dimension: expected a whole number",
            "material[0].density: expected a density, but \"5 mm\" is a length",
            "material[1].density: expected a density: a number in kg/m³",
            "boundary[0].velocity.y[1][1]: expected a velocity, but \"a\"",
        ] {
            assert!(
                found.iter().any(|p| p.starts_with(part)),
                "{part}\n{found:#?}"
            );
        }
        assert_eq!(found.len(), 5);
    }

    #[test]
    fn tables_and_lists_are_not_mixed_up() {
        assert_eq!(
            problems(json!({ "time": [1.0] })),
            ["time: expected a table, got an array"]
        );
        assert_eq!(
            problems(json!({ "load": [{ "pressure": [[0, 1, 2]] }] })),
            ["load[0].pressure[0]: expected a row [time, value], got 3 values"]
        );
        assert_eq!(
            problems(json!({ "load": [{ "pressure": [[0]] }] })),
            ["load[0].pressure[0]: expected a row [time, value], got 1 values"]
        );
        assert_eq!(problems(json!([1])), ["expected a table, got an array"]);
    }

    #[test]
    fn nothing_is_read_as_left_out() {
        let read: Result<input::SceneInput, _> = decode(json!({ "plane": null }));
        assert_eq!(read.map(|scene| scene.plane), Ok(None));
    }
}
