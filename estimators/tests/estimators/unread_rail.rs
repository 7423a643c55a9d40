//! Laws of the effective slope on rail that nothing has read: its standard deviation grows with the way gone back, and
//! what the force said of the rail under the train is kept for ten metres and no more.

use crate::common::{Crane, vehicle};
use monorig_estimators::Vehicle;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::mass_layout::MassLayout;
use monorig_estimators::api::params::Setting;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Value};
use monorig_estimators::registry;

const DT: f64 = 0.01;

/// A train whose masses hang evenly from its IMU to 12 m behind it.
fn long_train() -> Vehicle {
    let mut data = vehicle(2).data();
    data.layout = Some(MassLayout::even(data.tare_kg, [0.0, 12.0], [0.0, 12.0]));
    Vehicle::new(data).unwrap()
}

/// Drives a long train of 15 t on this grade, rad, at the speed wanted at each time, m/s; `change` alters the samples.
/// What the estimator says of the effective slope after each step, with the way gone, m.
fn drive(
    name: &str,
    settings: &[(&'static str, Setting<'static>)],
    grade_rad: f64,
    seconds: f64,
    wanted: impl Fn(f64) -> f64,
    change: impl Fn(f64, &mut Measurements),
) -> Vec<(f64, Value)> {
    let train = long_train();
    let mut estimator = registry::build(name, &train, settings.iter().copied()).unwrap();
    let mut crane = Crane::new(train, 15_000.0, 11);
    crane.grade_rad = grade_rad;
    let steps = (seconds / DT) as usize;
    let step = |k: usize| {
        let t = DT * k as f64;
        let mut z = crane.step(wanted(t), DT);
        change(t, &mut z);
        let Estimate {
            effective_grade_rad,
            ..
        } = estimator.step(&z, &Command::default(), DT).unwrap();
        (crane.chainage_m, effective_grade_rad)
    };
    (0..steps).map(step).collect()
}

/// A train that is switched on and goes back has rail under it that nothing has read and no force has measured: its
/// curvature may be up to 0.1 rad/m. The standard deviation grows by up to half of that a metre, and by a quarter at
/// least: the rail next to what was read is known in part. Beyond ten metres it grows no more.
#[test]
fn going_back_over_unread_rail_adds_to_the_doubt() {
    for name in ["dffrls_aekf_robust", "rail_fusion"] {
        let wanted = |t: f64| if t < 2.0 { 0.0 } else { -0.5 };
        let braked = |_: f64, z: &mut Measurements| z.motor_torque_nm = Default::default();
        let seen = drive(name, &[], 0.0, 36.0, wanted, braked);
        let sd_at = |way_m: f64| seen.iter().find(|(s, _)| *s <= -way_m).unwrap().1.sd;
        let grown = |from_m: f64, to_m: f64| (sd_at(to_m).powi(2) - sd_at(from_m).powi(2)).sqrt();
        for (from_m, to_m) in [(1.0_f64, 3.0_f64), (3.0, 5.0)] {
            let most = 0.05 * (to_m.powi(2) - from_m.powi(2)).sqrt();
            let found = grown(from_m, to_m);
            assert!(
                (0.5 * most..1.05 * most).contains(&found),
                "{name}: {found} of {most}"
            );
        }
        let (then, now) = (sd_at(11.0), sd_at(15.0));
        assert!(
            (now / then - 1.0).abs() < 0.02,
            "{name}: {then}, then {now}"
        );
    }
}

/// Weighed on a steady slope, then without torques, the train goes back beyond its start: the effective slope, while it
/// is marked valid, is right within four of its standard deviations all the way.
#[test]
fn without_torques_the_force_of_before_fades() {
    let wanted = |t: f64| match t {
        t if t > 62.0 => -1.0,
        t if t % 20.0 < 14.0 => 1.0,
        _ => 0.4,
    };
    let silent = |t: f64, z: &mut Measurements| {
        if t > 64.0 {
            z.motor_torque_nm = Default::default();
        }
    };
    let seen = drive("rail_fusion", &[], 0.06, 150.0, wanted, silent);
    let mut valid = 0;
    for (k, (way_m, slope)) in seen.iter().enumerate() {
        if slope.valid && k > 6_400 {
            valid += 1;
            let error = (slope.value - 0.06).abs();
            assert!(
                error < 4.0 * slope.sd,
                "{way_m} m: {error} rad, sd {}",
                slope.sd
            );
            assert!(error < 0.05, "{way_m} m: {error} rad");
        }
    }
    assert!(valid > 1_000, "{valid}");
}

/// Weighed on a steady slope, the train goes back beyond its start with its torques: the force tells the slope of the
/// rail that nothing has read, as well backwards as forwards, so that there is no more doubt than while it was weighed
/// and half of that which there is without torques.
#[test]
fn with_torques_the_force_tells_the_slope_of_unread_rail() {
    let wanted = |t: f64| match t {
        t if t > 62.0 => -1.0,
        t if t % 20.0 < 14.0 => 1.0,
        _ => 0.4,
    };
    let mut sds = Vec::new();
    for silent in [false, true] {
        let change = |t: f64, z: &mut Measurements| {
            if silent && t > 64.0 {
                z.motor_torque_nm = Default::default();
            }
        };
        let seen = drive("rail_fusion", &[], 0.06, 150.0, wanted, change);
        for (k, (way_m, slope)) in seen.iter().enumerate() {
            if k > 6_400 && !silent {
                assert!(slope.valid, "{way_m} m");
                let error = (slope.value - 0.06).abs();
                assert!(error < (3.0 * slope.sd).min(0.01), "{way_m} m: {error} rad");
            }
        }
        sds.push(seen.last().unwrap().1.sd);
    }
    assert!(sds[0] < 0.5 * sds[1], "{sds:?}");
}

/// A train of 12 m on a level rail that has been read, with a slope of 0.05 behind it that has not. It goes back onto
/// the slope: the force tells of it. Then the torques are silent, and what the force has said of rail that has come to
/// be read since fades with the way. All the way the effective slope is right within four standard deviations, valid or
/// not, and 12 m behind the edge, where all is the slope that the IMU reads, to 0.015.
#[test]
fn what_the_force_said_of_rail_that_is_read_since_fades() {
    let local = |s: f64| 0.05 * (-s).clamp(0.0, 1.0);
    let mean = |s: f64| {
        (0..24)
            .map(|k| local(s - 0.25 - 0.5 * f64::from(k)))
            .sum::<f64>()
            / 24.0
    };
    let train = long_train();
    let mut estimator = registry::build("rail_fusion", &train, []).unwrap();
    let mut crane = Crane::new(train, 15_000.0, 11);
    crane.chainage_m = 12.0;
    let (mut last_rad, mut told, mut checked) = (0.0, 0.0_f64, 0);
    for k in 0..14_000 {
        let t = DT * k as f64;
        let wanted = match t {
            t if t > 62.0 => -1.5,
            t if t % 20.0 < 14.0 => 1.0,
            _ => 0.4,
        };
        let s = crane.chainage_m;
        (crane.grade_rad, crane.last_grade_rad) = (mean(s), None);
        let mut z = crane.step(if t < 2.0 { 0.0 } else { wanted }, DT);
        // the force is that of the mean over the train, the IMU is at its front
        let (force, rate) = (&mut z.specific_force_mps2, &mut z.angular_rate_radps);
        force.as_mut().unwrap().value[0] += 9.81 * (local(s).sin() - mean(s).sin());
        rate.as_mut().unwrap().value[1] -= (local(s) - last_rad) / DT;
        last_rad = local(s);
        if s < 6.0 && t > 62.0 {
            z.motor_torque_nm = Default::default();
        }
        let e = estimator.step(&z, &Command::default(), DT).unwrap();
        let error = (e.effective_grade_rad.value - mean(crane.chainage_m)).abs();
        if t > 62.0 {
            let sd = e.effective_grade_rad.sd;
            assert!(error < 4.0 * sd, "{s} m: {error} rad, sd {sd}");
            if (6.0..6.5).contains(&s) {
                told = e.effective_grade_rad.value;
            }
            if s < -13.0 && s > -20.0 {
                checked += 1;
                assert!(error < 0.015, "{s} m: {error} rad");
            }
        }
    }
    assert!(told > 0.01 && checked > 400, "{told} {checked}");
}

/// Without a mount to doubt, over rail that it has read, the standard deviation of the effective slope is that of the
/// bias over g and no more than twice it; on an instrument that shakes by 2 m/s², no more than six times it.
#[test]
fn on_read_rail_the_bias_is_left() {
    let exact = [
        ("mount_sd_deg", Setting::Number(0.0)),
        ("accel_bias_sd_mps2", Setting::Number(0.01)),
    ];
    let wanted = |t: f64| if t < 2.0 { 0.0 } else { 1.0 };
    let mut found = Vec::new();
    for (shake_mps2, most) in [(0.0, 2.0), (2.0, 6.0)] {
        let shaken = |t: f64, z: &mut Measurements| {
            let sample = z.specific_force_mps2.as_mut().unwrap();
            sample.value[0] += shake_mps2 * (1.0e4 * t * t).sin();
        };
        let seen = drive("rail_fusion", &exact, 0.0, 60.0, wanted, shaken);
        let sd = seen.last().unwrap().1.sd;
        assert!(sd < most * 0.01 / 9.81, "{sd} rad");
        found.push(sd);
    }
    assert!(found[1] > found[0], "{found:?}");
}

/// A train that is switched on while it runs reads its rail badly at first: what is more than 0.003 of the sum
/// sin θ + b/g goes into the mean under the train. Its variance is added to that of the pitch, and fades over 20 m of
/// way once the rail is read better. It is the least in half a second: rail is read piece by piece, and of what is not
/// yet read the standard deviation of a train that has not been weighed knows little.
#[test]
fn rail_that_was_read_badly_stays_in_doubt_for_its_way() {
    let settings = [("mount_sd_deg", Setting::Number(0.0))];
    let mut estimator = registry::build("rail_fusion", &vehicle(2), settings).unwrap();
    let mut internals = estimator.internals().iter();
    let place = internals.position(|i| i.name == "read_sd").unwrap();
    let mut crane = Crane::new(vehicle(2), 15_000.0, 11);
    (0..1_000).for_each(|_| {
        crane.step(1.0, DT);
    });
    let (mut read, mut last, mut compared) = (0.0_f64, 0.0_f64, 0);
    let mut told = Vec::new();
    for _ in 0..6_000 {
        let z = crane.step(1.0, DT);
        let e = estimator.step(&z, &Command::default(), DT).unwrap();
        let mut values = [0.0; 64];
        estimator.internal_values(&mut values);
        // of the pitch of the body against the rail, which is in both of what is told
        let body = 0.0003_f64.powi(2);
        let sum_sd = (values[place].powi(2) - body).sqrt();
        if sum_sd < 0.02 {
            let unusual = (sum_sd.powi(2) - 0.003_f64.powi(2)).max(0.0).sqrt();
            read *= (-crane.speed_mps * DT / 20.0).exp();
            if unusual > read {
                read = unusual;
                told.clear();
            }
        }
        // the mean is looked at every tenth of a second, in which the pitch gets better, too
        let (before, pitch) = (last, e.grade_rad.sd.powi(2) - body);
        last = pitch;
        told.push((e.effective_grade_rad.sd.powi(2) - pitch).sqrt());
        if told.len() > 50
            && read > 0.004
            && e.effective_grade_rad.valid
            && (before / pitch - 1.0).abs() < 0.002
        {
            compared += 1;
            let found = told.iter().rev().take(50).fold(f64::MAX, |a, b| a.min(*b));
            assert!((found / read - 1.0).abs() < 0.1, "{found} {read}");
        }
    }
    assert!(compared > 1_500, "{compared}");
}

/// Without wheels the speed is that of the accelerometer: from the first second on its variance grows by 4e-4 m²/s² a
/// second at least, and after eight by one, so that wheels that were right all along are let in again.
#[test]
fn without_wheels_the_speed_gets_uncertain() {
    let mut estimator = registry::build("attitude", &vehicle(2), []).unwrap();
    let mut crane = Crane::new(vehicle(2), 15_000.0, 3);
    let (mut variances, mut last) = (Vec::new(), Estimate::default());
    for k in 0..3_300 {
        let t = DT * k as f64;
        let mut z = crane.step(1.0, DT);
        if (20.0..32.0).contains(&t) {
            z.wheel_speed_mps = Default::default();
        } else if t >= 32.0 {
            // it has drifted by more than its accelerometer can
            z.wheel_speed_mps
                .iter_mut()
                .flatten()
                .for_each(|s| s.value += 2.0);
        }
        last = estimator.step(&z, &Command::default(), DT).unwrap();
        variances.push(last.speed_mps.sd.powi(2));
    }
    let grown = |from_s: f64, to_s: f64| {
        let at = |t_s: f64| variances[((20.0 + t_s) / DT) as usize];
        at(to_s) - at(from_s)
    };
    let coasting = grown(1.5, 7.5);
    assert!((1e-6..1e-2).contains(&coasting), "{coasting}");
    assert!(grown(0.0, 0.9) < 2e-4, "{}", grown(0.0, 0.9));
    let open = grown(8.5, 11.5);
    assert!((open / 3.0 - 1.0).abs() < 0.1, "{open}");
    assert!(
        (last.speed_mps.value - 3.0).abs() < 0.05,
        "{}",
        last.speed_mps.value
    );
}
