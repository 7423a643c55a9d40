//! Replay and tuning on real runs: what is replayed is what was, and what is resumed is what would have been.

use monorig_estimators::filters::forgetting::Forgetting;
use monorig_estimators::filters::gaussian::Gaussian;
use monorig_estimators::filters::rls::Rls;
use monorig_estimators::registry;
use monorig_lab::metrics::series::{ErrorSample, ErrorSeries};
use monorig_lab::metrics::{measure, measure_run};
use monorig_lab::replay::cache;
use monorig_lab::replay::cache::Cache;
use monorig_lab::replay::play::play;
use monorig_lab::replay::record::{ReplayRecorder, record};
use monorig_lab::tuning::evaluate::{Evaluator, Means, Stage};
use monorig_lab::tuning::optimise::{Search, minimise, random_point};
use monorig_lab::tuning::study::{Optimiser, TuningStudy};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::run;
use monorig_sim::config::checked::Finite;
use monorig_sim::config::scenario::{ParameterValue, Scenario};
use monorig_sim::record::identity::Identity;
use monorig_tests::scenario;
use nalgebra::{Vector1, vector};

/// All estimators beside the loop, on a run with dropouts and late samples, events and faults.
fn eventful(seconds: &str) -> Scenario {
    let all: Vec<String> = registry::NAMES
        .iter()
        .map(|n| format!("{n}: {{}}"))
        .collect();
    scenario(
        "minimal",
        &[
            ("stop.after_s", seconds),
            ("sensors", "../assets/sensors/huainan.yaml"),
            ("estimators", &format!("{{{}}}", all.join(", "))),
            (
                "events",
                "[{from_s: 1.2, to_s: 1.6, sensor: imu, fault: stuck}, {at_s: 1.8, load_mass_kg: 8000}]",
            ),
        ],
    )
}

#[test]
fn replay_gives_the_bits_of_the_run() {
    let s = eventful("40");
    let mut rig = Simulation::build(s, &Registry::default(), 3).unwrap();
    let mut recorder = ReplayRecorder::new(&rig);
    let mut live = ErrorSeries::default();
    run(&mut rig, &mut [&mut recorder, &mut live], &mut |_| true).unwrap();
    assert_eq!(live.estimators.len(), registry::NAMES.len());
    let mut valid = 0;
    for (name, samples) in &live.estimators {
        let columns = &recorder.columns;
        let estimator = registry::build(name, &columns.vehicle, []).unwrap();
        let replayed = play(columns, name, Box::new(estimator)).unwrap();
        valid += samples
            .iter()
            .filter(|x| x.mass_valid && x.slope_valid)
            .count();
        same_bits(name, samples, &replayed);
    }
    assert!(valid > 1000, "nothing to compare: {valid}");
}

fn same_bits(name: &str, samples: &[ErrorSample], replayed: &[ErrorSample]) {
    let bits = |x: &ErrorSample| {
        let all = [
            x.t_s,
            x.mass_kg,
            x.mass_nees,
            x.slope,
            x.slope_effective,
            x.slope_nees,
            x.nis,
        ];
        (all.map(f64::to_bits), x.mass_valid, x.slope_valid)
    };
    assert_eq!(samples.len(), replayed.len());
    for (k, (a, b)) in samples.iter().zip(replayed).enumerate() {
        assert_eq!(bits(a), bits(b), "{name} at {} s", a.t_s);
        // the rest of it, in the digits that tell one number from the next
        if k % 50 == 0 {
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{name} at {} s", a.t_s);
        }
    }
}

/// The first trial is played from the samples, the third on kept inputs; a parameter of the front has others.
#[test]
fn every_trial_behind_a_front_is_the_run_with_its_parameters() {
    let of_estimator = ["slope_rmse_deg", "mass_rmse_kg"];
    for (name, key, values) in [
        ("dffrls_aekf", "delta", [0.9, 0.95, 0.97]),
        ("dffrls_aekf", "cutoff_hz", [0.5, 0.5, 2.0]),
        ("rail_fusion", "model_sd_mps2", [0.001, 0.002, 0.004]),
        ("rail_fusion", "torque_noise", [0.02, 0.02, 0.05]),
    ] {
        let of = |evaluation: &str| {
            let study = study_of(name, evaluation, "none", &of_estimator);
            trials(&study, &values.map(|value| (key, value)))
        };
        let replayed = of("replay");
        assert!(replayed.iter().flatten().all(|x| x.is_finite()));
        assert_ne!(replayed[1], replayed[2], "{key} changes nothing");
        assert_eq!(of("closed_loop"), replayed);
    }
}

/// Estimators beside the loop are left out of the recording: it is the same without them.
#[test]
fn estimators_beside_the_loop_do_not_change_the_recording() {
    let with = record(&eventful("5"), &Registry::default(), 1, &mut |_| true)
        .unwrap()
        .unwrap();
    let mut bare = eventful("5");
    bare.file.estimators.clear();
    let without = record(&bare, &Registry::default(), 1, &mut |_| true)
        .unwrap()
        .unwrap();
    assert!(with == without);
}

#[test]
fn a_recording_comes_back_from_disk_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path(), &Identity::of_program(None));
    let s = eventful("3");
    let made = cache
        .get(&s, &Registry::default(), 1, &mut |_| true)
        .unwrap()
        .unwrap();
    let place = cache.place(&s, 1).unwrap();
    assert!(cache::load(&place, made.vehicle).unwrap() == made);

    // found again without running: a run would be stopped at once
    let found = cache
        .get(&s, &Registry::default(), 1, &mut |_| false)
        .unwrap();
    assert!(found.unwrap() == made);
    // another seed, another scenario: not this one
    assert!(
        cache
            .get(&s, &Registry::default(), 2, &mut |_| false)
            .unwrap()
            .is_none()
    );
    assert!(
        cache
            .get(&eventful("2"), &Registry::default(), 1, &mut |_| false)
            .unwrap()
            .is_none()
    );

    let bytes = std::fs::read(&place).unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    for bad in [
        &flipped[..],
        &bytes[..bytes.len() - 8],
        &bytes[..20],
        b"",
        b"monorig replay 1",
    ] {
        std::fs::write(&place, bad).unwrap();
        assert!(
            cache::load(&place, made.vehicle).is_none(),
            "{} bytes",
            bad.len()
        );
    }
    // and is then made anew
    assert!(
        cache
            .get(&s, &Registry::default(), 1, &mut |_| true)
            .unwrap()
            .unwrap()
            == made
    );
    assert!(cache::load(&place, made.vehicle).is_some());
    let names = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(names, 1, "something was left behind");
}

/// A study of an estimator over one run of 60 s.
fn study_of(estimator: &str, evaluation: &str, feedforward: &str, metrics: &[&str]) -> TuningStudy {
    let folder = tempfile::tempdir().unwrap();
    let scenarios = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios");
    let run = |seed: u64| {
        format!(
            "[{{scenario: '{scenarios}/liu2023_section1.yaml', set: {{drive.controller.feedforward: {feedforward}, in_loop: dffrls_aekf_robust, stop.after_s: 60}}, seeds: [{seed}]}}]"
        )
    };
    let metrics: Vec<String> = metrics
        .iter()
        .map(|m| format!("{{metric: {m}, after_s: 10}}"))
        .collect();
    let parameters = match estimator {
        "rail_fusion" => {
            "{model_sd_mps2: {from: 0.001, to: 0.01}, torque_noise: {from: 0.01, to: 0.1}}"
        }
        _ => "{delta: {from: 0.9, to: 0.9999}, cutoff_hz: {from: 0.5, to: 2}}",
    };
    let text = format!(
        "version: 1\nwhy: A test.\nestimator: {estimator}\nevaluation: {evaluation}\n\
         parameters: {parameters}\n\
         tuning: {}\nvalidation: {}\nobjective: {{metrics: [{}]}}\nbudget: 5\n",
        run(1),
        run(2),
        metrics.join(", ")
    );
    let path = folder.path().join("study.yaml");
    std::fs::write(&path, text).unwrap();
    TuningStudy::load(&path, &Registry::default()).unwrap()
}

/// A study of `dffrls_aekf_robust`.
fn study(evaluation: &str, feedforward: &str, metrics: &[&str]) -> TuningStudy {
    study_of("dffrls_aekf_robust", evaluation, feedforward, metrics)
}

/// Metrics of trials, each with one value of a parameter.
fn trials(study: &TuningStudy, values: &[(&str, f64)]) -> Vec<Vec<f64>> {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path(), &Identity::of_program(None));
    let means = Means {
        cache: &cache,
        jobs: 1,
    };
    let evaluator = Evaluator::prepare(study, Stage::Tuning, means, &())
        .unwrap()
        .unwrap();
    let trial = |(key, value): &(&str, f64)| {
        let value = ParameterValue::Number(Finite::try_from(*value).unwrap());
        let values = [((*key).to_owned(), value)].into();
        let [shown] = &evaluator.evaluate(&values)[..] else {
            panic!("one run");
        };
        shown.values.clone().unwrap()
    };
    values.iter().map(trial).collect()
}

/// Metrics of a trial with this `delta`.
fn trial(study: &TuningStudy, delta: f64) -> Vec<f64> {
    trials(study, &[("delta", delta)]).remove(0)
}

/// Where the controller does not use the estimate, the whole world run again and a replay show the same, bit for bit.
#[test]
fn closed_loop_and_replay_agree_beside_the_loop() {
    let of_estimator = ["slope_rmse_deg", "mass_rmse_kg"];
    for delta in [0.9, 0.97] {
        let again = trial(&study("closed_loop", "none", &of_estimator), delta);
        let replayed = trial(&study("replay", "none", &of_estimator), delta);
        assert!(again.iter().all(|x| x.is_finite()), "{again:?}");
        assert_eq!(again, replayed);
    }
}

/// Where it does, a trial shows what the scenario shows with that parameter, and the parameter moves the train.
#[test]
fn a_trial_in_the_closed_loop_is_the_run_with_its_parameter() {
    let metrics = ["slope_rmse_deg", "speed_rmse_mps", "jerk_rms_mps3"];
    let study = study("closed_loop", "estimate", &metrics);
    let mut seen = Vec::new();
    for delta in ["0.9", "0.97"] {
        let shown = trial(&study, delta.parse().unwrap());
        let s = scenario(
            "liu2023_section1",
            &[
                ("stop.after_s", "60"),
                ("drive.controller.feedforward", "estimate"),
                ("in_loop", "dffrls_aekf_robust"),
                (
                    "estimators.dffrls_aekf_robust",
                    &format!("{{delta: {delta}}}"),
                ),
            ],
        );
        let mut series = ErrorSeries::default();
        run(
            &mut Simulation::build(s, &Registry::default(), 1).unwrap(),
            &mut [&mut series],
            &mut |_| true,
        )
        .unwrap();
        let end = f64::INFINITY;
        let alone = [
            measure(&series, "dffrls_aekf_robust", metrics[0], 10.0, end).unwrap(),
            measure_run(&series, metrics[1], 10.0, end).unwrap(),
            measure_run(&series, metrics[2], 10.0, end).unwrap(),
        ];
        assert_eq!(shown[..3], alone);
        seen.push(alone);
    }
    assert!(
        (0..3).all(|i| seen[0][i] != seen[1][i]),
        "the parameter changes nothing: {seen:?}"
    );
}

/// A parameter that walks at random (variance q a step), seen with noise of variance 1. In the steady state least
/// squares with forgetting is a filter of gain 1 − λ, and the best gain is Kalman's: K = (√(q² + 4 q) − q)/2. So the
/// best λ is known.
#[test]
fn finds_the_best_forgetting_factor_for_a_known_random_walk() {
    let q: f64 = 1e-3;
    let best = 1.0 - ((q * q + 4.0 * q).sqrt() - q) / 2.0;
    let normal = |k: usize, i: u64| random_point(5 + i, k, 12).iter().sum::<f64>() - 6.0;
    let mut x = 0.0;
    let walk: Vec<(f64, f64)> = (0..40_000)
        .map(|k| {
            x += q.sqrt() * normal(k, 0);
            (x, x + normal(k, 1))
        })
        .collect();
    let mean_square = |lambda: f64| {
        let prior = Gaussian::independent(vector![0.0], vector![10.0]);
        let mut rls = Rls::new(prior, Forgetting::Constant(lambda));
        let mut sum = 0.0;
        for (x, y) in &walk {
            rls.update(*y, &Vector1::new(1.0), 1.0, false).unwrap();
            sum += (rls.belief.x.x - x).powi(2);
        }
        sum / walk.len() as f64
    };
    // one axis, evenly in the logarithm of the memory from 3 to 3000
    let lambda = |u: f64| 1.0 - 1.0 / (3.0 * 1000_f64.powf(u.clamp(0.0, 1.0)));
    for (optimiser, budget) in [
        (Optimiser::CmaEs, 60),
        (Optimiser::Grid, 40),
        (Optimiser::Random, 60),
    ] {
        let search = Search {
            optimiser,
            start: &[0.9],
            counts: &[None],
            objectives: 1,
            budget,
            seed: 2,
        };
        let mut asked = Vec::new();
        minimise(&search, &mut |u| {
            let loss = if asked.len() < budget {
                mean_square(lambda(u[0]))
            } else {
                3.0
            };
            asked.push((loss, lambda(u[0])));
            vec![loss]
        });
        let least = |a: &&(f64, f64), b: &&(f64, f64)| a.0.total_cmp(&b.0);
        let (loss, found) = *asked.iter().min_by(least).unwrap();
        let memories = (1.0 - best) / (1.0 - found);
        assert!(
            (0.8..1.25).contains(&memories),
            "{optimiser:?}: {found} against {best}"
        );
        assert!(loss <= 1.01 * mean_square(best), "{optimiser:?}: {loss}");
    }
}
