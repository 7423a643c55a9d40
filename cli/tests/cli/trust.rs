//! Files from others are data: nothing that they name is run unasked, what was run is in the hash, no result goes over
//! an input.

use crate::common::{TestFolder, compile, project, words};
use monorig_testing::Random;
use monorig_testing::{mutants, tools};
use serde_json::{Value, json};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const OURS: &str = env!("CARGO_BIN_EXE_monorig");

/// A folder with a scenario of these estimators.
fn folder(estimators: &str) -> TestFolder {
    let dir = TestFolder::new();
    let text = format!(
        "\
version: 1
why: A quick one.
track: track.yaml
train: train.yaml
start: {{chainage_m: 2}}
stop: {{after_s: 12}}
physics: {{plant: point-mass}}
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 3, mps: 1.5}}]}}
sensors: sensors.yaml
estimators: {{{estimators}}}
integrity: {{max_misleading_share: 1}}
seeds: 1..2
expect: [{{metric: speed_rmse_mps, at_most: 1}}]
"
    );
    dir.write("quick.yaml", text.as_bytes());
    dir
}

/// An external estimator by way of a shell, which leaves a mark in the folder of `plain.yaml`.
fn shell(plain: &TestFolder) -> String {
    let at = plain.path("").display().to_string();
    let ecu = format!("touch {at}/RAN; exec {OURS} ecu dffrls_aekf --scenario {at}/plain.yaml");
    format!("{{external: {{process: [sh, -c, \"{ecu}\"]}}}}")
}

/// A folder with a scenario of ours alone.
fn plain() -> TestFolder {
    let dir = folder("attitude: {}");
    dir.write("plain.yaml", dir.read("quick.yaml").as_bytes());
    dir
}

/// True if something has left a mark in one of these folders; the mark goes.
fn ran(folders: &[&TestFolder]) -> bool {
    let marks = folders
        .iter()
        .map(|dir| std::fs::remove_file(dir.path("RAN")));
    marks.filter(Result::is_ok).count() > 0
}

/// Each way to name code of others, in each command that reads what others may have sent: it runs with the option, and
/// not without it. What else was asked of the command is done, or refused with the option's name.
#[test]
fn what_a_file_names_is_run_when_it_is_allowed() {
    let plain = plain();
    let mut ways = vec![format!("attitude: {{}}, ecu: {}", shell(&plain))];
    let in_c = TestFolder::new();
    if compile(&in_c, "marks.so", "cli/tests/foreign.c", "MARKS AT_LOADING") {
        ways.push("attitude: {}, mine: {library: ./marks.so}".to_owned());
        let whole = in_c.path("marks.so");
        ways.push(format!(
            "attitude: {{}}, mine: {{library: {}}}",
            whole.display()
        ));
    }
    for way in ways {
        let dir = folder(&way);
        if in_c.path("marks.so").exists() {
            std::fs::copy(in_c.path("marks.so"), dir.path("marks.so")).unwrap();
        }
        dir.write("mine.csv", b"time,mass_kg\n0,2500\n6,2500\n12,2500\n");
        let run = [
            "run",
            "quick.yaml",
            "--keep-samples",
            "--no-rerun",
            "--seed",
            "1",
        ];
        let (code, out, err) = dir.monorig(&run);
        assert_eq!(code, Some(0), "{out}{err}");
        assert!(
            ran(&[&dir, &plain]),
            "the scenario that the user runs: {way}"
        );
        let kept = "runs/quick/1";
        let (code, out, err) = dir.monorig(&["export", kept, "--to", "csv", "--out", "log"]);
        assert_eq!((code, ran(&[&dir, &plain])), (Some(0), false), "{out}{err}");
        let map = "log/quick_1_csv.map.yaml";
        for (task, runs_steps, done) in [
            (&["check", "quick.yaml"][..], false, true),
            (&["check", map], false, true),
            (&["check", "runs/quick/1/manifest.json"], false, true),
            (
                &["judge", kept, "--estimates", "mine.csv", "--no-rerun"],
                true,
                true,
            ),
            (
                &[
                    "judge",
                    "--map",
                    map,
                    "--estimates",
                    "mine.csv",
                    "--no-rerun",
                ],
                true,
                true,
            ),
            (&["replay", "--map", map, "--no-rerun"], true, false),
            (&["explain", kept, "--seeds", "1"], true, false),
        ] {
            let (code, out, err) = dir.monorig(task);
            assert!(!ran(&[&dir, &plain]), "{task:?} of {way}: {out}{err}");
            let told = words(&format!("{out}{err}"));
            let is_manifest = task.contains(&"runs/quick/1/manifest.json");
            assert!(
                is_manifest || told.contains("--allow-foreign"),
                "{task:?}: {told}"
            );
            assert_eq!(code == Some(2), !done, "{task:?}: {told}");
            if is_manifest {
                continue;
            }
            let (code, out, err) = dir.monorig(&[task, &["--allow-foreign"]].concat());
            assert!(code == Some(0) || code == Some(1), "{task:?}: {out}{err}");
            let loads = way.contains("library");
            assert_eq!(
                ran(&[&dir, &plain]),
                loads || runs_steps,
                "{task:?} of {way}: {out}{err}"
            );
        }
        let report = dir.monorig(&["report", kept]);
        assert_eq!(
            (report.0, ran(&[&dir, &plain])),
            (Some(0), false),
            "{report:?}"
        );
    }
}

/// The user names a part on the command line, and no file asks for it.
#[test]
fn what_the_command_line_names_is_run() {
    let (dir, plain) = (folder("attitude: {}"), plain());
    let run = [
        "run",
        "quick.yaml",
        "--keep-samples",
        "--no-rerun",
        "--seed",
        "1",
    ];
    assert_eq!(dir.monorig(&run).0, Some(0));
    assert_eq!(
        dir.monorig(&["export", "runs/quick/1", "--to", "csv", "--out", "."])
            .0,
        Some(2)
    );
    assert_eq!(
        dir.monorig(&["export", "runs/quick/1", "--to", "csv", "--out", "log"])
            .0,
        Some(0)
    );
    let map = "log/quick_1_csv.map.yaml";
    let ecu = shell(&plain);
    for set in [
        format!("estimators={{ecu: {ecu}}}"),
        format!("estimators.ecu={ecu}"),
    ] {
        let (code, out, err) = dir.monorig(&["replay", "--map", map, "--no-rerun", "--set", &set]);
        assert!(
            code.is_some_and(|c| c < 2) && ran(&[&dir, &plain]),
            "{set}: {out}{err}"
        );
    }
    // a change that says nothing of the program does not name it
    let text = dir
        .read(map)
        .replace("estimators: {", &format!("estimators: {{ecu: {ecu}, "));
    dir.write(map, text.as_bytes());
    let set = "estimators.ecu.external.deadline_ms=5";
    let (code, _, err) = dir.monorig(&["replay", "--map", map, "--no-rerun", "--set", set]);
    assert_eq!((code, ran(&[&dir, &plain])), (Some(2), false), "{err}");
}

/// Runs of one program are never put together with those of another.
#[test]
fn a_program_that_was_edited_begins_anew() {
    let ways = [
        "[sh, ecu.sh]",
        "[./ecu.sh]",
        "[sh, -c, \"sh ecu.sh\"]",
        "[sh, -c, \"exec sh ./ecu.sh; true\"]",
        "[sh, -c, 'exec sh \"ecu.sh\"']",
        "[sh, start.sh]",
    ];
    for way in ways {
        let dir = folder(&format!("ecu: {{external: {{process: {way}}}}}"));
        dir.write(
            "plain.yaml",
            folder("attitude: {}").read("quick.yaml").as_bytes(),
        );
        let program = |name: &str| {
            let text = format!("#!/bin/sh\nexec {OURS} ecu {name} --scenario plain.yaml\n");
            dir.write("ecu.sh", text.as_bytes());
            Command::new("chmod")
                .args(["+x", "ecu.sh"])
                .current_dir(dir.path(""))
                .status()
                .unwrap();
        };
        program("dffrls_aekf");
        dir.write("start.sh", b". ./ecu.sh\n");
        dir.write("study.yaml", b"version: 1\nwhy: a test\nscenario: quick.yaml\nruns: 2\nvary: [{path: load.mass_kg, uniform: [1000, 2000]}]\n");
        std::fs::create_dir(dir.path("bad")).unwrap();
        let condition = b"version: 1\ncondition: a test\ngroup: train\nset: {load.mass_kg: 2000}\n";
        dir.write("bad/heavy.yaml", condition);
        let stress = [
            "stress",
            "quick.yaml",
            "--conditions",
            "bad",
            "--only",
            "heavy",
        ];
        let study = ["study", "study.yaml"];
        let there = |task: &[&str]| {
            let (code, out, err) = dir.monorig(task);
            (code == Some(2), words(&format!("{out}{err}")))
        };
        for task in [&stress[..], &study] {
            let (refused, told) = there(task);
            assert!(!refused, "{told}");
            let (refused, told) = there(task);
            assert!(!refused && told.contains("runs exist already"), "{told}");
        }
        program("attitude");
        let (refused, told) = there(&stress);
        assert!(!refused && !told.contains("exist already"), "{way}: {told}");
        let (refused, told) = there(&study);
        assert!(
            refused && told.contains("made from other inputs"),
            "{way}: {told}"
        );
    }
}

/// Every result of every command, on every input of it, under each of its names: refused, and the input is as before.
#[test]
fn no_result_goes_over_an_input() {
    let dir = folder("attitude: {}");
    for seed in ["1", "2"] {
        let run = [
            "run",
            "quick.yaml",
            "--keep-samples",
            "--no-rerun",
            "--seed",
            seed,
        ];
        assert_eq!(dir.monorig(&run).0, Some(0));
    }
    dir.write("mine.csv", b"time,mass_kg\n0,2500\n12,2500\n");
    assert_eq!(
        dir.monorig(&["test", "quick.yaml", "--json", "tested.json"])
            .0,
        Some(0)
    );
    let named = [
        "quick.yaml",
        "track.yaml",
        "train.yaml",
        "sensors.yaml",
        "units/drive_unit.urdf",
    ];
    let of_run = [
        "manifest.json",
        "metrics.json",
        "channels.parquet",
        "samples.parquet",
    ];
    let of = |run: &str| {
        of_run
            .map(|name| format!("runs/quick/{run}/{name}"))
            .to_vec()
    };
    let named: Vec<String> = named.map(str::to_owned).to_vec();
    let both = [of("1"), of("2")].concat();
    let judged = [of("1"), vec!["mine.csv".to_owned()]].concat();
    let tested = [named.clone(), vec!["tested.json".to_owned()]].concat();
    let cases: Vec<(&[&str], &[&str], Vec<String>)> = vec![
        (
            &["test", "quick.yaml", "--baseline", "tested.json"],
            &["--json", "--junit"],
            tested,
        ),
        (
            &["run", "quick.yaml", "--no-rerun"],
            &["--json"],
            named.clone(),
        ),
        (
            &[
                "compare",
                "quick.yaml",
                "--estimators",
                "attitude,dffrls_aekf",
            ],
            &["--json", "--csv"],
            named,
        ),
        (
            &[
                "judge",
                "runs/quick/1",
                "--estimates",
                "mine.csv",
                "--no-rerun",
            ],
            &["--json", "--junit"],
            judged,
        ),
        (&["report", "runs/quick/1"], &["--out"], of("1")),
        (
            &["report", "runs/quick/1", "runs/quick/2"],
            &["--out"],
            both,
        ),
        (
            &["report", "tested.json"],
            &["--out"],
            vec!["tested.json".to_owned()],
        ),
    ];
    std::os::unix::fs::symlink(".", dir.path("here")).unwrap();
    let mut random = Random::new(mutants::first_seed());
    for (task, outputs, inputs) in &cases {
        for input in inputs {
            let other = dir.path("other_name");
            let _ = std::fs::remove_file(&other);
            std::fs::hard_link(dir.path(input), &other).unwrap();
            let names = [
                input.clone(),
                format!("here/{input}"),
                "other_name".to_owned(),
            ];
            let name = random.of(&names);
            let output = random.of(outputs);
            let before = std::fs::read(dir.path(input)).unwrap();
            let (code, out, err) = dir.monorig(&[*task, &[*output, name.as_str()]].concat());
            assert_eq!(
                code,
                Some(2),
                "{task:?} {output} {name} ({input}): {out}{err}"
            );
            assert!(words(&err).contains("input of this command"), "{err}");
            assert_eq!(
                std::fs::read(dir.path(input)).unwrap(),
                before,
                "{task:?} {name}"
            );
        }
    }
}

/// Two results of one name, and a folder that is not there.
#[test]
fn results_have_places_of_their_own() {
    let dir = folder("attitude: {}");
    std::fs::create_dir(dir.path("out")).unwrap();
    for (names, words_told) in [
        (["x", "x"], "two results"),
        (["x", "./x"], "two results"),
        (["out/x", "out/../out/x"], "two results"),
        (["-", "-"], "two results"),
        (["otu/x", "y"], "no folder otu"),
        (["y", "a/b/x"], "no folder a/b"),
    ] {
        let task = [
            "test",
            "quick.yaml",
            "--json",
            names[0],
            "--junit",
            names[1],
        ];
        let told = words(&dir.refused(&task));
        assert!(told.contains(words_told), "{names:?}: {told}");
    }
}

/// A folder behind a link is read, each file once, and no two scenarios have one name.
#[test]
fn every_scenario_of_a_folder_is_tested_once() {
    let dir = folder("attitude: {}");
    for name in ["all", "more"] {
        std::fs::create_dir(dir.path(name)).unwrap();
    }
    let text = dir.read("quick.yaml");
    let text = ["track", "train", "sensors"]
        .iter()
        .fold(text, |text, key| {
            text.replace(&format!("{key}: {key}"), &format!("{key}: ../{key}"))
        });
    dir.write("all/good.yaml", text.as_bytes());
    dir.write(
        "more/bad.yaml",
        text.replace("at_most: 1}", "at_most: 1e-6}").as_bytes(),
    );
    let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, dir.path(name)).unwrap();
    assert_eq!(dir.monorig(&["test", "all"]).0, Some(0));
    link("../more", "all/linked");
    link("../all", "more/round");
    let (code, out, err) = dir.monorig(&["test", "all", "all/good.yaml", "./all/../all/good.yaml"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("FAILED: 1 of 2 scenarios, 4 runs"), "{out}");
    dir.write("more/good.yaml", text.as_bytes());
    let (code, out, err) = dir.monorig(&["test", "all"]);
    assert!(
        code == Some(2) && words(&err).contains("have the same name"),
        "{out}{err}"
    );
}

/// A matrix with which nothing is shared judges nothing; one that was made better is not held.
#[test]
fn a_matrix_is_held_against_the_same_battery() {
    let dir = folder("attitude: {}");
    std::fs::create_dir(dir.path("bad")).unwrap();
    let bad = "group: instruments\nevents: [{from_s: 6, to_s: 8, sensor: accelerometer, fault: bias, size: 1}]";
    for (name, rest) in [
        ("biased", bad),
        ("idle", "group: train\nset: {why: nothing else}"),
    ] {
        let text = format!("version: 1\ncondition: a test\n{rest}\n");
        dir.write(&format!("bad/{name}.yaml"), text.as_bytes());
    }
    let stress = [
        "stress",
        "quick.yaml",
        "--conditions",
        "bad",
        "--only",
        "biased,idle",
    ];
    let (code, out, err) = dir.monorig(&[&stress[..], &["--json", "old.json"]].concat());
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(
        words(&out).contains("not judged: idle changes no input"),
        "{out}"
    );
    let old: Value = serde_json::from_str(&dir.read("old.json")).unwrap();
    type Edit = fn(&mut Value);
    let edits: &[(&str, Edit, i32)] = &[
        ("nothing", |_| {}, 0),
        (
            "seeds",
            |old| old["scenarios"]["quick"] = json!([1, 2, 3]),
            2,
        ),
        (
            "scenario",
            |old| old["scenarios"] = json!({"other": [1, 2]}),
            2,
        ),
        ("no cell", |old| old["cells"] = json!([]), 2),
        (
            "estimator",
            |old| each(old, |cell| cell["estimator"] = json!("other")),
            2,
        ),
        (
            "condition",
            |old| each(old, |cell| cell["condition"] = json!("other")),
            2,
        ),
        (
            "told sd",
            |old| each(old, |cell| scale(&mut cell["slope"]["sd"], 0.3)),
            1,
        ),
        (
            "error",
            |old| each(old, |cell| scale(&mut cell["slope"]["error"], 0.3)),
            1,
        ),
        (
            "valid",
            |old| each(old, |cell| cell["mass"]["valid"] = json!(1.0)),
            1,
        ),
    ];
    for (what, edit, expected) in edits {
        let mut edited = old.clone();
        edit(&mut edited);
        dir.write("edited.json", edited.to_string().as_bytes());
        let (code, out, err) = dir.monorig(&[&stress[..], &["--against", "edited.json"]].concat());
        assert_eq!(code, Some(*expected), "{what}: {out}{err}");
    }
}

fn each(old: &mut Value, edit: impl Fn(&mut Value)) {
    old["cells"]
        .as_array_mut()
        .unwrap()
        .iter_mut()
        .for_each(edit);
}

fn scale(number: &mut Value, factor: f64) {
    *number = json!(number.as_f64().unwrap() * factor);
}

/// A condition is one of the drive: it changes neither estimators nor their judge.
#[test]
fn a_condition_does_not_change_the_judge() {
    let dir = folder("attitude: {}");
    for key in [
        "integrity.k",
        "integrity.mass_alert_rel",
        "estimators.attitude.x",
        "expect",
        "availability.mass",
        "seeds",
        "known_failures[0].why",
        "in_loop",
    ] {
        let text = format!("version: 1\ncondition: a test\ngroup: told\nset: {{\"{key}\": 9}}\n");
        dir.write("condition.yaml", text.as_bytes());
        let told = words(&dir.refused(&["check", "condition.yaml"]));
        assert!(told.contains("not the drive"), "{key}: {told}");
    }
}

/// Only a shard leaves its verdicts to others.
#[test]
fn a_test_that_no_one_merges_is_judged_here() {
    let dir = folder("attitude: {}");
    assert!(
        dir.refused(&["test", "quick.yaml", "--expect", "merge"])
            .contains("--shard")
    );
    let shard = [
        "test",
        "quick.yaml",
        "--expect",
        "merge",
        "--shard",
        "1/2",
        "--json",
        "1.jsonl",
    ];
    assert_eq!(dir.monorig(&shard).0, Some(0));
}

/// A path that is no path of ours ends with words, however long it is, in every file and option that has paths.
#[test]
fn paths_have_an_end() {
    let dir = folder("attitude: {}");
    for parts in [120, 1000, 20_000, 60_000] {
        let path = vec!["a"; parts].join(".");
        let study =
            format!("version: 1\nwhy: a test\nscenario: quick.yaml\nruns: 2\nset: {{{path}: 1}}\n");
        dir.write("study.yaml", study.as_bytes());
        dir.refused(&["check", "study.yaml"]);
        dir.refused(&["run", "quick.yaml", "--set", &format!("{path}=1")]);
    }
}

/// Input without an end of a line is refused before it fills the memory.
#[test]
fn a_line_has_an_end() {
    let dir = folder("attitude: {}");
    for letter in ["x", " ", "0", "("] {
        dir.write("frames", letter.repeat(100_000).as_bytes());
        let mut ecu = Command::new(OURS);
        let from = std::fs::File::open(dir.path("frames")).unwrap();
        ecu.args(["ecu", "attitude", "--scenario", "quick.yaml"])
            .current_dir(dir.path(""));
        let done = ecu.stdin(from).output().unwrap();
        let told = words(&String::from_utf8(done.stderr).unwrap());
        assert_eq!(done.status.code(), Some(2), "{told}");
        assert!(told.contains("a line of more than 4096 bytes"), "{told}");
    }
}

/// A folder with a library of misdeeds in its scenario; none where there is no compiler.
fn misdeeds(defined: &str) -> Option<TestFolder> {
    let dir = folder("mine: {library: ./bad.so}");
    compile(&dir, "bad.so", "cli/tests/foreign.c", defined).then_some(dir)
}

/// A part has a limit of memory, and what it starts ends with it.
#[test]
#[cfg(target_os = "linux")] // limits, and processes in /proc
fn a_part_is_bounded() {
    let Some(dir) = misdeeds("ASKS_FOR_MEMORY AT_RUNNING") else {
        return;
    };
    let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun", "--seed", "1"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        words(&err).contains("bad.so ended its process: exit status: 4"),
        "{err}"
    );
    let Some(dir) = misdeeds("FORKS AT_BUILDING") else {
        return;
    };
    let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun", "--seed", "1"]);
    assert_ne!(code, Some(2), "{out}{err}");
    assert!(working(&dir).is_empty(), "{:?}", working(&dir));
    let sh = folder(&format!(
        "ecu: {{external: {{process: [sh, -c, \"sleep 1000 & exec {OURS} ecu attitude --scenario plain.yaml\"]}}}}"
    ));
    sh.write(
        "plain.yaml",
        dir.read("quick.yaml")
            .replace("mine: {library: ./bad.so}", "attitude: {}")
            .as_bytes(),
    );
    let (code, out, err) = sh.monorig(&["run", "quick.yaml", "--no-rerun", "--seed", "1"]);
    assert_ne!(code, Some(2), "{out}{err}");
    assert!(working(&sh).is_empty(), "{:?}", working(&sh));
}

/// Processes that work in the folder after a moment.
#[cfg(target_os = "linux")]
fn working(dir: &TestFolder) -> Vec<std::path::PathBuf> {
    let folder = dir.path("").canonicalize().unwrap();
    let here = || {
        let all = std::fs::read_dir("/proc")
            .unwrap()
            .flatten()
            .map(|e| e.path());
        let at =
            |p: &std::path::PathBuf| std::fs::read_link(p.join("cwd")).is_ok_and(|at| at == folder);
        all.filter(at).collect::<Vec<_>>()
    };
    let until = Instant::now() + Duration::from_secs(5);
    while !here().is_empty() && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(50));
    }
    here()
}

/// Ctrl-C ends a run whose part needs 0.4 s a step long before its end, some thousand steps later.
#[test]
fn a_slow_part_does_not_hold_the_program() {
    let Some(dir) = misdeeds("SLOW AT_EACH_STEP").filter(|_| tools(&["kill"])) else {
        return;
    };
    for signal in ["INT", "TERM"] {
        let mut command = Command::new(OURS);
        command
            .args(["run", "quick.yaml", "--no-rerun"])
            .current_dir(dir.path(""));
        let mut run = command
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_secs(2));
        let sent = Command::new("kill")
            .args(["-s", signal, &run.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let until = Instant::now() + Duration::from_secs(60);
        while run.try_wait().unwrap().is_none() {
            assert!(Instant::now() < until, "it goes on after {signal}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

/// Names of what an estimator shows are those of columns.
#[test]
fn what_an_estimator_shows_has_a_name() {
    for (names, good) in [
        (r#""speed","force""#, true),
        (r#""a/b""#, false),
        (r#""a\\b""#, false),
        (r#""../../x""#, false),
        (r#""\033[2J""#, false),
        (r#""a","b","a""#, false),
        (r#""""#, false),
    ] {
        let Some(dir) = misdeeds(&format!("SHOWS={names}")) else {
            return;
        };
        let (code, out, err) = dir.monorig(&["run", "quick.yaml", "--no-rerun", "--seed", "1"]);
        assert_eq!(code != Some(2), good, "{names}: {out}{err}");
        assert!(
            good || words(&err).contains("one of its internal quantities is called"),
            "{err}"
        );
    }
}

/// Two runs that ask one estimator on UDP get what each gets alone.
#[test]
fn runs_that_ask_one_address_do_not_mix() {
    let dir = folder("attitude: {}");
    let port = std::net::UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let at = port.to_string();
    let mut ecu = Command::new(OURS);
    ecu.args([
        "ecu",
        "dffrls_aekf",
        "--scenario",
        "quick.yaml",
        "--udp",
        &at,
    ]);
    let ecu = ecu.current_dir(dir.path("")).stderr(Stdio::null()).spawn();
    let ecu = Ending(ecu.unwrap());
    let start = |out: &str, seed: &str| {
        let set = format!("estimators={{ecu: {{external: {{udp: \"{at}\"}}}}}}");
        let mut run = Command::new(OURS);
        run.args([
            "run",
            "quick.yaml",
            "--no-rerun",
            "--seed",
            seed,
            "--out",
            out,
            "--set",
            &set,
        ]);
        let run = run.args(["--name", "v"]).current_dir(dir.path(""));
        run.stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    for seed in ["1", "2"] {
        assert_ne!(start("alone", seed).wait().unwrap().code(), Some(2));
    }
    let mut both = ["1", "2"].map(|seed| start("together", seed));
    both.iter_mut()
        .for_each(|run| assert_ne!(run.wait().unwrap().code(), Some(2)));
    for seed in ["1", "2"] {
        let of = |out: &str| {
            std::fs::read(dir.path(&format!("{out}/quick@v/{seed}/channels.parquet"))).unwrap()
        };
        assert!(of("alone") == of("together"), "seed {seed}");
    }
    drop(ecu);
}

/// A process that ends with the test.
struct Ending(std::process::Child);

impl Drop for Ending {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A damaged recording of channels without its manifest is never called complete.
#[test]
fn a_file_alone_is_not_verified() {
    let dir = folder("attitude: {}");
    assert_eq!(
        dir.monorig(&["run", "quick.yaml", "--no-rerun", "--seed", "1"])
            .0,
        Some(0)
    );
    let (_, out, _) = dir.monorig(&["check", "runs/quick/1/channels.parquet"]);
    assert!(out.contains("complete"), "{out}");
    let good = std::fs::read(dir.path("runs/quick/1/channels.parquet")).unwrap();
    let mut random = Random::new(mutants::first_seed());
    for _ in 0..mutants::count(30) {
        let mut bytes = good.clone();
        let at = random.below(bytes.len());
        bytes[at] ^= 1 << random.below(8);
        dir.write("channels.parquet", &bytes);
        let (code, out, err) = dir.monorig(&["check", "channels.parquet"]);
        assert!(
            code == Some(2) || out.contains("not verified"),
            "byte {at}: {out}{err}"
        );
        assert!(!out.contains("complete"), "byte {at}: {out}");
    }
}

/// A check of a part of a log says so, and is not one of the log.
#[test]
fn a_check_of_a_trimmed_log_is_not_judged_whole() {
    let dir = TestFolder::new();
    let map = project().join("examples/car_drive/drive.map.yaml");
    let told = |more: &[&str]| {
        let task = ["log", "check", "--map", map.to_str().unwrap()];
        dir.monorig(&[&task[..], more].concat()).1
    };
    let part = "a part of the log only";
    assert!(told(&["--set", "trim={from_s: 1, until_s: 60}"]).contains(part));
    assert!(!told(&[]).contains(part));
}

/// A folder for results in a folder that is not there may be a slip of the pen: nothing is made.
#[test]
fn folders_on_the_way_to_results_are_not_made() {
    let dir = TestFolder::new();
    let (code, _, err) = dir.monorig(&["new", "courses", "--out", "typo/drawn"]);
    assert!(code == Some(2) && err.contains("no folder typo"), "{err}");
    assert!(!dir.path("typo").exists());
}
