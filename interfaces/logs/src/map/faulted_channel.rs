//! The channel of a fault in a map file.

use monorig_estimators::api::signals::Measurand;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};
use std::borrow::Cow;
use std::sync::LazyLock;

/// A channel that can have a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaultedChannel {
    /// Specific force and angular rate.
    Imu,
    /// Torque, force or power.
    Traction,
    /// A measured quantity.
    Measured(Measurand),
}

/// All of them, by name. Motor torques are faulted through the traction that they are made of.
static ALL: LazyLock<Vec<(&'static str, FaultedChannel)>> = LazyLock::new(|| {
    let named = |m: &Measurand| match m {
        Measurand::MotorTorque => ("traction", FaultedChannel::Traction),
        m => (m.name(), FaultedChannel::Measured(*m)),
    };
    let imu = [("imu", FaultedChannel::Imu)];
    imu.into_iter()
        .chain(Measurand::ALL.iter().map(named))
        .collect()
});

static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| ALL.iter().map(|(name, _)| *name).collect());

impl FaultedChannel {
    fn name(self) -> &'static str {
        let of = ALL.iter().find(|(_, channel)| *channel == self);
        of.map_or("", |(name, _)| name)
    }

    fn about(self) -> &'static str {
        match self {
            Self::Imu => "Specific force and angular rate.",
            Self::Traction => "Torque, force or power.",
            Self::Measured(measurand) => measurand.about(),
        }
    }
}

impl<'de> Deserialize<'de> for FaultedChannel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let known = ALL.iter().find(|(known, _)| *known == name);
        known
            .map(|(_, channel)| *channel)
            .ok_or_else(|| D::Error::unknown_variant(&name, &NAMES))
    }
}

impl Serialize for FaultedChannel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl JsonSchema for FaultedChannel {
    fn schema_name() -> Cow<'static, str> {
        "FaultedChannel".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one = |(name, channel): &(&str, Self)| json_schema!({ "description": channel.about(), "type": "string", "const": name });
        json_schema!({
            "description": "A channel that can have a fault.",
            "oneOf": ALL.iter().map(one).collect::<Vec<_>>()
        })
    }
}
