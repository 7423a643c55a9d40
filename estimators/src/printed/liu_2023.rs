//! `dffrls_aekf_printed`: Liu et al. 2023, eq. 6–30, as printed.
//!
//! - `eq6`: inertia factor 1 + 4 J g/(R² M) (also in eq. 7, 17, 23, 24): the rotating masses count g times
//! - `eq16`: what the accelerometer reads, v̇ + g sin θ, stands where v̇ belongs, on the left and in α₁; or v̇ of the
//!   wheels in both places (2); right is the specific force on the left and v̇ in α₁
//! - `eq21`: λ of the step before in gain and covariance
//! - `eq23`: sin θ ≈ θ, cos θ ≈ 1
//! - `eq30`: Sage-Husa for q, Q, w and W at once ([`slope_ekf`](crate::printed::slope_ekf)); `other`: to the letter
//!
//! λ is found from the a-priori residual also here: that of eq. 19 is of the estimate it serves to find. P₀ and σ are
//! not given.

use nalgebra::{Matrix2, Vector2, vector};

use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, exp, sqrt};
use crate::api::signals::{Estimate, Vehicle};
use crate::filters::low_pass::MatchedFilter;
use crate::models::force_balance::ForceBalance;
use crate::preprocess::front_end::motion;
use crate::printed::slope_ekf::{Balance, NoiseRule, SlopeEkf, Told};
use crate::printed::{Erratum, PrintReading, PrintedAnswer, mass_from_inverse, usable};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Switches and constants of `dffrls_aekf_printed`.
    Own {
        eq6 [choice Erratum] = Erratum::Printed, "Printed: rotating masses times g.";
        eq16 [choice PrintReading] = PrintReading::Printed, "Printed: the accelerometer for v̇; other: wheels for both; corrected: specific force and v̇ each in its place.";
        eq21 [choice Erratum] = Erratum::Printed, "Printed: λ of the previous step.";
        eq23 [choice Erratum] = Erratum::Printed, "Printed: θ for sin θ and 1 for cos θ.";
        eq30 [choice PrintReading] = PrintReading::Printed, "Printed: printed Sage-Husa with dimensions corrected; other: to the letter; corrected: noise fixed.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "First forgetting factor.";
        delta ["-"] = 0.95, 0.5 => 1.0, "Smallest forgetting factor δ, per sample.";
        sigma ["s²/m"] = 5.0, 0.0 => 1000.0, "Decrease of λ with the residual.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        p0 ["-"] = 100.0, 1e-6 => 1e6, "P₀ of both parameters, 1/M over its first value and the sine.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
        kappa ["-"] = 0.966, 0.5 => 0.99999, "Forgetting factor κ of the noise.";
        q_v ["m²/s³"] = 1e-4, 0.0 => 10.0, "Process noise of speed at the start.";
        q_theta ["rad²/s"] = 3e-4, 0.0 => 10.0, "Process noise of the grade angle at the start.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `dffrls_aekf_printed`.
    Params { own: Own }
}

/// Speed below which the train stands, m/s. The paper's never did.
const STANDSTILL_MPS: Real = 0.05;

#[derive(Clone, Copy, Debug, PartialEq)]
struct RegressionState {
    /// [M₀/M, sin(θ + θ_μ)].
    chi: Vector2<Real>,
    P: Matrix2<Real>,
    lambda: Real,
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DffrlsAekfPrinted {
    own: Own,
    balance: ForceBalance,
    rotating_mass_kg: Real,
    mu: Real,
    mass0_kg: Real,
    mass: RegressionState,
    start: RegressionState,
    force: MatchedFilter,
    speed: MatchedFilter,
    accelerometer: MatchedFilter,
    slope: SlopeEkf,
    since_s: Real,
    breakdowns: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> DffrlsAekfPrinted {
    let own = params.own;
    let mu = vehicle.running_resistance;
    let filter = MatchedFilter::new(own.cutoff_hz);
    let start = RegressionState {
        chi: vector![1.0, mu / sqrt(1.0 + mu * mu)],
        P: Matrix2::identity() * own.p0,
        lambda: own.lambda0,
    };
    let noise = if own.eq30 == PrintReading::Other {
        NoiseRule::Literal
    } else if own.eq30.is_printed() {
        NoiseRule::Printed
    } else {
        NoiseRule::Fixed
    };
    DffrlsAekfPrinted {
        own,
        balance: ForceBalance::new(vehicle),
        rotating_mass_kg: vehicle.rotating_mass_kg
            * if own.eq6.is_printed() { GRAVITY } else { 1.0 },
        mu,
        mass0_kg: vehicle.first_mass_kg(own.mass0_kg),
        mass: start,
        start,
        force: filter,
        speed: filter,
        accelerometer: filter,
        slope: SlopeEkf::new(Told {
            r: own.wheel_speed_sd_mps * own.wheel_speed_sd_mps,
            q: [own.q_v, own.q_theta],
            grade0_sd_deg: own.grade0_sd_deg,
            fading: own.kappa,
            noise,
            small_angles: own.eq23.is_printed(),
        }),
        since_s: 0.0,
        breakdowns: 0.0,
    }
}

impl DffrlsAekfPrinted {
    fn mass_kg(&self) -> Real {
        mass_from_inverse(self.mass0_kg, self.mass.chi.x)
    }

    /// Eq. 16–22.
    fn learn(&mut self, force: Real, felt: Real, rate: Real) {
        let (y, beside_inertia) = if self.own.eq16 == PrintReading::Other {
            (rate, rate)
        } else if self.own.eq16.is_printed() {
            (felt, felt)
        } else {
            (felt, rate)
        };
        let alpha = vector![
            (force - self.rotating_mass_kg * beside_inertia) / self.mass0_kg,
            -GRAVITY * sqrt(1.0 + self.mu * self.mu)
        ];
        let RegressionState { chi, P, lambda } = self.mass;
        let residual = y - alpha.dot(&chi);
        let next_lambda =
            self.own.delta + (1.0 - self.own.delta) * exp(-self.own.sigma * residual.abs());
        let used = if self.own.eq21.is_printed() {
            lambda
        } else {
            next_lambda
        };
        let K = P * alpha / (used + alpha.dot(&(P * alpha)));
        let next = RegressionState {
            chi: chi + K * residual,
            P: (P - K * (alpha.transpose() * P)) / used,
            lambda: next_lambda,
        };
        if usable(next.chi.iter()) && next.P.iter().all(|p| p.is_finite()) {
            self.mass = next;
        } else {
            self.mass = self.start;
            self.breakdowns += 1.0;
        }
    }
}

impl Pipeline for DffrlsAekfPrinted {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("lambda", "-"),
        Internal::new("chi1", "-"),
        Internal::new("chi2", "-"),
        Internal::new("breakdowns", "-"),
        Internal::new("indefinite_share", "-"),
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
            let traction_n = self.balance.net_traction(torque, speed);
            self.force.step(traction_n, period);
            self.speed.step(speed, period);
            self.accelerometer.step(f, period);
            if let (true, Some(force), Some(felt)) =
                (running, self.force.value(), self.accelerometer.value())
            {
                self.learn(force, felt, self.speed.rate());
                let direction = if speed < 0.0 { -1.0 } else { 1.0 };
                let balance = Balance {
                    traction_n,
                    mass_kg: self.mass_kg(),
                    rotating_mass_kg: self.rotating_mass_kg,
                    resistance: direction * self.mu,
                };
                self.slope.step(&balance, speed, period);
            }
        }
        let (x, P) = self.slope.belief();
        let (innovation, nis) = self.slope.innovation();
        let mass_kg = self.mass_kg();
        let share = mass_kg / self.mass0_kg;
        PrintedAnswer {
            mass: (
                mass_kg,
                self.mass.P.m11.min(1e12) * mass_kg * mass_kg * share * share,
            ),
            grade: (x.y, P.m22),
            speed_mps: x.x,
            innovation,
            nis,
        }
        .estimate(t, moving, running)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let RegressionState { chi, lambda, .. } = self.mass;
        let (breakdowns, share) = self.slope.failures();
        copy_into(
            values,
            &[lambda, chi.x, chi.y, self.breakdowns + breakdowns, share],
        );
    }
}
