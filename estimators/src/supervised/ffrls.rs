//! `ffrls_robust`: baseline of Liu et al. 2023: mass and slope from one regression with constant forgetting (their eq. 16–18).
//!
//! v̇ = α₁ χ₁ + α₂ χ₂,  α₁ = F − J v̇, α₂ = −g √(1 + μ²),  χ₁ = 1/M, χ₂ = sin(θ + θ_μ), θ_μ = atan μ
//!
//! It takes the slope for a constant. On level or evenly graded track a start or a stop gives a usable mass; while the slope
//! changes at steady speed, the force varies with v̇ = 0 and the regression concludes that the mass is infinite: it then runs into
//! the end of its mass range and is marked `saturated`. Only forgetting brings it back. A baseline for comparisons.

use nalgebra::{Vector2, vector};

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::real::{GRAVITY, asin, sin, sqrt, within};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::control::{self, Control};
use crate::detect::plausibility::Instruments;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::conditioning::ConditioningParams;
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::{ResampledSample, Resampler};
use crate::rail::distributed_train::{DistributedTrain, steeper};
use crate::runner::{Pipeline, copy_into};
use crate::supervised::force_balance_ekf::MAX_GRADE_RAD;
use crate::supervised::supervision as supervise;
use crate::supervised::supervision::Supervision;
use crate::supervised::two_stage::motion;
use crate::{Real, Time};

params! {
    /// Parameters of the coupled regression.
    Own {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Constant forgetting factor, per regression sample.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.5, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        sine_sd ["-"] = 0.1, 0.001 => 1.0, "Standard deviation of the sine of the grade angle at the start.";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass all signals go through.";
        regression_hz ["Hz"] = 10.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the train counts as standing: no learning; not set: 0.05 on a rail, 0.3 on a road.";
        settle_s ["s"] = 1.0, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
        square_root [flag] = true, "Carry the covariance as its factors U D Uᵀ, which keep the digits that the covariance itself loses to rounding.";
    }
}

param_groups! {
    /// Parameters of `ffrls_robust`.
    Params { own: Own, supervision: Supervision, integrity: Integrity, conditioning: ConditioningParams }
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ffrls {
    params: Own,
    standstill_mps: Real,
    balance: ForceBalance,
    mu: Real,
    mass0_kg: Real,
    range_kg: [Real; 2],
    /// [M₀/M, sin(θ + θ_μ)].
    rls: Rls<2>,
    signals: Resampler,
    train: DistributedTrain,
    /// Sign of the speed at the last sample: χ₂ belongs to it.
    direction: Real,
    speed_mps: Real,
    saturated: bool,
    outcome: Outcome,
    validity: Validity,
    conditioning: ConditioningParams,
    /// Time since the last sample, s.
    since_sample_s: Real,
    /// What became of the last wheel speed, and of the last sample of the force balance.
    aids: [AidStatus; 2],
}

/// From the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> Ffrls {
    let own = params.own;
    let mass0_kg = vehicle.first_mass_kg(own.mass0_kg);
    let mu = vehicle.running_resistance;
    let prior = Gaussian::independent(vector![1.0, mu], vector![own.mass_sd, own.sine_sd]);
    Ffrls {
        params: own,
        standstill_mps: vehicle.standstill_mps(own.standstill_mps),
        balance: ForceBalance::new(vehicle),
        mu,
        mass0_kg,
        range_kg: vehicle.mass_range_kg,
        rls: Rls::new(prior, Forgetting::Constant(own.lambda0))
            .in_square_root_form(own.square_root),
        signals: Resampler::new(own.cutoff_hz, own.regression_hz, own.settle_s),
        train: DistributedTrain::new(
            &supervise::mapped(vehicle, params.supervision.grade_map),
            own.standstill_mps,
        ),
        direction: 1.0,
        speed_mps: 0.0,
        saturated: false,
        outcome: Outcome::default(),
        validity: Validity::new(vehicle, params.integrity, Instruments::default()),
        conditioning: params.conditioning,
        since_sample_s: 0.0,
        aids: [AidStatus::default(); 2],
    }
}

impl Ffrls {
    /// One sample: gate and fuse. What became of it.
    fn sample(&mut self, now: ResampledSample) -> AidStatus {
        self.direction = if now.speed_mps < 0.0 { -1.0 } else { 1.0 };
        let acceleration = now.acceleration_mps2;
        let h = vector![
            (now.force_n - self.balance.rotating_mass_kg * acceleration) / self.mass0_kg,
            -GRAVITY * sqrt(1.0 + self.mu * self.mu)
        ];
        let r = self.params.residual_sd_mps2 * self.params.residual_sd_mps2;
        let Some(outcome) = self.rls.update(acceleration, &h, r, false) else {
            return control::regressed(None, true);
        };
        self.outcome = outcome;
        self.rls.clamp_usable();
        self.saturated = self.found() != self.rls.belief.x;
        control::regressed(Some(&outcome), true)
    }

    /// χ within the range of the mass and what there is of slopes. It limits what is published, not the recursion ([`Rls::clamp_usable`]).
    fn found(&self) -> Vector2<Real> {
        let ([low, high], x) = (self.range_kg, self.rls.belief.x);
        vector![
            within(x.x, self.mass0_kg / high, self.mass0_kg / low),
            within(x.y, -0.85, 0.85)
        ]
    }
}

impl Pipeline for Ffrls {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("chi1", "-"),
        Internal::new("chi2", "-"),
        Internal::new("residual_mps2", "m/s²"),
        Internal::new("windup_limit", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.standstill_mps);
        self.validity.observe(reading, dt);
        self.since_sample_s += dt;
        let sample = self.signals.step(reading, &self.balance, running, dt);
        // It has no use for the rail ahead: its slope is the effective one by itself. Only the grade at the IMU asks for it.
        self.train.step(&self.signals, None, reading, running, dt);
        let [wheel_speed, force_balance] = &mut self.aids;
        *wheel_speed = control::wheel_speed_input(reading);
        if let Control::Out(outcome) = control::force_balance(reading, running, false) {
            *force_balance = control::without(outcome);
        }
        if let Some(sample) = sample {
            let status = self.sample(sample);
            if let Some(nis) = status.nis() {
                for source in [Source::ForceBalance, Source::WheelSpeed] {
                    self.validity.innovation(source, nis, self.since_sample_s);
                }
                self.since_sample_s = 0.0;
            }
            let [_, force_balance] = &mut self.aids;
            *force_balance = status;
        }
        self.speed_mps = reading.speed_mps.unwrap_or(self.speed_mps);
        let (x, P) = (self.found(), self.rls.belief.P);
        let spread = self.rls.spread().max(1.0);
        // Larger residuals than expected widen both, but not beyond what was known at the start.
        let widened = |sd: Real, prior: Real| (spread * sd).min(prior);
        let mass = self.mass0_kg / x.x;
        let mass_sd = mass * widened(sqrt(P.m11), self.params.mass_sd) / x.x;
        // sin θ + s μ cos θ = √(1 + μ²) sin(θ + s θ_μ), s = sgn v
        let theta = asin(x.y) - self.direction * asin(self.mu / sqrt(1.0 + self.mu * self.mu));
        let theta_sd = widened(sqrt(P.m22), self.params.sine_sd)
            / sqrt(1.0 - sin(theta) * sin(theta)).max(0.1);
        let total_mass_kg = self.validity.mass(Value {
            value: mass,
            sd: mass_sd,
            valid: !self.saturated,
        });
        let ahead = self.train.ahead(mass);
        let grade = |by: Real, doubt: Real| {
            let sd = sqrt(theta_sd * theta_sd + doubt * doubt);
            Value {
                value: steeper(theta, by).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd,
                valid: running && total_mass_kg.valid,
            }
        };
        let estimate = Estimate {
            t,
            total_mass_kg,
            grade_rad: grade(ahead.imu, ahead.sd),
            effective_grade_rad: grade(0.0, 0.0),
            speed_mps: Value {
                value: self.speed_mps,
                sd: 0.01,
                valid: reading.speed_mps.is_some(),
            },
            innovation: self.outcome.residual,
            nis: self.outcome.normalised * self.outcome.normalised,
            flags: Flags {
                moving,
                excited: running && !self.outcome.limited,
                saturated: self.saturated,
            },
        };
        self.validity.publish(estimate, true)
    }

    fn conditioning(&self) -> Option<ConditioningParams> {
        Some(self.conditioning)
    }

    const AID_SOURCES: &'static [&'static str] = &["wheel_speed", "force_balance"];

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &self.aids);
    }

    fn internal_values(&self, values: &mut [Real]) {
        let x = self.rls.belief.x;
        let limited = if self.outcome.limited { 1.0 } else { 0.0 };
        copy_into(values, &[x.x, x.y, self.outcome.residual, limited]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}
state!(Ffrls { rls, signals, train, direction, speed_mps, saturated, outcome, aids, validity, since_sample_s; params, conditioning, standstill_mps, balance, mu, mass0_kg, range_kg });
