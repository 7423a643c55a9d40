//! Libraries that crash, end the process, hang and print: what they cost is their own run.

use crate::common;
use crate::common::{TestFolder, compile, two_state, words};
use monorig_testing::tools;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A folder with a library of misdeeds and a scenario of two seconds with it. None where there is no compiler.
fn folder(defined: &str) -> Option<TestFolder> {
    let dir = TestFolder::new();
    let scenario = |library: &str| {
        format!(
            "\
version: 1
why: A library in a run.
track: track.yaml
train: train.yaml
start: {{chainage_m: 2}}
stop: {{after_s: 2}}
physics: {{plant: point-mass}}
drive: {{speed: [{{at_s: 0, mps: 0}}, {{at_s: 1, mps: 0.5}}]}}
sensors: sensors.yaml
estimators: {{mine: {{library: ./{library}}}, other: {{library: ./good.so}}}}
seeds: 1..8
integrity: {{max_misleading_share: 1}}
expect: [{{metric: speed_rmse_mps, at_most: 1}}]
"
        )
    };
    dir.write("bad.yaml", scenario("bad.so").as_bytes());
    dir.write("good.yaml", scenario("good.so").as_bytes());
    let source = "cli/tests/foreign.c";
    let compiled = compile(&dir, "bad.so", source, defined) && compile(&dir, "good.so", source, "");
    compiled.then_some(dir)
}

/// Processes that work in the folder.
fn processes(dir: &TestFolder) -> Vec<u32> {
    let folder = dir.path("").canonicalize().unwrap();
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = all.filter_map(|e| e.file_name().to_str()?.parse::<u32>().ok());
    let here =
        |id: &u32| std::fs::read_link(format!("/proc/{id}/cwd")).is_ok_and(|at| at == folder);
    ids.filter(here).collect()
}

/// Waits until no process works in the folder.
#[track_caller]
fn nothing_is_left(dir: &TestFolder) {
    let until = Instant::now() + Duration::from_secs(5);
    while !processes(dir).is_empty() {
        assert!(Instant::now() < until, "{:?}", processes(dir));
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The run fails and says which library, estimator, seed and signal; the run after it is made.
#[test]
fn a_crash_costs_one_run() {
    for (defined, how) in [
        ("SEGFAULT AT_RUNNING", "bad.so crashed: signal 11 (SIGSEGV)"),
        ("ABORTS AT_RUNNING", "bad.so crashed: signal 6 (SIGABRT)"),
        (
            "EXITS AT_RUNNING",
            "bad.so ended its process: exit status: 3",
        ),
    ] {
        let Some(dir) = folder(defined) else { return };
        let task = ["run", "bad.yaml", "good.yaml", "--no-rerun", "--seed", "7"];
        let (code, out, err) = dir.monorig(&task);
        assert_eq!(code, Some(1), "{out}{err}");
        let err = words(&err);
        let told = "the estimator mine broke down at t = 1.";
        for part in [told, ", seed 7: ", how] {
            assert!(err.contains(part), "{part} is not in {err}");
        }
        let last = out.lines().last().unwrap();
        assert_eq!(last, "FAILED: 1 of 2 runs: bad seed 7", "{out}");
        assert!(dir.path("runs/good/7/metrics.json").exists());
        assert!(!dir.path("runs/bad/7").exists(), "half a run");
        nothing_is_left(&dir);
    }
}

/// In tests, comparisons and studies a crash is the result of its run, whatever the number of threads.
#[test]
fn the_other_runs_go_on() {
    let Some(dir) = folder("SEGFAULT WITH_SOME_SEEDS") else {
        return;
    };
    let task = [
        "test",
        "bad.yaml",
        "good.yaml",
        "--json",
        "tested.json",
        "--keep-failed",
        "kept",
    ];
    let (code, out, err) = dir.monorig(&task);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(words(&out).contains("bad.so crashed: signal 11"), "{out}");
    let json: Value = serde_json::from_str(&dir.read("tested.json")).unwrap();
    let runs = json.pointer("/scenarios/0/runs").and_then(Value::as_array);
    let runs = runs.unwrap_or_else(|| panic!("{json}"));
    let crashed = runs.iter().filter(|run| run.get("error").is_some()).count();
    assert!(
        runs.len() == 8 && (1..8).contains(&crashed),
        "{crashed} of {}",
        runs.len()
    );

    let (code, out, err) = dir.monorig(&["compare", "bad.yaml", "--estimators", "mine,other"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        words(&format!("{out}{err}")).contains("bad.so crashed"),
        "{out}{err}"
    );

    let study = "version: 1\nwhy: A spread.\nscenario: bad.yaml\nruns: 8\nvary: [{path: load.mass_kg, uniform: [0, 2500]}]\n";
    dir.write("study.yaml", study.as_bytes());
    let results = ["1", "2"].map(|jobs| {
        let (code, out, err) = dir.monorig(&["study", "study.yaml", "--jobs", jobs, "--out", jobs]);
        assert_eq!(code, Some(1), "{out}{err}");
        dir.read(&format!("{jobs}/study/results.jsonl"))
    });
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0].lines().count(), 9);
    assert!(results[0].contains("signal 11"), "{}", results[0]);
    nothing_is_left(&dir);
}

/// Before a run is begun, a crash is a mistake of the input: the line that names the library.
#[test]
fn a_library_that_cannot_be_loaded_or_built_is_refused() {
    for (defined, during) in [
        (
            "SEGFAULT AT_LOADING",
            "crashed: signal 11 (SIGSEGV) while it is loaded",
        ),
        (
            "EXITS AT_LOADING",
            "ended its process: exit status: 3 while it is loaded",
        ),
        (
            "ABORTS AT_BUILDING",
            "crashed: signal 6 (SIGABRT) while it is built",
        ),
    ] {
        let Some(dir) = folder(defined) else { return };
        for task in [
            &["check", "bad.yaml", "--allow-foreign"][..],
            &["run", "bad.yaml"],
        ] {
            let told = words(&dir.refused(task));
            for part in ["bad.yaml:10:", during, "--in-process"] {
                assert!(told.contains(part), "{part} is not in {told}");
            }
        }
        nothing_is_left(&dir);
    }
}

/// A step without an end ends after its time, or at the second Ctrl-C; and with the program, however that ends.
#[test]
#[cfg(target_os = "linux")] // finds processes in /proc
fn an_endless_loop_ends() {
    let Some(dir) = folder("LOOPS AT_RUNNING").filter(|_| tools(&["kill"])) else {
        return;
    };
    let (code, out, err) = dir.monorig(&["run", "bad.yaml", "--no-rerun"]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(
        words(&err).contains("seed 1: bad.so gives no answer within 10 s"),
        "{err}"
    );
    nothing_is_left(&dir);
    for (signal, times, expected) in [("INT", 2, Some(130)), ("KILL", 1, None)] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        command
            .args(["run", "bad.yaml", "--no-rerun"])
            .current_dir(dir.path(""));
        let mut run = command
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // the loop has begun when the library's process has used a tenth of a second of its processor
        let until = Instant::now() + Duration::from_secs(8);
        while !processes(&dir)
            .iter()
            .any(|id| *id != run.id() && busy(*id))
        {
            assert!(Instant::now() < until, "the loop does not begin");
            std::thread::sleep(Duration::from_millis(50));
        }
        for _ in 0..times {
            let id = run.id().to_string();
            let sent = Command::new("kill")
                .args(["-s", signal, &id])
                .status()
                .unwrap();
            assert!(sent.success());
            std::thread::sleep(Duration::from_millis(200));
        }
        assert_eq!(run.wait().unwrap().code(), expected);
        nothing_is_left(&dir);
    }
}

/// An FMU is unpacked for a process, and removed with it, whether that crashes or the program is killed.
#[test]
#[cfg(target_os = "linux")] // finds processes in /proc
fn nothing_that_was_unpacked_is_left() {
    for (defined, killed) in [("SEGFAULT AT_RUNNING", false), ("LOOPS AT_RUNNING", true)] {
        let Some(dir) = folder(defined) else { return };
        let name = ["fmu", "estimator", "bad", "--library", "bad.so"];
        let (code, out, err) =
            dir.monorig(&[&name[..], &["--scenario", "good.yaml", "--out", "bad.fmu"]].concat());
        assert_eq!(code, Some(0), "{out}{err}");
        let text = dir
            .read("bad.yaml")
            .replace("library: ./bad.so", "fmu: ./bad.fmu");
        dir.write("bad.yaml", text.as_bytes());
        std::fs::create_dir(dir.path("unpacked")).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        command.args(["run", "bad.yaml", "--no-rerun"]);
        command
            .current_dir(dir.path(""))
            .env("TMPDIR", dir.path("unpacked"));
        let run = command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut run = run.spawn().unwrap();
        let there = || std::fs::read_dir(dir.path("unpacked")).unwrap().count();
        let until = Instant::now() + Duration::from_secs(8);
        let looping = || {
            processes(&dir)
                .iter()
                .any(|id| *id != run.id() && busy(*id))
        };
        while killed && !looping() {
            assert!(Instant::now() < until, "the loop does not begin");
            std::thread::sleep(Duration::from_millis(50));
        }
        if killed {
            assert!(there() > 0);
            run.kill().unwrap();
        }
        assert_eq!(run.wait().unwrap().code(), (!killed).then_some(1));
        nothing_is_left(&dir);
        assert_eq!(there(), 0, "{defined}");
    }
}

/// The program of a wheel has no library for FMUs beside it: what to do is said, and nothing is written.
#[test]
fn a_program_alone_makes_no_fmu_and_says_so() {
    let Some(dir) = folder("") else { return };
    std::fs::create_dir(dir.path("bin")).unwrap();
    std::fs::copy(env!("CARGO_BIN_EXE_monorig"), dir.path("bin/monorig")).unwrap();
    let task = ["fmu", "plant", "good.yaml", "--out", "plant.fmu"];
    let mut alone = Command::new(dir.path("bin/monorig"));
    let (code, out, err) = dir.output(alone.args(task).stdout(Stdio::piped()));
    assert_eq!(code, Some(2), "{out}{err}");
    for part in [
        "monorig_fmu",
        "is not in the folder of the program",
        "archive and wheel of a release",
    ] {
        assert!(words(&err).contains(part), "{part} is not in {err}");
    }
    assert!(!dir.path("plant.fmu").exists());
}

/// True of a process that has used a tenth of a second of its processor in its own code.
fn busy(id: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after
        .split_whitespace()
        .nth(11)
        .and_then(|t| t.parse::<u64>().ok());
    ticks.is_some_and(|ticks| ticks >= 10)
}

/// Standard output is that of the program; a crash at the end of an instance does not touch its results.
#[test]
fn what_a_library_prints_is_no_result() {
    let Some(dir) = folder("PRINTS SEGFAULT AT_THE_END") else {
        return;
    };
    let (code, out, err) = dir.monorig(&["run", "bad.yaml", "--no-rerun", "--json", "-"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(serde_json::from_str::<Value>(&out).is_ok(), "{out}");
    assert!(err.contains("step at 1."), "{err}");
    nothing_is_left(&dir);
}

/// Recorded channels, metrics and estimates of a run are the same bytes in the program and in a process of its own.
#[test]
fn a_run_is_the_same_inside_of_the_program() {
    let dir = TestFolder::new();
    if !two_state(&dir) {
        return;
    }
    let text = common::climb_in_c().replace("after_s: 100", "after_s: 40");
    // with static variables in it, a library can have two instances in processes of their own
    let two = "  other: {library: ./two_state.so}\nin_loop:";
    dir.write("climb.yaml", text.replace("in_loop:", two).as_bytes());
    let run = |out: &str, more: &[&str]| {
        let task = ["run", "climb.yaml", "--no-rerun", "--out", out];
        let (code, told, err) = dir.monorig(&[&task, more].concat());
        assert!(matches!(code, Some(0 | 1)), "{told}{err}");
        let read = |name: &str| std::fs::read(dir.path(out).join("climb/1").join(name)).unwrap();
        (code, ["channels.parquet", "metrics.json"].map(read))
    };
    let (apart, within) = (run("apart", &[]), run("within", &["--in-process"]));
    assert!(apart == within);
    let columns = common::columns(&dir.path("apart/climb/1"));
    let mass = columns
        .iter()
        .find(|(name, _)| name.contains("mine") && name.contains("mass"));
    assert!(mass.is_some_and(|(_, values)| values.iter().any(|v| v.is_finite())));
    assert!(
        columns.keys().any(|name| name.contains("mass_variance")),
        "internals"
    );
}

/// Two hundred runs take the memory, the files and the processes of one.
#[test]
#[cfg(target_os = "linux")]
fn two_hundred_runs_take_the_memory_of_one() {
    many_runs_take_the_memory_of_one(200);
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "a soak, which .ci/run makes"]
fn soak_two_thousand_runs_take_the_memory_of_one() {
    many_runs_take_the_memory_of_one(2000);
}

#[cfg(target_os = "linux")]
fn many_runs_take_the_memory_of_one(runs: usize) {
    use monorig_sim::closed_loop::registry::Registry;
    use monorig_sim::closed_loop::{Simulation, run};
    use monorig_sim::config::scenario::Scenario;
    let Some(dir) = folder("") else { return };
    let program = vec![env!("CARGO_BIN_EXE_monorig").into(), "serve-part".into()];
    let registry = monorig_plugin::guards_libraries(Registry::default(), program);
    let changes = [("stop.after_s".to_owned(), "0.05".to_owned())];
    let scenario = Scenario::load(&dir.path("good.yaml"), &changes).unwrap();
    let once = || {
        let mut simulation = Simulation::build(scenario.clone(), &registry, 1).unwrap();
        let outcome = run::run(&mut simulation, &mut [], &mut |_| true).unwrap();
        assert!(outcome.refusals.is_empty() && outcome.finished);
    };
    let resident = |id: &str| {
        let status = std::fs::read_to_string(Path::new("/proc").join(id).join("statm"));
        let pages = status.unwrap().split(' ').nth(1).unwrap().parse::<u64>();
        pages.unwrap() * 4096
    };
    let children = || {
        // the kernel lists those of each thread
        let tasks = std::fs::read_dir("/proc/self/task").unwrap().flatten();
        let lists = tasks.filter_map(|t| std::fs::read_to_string(t.path().join("children")).ok());
        let mut all: Vec<String> = Vec::new();
        lists.for_each(|list| all.extend(list.split_whitespace().map(str::to_owned)));
        // other tests of this program start processes, too
        let command = |id: &String| std::fs::read_to_string(format!("/proc/{id}/cmdline"));
        all.retain(|id| command(id).is_ok_and(|line| line.contains("serve-part")));
        all
    };
    let files = || std::fs::read_dir("/proc/self/fd").unwrap().count();
    (0..100).for_each(|_| once());
    let child = children().pop().unwrap();
    let before = (resident("self"), resident(&child), files());
    (0..runs).for_each(|_| once());
    assert!(
        children().contains(&child),
        "the same process serves all of them"
    );
    let after = (resident("self"), resident(&child), files());
    let more = |a: u64, b: u64| b.saturating_sub(a);
    assert!(more(before.0, after.0) < 16 << 20, "{before:?} {after:?}");
    assert!(more(before.1, after.1) < 4 << 20, "{before:?} {after:?}");
    // other tests of this program open files at the same time
    assert!(after.2 < before.2 + 50, "{before:?} {after:?}");
}
