//! Translates Serde's errors into problems worded for users.

use std::fmt::{self, Display};

use serde::de::{Error, Expected, Unexpected};

use crate::scene::key_path::Step;
use crate::scene::problem::{Help, nearest, suggestion};
use crate::scene::schema::home;
use crate::scene::{KeyPath, Problem};

/// A [`Problem`] without its final path, which is known only outside the visitor.
#[derive(Debug)]
pub(super) struct Fault {
    path: Option<KeyPath>,
    /// Key of the table at `path` that is at fault.
    key: Option<String>,
    message: String,
    help: Option<Help>,
}

impl Fault {
    /// Fills in the path, unless an inner value has done so.
    pub(super) fn at(mut self, path: &KeyPath) -> Self {
        self.path.get_or_insert_with(|| path.clone());
        self
    }

    pub(super) fn help(mut self, help: impl Into<Help>) -> Self {
        self.help = Some(help.into());
        self
    }

    fn of_key(self, key: &str) -> Self {
        Self {
            key: Some(key.to_owned()),
            ..self
        }
    }

    pub(super) fn into_problem(self) -> Problem {
        let table = self.path.unwrap_or_default();
        let Some(key) = self.key else {
            let example = || example(&table).map(Help::example);
            return Problem {
                help: self.help.or_else(example),
                ..Problem::new(table, self.message)
            };
        };
        let path = table.key(&key);
        if is_reserved(&path) {
            return Problem::new(path, "reserved for a later version")
                .of_key()
                .help("leave it out");
        }
        Problem {
            help: self.help,
            ..Problem::new(path, self.message).of_key()
        }
    }
}

/// Returns an example for the value of a key whose form is not obvious.
fn example(path: &KeyPath) -> Option<&'static str> {
    let (Some(Step::Key(table)), Some(Step::Key(key))) =
        (path.steps().first(), path.steps().last())
    else {
        return None;
    };
    Some(match (table.as_str(), key.as_str()) {
        ("gravity", "gravity") => "gravity = [0.0, -9.81], or in 3-D [0.0, 0.0, -9.81]",
        ("boundary", "velocity") => "velocity = { x = 1.0 }, which leaves y free",
        ("block", "velocity") => {
            "velocity = [3.0, 0.0] or [\"10 km/h\", 0.0], or in 3-D [3.0, 0.0, 0.0]"
        }
        ("block", "translate") => "translate = [1.0, 0.0], or in 3-D [1.0, 0.0, 0.0]",
        ("block", "shape") => {
            "shape = { box = { min = [0, 0], max = [2, 1], divisions = [4, 2] } }, or in 2-D \
             { polygon = [[0, 0], [1, 0], [0, 1]], size = 0.1 }"
        }
        ("block", "box") => "box = { min = [0, 0], max = [2, 1], divisions = [4, 2] }",
        ("block", "min" | "max") => "min = [0.0, 0.0]",
        ("block", "divisions") => "divisions = [4, 2]",
        ("block", "polygon") => "polygon = [[0, 0], [1, 0], [0, 1]]",
        ("material", "damping") => "damping = { mass = 0.5, stiffness = 1e-5 }, in 1/s and s",
        ("time", "stop_when") => "stop_when = { kinetic_energy_below = 1e-6 }, in J",
        ("boundary" | "probe", "point") => "point = [0.0, 0.0], or in 3-D [0.0, 0.0, 0.0]",
        ("load", "traction") => "traction = [0.0, 1e5], or in 3-D [0.0, 0.0, 1e5]",
        ("contact", "between") => "between = [\"left\", \"right\"]",
        ("output", "fields") => "fields = [\"velocity\", \"stress\"]",
        ("output", "block_list") => "block_list = [\"left\"]",
        _ => return None,
    })
}

/// Returns the key for a symbol used in textbooks.
fn of_symbol(symbol: &str) -> Option<&'static str> {
    match symbol {
        "E" => Some("young_modulus"),
        "nu" | "ν" => Some("poisson_ratio"),
        "rho" | "ρ" => Some("density"),
        "phi" | "φ" => Some("friction_angle"),
        _ => None,
    }
}

/// True if an unknown key is reserved for a later version.
fn is_reserved(path: &KeyPath) -> bool {
    match path.steps() {
        [Step::Key(key)] => matches!(key.as_str(), "stage" | "joint" | "initial_stress"),
        [Step::Key(list), Step::Index(_), Step::Key(key)] => {
            key == "initial_stress" || (list == "boundary" && key == "kind")
        }
        _ => false,
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Fault {}

impl Error for Fault {
    /// The first line is the message, the rest is the help.
    fn custom<T: Display>(text: T) -> Self {
        let text = text.to_string();
        let (message, help) = match text.split_once('\n') {
            Some((message, help)) => (message.to_owned(), Some(help.into())),
            None => (text, None),
        };
        Self {
            path: None,
            key: None,
            message,
            help,
        }
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::custom(format_args!(
            "expected {}, got {}",
            plain(expected),
            Found(found)
        ))
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        Self::custom(format_args!(
            "expected {}, got {length} values",
            plain(expected)
        ))
    }

    fn unknown_variant(word: &str, words: &'static [&'static str]) -> Self {
        Self::custom(format_args!(
            "expected one of {}, got \"{word}\"",
            quoted(words)
        ))
        .help(suggestion(word, words.iter().copied()))
    }

    fn unknown_field(key: &str, keys: &'static [&'static str]) -> Self {
        let known = || keys.iter().copied();
        let symbol = of_symbol(key).filter(|meant| keys.contains(meant));
        let symbol = symbol.map(|meant| Help::from(format!("did you mean `{meant}`?")));
        let help = symbol.unwrap_or_else(|| match (nearest(key, known()), home(key)) {
            _ if key == "block" && known().any(|known| known == "pressure") => {
                "did you mean `group`? Sides of a shape are groups, as in group = \"floor.ymax\""
                    .into()
            }
            (None, Some(home)) => home,
            // If there are few keys, all are listed as well.
            (Some(meant), _) if keys.len() <= 4 => format!(
                "did you mean `{meant}`? The keys here are: {}",
                keys.join(", ")
            )
            .into(),
            _ => suggestion(key, known()).into(),
        });
        Self::custom("unknown key").of_key(key).help(help)
    }

    fn missing_field(key: &'static str) -> Self {
        Self::custom("this key is missing").of_key(key)
    }
}

/// Returns an expectation in a user's words instead of a programmer's.
fn plain(expected: &dyn Expected) -> String {
    let text = expected.to_string();
    match text.as_str() {
        "u32" => format!("a whole number from 0 to {}", u32::MAX),
        "usize" => "a whole number, at least 0".to_owned(),
        "i64" => "a whole number".to_owned(),
        "a string" => "text in quotes".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "an array".to_owned(),
        "a tuple of size 2" => "a row [time, value]".to_owned(),
        _ => text,
    }
}

/// Returns `"a", "b"`.
pub(super) fn quoted(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
    quoted.join(", ")
}

/// The value found, as the user wrote it.
struct Found<'a>(Unexpected<'a>);

impl Display for Found<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Unexpected::Bool(value) => write!(f, "{value}"),
            Unexpected::Unsigned(value) => write!(f, "{value}"),
            Unexpected::Signed(value) => write!(f, "{value}"),
            Unexpected::Float(value) => write!(f, "{value:?}"),
            Unexpected::Str(text) => write!(f, "the text \"{text}\""),
            Unexpected::Unit => f.write_str("nothing"),
            Unexpected::Seq => f.write_str("an array"),
            Unexpected::Map => f.write_str("a table"),
            other => write!(f, "{other}"),
        }
    }
}

/// An expected number of values.
pub(super) struct Count(pub(super) usize);

impl Expected for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            2 => f.write_str("a row [time, value]"),
            count => write!(f, "{count} values"),
        }
    }
}
