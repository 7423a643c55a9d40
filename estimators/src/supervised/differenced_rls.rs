//! Mass from *changes* of traction and acceleration (Guo et al. 2024, eq. 2–7):
//!
//! Δ(F + J b) = X Δ(v̇ + b), X = M + J, by recursive least squares with constant forgetting
//!
//! F is the traction less air drag, J the rotating masses and b, on a road, what a bend takes
//! ([`Bend`](crate::models::single_track::Bend)).
//!
//! Against the print, the parameter is X₀/X with the change of acceleration as the measurement and the change of force
//! as the regressor. The noise is in the acceleration; as a regressor it draws the mass towards 0, by a share that no
//! standard deviation of the recursion knows (Söderström 2007, errors in variables). And the change of acceleration is
//! that of the specific force, as the slope is steady: the speed of a driven wheel changes with its slip, by 0.25 m/s
//! when a car at 60 km/h stops to accelerate. Without an accelerometer it is that of the wheels.
//!
//! Differences rid the equation of the running resistance and of a steady slope. They also keep only the noisiest part
//! of the signals, and a slope that changes between two samples is taken for acceleration; hence the differences over a
//! quarter of a second instead of one sample (which drives the estimate to 0), the rotating masses taken off, and two
//! gates: the change of force must be considerable, and by the accelerometer the slope (of a long train the effective
//! one) must not have changed. At steady speed the mass is held. It starts from its prior and needs real starts and
//! stops; on a crane that rolls along quietly its standard deviation stays large.

use nalgebra::vector;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::params::params;
use crate::api::real::{PI, sqrt, within};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::supervised::sample::BalanceSample;

params! {
    /// Parameters of the differenced mass regression.
    DifferencedParams {
        omega ["-"] = 0.999, 0.5 => 1.0, "Constant forgetting factor ω, per difference used.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        cutoff_hz ["Hz"] = 2.0, 0.05 => 20.0, "Corner of the matched low-pass both sides go through.";
        difference_hz ["Hz"] = 4.0, 0.1 => 100.0, "Rate of the samples whose differences are taken.";
        settle_s ["s"] = 0.5, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
        excitation_gate [flag] = true, "Use only differences whose change of force is considerable.";
        force_gate_mps2 ["m/s²"] = 0.05, 0.0 => 10.0, "Smallest change of force divided by mass that counts.";
        slope_gate_mps2 ["m/s²"] = 0.05, 0.0 => 10.0, "Largest change of f − v̇ (g times the change of slope) that passes.";
        difference_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "Expected residual of the differenced force balance divided by the mass; the noise of the accelerometer counts where it is larger.";
    }
}

impl DifferencedParams {
    /// Corner of the low-pass, Hz, rate of the samples, Hz, and settling time, s.
    pub fn sampling(&self) -> [Real; 3] {
        [self.cutoff_hz, self.difference_hz, self.settle_s]
    }
}

/// Smallest X₀/X that is divided by.
const LEAST_SHARE: Real = 1e-3;

/// Recursive least squares for the mass on differences of force and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferencedMass {
    params: DifferencedParams,
    last: Option<BalanceSample>,
    /// X₀/X, X the mass with the rotating masses.
    rls: Rls<1>,
    mass0_kg: Real,
    rotating_kg: Real,
    tare_kg: Real,
    range_kg: [Real; 2],
    /// Variances that the noise of the accelerometer and of the wheels gives to a difference of the acceleration,
    /// m²/s⁴.
    noise: [Real; 2],
    excited: bool,
    saturated: bool,
    outcome: Outcome,
}

impl DifferencedMass {
    /// Builds the mass estimator from the vehicle and the parameters.
    pub fn new(vehicle: &Vehicle, params: DifferencedParams) -> Self {
        let mass0_kg = vehicle.first_mass_kg(params.mass0_kg);
        let share = mass0_kg / (mass0_kg + vehicle.rotating_mass_kg);
        let prior = Gaussian::independent(vector![1.0], vector![params.mass_sd * share]);
        Self {
            params,
            last: None,
            rls: Rls::new(prior, Forgetting::Constant(params.omega)),
            mass0_kg,
            rotating_kg: vehicle.rotating_mass_kg,
            tare_kg: vehicle.tare_kg,
            range_kg: vehicle.mass_range_kg,
            noise: [0.0; 2],
            excited: false,
            saturated: false,
            outcome: Outcome::default(),
        }
    }

    /// Takes a sample of the force balance and returns what became of its difference from the one before.
    pub fn sample(&mut self, sample: &BalanceSample) -> AidStatus {
        match self.last.replace(*sample) {
            Some(before) => self.difference(&before, sample),
            _ => control::without(AidOutcome::Rejected(Rejection::NotRunning)),
        }
    }

    /// Takes the standard deviations of specific force, m/s², and wheel speed, m/s, of samples `dt` seconds apart.
    ///
    /// White noise of variance σ² behind two poles of corner ω has the variance σ² dt ω/4, its derivative σ² dt ω³/4.
    pub fn set_noise(&mut self, [force_sd, speed_sd]: [Real; 2], dt: Real) {
        let corner = 2.0 * PI * self.params.cutoff_hz;
        let of_both = |sd: Real| 0.5 * sd * sd * dt * corner;
        self.noise = [of_both(force_sd), of_both(speed_sd) * corner * corner];
    }

    /// The force balance has been interrupted: the next sample has nothing to differ from.
    pub fn pause(&mut self) {
        self.excited = false;
        self.last = None;
    }

    /// Another load may hang on the train: the mass keeps its value and is as uncertain as at the start.
    pub fn open_load(&mut self) {
        self.rls.reset_to_prior(&vector![1.0]);
    }

    /// X₀, kg.
    fn whole0_kg(&self) -> Real {
        self.mass0_kg + self.rotating_kg
    }

    /// X₀/X as found. A mass beyond all bounds has 0 or less: it counts as the largest there is.
    fn share(&self) -> Real {
        self.rls.belief.x.x.max(LEAST_SHARE)
    }

    /// X, kg.
    fn whole_kg(&self) -> Real {
        self.whole0_kg() / self.share()
    }

    fn difference(&mut self, before: &BalanceSample, now: &BalanceSample) -> AidStatus {
        let (bend, bend_before) = (now.bend, before.bend);
        let slope = |sample: &BalanceSample| {
            let [u, _] = sample.whole(self.tare_kg, self.found_kg());
            u
        };
        let (u, u_before) = (slope(now), slope(before));
        let [of_accelerometer, of_wheels] = self.noise;
        let (faster, noise) = match by_accelerometer(before, now) {
            Some(faster) => (faster, of_accelerometer),
            None => (
                now.sample.acceleration_mps2 - before.sample.acceleration_mps2,
                of_wheels,
            ),
        };
        let taken = bend.taken_mps2 - bend_before.taken_mps2;
        let force =
            now.sample.force_n - before.sample.force_n + bend.gained_n - bend_before.gained_n;
        let y = faster + taken;
        let h = (force + self.rotating_kg * taken) / self.whole0_kg();
        let steady_slope = (u - u_before).abs() < self.params.slope_gate_mps2;
        let moved = !self.params.excitation_gate
            || force.abs() > self.params.force_gate_mps2 * self.mass0_kg;
        self.excited = steady_slope && moved;
        if !self.excited {
            return control::without(AidOutcome::Rejected(Rejection::NotExcited));
        }
        let expected = self.params.difference_sd_mps2 * self.params.difference_sd_mps2;
        let r = expected.max(noise);
        let Some(outcome) = self.rls.update(y, &vector![h], r, false) else {
            return control::regressed(None, true);
        };
        self.outcome = outcome;
        self.rls.clamp_usable();
        let [low, high] = self.range_kg;
        self.saturated = !(low..=high).contains(&(self.whole_kg() - self.rotating_kg));
        control::regressed(Some(&outcome), true)
    }

    /// Mass within its range, kg. It limits what is published, not the recursion ([`Rls::clamp_usable`]).
    fn found_kg(&self) -> Real {
        let [low, high] = self.range_kg;
        within(self.whole_kg() - self.rotating_kg, low, high)
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Value {
        let value = self.found_kg();
        // of X₀/x by x
        let sd = sqrt(self.rls.widened().x) * self.whole_kg() / self.share();
        Value {
            value,
            sd,
            valid: !self.saturated,
        }
    }

    /// Returns true if the last difference was used.
    pub fn excited(&self) -> bool {
        self.excited
    }

    /// Returns true if the mass is held at an end of its range.
    pub fn saturated(&self) -> bool {
        self.saturated
    }

    /// Residual of the last difference used, N.
    pub fn residual_n(&self) -> Real {
        -self.outcome.residual * self.whole_kg()
    }
}
/// Change of the acceleration from a sample to another by the accelerometer, m/s²; `None` unless both have a reading.
fn by_accelerometer(before: &BalanceSample, now: &BalanceSample) -> Option<Real> {
    let of_body = |s: &BalanceSample| Some(s.sample.specific_force_mps2? + s.bend.drift_mps2);
    Some(of_body(now)? - of_body(before)?)
}

state!(DifferencedMass { last, rls, noise, excited, saturated, outcome; params, mass0_kg, rotating_kg, tare_kg, range_kg });

#[cfg(test)]
#[path = "differenced_rls_tests.rs"]
mod tests;
