//! Start search: the force balance begun from several loads, each weighed by how well it explains the first blocks.
//!
//! The swing weighs what hangs on the chains, so the balance is not linear in the mass: an extended Kalman filter that
//! starts far from it can come to rest on a wrong pair of mass and pendulum length, with a standard deviation that
//! covers neither. So the first blocks are gone over once for each of `START.loads`, as a Gaussian sum (Sorenson &
//! Alspach 1971): the best one goes on, its variance widened to that of the sum, and by what the filter alone
//! contradicts it.
//! Widened is the load with what the blocks tie to it: a heavier load with less resistance explains the same force.
//!
//! A pass is weighed by its normalised innovations squared alone. A likelihood would have the determinants of their
//! covariances, too. These favour the lightest load: the noise of the swing grows with the load and is larger than it
//! has to be.

use crate::Real;
use crate::api::real::{exp, sqrt};
use crate::api::snapshot::state;
use crate::tuning;

/// Passes over the blocks, and their results.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartSearch {
    active: bool,
    /// Number of the pass; after all loads the best one is gone over again.
    pass: u8,
    best: u8,
    /// Sum of the squares of this pass and of the best.
    square: Real,
    best_square: Real,
    /// Sums over the passes: weight, weight × load, weight × (variance + load²); loads as shares of the largest,
    /// weights relative to the best.
    sums: [Real; 3],
    /// Load and variance that the filter has come to without a search.
    alone: [Real; 2],
}

impl StartSearch {
    /// Begins with the first load; `alone` is the load that the filter has come to without a search, with its variance,
    /// as shares of the largest load and of its square.
    pub fn begin(&mut self, alone: [Real; 2]) {
        *self = Self {
            active: true,
            alone,
            ..Self::default()
        };
    }

    /// Returns true if passes are left.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// Ends it without a result.
    pub fn stop(&mut self) {
        self.active = false;
    }

    /// Returns true if this pass is the best one again.
    pub fn is_last(&self) -> bool {
        usize::from(self.pass) >= tuning::START.loads.len()
    }

    /// Load to start this pass from and its standard deviation, as shares of the largest.
    pub fn start(&self) -> [Real; 2] {
        let of = if self.is_last() { self.best } else { self.pass };
        tuning::START
            .loads
            .get(usize::from(of))
            .copied()
            .unwrap_or(tuning::START.loads[0])
    }

    /// Takes the normalised innovation squared of a block.
    pub fn take(&mut self, square: Real) {
        let linear =
            tuning::STATISTICS.noise_sd * (2.0 * sqrt(square) - tuning::STATISTICS.noise_sd);
        self.square += if square > tuning::STATISTICS.noise_sd * tuning::STATISTICS.noise_sd {
            linear
        } else {
            square
        };
    }

    /// Ends a pass that has come to this load and variance, as shares of the largest load and of its square. After the
    /// last one: the variance that the sum of all passes has about that load, and what the filter alone contradicts it
    /// by.
    pub fn close(&mut self, load: Real, variance: Real) -> Option<Real> {
        if self.is_last() {
            self.active = false;
            let [weight, first, second] = self.sums;
            let [mean, square] = [first, second].map(|sum| sum / weight.max(Real::MIN_POSITIVE));
            let mixed = (square - 2.0 * mean * load + load * load).max(variance);
            // the best pass is doubtful by what the load of the filter alone differs from it
            let [alone, doubt] = self.alone;
            let apart = (load - alone) * (load - alone) - doubt;
            return Some(mixed + apart.max(0.0));
        }
        if self.pass == 0 || self.square < self.best_square {
            let old = exp(-tuning::START.sharpness * (self.best_square - self.square).max(0.0));
            self.sums = self.sums.map(|sum| sum * old);
            (self.best, self.best_square) = (self.pass, self.square);
        }
        // the loads are not evenly spaced: each stands for as much as it is wide
        let [_, width] = self.start();
        let weight = width * exp(-tuning::START.sharpness * (self.square - self.best_square));
        let moments = [1.0, load, variance + load * load];
        for (sum, moment) in self.sums.iter_mut().zip(moments) {
            *sum += weight * moment;
        }
        self.pass += 1;
        self.square = 0.0;
        None
    }
}

state!(StartSearch { active, pass, best, square, best_square, sums, alone; } where |this| usize::from(this.pass) <= tuning::START.loads.len());

#[cfg(test)]
mod tests {
    use super::*;

    /// Load and variance of a filter that has weighed nothing yet.
    const NONE: [Real; 2] = [0.5, 1.0];

    /// Loads, variances and sums of squares of the passes, and the mixture of them written out.
    #[test]
    fn the_variance_is_that_of_the_mixture_about_the_best_load() {
        let found = [
            [0.05, 0.01, 30.0],
            [0.12, 0.02, 9.0],
            [0.30, 0.03, 4.0],
            [0.33, 0.03, 5.0],
            [0.50, 0.05, 8.0],
            [0.60, 0.05, 20.0],
            [0.70, 0.05, 40.0],
            [0.90, 0.05, 90.0],
        ];
        let mut search = StartSearch::default();
        search.begin(NONE);
        for [load, sd, square] in found {
            for _ in 0..10 {
                search.take(square / 10.0);
            }
            assert_eq!(search.close(load, sd * sd), None);
        }
        assert!(search.is_last() && search.start() == tuning::START.loads[2]);
        let about = search.close(0.31, 0.0).unwrap();
        assert!(!search.is_active());
        let weights = found
            .iter()
            .zip(tuning::START.loads)
            .map(|(f, [_, width])| width * exp(-tuning::START.sharpness * f[2]));
        let total: Real = weights.clone().sum();
        let terms = weights.zip(found).map(|(w, [load, sd, _])| {
            let off = load - 0.31;
            w / total * (sd * sd + off * off)
        });
        let expected: Real = terms.sum();
        assert!(
            (about - expected).abs() < 1e-5 * expected,
            "{about} {expected}"
        );
    }

    /// Two standard deviations of the filter alone beside the best pass: three of its variances more.
    #[test]
    fn a_filter_that_found_another_load_is_in_the_variance() {
        for (sd, more) in [(0.1, 0.03), (0.2, 0.0), (0.5, 0.0)] {
            let about = |alone: [Real; 2]| {
                let mut search = StartSearch::default();
                search.begin(alone);
                for [load, width] in tuning::START.loads {
                    search.take(20.0 * load);
                    search.close(load, width * width);
                }
                search.close(0.3, 0.01).unwrap()
            };
            let [wider, known] = [about([0.5, sd * sd]), about(NONE)];
            assert!((wider - known - more).abs() < 1e-6, "{wider} {known}");
        }
    }

    #[test]
    fn an_outlier_counts_linearly() {
        let mut search = StartSearch::default();
        search.begin(NONE);
        search.take(7.0);
        search.take(9.0);
        search.take(100.0);
        assert!((search.square - (7.0 + 9.0 + 51.0)).abs() < 1e-4);
    }

    /// Stopped, no pass is left; begun again, it is as new.
    #[test]
    fn a_search_that_is_stopped_has_no_pass_left() {
        let mut search = StartSearch::default();
        assert!(!search.is_active());
        search.begin(NONE);
        let new = search;
        search.take(4.0);
        search.close(0.5, 0.01);
        assert!(search.is_active() && search.start() == tuning::START.loads[1]);
        search.stop();
        assert!(!search.is_active());
        search.begin(NONE);
        assert_eq!(search, new);
    }
}
