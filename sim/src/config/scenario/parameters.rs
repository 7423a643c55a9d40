//! Parameters of an estimator: in a scenario, and in a file of their own that scenarios include.

use crate::config::checked::{Finite, Version1};
use crate::config::file::{input_error, read_yaml};
use crate::config::scenario::external::External;
use crate::error::Error;
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// The mistake of a `map` for nothing.
pub(super) const MAP_WITHOUT_FMU: &str = "`map` gives the names in an FMU, and `fmu` names none";

/// The value of a parameter: a number, `true` or `false`, or a word.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A number.
    Number(Finite),
    /// Yes or no.
    Flag(bool),
    /// One word of several.
    Choice(String),
}

impl ParameterValue {
    /// As the estimators take it.
    pub fn setting(&self) -> Setting<'_> {
        match self {
            Self::Number(number) => Setting::Number(number.get()),
            Self::Flag(flag) => Setting::Flag(*flag),
            Self::Choice(word) => Setting::Choice(word),
        }
    }
}

impl From<f64> for ParameterValue {
    fn from(number: f64) -> Self {
        Self::Number(Finite::new(number))
    }
}

impl From<bool> for ParameterValue {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

impl From<&str> for ParameterValue {
    fn from(word: &str) -> Self {
        Self::Choice(word.into())
    }
}

impl<'de> Deserialize<'de> for ParameterValue {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        struct Value;
        impl Visitor<'_> for Value {
            type Value = ParameterValue;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, true or false, or a word")
            }
            fn visit_bool<E: serde::de::Error>(self, flag: bool) -> Result<Self::Value, E> {
                Ok(ParameterValue::Flag(flag))
            }
            fn visit_f64<E: serde::de::Error>(self, x: f64) -> Result<Self::Value, E> {
                let number = Finite::try_from(x).map_err(E::custom)?;
                Ok(ParameterValue::Number(number))
            }
            fn visit_i64<E: serde::de::Error>(self, x: i64) -> Result<Self::Value, E> {
                self.visit_f64(x as f64)
            }
            fn visit_u64<E: serde::de::Error>(self, x: u64) -> Result<Self::Value, E> {
                self.visit_f64(x as f64)
            }
            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Self::Value, E> {
                Ok(ParameterValue::Choice(word.to_owned()))
            }
        }
        de.deserialize_any(Value)
    }
}

impl JsonSchema for ParameterValue {
    fn schema_name() -> Cow<'static, str> {
        "ParameterValue".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "number", "minimum": -1e12, "maximum": 1e12 }, { "type": "boolean" }, { "type": "string" }] })
    }
}

/// One estimator of a scenario: its type, the library or FMU it is in if it is foreign, and its parameters, those of
/// the file named `from`, if any, with the others in their place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Name of its type in the registry; none = the name it has in the scenario.
    pub is: Option<String>,
    /// Shared library or FMU with it, relative to the scenario; none: it is one of the registry.
    pub library: Option<String>,
    /// True of an FMU, which a scenario names by `fmu`.
    pub is_fmu: bool,
    /// Names that an FMU has in place of ours, and numbers in place of outputs that it has not.
    pub map: BTreeMap<String, ParameterValue>,
    /// The way to it, if it runs outside of the program.
    pub external: Option<External>,
    /// The file of the library, once the scenario is loaded.
    pub(crate) library_file: Option<PathBuf>,
    /// Parameter file, relative to the scenario.
    pub from: Option<String>,
    /// Parameters by name; once the scenario is loaded, those of the file too.
    pub values: BTreeMap<String, ParameterValue>,
    /// Names of the values that are from the file.
    inherited: BTreeSet<String>,
}

impl Settings {
    /// These values, and no file.
    pub fn new(values: BTreeMap<String, ParameterValue>) -> Self {
        Self {
            values,
            ..Self::default()
        }
    }

    /// An estimator of this type, with its defaults.
    pub fn of_type(name: &str) -> Self {
        Self {
            is: Some(name.into()),
            ..Self::default()
        }
    }

    /// The same from a shared library, as it is named and where it was found.
    pub fn in_library(mut self, library: &str, file: PathBuf) -> Self {
        self.library = Some(library.into());
        self.library_file = Some(file);
        self
    }

    /// The same from an FMU, as it is named and where it was found.
    pub fn in_fmu(mut self, fmu: &str, file: PathBuf) -> Self {
        self.is_fmu = true;
        self.in_library(fmu, file)
    }

    /// True if it is none of the registry.
    pub fn is_foreign(&self) -> bool {
        self.library.is_some() || self.external.is_some()
    }

    /// The key that names its library or FMU, or where it runs.
    pub fn foreign_key(&self) -> &'static str {
        match (&self.external, self.is_fmu) {
            (Some(_), _) => "external",
            (None, true) => "fmu",
            (None, false) => "library",
        }
    }

    /// The same with another value of a parameter.
    pub fn set(mut self, key: &str, value: impl Into<ParameterValue>) -> Self {
        self.values.insert(key.into(), value.into());
        self
    }

    /// Name of its type, given its name in the scenario.
    pub fn type_name<'a>(&'a self, name: &'a str) -> &'a str {
        self.is.as_deref().unwrap_or(name)
    }

    /// Its type in words, given its name in the scenario: a foreign one with its library, an external one with the
    /// way to it.
    pub fn origin(&self, name: &str) -> String {
        if let Some(external) = &self.external {
            return format!("external, {external}");
        }
        match (&self.library, &self.is) {
            (None, _) => self.type_name(name).to_owned(),
            (Some(library), None) => format!("foreign, of {library}"),
            (Some(library), Some(is)) => format!("foreign, {is} of {library}"),
        }
    }

    /// The parameters as a build function takes them.
    pub fn named(&self) -> Vec<(&str, Setting<'_>)> {
        let values = self.values.iter();
        values.map(|(k, v)| (k.as_str(), v.setting())).collect()
    }

    /// True if the parameter is from the file.
    pub(super) fn inherits(&self, key: &str) -> bool {
        self.inherited.contains(key)
    }

    /// Takes from a parameter file the values that the scenario itself does not have.
    pub(super) fn include(&mut self, file: &ParameterFile) {
        for (key, value) in &file.parameters {
            if !self.values.contains_key(key) {
                self.values.insert(key.clone(), value.clone());
                self.inherited.insert(key.clone());
            }
        }
    }
}

/// A parameter file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParameterFile {
    /// Format version, 1.
    pub version: Version1,
    /// Purpose of these values.
    pub why: String,
    /// The estimator they are for.
    pub estimator: String,
    /// Parameters by name.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// Origin of the values, if `monorig tune` has found them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<Provenance>,
}

/// The study that found the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Name of the study.
    pub study: String,
    /// SHA-256 over the study, all its input files and the version of monorig.
    pub study_hash: String,
    /// Version of monorig.
    pub monorig: String,
    /// Optimiser.
    pub optimiser: String,
    /// Its seed.
    pub seed: u64,
    /// Trials made.
    pub trials: usize,
    /// Index of the winning trial.
    pub trial: usize,
    /// Loss over the tuning runs, the defaults' being 1.
    pub tuning_loss: f64,
    /// Loss over the validation runs, the defaults' being 1; none if it cannot be computed.
    pub validation_loss: Option<f64>,
    /// Result of the validation against the defaults: `better`, `no difference` or `worse`.
    pub verdict: String,
}

impl ParameterFile {
    /// Read a parameter file. Whether the estimator has such parameters is checked by those who build it.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file: Self = read_yaml(path)?;
        if file.why.trim().is_empty() {
            return Err(input_error(
                path,
                "why",
                "a parameter file says what its values are good for",
                "write a sentence",
            ));
        }
        Ok(file)
    }

    /// As it stands in the file.
    pub fn to_yaml(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_yaml::to_string(self).unwrap_or_default()
    }
}

impl<'de> Deserialize<'de> for Settings {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = Settings;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a mapping of parameters, such as {} or {lambda0: 0.98}")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Settings, A::Error> {
                let mut settings = Settings::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "library" | "fmu" if settings.library.is_some() => {
                            let why = "an estimator is in a library or in an FMU, not in both";
                            return Err(serde::de::Error::custom(why));
                        }
                        "library" => settings.library = Some(map.next_value()?),
                        "fmu" => {
                            settings.is_fmu = true;
                            settings.library = Some(map.next_value()?);
                        }
                        "external" => settings.external = Some(map.next_value()?),
                        "map" => settings.map = map.next_value()?,
                        "is" => settings.is = Some(map.next_value()?),
                        "from" => settings.from = Some(map.next_value()?),
                        _ => {
                            settings.values.insert(key, map.next_value()?);
                        }
                    }
                }
                if !settings.map.is_empty() && !settings.is_fmu {
                    return Err(serde::de::Error::custom(MAP_WITHOUT_FMU));
                }
                let named = settings.library.is_some() || settings.is.is_some();
                if settings.external.is_some() && (named || settings.from.is_some()) {
                    let why = "what runs outside is no library, no FMU and none of ours: `external` alone says where it is";
                    return Err(serde::de::Error::custom(why));
                }
                Ok(settings)
            }
        }
        de.deserialize_map(Entries)
    }
}

impl Serialize for Settings {
    fn serialize<S: Serializer>(&self, ser: S) -> Result<S::Ok, S::Error> {
        let mut map = ser.serialize_map(None)?;
        if let Some(library) = &self.library {
            map.serialize_entry(self.foreign_key(), library)?;
        }
        if let Some(external) = &self.external {
            map.serialize_entry(self.foreign_key(), external)?;
        }
        if !self.map.is_empty() {
            map.serialize_entry("map", &self.map)?;
        }
        if let Some(is) = &self.is {
            map.serialize_entry("is", is)?;
        }
        if let Some(from) = &self.from {
            map.serialize_entry("from", from)?;
        }
        for (key, value) in &self.values {
            map.serialize_entry(key, value)?;
        }
        map.end()
    }
}

impl JsonSchema for Settings {
    fn schema_name() -> Cow<'static, str> {
        "Settings".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Parameters by name; `is` names the type of estimator when this entry has a name of its own; `library` or `fmu` names a shared library or an FMU with it, relative to the scenario; `external` says where one runs that is outside of the program; `map` gives the names that the FMU has in place of ours; `from` names a parameter file, relative to the scenario, for those not given here.",
            "type": "object",
            "properties": { "is": { "type": "string" }, "library": { "type": "string" }, "fmu": { "type": "string" }, "external": generator.subschema_for::<External>(), "map": { "type": "object", "additionalProperties": generator.subschema_for::<ParameterValue>() }, "from": { "type": "string" } },
            "additionalProperties": generator.subschema_for::<ParameterValue>()
        })
    }
}
