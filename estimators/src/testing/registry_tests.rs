//! Laws that hold for every named estimator.

use crate::Time;
use crate::api::estimator::Estimator;
use crate::api::params::{Key, KeyKind, Name, ParamError};
use crate::api::signals::Sample;
use crate::api::signals::{Command, Estimate, Measurements, RoadVehicle, Vehicle, VehicleData};
use crate::registry::*;
use crate::testing::Random;
use crate::testing::vehicles::*;
use crate::{Error, Real};
use std::vec::Vec;

/// Every named estimator on a train and on a road vehicle.
fn all() -> impl Iterator<Item = (&'static str, Vehicle, AnyEstimator)> {
    let vehicles = || [vehicle(), car()].into_iter();
    NAMES.iter().flat_map(move |name| {
        vehicles().map(|vehicle| (*name, vehicle, build(name, &vehicle, []).unwrap()))
    })
}

#[test]
fn every_key_has_a_default_in_its_range_and_a_unique_name() {
    for name in NAMES {
        let keys: Vec<&Key> = keys(name).unwrap().collect();
        for key in &keys {
            assert!(!key.doc.is_empty(), "{name}.{}", key.name);
            assert_eq!(
                keys.iter().filter(|other| other.name == key.name).count(),
                1,
                "{name}.{}",
                key.name
            );
            let set = |value| build(name, &vehicle(), [(key.name, value)]);
            assert!(key.default().is_none_or(|value| set(value).is_ok()));
            match key.kind {
                KeyKind::Number {
                    unit,
                    range: [low, high],
                    ..
                } => {
                    assert!(!unit.is_empty() && low < high, "{name}.{}", key.name);
                    let beyond = high * 2.0 + 1.0;
                    assert_eq!(set(beyond.into()), Err(ParamError::OutOfRange(key, beyond)));
                    assert!(
                        matches!(set(Real::NAN.into()), Err(ParamError::OutOfRange(of, _)) if of == *key)
                    );
                    assert_eq!(set(true.into()), Err(ParamError::OtherKind(key)));
                }
                KeyKind::Flag { .. } => {
                    assert!(set(true.into()).is_ok() && set(false.into()).is_ok());
                    assert_eq!(set(1.0.into()), Err(ParamError::OtherKind(key)));
                }
                KeyKind::Choice { choices, .. } => {
                    assert!(choices.iter().all(|&word| set(word.into()).is_ok()));
                    assert_eq!(
                        set("any".into()),
                        Err(ParamError::NotAChoice(key, Name::new("any")))
                    );
                    assert_eq!(set(1.0.into()), Err(ParamError::OtherKind(key)));
                }
            }
        }
        assert_eq!(
            build(name, &vehicle(), [("lamda0", 1.0.into())]),
            Err(ParamError::UnknownKey(Name::new("lamda0")))
        );
    }
    assert_eq!(
        build("dffrls", &vehicle(), []),
        Err(ParamError::UnknownEstimator(Name::new("dffrls")))
    );
    assert!(keys("dffrls").is_none());
}

#[test]
fn an_impossible_vehicle_is_refused() {
    let bad = [
        VehicleData {
            wheel_radius_m: 0.0,
            ..vehicle().data()
        },
        VehicleData {
            drives: 0,
            ..vehicle().data()
        },
        VehicleData {
            drives: 17,
            ..vehicle().data()
        },
        VehicleData {
            efficiency: 1.1,
            ..vehicle().data()
        },
        VehicleData {
            mass_range_kg: [2e4, 1e4],
            ..vehicle().data()
        },
        VehicleData {
            gear_ratio: Real::NAN,
            ..vehicle().data()
        },
        VehicleData {
            road: car().road.map(|road| RoadVehicle {
                rear_axle_m: 0.0,
                ..road
            }),
            ..car().data()
        },
        VehicleData {
            road: car().road.map(|road| RoadVehicle {
                drag_area_m2: Real::NAN,
                ..road
            }),
            ..car().data()
        },
    ];
    for data in bad {
        assert!(matches!(Vehicle::new(data), Err(ParamError::Vehicle(_))));
    }
}

#[test]
fn the_same_samples_give_the_same_bits_and_reset_forgets_all() {
    for (name, vehicle, mut estimator) in all() {
        let world = World {
            seconds: 20.0,
            ..world(1)
        };
        let first: Vec<Estimate> = world
            .run(&mut estimator)
            .iter()
            .map(|row| row.estimate)
            .collect();
        estimator.reset();
        assert_eq!(estimator, build(name, &vehicle, []).unwrap());
        let again: Vec<Estimate> = world
            .run(&mut estimator)
            .iter()
            .map(|row| row.estimate)
            .collect();
        assert_eq!(first, again, "{name}");
    }
}

/// Pipelines that observe the slope only through traction.
const BY_TRACTION: &[&str] = &[
    "dffrls_aekf",
    "rls_ekf",
    "ffrls",
    "joint_ekf",
    "mmrls_sh_stf",
];

#[test]
fn standing_never_changes_mass_or_slope() {
    for (name, _, mut estimator) in all() {
        let mut random = Random::new(21);
        let mut first = None;
        for k in 1..=20_000 {
            let t_s = k as Real * DT;
            let mut z = Measurements {
                t: Time::from_s(t_s),
                ..Default::default()
            };
            z.specific_force_mps2 = Some(Sample {
                t: Time::from_s(t_s),
                value: [random.normal(), 0.0, 9.81],
            });
            for i in 0..8 {
                z.motor_torque_nm[i] = Some(Sample {
                    t: Time::from_s(t_s),
                    value: 500.0 * random.normal(),
                });
                z.wheel_speed_mps[i] = Some(Sample {
                    t: Time::from_s(t_s),
                    value: 0.005 * random.normal(),
                });
            }
            let estimate = estimator.step(&z, &Command::default(), DT).unwrap();
            let flags = estimate.flags;
            assert!(
                !flags.moving && !flags.excited,
                "{name} at {t_s}: {flags:?}"
            );
            // An accelerometer reads the slope standing too; traction does not.
            let slope = if BY_TRACTION.contains(&name) {
                estimate.grade_rad.value
            } else {
                0.0
            };
            let now = (estimate.total_mass_kg, slope);
            assert_eq!(*first.get_or_insert(now), now, "{name} at {t_s}");
        }
    }
}

/// A step of which some numbers are garbage: huge, tiny, NaN, infinite, stale, or missing.
fn garbage(random: &mut Random, t_s: Real) -> (Measurements, Command, Real) {
    let number = |random: &mut Random| match (random.uniform() * 12.0) as u32 {
        0 => Real::NAN,
        1 => Real::INFINITY,
        2 => -1e300,
        3 => 0.0,
        4..=6 => 50.0 * random.normal(),
        _ => 0.5 * random.normal(),
    };
    let sample = |random: &mut Random| {
        let t_s = if random.uniform() < 0.05 {
            number(random)
        } else {
            t_s
        };
        let value = if random.uniform() < 0.02 {
            number(random)
        } else {
            0.8 + 0.3 * random.normal()
        };
        (random.uniform() < 0.8).then_some(Sample {
            t: Time::from_s(t_s),
            value,
        })
    };
    let mut z = Measurements {
        t: Time::from_s(t_s),
        ..Default::default()
    };
    for i in 0..8 {
        z.motor_torque_nm[i] = sample(random).map(|s| Sample {
            value: 100.0 * s.value,
            ..s
        });
        z.wheel_speed_mps[i] = sample(random);
    }
    z.specific_force_mps2 = sample(random).map(|s| Sample {
        t: s.t,
        value: [s.value, s.value, 0.0],
    });
    z.angular_rate_radps = sample(random).map(|s| Sample {
        t: s.t,
        value: [0.0, s.value, 0.0],
    });
    z.steering_angle_rad = sample(random);
    let u = Command {
        brake: if random.uniform() < 0.02 {
            Real::NAN
        } else {
            0.0
        },
        ..Default::default()
    };
    let dt = if random.uniform() < 0.05 { -DT } else { DT };
    (z, u, dt)
}

#[test]
fn steps_of_garbage_leave_it_finite_and_a_refused_step_leaves_it_as_it_was() {
    garbage_leaves_it_finite(20_000);
}

#[test]
#[ignore = "a soak, which .ci/run makes"]
fn soak_a_hundred_thousand_steps_of_garbage_leave_it_finite() {
    garbage_leaves_it_finite(100_000);
}

fn garbage_leaves_it_finite(steps: usize) {
    for (name, vehicle, mut estimator) in all() {
        let mut random = Random::new(22);
        let (mut refused, mut taken) = (0, 0);
        for k in 1..=steps {
            let mut t_s = k as Real * DT;
            if random.uniform() < 0.01 {
                t_s = -t_s;
            }
            let (z, u, dt) = garbage(&mut random, t_s);
            let before = estimator;
            match estimator.step(&z, &u, dt) {
                Ok(estimate) => {
                    taken += 1;
                    assert!(estimate.is_finite(), "{name}: {estimate:?}");
                    let [low, high] = vehicle.mass_range_kg;
                    assert!(
                        (low..=high).contains(&estimate.total_mass_kg.value),
                        "{name}: {estimate:?}"
                    );
                    assert!(
                        estimate.total_mass_kg.sd >= 0.0
                            && estimate.grade_rad.sd >= 0.0
                            && estimate.speed_mps.sd >= 0.0
                    );
                    assert!(estimate.grade_rad.value.abs() < 1.1);
                    assert!(estimate.nis >= 0.0);
                }
                Err(error) => {
                    refused += 1;
                    assert_ne!(error, Error::Diverged, "{name} at step {k}");
                    assert_eq!(
                        estimator, before,
                        "{name}: refused with {error} and changed"
                    );
                }
            }
        }
        assert!(
            refused > steps / 10 && taken > steps / 10,
            "{refused} refused, {taken} taken"
        );
        let mut values = [0.0; 64];
        estimator.internal_values(&mut values);
        assert!(values.iter().all(|v| v.is_finite()), "{name}");
        assert!(estimator.internals().len() <= values.len());
    }
}

/// `reset` builds anew from vehicle and parameters, so that an estimator is kept once.
#[test]
fn an_estimator_is_kept_once() {
    use crate::preprocess::front_end::FrontEnd;
    use crate::runner::Runner;
    use crate::supervised::liu_2023::dffrls_aekf_robust::{DffrlsAekf, Params};
    let parts = size_of::<DffrlsAekf>()
        + size_of::<FrontEnd>()
        + size_of::<Params>()
        + size_of::<Vehicle>();
    std::println!(
        "AnyEstimator {} bytes, dffrls_aekf_robust {} bytes",
        size_of::<AnyEstimator>(),
        size_of::<Runner<DffrlsAekf, Params>>()
    );
    assert!(size_of::<Runner<DffrlsAekf, Params>>() <= parts + 64);
}
