//! `monorig stress --drawn`: the same bytes whatever happens on the way, and a fault that is run again.

use crate::common::{TestFolder, project};
use serde_json::Value;

/// A folder with ranges of short courses for one drive unit.
fn dir() -> TestFolder {
    let assets = project().join("assets");
    let ranges = std::fs::read_to_string(assets.join("ranges/roadway.yaml")).unwrap();
    let ranges = ranges.replace("../", &format!("{}/", assets.display()));
    let is_long = |line: &&str| line.contains("dx80_176y");
    let ranges: Vec<&str> = ranges.lines().filter(|line| !is_long(line)).collect();
    let ranges = ranges.join("\n").replace("[100, 300]", "[30, 50]");
    let dir = TestFolder::new();
    dir.write("ranges.yaml", ranges.as_bytes());
    dir
}

fn run(dir: &TestFolder, arguments: &[&str]) -> String {
    let (code, out, err) = dir.monorig(&[&["stress"], arguments].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    out
}

fn drawn<'a>(count: &'a str, seed: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    let own = ["--drawn", count, "--seed", seed, "--ranges", "ranges.yaml"];
    [&own[..], rest].concat()
}

fn cells(dir: &TestFolder, file: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(&dir.read(file)).unwrap();
    all["cells"].as_array().unwrap().clone()
}

/// Threads and shards change no byte, fewer faults are the first of more, and one is run again to the same figures: by
/// its seed, and from its files.
#[test]
fn drawn_faults_are_the_same_and_run_again() {
    let dir = dir();
    let told = run(
        &dir,
        &drawn(
            "4",
            "1",
            &["--jobs", "1", "--json", "all.json", "--html", "all.html"],
        ),
    );
    for words in [
        "does it mislead?",
        "by kind",
        "by size",
        "fault_4",
        "--drawn 1 --seed ",
    ] {
        assert!(told.contains(words), "{words}\n{told}");
    }
    assert!(told.lines().all(|l| l.chars().count() <= 80), "{told}");
    assert!(dir.read("all.html").contains("All conditions together"));
    let whole = dir.read("all.json");
    run(
        &dir,
        &drawn(
            "4",
            "1",
            &["--jobs", "2", "--out", "two", "--json", "two.json"],
        ),
    );
    assert!(dir.read("two.json") == whole);

    for part in ["1/2", "2/2"] {
        run(
            &dir,
            &drawn("4", "1", &["--shard", part, "--json", &part[..1]]),
        );
    }
    let (code, merged, err) = dir.monorig(&["merge", "1", "2", "--into", "merged.json"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.read("merged.json") == whole && merged == told);

    let all = cells(&dir, "all.json");
    let worst = all[0]["condition"].as_str().unwrap().to_owned();
    let seed = worst.trim_start_matches("fault_");
    run(&dir, &drawn("1", seed, &["--json", "again.json"]));
    let course = format!("runs/stress/drawn/drawn_{seed}.yaml");
    let folder = format!("runs/stress/drawn/{worst}");
    run(
        &dir,
        &[
            &course,
            "--conditions",
            &folder,
            "--only",
            &worst,
            "--json",
            "files.json",
        ],
    );
    for cell in all.iter().filter(|c| c["condition"] == worst.as_str()) {
        assert!(cells(&dir, "again.json").contains(cell));
        let mut of_files = cells(&dir, "files.json");
        // there the run without the fault shows that it changes something
        of_files.iter_mut().for_each(|c| c["changed"] = 0.into());
        assert!(of_files.contains(cell), "{cell}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let dir = dir();
    for (arguments, says) in [
        (&["--drawn", "0"][..], "1..=100000"),
        (&["--drawn", "4", "--only", "oil"], "--only"),
        (&["--drawn", "4", "--conditions", "bad"], "--conditions"),
        (&["--drawn", "4", "mine.yaml"], "SCENARIOS"),
        (&["--drawn", "4", "--seeds", "1..2"], "--seeds"),
        (&["--seed", "4"], "--drawn"),
        (&["--drawn", "4", "--ranges", "none.yaml"], "none.yaml"),
    ] {
        let (code, out, err) = dir.monorig(&[&["stress"], arguments].concat());
        assert_eq!(code, Some(2), "{out}{err}");
        assert!(err.contains(says), "{says}\n{err}");
    }
}
