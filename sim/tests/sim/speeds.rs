//! Speed of the train, of its instruments and of its wheels: each is that of the place it is named after.

use monorig_estimators::Command;
use monorig_sim::plant::{Plant, rapier::World};
use monorig_sim::testing::{Cruise, slope, torque, track, train, world};
use monorig_sim::train::Train;
use std::sync::Arc;

const DT: f64 = 1e-3;

/// A cruise of so many seconds; `look` sees the world after every step, with the chainage before it.
fn drive(
    train: &Train,
    rail: &Arc<monorig_sim::rail::Rail>,
    (speed, seconds): (f64, f64),
    mut look: impl FnMut(&World, f64),
) {
    let mut w = world(train, rail, 22.0, 0.0);
    let mut cruise = Cruise::new(train, speed);
    for _ in 0..(seconds / DT) as usize {
        let command = cruise.command(train, &w, DT);
        let before = w.truth().chainage_m;
        w.step(&command, DT).unwrap();
        look(&w, before);
    }
}

#[test]
fn the_speed_is_the_rate_of_the_chainage_and_that_of_the_imu_is_less_on_a_crest() {
    let train = train("dx80_176y").with_load_mass(0.0).unwrap();
    let crest = track(
        "vertical: [{kind: grade, length_m: 30}, {kind: arc, to_grade_deg: -30, radius_m: 10, easement_m: 0.5}, {kind: grade, length_m: 60}]\n",
    );
    let (mut least, mut on_the_crest) = (1.0_f64, 0);
    drive(&train, &crest, (0.8, 25.0), |w, before| {
        let t = w.truth();
        if t.speed_mps < 0.3 {
            return;
        }
        let rate = (t.chainage_m - before) / DT;
        // A step's mean rate lies half a step before its end: 0.5 ms at 1 m/s² are 0.1 % of 0.5 m/s.
        let gap = (rate / t.speed_mps - 1.0).abs();
        assert!(
            gap < 2e-3,
            "at {:.3} s: {rate} against {}",
            t.t_s,
            t.speed_mps
        );
        if t.curvature_vertical_1pm < -0.0999 {
            least = least.min(t.speed_at_imu_mps / t.speed_mps);
            on_the_crest += 1;
        }
    });
    // 0.25 m below the rail's line, R = 10 m: 2.5 % less; the body is a chord of 0.6 m, 4.5 mm nearer to the centre in
    // its middle.
    assert!(on_the_crest > 1000);
    assert!((least - 0.975).abs() < 1e-3, "{least}");
}

#[test]
fn wheels_on_the_inside_of_a_bend_run_at_the_speed_of_the_web() {
    // At steady speed without torque to speak of, a friction wheel's rim has the speed of its side of the web: v (1 ∓ κ
    // · half the web).
    let mut train = train("dx80_176y").with_load_mass(0.0).unwrap();
    train.resistance = Default::default();
    let bend = track(
        "horizontal: [{kind: line, length_m: 25}, {kind: arc, radius_m: 4, angle_deg: 300, easement_m: 1}, {kind: line, length_m: 30}]\n",
    );
    let mut seen = 0;
    let (r, web) = (train.drives[0].wheel_radius_m, 0.5 * 0.007);
    drive(&train, &bend, (0.8, 28.0), |w, _| {
        let t = w.truth();
        // all of drive 1 in the arc, and the whole train moving evenly
        if t.t_s < 20.0
            || (t.curvature_horizontal_1pm - 0.25).abs() > 1e-6
            || t.accel_mps2.abs() > 0.02
        {
            return;
        }
        let [left, right] = t.drives[0].wheel_rate_radps.map(|rate| rate * r);
        let mean = 0.5 * (left + right);
        assert!(
            (mean / t.speed_mps - 1.0).abs() < 3e-4,
            "{mean} against {}",
            t.speed_mps
        );
        assert!(((right - left) / mean - 2.0 * 0.25 * web).abs() < 3e-4);
        seen += 1;
    });
    assert!(seen > 500, "{seen}");
}

#[test]
fn the_wheel_rate_is_that_of_the_same_instant() {
    // Constant torque on the level: slip is creep, κ F/σ0 of the rim's speed, and what is left is the lag. One step of
    // 2 ms at 0.5 m/s² would be 1 mm/s.
    let train = train("dx80_176y").with_load_mass(0.0).unwrap();
    let mut w = world(&train, &slope(0.0), 30.0, 0.0);
    let (d, dt) = (train.drives[0], 2e-3);
    let c = torque(&train, 12.0);
    for _ in 0..1000 {
        w.step(&c, dt).unwrap();
    }
    for _ in 0..500 {
        w.step(&c, dt).unwrap();
        let t = w.truth();
        assert!(t.accel_mps2 > 0.5, "{}", t.accel_mps2);
        let unit = &t.drives[0];
        let rim = unit.wheel_rate_radps[0] * d.wheel_radius_m;
        let creep = d.kappa * 0.5 * unit.traction_n / d.sigma0 * rim;
        let lag = t.speed_mps - (rim - creep);
        assert!(
            lag.abs() < 0.1 * t.accel_mps2 * dt,
            "{lag} m/s behind at {} m/s²",
            t.accel_mps2
        );
    }
}

#[test]
fn a_spinning_wheel_is_not_taken_along_by_the_train() {
    // On ice: J ω̇ = T − r F for each wheel, whatever the train does.
    let mut train = train("dx80_176y").with_load_mass(0.0).unwrap();
    for d in &mut train.drives {
        d.adhesion = 0.02;
    }
    let mut w = world(&train, &slope(0.0), 30.0, 0.0);
    let (d, dt) = (train.drives[0], 2e-3);
    let c: Command = torque(&train, 14.0);
    let mut last: Option<f64> = None;
    for k in 0..600 {
        w.step(&c, dt).unwrap();
        let unit = w.truth().drives[0];
        let rate = unit.wheel_rate_radps[0];
        if let Some(before) = last.filter(|_| k > 250) {
            let rolling = train.resistance.clamped_wheel
                * d.clamp_mpa
                * 1e6
                * d.piston_area_m2
                * d.wheel_radius_m;
            let shaft = 0.5 * unit.motor_torque_nm * d.gear_ratio * d.efficiency_drive;
            let inertia = d.wheel_inertia + 0.5 * d.gear_ratio * d.gear_ratio * d.motor_inertia;
            let expected = (shaft - rolling - d.wheel_radius_m * 0.5 * unit.traction_n) / inertia;
            let gained = (rate - before) / dt;
            assert!(unit.slip_mps > 0.1, "it spins");
            assert!(
                (gained / expected - 1.0).abs() < 1e-3,
                "{gained} against {expected} rad/s²"
            );
        }
        last = Some(rate);
    }
}

#[test]
fn a_rolling_start_has_its_wheels_at_its_speed() {
    let train = train("dx80_176y").with_load_mass(0.0).unwrap();
    let w = world(&train, &slope(0.0), 30.0, 0.8);
    let t = w.truth();
    for unit in &t.drives {
        for rate in unit.wheel_rate_radps {
            assert!((rate * train.drives[0].wheel_radius_m / t.speed_mps - 1.0).abs() < 1e-3);
        }
    }
}
