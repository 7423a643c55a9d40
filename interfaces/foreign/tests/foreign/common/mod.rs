//! Libraries and FMUs that are compiled here, in scenarios of two seconds.

use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Outcome, Simulation};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::env::consts::DLL_SUFFIX;
use std::io::Write;
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;

pub fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compiles a source of the project to a shared library, with these words defined; its file.
pub fn compile(folder: &Path, source: &str, defined: &str) -> PathBuf {
    let library = folder.join("mine.so");
    let mut cc = monorig_testing::c_compiler().expect("README names a C compiler");
    cc.args(["-shared", "-fPIC", "-O2", "-std=c99", "-Wall", "-Werror"]);
    cc.arg("-I").arg(project().join("interfaces/c/include"));
    cc.args(defined.split_whitespace().map(|word| format!("-D{word}")));
    cc.arg("-o").arg(&library);
    cc.arg(project().join(source)).arg("-lm");
    assert!(cc.status().unwrap().success());
    library
}

/// Folder in an FMU for the binary of this machine.
pub fn platform() -> String {
    let (system, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    format!("{arch}-{}", system.replace("macos", "darwin"))
}

/// Packs an FMU of these files.
pub fn pack(file: &Path, files: &[(&str, &[u8])]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(file).unwrap());
    for (name, bytes) in files {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// Packs an FMU of a description and a library of this name.
pub fn fmu(file: &Path, description: &str, library: &Path, name: &str) {
    let binary = format!("binaries/{}/{name}{DLL_SUFFIX}", platform());
    let library = std::fs::read(library).unwrap();
    let files = [
        ("modelDescription.xml", description.as_bytes()),
        (binary.as_str(), library.as_slice()),
    ];
    pack(file, &files);
}

/// A scenario of two seconds with these estimators, a line each, and this controller.
pub fn scenario(folder: &Path, estimators: &str, controller: &str) -> PathBuf {
    let assets = project().join("assets").canonicalize().unwrap();
    let assets = assets.display();
    let text = format!(
        "version: 1
why: A part of somebody else in a run.
track: {assets}/tracks/liu2023_section1.yaml
train: {assets}/trains/dx80_176y.yaml
sensors: {assets}/sensors/liu2023.yaml
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 1, mps: 0.5}}], controller: {controller}}}
estimators:
{estimators}
stop: {{after_s: 2}}
"
    );
    let file = folder.join("two_seconds.yaml");
    std::fs::write(&file, text).unwrap();
    file
}

pub fn build(file: &Path) -> Result<Simulation, Error> {
    build_with(file, &loads_libraries(Registry::default()))
}

pub fn build_with(file: &Path, registry: &Registry) -> Result<Simulation, Error> {
    Simulation::build(Scenario::load(file, &[])?, registry, 1)
}

pub fn run(simulation: &mut Simulation) -> Result<Outcome, Error> {
    monorig_sim::closed_loop::run(simulation, &mut [], &mut |_| true)
}

/// Message of a run of a scenario: its error, or the refused steps.
pub fn message(file: &Path) -> String {
    match build(file).and_then(|mut simulation| run(&mut simulation)) {
        Ok(outcome) => format!("{:?}", outcome.refusals),
        Err(e) => e.to_string(),
    }
}

#[track_caller]
pub fn has(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}
