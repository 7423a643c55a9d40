//! The block `channels` of a map file: a key for each measured quantity, by the table of the estimators' crate.
//!
//! Wheel speed and traction have keys of a form of their own; traction is what motor torques are made of.

use super::channel_keys::{CommandChannel, ScalarChannel, Traction, VectorChannel, WheelChannel};
use crate::notation::Quantity;
use monorig_estimators::api::signals::{Measurand, Shape};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Columns of a measured quantity.
#[derive(Clone, Debug, serde::Serialize)]
#[serde(untagged)]
#[allow(
    clippy::large_enum_variant,
    reason = "a map file has some of these channels"
)]
pub(crate) enum MeasuredChannel {
    /// Columns of three axes.
    Vector(VectorChannel),
    /// Column of one value.
    Scalar(ScalarChannel),
    /// Columns of one value for each drive unit, or for each reading.
    List(Vec<ScalarChannel>),
}

/// Columns of a log by the quantity that they measure. Estimators do without quantities that are missing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Channels {
    /// Measured quantities, but for wheel speed and motor torque.
    pub measured: BTreeMap<Measurand, MeasuredChannel>,
    /// Speeds of wheels at their circumference.
    pub wheel_speed: Vec<WheelChannel>,
    /// Traction of the vehicle.
    pub traction: Option<Traction>,
    /// Command of the controller. Without it the measured torque stands for it.
    pub command: Option<CommandChannel>,
}

impl Channels {
    /// The columns of a vector, if the map has them.
    pub fn vector(&self, measurand: Measurand) -> Option<&VectorChannel> {
        match self.measured.get(&measurand)? {
            MeasuredChannel::Vector(channel) => Some(channel),
            _ => None,
        }
    }
}

/// Place of a channel in the map file, for errors; `index` counts those of a list.
pub(crate) fn key(measurand: Measurand, index: usize) -> String {
    let name = measurand.name();
    match measurand.shape() {
        Shape::Vector | Shape::Scalar => format!("channels.{name}"),
        Shape::PerDrive | Shape::Auxiliary => format!("channels.{name}[{index}]"),
    }
}

/// Quantity of the columns of a measurand. One in a unit that is not of the list is recorded as it is, in the unit `1`.
pub(crate) fn quantity(measurand: Measurand) -> Quantity {
    Quantity::of_si(measurand.unit()).unwrap_or(Quantity::Number)
}

/// True if a measurand has a key of the usual form.
fn is_usual(measurand: Measurand) -> bool {
    !matches!(measurand, Measurand::WheelSpeed | Measurand::MotorTorque)
}

/// The measurand of a key of the usual form.
fn measurand_of(key: &str) -> Option<Measurand> {
    Measurand::named(key).filter(|m| is_usual(*m))
}

/// All keys of the block.
static KEYS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    let key = |m: &Measurand| match m {
        Measurand::MotorTorque => "traction",
        m => m.name(),
    };
    let keys = Measurand::ALL.iter().map(key);
    keys.chain(["command"]).collect()
});

struct ChannelsVisitor;

impl<'de> Visitor<'de> for ChannelsVisitor {
    type Value = Channels;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("struct Channels")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Channels, A::Error> {
        let mut channels = Channels::default();
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "wheel_speed" => channels.wheel_speed = map.next_value()?,
                "traction" => channels.traction = map.next_value()?,
                "command" => channels.command = map.next_value()?,
                key => {
                    let measurand =
                        measurand_of(key).ok_or_else(|| A::Error::unknown_field(key, &KEYS))?;
                    let channel = match measurand.shape() {
                        Shape::Vector => {
                            map.next_value::<Option<_>>()?.map(MeasuredChannel::Vector)
                        }
                        Shape::Scalar => {
                            map.next_value::<Option<_>>()?.map(MeasuredChannel::Scalar)
                        }
                        Shape::PerDrive | Shape::Auxiliary => {
                            let list: Vec<_> = map.next_value()?;
                            (!list.is_empty()).then_some(MeasuredChannel::List(list))
                        }
                    };
                    channels.measured.extend(channel.map(|c| (measurand, c)));
                }
            }
        }
        Ok(channels)
    }
}

impl<'de> Deserialize<'de> for Channels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("Channels", &KEYS, ChannelsVisitor)
    }
}

impl Serialize for Channels {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (measurand, channel) in &self.measured {
            map.serialize_entry(measurand.name(), channel)?;
        }
        if !self.wheel_speed.is_empty() {
            map.serialize_entry("wheel_speed", &self.wheel_speed)?;
        }
        if let Some(traction) = &self.traction {
            map.serialize_entry("traction", traction)?;
        }
        if let Some(command) = &self.command {
            map.serialize_entry("command", command)?;
        }
        map.end()
    }
}

/// Keys with their own form, for the schema.
#[derive(JsonSchema)]
#[schemars(deny_unknown_fields)]
#[expect(dead_code, reason = "only its schema is used")]
struct OwnKeys {
    /// Speeds of wheels at their circumference.
    #[schemars(default)]
    wheel_speed: Vec<WheelChannel>,
    /// Torque, force or power that drives the vehicle.
    traction: Option<Traction>,
    /// Command of the controller. Without it the measured torque stands for it.
    command: Option<CommandChannel>,
}

impl JsonSchema for Channels {
    fn schema_name() -> Cow<'static, str> {
        "Channels".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = OwnKeys::json_schema(generator);
        let about =
            "Quantities in the columns of a log. Estimators run without missing quantities.";
        schema.insert("description".into(), about.into());
        for measurand in Measurand::ALL.iter().copied().filter(|m| is_usual(*m)) {
            let mut channel = match measurand.shape() {
                Shape::Vector => Option::<VectorChannel>::json_schema(generator),
                Shape::Scalar => Option::<ScalarChannel>::json_schema(generator),
                Shape::PerDrive | Shape::Auxiliary => Vec::<ScalarChannel>::json_schema(generator),
            };
            channel.insert("description".into(), measurand.about().into());
            if measurand.shape().slots() > 1 {
                channel.insert("default".into(), serde_json::json!([]));
            }
            let properties = schema.get_mut("properties");
            if let Some(properties) = properties.and_then(|p| p.as_object_mut()) {
                properties.insert(measurand.name().into(), channel.into());
            }
        }
        schema
    }
}
