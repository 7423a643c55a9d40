//! How many trials of a tuning study a second has. `cargo bench --workspace --bench tuning`
//!
//! The best of many short rounds each, so that other programs on the machine disturb little; the two threads are timed in long
//! rounds, and want a machine of their own.

use monorig_estimators::registry;
use monorig_lab::replay::lanes::{Candidate, CoreModel, CoreSample, made_up, one_at_a_time, run};
use monorig_lab::replay::{play::play, record::record};
use monorig_lab::tune::evaluate::parallel;
use monorig_lab::tune::optimise::{Search, minimise};
use monorig_lab::tune::study::Optimiser;
use monorig_tests::scenario;
use std::time::{Duration, Instant};

const ROUNDS: usize = 200;
const SAMPLES: usize = 30_000;

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

fn lanes(count: usize, model: &CoreModel, samples: &[CoreSample]) -> f64 {
    let all: Vec<Candidate> = (0..count)
        .map(|i| candidate(i as f64 / count as f64))
        .collect();
    rate(count, || {
        std::hint::black_box(run(model, std::hint::black_box(&all), samples));
    })
}

fn main() {
    let (model, samples) = made_up(SAMPLES);
    println!("evaluations per second, RLS (2) + EKF (2) over {SAMPLES} samples, one core");
    let one = rate(1, || {
        let c = std::hint::black_box(candidate(0.3));
        std::hint::black_box(one_at_a_time(&model, &c, &samples));
    });
    println!("  one at a time, estimators crate   {one:8.0}");
    for count in [1, 8, 16, 64] {
        let all = lanes(count, &model, &samples);
        println!("  {count:2} in one call                    {all:8.0}");
    }

    let work: Vec<f64> = (0..64).map(|i| f64::from(i) / 64.0).collect();
    let jobs = |n| {
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            let start = Instant::now();
            std::hint::black_box(parallel(&work, n, |x| {
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

    println!(
        "evaluations per second of whole pipelines, one run of 110 s (vehicle test), one core"
    );
    let s = scenario(
        "liu2023_vehicle_test",
        &[("drive.controller.feedforward", "none")],
    );
    let columns = record(&s, 1, &mut |_| true).expect("run").expect("whole");
    let mut out = Vec::new();
    for name in registry::NAMES {
        let all = rate(1, || {
            let estimator = registry::build(name, &columns.vehicle, []).expect("defaults");
            play(&columns, estimator, &mut out);
        });
        let each = 1e9 / all / columns.len() as f64;
        println!(
            "  {name:<14} {all:8.1}   ({each:.0} ns for each of {} steps)",
            columns.len()
        );
    }
}
