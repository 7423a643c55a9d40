//! Files and names that would do harm: refused at once, with what would be right.

use crate::common::{GOOD, TestFolder};
use monorig_testing::tools;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Refused within 5 s and with so little address space, kB.
fn refused(dir: &TestFolder, memory_kb: u64, arguments: &[&str]) -> String {
    let begun = Instant::now();
    let limits = format!("ulimit -v {memory_kb}; ulimit -t 5; exec \"$0\" \"$@\"");
    let mut command = Command::new("bash");
    command
        .args(["-c", &limits, env!("CARGO_BIN_EXE_monorig")])
        .args(arguments);
    let (code, out, err) = dir.output(command.stdout(Stdio::piped()));
    assert_eq!(code, Some(2), "{arguments:?}: {out}{err}");
    assert!(!err.contains("panicked"), "{err}");
    assert!(
        begun.elapsed().as_secs() < 20,
        "{arguments:?} took {:?}",
        begun.elapsed()
    );
    err
}

#[test]
fn what_is_far_too_much_is_refused_with_the_limit() {
    if !tools(&["bash"]) {
        return;
    }
    let dir = TestFolder::new();
    let obstacle = "  - {at_m: 50, left_m: 2, up_m: -1, size_m: [1, 1, 1]}\n";
    let before = GOOD.split_once("obstacles:").unwrap().0;
    let many = |n: usize| format!("{before}obstacles:\n{}", obstacle.repeat(n));
    let aliases = format!(
        "why: &a {}\nb:\n{}",
        "x".repeat(10 << 20),
        "  - *a\n".repeat(2000)
    );
    for (name, text, limit) in [
        ("brackets.yaml", "[".repeat(100_000), "at most 20000"),
        ("dashes.yaml", "- ".repeat(100_000), "at most 64 levels"),
        ("list.yaml", "- 1\n".repeat(15 << 20), "at most 16 MB"),
        (
            "values.yaml",
            "- 1\n".repeat(3 << 20),
            "at most 200000 values",
        ),
        ("aliases.yaml", aliases, "32 MB of text"),
        ("obstacles.yaml", many(2000), "at most 1000"),
        ("many.yaml", many(100_000), "at most"),
    ] {
        dir.write(name, text.as_bytes());
        let told = refused(&dir, 1_000_000, &["check", "--kind", "scenario", name]);
        assert!(told.contains(limit), "{name}: {told}");
    }
    let urdf = dir.read("units/drive_unit.urdf");
    let spaces: String = (0..300_000).map(|i| format!(" xmlns:a{i}=\"b\"")).collect();
    for (inside, limit) in [
        (
            urdf.replacen("<robot", &format!("<robot{spaces}"), 1),
            "at most 1024 kB",
        ),
        (
            urdf.replacen("<robot", &format!("<robot{}", &spaces[..3000]), 1),
            "16 attributes",
        ),
        (
            format!("<!DOCTYPE a [<!ENTITY b \"c\">]>{urdf}"),
            "entities are not read",
        ),
        ("<a>".repeat(1000), "50 deep"),
    ] {
        dir.write("units/drive_unit.urdf", inside.as_bytes());
        let told = refused(&dir, 1_000_000, &["check", "units/drive_unit.yaml"]);
        assert!(told.contains(limit), "{told}");
    }
}

/// A pipe would be waited for, and a device has no end.
#[test]
fn pipes_and_devices_are_no_files() {
    if !tools(&["bash", "mkfifo"]) {
        return;
    }
    let dir = TestFolder::new();
    let made = Command::new("mkfifo")
        .arg(dir.path("pipe"))
        .status()
        .unwrap();
    assert!(made.success());
    for name in ["pipe", "/dev/zero"] {
        for arguments in [
            &["merge", name, "--into", "all.jsonl"][..],
            &["report", name],
            &["check", "--kind", "track", name],
            &["sensors", "fit", name],
        ] {
            let told = refused(&dir, 1_000_000, arguments);
            assert!(told.contains("not a regular file"), "{arguments:?}: {told}");
        }
        std::fs::create_dir_all(dir.path("alone")).unwrap();
        for result in [
            "run.rrd",
            "channels.parquet",
            "metrics.json",
            "manifest.json",
        ] {
            let link = format!("alone/{result}");
            let _ = std::fs::remove_file(dir.path(&link));
            let to = if name == "pipe" {
                dir.path("pipe")
            } else {
                name.into()
            };
            std::os::unix::fs::symlink(to, dir.path(&link)).unwrap();
            refused(&dir, 1_000_000, &["check", &link]);
        }
    }
}

/// Colours, a cleared screen, text from right to left: none of it comes from a file.
#[test]
fn control_characters_of_files_do_not_reach_the_terminal() {
    let dir = TestFolder::new();
    let bad = "\u{1b}[2J\u{202e}\u{9b}31m";
    dir.write(
        "bad.yaml",
        format!("{GOOD}\"{bad}\": 1 # {bad}\n").as_bytes(),
    );
    let name = "bad\u{1b}[31m.yaml";
    dir.write(name, GOOD.as_bytes());
    dir.write(
        "run.yaml",
        GOOD.replace("A sample.", "\"\\e[2J\"").as_bytes(),
    );
    for arguments in [
        &["check", "bad.yaml"][..],
        &["check", name],
        &["check", "--kind", "scenario", "no\u{1b}such.yaml"],
        &[
            "run",
            name,
            "--set",
            "stop.after_s=1",
            "--set",
            "colour\u{1b}=1",
        ],
    ] {
        let (_, out, err) = dir.monorig(arguments);
        let told = format!("{out}{err}");
        let hidden: Vec<char> = told
            .chars()
            .filter(|c| c.is_control() && *c != '\n' && *c != '\t')
            .collect();
        assert_eq!(hidden, ['\0'; 0], "{told:?}");
        assert!(!told.contains('\u{202e}'), "{told:?}");
    }
}

/// A page loads nothing, runs nothing, and links nowhere but to files and the web.
#[test]
fn a_report_can_do_nothing() {
    let dir = TestFolder::new();
    let text = "why: <script>alert(1)</script>\u{202e}";
    let scenario = GOOD
        .replace("why: A sample.", text)
        .replace("after_s: 60", "after_s: 45");
    dir.write(
        "javascript:x.yaml",
        scenario.replace("rapier", "point-mass").as_bytes(),
    );
    let (code, out, err) = dir.monorig(&["run", "javascript:x.yaml", "--out", "."]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let (code, _, err) = dir.monorig(&["report", "javascript:x/1", "--out", "page.html"]);
    assert_eq!(code, Some(0), "{err}");
    let page = dir.read("page.html");
    assert!(page.contains("Content-Security-Policy") && page.contains("default-src 'none'"));
    assert!(!page.contains("<script") && !page.contains('\u{202e}'));
    assert!(page.contains("href=\"./javascript:x/1/") && !page.contains("href=\"javascript:"));
}

/// Whatever a file is called, its results stay in the folder of results.
#[test]
fn names_do_not_lead_out_of_the_folder_of_results() {
    let dir = TestFolder::new();
    let short = GOOD
        .replace("after_s: 60", "after_s: 45")
        .replace("rapier", "point-mass");
    dir.write("...yaml", short.as_bytes());
    dir.refused(&["run", "...yaml", "--out", "results"]);
}

/// `--json` and `--junit` write files, and nothing through a link or into a device.
#[test]
fn reports_go_into_files_only() {
    let dir = TestFolder::new();
    let short = GOOD
        .replace("after_s: 60", "after_s: 45")
        .replace("rapier", "point-mass");
    dir.write("quick.yaml", short.as_bytes());
    dir.write("precious", b"precious");
    std::os::unix::fs::symlink(dir.path("precious"), dir.path("link")).unwrap();
    for to in ["link", "/dev/null"] {
        for option in ["--json", "--junit"] {
            let told = dir.refused(&["test", "quick.yaml", "--seeds", "1", option, to]);
            assert!(told.contains(to), "{told}");
        }
    }
    assert_eq!(dir.read("precious"), "precious");
    assert!(std::path::Path::new("/dev/null").exists());
}

/// Scenarios below the folder named, and such with a capital ending, are tested; other files are named as left out.
#[test]
fn a_folder_is_tested_with_all_below_it() {
    let dir = TestFolder::new();
    let quick = |name: &str| {
        let head = GOOD
            .split_once("events:")
            .unwrap()
            .0
            .replace("after_s: 60", "after_s: 6");
        let up = "../".repeat(name.matches('/').count());
        let text = head.replace("rapier", "point-mass");
        let text = ["track", "train", "sensors"]
            .iter()
            .fold(text, |text, file| {
                text.replace(&format!("{file}: {file}"), &format!("{file}: {up}{file}"))
            });
        dir.write(name, text.as_bytes());
    };
    std::fs::create_dir_all(dir.path("all/below")).unwrap();
    for name in ["all/one.yaml", "all/TWO.YAML", "all/below/three.yml"] {
        quick(name);
    }
    dir.write("all/below/track.yaml", dir.read("track.yaml").as_bytes());
    let (code, out, err) = dir.monorig(&["test", "all", "--seeds", "1"]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    assert!(out.contains("3 scenarios, 3 runs"), "{out}{err}");
    assert!(
        err.contains("left out: all/below/track.yaml (track)"),
        "{err}"
    );
}

/// A share so small that it rounds to no seed still asks for one.
#[test]
fn a_quantile_can_always_fail() {
    let dir = TestFolder::new();
    let head = GOOD
        .split_once("events:")
        .unwrap()
        .0
        .replace("after_s: 60", "after_s: 6");
    let expect = "expect: [{metric: speed_rmse_mps, at_most: 1.0e-9, quantile: 1.0e-10}]\n";
    dir.write(
        "quick.yaml",
        format!("{}{expect}", head.replace("rapier", "point-mass")).as_bytes(),
    );
    let (code, out, err) = dir.monorig(&["test", "quick.yaml", "--seeds", "1..3"]);
    assert_eq!(code, Some(1), "{out}{err}");
}

/// An error in a change of a study names the study's file, not a `--set` that nobody typed.
#[test]
fn errors_of_a_study_name_the_study() {
    let dir = TestFolder::new();
    let study = "version: 1\nwhy: A spread.\nscenario: scenario.yaml\nruns: 3\nvary:\n  - {path: load.mass_kg, uniform: [-9, -8]}\n";
    dir.write("spread.yaml", study.as_bytes());
    let told = dir.refused(&["study", "spread.yaml"]);
    assert!(
        !told.contains("--set") && told.contains("by spread.yaml"),
        "{told}"
    );
}

/// Threads that the system does not make: the work is done all the same, and it is told.
#[test]
fn without_threads_it_is_slower_and_the_same() {
    let dir = TestFolder::new();
    let head = GOOD
        .split_once("events:")
        .unwrap()
        .0
        .replace("after_s: 60", "after_s: 6");
    dir.write(
        "quick.yaml",
        head.replace("rapier", "point-mass").as_bytes(),
    );
    let test = |stack: Option<&str>, json: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        command.args([
            "test",
            "quick.yaml",
            "--seeds",
            "1..4",
            "--jobs",
            "3",
            "--json",
            json,
        ]);
        if let Some(bytes) = stack {
            command.env("RUST_MIN_STACK", bytes); // more than there is address space
        }
        dir.output(command.stdout(Stdio::piped()))
    };
    let (code, _, err) = test(None, "a.json");
    assert!(matches!(code, Some(0 | 1)), "{err}");
    let (starved, _, err) = test(Some("140737488355328"), "b.json");
    assert_eq!(starved, code, "{err}");
    assert!(
        err.contains("did not make 3 of the threads") && !err.contains("panicked"),
        "{err}"
    );
    assert_eq!(dir.read("a.json"), dir.read("b.json"));
}
