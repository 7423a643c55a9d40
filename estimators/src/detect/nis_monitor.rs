//! Consistency monitor of one source of measurements: windowed normalised innovation squared (NIS) on the un-adapted
//! noise.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::filters::lag_share::LagShare;
use crate::tuning::STATISTICS;

/// NIS monitor: exponentially windowed mean of the NIS of one source, against the limit that the mean of a consistent
/// filter exceeds with a stated probability (Bar-Shalom, Li & Kirubarajan 2001, section 5.4).
///
/// A window with the time constant T averages over 2 T, in which a filter of real signals has 2 T f independent
/// innovations, f the rate of decorrelation of what the model leaves out; n = 2 T f times their mean is then χ² with n
/// degrees of freedom. The limit is the quantile of that over n, by Wilson & Hilferty (1931): (1 − 2/(9 n) + z √(2/(9
/// n)))³.
///
/// The noise must be that given or learnt at the start, not that adapted to the innovations, or the test tests nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NisMonitor {
    on: bool,
    window_s: Real,
    limit: Real,
    mean: Real,
    share: LagShare,
}

impl NisMonitor {
    /// Window of time constant `window_s`, with innovations taken for independent at `independent_hz`; limit at the
    /// normal quantile `z` (4.75: one false alarm in a million windows). If not `on`, a source is always consistent.
    pub fn new(on: bool, window_s: Real, independent_hz: Real, z: Real) -> Self {
        Self {
            on,
            window_s,
            limit: chi_square_quantile((2.0 * window_s * independent_hz).max(1.0), z),
            mean: 1.0,
            share: LagShare::default(),
        }
    }

    /// Takes the NIS of an innovation, divided by its degrees of freedom, `period_s` after the last one.
    pub fn observe(&mut self, nis: Real, period_s: Real) {
        let nis = if nis.is_finite() {
            nis.min(STATISTICS.max_nis)
        } else {
            STATISTICS.max_nis
        };
        let share = self.share.of(period_s.min(self.window_s), self.window_s);
        self.mean += share * (nis - self.mean);
    }

    /// Windowed mean, 1 for a consistent filter.
    pub fn mean(&self) -> Real {
        self.mean
    }

    /// Returns true if the mean is within its limit.
    pub fn consistent(&self) -> bool {
        !self.on || self.mean <= self.limit
    }
}

/// Quantile of a χ² variable of `degrees` at the normal quantile `z`, over its degrees.
fn chi_square_quantile(degrees: Real, z: Real) -> Real {
    let a = 2.0 / (9.0 * degrees);
    let root = 1.0 - a + z * sqrt(a);
    root * root * root
}

state!(NisMonitor { mean; on, window_s, limit, share } where |this| this.mean >= 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    #[test]
    fn the_limit_is_the_quantile_of_the_table() {
        // χ² of 20 degrees: 31.41 at 95 %, 45.31 at 99.9 %. Wilson & Hilferty are good to half a percent there.
        assert!((20.0 * chi_square_quantile(20.0, 1.645) / 31.41 - 1.0).abs() < 5e-3);
        assert!((20.0 * chi_square_quantile(20.0, 3.090) / 45.31 - 1.0).abs() < 5e-3);
    }

    #[test]
    fn white_innovations_are_consistent_and_those_of_a_wrong_noise_are_not() {
        let run = |sd: Real| {
            let mut monitor = NisMonitor::new(true, 2.0, 5.0, 4.75);
            let mut random = Random::new(93);
            let good = (0..20_000).filter(|_| {
                monitor.observe((sd * random.normal()).powi(2), 0.01);
                monitor.consistent()
            });
            good.count()
        };
        assert_eq!(run(1.0), 20_000);
        assert!(run(2.5) < 200, "{}", run(2.5)); // lost within two seconds, and for good
        let mut off = NisMonitor::new(false, 2.0, 5.0, 4.75);
        off.observe(1e9, 1.0);
        assert!(off.consistent());
    }

    #[test]
    fn a_bump_does_not_end_validity_and_a_shift_does() {
        let mut monitor = NisMonitor::new(true, 2.0, 5.0, 4.75);
        for _ in 0..2 {
            monitor.observe(1e6, 0.01);
        }
        assert!(monitor.consistent());
        let steps = (1..).find(|_| {
            monitor.observe(1e6, 0.01);
            !monitor.consistent()
        });
        assert!(steps.unwrap() < 30);
        monitor.observe(Real::NAN, 0.01);
        assert!(monitor.mean().is_finite() && monitor.mean() > monitor.limit);
    }

    /// A window of 4 s with 5 independent innovations a second averages over 40: χ² is 73.40 at 99.9 %.
    #[test]
    fn the_limit_goes_by_the_number_of_independent_innovations() {
        let monitor = NisMonitor::new(true, 4.0, 5.0, 3.090);
        assert!(
            (40.0 * monitor.limit / 73.40 - 1.0).abs() < 5e-3,
            "{}",
            monitor.limit
        );
    }
}
