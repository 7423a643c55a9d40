//! Distributed train for a pipeline: aligns samples with the grade map, and gives the offset between the grade at the
//! IMU and the effective grade, the mean over the train's masses ([`MappedTrain`]). For a point the offset is 0 and no
//! sample waits.

use crate::Real;
use crate::api::real::{GRAVITY, PI, asin, sin};
use crate::api::signals::Vehicle;
use crate::api::snapshot::{Blank, state};
use crate::filters::ring_buffer::RingBuffer;
use crate::models::sample::ResampledSample;
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::Resampler;
use crate::rail::grade_map::{AtPlace, LoadedGrade, MappedTrain};
use crate::rail::map_gaps::MapGaps;

/// A distributed train on its grade map, with the samples that wait for rail not yet read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistributedTrain {
    train: MappedTrain,
    /// A point has no offset, and needs no map.
    point: bool,
    /// Signals of the rail at the accelerometer now.
    here: Option<AtPlace>,
    /// Samples, each with its place, that wait until the rail under the front of the train has been read.
    waiting: RingBuffer<(ResampledSample, Real), 32>,
    standstill_mps: Real,
    now: Option<LastKnown>,
    gaps: MapGaps,
    /// Bias of the accelerometer, m/s², and for how long it has been learnt, s.
    bias_mps2: Real,
    learnt_s: Real,
}

/// Length of the train that may be beyond the mapped rail while it still counts as on it, m: the end of the map is
/// extrapolated so far.
const SEEN_M: Real = 4.0;
/// Memory of the accelerometer's bias, s; the time after which it is known, s, and its standard deviation then, m/s².
const BIAS_MEMORY_S: Real = 20.0;
const BIAS_KNOWN_S: Real = 5.0;
const BIAS_SD_MPS2: Real = 0.03;

/// Effective grade and grades at the IMU when the train last moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct LastKnown {
    felt: LoadedGrade,
    /// g sin θ + b at the IMU and under the middle of the unit that carries it, m/s².
    imu: Real,
    unit: Real,
}

/// A sample aligned with the grade map: with the means of the grade where the train was; `felt` is `None` without an
/// accelerometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlignedSample {
    /// The sample.
    pub sample: ResampledSample,
    /// Means over where tare and load rested.
    pub felt: Option<LoadedGrade>,
}

/// Offset of sin θ from that of the effective grade.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GradeOffset {
    /// At the IMU.
    pub imu: Real,
    /// Under the middle of the unit that carries it: what the IMU, which pitches with that unit, reads.
    pub unit: Real,
    /// Standard deviation of both.
    pub sd: Real,
}

impl LastKnown {
    fn point([u, curvature]: AtPlace) -> Self {
        Self {
            felt: LoadedGrade::point([u, curvature]),
            imu: u,
            unit: u,
        }
    }
}

impl DistributedTrain {
    /// Builds the distributed train from the vehicle's nominal values.
    pub fn new(vehicle: &Vehicle, standstill_mps: Option<Real>) -> Self {
        Self {
            train: MappedTrain::new(vehicle),
            point: vehicle.tare_span_m == [0.0; 2]
                && vehicle.load_span_m == [0.0; 2]
                && vehicle.imu_arm_m == 0.0,
            here: None,
            waiting: RingBuffer::new(),
            standstill_mps: vehicle.standstill_mps(standstill_mps),
            now: None,
            gaps: MapGaps::new(vehicle),
            bias_mps2: 0.0,
            learnt_s: 0.0,
        }
    }

    /// One step, with the sample that is new; returns at most one sample whose rail has been read, so that no step has
    /// to serve many. While the train is not `running` nothing will be read: samples then come as they are, one a step.
    /// If too many wait, the oldest comes.
    pub fn step(
        &mut self,
        signals: &Resampler,
        sample: Option<ResampledSample>,
        reading: &Reading,
        running: bool,
        dt: Real,
    ) -> Option<AlignedSample> {
        let delayed_mps = signals.speed_mps();
        let speed = reading.speed_mps.unwrap_or(delayed_mps);
        self.roll(signals.at_place(), delayed_mps, speed, dt);
        let place_m = self.train.place_m();
        let next = match sample {
            Some(sample) if self.point => Some((sample, place_m)),
            Some(sample) => self.waiting.push((sample, place_m)),
            None => None,
        };
        let next = next.or_else(|| self.take(running))?;
        Some(self.ready(next))
    }

    /// The train moves on by one step; see [`MappedTrain::step`].
    pub fn roll(&mut self, place: Option<AtPlace>, delayed_mps: Real, speed_mps: Real, dt: Real) {
        self.here = place;
        let moving = speed_mps.abs() > self.standstill_mps;
        self.gaps.step(place.is_some(), speed_mps.abs() * dt);
        if self.point {
            self.now = place.filter(|_| moving).map(LastKnown::point).or(self.now);
            return;
        }
        self.train.step(place, delayed_mps, speed_mps, dt);
        if moving
            && let Some((felt, imu)) = self.train.felt_now()
            && let Some(unit) = self.train.unit_now()
        {
            self.now = Some(LastKnown { felt, imu, unit });
        }
    }

    /// Returns true if samples wait.
    pub fn is_waiting(&self) -> bool {
        self.waiting.first().is_some()
    }

    /// The next sample whose rail has been read, or any if the train is not `running`.
    fn take(&mut self, running: bool) -> Option<(ResampledSample, Real)> {
        let (_, place_m) = self.waiting.first()?;
        if running && !self.train.seen(place_m) {
            return None;
        }
        self.waiting.pop()
    }

    fn ready(&self, (sample, place_m): (ResampledSample, Real)) -> AlignedSample {
        AlignedSample {
            sample,
            felt: sample.specific_force_mps2.and_then(|_| match self.point {
                true => self.here.map(LoadedGrade::point),
                false => self.felt(place_m),
            }),
        }
    }

    fn felt(&self, place_m: Real) -> Option<LoadedGrade> {
        let mut felt = self.train.felt(place_m)?;
        for mean in [&mut felt.tare, &mut felt.load] {
            mean.doubt_mps2 += GRAVITY * self.gaps.under_rad();
        }
        Some(felt)
    }

    /// Offsets of sin θ at the IMU and under its unit from that of the effective grade of a train of `mass_kg`.
    pub fn ahead(&self, mass_kg: Real) -> GradeOffset {
        let gaps_sd = match self.point {
            true => 0.0,
            false => self.gaps.here_rad() + self.gaps.under_rad(),
        };
        let Some(LastKnown { felt, imu, unit }) = self.now else {
            return GradeOffset {
                sd: gaps_sd,
                ..GradeOffset::default()
            };
        };
        let (mean, doubt) = felt.whole(self.train.tare_kg(), mass_kg);
        GradeOffset {
            imu: (imu - mean) / GRAVITY,
            unit: (unit - mean) / GRAVITY,
            sd: doubt / GRAVITY + gaps_sd,
        }
    }

    /// Learns the bias of the accelerometer from a valid effective grade `theta`, rad: the mean read under the train
    /// less g sin θ, while all rail under the train is on the map.
    pub fn learn_bias(&mut self, mass_kg: Real, theta: Real, dt: Real) {
        let seen = !self.point && self.gaps.here_rad() + self.gaps.under_rad() == 0.0;
        let Some(now) = self.now.filter(|_| seen) else {
            return;
        };
        let (mean, _) = now.felt.whole(self.train.tare_kg(), mass_kg);
        if now.felt.tare.unseen_m <= SEEN_M {
            self.learnt_s = (self.learnt_s + dt).min(BIAS_MEMORY_S);
            let share = dt / self.learnt_s.max(dt);
            self.bias_mps2 += share * (mean - GRAVITY * sin(theta) - self.bias_mps2);
        }
    }

    /// Offset of sin θ at the IMU from that of the effective grade `theta`, rad, and its standard deviation. While the
    /// rail under the train has been seen it is the difference of what has been read, from which the bias drops out;
    /// else what the instrument reads now less the bias known from before.
    pub fn imu_offset(&self, mass_kg: Real, theta: Real) -> (Real, Real) {
        let ahead = self.ahead(mass_kg);
        match self.now {
            Some(now)
                if self.learnt_s >= BIAS_KNOWN_S
                    && self.gaps.here_rad() == 0.0
                    && now.felt.tare.unseen_m > SEEN_M =>
            {
                let reads = (now.imu - self.bias_mps2) / GRAVITY;
                (reads - sin(theta), BIAS_SD_MPS2 / GRAVITY)
            }
            _ => (ahead.imu, ahead.sd),
        }
    }

    /// Mean curvature under the train, 1/m.
    pub fn curvature_per_m(&self) -> Real {
        self.now.map_or(0.0, |now| now.felt.curvature_per_m())
    }

    /// Mass of the empty train, kg.
    pub fn tare_kg(&self) -> Real {
        self.train.tare_kg()
    }
}

/// The grade angle, rad, whose sine is `by` above that of `theta`, within ±90°.
pub fn steeper(theta: Real, by: Real) -> Real {
    if by == 0.0 {
        theta
    } else {
        asin(sin(theta) + by).clamp(-0.5 * PI, 0.5 * PI)
    }
}

impl Blank for LoadedGrade {
    fn blank() -> Self {
        Self::default()
    }
}

impl Blank for LastKnown {
    fn blank() -> Self {
        Self::default()
    }
}

impl Blank for AlignedSample {
    fn blank() -> Self {
        Self::default()
    }
}

state!(LastKnown { felt, imu, unit; });
state!(AlignedSample { sample, felt; });
state!(DistributedTrain { train, here, waiting, now, gaps, bias_mps2, learnt_s; point, standstill_mps });

#[cfg(test)]
#[path = "distributed_train_tests.rs"]
mod tests;
