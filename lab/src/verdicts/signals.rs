//! Two runs signal by signal: the samples that differ by more than a tolerance.

use monorig_sim::error::Error;
use monorig_sim::record::readback::{Columns, columns};
use serde::Serialize;
use std::ops::Range;
use std::path::Path;

/// Tolerances: a sample passes within `absolute` + `relative` · |value in A|.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SignalTolerance {
    /// In the unit of the signal.
    pub absolute: f64,
    /// Share of the value in A.
    pub relative: f64,
    /// Largest time by which a sample may come earlier or later in B, s.
    pub time_s: f64,
}

/// A signal with samples beyond the tolerance.
#[derive(Clone, Debug, Serialize)]
pub struct DifferentSignal {
    /// Channel.
    pub name: String,
    /// Samples of A beyond the tolerance.
    pub beyond: usize,
    /// Time of the first of them, s.
    pub first_s: f64,
    /// Its value in A and in B; NaN for no value.
    pub first: [f64; 2],
    /// Largest difference; infinite where only one run has a value.
    pub largest: f64,
    /// Largest difference as a multiple of the signal's span in A.
    pub of_span: f64,
}

/// Every signal of two runs compared.
#[derive(Clone, Debug, Serialize)]
pub struct SignalComparison {
    /// Tolerances.
    pub tolerance: SignalTolerance,
    /// Signals that both runs have.
    pub signals: usize,
    /// Samples in A.
    pub samples: usize,
    /// Signals that only A has, and that only B has.
    pub only: [Vec<String>; 2],
    /// Samples of A, and of B, at a time without a sample in the other run.
    pub unpaired: [usize; 2],
    /// Signals that differ, in the order of their first difference.
    pub differ: Vec<DifferentSignal>,
}

impl SignalComparison {
    /// Compares the channels whose names `wanted` accepts in two files of channels.
    pub fn of(
        files: [&Path; 2],
        tolerance: SignalTolerance,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<Self, Error> {
        let [(a, of_a), (b, of_b)] = [columns(files[0], &wanted)?, columns(files[1], &wanted)?];
        let names = |columns: &[String]| -> Vec<String> {
            let wanted = columns.iter().filter(|name| *name != TIME && wanted(name));
            wanted.cloned().collect()
        };
        let (in_a, in_b) = (names(&a.columns), names(&b.columns));
        let without = |all: &[String], other: &[String]| -> Vec<String> {
            let only = all.iter().filter(|name| !other.contains(name));
            only.cloned().collect()
        };
        let times = [of_a.get(TIME)?, of_b.get(TIME)?];
        let pairs = Pairs {
            times: times[0],
            other: times[1],
            near: near(times[0], times[1], tolerance.time_s),
        };
        let back = near(times[1], times[0], tolerance.time_s);
        let alone = |near: &[Range<usize>]| near.iter().filter(|rows| rows.is_empty()).count();
        let both = in_a.iter().filter(|name| in_b.contains(name));
        let mut differ = Vec::new();
        for name in both.clone() {
            differ.extend(pairs.difference(name, [&of_a, &of_b], tolerance)?);
        }
        differ.sort_by(|x, y| {
            let first = x.first_s.total_cmp(&y.first_s);
            first.then(y.of_span.total_cmp(&x.of_span))
        });
        Ok(Self {
            tolerance,
            signals: both.count(),
            samples: a.rows,
            only: [without(&in_a, &in_b), without(&in_b, &in_a)],
            unpaired: [alone(&pairs.near), alone(&back)],
            differ,
        })
    }

    /// True if all samples are within the tolerance, and both runs have the same signals and times.
    pub fn held(&self) -> bool {
        let only = self.only.iter().all(Vec::is_empty);
        self.differ.is_empty() && only && self.unpaired == [0, 0]
    }

    /// The outcome in a sentence.
    pub fn sentence(&self) -> String {
        let (n, all) = (self.differ.len(), self.signals);
        if self.held() {
            return format!(
                "held: no difference in {all} signals of {} samples",
                self.samples
            );
        }
        let mut said = vec![match self.differ.first() {
            Some(first) => format!(
                "{n} of {all} signals differ, the first at {:.2} s: {}",
                first.first_s, first.name
            ),
            None => format!("none of {all} signals differs"),
        }];
        for ((letter, only), unpaired) in ["A", "B"].iter().zip(&self.only).zip(self.unpaired) {
            let count =
                |n: usize, what: &str| (n > 0).then(|| format!("{n} {what} only in {letter}"));
            said.extend(count(only.len(), "signals"));
            said.extend(count(unpaired, "samples"));
        }
        format!("FAILED: {}", said.join("; "))
    }
}

/// Name of the column with the times.
const TIME: &str = "time";

/// Times of rows are whole nanoseconds in s, and are rounded.
const ROUNDING_S: f64 = 1e-9;

/// For each of the times the rows of `other` that lie within `reach_s` of it. Both rise.
fn near(times: &[f64], other: &[f64], reach_s: f64) -> Vec<Range<usize>> {
    let reach = reach_s + ROUNDING_S;
    let rows = times.iter().map(|t| {
        other.partition_point(|x| *x < t - reach)..other.partition_point(|x| *x <= t + reach)
    });
    rows.collect()
}

/// Rows of A, each with its counterparts in B.
struct Pairs<'a> {
    times: &'a [f64],
    other: &'a [f64],
    near: Vec<Range<usize>>,
}

impl Pairs<'_> {
    /// Samples of a signal beyond the tolerance; `None` without such a sample.
    fn difference(
        &self,
        name: &str,
        of: [&Columns; 2],
        tolerance: SignalTolerance,
    ) -> Result<Option<DifferentSignal>, Error> {
        let [a, b] = [of[0].get(name)?, of[1].get(name)?];
        let mut found: Option<DifferentSignal> = None;
        for ((t, x), rows) in self.times.iter().zip(a).zip(&self.near) {
            let window = b.get(rows.clone()).unwrap_or_default();
            let gap = gap(*x, window);
            let allowed = tolerance.absolute + tolerance.relative * x.abs();
            if window.is_empty() || gap == 0.0 || gap <= allowed {
                continue;
            }
            let nearest = rows.clone().min_by(|i, j| {
                let away = |row: usize| self.other.get(row).map_or(f64::NAN, |s| (s - t).abs());
                away(*i).total_cmp(&away(*j))
            });
            let theirs = nearest.and_then(|row| b.get(row).copied());
            let first = found.get_or_insert_with(|| DifferentSignal {
                name: name.to_owned(),
                beyond: 0,
                first_s: *t,
                first: [*x, theirs.unwrap_or(f64::NAN)],
                largest: 0.0,
                of_span: 0.0,
            });
            first.beyond += 1;
            first.largest = first.largest.max(gap);
        }
        Ok(found.map(|mut signal| {
            let (low, high) = range(a);
            signal.of_span = match high - low {
                span if span > 0.0 => signal.largest / span,
                _ => f64::INFINITY,
            };
            signal
        }))
    }
}

/// Distance of a value from its counterparts: 0 between the least and the greatest, infinite if only one side has a
/// value.
fn gap(x: f64, window: &[f64]) -> f64 {
    let (low, high) = range(window);
    match (x.is_nan(), window.iter().any(|y| y.is_nan())) {
        (true, true) => 0.0,
        (false, _) if low <= high => (low - x).max(x - high).max(0.0),
        _ => f64::INFINITY,
    }
}

/// Least and greatest of the existing values.
fn range(values: &[f64]) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.iter().filter(|x| !x.is_nan());
    values.fold(start, |(low, high), x| (low.min(*x), high.max(*x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f64 = f64::NAN;

    #[test]
    fn a_value_is_as_far_away_as_the_nearest_that_may_stand_for_it() {
        for (x, window, expected) in [
            (1.0, &[1.0][..], 0.0),
            (1.0, &[3.0], 2.0),
            (1.0, &[3.0, 2.5, NONE], 1.5),
            (1.0, &[0.0, 4.0], 0.0),
            (NONE, &[NONE, 1.0], 0.0),
            (NONE, &[1.0], f64::INFINITY),
            (1.0, &[NONE], f64::INFINITY),
            (f64::INFINITY, &[f64::INFINITY], 0.0),
        ] {
            assert_eq!(gap(x, window), expected, "{x} {window:?}");
        }
    }

    #[test]
    fn rows_within_the_reach_are_near() {
        let (a, b) = ([0.0, 0.1, 0.2], [0.0, 0.1 + 1e-12, 0.25]);
        assert_eq!(near(&a, &b, 0.0), [0..1, 1..2, 2..2]);
        assert_eq!(near(&a, &b, 0.05), [0..1, 1..2, 2..3]);
        assert_eq!(near(&a, &b, 1.0), [0..3, 0..3, 0..3]);
    }
}
