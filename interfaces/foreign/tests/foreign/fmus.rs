//! FMUs of strangers in a scenario: one that works, and each mistake with its message.

use crate::common;
use crate::common::{build, compile, fmu, has, pack, platform, run};
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::resolved;
use std::env::consts::DLL_SUFFIX;
use std::path::{Path, PathBuf};

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

/// The FMU with a library that is compiled with these words, and this description, in a scenario.
fn scenario(folder: &Path, defined: &str, description: &str, estimator: &str) -> PathBuf {
    let library = compile(folder, "interfaces/foreign/tests/slope_fmu.c", defined);
    fmu(&folder.join("slope.fmu"), description, &library, "slope");
    common::scenario(folder, &format!("  mine: {estimator}"), "{}")
}

/// Message of a run with it.
fn message(defined: &str, description: &str, estimator: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    common::message(&scenario(folder.path(), defined, description, estimator))
}

fn mine(more: &str) -> String {
    format!("{{fmu: ./slope.fmu, map: {{{MAP}}}{more}}}")
}

const AT: &str = "two_seconds.yaml:8:";

#[test]
fn an_fmu_with_other_names_estimates_and_its_digest_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let estimator = mine(", gain: 1, order: 3, form: round");
    let file = scenario(folder.path(), "", DESCRIPTION, &estimator);
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
        let map = format!("{{specific_force_x: ax, grade: theta{sd}}}");
        let estimator = format!("{{fmu: ./slope.fmu, wheel: 0, map: {map}}}");
        let file = scenario(folder.path(), "", DESCRIPTION, &estimator);
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
    let file = scenario(folder.path(), "FIXED_STEP", &fixed, &mine(""));
    let mut simulation = build(&file).unwrap();
    run(&mut simulation).unwrap();
    let steps = simulation.estimators[0].estimate.grade_rad.value * 1e6;
    assert!(
        (99.0..=100.5).contains(&steps),
        "{steps} steps of 20 ms in 2 s"
    );
    has(
        &message("", &fixed.replace("stepSize=\"0.02\"", ""), &mine("")),
        &[AT, "a fixed step size", "stepSize in DefaultExperiment"],
    );
}

/// A whole number is a number; what nothing feeds stays at its start, of whatever type it is.
#[test]
fn whole_numbers_are_numbers_and_open_inputs_stay_at_their_start() {
    let sd = "<Real/></ScalarVariable>\n    <ScalarVariable name=\"ok\"";
    let text = DESCRIPTION.replace(sd, &sd.replace("Real", "Integer")).replace(
        "  </ModelVariables>",
        "<ScalarVariable name=\"note\" valueReference=\"9\" causality=\"input\"><String start=\"\"/></ScalarVariable>
    <ScalarVariable name=\"mode\" valueReference=\"10\" causality=\"input\"><Integer start=\"1\"/></ScalarVariable>
  </ModelVariables>",
    );
    assert!(text.contains("<Integer/>"));
    let folder = tempfile::tempdir().unwrap();
    let map = "specific_force_x: ax, grade: theta, grade_sd: theta_sd, grade_valid: ok";
    let estimator = format!("{{fmu: ./slope.fmu, map: {{{map}}}, order: 3}}");
    let mut simulation = build(&scenario(folder.path(), "", &text, &estimator)).unwrap();
    run(&mut simulation).unwrap();
    let grade = simulation.estimators[0].estimate.grade_rad;
    assert!(grade.value != 0.0 && grade.sd == 3.0, "{grade:?}");
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
        &[AT, "`map` needs `fmu`"],
    );
    let map = |map: &str| of(&format!("{{fmu: ./slope.fmu, map: {{{map}}}}}"));
    has(
        &map("grade: slope"),
        &[
            AT,
            "`slope` for grade, but the FMU has no such variable",
            "ok, theta, theta_sd",
        ],
    );
    has(
        &map("grad: theta"),
        &[
            AT,
            "`grad`, which is neither an input nor an output",
            "effective_grade",
        ],
    );
    has(
        &map("grade: ax"),
        &[AT, "`ax`, for grade, is of causality input"],
    );
    has(&map("grade: ok"), &[AT, "`ok`, for grade, is not a number"]);
    has(
        &map("grade: theta, grade_valid: theta"),
        &[AT, "is not a Boolean"],
    );
    has(
        &map("total_mass: theta"),
        &[AT, "`theta` is in grad, but total_mass is in kg"],
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
        &map("grade: theta"),
        &[
            AT,
            "`ax` is unknown",
            "map: {wheel_speed[1]: ax}",
            "`ax: 0`",
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
    // a name is no way out of the archive
    for name in [
        "../../../x/m",
        "/tmp/m",
        "a/b",
        "..",
        "a\\\\b",
        "m.so",
        "m n",
    ] {
        has(
            &of(
                "modelIdentifier=\"slope\"",
                &format!("modelIdentifier=\"{name}\""),
            ),
            &[AT, "line 3", "is not a name in C"],
        );
    }
    has(
        &of("name=\"theta\"", "name=\"wheel\""),
        &[AT, "two of its variables are called `wheel`"],
    );
    // a unit that it does not define is what its name says
    let definitions = DESCRIPTION.find("  <UnitDefinitions>").unwrap();
    let behind = DESCRIPTION.find("  <TypeDefinitions>").unwrap();
    let undefined = DESCRIPTION[..definitions].to_owned() + &DESCRIPTION[behind..];
    has(
        &message(
            "",
            &undefined.replace("unit=\"grad\"", "unit=\"deg\""),
            &mine(""),
        ),
        &[AT, "`theta` is in deg, but grade is in rad"],
    );
    has(
        &of("CoSimulation", "ModelExchange"),
        &[AT, "model exchange only", "for co-simulation"],
    );
    has(
        &of("CoSimulation", "ScheduledExecution"),
        &[AT, "scheduled execution only", "for co-simulation"],
    );
    let array = "name=\"theta\" valueReference=\"4\" causality=\"output\"><Real unit=\"grad\"/>";
    let dimension = array.replace("/>", "><Dimension start=\"3\"/></Real>");
    has(
        &of(array, &dimension),
        &[AT, "`theta`, for grade, is an array", "for each value"],
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
        &[AT, "valueReference=\"-\" is not a number"],
    );
    has(
        &of("unit=\"grad\"", "unit=\"deg\""),
        &[
            AT,
            "`theta` is in deg, but grade is in rad",
            "a variable in rad",
        ],
    );
    has(
        &of("modelIdentifier=\"slope\"", "modelIdentifier=\"other\""),
        &[AT, "has no binary for this machine", "other.", &platform()],
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
        pack(&folder.path().join("slope.fmu"), files);
        let file = common::scenario(folder.path(), &format!("  mine: {}", mine("")), "{}");
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
    let binary = format!("binaries/{}/slope{DLL_SUFFIX}", platform());
    has(
        &of(&[description, (&binary, b"no library")]),
        &[AT, "shared library cannot be loaded"],
    );
    has(
        &of(&[description, ("../../outside", b"")]),
        &[AT, "`../../outside` in it leads out"],
    );
    let folder = tempfile::tempdir().unwrap();
    let file = common::scenario(folder.path(), &format!("  mine: {}", mine("")), "{}");
    std::fs::write(folder.path().join("slope.fmu"), "no archive").unwrap();
    has(
        &build(&file).err().unwrap().to_string(),
        &[AT, "cannot be unpacked"],
    );
}

/// An FMU may be larger than other input files, up to a limit of its own. The files are sparse: they take no room.
#[test]
fn an_fmu_may_be_large() {
    let of = |bytes: u64| {
        let folder = tempfile::tempdir().unwrap();
        let file = common::scenario(folder.path(), &format!("  mine: {}", mine("")), "{}");
        let large = std::fs::File::create(folder.path().join("slope.fmu")).unwrap();
        large.set_len(bytes).unwrap();
        build(&file).err().unwrap().to_string()
    };
    has(&of(17 << 20), &[AT, "cannot be unpacked"]);
    has(&of((256 << 20) + 1), &["slope.fmu", "at most 256 MB"]);
}
