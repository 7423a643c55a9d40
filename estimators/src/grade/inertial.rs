//! Slope from accelerometer and wheel speed with a curvature feed-forward: what the pipelines of the DFFRLS-AUKF method share.
//!
//! x = [v, θ]:  v⁻ = v + dt (f − g sin θ),  θ⁻ = θ + dt ρ v,  z = wheel speed
//!
//! (The consistent reading of the DFFRLS-AUKF method's eq. 14–16, which print a state [a, θ′] whose units do not fit.) The
//! filter is unscented, the method itself, or extended, its baseline; the model is all but linear, so the two agree.
//!
//! It needs neither torque nor mass nor resistance, works under the brake and standing, and estimates no mass. Its slope is never
//! better than the accelerometer's bias: 0.01 m/s² is 0.06°. With a pitch gyro in place of ρ v it is several times better.

use nalgebra::{Matrix1, Matrix2, matrix, vector};

use crate::api::estimator::Internal;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, cos, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, visit_built};
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::sage_husa::SageHusa;
use crate::filters::ukf::Spread;
use crate::filters::{ekf, ukf};
use crate::grade::curvature_rls::Curvature;
use crate::grade::force_balance_ekf::MAX_GRADE_RAD;
use crate::models::distributed_train::{DistributedTrain, steeper};
use crate::pipelines::runner::{Pipeline, copy_into};
use crate::preprocess::sample_hold::Reading;
use crate::{Real, Time};

params! {
    /// Sigma points of the unscented slope filter.
    SigmaParams {
        alpha ["-"] = 0.97, 1e-3 => 1.0, "Spread α of the sigma points.";
        beta ["-"] = 2.0, 0.0 => 10.0, "Tail constant β of the sigma points; 2 for a Gaussian.";
        kappa_ukf ["-"] = 1.0, -1.0 => 10.0, "Second spread κ of the sigma points; 3 − n = 1.";
    }
}

params! {
    /// Parameters of the inertial slope filter.
    InertialParams {
        q_v ["m²/s³"] = 1e-6, 1e-12 => 10.0, "Process noise of speed.";
        q_theta ["rad²/s"] = 5e-6, 1e-12 => 10.0, "Process noise of the grade angle with the curvature feed-forward.";
        q_theta_gyro ["rad²/s"] = 1e-8, 1e-12 => 10.0, "Process noise of the grade angle with the gyro.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed.";
        accel_bias_sd_mps2 ["m/s²"] = 0.01, 0.0 => 1.0, "Standard deviation of the accelerometer's bias, which the filter cannot see.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Its standard deviation.";
        gyro [flag] = false, "The pitch gyro carries the slope forward, not the curvature.";
    }
}

/// The filter with its curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvatureSlope<const N: usize> {
    params: InertialParams,
    /// Sigma points; `None`: extended.
    spread: Option<Spread>,
    curvature: Curvature<N>,
    train: DistributedTrain,
    mass_range_kg: [Real; 2],
    belief: Gaussian<2>,
    R: Matrix1<Real>,
    adaptive: Option<SageHusa<1>>,
    mass: Value,
    standstill_mps: Real,
    started: bool,
    saturated: bool,
    last: Option<Correction<1, 2>>,
}

impl<const N: usize> CurvatureSlope<N> {
    /// Unscented with sigma points or extended without; with a constant measurement noise, or with one adapted with the `fading`
    /// factor of Sage & Husa.
    pub fn new(
        vehicle: &Vehicle,
        params: InertialParams,
        curvature: Curvature<N>,
        sigma: Option<SigmaParams>,
        fading: Option<Real>,
    ) -> Self {
        let [low, high] = vehicle.mass_range_kg;
        let R = Matrix1::new(params.wheel_speed_sd_mps * params.wheel_speed_sd_mps);
        let x = vector![0.0, params.grade0_deg * PI / 180.0];
        let sd = vector![params.wheel_speed_sd_mps, params.grade0_sd_deg * PI / 180.0];
        Self {
            params,
            spread: sigma.map(|sigma| Spread {
                alpha: sigma.alpha,
                beta: sigma.beta,
                kappa: sigma.kappa_ukf,
            }),
            standstill_mps: curvature.standstill_mps(),
            train: DistributedTrain::new(vehicle, Some(curvature.standstill_mps())),
            mass_range_kg: vehicle.mass_range_kg,
            curvature,
            belief: Gaussian::independent(x, sd),
            R,
            adaptive: fading.map(|b| SageHusa::new(R, b, [0.01, 100.0])),
            // It estimates no mass: all it says is the vehicle's range (a uniform distribution).
            mass: Value {
                value: 0.5 * (low + high),
                sd: (high - low) / sqrt(12.0),
                valid: false,
            },
            started: false,
            saturated: false,
            last: None,
        }
    }

    fn predict(&mut self, reading: &Reading, dt: Real) {
        let rho = self.curvature.per_m().0;
        let gyro = reading.pitch_rate_radps.filter(|_| self.params.gyro);
        let f = reading.specific_force_mps2;
        let q_theta = if gyro.is_some() {
            self.params.q_theta_gyro
        } else {
            self.params.q_theta
        };
        // Without an accelerometer the speed may do anything, up to 1 m/s² or so.
        let q_v = if f.is_some() { self.params.q_v } else { 1.0 };
        let Q = Matrix2::from_diagonal(&vector![q_v, q_theta]) * dt;
        let next = |x: &nalgebra::Vector2<Real>| {
            let acceleration = f.map_or(0.0, |f| f - GRAVITY * sin(x.y));
            vector![
                x.x + dt * acceleration,
                x.y + dt * gyro.unwrap_or(rho * x.x)
            ]
        };
        if let Some(spread) = &self.spread {
            // P is kept positive definite by Q; should rounding break it, the next measurement finds the last one.
            let _ = ukf::predict(&mut self.belief, spread, next, &Q);
        } else {
            let x = self.belief.x;
            let by_theta = f.map_or(0.0, |_| -dt * GRAVITY * cos(x.y));
            let by_v = gyro.map_or(dt * rho, |_| 0.0);
            let F = matrix![1.0, by_theta; by_v, 1.0];
            ekf::predict(&mut self.belief, next(&x), &F, &Q);
        }
        self.saturated = false;
        self.limit();
    }

    /// No rail is steeper than the limit, whatever an instrument says.
    fn limit(&mut self) {
        let inside = self.belief.x.y.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD);
        self.saturated |= inside != self.belief.x.y;
        self.belief.x.y = inside;
    }

    fn update(&mut self, speed: Real) {
        if !self.started {
            self.belief.x.x = speed;
            self.started = true;
        }
        let R = self.adaptive.map_or(self.R, |noise| *noise.covariance());
        let (z, H) = (vector![speed], matrix![1.0, 0.0]);
        let correction = match &self.spread {
            Some(spread) => ukf::update(&mut self.belief, spread, z, |x| vector![x.x], &R),
            None => {
                let z_predicted = H * self.belief.x;
                ekf::update(&mut self.belief, z, z_predicted, &H, &R)
            }
        };
        let Some(correction) = correction else {
            return;
        };
        self.last = Some(correction);
        self.limit();
        if let Some(noise) = self.adaptive.as_mut() {
            noise.observe_residual(&(z - H * self.belief.x), &H, &self.belief);
            self.saturated |= noise.limited();
        }
    }
}

impl<const N: usize> Pipeline for CurvatureSlope<N> {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("curvature_sd_per_m", "1/m"),
        Internal::new("lambda", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("slope_filter_sd_rad", "rad"),
    ];

    fn advance(&mut self, reading: &Reading, t_s: Time, dt: Real) -> Estimate {
        self.curvature.step(reading, self.belief.x.y, dt);
        let (place, delayed_mps) = self.curvature.at_place();
        let speed = reading.speed_mps.unwrap_or(delayed_mps);
        self.train.roll(place, delayed_mps, speed, dt);
        self.predict(reading, dt);
        if let Some(speed) = reading.new_speed_mps {
            self.update(speed);
        }
        let Gaussian { x, P } = self.belief;
        let bias_rad = self.params.accel_bias_sd_mps2 / GRAVITY;
        let sd = sqrt(P.m22 + bias_rad * bias_rad);
        let known = reading.specific_force_mps2.is_some() && reading.speed_mps.is_some();
        // It knows no mass: the spread of the effective grade over all masses possible is added to the doubt.
        let ahead = self.train.ahead(self.mass.value);
        let [light, heavy] = self.mass_range_kg.map(|kg| self.train.ahead(kg).unit);
        let spread = (heavy - light) / sqrt(12.0);
        let grade = |by: Real, doubt: Real| {
            let sd = sqrt(sd * sd + doubt * doubt);
            Value {
                value: steeper(x.y, by).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd,
                valid: known && sd < 0.05 && x.y.abs() < MAX_GRADE_RAD,
            }
        };
        let doubt = sqrt(ahead.sd * ahead.sd + spread * spread);
        Estimate {
            t_s,
            total_mass_kg: self.mass,
            grade_rad: grade(ahead.imu - ahead.unit, 0.0),
            effective_grade_rad: grade(-ahead.unit, doubt),
            speed_mps: Value {
                value: x.x,
                sd: sqrt(P.m11),
                valid: reading.speed_mps.is_some(),
            },
            innovation: self.last.map_or(0.0, |c| c.y.x),
            nis: self.last.map_or(0.0, |c| c.nis),
            flags: Flags {
                moving: reading
                    .speed_mps
                    .is_some_and(|v| v.abs() > self.standstill_mps),
                excited: false,
                saturated: self.saturated,
            },
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (rho, rho_sd) = self.curvature.per_m();
        let R = self.adaptive.map_or(self.R, |noise| *noise.covariance());
        copy_into(
            values,
            &[
                rho,
                rho_sd,
                self.curvature.lambda(),
                sqrt(R.x),
                sqrt(self.belief.P.m22),
            ],
        );
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}
impl<const N: usize> State for CurvatureSlope<N> {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            params: _,
            standstill_mps: _,
            spread: _,
            R: _,
            mass_range_kg: _,
            train,
            curvature,
            belief,
            adaptive,
            mass,
            started,
            saturated,
            last,
        } = self;
        curvature.visit(archive);
        train.visit(archive);
        belief.visit(archive);
        visit_built(adaptive, archive);
        mass.visit(archive);
        started.visit(archive);
        saturated.visit(archive);
        last.visit(archive);
    }
}
