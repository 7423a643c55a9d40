//! Every reader, given files that are almost right: an error or a result, never a panic, an abort, or seconds of waiting.
//!
//! A bounded mutator, a few files of each kind in the normal suite; by hand as many as one likes:
//! `MONORIG_MUTANTS=10000 cargo test --release --test mutants`. `MONORIG_MUTANT_SEED` gives others.

#![allow(clippy::unwrap_used)]

mod common;

use common::TestFolder;
use std::process::{Command, Stdio};

/// Mutants of each kind in the normal suite.
const FEW: u64 = 150;
/// Files handed to a process at once.
const BATCH: u64 = 50;
/// Address space of a process, kB, and computing time, s.
const MEMORY_KB: u64 = 2_000_000;
const TIME_S: u64 = 5;

fn number_of(variable: &str, without: u64) -> u64 {
    let given = std::env::var(variable).ok();
    given.map_or(without, |text| text.parse().unwrap())
}

/// Random numbers (Steele, Lea and Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// What breaks readers: marks of their grammars, numbers at the ends of ranges, bytes that are no text.
const PIECES: &[&[u8]] = &[
    b"[",
    b"]",
    b"{",
    b"}",
    b": ",
    b"- ",
    b"\n",
    b"\t",
    b"'",
    b"\"",
    b"#",
    b"&a ",
    b"*a",
    b"!t ",
    b"|",
    b"---\n",
    b"? ",
    b"<",
    b">",
    b"/>",
    b"<!--",
    b"&lt;",
    b"<!DOCTYPE a>",
    b"=",
    b",",
    b"\0",
    b"\xff",
    b"\x1b[2J",
    b"\xe2\x80\xae",
    b"NaN",
    b".inf",
    b"-.inf",
    b"null",
    b"~",
    b"true",
    b"1e308",
    b"-1e308",
    b"1e-308",
    b"0",
    b"-0",
    b"-1",
    b"1e12",
    b"1e9",
    b"99999999999999999999999",
    b"4294967296",
    b"0x10",
    b"1..100000",
    b"[[[[[[[[",
    b"{a: {a: {a: ",
    b"../",
    b"/dev/zero",
    b".",
];

/// Numbers for numbers.
const NUMBERS: &[&str] = &[
    "0", "-0", "1", "-1", "1e-9", "1e9", "1e12", "-1e12", "1e13", "1e-300", "1e308", ".nan",
    ".inf", "65536", "100000", "0.1", "3.5", "1000000", "-7", "1e4",
];

/// A file with one to four things wrong in it.
fn mutant(good: &[u8], seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let mut bytes = good.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + 1 + random.below(40)).min(bytes.len());
        match random.below(9) {
            0 => flip(&mut bytes, &mut random),
            1 => drop(bytes.splice(at..end, [])),
            2 => {
                let piece = *random.of(PIECES);
                drop(bytes.splice(at..at, piece.iter().copied()));
            }
            3 => {
                let piece = *random.of(PIECES);
                drop(bytes.splice(at..end, piece.iter().copied()));
            }
            4 => {
                let again: Vec<u8> = bytes[at..end].repeat(1 + random.below(30));
                drop(bytes.splice(at..at, again));
            }
            5 | 6 => number(&mut bytes, &mut random),
            7 => lines(&mut bytes, &mut random),
            _ if random.below(4) == 0 => bytes.truncate(at),
            _ => {
                let word = random.next().to_le_bytes();
                let keep = 1 << random.below(4);
                for (byte, new) in bytes.iter_mut().skip(at).zip(word).take(keep) {
                    *byte = new;
                }
            }
        }
    }
    bytes
}

fn flip(bytes: &mut [u8], random: &mut Random) {
    let at = random.below(bytes.len());
    let bit = random.below(8);
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << bit;
    }
}

/// Another number in place of one.
fn number(bytes: &mut Vec<u8>, random: &mut Random) {
    let is_number = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
    let from = random.below(bytes.len() + 1);
    let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit) else {
        return;
    };
    let start = from + start;
    let length = bytes[start..].iter().take_while(|b| is_number(b)).count();
    let new = random.of(NUMBERS).bytes();
    drop(bytes.splice(start..start + length, new));
}

/// A line somewhere else, or twice.
fn lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
    if lines.is_empty() {
        return;
    }
    let (from, to) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(3) {
        0 => lines.insert(to, lines[from]),
        1 => lines.swap(from, to),
        _ => drop(lines.remove(from)),
    }
    *bytes = lines.concat();
}

/// Runs monorig with so little memory and time; the exit code, none if it was killed, and what it said.
fn bounded(dir: &TestFolder, arguments: &[String]) -> (Option<i32>, String) {
    let limits =
        format!("ulimit -v {MEMORY_KB}; ulimit -t {TIME_S}; ulimit -c 0; exec \"$0\" \"$@\"");
    let child = Command::new("bash")
        .args(["-c", &limits, env!("CARGO_BIN_EXE_monorig")])
        .args(arguments)
        .current_dir(dir.path(""))
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (
        child.status.code(),
        String::from_utf8_lossy(&child.stderr).into_owned(),
    )
}

/// Hands mutants of `good` to monorig: `place` puts one into the folder and says which file is to be named, `command` comes before
/// the names.
fn attack(
    kind: &str,
    dir: &TestFolder,
    good: &[u8],
    command: &[&str],
    one_at_a_time: bool,
    place: impl Fn(u64, &[u8]) -> String,
) {
    let all = number_of("MONORIG_MUTANTS", FEW);
    let first = number_of("MONORIG_MUTANT_SEED", 1) << 32;
    let command: Vec<String> = command.iter().map(|word| (*word).to_owned()).collect();
    let batch = if one_at_a_time { 1 } else { BATCH };
    for start in (0..all).step_by(batch as usize) {
        let seeds = start..(start + batch).min(all);
        let names: Vec<String> = seeds
            .map(|i| place(i % batch, &mutant(good, first + i)))
            .collect();
        let fine = |names: &[String]| {
            let (code, told) = bounded(dir, &[&command[..], names].concat());
            let fine = matches!(code, Some(0..=2)) && !told.contains("panicked");
            (fine, format!("{code:?} {told}"))
        };
        if fine(&names).0 {
            continue;
        }
        // which of them? Together they may only have taken too long
        for (i, name) in names.iter().enumerate() {
            let (fine, told) = fine(std::slice::from_ref(name));
            let seed = start + i as u64;
            assert!(
                fine,
                "{kind}, mutant {seed}: {}",
                told.chars().take(2000).collect::<String>()
            );
        }
    }
}

/// Files that stand for themselves.
#[test]
fn mutants_of_input_files() {
    let dir = TestFolder::new();
    let asset = |name: &str| std::fs::read(common::project().join("assets").join(name)).unwrap();
    dir.write("study.yaml", STUDY.as_bytes());
    dir.write("tuning.yaml", TUNING.as_bytes());
    for (kind, good, folder) in [
        ("scenario", dir.read("scenario.yaml").into_bytes(), ""),
        ("track", dir.read("track.yaml").into_bytes(), ""),
        ("train", dir.read("train.yaml").into_bytes(), ""),
        ("sensors", dir.read("sensors.yaml").into_bytes(), ""),
        ("study", STUDY.as_bytes().to_vec(), ""),
        ("tuning", TUNING.as_bytes().to_vec(), ""),
        ("unit", asset("units/drive_unit.yaml"), "units/"),
        ("car", asset("road/hongqi_ehs3.yaml"), "road/"),
        ("rail-profile", asset("rails/i140e.yaml"), "rails/"),
        ("parameters", asset("tuned/dffrls_aekf_robust.yaml"), ""),
    ] {
        let place = |i: u64, bytes: &[u8]| {
            let name = format!("{folder}mutant_{i}.yaml");
            dir.write(&name, bytes);
            name
        };
        attack(kind, &dir, &good, &["check", "--kind", kind], false, place);
    }
}

/// Files that another one names: that one is checked, and leads to the mutant.
#[test]
fn mutants_of_files_that_others_name() {
    let dir = TestFolder::new();
    let survey = dir.read("survey.csv");
    attack(
        "survey",
        &dir,
        survey.as_bytes(),
        &["check", "--kind", "track"],
        false,
        |i, bytes| {
            let (csv, track) = (format!("mutant_{i}.csv"), format!("surveyed_{i}.yaml"));
            dir.write(&csv, bytes);
            dir.write(
                &track,
                dir.read("surveyed.yaml")
                    .replace("survey.csv", &csv)
                    .as_bytes(),
            );
            track
        },
    );
    let urdf = dir.read("units/cab.urdf");
    let unit = |i: u64, urdf: &str| {
        let (name, unit) = (format!("mutant_{i}.urdf"), format!("units/mutant_{i}.yaml"));
        dir.write(&format!("units/{name}"), urdf.as_bytes());
        dir.write(
            &unit,
            dir.read("units/cab.yaml")
                .replace("cab.urdf", &name)
                .as_bytes(),
        );
        unit
    };
    attack(
        "urdf",
        &dir,
        urdf.as_bytes(),
        &["check", "--kind", "unit"],
        false,
        |i, bytes| {
            let made = unit(i, "");
            dir.write(&format!("units/mutant_{i}.urdf"), bytes);
            made
        },
    );
    let mesh = std::fs::read(dir.path("units/meshes/cab_shell.stl")).unwrap();
    assert!(urdf.contains("meshes/cab_shell.stl"));
    attack(
        "stl",
        &dir,
        &mesh,
        &["check", "--kind", "unit"],
        false,
        |i, bytes| {
            let name = format!("meshes/mutant_{i}.stl");
            dir.write(&format!("units/{name}"), bytes);
            unit(i, &urdf.replace("meshes/cab_shell.stl", &name))
        },
    );
}

/// What monorig itself has written.
#[test]
fn mutants_of_results() {
    let dir = TestFolder::new();
    let (head, _) = common::GOOD.split_once("events:").unwrap();
    let quick = head
        .replace("after_s: 60", "after_s: 2")
        .replace("rapier", "point-mass");
    dir.write("quick.yaml", quick.as_bytes());
    let (code, _, told) = dir.monorig(&["run", "quick.yaml"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    let run = "runs/quick/1";
    for name in [
        "channels.parquet",
        "run.rrd",
        "metrics.json",
        "manifest.json",
    ] {
        let Ok(good) = std::fs::read(dir.path(&format!("{run}/{name}"))) else {
            assert_eq!((name, cfg!(feature = "viewer")), ("run.rrd", false));
            continue;
        };
        std::fs::create_dir_all(dir.path("alone")).unwrap();
        attack(name, &dir, &good, &["check"], false, |i, bytes| {
            let name = format!("alone/{i}_{name}");
            dir.write(&name, bytes);
            name
        });
    }
    dir.write("study.yaml", STUDY.as_bytes());
    let (code, _, told) = dir.monorig(&["study", "study.yaml"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    let (code, _, told) = dir.monorig(&["test", "quick.yaml", "--json", "verdicts.json"]);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    for name in ["runs/study/results.jsonl", "verdicts.json"] {
        let good = std::fs::read(dir.path(name)).unwrap();
        let place = |_, bytes: &[u8]| {
            dir.write("alone/results.jsonl", bytes);
            "alone/results.jsonl".to_owned()
        };
        attack(name, &dir, &good, &["report"], true, place);
        attack(
            name,
            &dir,
            &good,
            &["merge", "--into", "alone/all"],
            true,
            place,
        );
    }
}

const STUDY: &str = "\
version: 1
why: A spread.
scenario: scenario.yaml
runs: 3
set: {stop.after_s: 2, expect: [], events: [], physics.plant: point-mass, obstacles: []}
vary:
  - {path: load.mass_kg, uniform: [0, 2500]}
  - {path: sensors.wheel_speed.errors.bias, normal: {mean: 0, sd: 0.01}}
  - {path: estimators.dffrls_aekf_robust, choice: [{}, {lambda0: 0.9}]}
";

const TUNING: &str = "\
version: 1
why: A search.
estimator: dffrls_aekf_robust
parameters:
  lambda0: {from: 0.9, to: 0.999, scale: memory}
tuning: [{scenario: scenario.yaml, seeds: 1..2}]
validation: [{scenario: scenario.yaml, seeds: 3}]
objective: {metrics: [{metric: slope_rmse_deg}]}
evaluation: closed_loop
budget: 5
";
