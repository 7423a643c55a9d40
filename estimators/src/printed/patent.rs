//! `mmrls_sh_stf_printed`: patent CN 111507019 B, as printed (its formulas are reconstructed: the published text has
//! them as pictures).
//!
//! - `eq20`: the slope in the regression is that of the filter which inverts the same force balance with this mass;
//!   right: the accelerometer
//! - `eq22`: the turning model without slope and running resistance, and always weighed, also on a straight
//! - `eq26`: the sigmoid of the residual with its sign, in N (also eq. 27): a large negative one is the best
//! - `eq28`: S = (1 − K h) P (1 − K h) (also eq. 29), which falls to 0 as the forgetting does; right: the innovation
//!   variance
//! - `eq46`: Sage-Husa for both Q and R (also eq. 48) ([`slope_ekf`](crate::printed::slope_ekf))
//!
//! The criterion for going from Sage-Husa to strong tracking is cut off in print: there is no strong tracking here. Λ
//! of both models may come out as 0, and their share as 0/0: a breakdown.

use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, cos, exp, pow, sin, sqrt, tanh};
use crate::api::signals::{Estimate, Vehicle};
use crate::filters::low_pass::MatchedFilter;
use crate::models::force_balance::ForceBalance;
use crate::models::sample::ResampledSample;
use crate::preprocess::front_end::motion;
use crate::preprocess::resampler::Resampler;
use crate::printed::slope_ekf::{Balance, NoiseRule, SlopeEkf, Told};
use crate::printed::{Erratum, PrintedAnswer};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Switches and constants of `mmrls_sh_stf_printed`.
    Own {
        eq20 [choice Erratum] = Erratum::Printed, "Printed: slope of the method's own filter in the regression.";
        eq22 [choice Erratum] = Erratum::Printed, "Printed: turning model without slope and resistance, always weighted.";
        eq26 [choice Erratum] = Erratum::Printed, "Printed: sigmoid of the signed residual in N.";
        eq28 [choice Erratum] = Erratum::Printed, "Printed: variance of the residual (1 − K h) P (1 − K h).";
        eq46 [choice Erratum] = Erratum::Printed, "Printed: printed Sage-Husa; corrected: noise fixed.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        p0 ["kg²s⁴/m²"] = 1e4, 1e-6 => 1e12, "P₀ of both masses, in units of the residual.";
        residual_sd_n ["N"] = 500.0, 1.0 => 1e6, "Size of the residual, for the corrected forms.";
        wheelbase_m ["m"] = 3.0, 0.1 => 50.0, "Length for a steering angle from the yaw rate, if the vehicle has no sensor for it.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass.";
        regression_hz ["Hz"] = 10.0, 0.1 => 1000.0, "Rate of the samples t of the forgetting law.";
        b ["-"] = 0.97, 0.5 => 0.99999, "Forgetting factor b of the noise.";
        q_v ["m²/s³"] = 1e-4, 0.0 => 10.0, "Process noise of speed at the start.";
        q_theta ["rad²/s"] = 3e-4, 0.0 => 10.0, "Process noise of the grade angle at the start.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

param_groups! {
    /// Parameters of `mmrls_sh_stf_printed`.
    Params { own: Own }
}

/// Speed below which the train stands, m/s.
const STANDSTILL_MPS: Real = 0.05;
/// Right: steering angle, rad, below which the straight model stands alone.
const STRAIGHT: Real = PI / 180.0;
/// Largest value that counts as a mass, kg.
const MAX_KG: Real = 1e9;

/// One scalar regression in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ScalarRegression {
    m: Real,
    P: Real,
    /// Posterior residual, N, and its assumed variance.
    e: Real,
    S: Real,
}

impl ScalarRegression {
    /// Eq. 21 with eq. 24 and 28.
    fn learn(&mut self, y: Real, h: Real, forget: Real, own: &Own) {
        let K = self.P * h / (forget + h * self.P * h);
        let noise = own.residual_sd_n * own.residual_sd_n;
        let S = noise * (1.0 + h * self.P * h);
        self.m += K * (y - h * self.m);
        self.P = (1.0 - K * h) * self.P / forget;
        self.e = y - h * self.m;
        self.S = if own.eq28.is_printed() {
            (1.0 - K * h) * self.P * (1.0 - K * h)
        } else {
            S / noise
        };
    }

    /// Eq. 26 and 30.
    fn likelihood(&self, own: &Own) -> Real {
        let size = if own.eq26.is_printed() {
            1.0 / (1.0 + exp(-self.e))
        } else {
            tanh(self.e.abs() / (2.0 * own.residual_sd_n))
        };
        exp(-0.5 * size * size / self.S) / sqrt(2.0 * PI * self.S)
    }

    fn usable(&self) -> bool {
        self.m.abs() < MAX_KG && self.P.is_finite() && self.S.is_finite() && self.e.is_finite()
    }
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MmrlsShStfPrinted {
    own: Own,
    balance: ForceBalance,
    mu: Real,
    first: ScalarRegression,
    straight: ScalarRegression,
    turning: ScalarRegression,
    straight_weight: Real,
    samples: u32,
    signals: Resampler,
    steering: MatchedFilter,
    lateral: MatchedFilter,
    slope: SlopeEkf,
    since_s: Real,
    breakdowns: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> MmrlsShStfPrinted {
    let own = params.own;
    let first = ScalarRegression {
        m: vehicle.first_mass_kg(own.mass0_kg),
        P: own.p0,
        e: 0.0,
        S: 1.0,
    };
    let filter = MatchedFilter::new(own.cutoff_hz);
    MmrlsShStfPrinted {
        own,
        balance: ForceBalance::new(vehicle),
        mu: vehicle.running_resistance,
        first,
        straight: first,
        turning: first,
        straight_weight: 0.5,
        samples: 0,
        signals: Resampler::new(own.cutoff_hz, own.regression_hz, 1.0),
        steering: filter,
        lateral: filter,
        slope: SlopeEkf::new(Told {
            r: own.wheel_speed_sd_mps * own.wheel_speed_sd_mps,
            q: [own.q_v, own.q_theta],
            grade0_sd_deg: own.grade0_sd_deg,
            fading: own.b,
            noise: if own.eq46.is_printed() {
                NoiseRule::Printed
            } else {
                NoiseRule::Fixed
            },
            small_angles: true,
        }),
        since_s: 0.0,
        breakdowns: 0.0,
    }
}

impl MmrlsShStfPrinted {
    fn mass_kg(&self) -> Real {
        let w = self.straight_weight;
        w * self.straight.m + (1.0 - w) * self.turning.m
    }

    /// Eq. 20–34.
    fn learn(&mut self, now: &ResampledSample) {
        let Some(f) = now.specific_force_mps2 else {
            return;
        };
        let rate = now.acceleration_mps2;
        let direction = if now.speed_mps < 0.0 { -1.0 } else { 1.0 };
        let inertia = self.balance.rotating_mass_kg / self.first.m * rate;
        let resistance = direction * self.mu * GRAVITY;
        let felt = if self.own.eq20.is_printed() {
            GRAVITY * self.slope.belief().0.y + rate
        } else {
            f
        };
        let steer = self.steering.value().unwrap_or(0.0);
        let across = self.lateral.value().unwrap_or(0.0);

        self.samples = self.samples.saturating_add(1);
        let forget = 1.0 - 0.05 * pow(0.98, Real::from(self.samples));
        let (mut straight, mut turning) = (self.straight, self.turning);
        straight.learn(now.force_n, resistance + felt + inertia, forget, &self.own);
        let turning_force = now.force_n * cos(steer) - 0.5 * self.mass_kg() * across * sin(steer);
        let weight = if self.own.eq22.is_printed() {
            turning.learn(turning_force, rate, forget, &self.own);
            weight(&straight, &turning, &self.own)
        } else if steer.abs() < STRAIGHT {
            1.0
        } else {
            turning.learn(
                turning_force,
                resistance + felt + inertia,
                forget,
                &self.own,
            );
            weight(&straight, &turning, &self.own)
        };
        if straight.usable() && turning.usable() && weight.is_finite() {
            (self.straight, self.turning, self.straight_weight) = (straight, turning, weight);
        } else {
            (self.straight, self.turning) = (self.first, self.first);
            (self.straight_weight, self.samples) = (0.5, 0);
            self.breakdowns += 1.0;
        }
    }
}

/// Eq. 32: Λₛ/(Λₛ + Λₜ).
fn weight(straight: &ScalarRegression, turning: &ScalarRegression, own: &Own) -> Real {
    let (s, t) = (straight.likelihood(own), turning.likelihood(own));
    s / (s + t)
}

impl Pipeline for MmrlsShStfPrinted {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("straight_mass_kg", "kg"),
        Internal::new("turning_mass_kg", "kg"),
        Internal::new("straight_weight", "-"),
        Internal::new("residual_variance", "N²"),
        Internal::new("breakdowns", "-"),
        Internal::new("indefinite_share", "-"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, STANDSTILL_MPS);
        let turned = reading
            .yaw_rate_radps
            .zip(reading.speed_mps)
            .map(|(rate, v)| self.own.wheelbase_m * rate / v);
        let steer = reading.steering_angle_rad.or(turned);
        if let Some((steer, across)) = steer.zip(reading.lateral_force_mps2) {
            // Standing, the quotient is anything.
            self.steering
                .step(if steer.abs() < 0.5 { steer } else { 0.0 }, dt);
            self.lateral.step(across, dt);
        }
        if let Some(sample) = self.signals.step(reading, &self.balance, running, dt) {
            self.learn(&sample);
        }
        self.since_s += dt;
        if let Some((torque, speed)) = reading.motor_torque_nm.zip(reading.new_speed_mps) {
            let period = self.since_s.min(1.0);
            self.since_s = 0.0;
            if running {
                let direction = if speed < 0.0 { -1.0 } else { 1.0 };
                let balance = Balance {
                    traction_n: self.balance.net_traction(torque, speed),
                    mass_kg: self.mass_kg(),
                    rotating_mass_kg: self.balance.rotating_mass_kg,
                    resistance: direction * self.mu,
                };
                self.slope.step(&balance, speed, period);
            }
        }
        let (x, P) = self.slope.belief();
        let (innovation, nis) = self.slope.innovation();
        PrintedAnswer {
            mass: (self.mass_kg(), self.straight.P),
            grade: (x.y, P.m22),
            speed_mps: x.x,
            innovation,
            nis,
        }
        .estimate(t, moving, running)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (breakdowns, share) = self.slope.failures();
        copy_into(
            values,
            &[
                self.straight.m,
                self.turning.m,
                self.straight_weight,
                self.straight.S,
                self.breakdowns + breakdowns,
                share,
            ],
        );
    }
}
