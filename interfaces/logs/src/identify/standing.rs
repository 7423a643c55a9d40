//! Samples of a log's IMU while the vehicle stands: its noise by averaging time (Allan deviation) is computed from
//! them.

use crate::drive::{Drive, Plan, calibrate};
use crate::map::{Many, Map};
use monorig_estimators::Time;
use monorig_estimators::api::signals::{MAX_DRIVES, Sample};
use monorig_sim::config::checked::Positive;
use monorig_sim::error::Error;

/// Faster than this is not standing, m/s.
const STANDING_MPS: f64 = 0.02;
/// Samples do not count this long after the vehicle has come to rest, and this long before it starts, s.
const SETTLING_S: f64 = 1.0;
/// Shortest stretch, s.
const SHORTEST_S: f64 = 10.0;
/// A longer gap between two samples ends a stretch, s.
const MAX_GAP_S: f64 = 0.5;
/// Steps in which the log is read, Hz: each sample by itself, where an instrument has no more.
const RATE_HZ: f64 = 1000.0;
/// Most samples of an instrument that are kept.
const MAX_SAMPLES: usize = 4_000_000;

/// An instrument of three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instrument {
    /// Accelerometer, m/s².
    SpecificForce,
    /// Gyro, rad/s.
    AngularRate,
}

/// An axis of an instrument while the vehicle stands.
#[derive(Clone, Debug)]
pub struct StandingAxis {
    /// The instrument.
    pub instrument: Instrument,
    /// `forward`, `left` or `up`.
    pub axis: &'static str,
    /// Samples (m/s² or rad/s), a list for each stretch.
    pub pieces: Vec<Vec<f64>>,
    /// Mean time between two of them, s.
    pub period_s: f64,
}

/// A stretch of one instrument.
type Stretch = Vec<Sample<[f64; 3]>>;

/// Stretches of an instrument: those that are whole, and the one that goes on.
#[derive(Default)]
struct Stretches {
    whole: Vec<Stretch>,
    now: Stretch,
    samples: usize,
}

impl Stretches {
    fn add(&mut self, sample: Sample<[f64; 3]>) {
        let gap = |last: &Sample<[f64; 3]>| seconds(last.t, sample.t) > MAX_GAP_S;
        if self.now.last().is_some_and(gap) {
            self.end(sample.t, 0.0);
        }
        if self.samples < MAX_SAMPLES {
            self.samples += 1;
            self.now.push(sample);
        }
    }

    /// The stretch is over at `t`, and its last `settling_s` (s) do not count.
    fn end(&mut self, t: Time, settling_s: f64) {
        let mut stretch = std::mem::take(&mut self.now);
        stretch.retain(|s| seconds(s.t, t) >= settling_s);
        let ends = stretch.first().zip(stretch.last());
        if ends.is_some_and(|(a, b)| seconds(a.t, b.t) >= SHORTEST_S) {
            self.whole.push(stretch);
        }
    }

    fn axes(&self, instrument: Instrument) -> impl Iterator<Item = StandingAxis> {
        let ends = self.whole.iter().filter_map(|s| s.first().zip(s.last()));
        let time_s: f64 = ends.map(|(a, b)| seconds(a.t, b.t)).sum();
        let steps: usize = self.whole.iter().map(|s| s.len() - 1).sum();
        let axes = ["forward", "left", "up"].into_iter().zip(0..);
        axes.filter(move |_| steps > 0)
            .map(move |(axis, i): (_, usize)| {
                let piece = |stretch: &Stretch| -> Vec<f64> {
                    let values = stretch.iter().map(|s| s.value.get(i).copied());
                    values.flatten().collect()
                };
                StandingAxis {
                    instrument,
                    axis,
                    pieces: self.whole.iter().map(piece).collect(),
                    period_s: time_s / steps as f64,
                }
            })
    }
}

fn seconds(from: Time, to: Time) -> f64 {
    to.ns().saturating_sub(from.ns()) as f64 * 1e-9
}

/// The axes of the IMU while all wheels stand, of stretches of 10 s and more; none where there is no such stretch.
pub fn standing(map: &Map) -> Result<Vec<StandingAxis>, Error> {
    let mut plan = Plan::new(map)?;
    calibrate(map, &mut plan)?;
    let mut each = map.clone();
    each.file.step.rate_hz = Positive::new(RATE_HZ);
    each.file.step.many = Many::Newest;
    let mut drive = Drive::open(&each, &plan)?;
    let (mut wheels, mut turned_at): ([Option<f64>; MAX_DRIVES], Option<Time>) = Default::default();
    let (mut force, mut rate) = (Stretches::default(), Stretches::default());
    let (mut segment, mut last) = (0, Time::from_ns(0));
    while let Some(step) = drive.next(&each)? {
        let t = Time::from_ns(step.t_ns);
        for (wheel, sample) in wheels.iter_mut().zip(&step.z.wheel_speed_mps) {
            *wheel = sample.map(|s| s.value.abs()).or(*wheel);
        }
        let mut known = wheels.iter().flatten().peekable();
        let stands = known.peek().is_some() && known.all(|v| *v <= STANDING_MPS);
        if !stands || step.segment != segment {
            // the time before a gap is not followed by a start
            let settling_s = if stands { 0.0 } else { SETTLING_S };
            let end = if stands { last } else { t };
            force.end(end, settling_s);
            rate.end(end, settling_s);
            segment = step.segment;
            turned_at = Some(t);
        }
        last = t;
        if !stands || turned_at.is_some_and(|turned| seconds(turned, t) < SETTLING_S) {
            continue;
        }
        if let Some(sample) = step.z.specific_force_mps2 {
            force.add(sample);
        }
        if let Some(sample) = step.z.angular_rate_radps {
            rate.add(sample);
        }
    }
    force.end(last, 0.0);
    rate.end(last, 0.0);
    let force = force.axes(Instrument::SpecificForce);
    Ok(force.chain(rate.axes(Instrument::AngularRate)).collect())
}
