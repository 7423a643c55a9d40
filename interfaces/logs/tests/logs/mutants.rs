//! Damaged files: bits flipped, cut short, lengths made huge. Each is read or refused; none ends the process, and none
//! takes long.
//!
//! `MONORIG_MUTANTS=10000` makes as many of each file; under `ulimit -v 4000000` a reader that trusts a declared length
//! shows itself.

use monorig_logs::read::{Database, ReadOptions, scan};
use monorig_testing::{Random, mutant, mutants};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

#[test]
fn damaged_files_are_read_or_refused() {
    let times = mutants::count(200);
    let dir = tempfile::tempdir().unwrap();
    let mut files = vec![
        "asammdf_410_plain.mf4",
        "asammdf_420_deflate.mf4",
        "json_zstd.mcap",
        "json_lz4.mcap",
        "cdr_none.mcap",
        "pyarrow_snappy.parquet",
        "pandas_datetime.parquet",
        "scipy_plain.mat",
        "scipy_deflate.mat",
        "h5py_73.mat",
        "can.log",
        "comma.csv",
    ];
    if cfg!(feature = "blf") {
        files.extend(["can.blf", "can.asc"]);
    }
    for file in files {
        let good = std::fs::read(data(file)).unwrap();
        let options = ReadOptions {
            dbc: Some(data("crane.dbc")),
            time: (file == "comma.csv").then(|| "Zeit".to_owned()),
            ..ReadOptions::default()
        };
        let (mut refused, mut slowest) = (0, Duration::ZERO);
        for seed in 0..times {
            let path = dir.path().join(file);
            std::fs::write(&path, mutant(&good, 0, seed)).unwrap();
            let (begun, mut rows) = (Instant::now(), 0usize);
            let read = scan(&path, &options, &mut |chunk| {
                rows += chunk.rows.len();
                rows < 1_000_000
            });
            if let Err(e) = read {
                refused += 1;
                assert!(e.to_string().contains(file), "{e}");
            }
            slowest = slowest.max(begun.elapsed());
        }
        println!("{file}: {times} mutants, {refused} refused, slowest {slowest:.2?}");
        assert!(slowest < Duration::from_secs(10), "{file}: {slowest:?}");
        assert!(refused > 0, "{file}: nothing was refused");
    }
}

/// One stamp far from the rest, anywhere in a table: the file is refused at once, with the row and its value.
#[test]
fn a_stamp_of_another_time_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("log.csv");
    let mut random = Random::new(mutants::first_seed());
    for _ in 0..mutants::count(100) {
        let origin_s = *random.of(&[0.0, 1.7e9, -50.0]);
        let rows = 2 + random.below(300);
        let mut stamps: Vec<f64> = (0..rows).map(|i| origin_s + 0.01 * i as f64).collect();
        let write = |stamps: &[f64]| {
            let rows = stamps.iter().map(|t| format!("{t:.3},1.5\n"));
            std::fs::write(&path, "time_s,v\n".to_owned() + &rows.collect::<String>()).unwrap();
            scan(&path, &ReadOptions::default(), &mut |_| true)
        };
        write(&stamps).unwrap();
        let at = random.below(rows);
        let sign = *random.of(&[-1.0, 1.0]);
        stamps[at] += sign * 10f64.powf(6.5 + 2.9 * random.unit());
        let told = write(&stamps).unwrap_err().to_string();
        let place = [at + 1, at + 2, at + 3].map(|n| told.contains(&format!("row {n} ")));
        assert!(
            place.contains(&true) && told.contains(" s, "),
            "row {}: {told}",
            at + 1
        );
    }
}

#[test]
fn damaged_databases_of_messages() {
    let good = std::fs::read(data("crane.dbc")).unwrap();
    for seed in 0..500 {
        let bytes = mutant(&good, 0, seed);
        let _ = Database::parse(&String::from_utf8_lossy(&bytes));
    }
}
