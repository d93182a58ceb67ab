//! The text of a scene: its values and their places.

use std::ops::Range;

use cdem::scene::{KeyPath, Place, Problem, Step};
use serde_json::{Map, Number, Value};
use toml::de::{DeInteger, DeTable, DeValue};

/// The values of a TOML text, and problems with values that a scene cannot have.
pub(super) struct Tree {
    pub(super) value: Value,
    pub(super) problems: Vec<Problem>,
}

/// Reads a TOML text as a tree of values.
///
/// # Errors
/// The first syntax error, with its bytes in the text.
pub(super) fn read(text: &str) -> Result<Tree, (Problem, Range<usize>)> {
    let document = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or(text.len()..text.len());
        let message = format!("this is not TOML: {}", error.message());
        let problem = Problem::new(KeyPath::root(), message);
        let help = match error.message() {
            "duplicate key" => Some(duplicate_help(&text[..span.start])),
            _ => syntax_help(text, &span),
        };
        match help {
            Some(help) => (problem.help(help), span),
            None => (problem, span),
        }
    })?;
    let mut problems = Vec::new();
    let value = table(document.get_ref(), &KeyPath::root(), &mut problems);
    Ok(Tree { value, problems })
}

/// Returns advice on a key or table that occurs twice, for the text `before` it.
fn duplicate_help(before: &str) -> &'static str {
    if before.trim_end().ends_with("[[") {
        "the same table has single brackets above: write double brackets for all of them"
    } else if before.trim_end().ends_with('[') {
        "a table may occur only once: move these keys to the first table of this name"
    } else {
        "a key may occur only once: remove one of them"
    }
}

/// Returns advice on frequent mistakes.
fn syntax_help(text: &str, span: &Range<usize>) -> Option<&'static str> {
    let (before, after) = (&text[..span.start], &text[span.start..]);
    let line_ends = after
        .trim_start_matches([' ', '\t'])
        .starts_with(['\n', '\r', '#']);
    let digit_before = before.ends_with(|c: char| c.is_ascii_digit());
    match (before, after) {
        (before, after) if before.trim_end().ends_with('=') && (line_ends || after.is_empty()) => {
            Some("the value is missing")
        }
        (before, _) if before.trim_end().ends_with('=') => {
            Some("write texts, and numbers with a unit, in quotes: \"40 GPa\"")
        }
        (_, after) if digit_before && after.starts_with(',') => {
            Some("write decimals with a point: 0.5")
        }
        _ => None,
    }
}

fn table(table: &DeTable<'_>, path: &KeyPath, problems: &mut Vec<Problem>) -> Value {
    let entries = table.iter().map(|(key, inner)| {
        let key: &str = key.get_ref();
        (
            key.to_owned(),
            value(inner.get_ref(), &path.key(key), problems),
        )
    });
    Value::Object(entries.collect::<Map<_, _>>())
}

fn value(found: &DeValue<'_>, path: &KeyPath, problems: &mut Vec<Problem>) -> Value {
    let read = match found {
        DeValue::String(text) => Ok(Value::String(text.to_string())),
        DeValue::Boolean(value) => Ok(Value::Bool(*value)),
        DeValue::Integer(digits) => integer(digits).ok_or("the whole number is too large"),
        DeValue::Float(digits) => {
            let float = digits.as_str().parse().ok().and_then(Number::from_f64);
            float.map(Value::Number).ok_or("must be a finite number")
        }
        DeValue::Datetime(_) => Err("a scene has no dates or times of day"),
        DeValue::Array(items) => {
            let items = items.iter().enumerate();
            let items = items.map(|(i, item)| value(item.get_ref(), &path.index(i), problems));
            Ok(Value::Array(items.collect()))
        }
        DeValue::Table(inner) => Ok(table(inner, path, problems)),
    };
    read.unwrap_or_else(|message| {
        problems.push(Problem::new(path.clone(), message));
        Value::Null
    })
}

fn integer(digits: &DeInteger<'_>) -> Option<Value> {
    let value = i64::from_str_radix(digits.as_str(), digits.radix()).ok()?;
    Some(Value::Number(value.into()))
}

/// Returns the bytes of a key or a value; if it is missing, those of the innermost table around it.
/// The range ends with its first line.
pub(super) fn locate(text: &str, path: &KeyPath, place: Place) -> Range<usize> {
    let Ok(document) = DeTable::parse(text) else {
        return 0..0;
    };
    let span = find(document.get_ref(), path.steps(), place).unwrap_or(0..0);
    let first_line = text[span.clone()].lines().next().map_or(0, str::len);
    span.start..span.start + first_line
}

/// Returns the span of the item at the path `steps` from `table`; `None` for the table itself.
fn find(table: &DeTable<'_>, steps: &[Step], place: Place) -> Option<Range<usize>> {
    let (Step::Key(wanted), rest) = steps.split_first()? else {
        return None;
    };
    let (key, value) = table.iter().find(|(key, _)| key.get_ref() == wanted)?;
    if rest.is_empty() && place == Place::Key {
        return Some(key.span());
    }
    Some(within(value.get_ref(), rest, place).unwrap_or_else(|| value.span()))
}

fn within(value: &DeValue<'_>, steps: &[Step], place: Place) -> Option<Range<usize>> {
    match (value, steps.split_first()) {
        (DeValue::Table(table), Some(_)) => find(table, steps, place),
        (DeValue::Array(items), Some((Step::Index(index), rest))) => {
            let item = items.get(*index)?;
            Some(within(item.get_ref(), rest, place).unwrap_or_else(|| item.span()))
        }
        _ => None,
    }
}

/// Returns line and column of a byte, from 1, in characters.
pub(super) fn line_and_column(text: &str, byte: usize) -> (usize, usize) {
    let before = &text[..byte];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.matches('\n').count() + 1;
    (line, before[line_start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
title = \"é\"
[time]
  end = 1.0
[[block]]
name = \"a\"
[[block]]
name = \"b\"
velocity = [1, [
  2]]
rotate = { axis = [0, 0, 1], angle = 3 }
";

    fn found(path: &KeyPath, place: Place) -> &'static str {
        &TEXT[locate(TEXT, path, place)]
    }

    #[test]
    fn paths_lead_to_their_text() {
        let root = KeyPath::root();
        let block = root.key("block").index(1);
        assert_eq!(found(&root.key("title"), Place::Value), "\"é\"");
        assert_eq!(found(&root.key("time").key("end"), Place::Key), "end");
        assert_eq!(found(&block.key("name"), Place::Value), "\"b\"");
        assert_eq!(found(&block.key("velocity"), Place::Value), "[1, [");
        assert_eq!(
            found(&block.key("velocity").index(1).index(0), Place::Value),
            "2"
        );
        assert_eq!(found(&block.key("rotate").key("angle"), Place::Value), "3");
    }

    #[test]
    fn what_is_missing_is_shown_at_its_table() {
        let root = KeyPath::root();
        assert_eq!(found(&root.key("time").key("step"), Place::Key), "[time]");
        assert_eq!(
            found(&root.key("block").index(1).key("mesh"), Place::Key),
            "[[block]]"
        );
        assert_eq!(
            Some(locate(TEXT, &root.key("block").index(1).key("mesh"), Place::Key).start),
            TEXT.rfind("[[block]]")
        );
        assert_eq!(locate(TEXT, &root.key("version"), Place::Key), 0..0);
    }

    #[test]
    fn columns_count_characters() {
        assert_eq!(line_and_column(TEXT, 0), (1, 1));
        assert_eq!(
            line_and_column(TEXT, TEXT.find("\"\n").unwrap_or(0)),
            (1, 11)
        );
        assert_eq!(line_and_column(TEXT, TEXT.find("end").unwrap_or(0)), (3, 3));
    }
}
