//! A number of a scene whose unit is known: SI, or text with a unit.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::scene::input::units::{self, Exponents};

/// Physical quantity that a key measures.
pub(crate) trait Dimension: Copy + fmt::Debug + Default + PartialEq {
    /// Name in the schema.
    const NAME: &'static str;
    /// Its name in a sentence: "a pressure".
    const MEASURES: &'static str;
    /// Unit of a bare number; "1" for ratios.
    const UNIT: &'static str;
    /// A text with a unit.
    const EXAMPLE: &'static str;
    /// The usual units, smallest first.
    const UNITS: &'static [&'static str];
    /// Powers of metre, kilogram, second and radian.
    const EXPONENTS: [i32; 4];
}

macro_rules! dimensions {
    ($($name:ident, $measures:literal, $unit:literal, $example:literal, $exponents:expr,
       [$($units:literal),*];)*) => {
        $(
            #[doc = concat!("In ", $unit, ".")]
            #[derive(Clone, Copy, Debug, Default, PartialEq)]
            pub(crate) struct $name;

            impl Dimension for $name {
                const NAME: &'static str = stringify!($name);
                const MEASURES: &'static str = $measures;
                const UNIT: &'static str = $unit;
                const EXAMPLE: &'static str = $example;
                const UNITS: &'static [&'static str] = &[$($units),*];
                const EXPONENTS: [i32; 4] = $exponents;
            }
        )*

        /// Returns the name in a sentence of the quantity with these exponents.
        fn measures(exponents: Exponents) -> &'static str {
            $(if exponents == $name::EXPONENTS { return $measures; })*
            "something else"
        }
    };
}

dimensions! {
    Ratio, "a plain number", "1", "25 %", [0, 0, 0, 0],
        ["%"];
    Length, "a length", "m", "5 mm", [1, 0, 0, 0],
        ["µm", "mm", "cm", "m", "km"];
    Duration, "a time", "s", "0.2 ms", [0, 0, 1, 0],
        ["µs", "ms", "s", "min", "h"];
    Velocity, "a velocity", "m/s", "10 km/h", [1, 0, -1, 0],
        ["mm/s", "m/s", "km/h", "km/s"];
    Acceleration, "an acceleration", "m/s²", "9.81 m/s^2", [1, 0, -2, 0],
        ["mm/s^2", "m/s^2"];
    Angle, "an angle", "degrees", "30 deg", [0, 0, 0, 1],
        ["deg", "rad"];
    AngularVelocity, "an angular velocity", "rad/s", "10 rpm", [0, 0, -1, 1],
        ["deg/s", "rad/s", "rpm"];
    Rate, "a rate", "1/s", "10 Hz", [0, 0, -1, 0],
        ["1/s", "Hz", "kHz"];
    Pressure, "a pressure", "Pa", "40 GPa", [-1, 1, -2, 0],
        ["Pa", "kPa", "bar", "MPa", "GPa"];
    Density, "a density", "kg/m³", "2.7 t/m^3", [-3, 1, 0, 0],
        ["kg/m^3", "g/cm^3", "t/m^3"];
    Energy, "an energy", "J", "5 kJ", [2, 1, -2, 0],
        ["mJ", "J", "kJ", "MJ"];
    Stiffness, "a stiffness", "N/m", "10 MN/m", [0, 1, -2, 0],
        ["N/m", "kN/m", "MN/m", "GN/m"];
}

/// A number in SI units (angles: radians) that a scene gives as a number or as
/// text with a unit. Bare angles are in degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Quantity<M>(f64, PhantomData<M>);

impl<M: Dimension> Quantity<M> {
    /// A quantity of so many SI units (radians).
    #[must_use]
    pub(crate) const fn new(si: f64) -> Self {
        Self(si, PhantomData)
    }

    /// The value in SI units (radians).
    #[must_use]
    pub(crate) const fn si(self) -> f64 {
        self.0
    }

    /// Returns the accepted forms, for the schema.
    fn description() -> String {
        let (measures, example) = (M::MEASURES, M::EXAMPLE);
        match M::UNIT {
            "1" => format!("{measures}, or text such as \"{example}\""),
            unit => format!("{measures}: a number in {unit}, or text such as \"{example}\""),
        }
    }

    const IN_DEGREES: bool = matches!(M::EXPONENTS, Angle::EXPONENTS);

    fn from_bare<E: Error>(value: f64) -> Result<Self, E> {
        if !value.is_finite() {
            return Err(E::custom(format_args!(
                "must be a finite number, got {value}"
            )));
        }
        Ok(Self::new(if Self::IN_DEGREES {
            value.to_radians()
        } else {
            value
        }))
    }

    fn from_text<E: Error>(text: &str) -> Result<Self, E> {
        let wrong = |what: &str, help: String| {
            let measures = M::MEASURES;
            E::custom(format_args!("expected {measures}, but {what}\n{help}"))
        };
        let measured = units::read(text).map_err(|misread| {
            let help = misread.unit.as_deref().map_or_else(Self::form, Self::units);
            wrong(&misread.message, help)
        })?;
        if measured.exponents == M::EXPONENTS {
            return Ok(Self::new(measured.value));
        }
        let found = measures(measured.exponents);
        Err(wrong(&format!("\"{text}\" is {found}"), Self::form()))
    }

    /// Returns advice on the form of a value.
    fn form() -> String {
        let example = M::EXAMPLE;
        match M::UNIT {
            "1" => format!("write a number, or text such as \"{example}\""),
            unit => format!("write a number in {unit}, or text such as \"{example}\""),
        }
    }

    /// Returns advice on a unit that is not known: the nearest one, or all of them.
    fn units(unknown: &str) -> String {
        let (measures, all) = (M::MEASURES, M::UNITS.join(", "));
        // Units differ by their capitals: the same letters are nearest.
        let letters = |unit: &&&str| unit.to_lowercase() == unknown.to_lowercase();
        let same = M::UNITS.iter().find(letters).copied();
        // One slip; with two, "mph" would be "km/h".
        let slip =
            |unit: &&&str| unknown.len() > 2 && strsim::damerau_levenshtein(unknown, unit) < 2;
        match same.or_else(|| M::UNITS.iter().find(slip).copied()) {
            Some(unit) => format!("did you mean `{unit}`? Units of {measures}: {all}"),
            None => format!(
                "units of {measures}: {all}; or write a number in {}",
                M::UNIT
            ),
        }
    }
}

/// The value in the unit of a bare number, with that unit.
impl<M: Dimension> fmt::Display for Quantity<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = if Self::IN_DEGREES {
            degrees(self.0).unwrap_or(self.0.to_degrees())
        } else {
            self.0
        };
        // Nobody counts sixteen digits.
        if value.abs() < 1e15 {
            write!(f, "{value}")?;
        } else {
            write!(f, "{value:e}")?;
        }
        match M::UNIT {
            "1" => Ok(()),
            unit => write!(f, " {unit}"),
        }
    }
}

impl<'de, M: Dimension> Deserialize<'de> for Quantity<M> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(QuantityVisitor(PhantomData))
    }
}

/// Reads a bare number or a text.
struct QuantityVisitor<M>(PhantomData<M>);

impl<M: Dimension> Visitor<'_> for QuantityVisitor<M> {
    type Value = Quantity<M>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Quantity::<M>::description())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Quantity::from_bare(value)
    }

    #[allow(clippy::cast_precision_loss)] // a whole number of 2^53 units is none that matters
    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Quantity::from_bare(value as f64)
    }

    #[allow(clippy::cast_precision_loss)] // as above
    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Quantity::from_bare(value as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Quantity::from_text(text)
    }
}

impl<M: Dimension> Serialize for Quantity<M> {
    /// Such that reading it gives the same bits.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !Self::IN_DEGREES {
            return serializer.serialize_f64(self.0);
        }
        match degrees(self.0) {
            Some(degrees) => serializer.serialize_f64(degrees),
            None => serializer.collect_str(&format_args!("{} rad", self.0)),
        }
    }
}

/// The degrees that give exactly these radians, the shortest in decimals
/// first. Every tenth number of radians has none: degrees are coarser there.
fn degrees(radians: f64) -> Option<f64> {
    let near = radians.to_degrees();
    let short = format!("{near:.12e}").parse().unwrap_or(near);
    [short, near, near.next_down(), near.next_up()]
        .into_iter()
        .find(|degrees| degrees.to_radians().to_bits() == radians.to_bits())
}

impl<M: Dimension> JsonSchema for Quantity<M> {
    fn schema_name() -> Cow<'static, str> {
        M::NAME.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": Self::description(),
            "type": ["number", "string"],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::{Value, from_value, json, to_value};

    fn read<M: Dimension>(value: Value) -> Result<f64, String> {
        let read: Result<Quantity<M>, _> = from_value(value);
        read.map(Quantity::si).map_err(|e| e.to_string())
    }

    #[test]
    fn numbers_are_si_and_bare_angles_degrees() {
        assert_eq!(read::<Pressure>(json!(40)), Ok(40.0));
        assert_eq!(read::<Pressure>(json!("40 GPa")), Ok(40e9));
        assert_eq!(read::<Angle>(json!(180)), Ok(std::f64::consts::PI));
        assert_eq!(read::<Angle>(json!("1 rad")), Ok(1.0));
        assert_eq!(read::<AngularVelocity>(json!(2.0)), Ok(2.0));
    }

    #[test]
    fn the_wrong_dimension_is_named() {
        let message = read::<Pressure>(json!("5 mm")).expect_err("a length");
        assert!(
            message.contains("expected a pressure, but \"5 mm\" is a length"),
            "{message}"
        );
        let message = read::<Length>(json!("5 kg m")).expect_err("kg m");
        assert!(message.contains("is something else"), "{message}");
    }

    #[test]
    fn unknown_units_are_answered_with_known_ones() {
        let told = |text: &str| read::<Pressure>(json!(text)).expect_err(text);
        let message = told("40 GPA");
        assert!(message.contains("did you mean `GPa`?"), "{message}");
        let message = told("5 ksi");
        assert!(
            message
                .contains("units of a pressure: Pa, kPa, bar, MPa, GPa; or write a number in Pa"),
            "{message}"
        );
        let message = read::<Velocity>(json!("30 mph")).expect_err("miles");
        assert!(
            message.contains("\nunits of a velocity: mm/s, m/s"),
            "{message}"
        );
        let message = read::<Velocity>(json!("30 km/hr")).expect_err("hr");
        assert!(message.contains("did you mean `km/h`?"), "{message}");
    }

    fn listed<M: Dimension>() {
        for unit in M::UNITS {
            let read = read::<M>(json!(format!("1 {unit}")));
            assert!(read.is_ok(), "{unit}: {read:?}");
        }
    }

    #[test]
    fn the_units_that_are_listed_are_known() {
        listed::<Ratio>();
        listed::<Length>();
        listed::<Duration>();
        listed::<Velocity>();
        listed::<Acceleration>();
        listed::<Angle>();
        listed::<AngularVelocity>();
        listed::<Rate>();
        listed::<Pressure>();
        listed::<Density>();
        listed::<Energy>();
        listed::<Stiffness>();
    }

    #[test]
    fn degrees_are_written_as_they_were_typed() {
        for typed in [20.0, 30.0, 33.7, 0.1, 89.999, -12.5] {
            let angle = Quantity::<Angle>::new(f64::to_radians(typed));
            assert_eq!(to_value(angle).ok(), Some(json!(typed)));
        }
    }

    proptest! {
        #[test]
        fn writing_and_reading_keeps_the_bits(radians in -10.0..10.0_f64, plain: i64) {
            let written = to_value(Quantity::<Angle>::new(radians)).expect("a value");
            prop_assert_eq!(read::<Angle>(written).map(f64::to_bits), Ok(radians.to_bits()));
            #[allow(clippy::cast_precision_loss)]
            let length = plain as f64;
            let written = to_value(Quantity::<Length>::new(length)).expect("a value");
            prop_assert_eq!(read::<Length>(written), Ok(length));
        }
    }
}
