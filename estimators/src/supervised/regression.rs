//! `regression_bench`: any of the [`regressors`](crate::models::regressors) with any way to forget, then an extended Kalman filter for the slope with the
//! mass found: a test bench for the question which regression can know what.
//!
//! Nothing beyond the textbook: no memory of the rail for a long train, no watch for another load, no gate for excitation. The gates that
//! every regression needs are there: none while standing or braking, variances never above their prior, mass within its range.

use nalgebra::{Vector2, vector};

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus};
use crate::api::estimator::Internal;
use crate::api::params::{choices, param_groups, params};
use crate::api::real::{GRAVITY, sqrt, within};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control;
use crate::detect::validity::Integrity;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::low_pass::MatchedFilter;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::models::regressors::{Finds, Known, Regressor, Signals};
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::{ResampledSample, Resampler};
use crate::rail::distributed_train::{AlignedSample, DistributedTrain};
use crate::supervised::force_balance_ekf::{Adaptation, ForceBalanceEkf, GradeParams};
use crate::supervised::force_balance_rls::AccelSource;
use crate::supervised::supervision::TwoStageSupervision;
use crate::supervised::two_stage::{MassEstimator, SteadyTraction, TwoStage};

choices! {
    /// How a regression forgets.
    Policy {
        /// Not at all (RLS).
        Never = "never",
        /// By one constant factor (FFRLS).
        Constant = "constant",
        /// By the residual (DFFRLS).
        Dynamic = "dynamic",
        /// Each parameter by its own factor (RLS-MFF).
        Multiple = "multiple",
        /// By the patent's time law.
        TimeLaw = "time_law",
    }
}

params! {
    /// Parameters of `regression_bench`.
    RegressionParams {
        regressor [choice Regressor] = Regressor::KnownResistance, "Which regression: R-A coupled, R-B running resistance, R-C differenced, R-D straight, R-E turning, R-F curvature, R-G specific force with known resistance, R-H with free resistance.";
        policy [choice Policy] = Policy::Never, "How it forgets: never (RLS), constantly (FFRLS), by the residual (DFFRLS), each parameter by its own factor (RLS-MFF), or by the patent's time law.";
        acceleration [choice AccelSource] = AccelSource::SpecificForce, "What is taken for acceleration: the specific force of the accelerometer, or the derivative of wheel speed.";
        lambda ["-"] = 0.99, 0.5 => 1.0, "Constant factor, or that of χ₁ of several, per regression sample.";
        lambda2 ["-"] = 0.95, 0.5 => 1.0, "Factor of χ₂ with several.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Factor by the residual until its size is known.";
        delta ["-"] = 0.98, 0.5 => 1.0, "Smallest factor by the residual.";
        sigma ["-"] = 1.0, 0.0 => 1000.0, "How fast it falls with the residual in units of its standard deviation.";
        loss ["-"] = 0.05, 0.0 => 0.5, "Loss of weight in the time law λ = 1 − loss · decayᵏ.";
        decay ["-"] = 0.98, 0.0 => 1.0, "Decay in the time law.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start, for R-B and R-F the known mass; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.5, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        resistance_sd ["-"] = 0.5, 1e-4 => 1.0, "Standard deviation of the running-resistance coefficient that R-B starts from.";
        curvature_sd_per_m ["1/m"] = 0.05, 1e-4 => 1.0, "Standard deviation of the curvature that R-F starts from.";
        free_sd ["-"] = 0.3, 0.001 => 2.0, "Standard deviation of the free term of R-A and R-H at the start, over g.";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Expected residual, m/s² (R-F: m/s³).";
        wheelbase_m ["m"] = 3.0, 0.1 => 50.0, "Length that makes a steering angle of a yaw rate in R-E, where the vehicle has no sensor for it.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass all signals go through.";
        regression_hz ["Hz"] = 10.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the train counts as standing: no learning; not set: 0.05 on a rail, 0.3 on a road.";
        settle_s ["s"] = 1.5, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
    }
}

param_groups! {
    /// Parameters of `regression_bench`.
    Params { regression: RegressionParams, slope: GradeParams, integrity: Integrity, conditioning: ConditioningParams }
}

/// The pipeline.
pub type Regression = TwoStage<OneRegression>;

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> Regression {
    let balance = ForceBalance::new(vehicle);
    let own = &params.regression;
    // It keeps no map of the rail.
    let supervision = TwoStageSupervision {
        grade_map: false,
        ..TwoStageSupervision::default()
    }
    .with(params.integrity, params.conditioning);
    TwoStage::new(
        vehicle,
        Resampler::new(own.cutoff_hz, own.regression_hz, own.settle_s),
        OneRegression::new(vehicle, *own),
        ForceBalanceEkf::new(balance, params.slope, Adaptation::None, &params.integrity),
        &supervision,
        own.standstill_mps,
    )
}

/// A regression by choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneRegression {
    regressor: Regressor,
    known: Known,
    noise: Real,
    wheelbase_m: Real,
    range_kg: [Real; 2],
    rls: Rls<2>,
    before: Option<ResampledSample>,
    steering: MatchedFilter,
    lateral: MatchedFilter,
    excess: MatchedFilter,
    speed_again: MatchedFilter,
    theta: Real,
    mass_sd: Real,
    saturated: bool,
    outcome: Outcome,
}

fn policy(params: &RegressionParams) -> Forgetting<2> {
    match params.policy {
        Policy::Never => Forgetting::None,
        Policy::Constant => Forgetting::Constant(params.lambda),
        Policy::Dynamic => Forgetting::Dynamic {
            floor: params.delta,
            sharpness: params.sigma,
            first: params.lambda0,
        },
        Policy::Multiple => Forgetting::Multiple([params.lambda, params.lambda2]),
        Policy::TimeLaw => Forgetting::TimeLaw {
            loss: params.loss,
            decay: params.decay,
        },
    }
}

impl OneRegression {
    fn new(vehicle: &Vehicle, params: RegressionParams) -> Self {
        let regressor = params.regressor;
        let mu = vehicle.running_resistance;
        let (mean, sd) = match regressor.finds() {
            Finds::Resistance => (0.0, params.resistance_sd),
            Finds::Curvature => (0.0, params.curvature_sd_per_m),
            Finds::Mass | Finds::InverseMass => (1.0, params.mass_sd),
        };
        let (free, free_sd) = match regressor {
            Regressor::Coupled => (mu, params.free_sd),
            Regressor::FreeResistance => (mu * GRAVITY, params.free_sd * GRAVITY),
            _ => (0.0, 0.0),
        };
        let filter = MatchedFilter::new(params.cutoff_hz);
        Self {
            regressor,
            known: Known {
                mass0_kg: vehicle.first_mass_kg(params.mass0_kg),
                mu,
                rotating_mass_kg: vehicle.rotating_mass_kg,
                source: params.acceleration,
            },
            noise: params.residual_sd_mps2 * params.residual_sd_mps2,
            wheelbase_m: params.wheelbase_m,
            range_kg: vehicle.mass_range_kg,
            rls: Rls::new(
                Gaussian::independent(vector![mean, free], vector![sd, free_sd]),
                policy(&params),
            ),
            before: None,
            steering: filter,
            lateral: filter,
            excess: filter,
            speed_again: filter,
            theta: 0.0,
            mass_sd: params.mass_sd,
            saturated: false,
            outcome: Outcome {
                lambda: 1.0,
                ..Outcome::default()
            },
        }
    }

    /// χ₁ within what there is. It limits what is published, not the recursion ([`Rls::clamp_usable`]).
    fn found(&self) -> Real {
        let [low, high] = self.range_kg;
        let first = self.known.mass0_kg;
        let [least, most] = match self.regressor.finds() {
            Finds::Mass => [low / first, high / first],
            Finds::InverseMass => [first / high, first / low],
            Finds::Resistance | Finds::Curvature => [-1.0, 1.0],
        };
        within(self.rls.belief.x.x, least, most)
    }

    /// Standard deviations of χ.
    fn sd(&self) -> Vector2<Real> {
        self.rls.widened().diagonal().map(sqrt)
    }
}

impl MassEstimator for OneRegression {
    const INTERNALS: &'static [Internal; 6] = &[
        Internal::new("lambda", "-"),
        Internal::new("residual", "-"),
        Internal::new("chi1", "-"),
        Internal::new("chi1_sd", "-"),
        Internal::new("chi2", "-"),
        Internal::new("chi2_sd", "-"),
    ];

    fn step(
        &mut self,
        reading: &Reading,
        _: &ForceBalance,
        signals: &Resampler,
        grade_rad: Real,
        dt: Real,
    ) {
        self.theta = grade_rad;
        let turned = reading
            .yaw_rate_radps
            .zip(reading.speed_mps)
            .map(|(rate, v)| self.wheelbase_m * rate / v);
        let steer = reading.steering_angle_rad.or(turned);
        if let Some((steer, across)) = steer.zip(reading.lateral_force_mps2) {
            // Standing, the quotient is anything.
            self.steering
                .step(if steer.abs() < 0.5 { steer } else { 0.0 }, dt);
            self.lateral.step(across, dt);
        }
        if let Some([u, _]) = signals.at_place() {
            self.excess.step(u, dt);
            self.speed_again.step(signals.speed_mps(), dt);
        } else {
            self.excess.empty();
            self.speed_again.empty();
        }
    }

    fn needs_accelerometer(&self) -> bool {
        self.known.source == AccelSource::SpecificForce
    }

    fn pause(&mut self) {
        self.before = None;
    }

    fn sample(
        &mut self,
        &AlignedSample { sample: now, .. }: &AlignedSample,
        _: &ForceBalance,
        _: &DistributedTrain,
    ) -> AidStatus {
        let before = self.before.replace(now);
        let turned = before.is_some_and(|before| before.speed_mps * now.speed_mps < 0.0);
        if turned && self.regressor.has_free_term() {
            self.rls.reset_to_prior(&vector![0.0, 1.0]);
        }
        let across = self.lateral.value().unwrap_or(0.0);
        let steer = self.steering.value().unwrap_or(0.0);
        let signals = Signals {
            now,
            before: before.filter(|_| !turned),
            theta: self.theta,
            turning: (steer, across),
            jerk: self
                .speed_again
                .value()
                .map(|speed| (self.excess.rate(), speed)),
        };
        let Some(row) = self.regressor.row(&signals, &self.known) else {
            return control::without(AidOutcome::Stale);
        };
        let Some(outcome) = self.rls.update(row.y, &row.h, self.noise, false) else {
            return control::regressed(None, true);
        };
        self.outcome = outcome;
        self.rls.clamp_usable();
        self.saturated = self.found() != self.rls.belief.x.x;
        control::regressed(Some(&outcome), true)
    }

    fn mass_kg(&self) -> Value {
        let (first, found) = (self.known.mass0_kg, self.found());
        let sd = self.sd().x;
        let (value, sd) = match self.regressor.finds() {
            Finds::Mass => (first * found, first * sd),
            Finds::InverseMass => (first / found, first * sd / (found * found)),
            Finds::Resistance | Finds::Curvature => (first, first * self.mass_sd),
        };
        Value {
            value,
            sd,
            valid: !self.saturated,
        }
    }

    fn running_resistance(&self, _: &DistributedTrain) -> Real {
        match self.regressor.finds() {
            Finds::Resistance => self.found().max(0.0),
            _ => self.known.mu,
        }
    }

    fn slope_sd_rad(&self, steady: &SteadyTraction, _: &DistributedTrain) -> Real {
        let mass = self.mass_kg();
        let by_mass = steady.traction_n.abs() / (mass.value * GRAVITY) * (mass.sd / mass.value);
        by_mass / steady.by_theta()
    }

    fn saturated(&self) -> bool {
        self.saturated
    }

    fn internals(&self, _: &DistributedTrain) -> [Real; 6] {
        let (x, sd) = (self.rls.belief.x, self.sd());
        [
            self.outcome.lambda,
            self.outcome.residual,
            x.x,
            sd.x,
            x.y,
            sd.y,
        ]
    }
}
state!(OneRegression { rls, before, steering, lateral, excess, speed_again, theta, mass_sd, saturated, outcome;
    regressor, known, noise, wheelbase_m, range_kg });
