//! What a page of the book claims: figures, what is known of them, and pictures.

use crate::Balance;
use crate::plot::Plot;

/// Why the energy is known to so much and no more ([`LEDGER_LIMIT`]).
pub(crate) const LEDGER: &str = "limit of the ledger for blocks of 40 elements and more";

/// What the ledger may lack of the energy exchanged (design, section 7).
pub(crate) const LEDGER_LIMIT: f64 = 1e-3;

/// A problem whose answer is known from elsewhere, with its page in the book.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// `V1` and so on; numbers stay, and none is used again.
    pub number: &'static str,
    /// Name of its page in `book/src/verification`, without ending.
    pub page: &'static str,
    /// Runs its scenes.
    pub solve: fn() -> Findings,
}

/// What comes of a problem.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Figures, in the order of the page.
    pub figures: Vec<Figure>,
    /// Pictures below them.
    pub plots: Vec<Plot>,
}

/// One figure beside what is known of it.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What it is, with its unit.
    pub what: String,
    /// What is known.
    pub known: Known,
    /// What the scene gives.
    pub found: f64,
    /// Where the tolerance comes from.
    pub why: &'static str,
}

/// What is known of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// This, but for a share of it.
    Within {
        /// The exact answer.
        exact: f64,
        /// Largest error, over the exact answer.
        share: f64,
    },
    /// That it lies from the one to the other.
    Between(f64, f64),
    /// That its size is no larger.
    AtMost(f64),
}

impl Findings {
    /// Adds a figure of which the exact value is known, to be met but for a share of it.
    pub fn exact(
        &mut self,
        what: impl Into<String>,
        (exact, found): (f64, f64),
        share: f64,
        why: &'static str,
    ) {
        let known = Known::Within { exact, share };
        self.add(what, known, found, why);
    }

    /// Adds a figure whose size has a bound.
    pub fn at_most(
        &mut self,
        what: impl Into<String>,
        (bound, found): (f64, f64),
        why: &'static str,
    ) {
        self.add(what, Known::AtMost(bound), found, why);
    }

    /// Adds a figure that lies between two others.
    pub fn between(
        &mut self,
        what: impl Into<String>,
        ([least, most], found): ([f64; 2], f64),
        why: &'static str,
    ) {
        self.add(what, Known::Between(least, most), found, why);
    }

    /// Adds what the energy of every run has to keep.
    pub(crate) fn energy(&mut self, of: impl Fn(&str) -> String, balance: &Balance) {
        self.at_most(
            of("energy that the ledger lacks, over that exchanged"),
            (LEDGER_LIMIT, balance.residual),
            LEDGER,
        );
        self.at_most(
            of("most that the energy ever rose, over that exchanged"),
            (LEDGER_LIMIT, balance.rise),
            LEDGER,
        );
    }

    fn add(&mut self, what: impl Into<String>, known: Known, found: f64, why: &'static str) {
        self.figures.push(Figure {
            what: what.into(),
            known,
            found,
            why,
        });
    }

    /// The figures that are not what is known of them.
    #[must_use]
    pub fn wrong(&self) -> Vec<&Figure> {
        self.figures.iter().filter(|f| !f.holds()).collect()
    }
}

impl Figure {
    /// Whether it is what is known of it; nothing is, that is not a number.
    #[must_use]
    pub fn holds(&self) -> bool {
        match self.known {
            Known::Within { exact, share } => (self.found - exact).abs() <= share * exact.abs(),
            Known::Between(least, most) => (least..=most).contains(&self.found),
            Known::AtMost(bound) => self.found.abs() <= bound,
        }
    }

    /// What was found, as a page tells it: of round-off its size alone, for its digits are
    /// those of a mathematical library.
    pub(crate) fn shown(&self) -> String {
        let size = self.found.abs();
        match self.known {
            Known::AtMost(_) if size > 0.0 && size < 1e-9 => {
                format!("below 1e{}", size.log10().floor() as i32 + 1)
            }
            _ => number(self.found),
        }
    }
}

impl std::fmt::Display for Figure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (known, off) = (self.known.value(), self.known.tolerance());
        write!(f, "{}: found {}, known {known}", self.what, self.shown())?;
        if off.is_empty() {
            Ok(())
        } else {
            write!(f, ", to {off}")
        }
    }
}

impl Known {
    /// The value, as a page tells it.
    pub(crate) fn value(self) -> String {
        match self {
            Self::Within { exact, .. } => number(exact),
            Self::Between(least, f64::INFINITY) => format!("at least {}", number(least)),
            Self::Between(least, most) => format!("{} to {}", number(least), number(most)),
            Self::AtMost(bound) => format!("at most {}", number(bound)),
        }
    }

    /// By how much it may be missed, as a page tells it.
    pub(crate) fn tolerance(self) -> String {
        match self {
            Self::Within { share, .. } if share >= 1e-3 => format!("{} %", number(100.0 * share)),
            Self::Within { share, .. } => number(share),
            Self::Between(..) | Self::AtMost(_) => String::new(),
        }
    }
}

/// A number for people: five digits at most, two where only its size matters.
fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if (1e-3..1e6).contains(&size) {
        let decimals = usize::try_from(4 - size.log10().floor() as i32).unwrap_or(0);
        return without_zeros(&format!("{x:.decimals$}")).to_owned();
    }
    let digits = if size < 1e-5 { 1 } else { 4 };
    let text = format!("{x:.digits$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{}e{exponent}", without_zeros(mantissa))
}

/// Decimals without the zeros at their end.
fn without_zeros(decimals: &str) -> &str {
    if decimals.contains('.') {
        decimals.trim_end_matches('0').trim_end_matches('.')
    } else {
        decimals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_holds_within_its_tolerance_alone() {
        let figure = |known, found| Figure {
            what: String::new(),
            known,
            found,
            why: "",
        };
        let exact = Known::Within {
            exact: -2.0,
            share: 0.01,
        };
        assert!(figure(exact, -2.019).holds() && !figure(exact, -2.021).holds());
        assert!(figure(Known::AtMost(1.0), -1.0).holds());
        assert!(!figure(Known::AtMost(1.0), f64::NAN).holds());
        assert!(!figure(Known::Between(0.0, 1.0), 1.1).holds());
    }

    #[test]
    fn numbers_are_short() {
        let texts = [1.0, 0.123_456_7, -12345.67, 6.25e-3, 3.0e-9, 0.0].map(number);
        assert_eq!(texts, ["1", "0.12346", "-12346", "0.00625", "3e-9", "0"]);
    }
}
