//! "Research on the dynamic inclination recognition method of monorail crane based on DFFRLS-AUKF" (Huainan main
//! roadway tests): `dffrls_aukf` and what the paper compares with it, `dffrls_ukf`, `dffrls_aekf_inclination` (its
//! DFFRLS-AEKF), `ffrls_aukf` and `rls_mff_aukf`. Curvature ρ = dθ/ds of the rail by least squares, slope by an
//! unscented Kalman filter on accelerometer and wheels.
//!
//! The published method with its errata corrected and nothing else:
//!
//! - eq. 6: the cosine, g v ρ cos θ
//! - eq. 9, 10: Γ = |ψ − Y|, and a gain that is m₀, m₀ + Δ₁ or m₀ + Δ₂ and never accumulates
//! - eq. 12: λ of this step
//! - eq. 14–16: state [v, θ] and input [a_sen, ρ v], the reading of A, B and C in which the units fit, with sin θ
//! - eq. 19: + η in the weight of the centre; eq. 26: the mean with the weights of means ([`ukf`](crate::filters::ukf))
//! - eq. 32–36: R alone, from the residual after the update, which keeps it positive; q, r and Q as they start
//!
//! σ, δ₁, δ₂, Δ₁, Δ₂, Γ₀, P₀, Q and R are not given, nor how the derivatives of eq. 6 are taken (here: matched
//! low-passes), nor what the second parameter of RLS-MFF is (here: an offset; with ρ alone multiple forgetting is the
//! constant one). It finds no mass.

use nalgebra::{Matrix1, Matrix2, SMatrix, SVector, Vector1, Vector2, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::estimator::copy_into;
use crate::api::params::params;
use crate::api::real::{GRAVITY, PI, cos, sin, sqrt};
use crate::api::snapshot::{State, state};
use crate::filters::adaptive_low_pass::AdaptiveSmoother;
use crate::filters::ekf::Ekf;
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Filter, Model, Process};
use crate::filters::rls::{Outcome, Rls};
use crate::filters::sage_husa::{Adaptive, Noise};
use crate::filters::ukf::{SigmaParams, Ukf};
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::slope_force::SlopeForce;

params! {
    /// Smoothing and regression, eq. 6–13.
    Curvature {
        m0 ["-"] = 0.15, 0.01 => 0.9, "Smoothing gain m₀ at rest; the paper has 0.1 to 0.2.";
        m_step1 ["-"] = 0.2, 0.0 => 1.0, "Δ₁, added to m₀ while the signal moves; not given.";
        m_step2 ["-"] = 0.5, 0.0 => 1.0, "Δ₂, added to m₀ while the signal moves fast; not given.";
        rest_amplitude_mps2 ["m/s²"] = 0.02, 1e-4 => 10.0, "Amplitude Γ₀ of the accelerometer's noise at rest.";
        threshold1 ["-"] = 3.0, 1.0 => 100.0, "δ₁, in amplitudes; not given.";
        threshold2 ["-"] = 6.0, 1.0 => 100.0, "δ₂, in amplitudes; not given.";
        cutoff_hz ["Hz"] = 1.0, 0.05 => 20.0, "Corner of the low-passes before the derivatives.";
        rate_hz ["Hz"] = 100.0, 0.1 => 1000.0, "Sampling rate; λ and m are per sample.";
        curvature_sd_per_m ["1/m"] = 0.05, 1e-4 => 1.0, "Standard deviation of the curvature at the start: P₀, which is not given.";
        jerk_sd_mps3 ["m/s³"] = 0.1, 1e-3 => 100.0, "Expected residual, the unit of P₀.";
    }
}

params! {
    /// Dynamic forgetting, eq. 12.
    DynamicForgetting {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor of the first sample.";
        delta ["-"] = 0.95, 0.5 => 1.0, "Smallest forgetting factor ∂.";
        sigma ["s³/m"] = 5.0, 0.0 => 1000.0, "Decrease of λ with the residual; not given.";
    }
}

params! {
    /// Constant forgetting.
    ConstantForgetting {
        lambda0 ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor.";
    }
}

params! {
    /// Multiple forgetting (Vahidi, Stefanopoulou & Peng 2005) of curvature and offset.
    MultipleForgetting {
        lambda_curvature ["-"] = 0.98, 0.5 => 1.0, "Forgetting factor of the curvature.";
        lambda_offset ["-"] = 0.999, 0.5 => 1.0, "Forgetting factor of the offset.";
        offset_sd_mps3 ["m/s³"] = 0.01, 1e-6 => 10.0, "Standard deviation of the offset at the start.";
    }
}

params! {
    /// The filter of eq. 14–31. Q, R and the start are not given.
    Slope {
        q_v ["m²/s³"] = 1e-4, 1e-12 => 10.0, "Process noise of speed.";
        q_theta ["rad²/s"] = 2e-5, 1e-12 => 10.0, "Process noise of the grade angle.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of wheel speed at the start.";
        grade0_deg ["deg"] = 0.0, -60.0 => 60.0, "Grade angle at the start.";
        grade0_sd_deg ["deg"] = 5.0, 0.001 => 90.0, "Standard deviation of the grade angle at the start.";
    }
}

params! {
    /// Adapted noise, eq. 32–36.
    AdaptedNoise {
        b ["-"] = 0.97, 0.5 => 0.99999, "Fading factor b of the adapted wheel-speed noise, per wheel-speed sample.";
    }
}

methods! {
    /// The method: curvature with dynamic forgetting, slope by an adaptive unscented Kalman filter.
    dffrls_aukf: DffrlsAukfPublished = Huainan<Ukf<InclinationModel, 2>, 1>,
        { curvature: Curvature, forgetting: DynamicForgetting, slope: Slope, sigma: SigmaParams, noise: AdaptedNoise },
        |_, p| build(&p.curvature, dynamic(&p.forgetting), 0.0, ukf(&p.slope, &p.sigma, Some(p.noise.b)));
    /// `dffrls_aukf` with fixed noise.
    dffrls_ukf: DffrlsUkfPublished = Huainan<Ukf<InclinationModel, 2>, 1>,
        { curvature: Curvature, forgetting: DynamicForgetting, slope: Slope, sigma: SigmaParams },
        |_, p| build(&p.curvature, dynamic(&p.forgetting), 0.0, ukf(&p.slope, &p.sigma, None));
    /// The method with constant forgetting.
    ffrls_aukf: FfrlsAukfPublished = Huainan<Ukf<InclinationModel, 2>, 1>,
        { curvature: Curvature, forgetting: ConstantForgetting, slope: Slope, sigma: SigmaParams, noise: AdaptedNoise },
        |_, p| build(&p.curvature, Forgetting::Constant(p.forgetting.lambda0), 0.0, ukf(&p.slope, &p.sigma, Some(p.noise.b)));
}

methods! {
    /// The method with multiple forgetting.
    rls_mff_aukf: RlsMffAukfPublished = Huainan<Ukf<InclinationModel, 2>, 2>,
        { curvature: Curvature, forgetting: MultipleForgetting, slope: Slope, sigma: SigmaParams, noise: AdaptedNoise },
        |_, p| build(&p.curvature, multiple(&p.forgetting), p.forgetting.offset_sd_mps3, ukf(&p.slope, &p.sigma, Some(p.noise.b)));
}

methods! {
    /// The method with an extended Kalman filter.
    dffrls_aekf_inclination: DffrlsAekfInclinationPublished = Huainan<Ekf<InclinationModel, 2>, 1>,
        { curvature: Curvature, forgetting: DynamicForgetting, slope: Slope, noise: AdaptedNoise },
        |_, p| build(&p.curvature, dynamic(&p.forgetting), 0.0, ekf(&p.slope, Some(p.noise.b)));
}

/// State [v, θ], input [a_sen, ρ], measurement v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InclinationModel {
    /// Process noise of v (m²/s³) and θ (rad²/s).
    pub q: [Real; 2],
}

impl Process<2> for InclinationModel {
    type Input = Vector2<Real>;

    fn f(&self, x: &Vector2<Real>, u: &Vector2<Real>, dt: Real) -> Vector2<Real> {
        let (a_sen, rho) = (u.x, u.y);
        let v_dot = a_sen - GRAVITY * sin(x.y); // eq. 14, once integrated
        let theta_dot = rho * x.x; // eq. 5, 14
        vector![x.x + dt * v_dot, x.y + dt * theta_dot] // eq. 15
    }

    fn F(&self, x: &Vector2<Real>, u: &Vector2<Real>, dt: Real) -> Matrix2<Real> {
        matrix![1.0, -dt * GRAVITY * cos(x.y); dt * u.y, 1.0] // eq. 15: A
    }

    fn Q(&self, _: &Vector2<Real>, dt: Real) -> Matrix2<Real> {
        let [q_v, q_theta] = self.q;
        Matrix2::from_diagonal(&vector![q_v * dt, q_theta * dt])
    }
}

impl Model<2, 1> for InclinationModel {
    fn h(&self, x: &Vector2<Real>) -> Vector1<Real> {
        vector![x.x] // eq. 16
    }

    fn H(&self, _: &Vector2<Real>) -> SMatrix<Real, 1, 2> {
        matrix![1.0, 0.0] // eq. 16: C
    }
}

/// Smoothing, curvature and slope filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Huainan<T, const N: usize> {
    smoother: AdaptiveSmoother<2>,
    derivatives: SlopeForce,
    r: Real,
    rate_hz: Real,
    /// [ρ] or [ρ, offset].
    rls: Rls<N>,
    slope: Adaptive<T, 1>,
    since_s: Real,
    started: bool,
    outcome: Outcome,
    last: Option<Correction<1, 2>>,
}

impl<T: Filter<2, 1, Model = InclinationModel>, const N: usize> Huainan<T, N> {
    fn learn(&mut self, a_sen: Real, v: Real, dt: Real) -> Option<()> {
        let (jerk, v) = self.derivatives.step(a_sen, v, dt)?; // eq. 6: a′_sen − a′_v
        self.since_s += dt;
        if self.since_s * self.rate_hz < 1.0 - 1e-9 {
            return None;
        }
        self.since_s = 0.0;
        let theta = self.slope.filter.belief().x.y;
        let h = first_then(GRAVITY * v * cos(theta), 1.0); // eq. 6, 11
        self.outcome = self.rls.update(jerk, &h, self.r, false)?; // eq. 12, 13
        Some(())
    }

    fn filter(&mut self, z: &Signals) -> Option<()> {
        let Some((a_sen, v)) = z.specific_force_mps2.zip(z.speed_mps) else {
            self.started = false; // no input: v starts again where there is one
            return None;
        };
        let [a_sen, v] = self.smoother.step([a_sen, v], z.dt); // eq. 7–10
        let _ = self.learn(a_sen, v, z.dt);
        let u = vector![a_sen, first(&self.rls.belief.x)];
        self.slope.filter.predict(&u, z.dt)?; // eq. 18–23
        z.new_speed_mps?;
        if !self.started {
            (self.slope.filter.belief_mut().x.x, self.started) = (v, true);
        }
        self.last = Some(self.slope.update(vector![v])?); // eq. 24–31
        self.slope.adapt(vector![v]); // eq. 32–36
        Some(())
    }
}

impl<T: Filter<2, 1, Model = InclinationModel> + Copy + State, const N: usize> Method
    for Huainan<T, N>
{
    const INTERNALS: &'static [Internal] = &[
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("curvature_sd_per_m", "1/m"),
        Internal::new("lambda", "-"),
        Internal::new("wheel_speed_sd_mps", "m/s"),
        Internal::new("slope_filter_sd_rad", "rad"),
    ];

    fn step(&mut self, z: &Signals) {
        let _ = self.filter(z);
    }

    fn answer(&self) -> Answer {
        let Gaussian { x, P } = self.slope.filter.belief();
        let found = |value, variance| Found {
            value,
            sd: sqrt(variance),
            started: self.last.is_some(),
        };
        Answer {
            mass_kg: None,
            grade_rad: found(x.y, P.m22),
            speed_mps: Some(found(x.x, P.m11)),
            innovation: self.last.map_or((0.0, 0.0), |c| (c.y.x, c.nis)),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let (rho, sd) = (
            first(&self.rls.belief.x),
            sqrt(first(&self.rls.widened().diagonal())),
        );
        let (R, P) = (self.slope.noise.R().x, self.slope.filter.belief().P.m22);
        copy_into(values, &[rho, sd, self.outcome.lambda, sqrt(R), sqrt(P)]);
    }
}

state!(@[T: State, const N: usize] Huainan<T, N> { smoother, derivatives, rls, slope, since_s, started, outcome, last; r, rate_hz });

fn first<const N: usize>(x: &SVector<Real, N>) -> Real {
    x.iter().next().copied().unwrap_or(0.0)
}

fn dynamic(p: &DynamicForgetting) -> Forgetting<1> {
    Forgetting::ByResidual {
        floor: p.delta,
        sharpness: p.sigma,
        first: p.lambda0,
    }
}

fn multiple(p: &MultipleForgetting) -> Forgetting<2> {
    Forgetting::Multiple([p.lambda_curvature, p.lambda_offset])
}

fn ekf(p: &Slope, b: Option<Real>) -> Adaptive<Ekf<InclinationModel, 2>, 1> {
    let (rad, v) = (PI / 180.0, p.wheel_speed_sd_mps);
    let model = InclinationModel {
        q: [p.q_v, p.q_theta],
    };
    let belief = Gaussian::independent(
        vector![0.0, p.grade0_deg * rad],
        vector![v, p.grade0_sd_deg * rad],
    ); // eq. 17
    Adaptive {
        filter: Ekf::new(model, belief),
        noise: Noise::published(Matrix1::new(v * v), b),
    }
}

fn ukf(p: &Slope, sigma: &SigmaParams, b: Option<Real>) -> Adaptive<Ukf<InclinationModel, 2>, 1> {
    let Adaptive { filter, noise } = ekf(p, b);
    let filter = Ukf {
        model: filter.model,
        belief: filter.belief,
        spread: sigma.spread(), // eq. 18, 19
    };
    Adaptive { filter, noise }
}

fn build<T, const N: usize>(
    p: &Curvature,
    policy: Forgetting<N>,
    offset_sd_mps3: Real,
    slope: Adaptive<T, 1>,
) -> ([Real; 2], Huainan<T, N>) {
    let corner_hz = |m: Real| m * p.rate_hz / (2.0 * PI); // eq. 8
    let corners_hz = [p.m0, p.m0 + p.m_step1, p.m0 + p.m_step2].map(corner_hz); // eq. 10
    let thresholds = [p.threshold1, p.threshold2];
    let sd = first_then(p.curvature_sd_per_m, offset_sd_mps3);
    let method = Huainan {
        smoother: AdaptiveSmoother::new(corners_hz, p.rest_amplitude_mps2, thresholds),
        derivatives: SlopeForce::new(p.cutoff_hz),
        r: p.jerk_sd_mps3 * p.jerk_sd_mps3,
        rate_hz: p.rate_hz,
        rls: Rls::new(Gaussian::independent(SVector::zeros(), sd), policy),
        slope,
        since_s: 0.0,
        started: false,
        outcome: Outcome::default(),
        last: None,
    };
    ([p.cutoff_hz, p.rate_hz], method)
}

/// [`first`, `then`, …].
fn first_then<const N: usize>(first: Real, then: Real) -> SVector<Real, N> {
    SVector::from_fn(|i, _| if i == 0 { first } else { then })
}
