//! The rail profile file: the lengths of an I-beam.

use crate::config::checked::{Positive, Version1};
use crate::config::file::read_yaml;
use crate::error::Error;
use crate::rail::profile::{Profile, ProfileSpec};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A rail profile file: a symmetric I-beam whose flanges taper from the web to their tips.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// Name, such as `I140E`.
    pub(crate) name: String,
    /// Source of the figures.
    #[serde(default)]
    pub(crate) about: String,
    /// Overall height, m.
    pub(crate) height_m: Positive,
    /// Width of the flanges, m.
    pub(crate) flange_width_m: Positive,
    /// Thickness of the web, m.
    pub(crate) web_m: Positive,
    /// Thickness of a flange at its tips, m.
    pub(crate) flange_tip_m: Positive,
    /// Thickness of a flange at the web, m; not less than at the tips.
    pub(crate) flange_root_m: Positive,
}

impl Profile {
    /// Read a profile file, and check it.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let file: ProfileFile = read_yaml(path)?;
        Self::new(&file.into()).map_err(|e| e.in_file(path))
    }
}

impl From<ProfileFile> for ProfileSpec {
    fn from(p: ProfileFile) -> Self {
        Self {
            name: p.name,
            height_m: p.height_m.get(),
            flange_width_m: p.flange_width_m.get(),
            web_m: p.web_m.get(),
            flange_tip_m: p.flange_tip_m.get(),
            flange_root_m: p.flange_root_m.get(),
        }
    }
}
