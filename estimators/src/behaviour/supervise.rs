//! Each supervisor in the case it exists for, on and off; what became of each measurement.

use super::*;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::signals::{Sample, VehicleData};

fn built(name: &str, vehicle: &Vehicle, switch: &'static str, on: bool) -> AnyEstimator {
    build(name, vehicle, [(switch, Setting::Flag(on))]).unwrap()
}

/// Estimators that have this switch.
fn with(switch: &'static str) -> impl Iterator<Item = &'static str> {
    let has = move |name: &&str| keys(name).unwrap().any(|key| key.name == switch);
    NAMES.iter().copied().filter(has)
}

#[test]
fn the_switches_of_an_estimator_go_by_its_kind() {
    for name in NAMES {
        let kind = kind(name).unwrap();
        let has = |switch| with(switch).any(|other| other == *name);
        let method = kind == Kind::Supervised;
        for switch in ["rail_memory", "method_grade"] {
            assert_eq!(has(switch), method, "{name}: {switch}");
        }
        let weighs = kind == Kind::Ours && has("force_fusion");
        assert_eq!(has("torque_monitor"), method || weighs, "{name}");
        for switch in ["validity_gate", "nis_monitor", "plausibility"] {
            assert_eq!(has(switch), kind.has_validity_rule(), "{name}: {switch}");
        }
        assert_eq!(has("innovation_gate"), kind == Kind::Baseline, "{name}");
        for switch in [
            "slip_gate",
            "accelerometer_gate",
            "separation",
            "spike_gate",
            "vertical_force",
        ] {
            assert_eq!(
                has(switch),
                method || kind == Kind::Ours,
                "{name}: {switch}"
            );
        }
        // The baselines take the channels as they come, ours gate each channel themselves.
        for switch in ["outlier_hold", "noise"] {
            assert_eq!(has(switch), method, "{name}: {switch}");
        }
    }
    assert_eq!(with("method_grade").count(), 1);
    assert_eq!(with("slip_detector").count(), 1);
    assert_eq!(with("load_change_detector").count(), 1);
    assert_eq!(with("excitation_gate").count(), 1);
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
    for name in with("load_change_detector").filter(|name| kind(name) == Some(Kind::Supervised)) {
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

/// All wheels slip alike, to and fro: no vote finds that. The method's grade then counts only without the detector.
#[test]
fn while_all_wheels_slip_the_grade_of_the_method_does_not_count() {
    let run = |switches: &[(&'static str, bool)]| {
        // Alone: the gates would find it too.
        let others = ["slip_gate", "nis_monitor", "plausibility", "outlier_hold"];
        let others = others.into_iter().map(|switch| (switch, false));
        let flags = others.chain(switches.iter().copied());
        let settings = flags.map(|(switch, on)| (switch, Setting::Flag(on)));
        let settings = settings.chain([("noise", Setting::Choice("told"))]);
        let estimator = build("dffrls_aekf_robust", &vehicle(), settings).unwrap();
        let tamper = |z: &mut Measurements, _: &mut Command| {
            let t = z.t.s() as Real;
            if (40.0..50.0).contains(&t) {
                for sample in z.wheel_speed_mps.iter_mut().flatten() {
                    sample.value += 0.1 * (40.0 * t).sin();
                }
            }
        };
        world(1).run(&mut Tampered { estimator, tamper })
    };
    let core = run(&[("method_grade", false)]);
    // Largest difference that the method makes to the effective grade, before and while slipping.
    let moved = |slip_detector: bool| {
        let rows = run(&[("slip_detector", slip_detector)]);
        let most = |from: Real, until: Real| {
            let pairs = rows.iter().zip(&core);
            let of = pairs.filter(|(row, _)| row.t > from && row.t < until);
            of.map(|(row, core)| {
                let grade = |row: &Row| row.estimate.effective_grade_rad.value;
                (grade(row) - grade(core)).abs()
            })
            .fold(0.0, Real::max)
        };
        [most(30.0, 40.0), most(43.0, 50.0)]
    };
    let ([before, on], [_, off]) = (moved(true), moved(false));
    std::println!(
        "moved by {before:.1e} rad before, {on:.1e} slipping, {off:.1e} without detector"
    );
    assert!(before > 0.0 && on == 0.0 && off > 0.0);
}

#[test]
fn without_the_rail_memory_a_long_train_is_a_point() {
    let long = Vehicle::new(VehicleData {
        tare_span_m: long::TARE_SPAN_M,
        load_span_m: long::LOAD_SPAN_M,
        ..vehicle().data()
    })
    .unwrap();
    for name in with("rail_memory") {
        let run = |vehicle: &Vehicle, on: bool| -> Vec<Estimate> {
            let world = World {
                seconds: 40.0,
                ..long::long(1)
            };
            let rows = world.run(&mut built(name, vehicle, "rail_memory", on));
            rows.iter().map(|row| row.estimate).collect()
        };
        let (on, off) = (run(&long, true), run(&long, false));
        assert_eq!(off, run(&long.as_point(), true), "{name}");
        // Largest difference of both grades.
        let apart = |estimates: &[Estimate]| {
            let apart = estimates
                .iter()
                .map(|e| (e.grade_rad.value - e.effective_grade_rad.value).abs());
            apart.fold(0.0, Real::max)
        };
        let (on, off) = (apart(&on), apart(&off));
        std::println!("{name}: {on:.3} rad apart with, {off:.3} without");
        assert!(on > 0.08 && off < 0.02, "{name}: {on} {off}");
    }
}

/// One of eight torque sensors reads twice what it should: an eighth of the mass.
#[test]
fn without_the_torque_monitor_one_wrong_torque_is_mass() {
    for name in with("torque_monitor").filter(|name| kind(name) == Some(Kind::Supervised)) {
        let error = |on: bool| {
            let estimator = built(name, &vehicle(), "torque_monitor", on);
            let tamper = |z: &mut Measurements, _: &mut Command| {
                if let Some(torque) = z.motor_torque_nm[3].as_mut() {
                    torque.value *= 2.0;
                }
            };
            let world = World {
                speed: |t| 1.5 + 1.2 * (0.7 * t).sin(),
                grade: |_| 0.0,
                ..world(1)
            };
            mass_error(&world.run(&mut Tampered { estimator, tamper }), 55.0)
        };
        let (on, off) = (error(true), error(false));
        std::println!("{name}: {on:.3} with, {off:.3} without");
        assert!(on < 0.03 && off > 0.08, "{name}: {on} {off}");
    }
}

/// From before the ramp the IMU is silent: what is left of the grade is the force.
#[test]
fn without_the_method_s_grade_a_ramp_that_no_imu_reads_is_not_found() {
    for name in with("method_grade") {
        let run = |on: bool| {
            let estimator = built(name, &vehicle(), "method_grade", on);
            let tamper = |z: &mut Measurements, _: &mut Command| {
                if z.t.s() > 16.0 {
                    (z.specific_force_mps2, z.angular_rate_radps) = (None, None);
                }
            };
            let rows = World {
                grade: |s| 8f64.to_radians() * smooth((s - 15.0) / 8.0),
                seconds: 40.0,
                ..world(1)
            }
            .run(&mut Tampered { estimator, tamper });
            // Largest error of the effective grade on the ramp's upper end, and of both in standard deviations.
            let (mut worst, mut normalised): (Real, Real) = (0.0, 0.0);
            for row in rows.iter().filter(|row| row.t > 30.0) {
                let e = row.estimate;
                let effective = (e.effective_grade_rad.value - row.effective).abs();
                let at_imu = (e.grade_rad.value - row.theta).abs();
                worst = worst.max(effective);
                let found = effective / e.effective_grade_rad.sd;
                normalised = normalised.max(found).max(at_imu / e.grade_rad.sd);
            }
            (worst, normalised)
        };
        let (on, off) = (run(true), run(false));
        std::println!(
            "{name}: {:.2}° ({:.1} sd) with, {:.2}° ({:.1} sd) without",
            on.0.to_degrees(),
            on.1,
            off.0.to_degrees(),
            off.1
        );
        assert!(
            off.0 > 0.1 && on.1 < 3.0 && off.1 < 3.0,
            "{name}: {on:?} {off:?}"
        );
        assert!(on.0 < 0.02, "{name}: {on:?}");
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

#[test]
fn every_estimator_with_the_validity_rule_has_a_status_of_its_wheel_speed() {
    let has_rule = |name: &&&str| kind(name).is_some_and(Kind::has_validity_rule);
    for name in NAMES.iter().filter(has_rule) {
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
        // Six of eight wheels slip. The core gates each wheel and goes on with the two that roll; the baselines, which
        // take the speed that the wheels agree on, take none.
        if kind(name) != Some(Kind::Baseline) {
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
