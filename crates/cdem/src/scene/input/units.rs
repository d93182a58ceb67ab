//! Texts such as "40 GPa": a number, a unit, and the powers of its base units.

/// Powers of metre, kilogram, second and radian.
pub(crate) type Exponents = [i32; 4];

/// A number in SI units (radians), with its base units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    /// SI value.
    pub(crate) value: f64,
    /// Powers of the base units.
    pub(crate) exponents: Exponents,
}

/// Reason for which a text is no quantity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Misread {
    /// As a part of a sentence.
    pub(crate) message: String,
    /// The unit, if it is unknown.
    pub(crate) unit: Option<String>,
}

/// A unit: a power of ten, another factor, and powers of base units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Unit {
    tens: i32,
    factor: f64,
    exponents: Exponents,
}

/// Units that take a prefix: symbol, power of ten in SI, base units.
const PREFIXED: [(&str, i32, Exponents); 8] = [
    ("m", 0, [1, 0, 0, 0]),
    ("g", -3, [0, 1, 0, 0]),
    ("s", 0, [0, 0, 1, 0]),
    ("N", 0, [1, 1, -2, 0]),
    ("Pa", 0, [-1, 1, -2, 0]),
    ("J", 0, [2, 1, -2, 0]),
    ("Hz", 0, [0, 0, -1, 0]),
    ("rad", 0, [0, 0, 0, 1]),
];

/// Units without prefixes: symbol, power of ten, factor, base units.
const PLAIN: [(&str, i32, f64, Exponents); 9] = [
    ("1", 0, 1.0, [0; 4]),
    ("%", -2, 1.0, [0; 4]),
    ("t", 3, 1.0, [0, 1, 0, 0]),
    ("bar", 5, 1.0, [-1, 1, -2, 0]),
    ("min", 0, 60.0, [0, 0, 1, 0]),
    ("h", 0, 3600.0, [0, 0, 1, 0]),
    ("deg", 0, std::f64::consts::PI / 180.0, [0, 0, 0, 1]),
    ("°", 0, std::f64::consts::PI / 180.0, [0, 0, 0, 1]),
    ("rpm", 0, std::f64::consts::PI / 30.0, [0, 0, -1, 1]),
];

const PREFIXES: [(char, i32); 10] = [
    ('n', -9),
    ('u', -6),
    ('µ', -6), // micro sign
    ('μ', -6), // Greek mu
    ('m', -3),
    ('c', -2),
    ('d', -1),
    ('k', 3),
    ('M', 6),
    ('G', 9),
];

/// Reads "40 GPa", "9.81 m/s²", "2.7 t/m^3", "1/s".
///
/// Powers of ten are applied to the decimal digits, so "0.2 ms" is bitwise
/// 2e-4. Products are written with `*`, `·` or a blank; every unit after a `/`
/// divides.
///
/// # Errors
/// If the text is not a number with a known unit.
pub(crate) fn read(text: &str) -> Result<Measured, Misread> {
    let text = text.trim();
    let (number, unit) = text.split_at(number_length(text));
    let wrong = |message: String| Misread {
        message,
        unit: None,
    };
    if number.is_empty() {
        return Err(wrong(format!("\"{text}\" does not begin with a number")));
    }
    let unit = unit.trim();
    if unit.is_empty() {
        return Err(wrong(format!("\"{text}\" has no unit")));
    }
    let unit = compound(unit).map_err(|message| Misread {
        message,
        unit: Some(unit.to_owned()),
    })?;
    let (digits, tens) = match number.split_once(['e', 'E']) {
        None => (number, Some(0)),
        Some((digits, tens)) => (digits, tens.parse::<i32>().ok()),
    };
    let value: Option<f64> = tens
        .and_then(|tens| tens.checked_add(unit.tens))
        .and_then(|tens| format!("{digits}e{tens}").parse().ok());
    match value.map(|value| value * unit.factor) {
        Some(value) if value.is_finite() => Ok(Measured {
            value,
            exponents: unit.exponents,
        }),
        Some(_) => Err(wrong(format!("\"{text}\" is too large"))),
        None => Err(wrong(format!("\"{number}\" is not a number"))),
    }
}

/// Bytes of the longest number at the start: sign, digits, point, exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        let rest = bytes[from..].iter();
        from + rest
            .take_while(|b| b.is_ascii_digit() || **b == b'.')
            .count()
    };
    let sign = |at: usize| usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let start = sign(0);
    let end = digits(start);
    if end == start {
        return 0;
    }
    if !matches!(bytes.get(end), Some(b'e' | b'E')) {
        return end;
    }
    let exponent = end + 1 + sign(end + 1);
    let last = digits(exponent);
    if last > exponent { last } else { end }
}

/// A product of units, with divisors.
fn compound(text: &str) -> Result<Unit, String> {
    let mut product = Unit {
        tens: 0,
        factor: 1.0,
        exponents: [0; 4],
    };
    for (i, part) in text.split('/').enumerate() {
        let sign = if i == 0 { 1 } else { -1 };
        let mut terms = part
            .split(['*', '·', ' '])
            .filter(|term| !term.is_empty())
            .peekable();
        if terms.peek().is_none() {
            return Err(format!("\"{text}\" is not a unit"));
        }
        for term in terms {
            let (unit, power) = power(term)?;
            let power = sign * power;
            product.tens += power * unit.tens;
            product.factor *= unit.factor.powi(power);
            for (sum, exponent) in product.exponents.iter_mut().zip(unit.exponents) {
                *sum += power * exponent;
            }
        }
    }
    Ok(product)
}

/// A unit and its power: `s`, `s2`, `s^2`, `s²`, `s^-2`, `s⁻²`.
fn power(term: &str) -> Result<(Unit, i32), String> {
    if let Some(unit) = single(term) {
        return Ok((unit, 1));
    }
    let plain: String = term
        .chars()
        .map(|c| match c {
            '²' => '2',
            '³' => '3',
            '¹' => '1',
            '⁻' => '-',
            other => other,
        })
        .filter(|c| *c != '^')
        .collect();
    let split = plain.find(|c: char| c == '-' || c.is_ascii_digit());
    let (symbol, exponent) = plain.split_at(split.unwrap_or(plain.len()));
    let exponent = exponent.parse().ok().filter(|p: &i32| (-4..=4).contains(p));
    single(symbol)
        .zip(exponent)
        .ok_or_else(|| format!("`{term}` is not a unit known here"))
}

/// A unit without power, with its prefix.
fn single(symbol: &str) -> Option<Unit> {
    if let Some((_, tens, factor, exponents)) = PLAIN.iter().find(|(name, ..)| *name == symbol) {
        return Some(Unit {
            tens: *tens,
            factor: *factor,
            exponents: *exponents,
        });
    }
    let unit = |name: &str, prefix: i32| {
        let (_, tens, exponents) = PREFIXED.iter().find(|(known, ..)| *known == name)?;
        Some(Unit {
            tens: tens + prefix,
            factor: 1.0,
            exponents: *exponents,
        })
    };
    unit(symbol, 0).or_else(|| {
        let first = symbol.chars().next()?;
        let (_, prefix) = PREFIXES.iter().find(|(c, _)| *c == first)?;
        unit(&symbol[first.len_utf8()..], *prefix)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn si(text: &str) -> f64 {
        read(text).expect(text).value
    }

    #[test]
    fn prefixes_shift_the_decimal_point_exactly() {
        for (text, value) in [
            ("40 GPa", 40e9),
            ("0.2 ms", 2e-4),
            ("5mm", 5e-3),
            ("3e2 µm", 3e-4),
            ("-1.5E-1 kN/m", -150.0),
            ("2.7 t/m^3", 2700.0),
            ("2.7 g/cm³", 2700.0),
            ("9.81 m/s2", 9.81),
            ("9.81 m·s^-2", 9.81),
            ("100 1/s", 100.0),
            ("25 %", 0.25),
            ("30 N/mm²", 30e6),
            ("+1 min", 60.0),
        ] {
            assert_eq!(si(text), value, "{text}");
        }
    }

    #[test]
    fn factors_that_are_no_powers_of_ten() {
        // One rounding of the factor, one of the product.
        let close = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs();
        assert!(close(si("72 km/h"), 20.0));
        assert!(close(si("180 deg"), std::f64::consts::PI));
        assert!(close(si("30°"), std::f64::consts::FRAC_PI_6));
        assert!(close(si("60 rpm"), std::f64::consts::TAU));
    }

    #[test]
    fn dimensions_add_up() {
        assert_eq!(
            read("1 N/m²").map(|m| m.exponents),
            read("1 Pa").map(|m| m.exponents)
        );
        assert_eq!(
            read("1 N*m").map(|m| m.exponents),
            read("1 J").map(|m| m.exponents)
        );
        assert_eq!(read("1 m/s/s").map(|m| m.exponents), Ok([1, 0, -2, 0]));
    }

    #[test]
    fn what_is_no_quantity_says_why() {
        for (text, part) in [
            ("GPa", "does not begin with a number"),
            ("", "does not begin with a number"),
            ("40", "has no unit"),
            ("40 GPs", "`GPs` is not a unit"),
            ("40 gpa", "`gpa` is not a unit"),
            ("40 Pa/", "\"Pa/\" is not a unit"),
            ("1 m^9", "`m^9` is not a unit"),
            ("1e999 m", "too large"),
            ("1e99999999999 m", "not a number"),
            ("1.2.3 m", "not a number"),
            ("nan m", "does not begin with a number"),
        ] {
            let message = read(text).expect_err(text);
            assert!(message.message.contains(part), "{text}: {message:?}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,12}") {
            if let Ok(measured) = read(&text) {
                prop_assert!(measured.value.is_finite());
            }
        }

        #[test]
        fn numbers_keep_their_bits(value in -1e300..1e300_f64) {
            prop_assert_eq!(si(&format!("{value} m")), value);
        }
    }
}
