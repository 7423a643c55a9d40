//! The controller of a scenario: which one, where its feed-forward comes from, and its parameters.

use super::estimator::MAP_WITHOUT_FMU;
use super::named_part::{NamedPart, PartKeys, given};
use super::{FeedForward, ParameterValue};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Default controller of a scenario.
pub const DEFAULT_CONTROLLER: &str = "pi";

/// The controller of a scenario and its parameters.
pub type ControllerSettings = NamedPart<ControllerKeys>;

/// The controller: which one it is, where its feed-forward comes from, and its parameters by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Controller")]
pub struct ControllerKeys {
    /// Name of the controller in the registry; `pi` if neither `kind` nor `fmu` is given.
    #[serde(
        default,
        deserialize_with = "given",
        skip_serializing_if = "Option::is_none"
    )]
    #[schemars(with = "String")]
    pub(crate) kind: Option<String>,
    /// FMU with the part, relative to the scenario.
    #[serde(
        default,
        deserialize_with = "given",
        skip_serializing_if = "Option::is_none"
    )]
    #[schemars(with = "String")]
    pub fmu: Option<String>,
    /// Names in the FMU that replace monorig's names.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub map: BTreeMap<String, ParameterValue>,
    /// The file of the FMU, once the scenario is loaded.
    #[serde(skip)]
    pub(crate) fmu_file: Option<PathBuf>,
    /// Source of slope and mass for the feed-forward.
    #[serde(default)]
    pub feedforward: FeedForward,
}

impl Default for ControllerKeys {
    fn default() -> Self {
        Self {
            kind: Some(DEFAULT_CONTROLLER.into()),
            fmu: None,
            map: BTreeMap::new(),
            fmu_file: None,
            feedforward: FeedForward::None,
        }
    }
}

impl PartKeys for ControllerKeys {
    const FORM: &'static str = "a mapping of parameters, such as {feedforward: estimate, kp: 2.0}";

    fn checked(mut self) -> Result<Self, &'static str> {
        if self.kind.is_some() && self.fmu.is_some() {
            return Err("give either `kind` or `fmu`, not both");
        }
        if self.fmu.is_none() {
            if !self.map.is_empty() {
                return Err(MAP_WITHOUT_FMU);
            }
            self.kind.get_or_insert_with(|| DEFAULT_CONTROLLER.into());
        }
        Ok(self)
    }
}

impl ControllerSettings {
    /// A controller of this kind, with its defaults.
    pub fn of_kind(name: &str) -> Self {
        Self::from(ControllerKeys {
            kind: Some(name.into()),
            ..ControllerKeys::default()
        })
    }
}
