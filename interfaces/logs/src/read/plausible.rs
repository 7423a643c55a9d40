//! The length of a log and the largest gap in it: a stamp far from the others is an error of clock, unit or column, and
//! whoever steps from one row to the next would be years on the way.

use super::Chunk;
use crate::notation::NS;
use crate::wrong;
use monorig_sim::error::Error;
use std::path::Path;

const DAY_NS: i64 = 86_400 * NS;
/// Largest time between a row and the next, ns: a logger may rest for a month.
pub(crate) const MAX_GAP_NS: i64 = 32 * DAY_NS;
/// Longest log, from the first row to the last, ns.
const MAX_LENGTH_NS: i64 = 400 * DAY_NS;

/// Holds the stamps of a file against both limits, row by row.
#[derive(Default)]
pub(super) struct Plausible {
    /// Piece, and earliest, latest and last stamp of it, ns.
    piece: Option<(u32, i64, i64, i64)>,
}

impl Plausible {
    /// Checks the rows of a chunk.
    pub(super) fn check(&mut self, path: &Path, chunk: &Chunk) -> Result<(), Error> {
        for row in &chunk.rows {
            let t = row.stamp_ns;
            let known = self.piece.filter(|(piece, ..)| *piece == row.piece);
            let (_, first, last, before) = known.unwrap_or((row.piece, t, t, t));
            let (first, last) = (first.min(t), last.max(t));
            let (gap, length) = (t.abs_diff(before), last.abs_diff(first));
            let what = if gap > MAX_GAP_NS.unsigned_abs() {
                format!("{} after or before the row before it", days(gap))
            } else if length > MAX_LENGTH_NS.unsigned_abs() {
                format!("{} away from another row of this log", days(length))
            } else if t.abs_diff(row.arrival_ns) > MAX_GAP_NS.unsigned_abs() {
                format!(
                    "{} away from its recording",
                    days(t.abs_diff(row.arrival_ns))
                )
            } else {
                self.piece = Some((row.piece, first, last, t));
                continue;
            };
            return Err(implausible(path, row.place, t, &what));
        }
        Ok(())
    }
}

/// The error of a stamp.
pub(crate) fn implausible(path: &Path, place: u64, stamp_ns: i64, what: &str) -> Error {
    let s = stamp_ns as f64 * 1e-9;
    wrong(
        path,
        None,
        format!("row {place} has the time {s:.3} s, {what}: this cannot be a time of the same log"),
        format!(
            "use rows of one clock, at most {} days apart and at most {} days in all; choose another column or unit of time, \
             or remove rows that do not belong to the log",
            MAX_GAP_NS / DAY_NS,
            MAX_LENGTH_NS / DAY_NS
        ),
    )
}

fn days(ns: u64) -> String {
    format!("{:.0} days", ns as f64 / DAY_NS as f64)
}

#[cfg(test)]
mod tests {
    use super::super::Row;
    use super::*;

    fn check(stamps_s: &[f64]) -> Result<(), Error> {
        let mut plausible = Plausible::default();
        let rows = (1..).zip(stamps_s);
        let chunk = Chunk {
            rows: rows.map(|(n, s)| Row::at(0, (s * 1e9) as i64, n)).collect(),
            ..Chunk::default()
        };
        plausible.check(Path::new("a.csv"), &chunk)
    }

    /// Whatever the clock begins with, a log of hours is one, and one stamp of another epoch or unit is found,
    /// wherever it stands.
    #[test]
    fn one_stamp_far_from_the_rest_is_found() {
        for origin_s in [0.0, -3600.0, 1.7e9, 4.1e9] {
            let good: Vec<f64> = (0..500).map(|i| origin_s + 0.01 * f64::from(i)).collect();
            assert!(check(&good).is_ok());
            for place in [0, 1, 250, 499] {
                for far_s in [origin_s + 1.7e9, origin_s - 1.7e9, origin_s + 3.0e6] {
                    let mut bad = good.clone();
                    bad[place] = far_s;
                    let told = check(&bad).unwrap_err().to_string();
                    let row = [place + 1, place + 2].map(|n| told.contains(&format!("row {n} ")));
                    assert!(row.contains(&true), "{place}: {told}");
                }
            }
        }
        let in_ns: Vec<f64> = (0..500).map(|i| 1.0e6 * f64::from(i)).collect();
        assert!(check(&in_ns).is_err());
    }
}
