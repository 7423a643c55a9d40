//! Work over several processes: shards of a test.

use crate::common::TestFolder;

const QUICK: &str = "\
version: 1
why: A quick one.
track: ../track.yaml
train: ../train.yaml
start: {chainage_m: 2}
stop: {after_s: 20}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: ../sensors.yaml
estimators: {attitude: {}}
integrity: {max_misleading_share: 1}
seeds: SEEDS
expect:
  - {metric: speed_rmse_mps, at_most: BOUND}
  - {estimator: attitude, metric: mass_availability, at_least: 0}
";

fn tests() -> TestFolder {
    let dir = TestFolder::new();
    std::fs::create_dir_all(dir.path("all")).unwrap();
    for (name, seeds, bound) in [("a", "1..3", "1"), ("b", "[7]", "1"), ("c", "1..2", "1e-9")] {
        let text = QUICK.replace("SEEDS", seeds).replace("BOUND", bound);
        dir.write(&format!("all/{name}.yaml"), text.as_bytes());
    }
    dir
}

/// Four shards, merged, are the same bytes and the same verdict as one process; a scenario without a run in a shard is
/// no failure.
#[test]
fn shards_of_a_test_are_judged_by_merge() {
    let dir = tests();
    let (code, whole, _) = dir.monorig(&["test", "all", "--json", "whole.json"]);
    assert_eq!(code, Some(1), "c does not hold: {whole}");
    let mut files = Vec::new();
    for part in [3, 1, 4, 2] {
        let (shard, file) = (format!("{part}/4"), format!("shard-{part}.json"));
        let arguments = [
            "test", "all", "--shard", &shard, "--json", &file, "--expect", "merge",
        ];
        let (code, out, err) = dir.monorig(&arguments);
        assert_eq!(code, Some(0), "{out}{err}");
        files.push(file);
    }
    let (code, ..) = dir.monorig(&["test", "all", "--shard", "4/4", "--json", "judged.json"]);
    assert_eq!(
        code,
        Some(0),
        "the fourth of six runs is that of b, which holds"
    );
    let merge = |files: &[String]| {
        let mut arguments = vec!["merge", "--into", "all.json"];
        arguments.extend(files.iter().map(String::as_str));
        arguments
            .iter()
            .map(|a| (*a).to_owned())
            .collect::<Vec<_>>()
    };
    let run = |arguments: Vec<String>| {
        dir.monorig(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let (code, out, err) = run(merge(&files));
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("\nFAILED: 1 of 3 scenarios, 6 runs"), "{out}");
    assert!(dir.read("all.json") == dir.read("whole.json"));

    for (files, says) in [
        (&files[..3], "do not make a whole: 1/4, 3/4, 4/4"),
        (
            &[&files[..], &files[..1]].concat()[..],
            "do not make a whole: 1/4, 2/4, 3/4, 3/4, 4/4",
        ),
    ] {
        let (code, out, err) = run(merge(files));
        assert_eq!(code, Some(2), "{out}");
        assert!(err.contains(says), "{err}");
    }
    for (from, to, says) in [
        (
            "\"arithmetic\":\"",
            "\"arithmetic\":\"0",
            "arithmetic of the machine",
        ),
        ("\"hash\":\"", "\"hash\":\"0", "files, values or seeds of a"),
        ("\"of\":4", "\"of\":5", "do not make a whole: 1/4, 2/5"),
    ] {
        let text = dir.read("shard-2.json");
        assert!(text.contains(from));
        dir.write("other.json", text.replacen(from, to, 1).as_bytes());
        let mut files = files.clone();
        files[3] = "other.json".into();
        let (code, _, err) = run(merge(&files));
        assert_eq!(code, Some(2));
        assert!(err.contains(says), "{err}");
    }
    let told = dir.refused(&["test", "all", "--shard", "1/2"]);
    assert!(told.contains("--json"), "{told}");
}
