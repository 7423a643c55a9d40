//! Snapshots of every named estimator: to survive a power cycle to the last bit, and to refuse all that is not such a
//! snapshot.

use crate::common::{Crane, Random, vehicle};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::Setting;
use monorig_estimators::api::signals::{Command, MAX_DRIVES, Measurements};
use monorig_estimators::api::snapshot::{MAX_SNAPSHOT_BYTES, SnapshotError};
use monorig_estimators::registry::AnyEstimator;
use monorig_estimators::{Real, registry};

const DT: Real = 0.01;

/// A drive with starts, stops, the brake, grades, bends of the rail, spikes of the gyro and sensors that fall silent.
fn drive(steps: usize) -> Vec<(Measurements, Command)> {
    drive_of(2, steps)
}

/// The same of a vehicle with so many drive units.
fn drive_of(drives: usize, steps: usize) -> Vec<(Measurements, Command)> {
    let mut crane = Crane::new(vehicle(drives), 15_000.0, 8);
    let mut random = Random::new(9);
    (0..steps)
        .map(|k| {
            crane.grade_rad = 0.1 * (crane.chainage_m / 5.0).sin();
            let wanted = [1.2, 0.4, 0.0, -0.8][(k / 700) % 4];
            let mut z = crane.step(wanted, DT);
            if let Some(rate) = &mut z.angular_rate_radps {
                rate.value[2] += 0.1 * crane.speed_mps;
                if random.chance(0.02) {
                    rate.value[1] += 0.5;
                }
            }
            if random.chance(0.05) {
                z.specific_force_mps2 = None;
            }
            if (k / 300) % 5 == 4 {
                z.motor_torque_nm[1] = None;
            }
            let u = Command {
                brake: if wanted == 0.0 && k % 2 == 0 {
                    1.0
                } else {
                    0.0
                },
                ..Command::default()
            };
            (z, u)
        })
        .collect()
}

fn all() -> Vec<AnyEstimator> {
    let built = registry::NAMES.iter();
    built
        .map(|name| registry::build(name, &vehicle(2), []).unwrap())
        .collect()
}

fn run(estimator: &mut AnyEstimator, drive: &[(Measurements, Command)]) {
    for (z, u) in drive {
        estimator.step(z, u, DT).unwrap();
    }
}

fn taken(estimator: &AnyEstimator) -> Vec<u8> {
    let mut bytes = [0; MAX_SNAPSHOT_BYTES];
    let used = estimator.snapshot(&mut bytes).unwrap();
    bytes[..used].to_vec()
}

/// Puts the right check sum behind a changed snapshot.
fn signed(mut snapshot: Vec<u8>) -> Vec<u8> {
    let end = snapshot.len() - 4;
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&snapshot[..end]);
    snapshot[end..].copy_from_slice(&sum.to_le_bytes());
    snapshot
}

/// After a drive each estimator is another than the one that was built, and what is restored from its snapshot is equal
/// to it in all that it holds.
#[test]
fn what_is_restored_is_what_was() {
    let drive = drive(1_500);
    for mut estimator in all() {
        let mut restored = estimator;
        run(&mut estimator, &drive);
        assert_ne!(restored, estimator, "{}", estimator.name());
        restored.restore(&taken(&estimator)).unwrap();
        assert_eq!(restored, estimator, "{}", estimator.name());
    }
}

#[test]
fn a_restored_estimator_goes_on_as_if_the_power_had_never_failed() {
    let drive = drive(6_000);
    for mut estimator in all() {
        let fresh = estimator;
        for (cut, part) in drive.chunks(1_511).enumerate() {
            let name = estimator.name();
            let mut restored = fresh;
            restored.restore(&taken(&estimator)).unwrap();
            assert_eq!(restored, estimator, "{name} at cut {cut}");
            for (z, u) in part {
                let a = estimator.step(z, u, DT).unwrap();
                let b = restored.step(z, u, DT).unwrap();
                assert_eq!(format!("{a:?}"), format!("{b:?}"), "{name} after cut {cut}");
            }
        }
    }
}

/// At any time of a drive with as many drive units as there can be: their states are then there, and most of what is
/// optional at some time.
#[test]
fn a_snapshot_fits_at_any_time_of_a_drive_with_all_drive_units() {
    let drive = drive_of(MAX_DRIVES, 6_000);
    for name in registry::NAMES {
        let mut estimator = registry::build(name, &vehicle(MAX_DRIVES), []).unwrap();
        let mut bytes = [0; MAX_SNAPSHOT_BYTES];
        for (k, (z, u)) in drive.iter().enumerate() {
            estimator.step(z, u, DT).unwrap();
            if k % 7 == 0 {
                let used = estimator.snapshot(&mut bytes);
                assert!(used.is_ok(), "{name} at step {k}: {used:?}");
            }
        }
    }
}

#[test]
fn a_torn_or_corrupt_snapshot_is_refused_and_changes_nothing() {
    let drive = drive(2_000);
    for mut estimator in all() {
        run(&mut estimator, &drive);
        let (name, good) = (estimator.name(), taken(&estimator));
        let mut other = registry::build(name, &vehicle(2), []).unwrap();
        let before = other;
        for length in 0..good.len() {
            assert!(other.restore(&good[..length]).is_err(), "{name} {length}");
        }
        for place in 0..good.len() {
            {
                let mut bad = good.clone();
                bad[place] ^= 1 << (place % 8);
                let refused = other.restore(&bad).unwrap_err();
                assert_eq!(refused, SnapshotError::Corrupt, "{name} {place}");
            }
        }
        assert_eq!(other, before, "{name}");
    }
}

#[test]
fn whatever_is_signed_an_estimator_takes_only_what_it_can_go_on_from() {
    let drive = drive(2_500);
    let (past, future) = drive.split_at(2_000);
    let mut random = Random::new(10);
    for mut estimator in all() {
        run(&mut estimator, past);
        let (name, good) = (estimator.name(), taken(&estimator));
        assert_eq!(signed(good.clone()), good);
        let (mut taken, mut refused) = (0, 0);
        for _ in 0..1_000 {
            let mut bad = good.clone();
            let place = random.below(bad.len() - 4);
            match random.below(4) {
                0 => bad[place] ^= 1 << random.below(8),
                1 => bad[place] = random.bits() as u8,
                2 => bad.truncate(place + 4),
                _ => bad[place..]
                    .iter_mut()
                    .for_each(|byte| *byte = random.bits() as u8),
            }
            let before = estimator;
            let mut other = estimator;
            match other.restore(&signed(bad)) {
                Err(_) => {
                    refused += 1;
                    assert_eq!(other, before, "{name}");
                }
                // Another state that could be: it must go on without a panic and without a number that is none.
                Ok(()) => {
                    taken += 1;
                    for (z, u) in &future[..10] {
                        if let Ok(estimate) = other.step(z, u, DT) {
                            assert!(estimate.is_finite(), "{name}: {estimate:?}");
                        }
                    }
                }
            }
        }
        assert!(
            refused > 300 && taken > 30,
            "{name}: {taken} taken, {refused} refused"
        );
    }
}

#[test]
fn what_is_not_a_number_does_not_get_in() {
    for mut estimator in all() {
        run(&mut estimator, &drive(1_000));
        let (name, good) = (estimator.name(), taken(&estimator));
        // Behind the header each scalar takes 8 bytes, but not always at a multiple of 8: try all places. Across two
        // numbers the bytes may make two others that are good.
        let mut refused = 0;
        for place in 22..good.len() - 12 {
            let mut bad = good.clone();
            bad[place..place + 8].copy_from_slice(&Real::NAN.to_le_bytes());
            let mut other = estimator;
            match other.restore(&signed(bad)) {
                Err(SnapshotError::Nonsense) => refused += 1,
                Err(_) => {}
                Ok(()) => {
                    let itself = other;
                    assert_eq!(other, itself, "{name} at {place}: NaN is not itself");
                }
            }
        }
        assert!(refused > 50, "{name}");
    }
}

#[test]
fn a_snapshot_of_another_estimator_vehicle_or_parameter_is_refused() {
    let built = |name: &str, drives, settings: &[(&'static str, Setting<'static>)]| {
        registry::build(name, &vehicle(drives), settings.iter().copied()).unwrap()
    };
    let mut estimator = built("dffrls_aekf_robust", 2, &[]);
    let before = estimator;
    for (other, why) in [
        (built("mmrls_sh_stf", 2, &[]), SnapshotError::OtherEstimator),
        (
            built("dffrls_aekf_robust", 3, &[]),
            SnapshotError::OtherSettings,
        ),
        (
            built("dffrls_aekf_robust", 2, &[("mass_sd", 0.41.into())]),
            SnapshotError::OtherSettings,
        ),
    ] {
        assert_eq!(estimator.restore(&taken(&other)), Err(why));
    }
    let mut other_format = taken(&estimator);
    other_format[4] ^= 1;
    assert_eq!(
        estimator.restore(&signed(other_format)),
        Err(SnapshotError::Format)
    );
    assert_eq!(estimator, before);
}

#[test]
fn a_buffer_too_small_is_refused_with_the_room_it_takes() {
    for estimator in all() {
        let needed = taken(&estimator).len();
        let mut small = vec![0; needed - 1];
        assert_eq!(
            estimator.snapshot(&mut small),
            Err(SnapshotError::Room(needed))
        );
        assert_eq!(
            estimator.snapshot(&mut []),
            Err(SnapshotError::Room(needed))
        );
        let mut exact = vec![0; needed];
        assert_eq!(estimator.snapshot(&mut exact), Ok(needed));
    }
}
