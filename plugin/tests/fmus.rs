//! FMUs of strangers in a scenario: one that works, and each mistake with its message.

#![cfg(unix)] // compiles with `cc`
#![allow(clippy::unwrap_used)] // helpers of tests

use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Outcome, Simulation, resolved};
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use zip::write::SimpleFileOptions;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="slope" guid="{1}">
  <CoSimulation modelIdentifier="slope" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="grad"><BaseUnit rad="1" factor="1.0"/></Unit>
    <Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="form"><Enumeration><Item name="round" value="1"/><Item name="square" value="2"/></Enumeration></SimpleType>
    <SimpleType name="gains"><Real min="0" max="1.5"/></SimpleType>
  </TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="ax" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="wheel" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="3" causality="parameter" variability="fixed" description="A &amp; B."><Real declaredType="gains" start="0.5"/></ScalarVariable>
    <ScalarVariable name="theta" valueReference="4" causality="output"><Real unit="grad"/></ScalarVariable>
    <ScalarVariable name="theta_sd" valueReference="5" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="ok" valueReference="6" causality="output"><Boolean/></ScalarVariable>
    <ScalarVariable name="order" valueReference="7" causality="parameter" variability="fixed"><Integer start="2" min="1" max="4"/></ScalarVariable>
    <ScalarVariable name="form" valueReference="8" causality="parameter" variability="fixed"><Enumeration declaredType="form" start="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>
"#;

/// All of its names for ours.
const MAP: &str = "specific_force_x: ax, \"wheel_speed[1]\": wheel, grade: theta, grade_sd: theta_sd, grade_valid: ok";

/// Folder of the binary for this machine.
fn platform() -> &'static str {
    match (std::env::consts::OS, std::env::consts::ARCH) {
        ("macos", _) => "darwin64",
        (_, "x86_64") => "linux64",
        (_, _) => "aarch64-linux",
    }
}

/// Compiles the library with these words defined.
fn compile(folder: &Path, defined: &str) -> Vec<u8> {
    let library = folder.join("slope.so");
    let mut cc = Command::new(std::env::var_os("CC").unwrap_or("cc".into()));
    cc.args(["-shared", "-fPIC", "-O2", "-std=c99", "-o"])
        .arg(&library);
    cc.args(defined.split_whitespace().map(|word| format!("-D{word}")));
    cc.arg(project().join("plugin/tests/slope_fmu.c"))
        .arg("-lm");
    assert!(cc.status().unwrap().success());
    std::fs::read(library).unwrap()
}

/// An FMU of these files in a scenario of two seconds.
fn scenario(folder: &Path, files: &[(&str, &[u8])], estimator: &str) -> PathBuf {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(folder.join("slope.fmu")).unwrap());
    for (name, bytes) in files {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
    let assets = project().join("assets").canonicalize().unwrap();
    let assets = assets.display();
    let text = format!(
        "version: 1
why: An FMU in a run.
track: {assets}/tracks/liu2023_section1.yaml
train: {assets}/trains/dx80_176y.yaml
sensors: {assets}/sensors/liu2023.yaml
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 1, mps: 0.5}}]}}
estimators:
  mine: {estimator}
stop: {{after_s: 2}}
"
    );
    let file = folder.join("two_seconds.yaml");
    std::fs::write(&file, text).unwrap();
    file
}

fn build(file: &Path) -> Result<Simulation, Error> {
    let registry = loads_libraries(Registry::default());
    Simulation::build(Scenario::load(file, &[])?, &registry, 1)
}

fn run(simulation: &mut Simulation) -> Result<Outcome, Error> {
    monorig_sim::closed_loop::run(simulation, &mut [], &mut |_| true)
}

/// The message of an FMU with this library and description, in a scenario with this estimator.
fn message(defined: &str, description: &str, estimator: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let library = compile(folder.path(), defined);
    let binary = format!("binaries/{}/slope.so", platform());
    let files = [
        ("modelDescription.xml", description.as_bytes()),
        (binary.as_str(), library.as_slice()),
    ];
    let file = scenario(folder.path(), &files, estimator);
    match build(&file).and_then(|mut s| run(&mut s)) {
        Ok(outcome) => format!("{:?}", outcome.refusals),
        Err(e) => e.to_string(),
    }
}

#[track_caller]
fn has(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn mine(more: &str) -> String {
    format!("{{fmu: ./slope.fmu, map: {{{MAP}}}{more}}}")
}

const AT: &str = "two_seconds.yaml:8:";

#[test]
fn an_fmu_with_other_names_estimates_and_its_digest_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let library = compile(folder.path(), "");
    let binary = format!("binaries/{}/slope.so", platform());
    let files = [
        ("modelDescription.xml", DESCRIPTION.as_bytes()),
        (binary.as_str(), library.as_slice()),
    ];
    let file = scenario(
        folder.path(),
        &files,
        &mine(", gain: 1, order: 3, form: round"),
    );
    let mut simulation = build(&file).unwrap();
    let outcome = run(&mut simulation).unwrap();
    assert!(
        outcome.finished && outcome.refusals.is_empty(),
        "{:?}",
        outcome.refusals
    );
    let estimate = simulation.estimators[0].estimate;
    let grade = estimate.grade_rad;
    assert!(
        grade.valid && grade.sd == 0.01 && grade.value != 0.0,
        "{grade:?}"
    );
    assert_eq!(estimate.effective_grade_rad, grade);
    assert!(!estimate.total_mass_kg.valid);
    let digests = simulation.scenario.input_digests();
    assert_eq!(
        digests.get("slope.fmu").map(String::len),
        Some(64),
        "{digests:?}"
    );
    let all = resolved(&simulation.scenario, &loads_libraries(Registry::default()));
    assert_eq!(all["parameters"]["estimators"]["mine"]["gain"], 1.0);
    assert_eq!(all["estimators"]["mine"]["fmu"], "./slope.fmu");
    assert_eq!(all["estimators"]["mine"]["map"]["grade"], "theta");
}

/// An estimate whose standard deviation nobody tells is not valid; a number in the map tells it.
#[test]
fn a_standard_deviation_is_of_the_fmu_or_of_the_map() {
    let of = |sd: &str| {
        let folder = tempfile::tempdir().unwrap();
        let library = compile(folder.path(), "");
        let binary = format!("binaries/{}/slope.so", platform());
        let files = [
            ("modelDescription.xml", DESCRIPTION.as_bytes()),
            (binary.as_str(), library.as_slice()),
        ];
        let map = format!("{{specific_force_x: ax, grade: theta{sd}}}");
        let file = scenario(
            folder.path(),
            &files,
            &format!("{{fmu: ./slope.fmu, wheel: 0, map: {map}}}"),
        );
        let mut simulation = build(&file).unwrap();
        run(&mut simulation).unwrap();
        simulation.estimators[0].estimate.grade_rad
    };
    assert!(!of("").valid);
    let told = of(", grade_sd: 0.25");
    assert!(told.valid && told.sd == 0.25, "{told:?}");
}

/// The FMU is called with its own step, as often as that fits; it checks the instants itself, and counts.
#[test]
fn an_fmu_with_a_fixed_step_is_called_with_that_step() {
    let fixed = DESCRIPTION
        .replace("canHandleVariableCommunicationStepSize=\"true\"", "")
        .replace(
            "  <ModelVariables>",
            "  <DefaultExperiment stepSize=\"0.02\"/>\n  <ModelVariables>",
        );
    let folder = tempfile::tempdir().unwrap();
    let library = compile(folder.path(), "FIXED_STEP");
    let binary = format!("binaries/{}/slope.so", platform());
    let files = [
        ("modelDescription.xml", fixed.as_bytes()),
        (binary.as_str(), library.as_slice()),
    ];
    let file = scenario(folder.path(), &files, &mine(""));
    let mut simulation = build(&file).unwrap();
    run(&mut simulation).unwrap();
    let steps = simulation.estimators[0].estimate.grade_rad.value * 1e6;
    assert!(
        (99.0..=100.5).contains(&steps),
        "{steps} steps of 20 ms in 2 s"
    );
    has(
        &message("", &fixed.replace("stepSize=\"0.02\"", ""), &mine("")),
        &[AT, "one step size only", "stepSize in DefaultExperiment"],
    );
}

#[test]
fn every_mistake_of_a_scenario_has_its_message() {
    let of = |estimator: &str| message("", DESCRIPTION, estimator);
    has(
        &of(&mine(", gian: 1")),
        &[AT, "no parameter `gian`", "did you mean `gain`"],
    );
    has(
        &of(&mine(", gain: 2")),
        &[AT, "2 is not a number in 0…1.5", "gain: A & B."],
    );
    has(
        &of(&mine(", order: 1.5")),
        &["`order` cannot be 1.5", "a whole number"],
    );
    has(
        &of(&mine(", form: oval")),
        &[AT, "oval is not one of round, square"],
    );
    has(&of(&mine(", is: slope")), &[AT, "`is` names `slope` in it"]);
    has(&of("{fmu: ./nothing.fmu}"), &[AT, "nothing.fmu"]);
    has(
        &of("{fmu: ./slope.fmu, library: ./slope.so}"),
        &[AT, "not in both"],
    );
    has(
        &of("{library: ./slope.so, map: {grade: theta}}"),
        &[AT, "`fmu` names none"],
    );
    let map = |map: &str| of(&format!("{{fmu: ./slope.fmu, map: {{{map}}}}}"));
    has(
        &map("grade: slope"),
        &[
            AT,
            "`slope` for grade, which the FMU has not",
            "ok, theta, theta_sd",
        ],
    );
    has(
        &map("grad: theta"),
        &[AT, "`grad`, which is no input or output", "effective_grade"],
    );
    has(
        &map("grade: ax"),
        &[AT, "`ax`, for grade, is of causality input"],
    );
    has(&map("grade: ok"), &[AT, "`ok`, for grade, is no number"]);
    has(
        &map("grade: theta, grade_valid: theta"),
        &[AT, "is no Boolean"],
    );
    has(
        &map("total_mass: theta"),
        &[AT, "`theta` is in grad, and total_mass in kg"],
    );
    has(
        &map("grade: 3"),
        &[AT, "no name for grade", "only for a standard deviation"],
    );
    has(
        &map("specific_force_x: ax"),
        &[
            AT,
            "neither `total_mass` nor `grade`",
            "ok, theta, theta_sd",
        ],
    );
    has(
        &map("specific_force_x: ax, grade: theta"),
        &[
            AT,
            "`wheel` is none of ours",
            "map: {wheel_speed[1]: wheel}",
            "`wheel: 0`",
        ],
    );
    assert_eq!(of(&mine("")), "[]");
}

#[test]
fn every_mistake_of_a_description_has_its_message() {
    let of = |from: &str, to: &str| {
        assert!(DESCRIPTION.contains(from));
        message("", &DESCRIPTION.replace(from, to), &mine(""))
    };
    has(
        &of("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\""),
        &[AT, "line 2", "it is of FMI 1.0", "FMI 2.0 or 3.0"],
    );
    has(
        &of("modelIdentifier=\"slope\"", ""),
        &[AT, "line 3", "CoSimulation has no modelIdentifier"],
    );
    has(
        &of("CoSimulation", "ModelExchange"),
        &[AT, "model exchange only", "for co-simulation"],
    );
    has(
        &of(
            "modelIdentifier=\"slope\"",
            "modelIdentifier=\"slope\" needsExecutionTool=\"true\"",
        ),
        &[AT, "needs the tool that made it", "standalone"],
    );
    has(
        &of("  </ModelVariables>", ""),
        &[AT, "modelDescription.xml, line"],
    );
    has(
        &message("", &DESCRIPTION[..600], &mine("")),
        &[AT, "modelDescription.xml, line"],
    );
    has(
        &of("valueReference=\"4\"", "valueReference=\"-\""),
        &[AT, "valueReference=\"-\" is no number"],
    );
    has(
        &of("unit=\"grad\"", "unit=\"deg\""),
        &[
            AT,
            "`theta` is in deg, and grade in rad",
            "a variable in rad",
        ],
    );
    has(
        &of("modelIdentifier=\"slope\"", "modelIdentifier=\"other\""),
        &[AT, "has no binary for this machine", "other.so", platform()],
    );
}

#[test]
fn every_mistake_of_a_library_has_its_message() {
    let of = |defined: &str| message(defined, DESCRIPTION, &mine(""));
    has(&of("NO_RESET"), &[AT, "no function `fmi2Reset`"]);
    has(
        &of("NO_LICENCE"),
        &["cannot be instantiated: no licence for slope, 0 left"],
    );
    has(&of("NAN_OUT"), &["grade_rad is NaN, and is marked valid"]);
    has(&of("DISCARDS"), &["no fix at "]);
    has(&of("BREAKS"), &["mine", "the memory is gone"]);
    let one = DESCRIPTION.replace(
        "modelIdentifier=\"slope\"",
        "modelIdentifier=\"slope\" canBeInstantiatedOnlyOncePerProcess=\"true\"",
    );
    let two = format!("{}\n  other: {}", mine(""), mine(""));
    has(
        &message("", &one, &two),
        &["one instance at a time", "--jobs 1"],
    );
    assert_eq!(message("", &one, &mine("")), "[]");
    assert_eq!(message("", DESCRIPTION, &two), "[]");
}

#[test]
fn every_mistake_of_an_archive_has_its_message() {
    let of = |files: &[(&str, &[u8])]| {
        let folder = tempfile::tempdir().unwrap();
        let file = scenario(folder.path(), files, &mine(""));
        build(&file).err().unwrap().to_string()
    };
    let description = ("modelDescription.xml", DESCRIPTION.as_bytes());
    has(
        &of(&[("readme.txt", b"")]),
        &[AT, "has no modelDescription.xml"],
    );
    has(
        &of(&[description]),
        &[AT, "no binary for this machine", "it has none at all"],
    );
    has(
        &of(&[description, ("binaries/win64/slope.dll", b"MZ")]),
        &[AT, "no binary for this machine", "it has win64"],
    );
    let binary = format!("binaries/{}/slope.so", platform());
    has(
        &of(&[description, (&binary, b"no library")]),
        &[AT, "shared library cannot be loaded"],
    );
    has(
        &of(&[description, ("../../outside", b"")]),
        &[AT, "`../../outside` in it leads out"],
    );
    let folder = tempfile::tempdir().unwrap();
    let file = scenario(folder.path(), &[description], &mine(""));
    std::fs::write(folder.path().join("slope.fmu"), "no archive").unwrap();
    has(
        &build(&file).err().unwrap().to_string(),
        &[AT, "cannot be unpacked"],
    );
}
