//! The recordings of real instruments, replayed by their committed maps. What is asserted is what is known of them from
//! elsewhere: the floor is level, the train stands, gravity is 9.8 m/s², and the means that a spreadsheet computes of
//! the columns.

use monorig_logs::check::{Verdict, check};
use monorig_logs::map::Map;
use monorig_logs::replay::{ReplayOptions, simulation};
use monorig_sim::{Registry, StepFrame};
use std::path::{Path, PathBuf};

fn map(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/data/real")
        .join(name)
}

const HUSKY: &str = "husky/husky.map.yaml";
const TRAIN: &str = "train_standstill/train_standstill.map.yaml";

/// Every sample of the log reaches the estimators, once, and at its time.
#[test]
fn every_sample_is_delivered_once() {
    let map = Map::load(&map(HUSKY)).unwrap();
    let mut replay = simulation(&map, &ReplayOptions::default(), &Registry::default()).unwrap();
    let (mut imu, mut wheels, mut sum, mut last) = (0u32, 0u32, 0.0, 0.0);
    let mut watch = |f: &StepFrame<'_>| {
        let z = f.measurements;
        if let Some(s) = z.specific_force_mps2 {
            imu += 1;
            sum += s.value[0];
            assert!(
                s.t <= z.t && z.t.s() - s.t.s() < 0.0101,
                "{:?} {:?}",
                s.t,
                z.t
            );
        }
        wheels += u32::from(z.wheel_speed_mps[0].is_some());
        last = z.t.s();
    };
    replay.run(&mut [&mut watch]).unwrap();
    // 5001 rows of the IMU and 326 of the wheels over 50 s; the mean of the column ax is 0.344576
    assert_eq!((imu, wheels), (5001, 326));
    assert!(
        (sum / f64::from(imu) - 0.344_576).abs() < 1e-5,
        "{}",
        sum / f64::from(imu)
    );
    assert!((last - 50.0).abs() < 0.02, "{last}");
}

/// On the level floor the slope is that by which the IMU is pitched or biased, 2.0° by the mean of its readings, within
/// the standard deviations that the estimators report; never NaN.
#[test]
fn the_slope_of_a_level_floor() {
    let map = Map::load(&map(HUSKY)).unwrap();
    let mut replay = simulation(&map, &ReplayOptions::default(), &Registry::default()).unwrap();
    let mut slopes: Vec<(String, f64, f64)> = Vec::new();
    let mut watch = |f: &StepFrame<'_>| {
        slopes = f
            .estimators
            .iter()
            .map(|e| {
                (
                    e.name.clone(),
                    e.estimate.grade_rad.value.to_degrees(),
                    e.estimate.grade_rad.sd.to_degrees(),
                )
            })
            .collect();
        assert_eq!(f.truth.grade_at_imu_rad, 0.0);
        assert!(f.truth.total_mass_kg.is_nan(), "no mass is known of it");
    };
    let outcome = replay.run(&mut [&mut watch]).unwrap();
    assert!(
        outcome.finished && outcome.refusals.is_empty(),
        "{:?}",
        outcome.refusals
    );
    for (name, slope, sd) in slopes {
        let off = slope.abs();
        assert!(
            off < 3.0 * sd.hypot(0.5).max(0.9),
            "{name}: {slope:.2}° ± {sd:.2}°"
        );
    }
}

/// Three runs are three segments, in each of which the estimators begin anew.
#[test]
fn runs_are_segments() {
    let map = Map::load(&map(TRAIN)).unwrap();
    let mut replay = simulation(&map, &ReplayOptions::default(), &Registry::default()).unwrap();
    let (mut times, mut forces) = (Vec::new(), Vec::new());
    let mut watch = |f: &StepFrame<'_>| {
        if f.sampled {
            times.push(f.measurements.t.s());
        }
        forces.extend(
            f.measurements
                .specific_force_mps2
                .map(|s| s.value.iter().map(|x| x * x).sum::<f64>().sqrt()),
        );
    };
    replay.run(&mut [&mut watch]).unwrap();
    let gaps = times.windows(2).filter(|w| w[1] - w[0] > 0.5).count();
    assert_eq!(gaps, 2);
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    assert!((9.6..10.2).contains(&mean), "{mean}");
}

/// The checks find nothing wrong with the train's log but the biases that its gyro really has; and what is broken on
/// purpose they find.
#[test]
fn checks_of_the_real_logs() {
    let bad = |map: &Map| -> Vec<String> {
        let all = check(map).unwrap();
        all.into_iter()
            .filter(|c| matches!(c.verdict, Verdict::Bad(_)))
            .map(|c| c.what)
            .collect()
    };
    let of = |name: &str, sets: &[(&str, &str)]| {
        let sets: Vec<_> = sets
            .iter()
            .map(|(a, b)| ((*a).to_owned(), (*b).to_owned()))
            .collect();
        Map::load_with(&map(name), None, &sets).unwrap()
    };
    assert_eq!(bad(&of(HUSKY, &[])), [""; 0]);
    let train = bad(&of(TRAIN, &[]));
    assert!(
        train.iter().all(|w| {
            // Three pieces of 1.2 s are too short for what the checks ask for.
            w.starts_with("bias of the gyro") || w.starts_with("samples of all channels")
        }),
        "{train:?}"
    );
    let unit = bad(&of(HUSKY, &[("channels.specific_force.unit", "g")]));
    assert!(unit.iter().any(|w| w.starts_with("|f|")), "{unit:?}");
}
