//! The controller of a scenario: which one, where its feed-forward comes from, and its parameters.

use super::{FeedForward, ParameterValue};
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// The controller of a scenario that names none.
pub const DEFAULT_CONTROLLER: &str = "pi";

/// The controller of a scenario and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSettings {
    /// Name of the controller in the registry.
    pub(crate) kind: String,
    /// Source of slope and mass for the feed-forward.
    pub feedforward: FeedForward,
    /// Its parameters by name.
    pub(crate) values: BTreeMap<String, ParameterValue>,
}

impl Default for ControllerSettings {
    fn default() -> Self {
        Self {
            kind: DEFAULT_CONTROLLER.into(),
            feedforward: FeedForward::None,
            values: BTreeMap::new(),
        }
    }
}

impl ControllerSettings {
    /// A controller of this kind, with its defaults.
    pub fn of_kind(name: &str) -> Self {
        Self {
            kind: name.into(),
            ..Self::default()
        }
    }

    /// The same with another value of a parameter.
    pub fn set(mut self, key: &str, value: impl Into<ParameterValue>) -> Self {
        self.values.insert(key.into(), value.into());
        self
    }

    /// The parameters as a build function takes them.
    pub(crate) fn named(&self) -> Vec<(&str, Setting<'_>)> {
        let values = self.values.iter();
        values.map(|(k, v)| (k.as_str(), v.setting())).collect()
    }
}

impl<'de> Deserialize<'de> for ControllerSettings {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = ControllerSettings;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a mapping of parameters, such as {feedforward: estimate, kp: 2.0}")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut settings = ControllerSettings::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "kind" => settings.kind = map.next_value()?,
                        "feedforward" => settings.feedforward = map.next_value()?,
                        _ => {
                            settings.values.insert(key, map.next_value()?);
                        }
                    }
                }
                Ok(settings)
            }
        }
        de.deserialize_map(Entries)
    }
}

impl Serialize for ControllerSettings {
    fn serialize<S: Serializer>(&self, ser: S) -> Result<S::Ok, S::Error> {
        let mut map = ser.serialize_map(None)?;
        map.serialize_entry("kind", &self.kind)?;
        map.serialize_entry("feedforward", &self.feedforward)?;
        for (key, value) in &self.values {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

impl JsonSchema for ControllerSettings {
    fn schema_name() -> Cow<'static, str> {
        "Controller".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let feedforward = generator.subschema_for::<FeedForward>();
        let value = generator.subschema_for::<ParameterValue>();
        json_schema!({
            "description": "The controller: `kind` names it, `pi` if not given; `feedforward` says where slope and mass of the feed-forward come from; the rest are its parameters by name.",
            "type": "object",
            "properties": { "kind": { "type": "string", "default": DEFAULT_CONTROLLER }, "feedforward": feedforward },
            "additionalProperties": value
        })
    }
}
