//! Damaged files: bits flipped, cut short, lengths made huge. Each is read or refused; none ends the process, and none
//! takes long.
//!
//! `MONORIG_MUTANTS=10000` makes as many of each file; under `ulimit -v 4000000` a reader that trusts a declared length
//! shows itself.

#![allow(clippy::unwrap_used)] // helpers of tests

use monorig_logs::read::{Database, ReadOptions, scan};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

/// Marsaglia's xorshift64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % n.max(1)
    }
}

fn mutant(good: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = good.to_vec();
    match random.below(4) {
        0 => bytes.truncate(random.below(good.len())),
        1 => {
            for _ in 0..=random.below(8) {
                let at = random.below(good.len());
                bytes[at] ^= 1 << random.below(8);
            }
        }
        2 => {
            // a length of a billion, or more than there is memory
            let (at, value) = (
                random.below(good.len().saturating_sub(8)),
                [1_000_000_000u64, u64::MAX >> 8][random.below(2)],
            );
            bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        }
        _ => {
            let (at, n) = (random.below(good.len().min(4096)), 1 + random.below(16));
            for byte in bytes.iter_mut().skip(at).take(n) {
                *byte = random.below(256) as u8;
            }
        }
    }
    bytes
}

#[test]
fn damaged_files_are_read_or_refused() {
    let times = std::env::var("MONORIG_MUTANTS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(200);
    let dir = tempfile::tempdir().unwrap();
    let mut files = vec![
        "asammdf_410_plain.mf4",
        "asammdf_420_deflate.mf4",
        "json_zstd.mcap",
        "json_lz4.mcap",
        "cdr_none.mcap",
        "pyarrow_snappy.parquet",
        "pandas_datetime.parquet",
        "can.log",
        "comma.csv",
    ];
    if cfg!(feature = "blf") {
        files.extend(["can.blf", "can.asc"]);
    }
    for file in files {
        let good = std::fs::read(data(file)).unwrap();
        let mut random = Random(0x9E37_79B9_7F4A_7C15);
        let options = ReadOptions {
            dbc: Some(data("crane.dbc")),
            time: (file == "comma.csv").then(|| "Zeit".to_owned()),
            ..ReadOptions::default()
        };
        let (mut refused, mut slowest) = (0, Duration::ZERO);
        for _ in 0..times {
            let path = dir.path().join(file);
            std::fs::write(&path, mutant(&good, &mut random)).unwrap();
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

#[test]
fn damaged_databases_of_messages() {
    let good = std::fs::read(data("crane.dbc")).unwrap();
    let mut random = Random(7);
    for _ in 0..500 {
        let bytes = mutant(&good, &mut random);
        let _ = Database::parse(&String::from_utf8_lossy(&bytes));
    }
}
