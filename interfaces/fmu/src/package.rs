//! An FMU put together: description, shared library and resources in a zip archive.

use crate::part::{FILE, Part, token};
use crate::{Fmi, description, model};
use monorig_sim::error::{DataError, Error};
use std::collections::BTreeMap;
use std::env::consts::{ARCH, DLL_PREFIX, DLL_SUFFIX, OS};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Parts that an FMU is put together from.
pub struct Package {
    part: Part,
    about: String,
    step_s: Option<f64>,
    /// Files in `resources/` beside the file of the part.
    files: BTreeMap<String, Vec<u8>>,
}

/// Folder in `binaries/` of this machine.
fn platform(fmi: Fmi) -> String {
    let system = match OS {
        "macos" => "darwin",
        other => other,
    };
    match (fmi, ARCH, OS) {
        (Fmi::Two, "x86_64", "linux") => "linux64".to_owned(),
        (Fmi::Two, "x86_64", "windows") => "win64".to_owned(),
        (Fmi::Two, _, "macos") => "darwin64".to_owned(),
        // FMI 2.0 has no name for others: that of 3.0
        _ => format!("{ARCH}-{system}"),
    }
}

/// A name that a function in C could have.
fn identifier(name: &str) -> String {
    let fits = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(fits).collect();
    match name.starts_with(|c: char| c.is_ascii_digit()) {
        true => format!("_{name}"),
        false => name,
    }
}

/// The shared library that goes into every FMU, which cargo builds beside the program.
pub fn library() -> Result<PathBuf, Error> {
    let name = format!("{DLL_PREFIX}monorig_fmu{DLL_SUFFIX}");
    let program = std::env::current_exe().unwrap_or_default();
    let folder = program.parent().unwrap_or(Path::new(""));
    // with `cargo run`, and of a test, it is in `deps`
    let places = [folder.join(&name), folder.join("deps").join(&name)];
    places.into_iter().find(|p| p.is_file()).ok_or_else(|| {
        let message = format!("{name} is not beside the program in {}", folder.display());
        let help = "the archive of a release has the program and this library side by side, and `cargo build --release` makes both; a wheel of Python has the program alone";
        DataError::new("", message, help).into()
    })
}

impl Package {
    pub(crate) fn new(
        part: Part,
        about: String,
        step_s: Option<f64>,
        files: BTreeMap<String, Vec<u8>>,
    ) -> Self {
        Self {
            part,
            about,
            step_s,
            files,
        }
    }

    /// Name of what it holds.
    pub fn name(&self) -> &str {
        self.part.name()
    }

    /// The FMU, with the shared library at this place.
    pub fn bytes(&self, fmi: Fmi, library: &Path) -> Result<Vec<u8>, Error> {
        self.pack(fmi, library).map_err(Error::at(library))
    }

    fn pack(&self, fmi: Fmi, library: &Path) -> std::io::Result<Vec<u8>> {
        let part = serde_json::to_vec_pretty(&self.part)?;
        // read as an importer does, so that no file is missing
        let folder = tempfile::tempdir()?;
        let resources = self
            .files
            .iter()
            .map(|(name, bytes)| (name.as_str(), bytes));
        let resources: Vec<(&str, &Vec<u8>)> = resources.chain([(FILE, &part)]).collect();
        for (name, bytes) in &resources {
            let place = folder.path().join(name);
            std::fs::create_dir_all(place.parent().unwrap_or(folder.path()))?;
            std::fs::write(place, bytes)?;
        }
        let read = serde_json::from_slice(&part)?;
        let (variables, _) = model::of(read, folder.path()).map_err(std::io::Error::other)?;

        let identifier = identifier(self.name());
        let model = description::ModelDescription {
            name: self.name(),
            about: &self.about,
            token: &token(&part),
            identifier: &identifier,
            keeps_state: self.part.keeps_state(),
            step_s: self.step_s,
        };
        let xml = description::write(&model, &variables, fmi)?;
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let binary = format!("binaries/{}/{identifier}{DLL_SUFFIX}", platform(fmi));
        let library = std::fs::read(library)?;
        let resources = resources.into_iter();
        let resources = resources.map(|(name, bytes)| (format!("resources/{name}"), bytes));
        let all = [
            ("modelDescription.xml".to_owned(), &xml),
            (binary, &library),
        ];
        for (name, bytes) in all.into_iter().chain(resources) {
            // no time of day in it: the same part gives the same bytes
            let options =
                SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
            zip.start_file(name, options)?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_is_one_of_c() {
        assert_eq!(identifier("rail_fusion"), "rail_fusion");
        assert_eq!(identifier("2 cabs, wet"), "_2_cabs__wet");
    }
}
