//! One estimator of a scenario: its type, where it comes from, and its parameters.

use super::external::External;
use super::named_part::{NamedPart, PartKeys, given};
use super::{ParameterFile, ParameterValue};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Message for a `map` without an FMU.
pub(super) const MAP_WITHOUT_FMU: &str = "`map` needs `fmu`: it gives the names in an FMU";

/// One estimator of a scenario: its type, the library or FMU it is in if it is foreign, and its parameters. Once the
/// scenario is loaded, these are those of the file named `from` too.
pub type Settings = NamedPart<EstimatorKeys>;

/// An estimator: where it comes from, and its parameters by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Settings")]
pub struct EstimatorKeys {
    /// Shared library with the estimator, relative to the scenario.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub library: Option<String>,
    /// FMU with the part, relative to the scenario.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub fmu: Option<String>,
    /// Connection to an estimator that runs outside the program.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "External")]
    pub external: Option<External>,
    /// Names in the FMU that replace monorig's names, and numbers that replace missing outputs.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub map: BTreeMap<String, ParameterValue>,
    /// Type of the estimator, if the name of this entry is not a type.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub is: Option<String>,
    /// Parameter file, relative to the scenario, for the parameters that are not given here.
    #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub from: Option<String>,
    /// The file of the library or FMU, once the scenario is loaded.
    #[serde(skip)]
    pub(crate) library_file: Option<PathBuf>,
    /// Names of the values from the parameter file.
    #[serde(skip)]
    inherited: BTreeSet<String>,
}

impl PartKeys for EstimatorKeys {
    const FORM: &'static str = "a mapping of parameters, such as {} or {lambda0: 0.98}";

    fn checked(self) -> Result<Self, &'static str> {
        if self.library.is_some() && self.fmu.is_some() {
            return Err("an estimator is in a library or in an FMU, not in both");
        }
        if !self.map.is_empty() && self.fmu.is_none() {
            return Err(MAP_WITHOUT_FMU);
        }
        let of_ours = self.is.is_some() || self.from.is_some();
        if self.external.is_some() && (self.file().is_some() || of_ours) {
            return Err("`external` cannot be combined with `library`, `fmu` or `is`");
        }
        Ok(self)
    }
}

impl EstimatorKeys {
    /// Library or FMU with the estimator, as the scenario names it.
    pub fn file(&self) -> Option<&str> {
        self.library.as_deref().or(self.fmu.as_deref())
    }

    /// True if the estimator is not one of the registry.
    pub fn is_foreign(&self) -> bool {
        self.file().is_some() || self.external.is_some()
    }

    /// Key that names the estimator's library, FMU or connection.
    pub fn foreign_key(&self) -> &'static str {
        match (&self.external, &self.fmu) {
            (Some(_), _) => "external",
            (None, Some(_)) => "fmu",
            (None, None) => "library",
        }
    }

    /// Name of its type, given its name in the scenario.
    pub fn type_name<'a>(&'a self, name: &'a str) -> &'a str {
        self.is.as_deref().unwrap_or(name)
    }

    /// Returns the type in words for this name in the scenario: a foreign estimator with its library, an external one
    /// with its address.
    pub fn origin(&self, name: &str) -> String {
        if let Some(external) = &self.external {
            return format!("external, {external}");
        }
        match (self.file(), &self.is) {
            (None, _) => self.type_name(name).to_owned(),
            (Some(library), None) => format!("foreign, from {library}"),
            (Some(library), Some(is)) => format!("foreign, {is} from {library}"),
        }
    }

    /// True if the parameter comes from the file.
    pub(super) fn inherits(&self, key: &str) -> bool {
        self.inherited.contains(key)
    }
}

impl Settings {
    /// Makes settings of these values, without a file.
    pub fn new(values: BTreeMap<String, ParameterValue>) -> Self {
        Self {
            values,
            ..Self::default()
        }
    }

    /// An estimator of this type, with its defaults.
    pub fn of_type(name: &str) -> Self {
        Self::from(EstimatorKeys {
            is: Some(name.into()),
            ..EstimatorKeys::default()
        })
    }

    /// Takes the estimator from a shared library, with its name in the scenario and the file that was found.
    pub fn in_library(mut self, library: &str, file: PathBuf) -> Self {
        self.library = Some(library.into());
        self.library_file = Some(file);
        self
    }

    /// Takes the estimator from an FMU, with its name in the scenario and the file that was found.
    pub fn in_fmu(mut self, fmu: &str, file: PathBuf) -> Self {
        self.fmu = Some(fmu.into());
        self.library_file = Some(file);
        self
    }

    /// Takes from a parameter file the values that the scenario itself does not have.
    pub(super) fn include(&mut self, file: &ParameterFile) {
        for (key, value) in &file.parameters {
            if !self.values.contains_key(key) {
                self.values.insert(key.clone(), value.clone());
                self.keys.inherited.insert(key.clone());
            }
        }
    }
}
