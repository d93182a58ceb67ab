//! What is wrong with a scene, told to the person who must mend it.

use std::fmt;

use crate::scene::KeyPath;

/// One thing that is wrong with a scene: where, what, and what to try.
///
/// It knows nothing of files: whoever has the text finds line and column from
/// the path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where it is; for a key that is missing, where it should be.
    pub path: KeyPath,
    /// Whether the key itself is wrong, or its value.
    pub place: Place,
    /// What is wrong and what was expected: one sentence, no full stop.
    pub message: String,
    /// What to try.
    pub help: Option<Help>,
}

/// What to try: scene files and programs write the same thing in different ways.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Help {
    /// To one who writes a scene file.
    pub in_file: String,
    /// To one whose program makes a scene of dictionaries and lists.
    pub in_program: String,
}

/// Which part of `key = value` a [`Problem`] is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// The key: unknown, not allowed here, or missing.
    Key,
    /// The value.
    #[default]
    Value,
}

impl Problem {
    /// A value that is wrong.
    #[must_use]
    pub fn new(path: KeyPath, message: impl Into<String>) -> Self {
        Self {
            path,
            place: Place::Value,
            message: message.into(),
            help: None,
        }
    }

    /// The same problem, of the key instead of its value.
    #[must_use]
    pub fn of_key(self) -> Self {
        Self {
            place: Place::Key,
            ..self
        }
    }

    /// The same problem with advice.
    #[must_use]
    pub fn help(self, help: impl Into<Help>) -> Self {
        Self {
            help: Some(help.into()),
            ..self
        }
    }
}

impl Help {
    /// A sentence about the tables of a list, such as `[[block]]`.
    pub(super) fn on_list(list: &str, sentence: impl Fn(&str) -> String) -> Self {
        Self {
            in_file: sentence(&format!("[[{list}]]")),
            in_program: sentence(&format!("`{list}`")),
        }
    }

    /// An example of a key with its value, `key = value`, after some words: inline tables of
    /// TOML are dictionaries in a program.
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

/// The one of `known` that was most likely meant by `word`, if any is like it.
pub(super) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let asked = word.to_lowercase();
    known
        .into_iter()
        .filter_map(|name| likeness(&asked, &name.to_lowercase()).map(|rank| (rank, name)))
        .min_by_key(|(rank, _)| *rank)
        .map(|(_, name)| name)
}

/// How many slips of the keyboard lie between two words; `None`: they are not
/// alike. A word that is part of the other counts as alike ("poisson").
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

/// Advice on a name that is not known: the nearest, or all of them.
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
