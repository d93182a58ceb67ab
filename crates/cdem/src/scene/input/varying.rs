//! Values that a scene gives in two ways: constant or as a table in time,
//! single or by component.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::scene::input::quantity::{Angle, Dimension, Duration, Quantity, Ratio};

/// A quantity, or something else that is an array or a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged, bound(serialize = "M: Dimension, T: Serialize"))]
pub(crate) enum QuantityOr<M, T> {
    /// A number, or text with a unit.
    Quantity(Quantity<M>),
    /// A table in time, a vector, or axis and angle.
    Other(T),
}

impl<M: Dimension, T: JsonSchema + OtherForm> JsonSchema for QuantityOr<M, T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("{}Or{}", M::NAME, T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut other = T::json_schema(generator);
        other.insert("description".to_owned(), T::description().into());
        json_schema!({
            "anyOf": [generator.subschema_for::<Quantity<M>>(), other],
        })
    }
}

/// A row `[time, value]` of a table.
pub(crate) type TimeRow<T> = (Quantity<Duration>, T);

/// A number, or a table of `[time, number]`.
pub(crate) type Varying<M> = QuantityOr<M, Vec<TimeRow<Quantity<M>>>>;

/// A number (2-D) or a vector (3-D).
pub(crate) type NumberOrVector<M> = QuantityOr<M, Vec<Quantity<M>>>;

/// A rotation about the origin: an angle (2-D), or axis and angle (3-D).
pub(crate) type Rotate = QuantityOr<Angle, AxisAngle>;

/// An axis through the origin and an angle about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct AxisAngle {
    /// Direction of the axis, of any length but 0.
    pub(crate) axis: Vec<Quantity<Ratio>>,
    /// Angle, degrees, by the right-hand rule.
    pub(crate) angle: Quantity<Angle>,
}

/// A vector, or a table of `[time, vector]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged, bound(serialize = "M: Dimension"))]
pub(crate) enum VaryingVector<M> {
    /// The same at all times.
    Constant(Vec<Quantity<M>>),
    /// Rows of time and vector.
    Table(Vec<TimeRow<Vec<Quantity<M>>>>),
}

impl<M: Dimension> JsonSchema for VaryingVector<M> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("{}VectorOrTable", M::NAME).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut constant = Vec::<Quantity<M>>::json_schema(generator);
        let text = format!("A vector in {}, constant in time.", M::UNIT);
        constant.insert("description".to_owned(), text.into());
        let mut table = Vec::<TimeRow<Vec<Quantity<M>>>>::json_schema(generator);
        let text = format!(
            "A table [[time, vector], …] in s and {}: linear between its rows, constant beyond \
             its ends.",
            M::UNIT
        );
        table.insert("description".to_owned(), text.into());
        json_schema!({ "anyOf": [constant, table] })
    }
}

/// "pressure", without its article.
fn measured<M: Dimension>() -> &'static str {
    M::MEASURES
        .split_once(' ')
        .map_or(M::MEASURES, |(_, rest)| rest)
}

/// The form beside a number.
pub(crate) trait OtherForm {
    /// In a sentence: "an array of numbers".
    const FORM: &'static str;

    /// In the schema.
    fn description() -> String;
}

impl<M: Dimension> OtherForm for Vec<Quantity<M>> {
    const FORM: &'static str = "an array of numbers";

    fn description() -> String {
        format!("3-D: a vector [x, y, z] in {}.", M::UNIT)
    }
}

impl<M: Dimension> OtherForm for Vec<TimeRow<Quantity<M>>> {
    const FORM: &'static str = "a table [[time, value], …]";

    fn description() -> String {
        format!(
            "A table [[time, {}], …] in s and {}: linear between its rows, constant beyond its \
             ends.",
            measured::<M>(),
            M::UNIT
        )
    }
}

impl<M: Dimension> OtherForm for TimeRow<Vec<Quantity<M>>> {
    const FORM: &'static str = "a row [time, [x, y, …]]";

    fn description() -> String {
        format!("A row [time, vector] of a table in s and {}.", M::UNIT)
    }
}

impl OtherForm for AxisAngle {
    const FORM: &'static str = "in 3-D { axis = [x, y, z], angle = … }";

    fn description() -> String {
        "3-D: axis and angle.".to_owned()
    }
}

impl<'de, M, T> Deserialize<'de> for QuantityOr<M, T>
where
    M: Dimension,
    T: Deserialize<'de> + OtherForm,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(QuantityOrVisitor(PhantomData))
    }
}

struct QuantityOrVisitor<M, T>(PhantomData<(M, T)>);

impl<M: Dimension, T> QuantityOrVisitor<M, T> {
    fn quantity<'de, E: Error>(from: impl IntoDeserializer<'de, E>) -> Result<QuantityOr<M, T>, E> {
        Quantity::deserialize(from.into_deserializer()).map(QuantityOr::Quantity)
    }
}

impl<'de, M, T> Visitor<'de> for QuantityOrVisitor<M, T>
where
    M: Dimension,
    T: Deserialize<'de> + OtherForm,
{
    type Value = QuantityOr<M, T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} (a number in {}, or text such as \"{}\"), or {}",
            M::MEASURES,
            M::UNIT,
            M::EXAMPLE,
            T::FORM
        )
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Self::quantity(value)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Self::quantity(value)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Self::quantity(value)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Self::quantity(text)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Self::Value, A::Error> {
        T::deserialize(SeqAccessDeserializer::new(items)).map(QuantityOr::Other)
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(entries)).map(QuantityOr::Other)
    }
}

impl<'de, M: Dimension> Deserialize<'de> for VaryingVector<M> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let items = Vec::<QuantityOr<M, TimeRow<Vec<Quantity<M>>>>>::deserialize(deserializer)?;
        let (mut constant, mut table) = (Vec::new(), Vec::new());
        for item in items {
            match item {
                QuantityOr::Quantity(component) => constant.push(component),
                QuantityOr::Other(row) => table.push(row),
            }
        }
        match (constant.is_empty(), table.is_empty()) {
            (_, true) => Ok(Self::Constant(constant)),
            (true, false) => Ok(Self::Table(table)),
            (false, false) => Err(Error::custom(
                "numbers and rows are mixed\n\
                 write one vector [x, y, …], or a table [[time, [x, y, …]], …]",
            )),
        }
    }
}
