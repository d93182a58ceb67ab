//! The claims of a page of the book: figures, their known values, and plots.

use crate::Balance;
use crate::plot::Plot;

/// Reason for [`LEDGER_LIMIT`], as a page states it.
pub(crate) const LEDGER: &str = "limit of the ledger for blocks of 40 elements and more";

/// Largest energy residual of the ledger, over the energy exchanged.
pub(crate) const LEDGER_LIMIT: f64 = 1e-3;

/// A problem with an independently known answer, and its page in the book.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// `V1` and so on. A number never changes and is never reused.
    pub number: &'static str,
    /// Name of its page in `book/src/verification`, without extension.
    pub page: &'static str,
    /// Runs its scenes.
    pub solve: fn() -> Findings,
}

/// Results of a problem.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// Figures, in the order of the page.
    pub figures: Vec<Figure>,
    /// Plots below the figures.
    pub plots: Vec<Plot>,
}

/// A figure of a run and its known value.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name, with unit.
    pub what: String,
    /// Known value.
    pub known: Known,
    /// Value of the run.
    pub found: f64,
    /// Reason for the tolerance.
    pub why: &'static str,
}

/// The known value of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// An exact value with a relative tolerance.
    Within {
        /// The exact answer.
        exact: f64,
        /// Largest error, over the exact answer.
        share: f64,
    },
    /// A range, ends included.
    Between(f64, f64),
    /// A bound on the absolute value.
    AtMost(f64),
}

/// A figure of a run before it has its known value.
#[must_use = "a figure without a known value is not added"]
pub struct FoundFigure<'a> {
    findings: &'a mut Findings,
    what: String,
    found: f64,
}

impl Findings {
    /// Creates a figure with its value in the run. A method of the result adds its known value.
    pub fn figure(&mut self, what: impl Into<String>, found: f64) -> FoundFigure<'_> {
        FoundFigure {
            findings: self,
            what: what.into(),
            found,
        }
    }

    /// Adds the two energy checks that every run must pass.
    pub(crate) fn energy(&mut self, of: impl Fn(&str) -> String, balance: &Balance) {
        self.figure(
            of("energy residual, over the energy exchanged"),
            balance.residual,
        )
        .at_most(LEDGER_LIMIT, LEDGER);
        self.figure(
            of("largest rise of the energy, over the energy exchanged"),
            balance.rise,
        )
        .at_most(LEDGER_LIMIT, LEDGER);
    }

    /// Returns the figures that miss their known value.
    #[must_use]
    pub fn wrong(&self) -> Vec<&Figure> {
        self.figures.iter().filter(|f| !f.holds()).collect()
    }
}

impl FoundFigure<'_> {
    /// Adds the figure with an exact value and a relative tolerance `share`, for the reason `why`.
    pub fn exact(self, exact: f64, share: f64, why: &'static str) {
        self.add(Known::Within { exact, share }, why);
    }

    /// Adds the figure with a bound on its absolute value, for the reason `why`.
    pub fn at_most(self, bound: f64, why: &'static str) {
        self.add(Known::AtMost(bound), why);
    }

    /// Adds the figure with a known range, ends included, for the reason `why`.
    pub fn between(self, least: f64, most: f64, why: &'static str) {
        self.add(Known::Between(least, most), why);
    }

    fn add(self, known: Known, why: &'static str) {
        self.findings.figures.push(Figure {
            what: self.what,
            known,
            found: self.found,
            why,
        });
    }
}

impl Figure {
    /// True if the figure agrees with its known value. NaN never agrees.
    #[must_use]
    pub fn holds(&self) -> bool {
        match self.known {
            Known::Within { exact, share } => (self.found - exact).abs() <= share * exact.abs(),
            Known::Between(least, most) => (least..=most).contains(&self.found),
            Known::AtMost(bound) => self.found.abs() <= bound,
        }
    }

    /// Returns the value as a page shows it. Round-off is shown as a power of ten only, because its
    /// digits depend on the mathematical library.
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
    /// Returns the known value as a page shows it.
    pub(crate) fn value(self) -> String {
        match self {
            Self::Within { exact, .. } => number(exact),
            Self::Between(least, f64::INFINITY) => format!("at least {}", number(least)),
            Self::Between(least, most) => format!("{} to {}", number(least), number(most)),
            Self::AtMost(bound) => format!("at most {}", number(bound)),
        }
    }

    /// Returns the tolerance as a page shows it.
    pub(crate) fn tolerance(self) -> String {
        match self {
            Self::Within { share, .. } if share >= 1e-3 => format!("{} %", number(100.0 * share)),
            Self::Within { share, .. } => number(share),
            Self::Between(..) | Self::AtMost(_) => String::new(),
        }
    }
}

/// Formats a number with five digits at most; below 1e-5 with two.
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

/// Removes trailing zeros of a decimal fraction.
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
