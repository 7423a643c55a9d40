//! Libraries of C in a scenario: one that works, and each mistake with its message.

use crate::common;
use crate::common::{build, compile, has};
use monorig_plugin::loads_libraries;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::resolved;
use std::path::{Path, PathBuf};

/// A scenario with these estimators beside the library.
fn scenario(folder: &Path, estimators: &str) -> PathBuf {
    common::scenario(folder, estimators, "{}")
}

/// The message for a library that was compiled with a mistake.
fn message(defined: &str, estimator: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    compile(folder.path(), "interfaces/foreign/tests/bad.c", defined);
    common::message(&scenario(folder.path(), &format!("  mine: {estimator}")))
}

#[track_caller]
fn told(defined: &str, estimator: &str, parts: &[&str]) {
    has(&message(defined, estimator), parts);
}

#[test]
fn every_mistake_of_a_library_has_its_message() {
    let plain = "{library: ./mine.so}";
    let at = "two_seconds.yaml:8:";
    told(
        "OTHER_HEADER",
        plain,
        &[
            at,
            "header number 2; this program has number 1",
            "build the library again",
        ],
    );
    told(
        "NO_RESET",
        plain,
        &[
            at,
            "has no function `monorig_reset`",
            "as monorig_estimator.h declares it",
        ],
    );
    told("NAMELESS", plain, &[at, "has no estimator"]);
    told(
        "SIZELESS",
        plain,
        &[at, "needs 0 bytes", "monorig_size must return"],
    );
    told(
        "WRONG_RANGE",
        plain,
        &[at, "parameter 0 of `bad` is not valid", "least ≤ most"],
    );
    told(
        "WILL_NOT",
        plain,
        &[at, "refuses to build `bad`: no licence"],
    );
    told(
        "NAN_VALID",
        plain,
        &["grade_rad is NaN, and is marked valid"],
    );
    told("NEGATIVE_SD", plain, &["the sd of total_mass_kg is -1"]);
    told("REFUSES", plain, &["no fix"]);
    told("BREAKS", plain, &["mine", "memory is gone"]);
    let two = "{library: ./mine.so}\n  other: {library: ./mine.so}";
    told("ONE", two, &["one instance at a time", "--jobs 1"]);
    assert_eq!(message("", two), "[]");
    assert_eq!(message("ONE", plain), "[]");
    assert_eq!(message("", plain), "[]");
}

#[test]
fn every_mistake_of_a_scenario_has_its_message() {
    let at = "two_seconds.yaml:8:";
    told("", "{library: ./nothing.so}", &[at, "nothing.so"]);
    told(
        "",
        "{library: ./two_seconds.yaml}",
        &[at, "cannot be loaded", "a shared library for this machine"],
    );
    told(
        "",
        "{library: ./mine.so, is: god}",
        &[at, "has no estimator `god`", "one of them: bad"],
    );
    told(
        "",
        "{library: ./mine.so, gian: 1}",
        &[at, "no parameter `gian`", "did you mean `gain`"],
    );
    told(
        "",
        "{library: ./mine.so, gain: 2}",
        &[at, "2 is not a number in 0…1.5", "gain: A parameter."],
    );
    told(
        "",
        "{library: ./mine.so, form: oval}",
        &[at, "oval is not one of round, square"],
    );
    assert_eq!(
        message("", "{library: ./mine.so, is: bad, gain: 0.5, form: square}"),
        "[]"
    );
}

#[test]
fn a_program_that_loads_no_libraries_says_so() {
    let folder = tempfile::tempdir().unwrap();
    compile(folder.path(), "interfaces/foreign/tests/bad.c", "");
    let file = scenario(folder.path(), "  mine: {library: ./mine.so}");
    let refused = common::build_with(&file, &Registry::default());
    let refused = refused.err().unwrap().to_string();
    has(
        &refused,
        &["this program does not run foreign estimators or controllers"],
    );
}

/// The example in C estimates, its parameter has an effect, and the inputs of the run have its digest.
#[test]
fn the_example_in_c_runs() {
    let folder = tempfile::tempdir().unwrap();
    compile(folder.path(), "examples/own_estimator_c/two_state.c", "");
    let estimators =
        "  mine: {library: ./mine.so}\n  other: {library: ./mine.so, grade_noise: 0.5}";
    let file = scenario(folder.path(), estimators);
    let mut simulation = build(&file).unwrap();
    let outcome = common::run(&mut simulation).unwrap();
    assert!(
        outcome.finished && outcome.refusals.is_empty(),
        "{:?}",
        outcome.refusals
    );
    let [mine, other] = &simulation.estimators[..] else {
        panic!("two estimators")
    };
    assert!(mine.estimate.grade_rad.valid && mine.estimate.grade_rad.value.abs() < 0.05);
    assert!(mine.estimate.grade_rad.sd < other.estimate.grade_rad.sd);
    assert_eq!(
        mine.internals_named(["mass_variance"]).map(|v| v.is_some()),
        [true]
    );

    let digests = simulation.scenario.input_digests();
    assert_eq!(
        digests.get("mine.so").map(String::len),
        Some(64),
        "{digests:?}"
    );
    let registry = loads_libraries(Registry::default());
    let all = resolved(&simulation.scenario, &registry);
    assert_eq!(all["parameters"]["estimators"]["mine"]["grade_noise"], 0.02);
    assert_eq!(all["estimators"]["mine"]["library"], "./mine.so");
}

/// Built ten thousand times, an instance takes no more memory than once.
#[test]
#[cfg(target_os = "linux")]
fn ten_thousand_instances_take_the_memory_of_one() {
    let resident = || {
        let status = std::fs::read_to_string("/proc/self/statm").unwrap();
        let pages = status.split(' ').nth(1).unwrap();
        pages.parse::<u64>().unwrap() * 4096
    };
    let folder = tempfile::tempdir().unwrap();
    compile(folder.path(), "examples/own_estimator_c/two_state.c", "");
    let file = scenario(folder.path(), "  mine: {library: ./mine.so}");
    let simulation = build(&file).unwrap();
    let registry = loads_libraries(Registry::default());
    let settings = &simulation.scenario.file.estimators["mine"];
    let build = || {
        registry
            .estimator_of("mine", settings)
            .unwrap()
            .build(&simulation.vehicle, &[])
    };
    for _ in 0..100 {
        drop(build().unwrap());
    }
    let before = resident();
    for _ in 0..10_000 {
        drop(build().unwrap());
    }
    let more = resident().saturating_sub(before);
    assert!(more < 4 << 20, "{more} bytes more");
}
