//! Controllers that are FMUs: one that is ours to the last bit, and each mistake with its message.

use crate::common;
use crate::common::{compile, fmu, has, run};
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::{Simulation, StepFrame, resolved};
use monorig_sim::config::scenario::Scenario;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Inputs, parameters and outputs of the FMU, in the order of their references; 16 of those with `[]`.
const NUMBERS: [(&str, &str); 22] = [
    ("reference_speed", "input"),
    ("reference_acceleration", "input"),
    ("emergency_brake", "input"),
    ("measured_speed", "input"),
    ("feedforward_grade", "input"),
    ("feedforward_mass", "input"),
    ("effective_grade", "input"),
    ("slip[]", "input"),
    ("kp", "parameter"),
    ("ki", "parameter"),
    ("grade_gain", "parameter"),
    ("torque_max", "parameter"),
    ("gravity", "parameter"),
    ("start_speed", "parameter"),
    ("drives", "parameter"),
    ("radius", "parameter"),
    ("gear", "parameter"),
    ("efficiency", "parameter"),
    ("resistance", "parameter"),
    ("rotating_mass", "parameter"),
    ("command_motor_torque[]", "output"),
    ("command_brake", "output"),
];
const FLAGS: [(&str, &str); 3] = [
    ("feedforward_valid", "input"),
    ("hold", "parameter"),
    ("effective_grade_valid", "input"),
];

/// The description of the FMU.
fn description(three: bool) -> String {
    let mut variables = String::new();
    let mut reference = 0;
    let mut variable = |name: &str, causality: &str, kind: [&str; 2], start: &str| {
        let start = match causality {
            "output" => String::new(),
            _ => format!("start=\"{start}\""),
        };
        let (max, fixed) = match (name, causality) {
            ("kp", _) => ("max=\"1000\"", "variability=\"fixed\""),
            (_, "parameter") => ("", "variability=\"fixed\""),
            _ => ("", ""),
        };
        let head = format!(
            "name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" {fixed}"
        );
        let [two_kind, three_kind] = kind;
        match three {
            true => writeln!(variables, "<{three_kind} {head} {max} {start}/>"),
            false => writeln!(
                variables,
                "<ScalarVariable {head}><{two_kind} {max} {start}/></ScalarVariable>"
            ),
        }
        .unwrap();
        reference += 1;
    };
    for (name, causality) in NUMBERS {
        match name.split_once("[]") {
            Some((name, _)) => (1..=16).for_each(|i| {
                variable(&format!("{name}[{i}]"), causality, ["Real", "Float64"], "0");
            }),
            None => variable(name, causality, ["Real", "Float64"], "0"),
        }
    }
    for (name, causality) in FLAGS {
        variable(name, causality, ["Boolean"; 2], "true");
    }
    let (version, token) = match three {
        true => ("3.0", "instantiationToken"),
        false => ("2.0", "guid"),
    };
    format!(
        "<fmiModelDescription fmiVersion=\"{version}\" modelName=\"pi\" {token}=\"{{1}}\">
<CoSimulation modelIdentifier=\"pi\" canHandleVariableCommunicationStepSize=\"true\"/>
<ModelVariables>\n{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"
    )
}

const ESTIMATOR: &str = "  dffrls_aekf_robust: {}";

/// The FMU, compiled with these words; its file.
fn made(folder: &Path, defined: &str, description: &str) -> PathBuf {
    let library = compile(folder, "interfaces/foreign/tests/pi_fmu.c", defined);
    let file = folder.join("pi.fmu");
    fmu(&file, description, &library, "pi");
    file
}

/// A climb of this many seconds under a controller that gets the estimates.
fn climb(controller: &str, seconds: &str, registry: &Registry) -> Simulation {
    let changes = [
        ("drive.controller", controller),
        ("in_loop", "dffrls_aekf_robust"),
        ("stop.after_s", seconds),
    ];
    let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let file = common::project().join("scenarios/minimal.yaml");
    Simulation::build(Scenario::load(&file, &changes).unwrap(), registry, 1).unwrap()
}

/// Bits of all commands of a run, and of the truth. An FMU shows the estimate that it gets.
fn commands(simulation: &mut Simulation, shows: bool) -> Vec<u64> {
    let (mut all, mut valid) = (Vec::new(), 0);
    let mut keep = |f: &StepFrame<'_>| {
        let c = f.command;
        let (torques, others) = c.motor_torque_nm.split_at(8);
        let numbers = torques.iter().chain([&c.brake, &c.clamp_pressure_mpa]);
        let truth = [
            f.truth.speed_mps,
            f.perception.grade_rad,
            f.perception.total_mass_kg,
        ];
        all.extend(numbers.chain(&truth).map(|x| x.to_bits()));
        let grade = f.perception.estimate.unwrap().effective_grade_rad;
        valid += u32::from(grade.valid);
        assert!(!shows || others[6..] == [grade.value, f64::from(u8::from(grade.valid))]);
    };
    let outcome = monorig_sim::closed_loop::run(simulation, &mut [&mut keep], &mut |_| true);
    assert!(outcome.unwrap().finished);
    assert!(
        (1000..30_000).contains(&valid),
        "{valid} of 30000 are valid"
    );
    all
}

/// Parameters of the FMU for the vehicle of a simulation.
fn parameters(simulation: &Simulation) -> String {
    let v = &simulation.vehicle;
    format!(
        ", kp: 2, ki: 0.6, grade_gain: 1, torque_max: {}, gravity: 9.81, drives: {}, radius: {}, gear: {}, efficiency: {}, resistance: {}, rotating_mass: {}",
        simulation.train.drives[0].torque_max_nm,
        v.drives,
        v.wheel_radius_m,
        v.gear_ratio,
        v.efficiency,
        v.running_resistance,
        v.rotating_mass_kg
    )
}

#[test]
#[ignore = "no test: the process that others start"]
fn serves() {
    monorig_plugin::serve();
}

/// FMUs in processes of their own.
fn guarded() -> Registry {
    let program = std::env::current_exe().unwrap().into_os_string();
    let words = ["controllers::serves", "--exact", "--ignored", "--nocapture"].map(Into::into);
    let program = std::iter::once(program).chain(words).collect();
    monorig_plugin::guards_libraries(Registry::default(), program)
}

/// With an estimate that becomes valid, slip, feed-forward and brake: the commands of ours.
#[test]
fn ours_as_an_fmu_commands_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let ours = "{kp: 2, ki: 0.6, feedforward: estimate}";
    let mut simulation = climb(ours, "60", &Registry::default());
    let parameters = parameters(&simulation);
    let ours = commands(&mut simulation, false);
    let grade = simulation.estimators[0].estimate.effective_grade_rad;
    assert!(grade.valid && grade.value > 0.1, "{grade:?}");
    let numbers = description(true)
        .replace("<Float64 name=\"drives\"", "<UInt8 name=\"drives\"")
        .replace(
            "<Float64 name=\"command_brake\"",
            "<Float32 name=\"command_brake\"",
        );
    // the last has numbers of other types, which hold the same values
    for (three, text) in [
        (false, description(false)),
        (true, description(true)),
        (true, numbers),
    ] {
        let file = made(folder.path(), "", &text);
        let of = format!(
            "{{fmu: {}, feedforward: estimate{parameters}}}",
            file.display()
        );
        let here = loads_libraries(Registry::default());
        for (registry, host) in [(here, "in this process"), (guarded(), "in its own")] {
            let mut simulation = climb(&of, "60", &registry);
            assert!(
                commands(&mut simulation, true) == ours,
                "FMI 3: {three}, {host}"
            );
            let digests = simulation.scenario.input_digests();
            assert!(digests.keys().any(|name| name.ends_with("pi.fmu")));
            let all = resolved(&simulation.scenario, &registry);
            assert_eq!(all["parameters"]["controller"]["ki"], 0.6);
            assert!(all["drive"]["controller"]["fmu"].is_string());
        }
    }
}

/// One with a fixed step is called with that step, and its command is held in between.
#[test]
fn a_controller_with_a_fixed_step_is_called_with_that_step() {
    let fixed = description(false)
        .replace("canHandleVariableCommunicationStepSize=\"true\"", "")
        .replace(
            "<ModelVariables>",
            "<DefaultExperiment stepSize=\"0.01\"/><ModelVariables>",
        );
    let folder = tempfile::tempdir().unwrap();
    let file = made(folder.path(), "COUNTS", &fixed);
    let of = format!("{{fmu: {}}}", file.display());
    let mut simulation = climb(&of, "0.5", &loads_libraries(Registry::default()));
    let mut torques = Vec::new();
    let mut keep = |f: &StepFrame<'_>| torques.push(f.command.motor_torque_nm[0]);
    monorig_sim::closed_loop::run(&mut simulation, &mut [&mut keep], &mut |_| true).unwrap();
    // steps of 4 ms: the FMU, whose steps are of 10 ms, has ended so many of them at the end of each
    let expected = (1..=125).map(|step| f64::from(4 * step / 10));
    assert_eq!(torques, expected.collect::<Vec<_>>());
}

#[test]
fn a_controller_that_breaks_down_ends_its_run() {
    const AT: &str = "the controller broke down at t = 1.000 s, seed 1: ";
    let broken = |defined: &str| {
        let folder = tempfile::tempdir().unwrap();
        let file = made(folder.path(), defined, &description(false));
        let of = format!(
            "{{fmu: {}, radius: 0.2, gear: 20, efficiency: 1, drives: 8}}",
            file.display()
        );
        let mut simulation = climb(&of, "2", &guarded());
        run(&mut simulation).unwrap_err().to_string()
    };
    has(&broken("CRASHES"), &[AT, "pi.fmu crashed: signal 11"]);
    has(
        &broken("LOOPS"),
        &[AT, "pi.fmu gives no answer within 10 s"],
    );
    has(&broken("NAN_OUT"), &[AT, "command_motor_torque[1] is NaN"]);
    has(&broken("DISCARDS"), &[AT, "the FMU gives no reason"]);
    has(&broken("BREAKS"), &[AT, "the FMU gives no reason"]);
}

#[test]
fn every_mistake_of_a_scenario_has_its_message() {
    const AT: &str = "two_seconds.yaml:6:";
    let of = |description: &str, controller: &str| {
        let folder = tempfile::tempdir().unwrap();
        made(folder.path(), "", description);
        common::message(&common::scenario(folder.path(), ESTIMATOR, controller))
    };
    let good = description(false);
    let told = |controller: &str, parts: &[&str]| has(&of(&good, controller), parts);
    told("{fmu: ./no.fmu}", &[AT, "drive.controller.fmu", "no.fmu"]);
    told("{fmu: ./pi.fmu, kind: pi}", &[AT, "not both"]);
    told("{map: {command_brake: x}}", &[AT, "`map` needs `fmu`"]);
    told(
        "{fmu: ./pi.fmu, kpp: 1}",
        &[AT, "no parameter `kpp`", "did you mean `kp`"],
    );
    told(
        "{fmu: ./pi.fmu, kp: 1001}",
        &[AT, "1001 is not a number", "1000"],
    );
    told(
        "{fmu: ./pi.fmu, map: {reference_sped: kp}}",
        &[
            AT,
            "neither an input nor an output of a controller",
            "reference_speed",
        ],
    );
    told(
        "{fmu: ./pi.fmu, map: {measured_speed: kp}}",
        &[AT, "`kp`, for measured_speed, is of causality parameter"],
    );
    told(
        "{fmu: ./pi.fmu, map: {measured_speed: 1}}",
        &[AT, "no name for measured_speed"],
    );
    // an input that nothing feeds any more stays at its start
    let held = "{fmu: ./pi.fmu, map: {measured_speed: reference_speed}}";
    assert_eq!(of(&good, held), "[]");
    let without =
        |name: &str, instead: &str| good.replace(&format!("\"{name}\""), &format!("\"{instead}\""));
    has(
        &of(&without("command_motor_torque[1]", "T"), "{fmu: ./pi.fmu}"),
        &[
            AT,
            "has no output `command_motor_torque[1]`",
            "outputs: T, command_brake",
        ],
    );
    has(
        &of(&without("command_motor_torque[3]", "T"), "{fmu: ./pi.fmu}"),
        &[
            AT,
            "has no output `command_motor_torque[3]`, but the train has 8 drive units",
        ],
    );
    let map = "{fmu: ./pi.fmu, efficiency: 1, gear: 1, drives: 8, map: {\"command_motor_torque[3]\": \"command_motor_torque[1]\"}}";
    assert_eq!(of(&without("command_motor_torque[3]", "T"), map), "[]");
}
