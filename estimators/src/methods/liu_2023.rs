//! Liu Zechao, Li Jingzhao, Zheng Changlu et al., "Safety performance of unmanned monorail cranes in mines: key
//! parameters identification research", Coal Science and Technology 51(S1), 2023: `dffrls_aekf` and what the paper
//! compares it with, `rls_ekf`, `ffrls` and `joint_ekf`. Mass by least squares on the force balance, slope by an
//! extended Kalman filter with that mass.
//!
//! The published method with its errata corrected and nothing else:
//!
//! - eq. 6: the rotating masses J have no g (also in 7, 17, 23, 24); they, gear and efficiency (eq. 2) are the
//!   [`ForceBalance`](crate::models::force_balance::ForceBalance)'s
//! - eq. 16: what an accelerometer reads is f = v̇ + g sin θ. Of the two readings the one with the paper's sensor: f on
//!   the left, and χ₂ is then sin θ_μ cos θ. `ffrls`, whose slope is χ₂ of eq. 18, needs the other: v̇ of the wheels on
//!   the left
//! - eq. 19–22: λ of this step, from the residual before the update (in print that of the estimate it serves to find)
//! - eq. 23: radians, with sin θ and cos θ; eq. 28: the Jacobian of the whole state
//! - eq. 30: R alone, from the residual after the update, which keeps it positive ([`crate::filters::sage_husa`]); q, r
//!   and Q as they start
//!
//! P₀, σ, Q and R are not given. All signals of the regression go through one low-pass, which the paper does not
//! mention.

use nalgebra::{Matrix1, Matrix2, SMatrix, Vector1, Vector2, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::estimator::copy_into;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, asin, cos, sin, sqrt, within};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::filters::ekf::Ekf;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Model, Process};
use crate::filters::rls::{Outcome, Rls};
use crate::filters::sage_husa::{Adaptive, Noise};
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::force_balance::Drive;
use crate::models::sample::ResampledSample;

params! {
    /// The regression of eq. 16–22.
    Regression {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.5, 0.001 => 10.0, "Standard deviation of this mass, as a share of the mass: P₀, which is not given.";
        sine_sd ["-"] = 0.1, 0.001 => 1.0, "Standard deviation of χ₂ at the start: P₀, which is not given.";
        residual_sd_mps2 ["m/s²"] = 0.02, 1e-4 => 1.0, "Expected residual, the unit of P₀.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-pass of force, speed and accelerometer.";
        rate_hz ["Hz"] = 200.0, 0.1 => 1000.0, "Sampling rate; λ is per sample.";
    }
}

params! {
    /// Dynamic forgetting, eq. 19.
    DynamicForgetting {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor of the first sample.";
        delta ["-"] = 0.95, 0.5 => 1.0, "Smallest forgetting factor δ.";
        sigma ["s²/m"] = 5.0, 0.0 => 1000.0, "Decrease of λ with the residual; not given.";
    }
}

params! {
    /// Constant forgetting.
    ConstantForgetting {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor.";
    }
}

params! {
    /// The filter of eq. 23–29. Q, R and the start are not given.
    Slope {
        q_v ["m²/s³"] = 1e-4, 0.0 => 10.0, "Process noise of speed.";
        q_theta ["rad²/s"] = 3e-4, 0.0 => 10.0, "Process noise of the grade angle.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed at the start.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

params! {
    /// Adapted noise, eq. 30.
    AdaptedNoise {
        kappa ["-"] = 0.966, 0.5 => 0.99999, "Fading factor κ of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

methods! {
    /// The method: least squares with dynamic forgetting, then an adaptive extended Kalman filter.
    dffrls_aekf: DffrlsAekfPublished = Liu2023,
        { mass: Regression, forgetting: DynamicForgetting, slope: Slope, noise: AdaptedNoise },
        |vehicle, p| build(vehicle, &p.mass, dynamic(&p.forgetting), SlopeBy::Filter(p.slope, Some(p.noise.kappa)));
    /// Least squares without forgetting, then an extended Kalman filter.
    rls_ekf: RlsEkfPublished = Liu2023,
        { mass: Regression, slope: Slope },
        |vehicle, p| build(vehicle, &p.mass, Forgetting::None, SlopeBy::Filter(p.slope, None));
    /// Mass and slope from one regression with constant forgetting.
    ffrls: FfrlsPublished = Liu2023,
        { mass: Regression, forgetting: ConstantForgetting },
        |vehicle, p| build(vehicle, &p.mass, Forgetting::Constant(p.forgetting.lambda0), SlopeBy::Regression);
}

/// State [v, θ], measurement v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GradeModel {
    /// Rotating masses J reflected to the rim, kg.
    pub rotating_mass_kg: Real,
    /// Process noise of v (m²/s³) and θ (rad²/s).
    pub q: [Real; 2],
}

impl Process<2> for GradeModel {
    type Input = Drive;

    fn f(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> Vector2<Real> {
        let gamma = 1.0 + self.rotating_mass_kg / u.mass_kg; // eq. 6
        let pull = u.traction_n / u.mass_kg;
        let v_dot = (pull - u.resistance * GRAVITY * cos(x.y) - GRAVITY * sin(x.y)) / gamma; // eq. 23
        vector![x.x + dt * v_dot, x.y] // eq. 24, 25
    }

    fn F(&self, x: &Vector2<Real>, u: &Drive, dt: Real) -> Matrix2<Real> {
        let gamma = 1.0 + self.rotating_mass_kg / u.mass_kg; // eq. 6
        let by_theta = -GRAVITY * (cos(x.y) - u.resistance * sin(x.y)) / gamma; // eq. 28: J_f
        matrix![1.0, dt * by_theta; 0.0, 1.0]
    }

    fn Q(&self, _: &Drive, dt: Real) -> Matrix2<Real> {
        let [q_v, q_theta] = self.q;
        Matrix2::from_diagonal(&vector![q_v * dt, q_theta * dt])
    }
}

impl Model<2, 1> for GradeModel {
    fn h(&self, x: &Vector2<Real>) -> Vector1<Real> {
        vector![x.x] // eq. 26
    }

    fn H(&self, _: &Vector2<Real>) -> SMatrix<Real, 1, 2> {
        matrix![1.0, 0.0] // eq. 26: ξ
    }
}

/// Source of the slope: χ₂ of the regression, or the filter, with κ of eq. 30 or with fixed noise.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SlopeBy {
    Regression,
    Filter(Slope, Option<Real>),
}

/// Regression and slope filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Liu2023 {
    mass0_kg: Real,
    range_kg: [Real; 2],
    rotating_mass_kg: Real,
    mu: Real,
    r: Real,
    slope_by: SlopeBy,
    /// χ = [M₀/M, sin(θ + θ_μ)].
    rls: Rls<2>,
    slope: Adaptive<Ekf<GradeModel, 2>, 1>,
    direction: Real,
    learnt: bool,
    started: bool,
    outcome: Outcome,
    last: Option<Correction<1, 2>>,
}

impl Liu2023 {
    fn learn(&mut self, now: &ResampledSample) -> Option<()> {
        let v_dot = now.acceleration_mps2;
        let y = match self.slope_by {
            SlopeBy::Regression => v_dot,                    // eq. 16
            SlopeBy::Filter(..) => now.specific_force_mps2?, // eq. 16, by the paper's sensor
        };
        let net_n = now.force_n - self.rotating_mass_kg * v_dot;
        let alpha = vector![
            net_n / self.mass0_kg,                    // eq. 17: α₁ (χ₁ = M₀/M)
            -GRAVITY * sqrt(1.0 + self.mu * self.mu)  // eq. 17: α₂
        ];
        self.outcome = self.rls.update(y, &alpha, self.r, false)?; // eq. 19–22
        self.learnt = true;
        Some(())
    }

    fn mass_kg(&self) -> Found {
        let [low, high] = self.range_kg;
        let chi = within(
            self.rls.belief.x.x,
            self.mass0_kg / high,
            self.mass0_kg / low,
        );
        Found {
            value: self.mass0_kg / chi, // eq. 18: χ₁
            sd: self.mass0_kg / (chi * chi) * sqrt(self.rls.widened().m11),
            started: self.learnt && chi == self.rls.belief.x.x,
        }
    }

    fn regressed_slope(&self) -> Found {
        let theta_mu = self.direction * asin(sine_of_friction(self.mu));
        let theta = asin(self.rls.belief.x.y) - theta_mu; // eq. 18: χ₂
        Found {
            value: theta,
            sd: sqrt(self.rls.widened().m22) / cos(theta).max(0.1),
            started: self.learnt,
        }
    }

    fn filtered_slope(&self) -> Found {
        let Gaussian { x, P } = self.slope.filter.belief;
        Found {
            value: x.y,
            sd: sqrt(P.m22),
            started: self.last.is_some(),
        }
    }

    fn filter_slope(&mut self, z: &Signals) -> Option<()> {
        let Some(traction_n) = z.traction_n else {
            self.started = false; // eq. 23 does not hold; v starts again where it does
            return None;
        };
        let drive = Drive {
            traction_n,
            mass_kg: self.mass_kg().value,
            resistance: z.direction * self.mu,
        };
        self.slope.filter.predict(&drive, z.dt); // eq. 27, 28
        let speed = vector![z.new_speed_mps?];
        if !self.started {
            (self.slope.filter.belief.x.x, self.started) = (speed.x, true);
        }
        self.last = Some(self.slope.update(speed)?); // eq. 29
        self.slope.adapt(speed); // eq. 30
        Some(())
    }
}

impl Method for Liu2023 {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("lambda", "-"),
        Internal::new("chi1", "-"),
        Internal::new("chi2", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("slope_filter_sd_rad", "rad"),
    ];

    fn step(&mut self, z: &Signals) {
        self.direction = z.direction;
        let _ = z.sample.and_then(|now| self.learn(&now));
        if self.slope_by != SlopeBy::Regression {
            let _ = self.filter_slope(z);
        }
    }

    fn answer(&self) -> Answer {
        let by_regression = self.slope_by == SlopeBy::Regression;
        let Gaussian { x, P } = self.slope.filter.belief;
        let filtered = Found {
            value: x.x,
            sd: sqrt(P.m11),
            started: true,
        };
        Answer {
            mass_kg: Some(self.mass_kg()),
            grade_rad: if by_regression {
                self.regressed_slope()
            } else {
                self.filtered_slope()
            },
            speed_mps: (!by_regression).then_some(filtered),
            innovation: self
                .last
                .map_or((self.outcome.residual, 0.0), |c| (c.y.x, c.nis)),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (chi, P) = (self.rls.belief.x, self.slope.filter.belief.P);
        let sd = [self.slope.noise.R().x, P.m22].map(sqrt);
        copy_into(values, &[self.outcome.lambda, chi.x, chi.y, sd[0], sd[1]]);
    }
}

state!(Liu2023 { rls, slope, direction, learnt, started, outcome, last; mass0_kg, range_kg, rotating_mass_kg, mu, r, slope_by });

/// sin θ_μ with θ_μ = atan μ.
fn sine_of_friction(mu: Real) -> Real {
    mu / sqrt(1.0 + mu * mu)
}

fn dynamic(p: &DynamicForgetting) -> Forgetting<2> {
    Forgetting::ByResidual {
        floor: p.delta,
        sharpness: p.sigma,
        first: p.lambda0,
    }
}

fn build(
    vehicle: &Vehicle,
    p: &Regression,
    policy: Forgetting<2>,
    slope_by: SlopeBy,
) -> ([Real; 2], Liu2023) {
    let mu = vehicle.running_resistance;
    let chi = vector![1.0, sine_of_friction(mu)];
    let (slope, kappa) = match slope_by {
        SlopeBy::Regression => (Slope::default(), None),
        SlopeBy::Filter(slope, kappa) => (slope, kappa),
    };
    let model = GradeModel {
        rotating_mass_kg: vehicle.rotating_mass_kg,
        q: [slope.q_v, slope.q_theta],
    };
    let R = Matrix1::new(slope.wheel_speed_sd_mps * slope.wheel_speed_sd_mps);
    let method = Liu2023 {
        mass0_kg: vehicle.first_mass_kg(p.mass0_kg),
        range_kg: vehicle.mass_range_kg,
        rotating_mass_kg: vehicle.rotating_mass_kg,
        mu,
        r: p.residual_sd_mps2 * p.residual_sd_mps2,
        slope_by,
        rls: Rls::new(
            Gaussian::independent(chi, vector![p.mass_sd, p.sine_sd]),
            policy,
        ),
        slope: Adaptive {
            filter: Ekf::new(model, slope.start()),
            noise: Noise::published(R, kappa),
        },
        direction: 1.0,
        learnt: false,
        started: false,
        outcome: Outcome::default(),
        last: None,
    };
    ([p.cutoff_hz, p.rate_hz], method)
}

impl Slope {
    /// [v, θ] at the start.
    pub(crate) fn start(&self) -> Gaussian<2> {
        let rad = PI / 180.0;
        let sd = vector![self.wheel_speed_sd_mps, self.grade0_sd_deg * rad];
        Gaussian::independent(vector![0.0, self.grade0_deg * rad], sd)
    }
}
