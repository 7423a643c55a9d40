//! Estimators outside of the program, as scenarios name them.

use super::OURS;
use crate::common::{self, TestFolder, words};

/// Mistakes in a scenario have its line; a run says that its estimator is an external one.
#[test]
fn an_external_estimator_in_a_scenario() {
    let dir = TestFolder::new();
    let written = |external: &str| {
        let project = common::project().canonicalize().unwrap();
        let assets = project.join("assets");
        let assets = assets.display();
        format!(
            "version: 1\nwhy: A controller.\ntrack: {assets}/tracks/liu2023_section1.yaml\ntrain: {assets}/trains/dx80_176y.yaml\n\
             load: {{mass_kg: 10000}}\nsensors: {assets}/sensors/liu2023.yaml\ndrive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 2, mps: 0.5}}]}}\n\
             estimators:\n  ecu: {{external: {external}}}\nstop: {{after_s: 2}}\nintegrity: {{max_misleading_share: 1}}\n"
        )
    };
    for (external, told) in [
        ("{}", "one of `process`, `udp` and `can`"),
        ("{udp: localhost}", "`localhost` is no address with a port"),
        (
            "{udp: \"127.0.0.1:47800\", can: can0}",
            "one of `process`, `udp` and `can`",
        ),
        ("{can: \"\"}", "`can` is an interface"),
        ("{process: []}", "begins with a program"),
        (
            "{process: [no-such-program]}",
            "the program `no-such-program` does not exist",
        ),
        ("{process: [./mine]}", "the program `./mine` does not exist"),
        ("{process: [sh], baud: 9600}", "baud"),
        (
            "{process: [sh], deadline_ms: 0}",
            "`deadline_ms` is above 0 and at most 1000",
        ),
        ("{process: [sh], start_s: 601}", "`start_s` is above 0"),
        (
            "{process: [sh], faults: {delay_every: 3}}",
            "`delay_every` and `delay_ms` belong together",
        ),
        (
            "{process: [sh]}, is: rail_fusion",
            "`external` cannot be combined",
        ),
        ("{process: [sh]}, gain: 2", "no parameter `gain`"),
    ] {
        dir.write("bad.yaml", written(external).as_bytes());
        let refused = words(&dir.refused(&["check", "bad.yaml", "--allow-foreign"]));
        assert!(
            refused.contains("bad.yaml:9:") && refused.contains(told),
            "{external}: {refused}"
        );
    }
    let program = format!("[{OURS}, ecu, attitude, --scenario, good.yaml]");
    dir.write(
        "good.yaml",
        written(&format!("{{process: {program}}}")).as_bytes(),
    );
    let (code, out, err) = dir.monorig(&["run", "good.yaml", "--no-rerun"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(words(&err).contains("ecu is external, process"), "{err}");
    let manifest: serde_json::Value =
        serde_json::from_str(&dir.read("runs/good/1/manifest.json")).unwrap();
    let told = manifest.pointer("/resolved/estimators/ecu/external/process/1");
    assert_eq!(
        told.and_then(|word| word.as_str()),
        Some("ecu"),
        "{manifest}"
    );
}
