//! Many candidates in one pass over the samples: two-parameter least squares with a constant forgetting factor, and a two-state
//! extended Kalman filter with its mass.
//!
//! One candidate at a time waits for its own last result at every step; several side by side fill the waiting, and one
//! instruction works on two, four or eight, whatever the machine has. The recursions are those of the estimators crate ([`monorig_estimators::filters::rls`],
//! [`monorig_estimators::filters::ekf`]) without their guards, written once for any number of lanes: a lane's numbers are the same, bit
//! for bit, whatever runs beside it.
//!
//! The pipelines of [`monorig_estimators::registry`] are not run this way: they branch at every step.

use fearless_simd::{Level, Select, Simd, SimdBase, dispatch};
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

/// Runs any number of candidates over the samples, as many in one pass as the machine's widest instructions take; one alone
/// goes without them.
pub fn run(model: &CoreModel, candidates: &[Candidate], samples: &[CoreSample]) -> Vec<Score> {
    if let [candidate] = candidates {
        return vec![one(model, candidate, samples)];
    }
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || many(simd, model, candidates, samples)
    ))
}

fn one(model: &CoreModel, candidate: &Candidate, samples: &[CoreSample]) -> Score {
    let [mass_sum, slope_sum] = pass(model, candidate.numbers(), samples, ());
    Score::of_sums(mass_sum, slope_sum, samples.len())
}

#[inline(always)]
fn many<S: Simd>(
    simd: S,
    model: &CoreModel,
    candidates: &[Candidate],
    samples: &[CoreSample],
) -> Vec<Score> {
    let width = S::f64s::LEN;
    let mut scores = Vec::with_capacity(candidates.len());
    for group in candidates.chunks(2 * width) {
        // what is left over in the last group goes twice
        let vector = |first: usize, which: usize| {
            S::f64s::from_fn(simd, |i| {
                group[(first + i).min(group.len() - 1)].numbers()[which]
            })
        };
        let numbers = [0, 1, 2, 3].map(|which| Two::<S>(vector(0, which), vector(width, which)));
        let [mass, slope] = pass(model, numbers, samples, simd).map(Two::to_vec);
        let sums = mass.iter().zip(&slope).take(group.len());
        scores.extend(sums.map(|(mass, slope)| Score::of_sums(*mass, *slope, samples.len())));
    }
    scores
}

impl Candidate {
    fn numbers(&self) -> [f64; 4] {
        [self.lambda, self.q_speed, self.q_slope, self.r_speed]
    }
}

impl Score {
    fn of_sums(mass: f64, slope: f64, count: usize) -> Self {
        Self {
            mass_mse: mass / count as f64,
            slope_mse: slope / count as f64,
        }
    }
}

/// The recursions, for one candidate (`f64`) or several side by side ([`Two`]): sums of the squared errors of mass and slope.
#[inline(always)]
fn pass<N: Number>(
    model: &CoreModel,
    [lambda, q_speed, q_slope, r]: [N; 4],
    samples: &[CoreSample],
    token: N::Token,
) -> [N; 2] {
    let memory = N::all(token, 1.0) / lambda;
    let (g_dt, mu) = (
        N::all(token, GRAVITY * model.dt_s),
        N::all(token, model.resistance),
    );

    let [mut c1, mut c2] = [N::all(token, model.mass0_kg), N::all(token, 0.0)];
    let [mut p11, mut p12, mut p22] = [
        N::all(token, model.p0[0]),
        N::all(token, 0.0),
        N::all(token, model.p0[1]),
    ];
    let [mut v, mut theta] = [N::all(token, 0.0), N::all(token, 0.0)];
    let [mut s11, mut s12, mut s22] = [
        N::all(token, model.s0[0]),
        N::all(token, 0.0),
        N::all(token, model.s0[1]),
    ];
    let [mut mass_sum, mut slope_sum] = [N::all(token, 0.0), N::all(token, 0.0)];

    for z in samples {
        // least squares: K = P h / (λ + hᵀ P h), P ← (P − K hᵀ P)/λ
        let (h1, h2) = (N::all(token, z.h[0]), N::all(token, z.h[1]));
        let (g1, g2) = (p11 * h1 + p12 * h2, p12 * h1 + p22 * h2);
        let gain = N::all(token, 1.0) / (lambda + h1 * g1 + h2 * g2);
        let (k1, k2) = (g1 * gain, g2 * gain);
        let residual = N::all(token, z.y) - h1 * c1 - h2 * c2;
        c1 = c1 + k1 * residual;
        c2 = c2 + k2 * residual;
        p11 = (p11 - k1 * g1) * memory;
        p12 = (p12 - k1 * g2) * memory;
        p22 = (p22 - k2 * g2) * memory;

        // filter: v ← v + dt (F/M − g (sin θ + μ cos θ))
        let (sine, cosine) = sine_cosine(theta, token);
        v = v + N::all(token, model.dt_s * z.traction_n) / c1 - g_dt * (sine + mu * cosine);
        // what the next slope waits for is kept short
        let by_slope = g_dt * (mu * sine - cosine);
        let j = by_slope * s22;
        let more = by_slope * (s12 + s12 + j);
        let sure = N::all(token, 1.0) / (s11 + (q_speed + r) + more);
        s11 = (s11 + q_speed) + more;
        s12 = s12 + j;
        s22 = s22 + q_slope;

        let innovation = N::all(token, z.speed_mps) - v;
        v = v + s11 * innovation * sure;
        theta = theta + s12 * innovation * sure;
        theta = theta.within(N::all(token, -STEEPEST), N::all(token, STEEPEST));
        let (k1, k2) = (s11 * sure, s12 * sure);
        s22 = s22 - k2 * s12;
        s12 = s12 - k1 * s12;
        s11 = s11 - k1 * s11;

        let (mass, slope) = (
            c1 - N::all(token, z.mass_kg),
            theta - N::all(token, z.slope_rad),
        );
        mass_sum = mass_sum + mass * mass;
        slope_sum = slope_sum + slope * slope;
    }
    [mass_sum, slope_sum]
}

/// Taylor's series, to 1e-16 for angles up to [`STEEPEST`].
#[inline(always)]
fn sine_cosine<N: Number>(x: N, token: N::Token) -> (N, N) {
    let x2 = x * x;
    let sine = series(
        x2,
        [
            -1.0 / 6.0,
            1.0 / 120.0,
            -1.0 / 5040.0,
            1.0 / 362_880.0,
            -1.0 / 39_916_800.0,
            1.0 / 6_227_020_800.0,
            -1.0 / 1_307_674_368_000.0,
        ],
        token,
    );
    let cosine = series(
        x2,
        [
            -1.0 / 2.0,
            1.0 / 24.0,
            -1.0 / 720.0,
            1.0 / 40_320.0,
            -1.0 / 3_628_800.0,
            1.0 / 479_001_600.0,
            -1.0 / 87_178_291_200.0,
        ],
        token,
    );
    (sine * x, cosine)
}

/// 1 + a x + b x² + … + g x⁷, in pairs (Estrin 1960): one after the other, each term would wait for the last.
#[inline(always)]
fn series<N: Number>(x: N, [a, b, c, d, e, f, g]: [f64; 7], token: N::Token) -> N {
    let x2 = x * x;
    let x4 = x2 * x2;
    let pair_1 = N::all(token, 1.0) + N::all(token, a) * x;
    let pair_2 = N::all(token, b) + N::all(token, c) * x;
    let pair_3 = N::all(token, d) + N::all(token, e) * x;
    let pair_4 = N::all(token, f) + N::all(token, g) * x;
    (pair_1 + pair_2 * x2) + (pair_3 + pair_4 * x2) * x4
}

/// A number of one candidate, or of each of several.
trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// What making a number takes.
    type Token: Copy;
    /// The same for every candidate.
    fn all(token: Self::Token, x: f64) -> Self;
    /// Limited to `least` … `most`; what is not a number stays so.
    fn within(self, least: Self, most: Self) -> Self;
}

impl Number for f64 {
    type Token = ();

    #[inline(always)]
    fn all((): (), x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn within(self, least: Self, most: Self) -> Self {
        let x = if self > most { most } else { self };
        if x < least { least } else { x }
    }
}

/// Two vectors of the machine's width: one fills the other's waiting, three would not stay in registers.
#[derive(Clone, Copy)]
struct Two<S: Simd>(S::f64s, S::f64s);

impl<S: Simd> Two<S> {
    fn to_vec(self) -> Vec<f64> {
        [self.0.as_slice(), self.1.as_slice()].concat()
    }
}

impl<S: Simd> Number for Two<S> {
    type Token = S;

    #[inline(always)]
    fn all(token: S, x: f64) -> Self {
        Self(S::f64s::splat(token, x), S::f64s::splat(token, x))
    }

    #[inline(always)]
    fn within(self, least: Self, most: Self) -> Self {
        Self(
            limit::<S>(self.0, least.0, most.0),
            limit::<S>(self.1, least.1, most.1),
        )
    }
}

#[inline(always)]
fn limit<S: Simd>(x: S::f64s, least: S::f64s, most: S::f64s) -> S::f64s {
    let x = x.simd_gt(most).select(most, x);
    x.simd_lt(least).select(least, x)
}

macro_rules! lane_by_lane {
    ($($operation:ident $name:ident $sign:tt,)*) => {
        $(impl<S: Simd> $operation for Two<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0 $sign other.0, self.1 $sign other.1)
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
    use monorig_estimators::filters::ekf;
    use monorig_estimators::filters::forgetting::Forgetting;
    use monorig_estimators::filters::gaussian::Gaussian;
    use monorig_estimators::filters::rls::Rls;
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
        let (sine, cosine) = libm::sincos(belief.x.y);
        let accel = z.traction_n / mass - GRAVITY * (sine + mu * cosine);
        // what the next slope waits for is kept short
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
