//! Recorded inputs, the oracles' outputs, and their comparison.

use std::{fs, path::Path};

/// Largest difference from the oracle, relative to its number.
const RELATIVE: f64 = 1e-9;
/// Where the oracle's number is near a zero crossing, its size counts as at least this share of its column's median.
const NEAR_ZERO: f64 = 1e-2;

/// A CSV file of numbers.
pub struct Table {
    pub names: Vec<String>,
    pub rows: Vec<Vec<f64>>,
}

impl Table {
    pub fn read(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/reference/data");
        let text = fs::read_to_string(folder.join(name)).unwrap();
        let mut lines = text.lines();
        let names = lines.next().unwrap().split(',').map(String::from);
        let rows = lines.map(|line| line.split(',').map(|v| v.parse().unwrap()).collect());
        Self {
            names: names.collect(),
            rows: rows.collect(),
        }
    }

    /// The rows as arrays; the file must have just `WIDTH` columns.
    #[allow(dead_code)]
    pub fn arrays<const WIDTH: usize>(&self) -> Vec<[f64; WIDTH]> {
        let rows = self.rows.iter();
        rows.map(|row| row.as_slice().try_into().unwrap()).collect()
    }

    /// Middle of the sizes of a column's numbers.
    fn median(&self, column: usize) -> f64 {
        let mut sizes: Vec<f64> = self.rows.iter().map(|row| row[column].abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes[sizes.len() / 2]
    }
}

/// Compares all `rows` with the oracle's output, number by number.
pub fn assert_agrees(algorithm: &str, rows: &[Vec<f64>]) {
    let oracle = Table::read(&format!("{algorithm}_output.csv"));
    assert!(rows.len() > 100 && rows.len() == oracle.rows.len());
    let mut worst: f64 = 0.0;
    for (column, name) in oracle.names.iter().enumerate() {
        let median = oracle.median(column);
        for (k, (got, expected)) in rows.iter().zip(&oracle.rows).enumerate() {
            assert_eq!(got.len(), oracle.names.len(), "{algorithm}: numbers a row");
            let (got, expected) = (got[column], expected[column]);
            let size = expected.abs().max(NEAR_ZERO * median);
            let off = (got - expected).abs() / if size > 0.0 { size } else { 1.0 };
            assert!(
                off <= RELATIVE,
                "{algorithm}: {name} in row {k} is {got}, the oracle has {expected} ({off:.1e} off)"
            );
            worst = worst.max(off);
        }
    }
    println!("{algorithm}: at most {worst:.1e} off");
}
