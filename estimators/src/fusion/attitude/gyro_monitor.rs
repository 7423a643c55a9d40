//! Gyro monitor: wheels that agree with each other and contradict the filter mean that the pitch, the gyro's integral,
//! is wrong.
//!
//! The test is the mean of the innovations over its variance, which finds a wrong gyro much sooner than the mean of
//! their squares: with the wheels' noise white, the variance of the mean is S dt/(2 τ).

use crate::Real;
use crate::aiding::wheels::{AGREE_SD, Ballot, SPREAD};
use crate::api::snapshot::state;

/// Memory of the mean innovation τ, s.
const MEMORY_S: Real = 0.3;
/// Threshold of the square of the mean over its variance, and largest excess that is taken.
const THRESHOLD: Real = 30.0;
const MAX_EXCESS: Real = 20.0;
/// Time that the test must be above its threshold, s: slip is rejected sooner.
const WAIT_S: Real = 0.25;
/// Time for which the monitor rests after a rejected wheel, and after a shock of the accelerometer, s.
const SLIP_REST_S: Real = 1.5;
const SHOCK_REST_S: Real = 0.5;
/// Variance of the pitch that a unit of excess adds, rad²/s.
const DOUBT_RAD2PS: Real = 1.6e-5;
/// Speed from which the monitor works, m/s.
const MIN_SPEED_MPS: Real = 0.05;

/// The monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GyroMonitor {
    on: bool,
    sd_mps: Real,
    mean: Real,
    test: Real,
    above_s: Real,
    rest_s: Real,
}

impl GyroMonitor {
    /// Builds the gyro monitor for wheels of the standard deviation `sd_mps`.
    pub fn new(on: bool, sd_mps: Real) -> Self {
        Self {
            on,
            sd_mps,
            mean: 0.0,
            test: 0.0,
            above_s: 0.0,
            rest_s: 0.0,
        }
    }

    /// The accelerometer has had a shock: the speed has jumped, which is no sign of a wrong pitch.
    pub fn shock(&mut self) {
        (self.mean, self.rest_s) = (0.0, self.rest_s.max(SHOCK_REST_S));
    }

    /// Takes the innovation of the mean of the wheels and its variance; returns by how much the variance of the pitch
    /// grows, rad².
    pub fn step(
        &mut self,
        ballot: &Ballot,
        [y, S]: [Real; 2],
        speed_mps: Real,
        dt: Real,
    ) -> Option<Real> {
        let range = AGREE_SD * self.sd_mps + SPREAD * ballot.speed_mps.abs();
        if ballot.rejected == 0 && (ballot.used == 1 || ballot.range_mps < range) {
            self.mean += (dt / (MEMORY_S + dt)) * (y - self.mean);
        } else {
            (self.mean, self.rest_s) = (0.0, SLIP_REST_S);
        }
        self.rest_s = (self.rest_s - dt).max(0.0);
        self.test = self.mean * self.mean / (S * dt / (2.0 * MEMORY_S)).max(Real::MIN_POSITIVE);
        let excess = (self.test - THRESHOLD).min(MAX_EXCESS);
        let above = speed_mps.abs() > MIN_SPEED_MPS && excess > 0.0 && self.rest_s <= 0.0;
        self.above_s = if above { self.above_s + dt } else { 0.0 };
        (self.on && self.above_s > WAIT_S).then_some(DOUBT_RAD2PS * excess * dt)
    }

    /// Square of the mean innovation over its variance.
    pub fn test(&self) -> Real {
        self.test
    }
}

state!(GyroMonitor { mean, test, above_s, rest_s; on, sd_mps });
