//! `monorig stress`: the same bytes whatever happens on the way, and its verdict against an earlier matrix.

use crate::common::{TestFolder, words};

const QUICK: &str = "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {chainage_m: 2}
stop: {after_s: 12}
physics: {plant: point-mass}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 3, mps: 1.5}]}
sensors: sensors.yaml
estimators: {rail_fusion: {}}
seeds: 1..2
";

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick.yaml", QUICK.as_bytes());
    std::fs::create_dir(dir.path("bad")).unwrap();
    for (name, rest) in [
        (
            "scale",
            "group: instruments\nevents: [{from_s: 2, sensor: wheel_speed, fault: scale, size: 1.1}]",
        ),
        ("heavy", "group: train\nset: {load.mass_kg: 2000}"),
        ("tare", "group: told\ntold_factor: {tare_kg: 1.3}"),
    ] {
        let text = format!("version: 1\ncondition: a test\n{rest}\n");
        dir.write(&format!("bad/{name}.yaml"), text.as_bytes());
    }
    dir
}

const STRESS: [&str; 4] = ["stress", "quick.yaml", "--conditions", "bad"];

fn stress(dir: &TestFolder, arguments: &[&str]) -> String {
    let (code, out, err) = dir.monorig(&[&STRESS, arguments].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    out
}

/// Whatever the number of threads, resumed after a kill at any place, in shards or whole.
#[test]
fn threads_kills_and_shards_change_no_byte() {
    let dir = dir();
    let told = stress(
        &dir,
        &[
            "--jobs",
            "1",
            "--out",
            "one",
            "--json",
            "whole.json",
            "--html",
            "whole.html",
        ],
    );
    assert!(told.contains("nominal") && told.contains("heavy"), "{told}");
    let page = dir.read("whole.html");
    assert!(page.contains("tare") && !page.contains("<script"));
    let whole = dir.read("whole.json");
    assert_eq!(
        stress(&dir, &["--jobs", "2", "--out", "two", "--json", "two.json"]),
        told
    );
    assert!(dir.read("two.json") == whole);
    assert!(stress(&dir, &["--out", "one", "--json", "-"]) == whole);

    let folder = std::fs::read_dir(dir.path("one/stress"))
        .unwrap()
        .next()
        .unwrap();
    let results = folder.unwrap().path().join("results.jsonl");
    let lines = std::fs::read(&results).unwrap();
    std::fs::write(&results, &lines[..lines.len() / 2]).unwrap();
    stress(&dir, &["--out", "one", "--json", "again.json"]);
    assert!(dir.read("again.json") == whole && std::fs::read(&results).unwrap() == lines);

    let mut parts = Vec::new();
    for part in ["3/3", "1/3", "2/3"] {
        let name = format!("{}.json", &part[..1]);
        stress(&dir, &["--shard", part, "--json", &name]);
        parts.push(name);
    }
    let merge: Vec<&str> = ["merge", "--into", "all.json"]
        .into_iter()
        .chain(parts.iter().map(String::as_str))
        .collect();
    let told = dir.refused(&merge[..5]);
    assert!(told.contains("do not make a whole: 1/3, 3/3"), "{told}");
    let (code, _, err) = dir.monorig(&merge);
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.read("all.json") == whole);
}

/// The largest share that misleads is within itself and beyond less, and no share is beyond 100 %.
#[test]
fn the_share_that_misleads_is_judged() {
    let dir = dir();
    let mount = "version: 1\ncondition: a test\ngroup: instruments\nset:\n  sensors.accelerometer.misalignment_deg: [0, 3, 0]\n";
    dir.write("bad/mount.yaml", mount.as_bytes());
    let told = stress(&dir, &["--only", "heavy", "--max-misled", "50%"]);
    assert!(told.ends_with("held: misled at most 50 %\n"), "{told}");
    stress(&dir, &["--json", "all.json"]);
    let all: serde_json::Value = serde_json::from_str(&dir.read("all.json")).unwrap();
    let cells = all["cells"].as_array().unwrap();
    let shares = cells.iter().flat_map(|cell| {
        let quantities = ["mass", "slope", "effective_slope"];
        quantities.map(|quantity| cell[quantity]["misleading"].as_f64().unwrap_or(0.0))
    });
    let most = shares.fold(0.0, f64::max);
    assert!(
        most > 0.0,
        "a battery in which nothing misleads tests nothing"
    );
    let less = (0.9 * most).min(0.45).to_string();
    let (code, out, err) = dir.monorig(&[&STRESS[..], &["--max-misled", &less]].concat());
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("FAILED: 1 cell misled more than"), "{out}");
    let (code, _, err) = dir.monorig(&[&STRESS[..], &["--max-misled", "51%"]].concat());
    assert!(code == Some(2) && err.contains("at most 50%"), "{err}");
}

/// An estimator without a valid sample in any run is not one that misled nowhere.
#[test]
fn a_battery_without_a_valid_sample_fails() {
    let dir = dir();
    let late = "estimators.late={is: attitude, grade_sd_max_deg: 0.01}";
    for more in [&["--max-misled", "1%"][..], &[]] {
        let task = ["--only", "heavy", "--estimators", "late", "--set", late];
        let (code, out, err) = dir.monorig(&[&STRESS[..], &task, more].concat());
        assert_eq!(code, Some(1), "{out}{err}");
        assert!(out.contains("no run has a valid sample of late"), "{out}");
        assert!(!out.contains("held"), "{out}");
    }
}

/// Against itself nothing is worse; against a matrix with a smaller error a figure is, and the exit code is 1.
#[test]
fn what_has_become_worse_fails() {
    let dir = dir();
    stress(&dir, &["--json", "old.json"]);
    let told = stress(&dir, &["--against", "old.json"]);
    let counts = "0 figures worse, 0 better: errors by more than 5 %, shares by more than 1 %\n";
    let end = format!("{counts}held: no figure is worse\n");
    assert!(told.ends_with(&end), "{told}");
    let mut old: serde_json::Value = serde_json::from_str(&dir.read("old.json")).unwrap();
    let error = old["cells"][0]["slope"]["error"].as_f64().unwrap();
    old["cells"][0]["slope"]["error"] = (0.5 * error).into();
    dir.write("old.json", old.to_string().as_bytes());
    let against = [&STRESS[..], &["--against", "old.json"]].concat();
    let (code, out, err) = dir.monorig(&against);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        out.contains("WORSE") && out.contains("slope error"),
        "{out}"
    );
    let loose = [&against[..], &["--worse-than", "150%"]].concat();
    assert_eq!(dir.monorig(&loose).0, Some(0));
}

/// A mistake in a condition is told with file, line and what would be right.
#[test]
fn a_wrong_condition_is_refused_where_it_is_wrong() {
    for (text, line, told, help) in [
        (
            "version: 1\ncondition: x\ngroup: weather\n",
            3,
            "weather",
            "rail",
        ),
        (
            "version: 1\ncondition: x\ngroup: rail\nsett: {}\n",
            4,
            "sett",
            "set",
        ),
        (
            "version: 1\ncondition: ' '\ngroup: rail\n",
            2,
            "needs a description",
            "write a line",
        ),
        (
            "version: 1\ncondition: x\ngroup: rail\nset: {load.mas_kg: 1}\n",
            4,
            "mas_kg",
            "mass_kg",
        ),
        (
            "version: 1\ncondition: x\ngroup: told\ntold_factor: {tare_kg: -1}\n",
            4,
            "-1",
            "above zero",
        ),
        (
            "version: 1\ncondition: x\ngroup: rail\nevents:\n  - {from_s: 1, sensor: imu, fault: scale}\n",
            5,
            "size",
            "factor",
        ),
        (
            "version: 1\ncondition: x\ngroup: rail\nevents:\n  - {from_s: 1, sensor: radar, fault: off}\n",
            5,
            "radar",
            "wheel_speed",
        ),
    ] {
        let dir = dir();
        dir.write("bad/wrong.yaml", text.as_bytes());
        let (code, _, err) = dir.monorig(&STRESS);
        assert_eq!(code, Some(2), "{err}");
        let err = words(&err);
        let place = format!("wrong.yaml:{line}:");
        assert!(
            err.contains(&place) && err.contains(told) && err.contains(help),
            "{place} {told}, {help}: {err}"
        );
    }
    let dir = dir();
    let told = dir.refused(&[
        "stress",
        "quick.yaml",
        "--conditions",
        "bad",
        "--only",
        "nothing",
    ]);
    assert!(told.contains("no condition has `nothing`"), "{told}");
}
