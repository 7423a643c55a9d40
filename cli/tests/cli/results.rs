//! Results that a run leaves behind: whole ones, also when it is stopped from outside; nothing when the disk is full.

use crate::common::{TestFolder, project};
use monorig_testing::tools;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const BINARY: &str = env!("CARGO_BIN_EXE_monorig");
const RESULTS: [&str; 4] = [
    "channels.parquet",
    "manifest.json",
    "metrics.json",
    "run.rrd",
];

/// Bytes below a folder.
fn bytes(folder: &std::path::Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let sizes = entries.map(|e| match e.metadata() {
        Ok(m) if m.is_dir() => bytes(&e.path()),
        Ok(m) => m.len(),
        Err(_) => 0, // gone in between
    });
    sizes.sum()
}

fn scenario(name: &str) -> String {
    project().join("scenarios").join(name).display().to_string()
}

/// Start the winding scenario, slowed down by a small step, and send it a signal when it has written a megabyte.
fn stopped_by(signal: &str) -> (TestFolder, std::process::Output) {
    let dir = TestFolder::new();
    let mut child = Command::new(BINARY)
        .args([
            "run",
            &scenario("winding.yaml"),
            "--set",
            "physics.dt_ms=0.25",
            "--name",
            "fine",
        ])
        .current_dir(dir.path(""))
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while bytes(&dir.path("runs")) < 1_000_000 {
        assert!(
            child.try_wait().unwrap().is_none(),
            "it ended before it could be stopped"
        );
        assert!(
            started.elapsed() < Duration::from_secs(60),
            "it writes nothing"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
    (dir, child.wait_with_output().unwrap())
}

#[test]
fn a_run_stopped_from_outside_leaves_whole_results_that_say_so() {
    if !tools(&["kill"]) {
        return;
    }
    for signal in ["-INT", "-TERM"] {
        let (dir, output) = stopped_by(signal);
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{signal}: {told}");
        assert!(
            told.contains("interrupted") && !told.contains("panicked"),
            "{told}"
        );

        let folder = dir.path("runs/winding@fine/1");
        let mut names: Vec<String> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, RESULTS, "{signal}");
        let files = RESULTS.map(|name| format!("runs/winding@fine/1/{name}"));
        let mut arguments = vec!["check"];
        arguments.extend(files.iter().map(String::as_str));
        let (code, out, err) = dir.monorig(&arguments);
        assert_eq!(code, Some(0), "{signal}: {err}");
        let line = |name: &str| out.lines().find(|l| l.contains(name)).unwrap().to_owned();
        assert!(line("run.rrd").ends_with("complete)"), "{out}");
        assert!(line("channels.parquet").ends_with("complete)"), "{out}");
        assert!(line("metrics.json").contains("NOT finished"), "{out}");
        assert!(
            dir.read("runs/winding@fine/1/metrics.json")
                .contains("\"finished\": false")
        );
        // what was recorded reaches to where it was stopped: some, not all of the 300 s at 50 Hz
        let words: Vec<String> = line("channels.parquet")
            .split(", ")
            .map(str::to_owned)
            .collect();
        let rows = words
            .iter()
            .find_map(|w| w.strip_suffix(" rows")?.parse::<usize>().ok());
        assert!(rows.is_some_and(|n| (100..14_900).contains(&n)), "{out}");
    }
}

/// A torn, empty or foreign result is refused by `check`.
#[test]
fn results_that_are_not_whole_are_refused() {
    let dir = TestFolder::new();
    let minimal = scenario("minimal.yaml");
    let short = [
        "run",
        &minimal,
        "--set",
        "stop.after_s=6",
        "--name",
        "short",
    ];
    let (code, _, err) = dir.monorig(&short);
    assert_eq!(code, Some(0), "{err}");
    for name in RESULTS {
        let file = format!("runs/minimal@short/1/{name}");
        let (code, out, err) = dir.monorig(&["check", &file]);
        assert_eq!(code, Some(0), "{out}{err}");
        let whole = std::fs::read(dir.path(&file)).unwrap();
        let half = &whole[..whole.len() / 2];
        for (what, bytes) in [
            ("torn", half),
            ("empty", b""),
            ("foreign", b"colour: red\n"),
        ] {
            dir.write(&file, bytes);
            let told = dir.refused(&["check", &file]);
            assert!(told.contains(&file), "{name} {what}: {told}");
            assert!(told.contains("help:"), "{name} {what}: {told}");
        }
        dir.write(&file, &whole);
        let folder = file.rsplit_once('/').unwrap().0;
        for missing in [format!("{folder}/no-{name}"), format!("nowhere/{name}")] {
            assert!(
                dir.refused(&["check", &missing]).contains("does not exist"),
                "{missing}"
            );
        }
    }
}

/// Ways to run with little room for results, as shell scripts: a small disk of its own if the system lets us, and a
/// limit on the size of files.
const NO_ROOM: [(&str, &str, &str); 2] = [
    (
        "small disk",
        "unshare -m sh -c",
        "mkdir runs && mount -t tmpfs -o size=ROOMk tmpfs runs || exit 77",
    ),
    (
        "file size limit",
        "sh -c",
        "mkdir runs; trap '' XFSZ; ulimit -f $((ROOM * 2)) || exit 77",
    ),
];

#[test]
fn a_full_disk_is_told_and_nothing_half_written_stays() {
    let mut tried = Vec::new();
    for (way, shell, before) in NO_ROOM {
        if !tools(&[shell.split(' ').next().unwrap(), "sh", "find"]) {
            continue;
        }
        // full at once, in the manifest; while the scene is written; in the middle of the run
        for room_kb in [4, 64, 3000] {
            let dir = TestFolder::new();
            let before = before.replace("ROOM", &room_kb.to_string());
            let script =
                format!("{before}; \"$0\" run \"$1\"; echo code $?; find runs -mindepth 1");
            let mut words = shell.split(' ');
            let mut command = Command::new(words.next().unwrap());
            command
                .args(words)
                .args([&script, BINARY, &scenario("winding.yaml")]);
            let (code, out, err) = dir.output(command.stdout(Stdio::piped()));
            if code != Some(0) {
                eprintln!("{way} is not possible here: {out}{err}");
                break;
            }
            assert_eq!(out, "code 2\n", "{way}, {room_kb} kB: {err}");
            assert!(
                err.contains("help: make room") && !err.contains("panicked"),
                "{way}: {err}"
            );
            tried.push(way);
        }
    }
    if tried.is_empty() {
        eprintln!("skipped: neither a small disk nor a limit on files can be had here");
    }
}
