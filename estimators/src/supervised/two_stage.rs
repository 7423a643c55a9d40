//! Mass by a regression, then slope by the force balance with that mass: the two stages of Liu et al. 2023.

use crate::Real;
use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::{State, state};
use crate::detect::control::{self, Control};
use crate::detect::observability::GradeObservability;
use crate::detect::slip::SlipDetector;
use crate::models::force_balance::{Drive, ForceBalance};
use crate::runner::copy_into;
use crate::supervised::force_balance_ekf::ForceBalanceEkf;
use crate::supervised::pipeline::{Step, SupervisedMethod};
use crate::supervised::sample::BalanceSample;

params! {
    /// Supervisor of the second stage.
    SlipSupervision {
        slip_detector [flag] = true, "The method's grade does not count while wheel speed does not follow the force balance.";
    }
}

/// The traction that keeps the speed on a grade: sin θ + s μ cos θ = F/(M g).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyTraction {
    /// Traction F at the rims, N.
    pub traction_n: Real,
    /// Grade angle θ, rad: sine and cosine.
    pub sin_cos: [Real; 2],
    /// Direction of travel s, ±1.
    pub direction: Real,
    /// Running-resistance coefficient μ.
    pub mu: Real,
}

impl SteadyTraction {
    /// ∂(sin θ + s μ cos θ)/∂θ: an error of F/(M g) divided by it is one of θ. Not below 0.1, which no grade of a rail
    /// comes near.
    pub fn by_theta(&self) -> Real {
        let [sine, cosine] = self.sin_cos;
        (cosine - self.direction * self.mu * sine).max(0.1)
    }
}

/// A first stage: something that learns the mass while the train runs.
pub trait MassEstimator: Copy {
    /// Names of [`MassEstimator::internals`].
    const INTERNALS: &'static [Internal; 6];

    /// Takes a sample of the force balance and returns its status.
    fn sample(&mut self, sample: &BalanceSample, balance: &ForceBalance) -> AidStatus;

    /// The train stands, brakes, or has not run long enough for samples to count.
    fn pause(&mut self) {}

    /// Another load may hang on the train, which has stood.
    fn open_load(&mut self) {}

    /// Total mass, kg.
    fn mass_kg(&self) -> Value;

    /// Running-resistance coefficient to go with that mass on rail of this horizontal curvature, 1/m.
    fn running_resistance(&self, curvature_per_m: Real) -> Real;

    /// Standard deviation, rad, that the uncertainty of mass and resistance gives to a slope computed from the force
    /// balance with the traction of `steady`.
    fn slope_sd_rad(&self, steady: &SteadyTraction, curvature_per_m: Real) -> Real;

    /// Standard deviation of the errors of the force balance beyond the noise of the parameters, m/s²: an error of the
    /// slope by this over g.
    fn unmodelled_mps2(&self) -> Real {
        0.0
    }

    /// Returns true if its last sample was excited.
    fn excited(&self) -> bool {
        true
    }

    /// Returns true if a limit acts.
    fn saturated(&self) -> bool;

    /// Its own quantities, for plots.
    fn internals(&self, curvature_per_m: Real) -> [Real; 6];
}

/// Mass first, then slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoStage<M> {
    /// Constants of the force balance.
    balance: ForceBalance,
    /// First stage.
    mass: M,
    /// Second stage.
    slope: ForceBalanceEkf,
    slip: SlipDetector,
    observability: GradeObservability,
    curvature_per_m: Real,
    /// Effective grade of the last step, rad.
    grade: Value,
}

impl<M: MassEstimator> TwoStage<M> {
    /// Builds the method from its two stages; `slip_detector`: no grade of its own is valid while the wheels slip.
    pub fn new(vehicle: &Vehicle, mass: M, slope: ForceBalanceEkf, slip_detector: bool) -> Self {
        Self {
            balance: ForceBalance::new(vehicle),
            mass,
            slope,
            slip: SlipDetector::new(slip_detector),
            observability: GradeObservability::default(),
            curvature_per_m: 0.0,
            grade: Value::default(),
        }
    }

    /// Second stage: predict by the force balance, correct by wheel speed.
    fn filter_slope(&mut self, drive: Option<Drive>, now: &Step) {
        self.slope.learn_noise(&now.reading.noise);
        self.slope.predict(drive, now.dt);
        if now.moving && drive.is_none() {
            self.slope.drift(now.dt);
            self.observability.lose();
        }
        if let Control::New(speed) = control::wheel_speed(now.reading) {
            let (_, correction) = self.slope.update(speed, now.running);
            if correction.is_some() {
                self.observability.update(self.slope.belief().P.m22);
            }
        }
    }

    /// Effective grade of the second stage, with the uncertainty of the first stage's results.
    fn found(&self, drive: Option<Drive>, direction: Real, mu: Real) -> Value {
        let belief = self.slope.belief();
        let parameters_sd = drive.map_or(0.0, |drive| {
            let (traction_n, sin_cos) = self.slope.steady_traction_n(&drive);
            let steady = SteadyTraction {
                traction_n,
                sin_cos,
                direction,
                mu,
            };
            self.mass.slope_sd_rad(&steady, self.curvature_per_m)
        });
        let unmodelled = self.mass.unmodelled_mps2() / GRAVITY;
        let variance = belief.P.m22 + parameters_sd * parameters_sd + unmodelled * unmodelled;
        let basis = drive.is_some()
            && self.slope.started()
            && !self.slope.clamped()
            && self.mass.mass_kg().valid
            && self.slip.wheel_speed_consistent(self.slope.adapted_ratio())
            && self.observability.grade_observable();
        Value::new(belief.x.y, sqrt(variance), basis)
    }
}

impl<M: MassEstimator + State + core::fmt::Debug> SupervisedMethod for TwoStage<M> {
    const INTERNALS: &'static [Internal] = {
        let [a, b, c, d, e, f] = *M::INTERNALS;
        &[
            a,
            b,
            c,
            d,
            e,
            f,
            Internal::new("wheel_speed_sd_mps", "m/s"),
            Internal::new("method_grade_rad", "rad"),
            Internal::new("method_grade_sd_rad", "rad"),
        ]
    };

    fn sample(&mut self, sample: &BalanceSample) -> AidStatus {
        self.mass.sample(sample, &self.balance)
    }

    fn pause(&mut self) {
        self.mass.pause();
    }

    fn open_load(&mut self) {
        self.mass.open_load();
    }

    fn step(&mut self, now: &Step) {
        self.curvature_per_m = now.curvature_per_m;
        let direction = if now.attitude.speed_mps < 0.0 {
            -1.0
        } else {
            1.0
        };
        let mu = self.mass.running_resistance(self.curvature_per_m);
        let mass_kg = self.mass.mass_kg().value;
        let drive = now.traction_n.map(|traction| Drive {
            traction_n: traction - now.bend.force_n(mass_kg),
            mass_kg,
            resistance: mu * direction,
        });
        self.filter_slope(drive, now);
        self.grade = self.found(drive, direction, mu);
    }

    fn mass_kg(&self) -> Value {
        self.mass.mass_kg()
    }

    fn effective_grade_rad(&self) -> Value {
        self.grade
    }

    fn is_excited(&self) -> bool {
        self.mass.excited()
    }

    fn is_saturated(&self) -> bool {
        self.mass.saturated() || self.slope.saturated()
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [a, b, c, d, e, f] = self.mass.internals(self.curvature_per_m);
        let (slope, grade) = (&self.slope, self.grade);
        let now = [
            a,
            b,
            c,
            d,
            e,
            f,
            slope.measurement_sd(),
            grade.value,
            grade.sd,
        ];
        copy_into(values, &now);
    }
}

state!(@[M: State] TwoStage<M> { mass, slope, observability, curvature_per_m, grade; balance, slip });

#[cfg(test)]
#[path = "two_stage_tests.rs"]
mod tests;
