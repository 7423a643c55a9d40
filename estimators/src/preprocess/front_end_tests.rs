//! Tests of [`super`].

use super::*;
use crate::testing::vehicles::vehicle;

#[test]
fn a_channel_without_samples_is_held_for_three_periods_only() {
    let mut front = FrontEnd::new(&vehicle());
    let u = Command::default();
    for k in 1..=10 {
        let t = Time::from_s(0.05 * f64::from(k));
        let mut z = Measurements::at(t);
        z.wheel_speed_mps[0] = Some(Sample { t, value: 1.0 });
        front.read(&z, &u, 0.05).unwrap();
    }
    let nothing = |t_s| Measurements::at(Time::from_s(t_s));
    let reading = front.read(&nothing(0.6), &u, 0.05).unwrap();
    assert_eq!(
        (reading.speed_mps, reading.new_speed_mps),
        (Some(1.0), None)
    );
    let reading = front.read(&nothing(0.66), &u, 0.05).unwrap();
    assert_eq!(reading.speed_mps, None);
}

#[test]
fn missing_torques_are_made_up_from_the_others_down_to_half() {
    let u = Command::default();
    let read = |count: usize| {
        let mut z = Measurements {
            t: Time::from_s(1.0),
            ..Default::default()
        };
        for place in z.motor_torque_nm.iter_mut().take(count) {
            *place = Some(Sample {
                t: Time::from_s(1.0),
                value: 100.0,
            });
        }
        FrontEnd::new(&vehicle())
            .read(&z, &u, 0.01)
            .unwrap()
            .motor_torque_nm
    };
    assert_eq!(vehicle().drives, 8);
    assert_eq!(
        (read(8), read(4), read(3)),
        (Some(800.0), Some(800.0), None)
    );
}

#[test]
fn a_grade_that_grows_is_a_positive_pitch_rate() {
    let z = Measurements {
        t: Time::from_s(1.0),
        angular_rate_radps: Some(Sample {
            t: Time::from_s(1.0),
            value: [0.0, -0.1, 0.0],
        }),
        ..Default::default()
    };
    let mut front = FrontEnd::new(&vehicle());
    let reading = front.read(&z, &Command::default(), 0.01).unwrap();
    assert_eq!(reading.pitch_rate_radps, Some(0.1));
}

/// Speeds of eight wheels over 10 s, then one second of `faulty` ones; what is known at the end.
fn after(faulty: impl Fn(usize, Real) -> Option<Real>) -> Reading {
    let mut front = FrontEnd::new(&vehicle());
    let mut random = crate::testing::Random::new(91);
    let mut last = Reading::default();
    for k in 1..=1_100 {
        let t = Time::from_ns(10_000_000 * k);
        let mut z = Measurements::at(t);
        for (i, place) in z.wheel_speed_mps.iter_mut().enumerate() {
            let noisy = 1.0 + 0.005 * random.normal();
            let value = if k > 1_000 {
                faulty(i, noisy)
            } else {
                Some(noisy)
            };
            *place = value.map(|value| Sample { t, value });
        }
        last = front.read(&z, &Command::default(), 0.01).unwrap();
    }
    last
}

#[test]
fn why_the_speed_is_not_known() {
    let fine = after(|_, noisy| Some(noisy));
    assert!(fine.speed_mps.is_some() && fine.wheel_speed_fault.is_none());
    let fault = |reading: Reading| (reading.speed_mps, reading.wheel_speed_fault);
    let slips = after(|i, noisy| Some(noisy + if i < 6 { 0.3 * (i + 1) as Real } else { 0.0 }));
    assert_eq!(fault(slips), (None, Some(Rejection::Slip)));
    let stuck = after(|_, _| Some(1.0));
    assert_eq!(fault(stuck), (None, Some(Rejection::Stuck)));
    let stale = after(|_, _| None);
    assert_eq!(fault(stale), (None, None));
}

#[test]
fn a_train_at_the_standstill_speed_stands_and_a_brake_at_its_threshold_is_released() {
    let at = |speed_mps, brake| Reading {
        speed_mps: Some(speed_mps),
        brake,
        ..Reading::default()
    };
    assert_eq!(motion(&at(0.05, 0.0), 0.05), (false, false));
    assert_eq!(motion(&at(-0.051, 0.001), 0.05), (true, true));
    assert_eq!(motion(&at(0.051, 0.0011), 0.05), (true, false));
    assert_eq!(motion(&Reading::default(), 0.05), (false, false));
}
