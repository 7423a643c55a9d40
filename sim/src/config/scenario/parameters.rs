//! Values of parameters, and files of parameters of an estimator that scenarios include.

use crate::config::checked::{Finite, Version1};
use crate::config::file::{input_error, read_yaml};
use crate::error::Error;
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Visitor;
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// The value of a parameter: a number, `true` or `false`, or a word.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A number.
    Number(Finite),
    /// True or false.
    Flag(bool),
    /// One of several words.
    Choice(String),
}

impl ParameterValue {
    /// Returns the value as a setting of an estimator.
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
    /// Origin of the values, if `monorig tune` found them.
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
    /// Loss over the tuning runs; the loss of the defaults is 1.
    pub tuning_loss: f64,
    /// Loss over the validation runs; the loss of the defaults is 1; none if it cannot be computed.
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
                "a parameter file needs a purpose",
                "write a sentence",
            ));
        }
        Ok(file)
    }

    /// Returns the text of the value in a file.
    pub fn to_yaml(&self) -> String {
        // Strings and finite numbers: nothing in here can fail to serialise.
        serde_yaml::to_string(self).unwrap_or_default()
    }
}
