//! Many candidates in one pass over the samples: two-parameter least squares with a constant forgetting factor, and a two-state
//! extended Kalman filter with its mass.
//!
//! One candidate at a time waits for its own last result at every step; several side by side fill the waiting, and the
//! compiler puts two or more into one instruction. The recursions are those of the estimators crate ([`monorig_estimators::rls`],
//! [`monorig_estimators::ekf`]) without their guards, written once for any number of lanes: a lane's numbers are the same, bit
//! for bit, whatever runs beside it.
//!
//! The pipelines of [`monorig_estimators::crane`] are not run this way: they branch at every step.

use std::ops::{Add, Div, Mul, Sub};

/// The signals of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoreSample {
    /// Left-hand side of the regression, N.
    pub y: f64,
    /// Regressors, m/s² and 1.
    pub h: [f64; 2],
    /// Traction, N.
    pub traction_n: f64,
    /// Measured speed, m/s.
    pub speed_mps: f64,
    /// True mass, kg.
    pub mass_kg: f64,
    /// True slope, rad.
    pub slope_rad: f64,
}

/// What is the same for all candidates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoreModel {
    /// Time between samples, s.
    pub dt_s: f64,
    /// First mass, kg.
    pub mass0_kg: f64,
    /// Variances of the parameters at the start, in units of the residual's variance.
    pub p0: [f64; 2],
    /// Running-resistance coefficient.
    pub resistance: f64,
    /// Variances of speed and slope at the start, (m/s)² and rad².
    pub s0: [f64; 2],
}

/// What a candidate chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Forgetting factor.
    pub lambda: f64,
    /// Variance that a step adds to the speed, (m/s)².
    pub q_speed: f64,
    /// Variance that a step adds to the slope, rad².
    pub q_slope: f64,
    /// Variance of the measured speed, (m/s)².
    pub r_speed: f64,
}

/// How good a candidate was.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Mean square error of the mass, kg².
    pub mass_mse: f64,
    /// Mean square error of the slope, rad².
    pub slope_mse: f64,
}

const GRAVITY: f64 = 9.81;
/// The sine and cosine below are good to the last bit or two up to here, rad; no rail is as steep.
const STEEPEST: f64 = 0.6;

/// Runs `N` candidates over the samples in one pass.
pub fn run<const N: usize>(
    model: &CoreModel,
    candidates: &[Candidate; N],
    samples: &[CoreSample],
) -> [Score; N] {
    let all = Lane::<N>::all;
    let of = |f: fn(&Candidate) -> f64| Lane(std::array::from_fn(|i| f(&candidates[i])));
    let (lambda, q_speed, q_slope, r) = (
        of(|c| c.lambda),
        of(|c| c.q_speed),
        of(|c| c.q_slope),
        of(|c| c.r_speed),
    );
    let memory = all(1.0) / lambda;
    let (g_dt, mu) = (all(GRAVITY * model.dt_s), all(model.resistance));

    let [mut c1, mut c2] = [all(model.mass0_kg), all(0.0)];
    let [mut p11, mut p12, mut p22] = [all(model.p0[0]), all(0.0), all(model.p0[1])];
    let [mut v, mut theta] = [all(0.0), all(0.0)];
    let [mut s11, mut s12, mut s22] = [all(model.s0[0]), all(0.0), all(model.s0[1])];
    let [mut mass_sum, mut slope_sum] = [all(0.0), all(0.0)];

    for z in samples {
        let (sine, cosine) = theta.sine_cosine();
        let by_slope = all(0.0) - g_dt * (cosine - mu * sine);
        let j = by_slope * s22;
        s11 = s11 + by_slope * (s12 + s12 + j) + q_speed;
        s12 = s12 + j;
        s22 = s22 + q_slope;

        // both innovation variances by one division: divisions are what takes longest
        let (h1, h2) = (all(z.h[0]), all(z.h[1]));
        let (g1, g2) = (p11 * h1 + p12 * h2, p12 * h1 + p22 * h2);
        let (of_force, of_speed) = (lambda + h1 * g1 + h2 * g2, s11 + r);
        let both = all(1.0) / (of_force * of_speed);
        let (gain, sure) = (both * of_speed, both * of_force);

        // least squares: K = P h / (λ + hᵀ P h), P ← (P − K hᵀ P)/λ
        let step = (all(z.y) - h1 * c1 - h2 * c2) * gain;
        c1 = c1 + g1 * step;
        c2 = c2 + g2 * step;
        let (k1, k2) = (g1 * gain, g2 * gain);
        p11 = (p11 - k1 * g1) * memory;
        p12 = (p12 - k1 * g2) * memory;
        p22 = (p22 - k2 * g2) * memory;

        // filter: v ← v + dt (F/M − g (sin θ + μ cos θ))
        v = v + all(model.dt_s * z.traction_n) / c1 - g_dt * (sine + mu * cosine);
        let (k1, k2) = (s11 * sure, s12 * sure);
        let innovation = all(z.speed_mps) - v;
        v = v + k1 * innovation;
        theta = (theta + k2 * innovation).within(STEEPEST);
        s22 = s22 - k2 * s12;
        s12 = s12 - k1 * s12;
        s11 = s11 - k1 * s11;

        let (mass, slope) = (c1 - all(z.mass_kg), theta - all(z.slope_rad));
        mass_sum = mass_sum + mass * mass;
        slope_sum = slope_sum + slope * slope;
    }
    let count = samples.len() as f64;
    std::array::from_fn(|i| Score {
        mass_mse: mass_sum.0[i] / count,
        slope_mse: slope_sum.0[i] / count,
    })
}

/// One number of every candidate.
#[derive(Clone, Copy)]
struct Lane<const N: usize>([f64; N]);

impl<const N: usize> Lane<N> {
    #[inline(always)]
    fn all(x: f64) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    fn within(self, most: f64) -> Self {
        Self(self.0.map(|x| {
            let x = if x > most { most } else { x };
            if x < -most { -most } else { x }
        }))
    }

    /// Taylor's series, to 1e-16 for angles up to [`STEEPEST`].
    #[inline(always)]
    fn sine_cosine(self) -> (Self, Self) {
        let series = |terms: [f64; 7]| {
            let x2 = self * self;
            let rest = terms
                .into_iter()
                .fold(Self::all(0.0), |sum, term| (sum + Self::all(term)) * x2);
            rest + Self::all(1.0)
        };
        let sine = series([
            -1.0 / 1_307_674_368_000.0,
            1.0 / 6_227_020_800.0,
            -1.0 / 39_916_800.0,
            1.0 / 362_880.0,
            -1.0 / 5040.0,
            1.0 / 120.0,
            -1.0 / 6.0,
        ]);
        let cosine = series([
            -1.0 / 87_178_291_200.0,
            1.0 / 479_001_600.0,
            -1.0 / 3_628_800.0,
            1.0 / 40_320.0,
            -1.0 / 720.0,
            1.0 / 24.0,
            -1.0 / 2.0,
        ]);
        (sine * self, cosine)
    }
}

macro_rules! lane_by_lane {
    ($($operation:ident $name:ident $sign:tt,)*) => {
        $(impl<const N: usize> $operation for Lane<N> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $sign other.0[i]))
            }
        })*
    };
}

lane_by_lane! {
    Add add +,
    Sub sub -,
    Mul mul *,
    Div div /,
}

/// One candidate with the estimators crate's own recursions: what [`run`] must agree with.
pub fn one_at_a_time(model: &CoreModel, candidate: &Candidate, samples: &[CoreSample]) -> Score {
    use monorig_estimators::{ekf, forgetting::Forgetting, gaussian::Gaussian, rls::Rls};
    use nalgebra::{Matrix1, Matrix2, RowVector2, Vector1, Vector2};

    let sd = |[a, b]: [f64; 2]| Vector2::new(a.sqrt(), b.sqrt());
    let prior = Gaussian::independent(Vector2::new(model.mass0_kg, 0.0), sd(model.p0));
    let mut rls = Rls::new(prior, Forgetting::Constant(candidate.lambda));
    let mut belief = Gaussian::independent(Vector2::zeros(), sd(model.s0));
    let q = Matrix2::from_diagonal(&Vector2::new(candidate.q_speed, candidate.q_slope));
    let (seen, r) = (RowVector2::new(1.0, 0.0), Matrix1::new(candidate.r_speed));
    let (dt, mu) = (model.dt_s, model.resistance);
    let mut score = Score::default();
    for z in samples {
        // A sample that allows no update leaves things as they are; the score shows it.
        let _ = rls.update(z.y, &Vector2::from(z.h), 1.0, false);
        let mass = rls.belief.x.x;
        let (sine, cosine) = (libm::sin(belief.x.y), libm::cos(belief.x.y));
        let accel = z.traction_n / mass - GRAVITY * (sine + mu * cosine);
        let by_slope = -dt * GRAVITY * (cosine - mu * sine);
        let next = Vector2::new(belief.x.x + dt * accel, belief.x.y);
        ekf::predict(
            &mut belief,
            next,
            &Matrix2::new(1.0, by_slope, 0.0, 1.0),
            &q,
        );
        let (measured, predicted) = (Vector1::new(z.speed_mps), Vector1::new(belief.x.x));
        let _ = ekf::update(&mut belief, measured, predicted, &seen, &r);
        belief.x.y = belief.x.y.clamp(-STEEPEST, STEEPEST);
        score.mass_mse += (mass - z.mass_kg).powi(2);
        score.slope_mse += (belief.x.y - z.slope_rad).powi(2);
    }
    let count = samples.len() as f64;
    Score {
        mass_mse: score.mass_mse / count,
        slope_mse: score.slope_mse / count,
    }
}

/// A made-up run: a load that changes slowly, a slope that changes, speed that is kept by traction, noise on everything.
pub fn made_up(count: usize) -> (CoreModel, Vec<CoreSample>) {
    let model = CoreModel {
        dt_s: 0.005,
        mass0_kg: 10_000.0,
        p0: [1e6, 1e6],
        resistance: 0.02,
        s0: [1e-4, 1e-2],
    };
    let noise = |k: usize, i: usize| {
        // the sum of twelve even numbers is nearly normal
        let even = crate::tune::optimise::random_point(11 + i as u64, k, 12);
        even.iter().sum::<f64>() - 6.0
    };
    let mut speed = 0.0;
    let mut mass = 12_000.0;
    let samples = (0..count).map(|k| {
        let t = k as f64 * model.dt_s;
        mass += 2.0 * noise(k, 0);
        let slope = 0.12 * libm::sin(0.11 * t) + 0.05 * libm::sin(0.7 * t);
        let climb = GRAVITY * (libm::sin(slope) + model.resistance * libm::cos(slope));
        let accel = 0.3 * libm::cos(0.5 * t);
        speed += model.dt_s * accel;
        let traction_n = mass * (accel + climb);
        let force = accel + climb + 0.02 * noise(k, 1);
        CoreSample {
            y: traction_n + 200.0 * noise(k, 2),
            h: [force, 1.0],
            traction_n,
            speed_mps: speed + 0.005 * noise(k, 3),
            mass_kg: mass,
            slope_rad: slope,
        }
    });
    let samples = samples.collect();
    (model, samples)
}
