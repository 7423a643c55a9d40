//! The clock of an instrument: it stamps the instant t with t + offset + drift·t.

use super::spec::ClockSpec;
use super::stream::Stream;

/// A clock during one run.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    offset_ns: i64,
    drift: f64,
}

impl Clock {
    /// Offset and drift of a run: the known parts plus those drawn.
    pub fn new(spec: &ClockSpec, seed: u64, name: &str) -> Self {
        let mut stream = Stream::new(seed, &format!("{name}/clock"));
        let offset_ms = spec.offset_ms.get() + spec.offset_sd_ms.get() * stream.normal();
        Self {
            offset_ns: libm::round(offset_ms * 1e6) as i64,
            drift: 1e-6 * (spec.drift_ppm.get() + spec.drift_sd_ppm.get() * stream.normal()),
        }
    }

    /// The stamp of the instant `t_ns`, ns.
    pub fn stamp_ns(&self, t_ns: i64) -> i64 {
        t_ns + self.offset_ns + libm::round(self.drift * t_ns as f64) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{Finite, NonNegative};

    #[test]
    fn it_is_off_by_its_offset_and_by_its_drift_times_the_time() {
        let spec = ClockSpec {
            offset_ms: Finite::new(-30.0),
            drift_ppm: Finite::new(100.0),
            ..ClockSpec::default()
        };
        let clock = Clock::new(&spec, 1, "s");
        for hours in 0..24_i64 {
            let t = hours * 3_600_000_000_000;
            assert_eq!(clock.stamp_ns(t), t - 30_000_000 + hours * 360_000_000);
        }
    }

    #[test]
    fn a_right_clock_stamps_to_the_nanosecond() {
        let clock = Clock::new(&ClockSpec::default(), 1, "s");
        for t in [0, 1, 86_400_000_000_001] {
            assert_eq!(clock.stamp_ns(t), t);
        }
    }

    #[test]
    fn drawn_offsets_and_drifts_have_their_spread() {
        let spec = ClockSpec {
            offset_sd_ms: NonNegative::new(20.0),
            drift_sd_ppm: NonNegative::new(50.0),
            ..ClockSpec::default()
        };
        let runs = 10_000;
        let (mut offsets, mut drifts) = (0.0, 0.0);
        for seed in 0..runs {
            let clock = Clock::new(&spec, seed, "s");
            offsets += (clock.stamp_ns(0) as f64 * 1e-6).powi(2);
            let second = clock.stamp_ns(1_000_000_000) - clock.stamp_ns(0) - 1_000_000_000;
            drifts += (second as f64 * 1e-3).powi(2);
        }
        let bound = 5.0 * f64::sqrt(2.0 / runs as f64);
        assert!((offsets / runs as f64 / 400.0 - 1.0).abs() < bound);
        // Drifts are seen in steps of 1 ns in a second, 10⁻³ of a millionth.
        assert!((drifts / runs as f64 / 2500.0 - 1.0).abs() < bound);
    }
}
