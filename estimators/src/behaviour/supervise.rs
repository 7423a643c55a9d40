//! Each supervisor in the case it exists for, on and off; what became of each measurement.

use super::*;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::signals::{Sample, VehicleData};

const BASELINES: [&str; 2] = ["ekf_v_theta_biases", "complementary_filter"];

/// They gate each channel themselves.
const OURS: [&str; 2] = ["rail_fusion", "attitude"];

fn built(name: &str, vehicle: &Vehicle, switch: &'static str, on: bool) -> AnyEstimator {
    build(name, vehicle, [(switch, Setting::Flag(on))]).unwrap()
}

/// Robust estimators that have this switch.
fn with(switch: &'static str) -> impl Iterator<Item = &'static str> {
    let has = move |name: &&str| keys(name).unwrap().any(|key| key.name == switch);
    NAMES.iter().copied().filter(has)
}

#[test]
fn every_robust_estimator_has_its_switches_and_no_other_has_any() {
    for name in NAMES {
        let robust = name.ends_with("_robust");
        let supervised = kind(name) == Some(Kind::Supervised);
        let has = |switch| with(switch).any(|other| other == *name);
        assert_eq!(has("grade_map"), robust, "{name}");
        for switch in [
            "validity_gate",
            "innovation_gate",
            "nis_monitor",
            "plausibility",
        ] {
            assert_eq!(has(switch), supervised, "{name}");
        }
        // The baselines take the channels as they come.
        let conditioned = supervised && !BASELINES.contains(name) && !OURS.contains(name);
        for switch in ["outlier_hold", "gyro_calibration", "noise"] {
            assert_eq!(has(switch), conditioned, "{name}");
        }
    }
    assert_eq!(with("slip_detector").count(), 2);
    assert_eq!(with("load_change_detector").count(), 3);
    assert_eq!(with("excitation_gate").count(), 2);
}

/// Rolling at constant speed on the level, the running resistance off by a third: noise in the regressor passes for
/// information.
#[test]
fn without_the_excitation_gate_steady_speed_makes_it_certain_of_a_wrong_mass() {
    let normalised = |on: bool| {
        let count = 10;
        let mut sum = 0.0;
        for seed in 1..=count {
            let mut estimator = built("dffrls_aekf_robust", &vehicle(), "excitation_gate", on);
            let mut random = Random::new(700 + seed);
            let rows = World {
                mu: 0.02 * (1.0 + 0.3 * random.normal()),
                grade: |_| 0.0,
                speed: |_| 0.6,
                start_mps: 0.6,
                seconds: 300.0,
                ..world(seed)
            }
            .run(&mut estimator);
            let mass = rows.last().unwrap().estimate.total_mass_kg;
            sum += ((mass.value - 15_000.0) / mass.sd).powi(2) / count as Real;
        }
        sum
    };
    let (on, off) = (normalised(true), normalised(false));
    std::println!("(error/sd)² {on:.2} with the gate, {off:.2} without");
    assert!(on < 2.0 && off > 4.0 * on, "{on} {off}");
}

#[test]
fn without_the_load_change_detector_another_load_is_not_learnt() {
    for name in ["dffrls_aekf_robust", "mmrls_sh_stf_robust"] {
        let error = |on: bool| {
            let mut estimator = built(name, &vehicle(), "load_change_detector", on);
            let world = World {
                mass_change: Some((60.0, 10_000.0)),
                grade: |s| 4f64.to_radians() * (0.3 * s).sin(),
                speed: |t| 0.7 + 0.3 * (0.5 * t).sin(),
                seconds: 120.0,
                ..world(1)
            };
            mass_error(&world.run(&mut estimator), 100.0)
        };
        let (on, off) = (error(true), error(false));
        std::println!("{name}: {on:.3} with, {off:.3} without");
        assert!(on < 0.03 && off > 0.1, "{name}: {on} {off}");
    }
}

/// All wheels slip alike, to and fro: no vote finds that.
#[test]
fn while_all_wheels_slip_no_grade_is_valid_but_without_the_slip_detector() {
    let valid = |on: bool| {
        // Alone: gate, consistency and plausibility would find it too.
        let others = [
            "innovation_gate",
            "nis_monitor",
            "plausibility",
            "outlier_hold",
        ];
        let settings = others.map(|switch| (switch, Setting::Flag(false)));
        let told = [
            ("noise", Setting::Choice("told")),
            ("slip_detector", Setting::Flag(on)),
        ];
        let settings = settings.into_iter().chain(told);
        let estimator = build("dffrls_aekf_robust", &vehicle(), settings).unwrap();
        let tamper = |z: &mut Measurements, _: &mut Command| {
            let t = z.t.s() as Real;
            if (40.0..50.0).contains(&t) {
                for sample in z.wheel_speed_mps.iter_mut().flatten() {
                    sample.value += 0.1 * (40.0 * t).sin();
                }
            }
        };
        let rows = world(1).run(&mut Tampered { estimator, tamper });
        let share = |from: Real, until: Real| {
            let rows: Vec<&Row> = rows.iter().filter(|r| r.t > from && r.t < until).collect();
            rows.iter().filter(|r| r.estimate.grade_rad.valid).count() as Real / rows.len() as Real
        };
        (share(30.0, 40.0), share(43.0, 50.0))
    };
    let ((before, slipping), (_, off)) = (valid(true), valid(false));
    std::println!("valid: {before:.2} before, {slipping:.2} slipping, {off:.2} without detector");
    assert!(before > 0.99 && slipping == 0.0 && off > 0.9);
}

#[test]
fn without_the_grade_map_a_long_train_is_a_point() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: long::TARE_SPAN_M,
        load_span_m: long::LOAD_SPAN_M,
        ..vehicle().data()
    })
    .unwrap();
    for name in with("grade_map") {
        let run = |vehicle: &Vehicle, on: bool| -> Vec<Estimate> {
            let world = World {
                seconds: 40.0,
                ..long::long(1)
            };
            let rows = world.run(&mut built(name, vehicle, "grade_map", on));
            rows.iter().map(|row| row.estimate).collect()
        };
        let (on, off) = (run(&long, true), run(&long, false));
        assert_eq!(off, run(&long.as_point(), true), "{name}");
        assert_ne!(off, on, "{name}");
        assert!(
            off.iter()
                .all(|e| e.grade_rad.value == e.effective_grade_rad.value)
        );
    }
}

#[test]
fn the_validity_gate_changes_the_marks_and_nothing_else() {
    for name in with("validity_gate") {
        let run = |on: bool| world(1).run(&mut built(name, &vehicle(), "validity_gate", on));
        let (on, off) = (run(true), run(false));
        let unmarked = |estimate: &Estimate| {
            let mut e = *estimate;
            for value in [
                &mut e.total_mass_kg,
                &mut e.grade_rad,
                &mut e.effective_grade_rad,
                &mut e.speed_mps,
            ] {
                value.valid = true;
            }
            e
        };
        let mut not_yet = 0;
        for (on, off) in on.iter().zip(&off) {
            assert_eq!(unmarked(&on.estimate), unmarked(&off.estimate), "{name}");
            let marks = [off.estimate.grade_rad, off.estimate.effective_grade_rad];
            assert!(marks.iter().all(|value| value.valid), "{name}");
            not_yet += usize::from(!on.estimate.grade_rad.valid);
        }
        assert!(not_yet > 0, "{name}");
    }
}

/// Status by source after a step.
fn status(estimator: &impl Estimator, source: &str) -> Option<AidStatus> {
    let place = estimator.aid_sources().iter().position(|s| *s == source)?;
    let mut all = [AidStatus::default(); 8];
    estimator.aid_status(&mut all);
    Some(all[place])
}

/// Estimators that gate each wheel by itself, not the speed that the wheels agree on.
const GATE_EACH_WHEEL: [&str; 2] = ["attitude", "rail_fusion"];

#[test]
fn every_supervised_estimator_has_a_status_of_its_wheel_speed() {
    let supervised = |name: &&&str| kind(name) == Some(Kind::Supervised);
    for name in NAMES.iter().filter(supervised) {
        let mut estimator = build(name, &vehicle(), []).unwrap();
        assert_eq!(estimator.aid_sources()[0], "wheel_speed", "{name}");
        let mut noted = Vec::new();
        let mut random = Random::new(5);
        for k in 1..=4_000 {
            let (t, now) = (0.01 * k as Real, crate::Time::from_ns(10_000_000 * k));
            let mut z = Measurements {
                t: now,
                ..Default::default()
            };
            let sample = |value| Some(Sample { t: now, value });
            z.specific_force_mps2 = Some(Sample {
                t: now,
                value: [0.2 + 0.01 * random.normal(), 0.0, 9.81],
            });
            for i in 0..8 {
                z.motor_torque_nm[i] = sample(60.0 + random.normal());
                let slips = (10.0..15.0).contains(&t) && i < 6;
                let stuck = (25.0..30.0).contains(&t);
                let dead = (20.0..22.0).contains(&t);
                let noise = if stuck { 0.0 } else { 0.005 * random.normal() };
                let value = 0.8 + noise + if slips { 0.1 * i as Real + 0.3 } else { 0.0 };
                z.wheel_speed_mps[i] = sample(value).filter(|_| !dead);
            }
            let brake = if t > 35.0 { 1.0 } else { 0.0 };
            let command = Command {
                brake,
                ..Default::default()
            };
            let estimate = estimator.step(&z, &command, 0.01).unwrap();
            let wheel_speed = status(&estimator, "wheel_speed").unwrap();
            noted.push((
                t,
                wheel_speed,
                status(&estimator, "force_balance"),
                estimate,
            ));
        }
        let outcome = |at: Real| noted.iter().find(|n| n.0 > at).unwrap().1.outcome;
        assert_eq!(outcome(8.0), AidOutcome::Fused, "{name}");
        // Six of eight wheels slip. Estimators that gate each wheel go on with the two that roll; the others take none.
        if GATE_EACH_WHEEL.contains(name) {
            let slipping = noted.iter().find(|n| n.0 > 12.0).unwrap();
            assert_eq!(slipping.1.outcome, AidOutcome::Fused, "{name}");
            let off = slipping.3.speed_mps.value - 0.8;
            assert!(off.abs() < 0.01, "{name}: {off}");
        } else {
            assert_eq!(
                outcome(12.0),
                AidOutcome::Rejected(Rejection::Slip),
                "{name}"
            );
        }
        assert_eq!(outcome(18.0), AidOutcome::Fused, "{name}");
        assert_eq!(outcome(21.0), AidOutcome::Stale, "{name}");
        assert_eq!(
            outcome(28.0),
            AidOutcome::Rejected(Rejection::Stuck),
            "{name}"
        );
        assert_eq!(outcome(33.0), AidOutcome::Fused, "{name}");
        for (t, wheel_speed, force_balance, estimate) in &noted {
            if *t > 35.1
                && let Some(balance) = force_balance
            {
                let standing = AidOutcome::Rejected(Rejection::NotRunning);
                assert_eq!(balance.outcome, standing, "{name}");
            }
            assert!(wheel_speed.innovation_variance >= 0.0);
            if wheel_speed.innovation_variance > 0.0 {
                assert_eq!(wheel_speed.innovation, estimate.innovation, "{name}");
            }
        }
    }
}

/// A sample taken without excitation has less weight, and the status shows it.
#[test]
fn the_mass_regression_says_when_it_gives_a_sample_less_weight() {
    let count = |speed: fn(Real) -> Real, outcome: AidOutcome| {
        let mut estimator = build("dffrls_aekf_robust", &vehicle(), []).unwrap();
        let world = World {
            grade: |_| 0.0,
            speed,
            start_mps: 0.6,
            ..world(1)
        };
        let mut seen = Watching {
            estimator: &mut estimator,
            count: 0,
            outcome,
        };
        world.run(&mut seen);
        seen.count
    };
    let steps = 12_000;
    assert!(count(|_| 0.6, AidOutcome::Deweighted) > steps / 2);
    assert!(count(|t| 0.6 + 0.4 * (1.5 * t).sin(), AidOutcome::Fused) > steps / 2);
}

/// Counts steps after which the force balance had an outcome.
struct Watching<'a> {
    estimator: &'a mut AnyEstimator,
    count: usize,
    outcome: AidOutcome,
}

impl Estimator for Watching<'_> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let estimate = self.estimator.step(z, u, dt)?;
        let now = status(self.estimator, "force_balance").unwrap();
        self.count += usize::from(now.outcome == self.outcome);
        Ok(estimate)
    }

    fn reset(&mut self) {
        self.estimator.reset();
    }
}
