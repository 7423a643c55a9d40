//! How many trials of a tuning study a second has. `cargo bench --workspace --bench tuning`
//!
//! The best of many short rounds each, so that other programs on the machine disturb little; the two threads are timed
//! in long rounds, and want a machine of their own.

use monorig_estimators::registry;
use monorig_lab::batch::map_in_order;
use monorig_lab::replay::{play::play, record::record};
use monorig_lab::tuning::optimise::{Search, minimise, random_point};
use monorig_lab::tuning::study::Optimiser;
use monorig_sim::closed_loop::registry::Registry;
use monorig_tests::scenario;
use std::time::{Duration, Instant};

const ROUNDS: usize = 100;
const SAMPLES: usize = 30_000;
const GRAVITY: f64 = 9.81;
/// The slope is kept within this, rad.
const STEEPEST: f64 = 0.6;

fn candidate(x: f64) -> Candidate {
    Candidate {
        lambda: 0.99 + 0.009 * x,
        q_speed: 1e-7,
        q_slope: 1e-7 * (1.0 + x),
        r_speed: 2.5e-5,
    }
}

/// Evaluations per second of `f`, which makes `n`.
fn rate(n: usize, mut f: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        f();
        best = best.min(start.elapsed().as_secs_f64());
    }
    n as f64 / best
}

/// Words that choose estimators; those with dashes are cargo's.
fn words() -> impl Iterator<Item = String> {
    std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
}

fn wanted(name: &str) -> bool {
    words().next().is_none() || words().any(|word| name.contains(&word))
}

fn main() {
    if words().next().is_some() {
        whole_pipelines();
        return;
    }
    let (model, samples) = made_up(SAMPLES);
    println!("evaluations per second, RLS (2) + EKF (2) over {SAMPLES} samples, one core");
    let one = rate(1, || {
        let c = std::hint::black_box(candidate(0.3));
        std::hint::black_box(one_at_a_time(&model, &c, &samples));
    });
    println!("  estimators crate   {one:8.0}");

    let work: Vec<f64> = (0..64).map(|i| f64::from(i) / 64.0).collect();
    let jobs = |n| {
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            let start = Instant::now();
            std::hint::black_box(map_in_order(n, &work, |x| {
                one_at_a_time(&model, &candidate(*x), &samples)
            }));
            best = best.min(start.elapsed().as_secs_f64());
        }
        1.0 / best
    };
    let (single, double) = (jobs(1), jobs(2));
    println!("two threads: {:.2} times one", double / single);

    let mut share = f64::INFINITY;
    for _ in 0..3 {
        let (mut running, start) = (Duration::ZERO, Instant::now());
        let search = Search {
            optimiser: Optimiser::CmaEs,
            start: &[0.5, 0.5],
            counts: &[None; 2],
            objectives: 1,
            budget: 600,
            seed: 1,
        };
        minimise(&search, &mut |x| {
            let at = Instant::now();
            let score = one_at_a_time(&model, &candidate(x[0].clamp(0.0, 1.0)), &samples);
            running += at.elapsed();
            vec![score.mass_mse]
        });
        let all = start.elapsed();
        share = share.min((all - running).as_secs_f64() / all.as_secs_f64());
    }
    println!(
        "optimiser (CMA-ES, 600 trials): {:.2} % of the time",
        100.0 * share
    );

    whole_pipelines();
}

/// Trials over one run of 110 s (vehicle test). Words behind `--`
/// choose estimators whose names hold one of them.
fn whole_pipelines() {
    let s = scenario(
        "liu2023_vehicle_test",
        &[("drive.controller.feedforward", "none")],
    );
    let columns = record(&s, &Registry::default(), 1, &mut |_| true)
        .expect("run")
        .expect("whole");
    let steps = columns.len();
    println!("evaluations per second, vehicle test ({steps} steps), one core");
    for name in registry::NAMES.iter().filter(|name| wanted(name)) {
        let build = || registry::build(name, &columns.vehicle, []).expect("defaults");
        let sampled = rate(1, || {
            std::hint::black_box(play(&columns, "tuned", Box::new(build())).expect("a replay"));
        });
        let each = |rate: f64| 1e9 / rate / steps as f64;
        let told = format!(
            "  {name:<24} {sampled:6.1} ({:4.0} ns a step)",
            each(sampled)
        );
        println!("{told}");
    }
}

/// The signals of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct CoreSample {
    /// Left-hand side of the regression, N.
    y: f64,
    /// Regressors, m/s² and 1.
    h: [f64; 2],
    /// Traction, N.
    traction_n: f64,
    /// Measured speed, m/s.
    speed_mps: f64,
    /// True mass, kg.
    mass_kg: f64,
    /// True slope, rad.
    slope_rad: f64,
}

/// Values that are the same for all candidates.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CoreModel {
    /// Time between samples, s.
    dt_s: f64,
    /// First mass, kg.
    mass0_kg: f64,
    /// Variances of the parameters at the start, in units of the residual's variance.
    p0: [f64; 2],
    /// Running-resistance coefficient.
    resistance: f64,
    /// Variances of speed and slope at the start, (m/s)² and rad².
    s0: [f64; 2],
}

/// Values that a candidate chooses.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    /// Forgetting factor.
    lambda: f64,
    /// Variance that a step adds to the speed, (m/s)².
    q_speed: f64,
    /// Variance that a step adds to the slope, rad².
    q_slope: f64,
    /// Variance of the measured speed, (m/s)².
    r_speed: f64,
}

/// Loss of a candidate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Score {
    /// Mean square error of the mass, kg².
    mass_mse: f64,
    /// Mean square error of the slope, rad².
    slope_mse: f64,
}

/// One candidate with the estimators crate's own recursions: what [`run`] must agree with.
fn one_at_a_time(model: &CoreModel, candidate: &Candidate, samples: &[CoreSample]) -> Score {
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

/// A made-up run: a load that changes slowly, a slope that changes, speed that is kept by traction, noise on
/// everything.
fn made_up(count: usize) -> (CoreModel, Vec<CoreSample>) {
    let model = CoreModel {
        dt_s: 0.005,
        mass0_kg: 10_000.0,
        p0: [1e6, 1e6],
        resistance: 0.02,
        s0: [1e-4, 1e-2],
    };
    let noise = |k: usize, i: usize| {
        // the sum of twelve even numbers is nearly normal
        let even = random_point(11 + i as u64, k, 12);
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
