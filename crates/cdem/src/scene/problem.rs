//! Errors of a scene, worded for the user who must correct it.

use std::fmt;

use crate::scene::KeyPath;

/// An error in a scene: place, problem and advice.
///
/// It has no reference to a file. The reader of the text finds line and column from the path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path of the value; for a missing key, the path it should have.
    pub path: KeyPath,
    /// The part at fault: the key itself, or its value.
    pub place: Place,
    /// Problem and expectation: one sentence, no full stop.
    pub message: String,
    /// Advice.
    pub help: Option<Help>,
}

/// Advice in two forms, because scene files and programs write the same thing in different ways.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Help {
    /// For authors of scene files.
    pub in_file: String,
    /// For programs that make a scene of dictionaries and lists.
    pub in_program: String,
}

/// The part of `key = value` that a [`Problem`] is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// The key: unknown, not allowed here, or missing.
    Key,
    /// The value.
    #[default]
    Value,
}

impl Problem {
    /// Creates the problem of a wrong value.
    #[must_use]
    pub fn new(path: KeyPath, message: impl Into<String>) -> Self {
        Self {
            path,
            place: Place::Value,
            message: message.into(),
            help: None,
        }
    }

    /// Returns the same problem, for the key instead of its value.
    #[must_use]
    pub fn of_key(self) -> Self {
        Self {
            place: Place::Key,
            ..self
        }
    }

    /// Returns the same problem with advice.
    #[must_use]
    pub fn help(self, help: impl Into<Help>) -> Self {
        Self {
            help: Some(help.into()),
            ..self
        }
    }
}

impl Help {
    /// Creates a sentence about the tables of a list, such as `[[block]]`.
    pub(super) fn on_list(list: &str, sentence: impl Fn(&str) -> String) -> Self {
        Self {
            in_file: sentence(&format!("[[{list}]]")),
            in_program: sentence(&format!("`{list}`")),
        }
    }

    /// Creates an example `key = value`, possibly followed by words. Inline tables of TOML become
    /// dictionaries in a program.
    pub(super) fn example(example: &str) -> Self {
        let parts: Vec<&str> = example.split(" = ").collect();
        let mut in_program = parts
            .first()
            .map_or_else(String::new, |key| format!("{key} = "));
        for (i, part) in parts.iter().enumerate().skip(1) {
            match part.rsplit_once(' ') {
                Some((before, key)) if i + 1 < parts.len() => {
                    in_program.push_str(&format!("{before} \"{key}\": "));
                }
                _ => in_program.push_str(part),
            }
        }
        let in_program = in_program.replace("{ ", "{").replace(" }", "}");
        Self {
            in_file: format!("for example: {example}"),
            in_program: format!("for example: {in_program}"),
        }
    }
}

impl From<String> for Help {
    fn from(text: String) -> Self {
        Self {
            in_file: text.clone(),
            in_program: text,
        }
    }
}

impl From<&str> for Help {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.path.steps().is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        write!(f, "{}", self.message)
    }
}

impl std::error::Error for Problem {}

/// Returns the name in `known` most similar to `word`, if one is similar enough.
pub(super) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let asked = word.to_lowercase();
    known
        .into_iter()
        .filter_map(|name| likeness(&asked, &name.to_lowercase()).map(|rank| (rank, name)))
        .min_by_key(|(rank, _)| *rank)
        .map(|(_, name)| name)
}

/// Returns the number of typing errors between two words; `None` if they are not similar. A word
/// that contains the other counts as similar ("poisson").
fn likeness(asked: &str, name: &str) -> Option<usize> {
    let slips = strsim::damerau_levenshtein(asked, name);
    let length = asked.chars().count().max(name.chars().count());
    if slips <= length.div_ceil(3) && slips < length {
        return Some(slips);
    }
    let contained = asked.chars().count() > 2 && name.contains(asked)
        || name.chars().count() > 2 && asked.contains(name);
    contained.then_some(length)
}

/// Returns advice on an unknown name: the most similar one, or all of them.
pub(crate) fn suggestion<'a>(
    word: &str,
    known: impl IntoIterator<Item = &'a str> + Clone,
) -> String {
    if let Some(name) = nearest(word, known.clone()) {
        return format!("did you mean `{name}`?");
    }
    let all: Vec<&str> = known.into_iter().collect();
    match all.as_slice() {
        [] => "there are none".to_owned(),
        [one] => format!("the only one is `{one}`"),
        _ => format!("choose one of: {}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_parts_and_capitals_are_recognised() {
        let keys = ["young_modulus", "poisson_ratio", "density", "name"];
        for (asked, meant) in [
            ("youngs_modulus", "young_modulus"),
            ("Density", "density"),
            ("densit", "density"),
            ("poisson", "poisson_ratio"),
            ("names", "name"),
        ] {
            assert_eq!(nearest(asked, keys), Some(meant));
        }
        for strange in ["E", "colour", ""] {
            assert_eq!(nearest(strange, keys), None, "{strange}");
        }
    }

    #[test]
    fn examples_are_dictionaries_in_a_program() {
        for (file, program) in [
            ("end = 1.0", "end = 1.0"),
            (
                "gravity = [0, -9.81], or in 3-D [0, 0, 1]",
                "gravity = [0, -9.81], or in 3-D [0, 0, 1]",
            ),
            (
                "shape = { box = { min = [0, 0], max = [2, 1] } }",
                "shape = {\"box\": {\"min\": [0, 0], \"max\": [2, 1]}}",
            ),
            (
                "velocity = { x = 1.0 }, which leaves y free",
                "velocity = {\"x\": 1.0}, which leaves y free",
            ),
        ] {
            let help = Help::example(file);
            assert_eq!(help.in_file, format!("for example: {file}"));
            assert_eq!(help.in_program, format!("for example: {program}"));
        }
    }

    #[test]
    fn advice_names_the_nearest_or_all() {
        assert_eq!(suggestion("rok", ["rock", "ice"]), "did you mean `rock`?");
        assert_eq!(
            suggestion("xyz", ["rock", "ice"]),
            "choose one of: rock, ice"
        );
        assert_eq!(suggestion("xyz", ["rock"]), "the only one is `rock`");
        assert_eq!(suggestion("xyz", []), "there are none");
    }
}
