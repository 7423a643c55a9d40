//! Mass from two models weighed by how well they explain the traction (patent CN 111507019 B, step 2 ①).
//!
//! - straight: F − J v̇ = M a, a = f + s μ g cos θ (their eq. 20; F is the traction less air drag; a long train feels
//!   the f of where its masses rest, as in [`crate::supervised::force_balance_rls`])
//! - turning, on a road only: F + F_f (1/cos δ − 1) − J v̇ = M (a + (l_r/L) a_y tan δ) (eq. 12–22, single-track model):
//!   the side force of the steered tyres takes part of the traction, and a straight model takes that for mass
//!   ([`Bend`](crate::models::single_track::Bend))
//!
//! Each by recursive least squares with λ(k) = 1 − 0.05 · 0.98ᵏ; the weights are the likelihoods of their residuals.
//!
//! Against the print: a uses the specific force f of the accelerometer, where the patent puts in the slope of a filter
//! that inverts the same balance (mass and slope then chase each other); the residual is taken by size (in print a
//! large negative one is the best) and in its own standard deviations; its variance is the innovation variance (the
//! printed one falls to 0); the law that settles at λ = 1 starts again when the load changes. The side force comes from
//! the lateral acceleration and not from a slip angle that is nearly 0 by construction
//! ([`crate::models::single_track`]). Below a degree of steering or 0.3 m/s² across, and on a rail, the straight model
//! stands alone.
//!
//! μ and the accelerometer's bias are taken as known: on level track a μ of 0.02 that is off by a quarter is a mass off
//! by a quarter until a start or a slope dilutes it.

use nalgebra::vector;

use crate::Real;
use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, exp, ln, sqrt, tanh, within};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control;
use crate::detect::load_change::LoadChangeDetector;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::supervised::sample::BalanceSample;
use crate::supervised::two_stage::{MassEstimator, SteadyTraction};

params! {
    /// Parameters of the two-model mass regression.
    MultiModelParams {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        mu_sd ["-"] = 0.3, 0.0 => 2.0, "Standard deviation of the running resistance, as a share of the nominal value; only widens what is reported.";
        loss ["-"] = 0.05, 0.0 => 0.5, "Loss of weight in the time law λ = 1 − loss · decayᵏ.";
        decay ["-"] = 0.98, 0.0 => 1.0, "Decay in the time law.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass all signals go through.";
        regression_hz ["Hz"] = 2.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regressions; λ is per such sample.";
        settle_s ["s"] = 1.0, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual of the force balance divided by the mass.";
        load_change ["-"] = 20.0, 1.0 => 1e6, "Cumulated sum of the normalised residual that means another load.";
        load_change_detector [flag] = true, "Start both models again when residuals say that the load is another one.";
    }
}

impl MultiModelParams {
    /// Corner of the low-pass, Hz, rate of the samples, Hz, and settling time, s.
    pub fn sampling(&self) -> [Real; 3] {
        [self.cutoff_hz, self.regression_hz, self.settle_s]
    }
}

/// Least and most weight of a model while turning.
const WEIGHTS: (Real, Real) = (0.02, 0.98);

/// Mass by a straight and a turning model, each a recursive least squares, weighed by likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiModelMass {
    params: MultiModelParams,
    start: Rls<1>,
    straight: Rls<1>,
    turning: Rls<1>,
    straight_weight: Real,
    /// Σ a and Σ a² of the straight model, forgotten like its samples: what a constant error of the level does to the
    /// mass.
    sums: [Real; 2],
    load: LoadChangeDetector,
    mass0_kg: Real,
    mu: Real,
    bias_sd_mps2: Real,
    tare_kg: Real,
    range_kg: [Real; 2],
    saturated: bool,
    outcome: Outcome,
}

impl MultiModelMass {
    /// Builds the mass estimator from the vehicle, the parameters and the standard deviation of the accelerometer's
    /// bias, m/s² (`None`: that of the vehicle's sheet).
    pub fn new(vehicle: &Vehicle, params: MultiModelParams, bias_sd_mps2: Option<Real>) -> Self {
        let prior = Gaussian::independent(vector![1.0], vector![params.mass_sd]);
        let rls = Rls::new(
            prior,
            Forgetting::TimeLaw {
                loss: params.loss,
                decay: params.decay,
            },
        );
        Self {
            params,
            start: rls,
            straight: rls,
            turning: rls,
            straight_weight: 1.0,
            sums: [0.0; 2],
            load: LoadChangeDetector::new(params.load_change_detector, params.load_change),
            mass0_kg: vehicle.first_mass_kg(params.mass0_kg),
            mu: vehicle.running_resistance,
            bias_sd_mps2: vehicle.accel_bias_sd(bias_sd_mps2, 0.02),
            tare_kg: vehicle.tare_kg,
            range_kg: vehicle.mass_range_kg,
            saturated: false,
            outcome: Outcome::default(),
        }
    }

    /// M/M₀ of both models.
    fn fused(&self) -> Real {
        let (s, t) = (self.found(&self.straight), self.found(&self.turning));
        self.straight_weight * s + (1.0 - self.straight_weight) * t
    }

    /// M/M₀ of a model within the range of the mass. It limits what is published, not the recursion
    /// ([`Rls::clamp_usable`]).
    fn found(&self, rls: &Rls<1>) -> Real {
        let [low, high] = self.range_kg.map(|kg| kg / self.mass0_kg);
        within(rls.belief.x.x, low, high)
    }

    /// Another load: both start again, from the mass they have.
    fn restart(&mut self) {
        let means = [self.found(&self.straight), self.found(&self.turning)];
        for (rls, mean) in [&mut self.straight, &mut self.turning]
            .into_iter()
            .zip(means)
        {
            *rls = self.start;
            rls.belief.x.x = mean;
        }
        self.sums = [0.0; 2];
    }

    /// Share of the mass that an error of the level μ g − b by one standard deviation makes.
    fn level_error(&self) -> Real {
        let [first, second] = self.sums;
        let resistance_sd = self.params.mu_sd * self.mu * GRAVITY;
        let bias_sd = self.bias_sd_mps2;
        let level_sd = sqrt(resistance_sd * resistance_sd + bias_sd * bias_sd);
        // The prior counts as a² of its own: before any sample the level does nothing.
        let noise = self.params.residual_sd_mps2 / self.params.mass_sd;
        level_sd * first.abs() / (second + noise * noise)
    }
}

/// ln Λ of a residual e: its size tanh(|e|/2σ) against the innovation variance S in units of σ².
fn log_likelihood(rls: &Rls<1>, outcome: &Outcome, a: Real, r: Real) -> Real {
    let sd = rls.spread() * sqrt(r);
    let size = tanh(outcome.residual.abs() / (2.0 * sd.max(1e-12)));
    let S = 1.0 + a * a * rls.belief.P.x / r;
    -0.5 * (ln(2.0 * PI * S) + size * size / S)
}

impl MassEstimator for MultiModelMass {
    const INTERNALS: &'static [Internal; 6] = &[
        Internal::new("lambda", "-"),
        Internal::new("mass_residual_n", "N"),
        Internal::new("straight_mass_kg", "kg"),
        Internal::new("turning_mass_kg", "kg"),
        Internal::new("load_changes", "-"),
        Internal::new("straight_weight", "-"),
    ];

    fn sample(&mut self, now: &BalanceSample, balance: &ForceBalance) -> AidStatus {
        let acceleration = now.sample.acceleration_mps2;
        let direction = now.direction();
        // f with the slope under the load; the difference of the slope under the tare is known and goes to the other
        // side.
        let [tare_u, load_u] = now.u_mps2;
        let f = acceleration + load_u;
        let tare_kg = self.tare_kg;
        let [u, doubt] = now.whole(tare_kg, self.fused() * self.mass0_kg);
        let cosine = ForceBalance::cosine(acceleration + u, acceleration);
        let a = f + direction * self.mu * GRAVITY * cosine;
        let noise = self.params.residual_sd_mps2;
        let r = noise * noise + doubt * doubt;
        let inertia = balance.rotating_mass_kg * acceleration + tare_kg * (tare_u - load_u);

        let y = (now.sample.force_n - inertia) / self.mass0_kg;
        let Some(straight) = self.straight.update(y, &vector![a], r, false) else {
            return control::regressed(None, true);
        };
        self.outcome = straight;
        let [first, second] = self.sums;
        self.sums = [
            straight.lambda * first + a,
            straight.lambda * second + a * a,
        ];

        self.straight_weight = 1.0;
        let bend = now.bend;
        let a_turning = a + bend.taken_mps2;
        let y = (now.sample.force_n + bend.gained_n - inertia) / self.mass0_kg;
        if bend.turning()
            && let Some(turning) = self.turning.update(y, &vector![a_turning], r, false)
        {
            let (s, t) = (
                log_likelihood(&self.straight, &straight, a, r),
                log_likelihood(&self.turning, &turning, a_turning, r),
            );
            let (least, most) = WEIGHTS;
            self.straight_weight = (1.0 / (1.0 + exp(t - s))).clamp(least, most);
        }
        for rls in [&mut self.straight, &mut self.turning] {
            rls.clamp_usable();
        }
        self.saturated = [&self.straight, &self.turning]
            .iter()
            .any(|rls| self.found(rls) != rls.belief.x.x);
        if self
            .load
            .changed(straight.normalised / self.straight.spread().max(1.0))
        {
            self.restart();
        }
        control::regressed(Some(&straight), true)
    }

    fn open_load(&mut self) {
        self.restart();
    }

    /// Standard deviation: of the mixture, and of the level taken as known.
    fn mass_kg(&self) -> Value {
        let (s, t) = (self.found(&self.straight), self.found(&self.turning));
        let (w, mean) = (self.straight_weight, self.fused());
        let away = |x: Real| (x - mean) * (x - mean);
        let variance = w * (self.straight.widened().x + away(s))
            + (1.0 - w) * (self.turning.widened().x + away(t));
        let level = mean * self.level_error();
        let (value, sd) = (
            mean * self.mass0_kg,
            sqrt(variance + level * level) * self.mass0_kg,
        );
        Value {
            value,
            sd,
            valid: !self.saturated,
        }
    }

    fn running_resistance(&self, _: Real) -> Real {
        self.mu
    }

    /// Errors of mass and of resistance, taken as independent.
    fn slope_sd_rad(&self, steady: &SteadyTraction, _: Real) -> Real {
        let mass = self.mass_kg();
        let by_mass = steady.traction_n / (mass.value * GRAVITY) * mass.sd / mass.value;
        let [_, cosine] = steady.sin_cos;
        let by_resistance = self.params.mu_sd * self.mu * cosine;
        sqrt(by_mass * by_mass + by_resistance * by_resistance) / steady.by_theta()
    }

    fn unmodelled_mps2(&self) -> Real {
        let excess = self.straight.spread() * self.straight.spread() - 1.0;
        self.params.residual_sd_mps2 * sqrt(excess)
    }

    fn saturated(&self) -> bool {
        self.saturated
    }

    fn internals(&self, _: Real) -> [Real; 6] {
        let kg = self.mass0_kg;
        [
            self.outcome.lambda,
            self.outcome.residual * kg,
            self.found(&self.straight) * kg,
            self.found(&self.turning) * kg,
            self.load.changes() as Real,
            self.straight_weight,
        ]
    }
}

state!(MultiModelMass { straight, turning, straight_weight, sums, load, saturated, outcome;
    params, start, mass0_kg, mu, bias_sd_mps2, tare_kg, range_kg });

#[cfg(test)]
#[path = "multi_model_rls_tests.rs"]
mod tests;
