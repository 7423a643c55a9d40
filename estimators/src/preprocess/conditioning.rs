//! Conditioning of the channels for robust estimators: outlier hold and noise learning.

use crate::Real;
use crate::api::params::{choices, params};
use crate::api::reading::LearntNoise;
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::instruments::noise_learning::NoiseLearning;
use crate::instruments::spike_gate::{SpikeGate, SpikeLimits};

choices! {
    /// Source of the noise of wheel speed and accelerometer.
    NoiseSource {
        /// From the parameters.
        Told = "told",
        /// From the samples, if they are noisier than the parameters.
        Learnt = "learnt",
    }
}

params! {
    /// Conditioning of the channels.
    ConditioningParams {
        outlier_hold [flag] = true, "Reject jumps of wheel speed that last for less than 0.2 s (joints, bumps).";
        noise [choice NoiseSource] = NoiseSource::Learnt, "Noise of wheel speed and accelerometer: from the parameters, or learnt from the samples if they are noisier (up to thirty times).";
    }
}

/// Outlier hold of wheel speed, by the largest acceleration of wheels that roll on a rail and on a road; longest jump
/// of a recorded drive: 0.154 s.
const SPEED_LIMITS: [SpikeLimits; 2] = [
    SpikeLimits {
        floor: 0.05,
        rate: 3.0,
        longest: 0.2,
        keeps_integral: false,
    },
    SpikeLimits {
        floor: 0.05,
        rate: 12.0,
        longest: 0.2,
        keeps_integral: false,
    },
];

/// Largest gap between samples from which noise can be learnt, s.
const MAX_NOISE_PERIOD_S: Real = 0.3;

/// Conditioning of the channels of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioning {
    params: ConditioningParams,
    speed: SpikeGate<1>,
    noise: [NoiseLearning; 2],
}

impl Conditioning {
    /// Builds the conditioning for a vehicle.
    pub fn new(vehicle: &Vehicle, params: ConditioningParams) -> Self {
        let [rail, road] = SPEED_LIMITS;
        let speed = if vehicle.road.is_some() { road } else { rail };
        Self {
            params,
            speed: SpikeGate::new(speed),
            noise: [NoiseLearning::of_speed(), NoiseLearning::of_acceleration()],
        }
    }

    /// Takes a new speed of the wheels, m/s, `period_s` after the last speed; `None` if the speed is rejected.
    pub fn speed(&mut self, speed_mps: Real, period_s: Real, standing: bool) -> Option<Real> {
        let [passed] = match self.params.outlier_hold {
            true => self.speed.take([speed_mps], period_s)?,
            false => [speed_mps],
        };
        let [noise, _] = &mut self.noise;
        if !standing && period_s < MAX_NOISE_PERIOD_S {
            noise.observe(passed, period_s);
        }
        Some(passed)
    }

    /// The last accepted speed, m/s.
    pub fn last_speed(&self) -> Option<Real> {
        self.speed.value().map(|[speed]| speed)
    }

    /// Takes a new specific force along the train, m/s², `period_s` after the last one.
    ///
    /// Nothing of it is held out: a hit at a joint is a real acceleration whose integral vanishes, and what is cut off
    /// one of its halves stays as a velocity.
    pub fn force(&mut self, force_mps2: Real, period_s: Real, standing: bool) {
        let [_, noise] = &mut self.noise;
        if !standing && period_s < MAX_NOISE_PERIOD_S {
            noise.observe(force_mps2, period_s);
        }
    }

    /// The noise learnt so far.
    pub fn learnt_noise(&self) -> LearntNoise {
        if self.params.noise == NoiseSource::Told {
            return LearntNoise::default();
        }
        let [speed, force] = &self.noise;
        LearntNoise {
            wheel_speed_mps: speed.sd(),
            specific_force_mps2: force.sd(),
        }
    }
}

state!(Conditioning { speed, noise; params });

#[cfg(test)]
#[path = "conditioning_tests.rs"]
mod tests;
