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
    let system = OS.replace("macos", "darwin");
    match (fmi, ARCH, OS) {
        (Fmi::Two, "x86_64", "linux") => "linux64".to_owned(),
        (Fmi::Two, "x86_64", "windows") => "win64".to_owned(),
        (Fmi::Two, _, "macos") => "darwin64".to_owned(),
        // FMI 2.0 has no name for others: that of 3.0
        _ => format!("{ARCH}-{system}"),
    }
}

/// Reads a library for another machine, as FOLDER=FILE with its folder in `binaries/`.
pub fn binary(text: &str) -> Result<(String, PathBuf), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let named = text
        .split_once('=')
        .filter(|(folder, _)| folder.chars().all(plain));
    let (folder, file) = named.ok_or("write FOLDER=FILE, such as win64=monorig_fmu.dll")?;
    Ok((folder.to_owned(), file.into()))
}

/// Licence of monorig, which is in every FMU.
const LICENCE: &[u8] = include_bytes!("../LICENSE-MIT");
/// Texts of the licences of the packages that are linked, beside the library of a release.
const NOTICES: &str = "licenses/THIRD-PARTY.txt";

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
    let share = folder.join("../share/monorig/lib");
    let places = [folder, Path::new("lib"), Path::new("deps")].map(|f| folder.join(f).join(&name));
    let mut places = places.into_iter().chain([share.join(&name)]);
    places.find(|p| p.is_file()).ok_or_else(|| {
        let message = format!("{name} is not in the folder of the program, {}", folder.display());
        let help = "archive and wheel of a release have this library, and `cargo build --release` makes it";
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

    /// The FMU, with the shared library at this place, and with those of other machines.
    pub fn bytes(
        &self,
        fmi: Fmi,
        library: &Path,
        others: &[(String, PathBuf)],
    ) -> Result<Vec<u8>, Error> {
        let this = (platform(fmi), library.to_owned());
        let read = |file: &Path| std::fs::read(file).map_err(Error::at(file));
        let licence = "documentation/licenses/license.txt".to_owned();
        let mut files = vec![(licence, LICENCE.to_vec())];
        let beside = library.parent().unwrap_or(Path::new("")).join("..");
        if let Ok(notices) = read(&beside.join(NOTICES)) {
            files.push((format!("documentation/{NOTICES}"), notices));
        }
        let identifier = identifier(self.name());
        for (folder, file) in std::iter::once(&this).chain(others) {
            let ending = file.extension().unwrap_or_default().to_string_lossy();
            let name = format!("binaries/{folder}/{identifier}.{ending}");
            files.push((name, read(file)?));
        }
        self.pack(fmi, files).map_err(Error::at(library))
    }

    fn pack(&self, fmi: Fmi, files: Vec<(String, Vec<u8>)>) -> std::io::Result<Vec<u8>> {
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
        let resources = resources.into_iter();
        let resources = resources.map(|(name, bytes)| (format!("resources/{name}"), bytes));
        let all = [("modelDescription.xml".to_owned(), &xml)].into_iter();
        let files = files.iter().map(|(name, bytes)| (name.clone(), bytes));
        for (name, bytes) in all.chain(files).chain(resources) {
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
