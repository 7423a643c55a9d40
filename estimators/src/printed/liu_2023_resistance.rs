//! `resistance_dffrls_printed`: Liu et al. 2023, section 2.2, eq. 8–15, as printed; the slope comes from the
//! accelerometer here, not from a survey.
//!
//! - `eq9`: rotating masses times g
//! - `eq14`: K = P h (φ + hᵀ P h), the inverse missing. Then P ← (1 − K h) P/φ turns negative as soon as P h² > 0.62
//!   (the root of x² + φ x = 1), that is P > 0.0065 at h = g.

use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, asin, exp};
use crate::api::signals::{Estimate, Vehicle};
use crate::filters::low_pass::MatchedFilter;
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::motion;
use crate::printed::{Erratum, PrintedAnswer, usable};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Switches and constants of `resistance_dffrls_printed`.
    Own {
        eq9 [choice Erratum] = Erratum::Printed, "Printed: rotating masses times g.";
        eq14 [choice Erratum] = Erratum::Printed, "Printed: the gain without its inverse.";
        p0 ["-"] = 1.0, 1e-9 => 1e6, "P₀, not given.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "First forgetting factor.";
        delta ["-"] = 0.95, 0.5 => 1.0, "Smallest forgetting factor δ, per sample.";
        sigma ["s²/m"] = 5.0, 0.0 => 1000.0, "Decrease of φ with the residual.";
        known_mass_kg ["kg"] = none, 1.0 => 1e6, "Total mass, known; not set: the middle of the vehicle's mass range.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
    }
}

param_groups! {
    /// Parameters of `resistance_dffrls_printed`.
    Params { own: Own }
}

/// Speed below which the train stands, m/s.
const STANDSTILL_MPS: Real = 0.05;

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResistancePrinted {
    own: Own,
    balance: ForceBalance,
    rotating_mass_kg: Real,
    mass_kg: Real,
    mu: Real,
    P: Real,
    lambda: Real,
    force: MatchedFilter,
    speed: MatchedFilter,
    accelerometer: MatchedFilter,
    since_s: Real,
    residual: Real,
    negative: Real,
    breakdowns: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> ResistancePrinted {
    let own = params.own;
    let filter = MatchedFilter::new(own.cutoff_hz);
    ResistancePrinted {
        own,
        balance: ForceBalance::new(vehicle),
        rotating_mass_kg: vehicle.rotating_mass_kg
            * if own.eq9.is_printed() { GRAVITY } else { 1.0 },
        mass_kg: vehicle.first_mass_kg(own.known_mass_kg),
        mu: 0.0,
        P: own.p0,
        lambda: own.lambda0,
        force: filter,
        speed: filter,
        accelerometer: filter,
        since_s: 0.0,
        residual: 0.0,
        negative: 0.0,
        breakdowns: 0.0,
    }
}

impl ResistancePrinted {
    /// Eq. 8–15.
    fn learn(&mut self, force: Real, felt: Real, rate: Real, direction: Real) {
        let y = (force - self.rotating_mass_kg * rate) / self.mass_kg - felt;
        let h = direction * GRAVITY * ForceBalance::cosine(felt, rate);
        self.residual = y - h * self.mu;
        let size = self.residual.abs();
        self.lambda = self.own.delta + (1.0 - self.own.delta) * exp(-self.own.sigma * size);
        let S = self.lambda + h * self.P * h;
        let K = if self.own.eq14.is_printed() {
            self.P * h * S
        } else {
            self.P * h / S
        };
        let (mu, P) = (
            self.mu + K * self.residual,
            (1.0 - K * h) * self.P / self.lambda,
        );
        if usable([&mu, &P]) {
            (self.mu, self.P) = (mu, P);
        } else {
            (self.mu, self.P, self.lambda) = (0.0, self.own.p0, self.own.lambda0);
            self.breakdowns += 1.0;
        }
        if self.P < 0.0 {
            self.negative += 1.0;
        }
    }
}

impl Pipeline for ResistancePrinted {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("running_resistance", "-"),
        Internal::new("covariance", "-"),
        Internal::new("lambda", "-"),
        Internal::new("negative_steps", "-"),
        Internal::new("breakdowns", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, STANDSTILL_MPS);
        self.since_s += dt;
        let signals = reading
            .motor_torque_nm
            .zip(reading.new_speed_mps)
            .zip(reading.specific_force_mps2);
        if let Some(((torque, speed), f)) = signals {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            self.force
                .step(self.balance.net_traction(torque, speed), period);
            self.speed.step(speed, period);
            self.accelerometer.step(f, period);
            if let (true, Some(force), Some(felt)) =
                (running, self.force.value(), self.accelerometer.value())
            {
                let direction = if speed < 0.0 { -1.0 } else { 1.0 };
                self.learn(force, felt, self.speed.rate(), direction);
            }
        }
        let slope = self.accelerometer.value().unwrap_or(0.0) - self.speed.rate();
        PrintedAnswer {
            mass: (self.mass_kg, 0.0),
            grade: (asin(slope / GRAVITY), 0.0),
            speed_mps: self.speed.value().unwrap_or(0.0),
            innovation: self.residual,
            nis: 0.0,
        }
        .estimate(t, moving, running)
    }

    fn internal_values(&self, values: &mut [Real]) {
        copy_into(
            values,
            &[self.mu, self.P, self.lambda, self.negative, self.breakdowns],
        );
    }
}
