//! Liu Zechao, Li Jingzhao, Zheng Changlu et al. 2023, section 2.2: `resistance_dffrls`, the running-resistance
//! coefficient μ of a train of known mass by least squares with dynamic forgetting, y = h μ.
//!
//! The published method with its errata corrected and nothing else:
//!
//! - eq. 9: the rotating masses J have no g
//! - eq. 12: the forgetting factor from the residual before the update
//! - eq. 14: the gain divided by φ + hᵀ P h; in print it is multiplied
//!
//! The paper takes θ from a survey; here the accelerometer reads v̇ + g sin θ at once. P₀ and σ are not given.

use nalgebra::vector;

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::estimator::copy_into;
use crate::api::params::params;
use crate::api::real::{GRAVITY, asin, sqrt};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::force_balance::ForceBalance;
use crate::models::sample::ResampledSample;

params! {
    /// Constants of eq. 8–15.
    Regression {
        known_mass_kg ["kg"] = none, 1.0 => 1e6, "Total mass, known; not set: the middle of the vehicle's mass range.";
        resistance0 ["-"] = 0.0, 0.0 => 1.0, "μ at the start.";
        resistance0_sd ["-"] = 0.5, 1e-4 => 1.0, "Standard deviation of μ at the start: P₀, which is not given.";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual, the unit of P₀.";
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor of the first sample.";
        delta ["-"] = 0.95, 0.5 => 1.0, "Smallest forgetting factor δ.";
        sigma ["s²/m"] = 5.0, 0.0 => 1000.0, "Decrease of φ with the residual; not given.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
        rate_hz ["Hz"] = 200.0, 0.1 => 1000.0, "Sampling rate; φ is per sample.";
    }
}

methods! {
    /// The method.
    resistance_dffrls: ResistancePublished = ResistanceRegression,
        { regression: Regression },
        |vehicle, p| build(vehicle, &p.regression);
}

/// The regression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResistanceRegression {
    mass_kg: Real,
    rotating_mass_kg: Real,
    r: Real,
    rls: Rls<1>,
    /// Grade angle, rad, from accelerometer and wheels.
    grade_rad: Real,
    learnt: bool,
    outcome: Outcome,
}

impl ResistanceRegression {
    fn learn(&mut self, now: &ResampledSample, direction: Real) -> Option<()> {
        let (f, v_dot) = (now.specific_force_mps2?, now.acceleration_mps2);
        let net_n = now.force_n - self.rotating_mass_kg * v_dot;
        let y = net_n / self.mass_kg - f; // eq. 9: f = g sin θ + v̇
        let h = direction * GRAVITY * ForceBalance::cosine(f, v_dot); // eq. 10
        self.outcome = self.rls.update(y, &vector![h], self.r, false)?; // eq. 12–15
        self.grade_rad = asin((f - v_dot) / GRAVITY);
        self.learnt = true;
        Some(())
    }
}

impl Method for ResistanceRegression {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("running_resistance", "-"),
        Internal::new("running_resistance_sd", "-"),
        Internal::new("lambda", "-"),
        Internal::new("residual_mps2", "m/s²"),
    ];

    fn step(&mut self, z: &Signals) {
        let _ = z.sample.and_then(|now| self.learn(&now, z.direction));
    }

    /// The mass is known, the slope is what the accelerometer reads: neither is an answer of the method.
    fn answer(&self) -> Answer {
        let found = |value, sd| Found {
            value,
            sd,
            started: self.learnt,
        };
        Answer {
            mass_kg: Some(found(self.mass_kg, 0.0)),
            grade_rad: found(self.grade_rad, sqrt(self.r) / GRAVITY),
            speed_mps: None,
            innovation: (
                self.outcome.residual,
                self.outcome.normalised * self.outcome.normalised,
            ),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (mu, sd) = (self.rls.belief.x.x, sqrt(self.rls.widened().x));
        copy_into(
            values,
            &[mu, sd, self.outcome.lambda, self.outcome.residual],
        );
    }
}

state!(ResistanceRegression { rls, grade_rad, learnt, outcome; mass_kg, rotating_mass_kg, r });

fn build(vehicle: &Vehicle, p: &Regression) -> ([Real; 2], ResistanceRegression) {
    let prior = Gaussian::independent(vector![p.resistance0], vector![p.resistance0_sd]);
    let policy = Forgetting::ByResidual {
        floor: p.delta,
        sharpness: p.sigma,
        first: p.lambda0,
    };
    let method = ResistanceRegression {
        mass_kg: vehicle.first_mass_kg(p.known_mass_kg),
        rotating_mass_kg: vehicle.rotating_mass_kg,
        r: p.residual_sd_mps2 * p.residual_sd_mps2,
        rls: Rls::new(prior, policy),
        grade_rad: 0.0,
        learnt: false,
        outcome: Outcome::default(),
    };
    ([p.cutoff_hz, p.rate_hz], method)
}
