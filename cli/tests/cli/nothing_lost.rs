//! Results are what they say: made by this program from these files, whole, and never in place of better ones.

use crate::common::{GOOD, TestFolder};
use monorig_testing::tools;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The good scenario without what takes time.
fn quick(after_s: u32) -> String {
    let (head, _) = GOOD.split_once("events:").unwrap();
    head.replace("after_s: 60", &format!("after_s: {after_s}"))
        .replace("rapier", "point-mass")
}

const STUDY: &str = "\
version: 1
why: A spread.
scenario: quick.yaml
runs: 60
vary:
  - {path: load.mass_kg, uniform: [0, 2500]}
  - {path: sensors, choice: [sensors.yaml, others.yaml]}
";

fn with_study() -> TestFolder {
    let dir = TestFolder::new();
    dir.write("quick.yaml", quick(10).as_bytes());
    dir.write("spread.yaml", STUDY.as_bytes());
    dir.write("others.yaml", dir.read("sensors.yaml").as_bytes());
    dir
}

fn run(dir: &TestFolder, arguments: &[&str]) -> String {
    let (code, out, err) = dir.monorig(arguments);
    assert!(matches!(code, Some(0 | 1)), "{arguments:?}: {out}{err}");
    out
}

fn start(dir: &TestFolder, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_monorig"))
        .args(arguments)
        .current_dir(dir.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits until something is so, at most a minute.
fn until(so: impl Fn() -> bool) {
    let begun = Instant::now();
    while !so() {
        assert!(begun.elapsed().as_secs() < 60, "it never came");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Ctrl-C, then the end.
fn interrupt(mut child: Child) {
    let pid = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

fn json(dir: &TestFolder, name: &str) -> Value {
    serde_json::from_str(&dir.read(name)).unwrap()
}

#[test]
fn the_program_says_which_it_is() {
    let dir = TestFolder::new();
    let (code, told, _) = dir.monorig(&["--version"]);
    assert_eq!(code, Some(0));
    assert!(
        told.contains(env!("CARGO_PKG_VERSION")) && told.contains("program "),
        "{told}"
    );
    dir.write("quick.yaml", quick(2).as_bytes());
    run(&dir, &["run", "quick.yaml", "--no-rerun"]);
    let manifest = json(&dir, "runs/quick/1/manifest.json");
    let bytes = std::fs::read(env!("CARGO_BIN_EXE_monorig")).unwrap();
    let sum = Sha256::digest(bytes);
    let sum: String = sum.iter().map(|byte| format!("{byte:02x}")).collect();
    let program = manifest["monorig"]["program"].as_str().unwrap();
    assert!(!program.is_empty() && sum.starts_with(program));
    // the default of a parameter that the scenario leaves out
    let parameters = &manifest["resolved"]["parameters"]["estimators"]["dffrls_aekf_robust"];
    assert!(parameters.as_object().unwrap().len() > 5, "{parameters}");
}

/// Results, shards and trials of another build are refused, and left as they are.
#[test]
fn results_of_another_program_are_not_gone_on_with() {
    let dir = with_study();
    run(&dir, &["study", "spread.yaml"]);
    run(&dir, &["study", "spread.yaml", "--shard", "1/2"]);
    run(&dir, &["study", "spread.yaml", "--shard", "2/2"]);
    let parts = [
        "runs/spread/results.1-of-2.jsonl",
        "runs/spread/results.2-of-2.jsonl",
    ];
    for (file, arguments) in [
        ("runs/spread/results.jsonl", &["study", "spread.yaml"][..]),
        (
            parts[1],
            &["merge", parts[0], parts[1], "--into", "all.jsonl"],
        ),
    ] {
        let good = dir.read(file);
        let (head, lines) = good.split_once('\n').unwrap();
        for (field, other, told) in [
            ("program", "0".repeat(64), "program file"),
            (
                "revision",
                "elsewhere".to_owned(),
                "git revision elsewhere there",
            ),
            (
                "arithmetic",
                "other".to_owned(),
                "arithmetic of the machine other there",
            ),
        ] {
            let mut header: Value = serde_json::from_str(head).unwrap();
            header["monorig"][field] = other.into();
            dir.write(file, format!("{header}\n{lines}").as_bytes());
            let refused = dir.refused(arguments);
            assert!(refused.contains(told), "{refused}");
        }
        dir.write(file, good.as_bytes());
    }
}

/// A file that `--set` names is among the inputs: another content is another hash. A file that is only mentioned is not
/// read.
#[test]
fn the_manifest_has_the_files_that_were_read_and_no_others() {
    let dir = TestFolder::new();
    dir.write("quick.yaml", quick(2).as_bytes());
    dir.write("liu2023.pdf", b"%PDF \xff");
    let sensors = |source: &str| dir.read("sensors.yaml").replace("A sample.", source);
    dir.write("others.yaml", sensors("liu2023.pdf").as_bytes());
    let command = [
        "run",
        "quick.yaml",
        "--no-rerun",
        "--set",
        "sensors=others.yaml",
        "--name",
        "others",
    ];
    let manifest = || {
        run(&dir, &command);
        json(&dir, "runs/quick@others/1/manifest.json")
    };
    let first = manifest();
    let inputs = first["inputs"].as_object().unwrap();
    for name in [
        "quick.yaml",
        "others.yaml",
        "track.yaml",
        "rails/i140e.yaml",
        "units/drive_unit.urdf",
    ] {
        assert!(inputs.contains_key(name), "{name}: {inputs:?}");
    }
    for name in ["sensors.yaml", "liu2023.pdf"] {
        assert!(!inputs.contains_key(name), "{name}");
    }
    assert_eq!(manifest(), first);
    dir.write("others.yaml", sensors("elsewhere").as_bytes());
    assert_ne!(manifest()["hash"], first["hash"]);
}

/// Files edited while a study goes on change none of its runs, a choice's among them; and the study keeps what it was
/// made from.
#[test]
fn a_study_is_made_from_the_files_as_they_were_when_it_began() {
    let dir = with_study();
    run(&dir, &["study", "spread.yaml", "--out", "undisturbed"]);
    let whole = dir.read("undisturbed/spread/results.jsonl");
    let child = start(&dir, &["study", "spread.yaml", "--jobs", "1"]);
    let results = dir.path("runs/spread/results.jsonl");
    until(|| std::fs::read_to_string(&results).is_ok_and(|t| t.lines().count() > 2));
    for name in [
        "track.yaml",
        "sensors.yaml",
        "others.yaml",
        "quick.yaml",
        "units/drive_unit.urdf",
    ] {
        dir.write(name, b"edited");
    }
    assert!(matches!({ child }.wait().unwrap().code(), Some(0 | 1)));
    assert!(dir.read("runs/spread/results.jsonl") == whole);
    let header: Value = serde_json::from_str(whole.lines().next().unwrap()).unwrap();
    let inputs = header["inputs"].as_object().unwrap();
    assert!(inputs.contains_key("others.yaml") && inputs.contains_key("spread.yaml"));
    for digest in inputs.values() {
        let kept = dir
            .path("runs/spread/inputs")
            .join(digest.as_str().unwrap());
        assert!(kept.is_file(), "{}", kept.display());
    }
}

/// A scenario that cannot be used is in every report, as an error.
#[test]
fn an_unusable_scenario_is_in_all_reports() {
    let dir = TestFolder::new();
    dir.write("quick.yaml", quick(2).as_bytes());
    dir.write("broken.yaml", b"colour: red\n");
    let files = ["--junit", "v.xml", "--json", "v.json"];
    let command = [
        &["test", "quick.yaml", "broken.yaml", "--seeds", "1"][..],
        &files,
    ]
    .concat();
    let (code, out, err) = dir.monorig(&command);
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(out.contains("1 could not be used"), "{out}");
    let xml = dir.read("v.xml");
    assert!(xml.contains("<error") && xml.contains("broken"), "{xml}");
    assert!(xml.contains("errors=\"1\""), "{xml}");
    let verdicts = json(&dir, "v.json");
    let broken = &verdicts["scenarios"][1];
    assert_eq!(
        (&broken["scenario"], &broken["held"]),
        (&"broken".into(), &false.into())
    );
    assert!(
        broken.to_string().contains("unknown key `colour`"),
        "{broken}"
    );
    run(&dir, &["report", "v.json"]);
    assert!(dir.read("v.html").contains("broken"));
}

/// Reports of an earlier test do not stay behind when this one is interrupted.
#[test]
fn after_an_interrupt_there_is_no_old_report() {
    if !tools(&["kill"]) {
        return;
    }
    let dir = TestFolder::new();
    let long = quick(60).replace("point-mass", "rapier");
    dir.write("long.yaml", long.as_bytes());
    dir.write("v.xml", b"<old/>");
    let command = [
        "test",
        "long.yaml",
        "--seeds",
        "1..500",
        "--jobs",
        "1",
        "--junit",
        "v.xml",
    ];
    let child = start(&dir, &command);
    until(|| !dir.path("v.xml").exists()); // it listens
    interrupt(child);
    assert!(!dir.path("v.xml").exists());
}

/// The first run, whole, stays when the second is interrupted; that one stands beside it.
#[test]
fn an_interrupted_run_does_not_replace_a_whole_one() {
    if !tools(&["kill"]) {
        return;
    }
    let dir = TestFolder::new();
    dir.write("quick.yaml", quick(2).as_bytes());
    run(&dir, &["run", "quick.yaml", "--no-rerun"]);
    let whole = dir.read("runs/quick/1/manifest.json");
    let standing = quick(1_000_000).replace("mps: 1.0", "mps: 0.0"); // it does not come to the end of the track meanwhile
    dir.write("quick.yaml", standing.as_bytes());
    let child = start(&dir, &["run", "quick.yaml", "--no-rerun"]);
    let begun = || {
        let names = dir.names();
        names
            .iter()
            .any(|n| n.contains(".1.partial-") && n.contains("channels"))
    };
    until(begun);
    std::thread::sleep(Duration::from_millis(300));
    interrupt(child);
    assert_eq!(dir.read("runs/quick/1/manifest.json"), whole);
    let (code, told, err) = dir.monorig(&["check", "runs/quick/1.interrupted/metrics.json"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(told.contains("NOT finished"), "{told}");
    let left = dir.names().into_iter().filter(|n| n.contains("partial"));
    assert_eq!(left.count(), 0);
}

/// Backwards off the start of the track is as wrong as forwards off its end.
#[test]
fn a_train_that_leaves_the_start_of_the_track_breaks_down() {
    let dir = TestFolder::new();
    let back = quick(60).replace("{at_s: 4, mps: 1.0}", "{at_s: 4, mps: -2.0}");
    dir.write("back.yaml", back.as_bytes());
    let (code, out, err) = dir.monorig(&["run", "back.yaml", "--no-rerun"]);
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(err.contains("ran off the start of the track"), "{err}");
    assert!(!dir.path("runs/back").exists());
}

/// Any byte of any file of a run: told by `check`, and nothing is drawn of it.
#[test]
fn a_damaged_output_is_told() {
    let dir = TestFolder::new();
    dir.write("quick.yaml", quick(5).as_bytes());
    run(&dir, &["run", "quick.yaml"]);
    let folder = "runs/quick/1";
    run(&dir, &["check", &format!("{folder}/manifest.json")]);
    for name in ["channels.parquet", "metrics.json", "run.rrd"] {
        let file = format!("{folder}/{name}");
        let Ok(good) = std::fs::read(dir.path(&file)) else {
            assert_eq!((name, cfg!(feature = "viewer")), ("run.rrd", false));
            continue;
        };
        let mut flipped = good.clone();
        flipped[good.len() / 2] ^= 1;
        for damaged in [&flipped[..], &good[..good.len() - 1]] {
            dir.write(&file, damaged);
            for arguments in [
                ["check", &file],
                ["check", &format!("{folder}/manifest.json")],
                ["report", folder],
            ] {
                assert!(dir.refused(&arguments).contains(name), "{arguments:?}");
            }
        }
        dir.write(&file, &good);
    }
    run(&dir, &["report", folder]);
}

/// The same run gives the same bytes in every file.
#[test]
fn two_runs_give_the_same_bytes() {
    let dir = TestFolder::new();
    dir.write(
        "quick.yaml",
        quick(40).replace("point-mass", "rapier").as_bytes(),
    );
    for out in ["a", "b", "c"] {
        run(&dir, &["run", "quick.yaml", "--out", out]);
    }
    let mut files = 0;
    for entry in std::fs::read_dir(dir.path("a/quick/1")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let bytes = |out: &str| std::fs::read(dir.path(out).join("quick/1").join(&name)).unwrap();
        assert!(
            bytes("a") == bytes("b") && bytes("a") == bytes("c"),
            "{name} differs"
        );
        files += 1;
    }
    assert_eq!(files, if cfg!(feature = "viewer") { 4 } else { 3 });
}
