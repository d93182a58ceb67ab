//! Numbers as messages show them: few digits.

/// A number with at most so many significant digits, without zeros at its end,
/// and without an exponent as long as it is of everyday size. Digits before
/// the point are all kept.
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
    // Rounded first: rounding may add a digit before the point.
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

fn without_zeros(text: &str) -> &str {
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.'),
        false => text,
    }
}

/// Of a number in an error: six digits tell numbers apart, more are noise.
pub(crate) fn short(value: f64) -> String {
    significant(value, 6)
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

    proptest! {
        #[test]
        fn six_digits_are_off_by_half_a_unit_at_most(value in prop::num::f64::NORMAL) {
            let read: f64 = short(value).parse().expect("a number");
            // Half a unit in the sixth digit of a number that begins with 1.
            prop_assert!((read / value - 1.0).abs() <= 5.000_001e-6, "{}", short(value));
        }
    }
}
