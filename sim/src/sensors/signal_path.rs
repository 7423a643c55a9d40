//! Signal path of an instrument: ideal signal (+ vibration and hits) → bandwidth → sampling → misalignment → errors →
//! faults → stamp → arrival.
//!
//! Between two physics steps the ideal signal is taken as linear, so a value can be taken at any instant between steps.
//! An instrument either reads the signal *at* an instant, or its *mean* since the instant before (integrating sensors:
//! accelerometer, gyro). A mean carries the stamp of the end of its period, as strapdown sensors do.

use super::clock::Clock;
use super::delay_line::{DelayLine, Reading};
use super::error_model::ErrorModel;
use super::fault::{FaultWindow, Faults};
use super::fitting::Fitting;
use super::misalignment;
use super::sampling::Schedule;
use super::shake::{Ride, Shake};
use super::spec::InstrumentSpec;
use super::step_interval::StepInterval;
use super::value_sampler::{SamplingMode, ValueSampler};
use crate::checked::{Finite, NonNegative, Positive};
use crate::error::Error;
use monorig_estimators::Time;
use monorig_estimators::api::signals::Sample;
use nalgebra::{Matrix3, Vector3};

/// Signal path of an instrument of `N` axes, from the ideal signal to samples.
#[derive(Clone, Debug)]
pub struct SignalPath<const N: usize> {
    /// Name, such as `gyro` or `wheel_speed[3]`.
    name: String,
    schedule: Schedule,
    clock: Clock,
    begun: bool,
    signal: ValueSampler<N>,
    shake: Option<Shake<N>>,
    misalignment: Option<Matrix3<f64>>,
    errors: [ErrorModel; N],
    faults: Faults<N>,
    line: DelayLine<N>,
    delivered: Option<Reading<N>>,
}

impl<const N: usize> SignalPath<N> {
    /// The path of the instrument `name`, whose random streams start with that name; `axes` = a name and a known bias
    /// for each axis.
    pub fn new(
        name: &str,
        mode: SamplingMode,
        spec: &InstrumentSpec,
        axes: [(&str, f64); N],
        on: &Fitting<'_>,
    ) -> Self {
        let (sampling, errors, seed) = (&spec.sampling, &spec.errors, on.seed);
        let rate_hz = sampling.rate_hz.get();
        let shares = spec
            .axis_shake
            .map_or([1.0; 3], |shares| shares.map(NonNegative::get));
        let shares = std::array::from_fn(|i| if N == 3 { shares[i] } else { 1.0 });
        Self {
            name: name.into(),
            schedule: Schedule::new(sampling, seed, name),
            clock: Clock::new(&sampling.clock, seed, name),
            begun: false,
            signal: ValueSampler::new(mode, errors.bandwidth_hz.map(Positive::get)),
            shake: Shake::new(errors, mode, shares, on.joints_m, seed, name),
            misalignment: None,
            errors: axes.map(|(axis, bias)| {
                ErrorModel::new(errors, rate_hz, bias, seed, &format!("{name}{axis}"))
            }),
            faults: Faults::new(seed, name),
            line: DelayLine::new(sampling, seed, name),
            delivered: None,
        }
    }

    /// Samples per second, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.schedule.rate_hz()
    }

    /// Adds a fault.
    pub fn add_fault(&mut self, fault: FaultWindow) {
        self.faults.add(fault);
    }

    /// Takes the values that are due while the ideal signal goes from `start` to `end` over `span`, at whose end the
    /// instrument is at `ride`. Spans follow each other without gap; the first may be empty.
    pub fn observe(
        &mut self,
        span: StepInterval,
        ride: Ride,
        start: [f64; N],
        end: [f64; N],
    ) -> Result<(), Error>
    where
        Self: Align<N>,
    {
        let parts = match self.shake {
            Some(_) => Shake::<N>::parts(span),
            None => 1,
        };
        let (mut from_ns, mut from) = (span.from_ns, start);
        for part in 1..=parts {
            let to_ns = span.from_ns + (span.to_ns - span.from_ns) * part / parts;
            let share = part as f64 / parts as f64;
            let to = match part < parts {
                true => std::array::from_fn(|i| start[i] + share * (end[i] - start[i])),
                false => end,
            };
            let here = ride.earlier((span.to_ns - to_ns) as f64 * 1e-9);
            self.observe_part(StepInterval { from_ns, to_ns }, here, from, to)?;
            (from_ns, from) = (to_ns, to);
        }
        Ok(())
    }

    fn observe_part(
        &mut self,
        span: StepInterval,
        ride: Ride,
        start: [f64; N],
        end: [f64; N],
    ) -> Result<(), Error>
    where
        Self: Align<N>,
    {
        let idle = self.begun && self.schedule.next_ns() > span.to_ns;
        if idle && self.shake.is_none() && self.signal.has_no_memory() {
            return Ok(());
        }
        self.signal.begin(span, start, end);
        if let Some(shake) = &mut self.shake {
            shake.advance(span, ride);
        }
        if !self.begun {
            self.begun = true;
            self.schedule.begin_at(span.from_ns);
        }
        while self.schedule.next_ns() <= span.to_ns {
            let instant = self.schedule.take();
            let ideal = self.signal.take(instant.taken_ns);
            let shaken = self.shake.as_mut().and_then(|s| s.take(instant.taken_ns));
            let Some(ideal) = ideal else { continue };
            if ideal.iter().any(|x| !x.is_finite()) {
                return Err(Error::Broken {
                    t_s: instant.stamp_ns as f64 * 1e-9,
                    what: format!(
                        "the {} got the value {ideal:?}, which is not finite",
                        self.name
                    ),
                });
            }
            let stamp_s = instant.stamp_ns as f64 * 1e-9;
            let felt = match shaken {
                Some(shaken) => std::array::from_fn(|i| ideal[i] + shaken[i]),
                None => ideal,
            };
            let aligned = self.align(felt);
            let mut sensed: [f64; N] = std::array::from_fn(|i| self.errors[i].sense(aligned[i]));
            self.faults.disturb(stamp_s, &mut sensed);
            let converted = std::array::from_fn(|i| self.errors[i].convert(sensed[i]));
            match self.faults.hand_over(stamp_s, converted) {
                Some(measured) if !instant.lost => {
                    let reading = Reading {
                        stamp_ns: self.clock.stamp_ns(instant.stamp_ns),
                        measured,
                        ideal,
                    };
                    self.line.send(instant.taken_ns, reading);
                }
                _ => {}
            }
        }
        self.signal.finish();
        if let Some(shake) = &mut self.shake {
            shake.finish();
        }
        Ok(())
    }

    /// Delivers what has arrived by `now_ns` since the last call: nothing, a sample, or what the sheet's `many` makes
    /// of several. A sample of one value has zeros behind it, as a slot of the measurements takes it.
    pub fn deliver(&mut self, now_ns: i64) -> Option<Sample<[f64; 3]>> {
        self.delivered = self.line.receive(now_ns);
        self.delivered.map(|r| sample(r.stamp_ns, r.measured))
    }

    /// Ideal value of the last delivered sample; `None` if the last call delivered no sample.
    pub fn ideal(&self) -> Option<Sample<[f64; 3]>> {
        self.delivered.map(|r| sample(r.stamp_ns, r.ideal))
    }
}

/// A sample of `N` values, filled up with zeros.
fn sample<const N: usize>(stamp_ns: i64, values: [f64; N]) -> Sample<[f64; 3]> {
    Sample {
        t: Time::from_ns(stamp_ns),
        value: std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0)),
    }
}

impl SignalPath<3> {
    /// The path of an inertial instrument: axes x, y, z with their biases, turned against the mount by the misalignment
    /// of the run.
    pub fn inertial(name: &str, spec: &InstrumentSpec, on: &Fitting<'_>) -> Self {
        let [x, y, z] = spec.axis_bias.unwrap_or_default().map(Finite::get);
        let axes = [(".x", x), (".y", y), (".z", z)];
        let mut path = Self::new(name, SamplingMode::Integrating, spec, axes, on);
        path.misalignment = misalignment::draw(spec, on.seed, name);
        path
    }
}

impl SignalPath<1> {
    /// The path of an instrument with one reading.
    pub fn scalar(name: &str, mode: SamplingMode, spec: &InstrumentSpec, on: &Fitting<'_>) -> Self {
        Self::new(name, mode, spec, [("", 0.0)], on)
    }
}

/// Turns values from the axes of the mount to the axes of the sensor.
pub trait Align<const N: usize> {
    /// The vector in sensor axes.
    fn align(&self, v: [f64; N]) -> [f64; N];
}

impl Align<1> for SignalPath<1> {
    fn align(&self, v: [f64; 1]) -> [f64; 1] {
        v
    }
}

impl Align<3> for SignalPath<3> {
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
    use crate::sensors::spec::{HitSpec, Sampling, VibrationSpec};

    fn sampling(rate_hz: f64, latency_ms: f64, jitter_ms: f64) -> Sampling {
        Sampling {
            latency_ms: NonNegative::new(latency_ms),
            jitter_ms: NonNegative::new(jitter_ms),
            ..Sampling::at(rate_hz)
        }
    }

    /// Run on the signal x(t) in steps of 2 ms; all samples with the instant each was handed over at.
    fn run(
        path: &mut SignalPath<1>,
        x: impl Fn(f64) -> f64,
        seconds: f64,
    ) -> Vec<(f64, Sample<[f64; 3]>)> {
        let steps = (seconds / 0.002).round() as i64;
        let mut seen = Vec::new();
        for k in 0..steps {
            let span = StepInterval {
                from_ns: k * 2_000_000,
                to_ns: (k + 1) * 2_000_000,
            };
            let t = |ns: i64| x(ns as f64 * 1e-9);
            path.observe(span, Ride::default(), [t(span.from_ns)], [t(span.to_ns)])
                .unwrap();
            if let Some(sample) = path.deliver(span.to_ns) {
                seen.push((span.to_ns as f64 * 1e-9, sample));
            }
        }
        seen
    }

    fn path(mode: SamplingMode, sampling: Sampling) -> SignalPath<1> {
        let spec = InstrumentSpec {
            sampling,
            ..InstrumentSpec::default()
        };
        let train = crate::sensors::behaviour::train(1);
        SignalPath::scalar("test", mode, &spec, &Fitting::new(&train, 9.81, 1))
    }

    /// A ramp is linear between steps: every value must be that of its own stamp, also for stamps between steps.
    #[test]
    fn values_are_taken_between_steps() {
        for rate in [200.0, 150.0, 100.0, 50.0, 7.0] {
            let seen = run(
                &mut path(SamplingMode::Instant, sampling(rate, 0.0, 0.0)),
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

    /// A step is shaken in parts of at most 2 ms: samples in steps of 4 ms are those in steps of 2 ms.
    #[test]
    fn a_step_of_4_ms_shakes_as_two_of_2_ms() {
        let mut spec = InstrumentSpec {
            sampling: sampling(100.0, 0.0, 0.0),
            ..InstrumentSpec::default()
        };
        spec.errors.vibration = Some(VibrationSpec {
            sd: NonNegative::new(1.0),
            full_mps: Positive::new(0.5),
            band_hz: [4.0, 15.0].map(Positive::new),
        });
        spec.errors.hits = Some(HitSpec {
            size: [2.0, 4.0].map(NonNegative::new),
            duration_ms: Positive::new(14.0),
            per_m: NonNegative::new(3.0),
            at_joints: false,
        });
        let train = crate::sensors::behaviour::train(1);
        let shaking = |step_ns: i64| -> Vec<f64> {
            let on = Fitting::new(&train, 9.81, 1);
            let mut path = SignalPath::scalar("test", SamplingMode::Instant, &spec, &on);
            let samples = (0..20_000_000_000 / step_ns).filter_map(|k| {
                let (from_ns, to_ns) = (k * step_ns, (k + 1) * step_ns);
                let [start, end] = [from_ns, to_ns].map(|ns| ns as f64 * 1e-9);
                let ride = Ride {
                    chainage_m: end,
                    speed_mps: 1.0,
                };
                let span = StepInterval { from_ns, to_ns };
                path.observe(span, ride, [start], [end]).unwrap();
                path.deliver(to_ns).map(|s| s.value[0] - s.t.s())
            });
            samples.collect()
        };
        let (short, long) = (shaking(2_000_000), shaking(4_000_000));
        let size = short.iter().map(|x| x * x).sum::<f64>() / short.len() as f64;
        assert!(size > 0.5 && short.iter().any(|x| x.abs() > 3.5), "{size}");
        assert!(short.len() > 1990 && short.len().abs_diff(long.len()) <= 1);
        assert!(short.iter().zip(&long).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    /// The mean of t over a period ending at its stamp is the stamp less half a period.
    #[test]
    fn means_cover_exactly_their_period() {
        for rate in [200.0, 150.0, 50.0] {
            let seen = run(
                &mut path(SamplingMode::Integrating, sampling(rate, 0.0, 0.0)),
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
            &mut path(SamplingMode::Instant, sampling(100.0, 33.0, 0.0)),
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
            &mut path(SamplingMode::Instant, sampling(100.0, 0.0, 1.0)),
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

    /// Jitter may put two instants into one step: then their mean is handed over, with the mean of their stamps. None
    /// is left out, none changes places.
    #[test]
    fn two_samples_of_a_step_come_as_their_mean() {
        let seen = run(
            &mut path(SamplingMode::Instant, sampling(500.0, 0.0, 0.4)),
            |t| t,
            10.0,
        );
        let mut halves = 0;
        for pair in seen.windows(2) {
            let periods = (pair[1].1.t.s() - pair[0].1.t.s()) / 0.002;
            assert!((1.0 - 1e-6..2.0 + 1e-6).contains(&periods), "{periods}");
            halves += usize::from((periods - 1.5).abs() < 1e-6);
        }
        assert!(halves > 100, "{halves}");
        for (_, s) in &seen {
            // 0.49 of a period is the most that jitter shifts.
            assert!((s.value[0] - s.t.s()).abs() < 0.001);
        }
    }

    #[test]
    fn a_signal_that_is_not_finite_is_reported_with_its_instrument() {
        let mut path = path(SamplingMode::Instant, sampling(200.0, 0.0, 0.0));
        let result = path.observe(
            StepInterval {
                from_ns: 0,
                to_ns: 2_000_000,
            },
            Ride::default(),
            [f64::NAN],
            [f64::NAN],
        );
        assert!(matches!(result, Err(Error::Broken { what, .. }) if what.contains("test")));
    }
}
