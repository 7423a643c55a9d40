//! What all instruments have in common: ideal signal → bandwidth → sampling → misalignment → errors → faults → latency.
//!
//! Between two physics steps the ideal signal is taken as linear, so a value can be taken at any instant between steps.
//! An instrument either reads the signal *at* an instant, or its *mean* since the instant before (integrating sensors:
//! accelerometer, gyro). A mean carries the stamp of the end of its period, as strapdown sensors do.

use super::error_model::ErrorModel;
use super::fault::{Faults, Window};
use super::low_pass::LowPass;
use super::sampling::{DelayLine, Reading, Schedule};
use crate::config::sensor_sheet_file::{Errors, Sampling};
use crate::error::Error;
use monorig_estimators::Time;
use monorig_estimators::api::signals::Sample;
use nalgebra::{Matrix3, Vector3};

/// Interval of time from one physics step to the next, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepInterval {
    /// Begin.
    pub from_ns: i64,
    /// End; not before the begin.
    pub to_ns: i64,
}

/// Sampling mode of an instrument: what one value stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplingMode {
    /// The signal at the instant.
    Instant,
    /// The mean of the signal since the instant before.
    Integrating,
}

/// One instrument of `N` axes.
#[derive(Clone, Debug)]
pub struct Instrument<const N: usize> {
    /// Such as `gyro` or `wheel_speed[3]`.
    name: String,
    mode: SamplingMode,
    schedule: Schedule,
    begun: bool,
    low_pass: Option<LowPass<N>>,
    /// Integral of the signal since `since_ns`, unit·ns; `None` before the first instant.
    since_ns: Option<i64>,
    integral: [f64; N],
    misalignment: Option<Matrix3<f64>>,
    errors: [ErrorModel; N],
    faults: Faults<N>,
    line: DelayLine<N>,
    delivered: Option<Reading<N>>,
}

impl<const N: usize> Instrument<N> {
    /// An instrument as the sheet has it; `axes` = a name and a known bias for each axis.
    pub fn new(
        name: &str,
        mode: SamplingMode,
        (sampling, errors): (&Sampling, &Errors),
        axes: [(&str, f64); N],
        seed: u64,
    ) -> Self {
        let rate_hz = sampling.rate_hz.get();
        Self {
            name: name.into(),
            mode,
            schedule: Schedule::new(sampling, seed, name),
            begun: false,
            low_pass: errors.bandwidth_hz.map(|f| LowPass::new(f.get())),
            since_ns: None,
            integral: [0.0; N],
            misalignment: None,
            errors: axes.map(|(axis, bias)| {
                ErrorModel::new(errors, rate_hz, bias, seed, &format!("{name}{axis}"))
            }),
            faults: Faults::new(seed, name),
            line: DelayLine::new(sampling),
            delivered: None,
        }
    }

    /// Add a fault.
    pub fn add_fault(&mut self, window: Window) {
        self.faults.add(window);
    }

    /// The ideal signal goes from `start` to `end` over `span`: take the values that are due. Spans follow each other
    /// without gap; the first may be empty.
    pub fn observe(
        &mut self,
        span: StepInterval,
        start: [f64; N],
        end: [f64; N],
    ) -> Result<(), Error>
    where
        Self: Align<N>,
    {
        let length_ns = span.to_ns - span.from_ns;
        let (start, end) = match &mut self.low_pass {
            Some(filter) => filter.pass(length_ns, start, end),
            None => (start, end),
        };
        let at = |t_ns: i64| -> [f64; N] {
            if t_ns >= span.to_ns {
                return end;
            }
            let share = (t_ns - span.from_ns) as f64 / length_ns as f64;
            std::array::from_fn(|i| start[i] + share * (end[i] - start[i]))
        };
        if !self.begun {
            self.begun = true;
            self.schedule.begin_at(span.from_ns);
        }
        let mut here_ns = span.from_ns;
        while self.schedule.next_ns() <= span.to_ns {
            let instant = self.schedule.take();
            let ideal = match self.mode {
                SamplingMode::Instant => Some(at(instant.taken_ns)),
                SamplingMode::Integrating => {
                    self.integrate(here_ns, instant.taken_ns, at);
                    here_ns = instant.taken_ns;
                    self.close_period(instant.taken_ns)
                }
            };
            let Some(ideal) = ideal else { continue };
            if ideal.iter().any(|x| !x.is_finite()) {
                return Err(Error::Broken {
                    t_s: instant.stamp_ns as f64 * 1e-9,
                    what: format!(
                        "the {} was to measure {ideal:?}, which is not finite",
                        self.name
                    ),
                });
            }
            let stamp_s = instant.stamp_ns as f64 * 1e-9;
            let aligned = self.align(ideal);
            let mut sensed: [f64; N] = std::array::from_fn(|i| self.errors[i].sense(aligned[i]));
            self.faults.disturb(stamp_s, &mut sensed);
            let converted = std::array::from_fn(|i| self.errors[i].convert(sensed[i]));
            match self.faults.hand_over(stamp_s, converted) {
                Some(measured) if !instant.lost => {
                    let reading = Reading {
                        stamp_ns: instant.stamp_ns,
                        measured,
                        ideal,
                    };
                    self.line.send(instant.taken_ns, reading);
                }
                _ => {}
            }
        }
        if self.mode == SamplingMode::Integrating {
            self.integrate(here_ns, span.to_ns, at);
        }
        Ok(())
    }

    /// The sample that has arrived by `now_ns`, if any.
    pub fn deliver(&mut self, now_ns: i64) -> Option<Sample<[f64; N]>> {
        self.delivered = self.line.receive(now_ns);
        self.delivered.map(|r| Sample {
            t: Time::from_ns(r.stamp_ns),
            value: r.measured,
        })
    }

    /// The ideal value behind the sample last delivered; `None` when the last call delivered none.
    pub fn ideal(&self) -> Option<Sample<[f64; N]>> {
        self.delivered.map(|r| Sample {
            t: Time::from_ns(r.stamp_ns),
            value: r.ideal,
        })
    }

    fn integrate(&mut self, from_ns: i64, to_ns: i64, at: impl Fn(i64) -> [f64; N]) {
        if self.since_ns.is_some() && to_ns > from_ns {
            let (a, b) = (at(from_ns), at(to_ns));
            let half = 0.5 * (to_ns - from_ns) as f64;
            for i in 0..N {
                self.integral[i] += half * (a[i] + b[i]);
            }
        }
    }

    /// End a period: its mean, or `None` for the first instant, which only opens one.
    fn close_period(&mut self, now_ns: i64) -> Option<[f64; N]> {
        let mean = self
            .since_ns
            .map(|since| self.integral.map(|x| x / (now_ns - since) as f64));
        self.since_ns = Some(now_ns);
        self.integral = [0.0; N];
        mean
    }
}

impl Instrument<3> {
    /// Turn the sensor's axes: `matrix` takes a vector from mount axes to sensor axes.
    pub fn misalign(&mut self, matrix: Option<Matrix3<f64>>) {
        self.misalignment = matrix;
    }
}

/// From the axes of the mount to those of the sensor.
pub trait Align<const N: usize> {
    /// The vector in sensor axes.
    fn align(&self, v: [f64; N]) -> [f64; N];
}

impl Align<1> for Instrument<1> {
    fn align(&self, v: [f64; 1]) -> [f64; 1] {
        v
    }
}

impl Align<3> for Instrument<3> {
    fn align(&self, v: [f64; 3]) -> [f64; 3] {
        match &self.misalignment {
            Some(matrix) => (matrix * Vector3::from(v)).into(),
            None => v,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::checked::{Fraction, NonNegative, Positive};

    fn sampling(rate_hz: f64, latency_ms: f64, jitter_ms: f64) -> Sampling {
        Sampling {
            rate_hz: Positive::try_from(rate_hz).unwrap(),
            latency_ms: NonNegative::try_from(latency_ms).unwrap(),
            jitter_ms: NonNegative::try_from(jitter_ms).unwrap(),
            dropout: Fraction::try_from(0.0).unwrap(),
        }
    }

    /// Run on the signal x(t) in steps of 2 ms; all samples with the instant each was handed over at.
    fn run(
        instrument: &mut Instrument<1>,
        x: impl Fn(f64) -> f64,
        seconds: f64,
    ) -> Vec<(f64, Sample<[f64; 1]>)> {
        let steps = (seconds / 0.002).round() as i64;
        let mut seen = Vec::new();
        for k in 0..steps {
            let span = StepInterval {
                from_ns: k * 2_000_000,
                to_ns: (k + 1) * 2_000_000,
            };
            let t = |ns: i64| x(ns as f64 * 1e-9);
            instrument
                .observe(span, [t(span.from_ns)], [t(span.to_ns)])
                .unwrap();
            if let Some(sample) = instrument.deliver(span.to_ns) {
                seen.push((span.to_ns as f64 * 1e-9, sample));
            }
        }
        seen
    }

    fn instrument(mode: SamplingMode, sampling: Sampling) -> Instrument<1> {
        Instrument::new(
            "test",
            mode,
            (&sampling, &Errors::default()),
            [("", 0.0)],
            1,
        )
    }

    /// A ramp is linear between steps: every value must be that of its own stamp, also for stamps between steps.
    #[test]
    fn values_are_taken_between_steps() {
        for rate in [200.0, 150.0, 100.0, 50.0, 7.0] {
            let seen = run(
                &mut instrument(SamplingMode::Instant, sampling(rate, 0.0, 0.0)),
                |t| 3.0 * t,
                10.0,
            );
            assert!((seen.len() as f64 - 10.0 * rate).abs() <= 1.0);
            for (k, (handed_over, sample)) in seen.iter().enumerate() {
                assert!((sample.t.s() - k as f64 / rate).abs() < 1e-9);
                assert!((sample.value[0] - 3.0 * sample.t.s()).abs() < 1e-9);
                assert!((0.0..0.002 + 1e-9).contains(&(handed_over - sample.t.s())));
            }
        }
    }

    /// The mean of t over a period ending at its stamp is the stamp less half a period.
    #[test]
    fn means_cover_exactly_their_period() {
        for rate in [200.0, 150.0, 50.0] {
            let seen = run(
                &mut instrument(SamplingMode::Integrating, sampling(rate, 0.0, 0.0)),
                |t| t,
                5.0,
            );
            assert!(
                (seen[0].1.t.s() - 1.0 / rate).abs() < 1e-9,
                "no sample before a full period"
            );
            for (_, sample) in &seen {
                assert!((sample.value[0] - (sample.t.s() - 0.5 / rate)).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn a_late_sample_keeps_its_stamp_and_value() {
        let seen = run(
            &mut instrument(SamplingMode::Instant, sampling(100.0, 33.0, 0.0)),
            |t| t,
            2.0,
        );
        assert!(seen.len() > 190);
        for (handed_over, sample) in seen {
            assert!((sample.value[0] - sample.t.s()).abs() < 1e-9);
            let late = handed_over - sample.t.s();
            assert!((0.033 - 1e-9..0.035 + 1e-9).contains(&late), "{late}");
        }
    }

    /// On a ramp of slope 1 the error of a value is the jitter of its instant, in seconds.
    #[test]
    fn jitter_shows_as_error_of_a_moving_signal() {
        let seen = run(
            &mut instrument(SamplingMode::Instant, sampling(100.0, 0.0, 1.0)),
            |t| t,
            200.0,
        );
        let n = seen.len() as f64;
        assert!(n > 19_990.0);
        let variance = seen
            .iter()
            .map(|(_, s)| (s.value[0] - s.t.s()).powi(2))
            .sum::<f64>()
            / n;
        assert!(
            (variance / 1e-6 - 1.0).abs() < 5.0 * f64::sqrt(2.0 / n),
            "{variance}"
        );
    }

    /// Jitter may put two instants into one step: none may get lost, none may change places.
    #[test]
    fn one_sample_a_step_at_most_and_none_lost() {
        let seen = run(
            &mut instrument(SamplingMode::Instant, sampling(500.0, 0.0, 0.4)),
            |t| t,
            10.0,
        );
        assert!(seen.len() >= 4997, "{}", seen.len());
        for pair in seen.windows(2) {
            assert!((pair[1].1.t.s() - pair[0].1.t.s() - 0.002).abs() < 1e-9);
        }
    }

    #[test]
    fn a_signal_that_is_not_finite_is_reported_with_its_instrument() {
        let mut i = instrument(SamplingMode::Instant, sampling(200.0, 0.0, 0.0));
        let result = i.observe(
            StepInterval {
                from_ns: 0,
                to_ns: 2_000_000,
            },
            [f64::NAN],
            [f64::NAN],
        );
        assert!(matches!(result, Err(Error::Broken { what, .. }) if what.contains("test")));
    }
}
