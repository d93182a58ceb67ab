//! Formats of numbers in messages, with few digits.

/// Formats a number with at most `digits` significant digits and without trailing zeros. The
/// exponent is left out for magnitudes from 1e-4 up to 1e6. All digits before the point are kept.
///
/// ```
/// use cdem::significant;
/// assert_eq!(significant(2.490_086_229e-4, 6), "0.000249009");
/// assert_eq!(significant(-1e-9, 3), "-1e-9");
/// assert_eq!(significant(1235.0, 2), "1235");
/// ```
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return value.to_string();
    }
    let digits = digits.max(1);
    // Round first: rounding may add a digit before the point.
    let rounded = format!("{value:.*e}", digits - 1);
    let Some((mantissa, Ok(order))) = rounded
        .split_once('e')
        .map(|(mantissa, order)| (mantissa, order.parse::<i32>()))
    else {
        return rounded;
    };
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(-4..6).contains(&order) {
        return format!("{}e{order}", without_zeros(mantissa));
    }
    let decimals = usize::try_from(digits as i32 - 1 - order).unwrap_or(0);
    without_zeros(&format!("{value:.decimals$}")).to_owned()
}

/// Formats a quantity with up to four digits and an SI prefix.
///
/// ```
/// assert_eq!(cdem::quantity(74_784.4, "J"), "74.78 kJ");
/// ```
#[must_use]
pub fn quantity(value: f64, unit: &str) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value} {unit}");
    }
    let power = (value.abs().log10() / 3.0 + 1e-12).floor().clamp(-5.0, 5.0);
    let prefix = ["f", "p", "n", "µ", "m", "", "k", "M", "G", "T", "P"][(power + 5.0) as usize];
    let number = significant(value / 1000_f64.powf(power), 4);
    format!("{number} {prefix}{unit}")
}

fn without_zeros(text: &str) -> &str {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text,
    }
}

/// Formats a number in an error message. Six digits tell numbers apart; more would be noise.
pub(crate) fn short(value: f64) -> String {
    significant(value, 6)
}

/// Largest number of blocks that a message names one by one.
const NAMED_BLOCKS: usize = 4;

/// Names the blocks of a message: all of a few; of many their number, the first two and the last.
pub(crate) fn named_blocks(names: &[&str]) -> String {
    let quoted = |names: &[&str]| {
        let quoted: Vec<_> = names.iter().map(|name| format!("\"{name}\"")).collect();
        quoted.join(", ")
    };
    match names {
        [name] => format!("block \"{name}\""),
        [first, second, .., last] if names.len() > NAMED_BLOCKS => format!(
            "{} blocks ({}, … \"{last}\")",
            names.len(),
            quoted(&[first, second])
        ),
        few => format!("{} blocks ({})", few.len(), quoted(few)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        for (value, text) in [
            (2.0, "2"),
            (0.014_999, "0.015"),
            (1234.5678, "1235"),
            (1e-9, "1e-9"),
            (1.25e9, "1.25e9"),
            (99_999.7, "100000"),
            (999_999.7, "1e6"),
            (100.0, "100"),
            (0.0, "0"),
            (-0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(significant(value, 4), text);
        }
    }

    #[test]
    fn quantities_have_a_prefix_and_few_digits() {
        for (value, text) in [
            (0.0, "0 J"),
            (1.0, "1 J"),
            (999.96, "1000 J"),
            (1000.0, "1 kJ"),
            (-74_784.4, "-74.78 kJ"),
            (5e-4, "500 µJ"),
            (1.234_56e-3, "1.235 mJ"),
            (3.2e20, "320000 PJ"),
            (f64::NAN, "NaN J"),
        ] {
            assert_eq!(quantity(value, "J"), text);
        }
    }

    #[test]
    fn many_blocks_are_counted_and_few_are_named() {
        for (names, text) in [
            (&["a"][..], "block \"a\""),
            (&["a", "b"], "2 blocks (\"a\", \"b\")"),
            (
                &["a", "b", "c", "d"],
                "4 blocks (\"a\", \"b\", \"c\", \"d\")",
            ),
            (
                &["a", "b", "c", "d", "e"],
                "5 blocks (\"a\", \"b\", … \"e\")",
            ),
        ] {
            assert_eq!(named_blocks(names), text);
        }
    }

    proptest! {
        #[test]
        fn six_digits_are_off_by_half_a_unit_at_most(value in prop::num::f64::NORMAL) {
            let read: f64 = short(value).parse().expect("a number");
            // Half a unit in the sixth digit of a number that begins with 1.
            prop_assert!((read / value - 1.0).abs() <= 5.000_001e-6, "{}", short(value));
        }
    }
}
