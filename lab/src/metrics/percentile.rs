//! Percentiles of magnitudes in bounded memory: exact for the first 131 072 values, from a histogram beyond.
//!
//! The histogram is log-linear (Tene 2012, HdrHistogram): each power of two is cut into 1024 cells of equal width, so
//! that the middle of a cell is within 1/2048 (0.05 %) of every value in it. A cell is the leading bits of the
//! number: no logarithm, so the same on every machine, and whatever the order of the values.

use crate::metrics::statistics::{Accumulator, Running};
use std::collections::BTreeMap;

/// So many values are kept as they are: 22 minutes at 100 Hz.
const EXACT: usize = 1 << 17;
/// Bits of the mantissa that make the cells of a power of two.
const CELL_BITS: u32 = 10;
/// Bits of a number below those of its cell.
const BELOW: u32 = f64::MANTISSA_DIGITS - 1 - CELL_BITS;

/// The 95th percentile of magnitudes: the value below which 95 % of them lie, the nearest of the values.
pub(crate) fn p95<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Percentile {
        of,
        share: 0.95,
        numbers_only: false,
        so_far: Magnitudes::default(),
    })
}

/// The 99th percentile of the values that are numbers.
pub(crate) fn p99_of_numbers<T: 'static>(of: impl Fn(&T) -> f64 + 'static) -> Running<T> {
    Box::new(Percentile {
        of,
        share: 0.99,
        numbers_only: true,
        so_far: Magnitudes::default(),
    })
}

struct Percentile<F> {
    of: F,
    share: f64,
    numbers_only: bool,
    so_far: Magnitudes,
}

impl<T, F: Fn(&T) -> f64> Accumulator<T> for Percentile<F> {
    fn add(&mut self, x: &T) {
        let x = (self.of)(x).abs();
        if !(self.numbers_only && x.is_nan()) {
            self.so_far.add(x);
        }
    }

    fn value(&self) -> f64 {
        self.so_far.percentile(self.share)
    }
}

/// Magnitudes, as they are or as a histogram: the number of values in each cell. The sign of a magnitude is 0, so cells
/// are in the order of the numbers, infinity and not-a-number last.
enum Magnitudes {
    Exact(Vec<f64>),
    Cells(BTreeMap<u64, u64>),
}

impl Default for Magnitudes {
    fn default() -> Self {
        Self::Exact(Vec::new())
    }
}

impl Magnitudes {
    fn add(&mut self, x: f64) {
        match self {
            Self::Exact(values) if values.len() < EXACT => values.push(x),
            Self::Exact(values) => {
                let values = std::mem::take(values);
                *self = Self::Cells(BTreeMap::new());
                values.into_iter().chain([x]).for_each(|x| self.add(x));
            }
            Self::Cells(cells) => *cells.entry(x.to_bits() >> BELOW).or_default() += 1,
        }
    }

    /// The value below which the share `p` (0…1) lies; not a number of none.
    fn percentile(&self, p: f64) -> f64 {
        let place = |n: f64| ((n - 1.0) * p).round();
        match self {
            Self::Exact(values) if values.is_empty() => f64::NAN,
            Self::Exact(values) => {
                let mut values = values.clone();
                let place = place(values.len() as f64) as usize;
                *values.select_nth_unstable_by(place, f64::total_cmp).1
            }
            Self::Cells(cells) => {
                let place = place(cells.values().sum::<u64>() as f64) as u64;
                let mut below = 0;
                let at = cells.iter().find(|(_, n)| {
                    below += **n;
                    below > place
                });
                at.map_or(f64::NAN, |(cell, _)| middle(*cell))
            }
        }
    }
}

fn middle(cell: u64) -> f64 {
    let start = f64::from_bits(cell << BELOW);
    let end = f64::from_bits((cell + 1) << BELOW);
    match start == 0.0 || !end.is_finite() {
        true => start,
        false => 0.5 * (start + end),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(x: impl Iterator<Item = f64>) -> Magnitudes {
        let mut all = Magnitudes::default();
        x.for_each(|x| all.add(x));
        all
    }

    #[test]
    fn percentiles_are_values_of_the_list() {
        let x = || of((0..101).rev().map(f64::from));
        assert_eq!(x().percentile(0.95), 95.0);
        assert_eq!(x().percentile(0.0), 0.0);
        assert_eq!(x().percentile(1.0), 100.0);
        assert_eq!(of([7.0].into_iter()).percentile(0.3), 7.0);
        assert!(of(std::iter::empty()).percentile(0.5).is_nan());
    }

    /// Against the sorted list: errors over nine powers of ten, in an order of their own (a multiplicative
    /// generator), zeros among them.
    #[test]
    fn of_many_values_within_a_two_thousandth() {
        let n = 3 * EXACT;
        let mut state = 1u64;
        let values: Vec<f64> = (0..n)
            .map(|i| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let u = (state >> 11) as f64 / (1u64 << 53) as f64;
                if i % 50 == 0 {
                    0.0
                } else {
                    10f64.powf(9.0 * u - 6.0)
                }
            })
            .collect();
        let all = of(values.iter().copied());
        assert!(matches!(&all, Magnitudes::Cells(cells) if cells.len() <= 32 << CELL_BITS));
        let backwards = of(values.iter().rev().copied());
        let mut sorted = values;
        sorted.sort_unstable_by(f64::total_cmp);
        for p in [0.0, 0.01, 0.3, 0.5, 0.95, 0.999, 1.0] {
            let exact = sorted[((n - 1) as f64 * p).round() as usize];
            let x = all.percentile(p);
            assert!(
                (x - exact).abs() <= exact / 2048.0,
                "{p}: {x} against {exact}"
            );
            assert_eq!(x.to_bits(), backwards.percentile(p).to_bits());
        }
    }

    #[test]
    fn what_is_no_number_comes_last_as_in_the_exact_list() {
        let most = of((0..2 * EXACT).map(|i| if i % 4 == 0 { f64::NAN } else { 1.0 }));
        assert!((most.percentile(0.5) - 1.0).abs() < 1e-3);
        assert!(most.percentile(0.95).is_nan());
        let infinite = of((0..2 * EXACT).map(|_| f64::INFINITY));
        assert_eq!(infinite.percentile(0.5), f64::INFINITY);
    }
}
