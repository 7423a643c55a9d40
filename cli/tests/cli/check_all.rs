//! `check` knows every file that commands write.

use crate::common::{GOOD, TestFolder};
use std::path::{Path, PathBuf};

/// All files in a folder and in the folders in it.
fn all(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(all(&path)),
            false => found.push(path),
        }
    }
    found
}

const STUDY: &str = "\
version: 1
why: A small one.
scenario: scenario.yaml
runs: 2
vary: [{path: load.mass_kg, uniform: [1000, 2500]}]
";

#[test]
fn every_file_that_is_written_is_known() {
    let dir = TestFolder::new();
    let short = GOOD.replace("stop: {after_s: 60}", "stop: {after_s: 8}");
    let short: String = short
        .lines()
        .filter(|l| !l.contains("at_s: 30, load") && !l.contains("from_s: 40"))
        .filter(|l| {
            !l.starts_with("expect") && !l.contains("metric:") && !l.starts_with("availability")
        })
        .map(|l| format!("{l}\n"))
        .collect();
    dir.write("scenario.yaml", short.as_bytes());
    dir.write("study.yaml", STUDY.as_bytes());
    std::fs::create_dir(dir.path("out")).unwrap();
    for task in [
        &[
            "run",
            "scenario.yaml",
            "--keep-samples",
            "--out",
            "out/runs",
        ][..],
        &["report", "out/runs/scenario/1"],
        &["explain", "out/runs/scenario/1", "--seeds", "1"],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "csv",
            "--out",
            "out/csv",
        ],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "mcap",
            "--out",
            "out/mcap",
        ],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "mf4",
            "--out",
            "out/mf4",
        ],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "mat",
            "--out",
            "out/mat",
        ],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "can",
            "--out",
            "out/can",
        ],
        &[
            "export",
            "out/runs/scenario/1",
            "--to",
            "parquet",
            "--out",
            "out/parquet",
        ],
        &[
            "compare",
            "scenario.yaml",
            "--seeds",
            "1..2",
            "--json",
            "out/c.json",
            "--csv",
            "out/c.csv",
        ],
        &[
            "test",
            "scenario.yaml",
            "--seeds",
            "1..2",
            "--json",
            "out/t.json",
            "--junit",
            "out/t.xml",
        ],
        &["study", "study.yaml", "--out", "out/studies"],
        &["report", "out/t.json"],
    ] {
        let (code, out, err) = dir.monorig(task);
        assert!(matches!(code, Some(0 | 1)), "{task:?}: {out}{err}");
    }
    let files = all(&dir.path("out"));
    assert!(files.len() > 30, "{files:?}");
    for file in &files {
        let (code, out, err) = dir.monorig(&["check", file.to_str().unwrap()]);
        assert_eq!(code, Some(0), "{}: {out}{err}", file.display());
    }
}

/// A damaged file is refused, in every one of these formats.
#[test]
fn what_is_damaged_is_refused() {
    let dir = TestFolder::new();
    dir.write("a.csv", b"a,b\n1,2\n3\n");
    dir.write("a.xml", b"<testsuites><testsuite></testsuites>");
    dir.write("a.dbc", b"BO_ what");
    dir.write("a.mcap", b"\x89MCAP0\r\n");
    let name = "0".repeat(64);
    dir.write(&name, b"something else");
    for file in ["a.csv", "a.xml", "a.dbc", "a.mcap", &name] {
        let told = dir.refused(&["check", file]);
        assert!(told.contains(file), "{told}");
    }
}
