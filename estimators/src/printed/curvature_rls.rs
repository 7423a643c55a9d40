//! Vertical curvature of the rail from accelerometer and wheel speed, by recursive least squares that forgets.
//!
//! An accelerometer reads f = v̇ + g sin θ, so d(f − v̇)/dt = g cos θ θ̇, and on a rail θ̇ = ρ v:
//!
//! d(f − v̇)/dt = (g v cos θ) ρ,  ρ = dθ/ds, 1/m
//!
//! (The curvature model of the DFFRLS-AUKF method, its eq. 5–6 and 11–13; in print the cosine is missing.) A constant
//! bias of the accelerometer drops out. Both sides go through the same filters: adaptive smoothing, a matched low-pass
//! that gives v̇, and a second one that gives the derivative of f − v̇.

use nalgebra::vector;

use crate::Real;
use crate::api::params::params;
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, cos, sqrt, within};
use crate::api::signals::Vehicle;
use crate::api::snapshot::state;
use crate::filters::adaptive_low_pass::AdaptiveSmoother;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::models::slope_force::SlopeForce;

params! {
    /// Parameters of the curvature regression.
    CurvatureParams {
        smoothing_hz ["Hz"] = 3.0, 0.05 => 50.0, "Corner of the adaptive smoothing while the signal is calm; it rises to three and ten times this value.";
        smoothing_noise_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Amplitude Γ₀ of the accelerometer's noise at rest.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the two matched low-passes.";
        regression_hz ["Hz"] = 10.0, 0.1 => 1000.0, "Rate at which filtered samples enter the regression.";
        jerk_sd_mps3 ["m/s³"] = 0.1, 1e-3 => 100.0, "Expected residual of the derivative of f − v̇.";
        curvature0_sd_per_m ["1/m"] = 0.05, 1e-4 => 1.0, "Standard deviation of the curvature before any measurement.";
        curvature_max_per_m ["1/m"] = 0.25, 1e-3 => 1.0, "Largest curvature a rail has.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the curvature is not learnt; not set: 0.05 on a rail, 0.3 on a road.";
        settle_s ["s"] = 1.0, 0.0 => 10.0, "Time after standing before learning resumes.";
    }
}

params! {
    /// Dynamic forgetting of the curvature.
    DynamicForgetting {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor until the size of the residual is known.";
        delta ["-"] = 0.6, 0.5 => 1.0, "Smallest forgetting factor δ, per regression sample.";
        sigma ["-"] = 3.0, 0.0 => 1000.0, "Decrease of λ with the residual in units of its standard deviation.";
    }
}

impl DynamicForgetting {
    /// The policy of these parameters.
    pub fn policy(&self) -> Forgetting<1> {
        Forgetting::Dynamic {
            floor: self.delta,
            sharpness: self.sigma,
            first: self.lambda0,
        }
    }
}

/// The regression on ρ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    params: CurvatureParams,
    standstill_mps: Real,
    smoother: AdaptiveSmoother<2>,
    signals: SlopeForce,
    rls: Rls<1>,
    /// True if both instruments had a value in the last step.
    fresh: bool,
    running_s: Real,
    since_sample_s: Real,
    outcome: Outcome,
}

impl Curvature {
    /// Builds the regression of the curvature from the vehicle, its parameters and the way to forget.
    pub fn new(vehicle: &Vehicle, params: CurvatureParams, policy: Forgetting<1>) -> Self {
        let calm = params.smoothing_hz;
        let prior = Gaussian::independent(vector![0.0], vector![params.curvature0_sd_per_m]);
        Self {
            params,
            standstill_mps: vehicle.standstill_mps(params.standstill_mps),
            smoother: AdaptiveSmoother::new(
                [calm, 3.0 * calm, 10.0 * calm],
                params.smoothing_noise_mps2,
                [3.0, 6.0],
            ),
            signals: SlopeForce::new(params.cutoff_hz),
            rls: Rls::new(prior, policy),
            fresh: false,
            running_s: 0.0,
            since_sample_s: 0.0,
            outcome: Outcome {
                lambda: 1.0,
                ..Outcome::default()
            },
        }
    }

    /// One step, at a grade angle `theta` (only its cosine is used).
    pub fn step(&mut self, reading: &Reading, theta: Real, dt: Real) {
        let Some((f, v)) = reading.specific_force_mps2.zip(reading.speed_mps) else {
            (self.running_s, self.fresh) = (0.0, false);
            return;
        };
        self.fresh = true;
        let [f, v] = self.smoother.step([f, v], dt);
        let Some((jerk, speed)) = self.signals.step(f, v, dt) else {
            return;
        };

        self.running_s = if v.abs() > self.standstill_mps {
            self.running_s + dt
        } else {
            0.0
        };
        self.since_sample_s += dt;
        let due = self.since_sample_s * self.params.regression_hz >= 1.0 - 1e-9;
        if due && self.running_s >= self.params.settle_s {
            self.since_sample_s = 0.0;
            let h = GRAVITY * cos(theta) * speed;
            let r = self.params.jerk_sd_mps3 * self.params.jerk_sd_mps3;
            self.outcome = self
                .rls
                .update(jerk, &vector![h], r, false)
                .unwrap_or(self.outcome);
            self.rls.clamp_usable();
        }
    }

    /// Curvature ρ, 1/m, and its standard deviation. While standing, and just after, it is not known: 0.
    pub fn per_m(&self) -> (Real, Real) {
        if self.learning() {
            let belief = &self.rls.belief;
            let most = self.params.curvature_max_per_m;
            (
                within(belief.x.x, -most, most),
                sqrt(belief.P.x) * self.rls.spread(),
            )
        } else {
            (0.0, self.params.curvature0_sd_per_m)
        }
    }

    /// Returns true if the train has moved long enough for the regression to learn.
    pub fn learning(&self) -> bool {
        self.running_s >= self.params.settle_s
    }
}

state!(Curvature { smoother, signals, rls, fresh, running_s, since_sample_s, outcome; params, standstill_mps });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;

    /// A train at constant speed through a circular arc, with an accelerometer bias.
    fn finds_the_arc(policy: Forgetting<1>) {
        for (rho, bias) in [(0.05, 0.0), (0.05, 0.5), (-0.1, -0.2)] {
            let mut curvature = Curvature::new(&vehicle(), CurvatureParams::default(), policy);
            let (v, dt): (Real, Real) = (0.5, 0.01);
            let mut theta: Real = 0.0;
            for _ in 0..1000 {
                theta += rho * v * dt;
                let reading = Reading {
                    speed_mps: Some(v),
                    specific_force_mps2: Some(9.81 * theta.sin() + bias),
                    ..Default::default()
                };
                curvature.step(&reading, theta, dt);
            }
            let (found, _) = curvature.per_m();
            assert!((found / rho - 1.0).abs() < 0.03, "{found} for {rho}");
        }
    }

    #[test]
    fn finds_the_curvature_of_an_arc_whatever_the_bias() {
        finds_the_arc(DynamicForgetting::default().policy());
        finds_the_arc(Forgetting::Constant(0.9));
    }

    #[test]
    fn knows_nothing_standing() {
        let policy = DynamicForgetting::default().policy();
        let mut curvature = Curvature::new(&vehicle(), CurvatureParams::default(), policy);
        for k in 0..1000 {
            let f = 0.01 * k as Real;
            curvature.step(
                &Reading {
                    speed_mps: Some(0.0),
                    specific_force_mps2: Some(f),
                    ..Default::default()
                },
                0.0,
                0.01,
            );
        }
        assert_eq!(curvature.per_m(), (0.0, 0.05));
    }

    fn straight(k: usize, speed_mps: Real) -> Reading {
        Reading {
            speed_mps: Some(speed_mps),
            specific_force_mps2: Some(1.0 + 0.3 + 0.001 * k as Real),
            ..Default::default()
        }
    }

    #[test]
    fn the_standstill_speed_is_that_of_the_vehicle_and_learning_starts_after_settling() {
        let new = |standstill_mps| {
            let params = CurvatureParams {
                standstill_mps,
                ..Default::default()
            };
            Curvature::new(&vehicle(), params, Forgetting::None)
        };
        assert_eq!(new(None).standstill_mps, 0.05);
        let mut curvature = new(Some(0.2));
        assert_eq!(
            (curvature.standstill_mps, curvature.outcome.lambda),
            (0.2, 1.0)
        );
        for (speed, learning) in [(0.1, false), (0.5, true), (0.1, false), (-0.5, true)] {
            for k in 0..95 {
                curvature.step(&straight(k, speed), 0.0, 0.01);
                assert!(!learning || !curvature.learning());
            }
            for k in 0..200 {
                curvature.step(&straight(k, speed), 0.0, 0.01);
            }
            assert_eq!(curvature.learning(), learning, "{speed}");
        }
        curvature.step(&Reading::default(), 0.0, 0.01);
        assert!(!curvature.learning());
    }

    /// At constant speed every sample brings h²/r, h = g v cos θ, ten times a second.
    #[test]
    fn the_information_about_curvature_grows_by_the_square_of_speed() {
        let params = CurvatureParams::default();
        let mut curvature = Curvature::new(&vehicle(), params, Forgetting::None);
        let (v, theta): (Real, Real) = (2.0, 0.5);
        for _ in 0..5_000 {
            let reading = Reading {
                speed_mps: Some(v),
                specific_force_mps2: Some(1.0),
                ..Default::default()
            };
            curvature.step(&reading, theta, 0.01);
        }
        let (h, r) = (GRAVITY * v * cos(theta), 0.1 * 0.1);
        let samples = curvature.rls.updates() as Real;
        assert!((485.0..=500.0).contains(&samples), "{samples}");
        let information = 1.0 / (0.05 * 0.05) + samples * h * h / r;
        assert!((curvature.rls.belief.P.x * information - 1.0).abs() < 1e-2);
        let (found, sd) = curvature.per_m();
        assert!(found.abs() < 1e-6);
        assert!((sd / (curvature.rls.spread() / information.sqrt()) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_smoothing_opens_to_three_and_ten_times_its_corner() {
        let params = CurvatureParams::default();
        let curvature = Curvature::new(&vehicle(), params, Forgetting::None);
        let expected = AdaptiveSmoother::new([3.0, 9.0, 30.0], 0.02, [3.0, 6.0]);
        assert_eq!(curvature.smoother, expected);
    }

    #[test]
    fn the_forgetting_factor_is_that_of_the_last_update() {
        let policy = Forgetting::Constant(0.9);
        let mut curvature = Curvature::new(&vehicle(), CurvatureParams::default(), policy);
        for k in 0..300 {
            curvature.step(&straight(k, 1.0), 0.0, 0.01);
        }
        assert_eq!(curvature.outcome.lambda, 0.9);
    }
}
