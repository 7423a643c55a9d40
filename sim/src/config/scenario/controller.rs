//! The controller of a scenario: which one, where its feed-forward comes from, and its parameters.

use super::parameters::MAP_WITHOUT_FMU;
use super::plant_kind::settings;
use super::{FeedForward, ParameterValue};
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

/// The controller of a scenario that names none.
pub const DEFAULT_CONTROLLER: &str = "pi";

/// The controller of a scenario and its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSettings {
    /// Name of the controller in the registry.
    pub(crate) kind: String,
    /// FMU with it, relative to the scenario; none: it is one of the registry.
    pub fmu: Option<String>,
    /// Names that an FMU has in place of ours.
    pub map: BTreeMap<String, ParameterValue>,
    /// The file of the FMU, once the scenario is loaded.
    pub(crate) fmu_file: Option<PathBuf>,
    /// Source of slope and mass for the feed-forward.
    pub feedforward: FeedForward,
    /// Its parameters by name.
    pub values: BTreeMap<String, ParameterValue>,
}

impl Default for ControllerSettings {
    fn default() -> Self {
        Self {
            kind: DEFAULT_CONTROLLER.into(),
            fmu: None,
            map: BTreeMap::new(),
            fmu_file: None,
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
        settings(&self.values)
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
                let mut kind = None;
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "kind" => kind = Some(map.next_value()?),
                        "fmu" => settings.fmu = Some(map.next_value()?),
                        "map" => settings.map = map.next_value()?,
                        "feedforward" => settings.feedforward = map.next_value()?,
                        _ => {
                            settings.values.insert(key, map.next_value()?);
                        }
                    }
                }
                if kind.is_some() && settings.fmu.is_some() {
                    let why = "a controller is one that `kind` names or one in an FMU, not both";
                    return Err(serde::de::Error::custom(why));
                }
                if !settings.map.is_empty() && settings.fmu.is_none() {
                    return Err(serde::de::Error::custom(MAP_WITHOUT_FMU));
                }
                settings.kind = kind.unwrap_or(settings.kind);
                Ok(settings)
            }
        }
        de.deserialize_map(Entries)
    }
}

impl Serialize for ControllerSettings {
    fn serialize<S: Serializer>(&self, ser: S) -> Result<S::Ok, S::Error> {
        let mut map = ser.serialize_map(None)?;
        match &self.fmu {
            Some(fmu) => map.serialize_entry("fmu", fmu)?,
            None => map.serialize_entry("kind", &self.kind)?,
        }
        if !self.map.is_empty() {
            map.serialize_entry("map", &self.map)?;
        }
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
            "description": "The controller: `kind` names it, `pi` if not given, or `fmu` an FMU with it, relative to the scenario, and `map` the names that the FMU has in place of ours; `feedforward` says where slope and mass of the feed-forward come from; the rest are its parameters by name.",
            "type": "object",
            "properties": { "kind": { "type": "string", "default": DEFAULT_CONTROLLER }, "fmu": { "type": "string" }, "map": { "type": "object", "additionalProperties": value }, "feedforward": feedforward },
            "additionalProperties": value
        })
    }
}
