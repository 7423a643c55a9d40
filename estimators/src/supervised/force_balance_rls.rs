//! Mass from the force balance by recursive least squares, with the running resistance and the accelerometer's bias
//! left free.
//!
//! F − J v̇ = M (f + s μ₀ g c) + r s g c + q s g c |κ| + a,  s = sgn v, c = cos θ
//!
//! Parameters: M total mass; r what the running resistance differs from μ₀ M g c by, over g c; q the same per curvature
//! κ of the rail (yaw rate over speed: guide rollers drag in curves); a = −M b, b the accelerometer's bias. In one
//! driving direction only r s g + a is seen; the prior (sd of μ and b) shares it out, and a reversal separates the two.
//! The prior also makes the regression good in both regimes: before the specific force has varied, M is known from the
//! level of the force as well as μ₀ and b are known; once a start, a stop or a change of slope has moved f, M is its
//! slope and needs neither μ₀ nor b.
//!
//! A train is long: f and κ are means over where its masses rest ([`BalanceSample`]). With m₀ the tare, u = f − v̇
//! the part of the slope, ū₀ its mean over the tare and ū₁ over where the load rests, the force on the right is M (v̇ +
//! ū₁) + m₀ (ū₀ − ū₁): the second term is known and goes to the left, so the balance stays linear in M.
//!
//! f is the specific force of the accelerometer: a change of slope then *informs* about mass. (Liu et al. 2023, eq.
//! 16–18, take the accelerometer for v̇; the slope is then part of `a`, and a change of slope ruins the mass.)
//!
//! A torque gain error of e gives a mass error of e: no regression on torque can do better than the torque's
//! calibration.

use nalgebra::{Matrix4, Vector4, vector};

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, lag, sqrt, within};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control;
use crate::detect::excitation_gate::ExcitationGate;
use crate::detect::load_change::LoadChangeDetector;
use crate::detect::standing_load::KeptMass;
use crate::filters::ewma_variance::EwmaVariance;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::supervised::sample::BalanceSample;
use crate::supervised::two_stage::{MassEstimator, SteadyTraction};

params! {
    /// Parameters of the mass regression.
    MassParams {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of this mass, as a share of the mass.";
        mu_sd ["-"] = 0.3, 0.0 => 2.0, "Standard deviation of the running resistance, as a share of the vehicle's nominal value.";
        curve_sd_m ["m"] = 0.05, 0.0 => 10.0, "Standard deviation of a curve's addition to the running-resistance coefficient, times its radius; 0 = no addition.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the matched low-pass of all signals of the regression.";
        regression_hz ["Hz"] = 2.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression (slow enough for their errors to be independent); λ is per sample.";
        settle_s ["s"] = 1.5, 0.0 => 10.0, "Time from the end of standing or braking until learning resumes (the filters forget).";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual of the force balance divided by the mass.";
        sway_share ["-"] = 0.3, 0.0 => 2.0, "Share of the running deviation of v̇ that counts as force of a swinging load, which the balance leaves out.";
        excitation_mps2 ["m/s²"] = 0.06, 0.0 => 10.0, "Running standard deviation of the regressor above which it counts as excited.";
        excitation_memory_s ["s"] = 5.0, 0.5 => 60.0, "Memory of the running standard deviation of the regressor.";
        unexcited_weight ["-"] = 0.02, 0.0 => 1.0, "Weight of a sample without excitation (noise in the regressor makes it less informative than it seems).";
        excitation_gate [flag] = true, "Give samples little weight, without forgetting, while the regressor is not excited.";
        load_change ["-"] = 20.0, 1.0 => 1e6, "Cumulated sum of the normalised residual that shows another load, and reopens the mass.";
        load_change_detector [flag] = true, "Reopen the mass when residuals show another load.";
    }
}

impl MassParams {
    /// Corner of the low-pass, Hz, rate of the samples, Hz, and settling time, s.
    pub fn sampling(&self) -> [Real; 3] {
        [self.cutoff_hz, self.regression_hz, self.settle_s]
    }
}

/// Share of the initial variance that another load gives back to running resistance and bias term: of one that the
/// residuals tell, and of one that may have been hung on at a standstill, of which nothing is known.
const OTHER_LOAD: Real = 0.05;
const UNSEEN_LOAD: Real = 0.25;

/// Time in which a swing of the load decays, s.
const SWAY_MEMORY_S: Real = 3.0;

/// Recursive least squares for the mass on the force balance, with its excitation gate and load-change detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceBalanceRls {
    params: MassParams,
    /// Parameters divided by the first mass: [M, r, a, q]/M₀.
    rls: Rls<4>,
    /// Covariance, widened if the residuals are larger than expected or correlated.
    covariance: Matrix4<Real>,
    mass0_kg: Real,
    tare_kg: Real,
    mu0: Real,
    range_kg: [Real; 2],
    gate: ExcitationGate,
    load: LoadChangeDetector,
    /// Parameters when the residuals last kept to no side: samples of another load have not changed them.
    before: Rls<4>,
    kept: KeptMass,
    saturated: bool,
    outcome: Outcome,
    /// Variance of the acceleration: what makes the load swing.
    jolts: EwmaVariance,
}

impl ForceBalanceRls {
    /// Builds the regression from the vehicle, the parameters, the way to forget and the standard deviation of the
    /// accelerometer's bias, m/s² (`None`: the value of the vehicle's sheet).
    pub fn new(
        vehicle: &Vehicle,
        params: MassParams,
        policy: Forgetting<4>,
        bias_sd_mps2: Option<Real>,
    ) -> Self {
        let mass0_kg = vehicle.first_mass_kg(params.mass0_kg);
        let mu0 = vehicle.running_resistance;
        let sd = vector![
            params.mass_sd,
            params.mu_sd * mu0,
            vehicle.accel_bias_sd(bias_sd_mps2, 0.02),
            params.curve_sd_m
        ];
        let prior = Gaussian::independent(vector![1.0, 0.0, 0.0, 0.0], sd);
        let rls = Rls::new(prior, policy);
        Self {
            params,
            rls,
            covariance: rls.widened(),
            before: rls,
            kept: KeptMass::default(),
            mass0_kg,
            tare_kg: vehicle.tare_kg,
            mu0,
            range_kg: vehicle.mass_range_kg,
            gate: ExcitationGate::new(
                params.excitation_gate,
                params.excitation_mps2,
                params.excitation_memory_s,
            ),
            load: LoadChangeDetector::new(params.load_change_detector, params.load_change),
            saturated: false,
            outcome: Outcome {
                lambda: 1.0,
                ..Outcome::default()
            },
            jolts: EwmaVariance::default(),
        }
    }

    /// Another load is another running resistance too (bearings and clamped wheels do not get heavier), and another
    /// M b: kept with the certainty that the old load gave them they would pull the mass for as long as that certainty
    /// lasts. Not forgotten either: the load may be the same, and on a steady grade nothing else determines the mass.
    fn open(&mut self, share: Real) {
        self.rls.reset_to_prior(&vector![1.0, 0.0, 0.0, 0.0]);
        self.rls.inflate(&vector![0.0, share, share, share]);
        self.covariance = self.rls.widened();
    }

    /// Counts the mass from before a standstill as measured after it has been confirmed.
    fn recall(&mut self) {
        let now = self.rls.belief.x.x;
        if let Some([mass, variance]) = self.kept.recall(now, self.covariance.m11) {
            let whole = vector![1.0, 0.0, 0.0, 0.0];
            // Without an update, for numbers that allow none, the mass stays as weighed.
            let _ = self.rls.update(mass, &whole, variance, true);
            self.covariance = self.rls.widened();
        }
    }

    /// M/M₀ within the range of the mass. It limits what is published, not the recursion ([`Rls::clamp_usable`]).
    fn found(&self) -> Real {
        let [low, high] = self.range_kg.map(|kg| kg / self.mass0_kg);
        within(self.rls.belief.x.x, low, high)
    }
}

impl MassEstimator for ForceBalanceRls {
    const INTERNALS: &'static [Internal; 6] = &[
        Internal::new("lambda", "-"),
        Internal::new("mass_residual_n", "N"),
        Internal::new("running_resistance", "-"),
        Internal::new("accel_bias_mps2", "m/s²"),
        Internal::new("load_changes", "-"),
        Internal::new("windup_limit", "-"),
    ];

    fn sample(&mut self, now: &BalanceSample, balance: &ForceBalance) -> AidStatus {
        let acceleration = now.sample.acceleration_mps2;
        let tare = self.tare_kg / self.mass0_kg;
        let curvature = now.curvature_per_m;
        let [tare_u, load_u] = now.u_mps2;
        let [u, doubt] = now.whole(tare, self.found());
        let f = acceleration + load_u;
        let cosine = ForceBalance::cosine(acceleration + u, acceleration);
        // Force of the tare beyond that of the load, over M₀, m/s².
        let known = tare * (tare_u - load_u);
        self.gate.observe(f, now.sample.period_s);
        let excited = self.gate.excited();

        let against = now.direction() * GRAVITY * cosine;
        let y =
            (now.sample.force_n - balance.rotating_mass_kg * acceleration) / self.mass0_kg - known;
        let h = vector![f + against * self.mu0, against, 1.0, against * curvature];
        let weight = if excited {
            1.0
        } else {
            self.params.unexcited_weight
        };
        if weight <= 0.0 {
            return control::without(AidOutcome::Rejected(Rejection::NotExcited));
        }
        self.jolts.add(
            acceleration,
            lag(now.sample.period_s.min(60.0), SWAY_MEMORY_S),
        );
        let noise = self.params.residual_sd_mps2;
        let sway = self.params.sway_share * self.params.sway_share * self.jolts.variance();
        let r = (noise * noise + doubt * doubt + sway) / weight;
        let Some(outcome) = self.rls.update(y, &h, r, !excited) else {
            return control::regressed(None, excited);
        };
        self.outcome = outcome;
        self.rls.clamp_usable();
        self.saturated = self.found() != self.rls.belief.x.x;
        if excited
            && self
                .load
                .changed(outcome.normalised / self.rls.spread().max(1.0))
        {
            self.rls = self.before;
            self.kept.forget();
            self.open(OTHER_LOAD);
        }
        if self.load.at_rest() {
            self.before = self.rls;
        }
        self.covariance = self.rls.widened();
        if excited {
            self.recall();
        }
        control::regressed(Some(&outcome), excited)
    }

    fn pause(&mut self) {
        self.gate.close();
    }

    fn open_load(&mut self) {
        self.kept.keep(self.rls.belief.x.x, self.covariance.m11);
        self.open(UNSEEN_LOAD);
        self.before = self.rls;
    }

    fn mass_kg(&self) -> Value {
        let value = self.found() * self.mass0_kg;
        let sd = sqrt(self.covariance.m11) * self.mass0_kg;
        Value::new(value, sd, !self.saturated)
    }

    /// Running resistance, as far as it is separated from the accelerometer's bias, with the addition of the curve
    /// under the train.
    fn running_resistance(&self, curvature_per_m: Real) -> Real {
        let x = self.rls.belief.x;
        (self.mu0 + (x.y + x.w * curvature_per_m) / self.found()).clamp(0.0, 1.0)
    }

    /// Mass with μ = μ₀ + (r + q |κ|)/M.
    fn slope_sd_rad(&self, steady: &SteadyTraction, curvature_per_m: Real) -> Real {
        let (x, m) = (self.rls.belief.x, self.found());
        let [_, cosine] = steady.sin_cos;
        let against = steady.direction * cosine;
        let by_m = -steady.traction_n / (self.mass0_kg * GRAVITY * m * m)
            + against * (x.y + x.w * curvature_per_m) / (m * m);
        let by_r = -against / m;
        let gradient: Vector4<Real> = vector![by_m, by_r, 0.0, by_r * curvature_per_m];
        sqrt(gradient.dot(&(self.covariance * gradient))) / steady.by_theta()
    }

    fn excited(&self) -> bool {
        self.gate.excited()
    }

    fn unmodelled_mps2(&self) -> Real {
        let excess = self.rls.spread() * self.rls.spread() - 1.0;
        self.params.residual_sd_mps2 * sqrt(excess)
    }

    fn saturated(&self) -> bool {
        self.saturated
    }

    fn internals(&self, curvature_per_m: Real) -> [Real; 6] {
        let bias = -self.rls.belief.x.z / self.found();
        let limited = if self.outcome.limited { 1.0 } else { 0.0 };
        let residual_n = self.outcome.residual * self.mass0_kg;
        [
            self.outcome.lambda,
            residual_n,
            self.running_resistance(curvature_per_m),
            bias,
            self.load.changes() as Real,
            limited,
        ]
    }
}

state!(ForceBalanceRls { rls, gate, load, before, kept, saturated, outcome, jolts, covariance; params, mass0_kg, tare_kg, mu0, range_kg });

#[cfg(test)]
#[path = "force_balance_rls_tests.rs"]
mod tests;
