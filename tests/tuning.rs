//! Replay and tuning on real runs: what is replayed is what was, and what is resumed is what would have been.

#![allow(clippy::unwrap_used)]

use monorig_estimators::crane;
use monorig_lab::replay::cache::{self, Cache};
use monorig_lab::replay::play::play;
use monorig_lab::replay::record::{Recorder, record};
use monorig_lab::series::Series;
use monorig_sim::rig::Rig;
use monorig_sim::run::run;
use monorig_sim::scenario::Scenario;
use monorig_tests::scenario;

/// All estimators beside the loop, on a run with dropouts and late samples, events and faults.
fn eventful(seconds: &str) -> Scenario {
    let all: Vec<String> = crane::NAMES.iter().map(|n| format!("{n}: {{}}")).collect();
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
    let mut rig = Rig::build(s, 3).unwrap();
    let mut recorder = Recorder::new(&rig);
    let mut live = Series::default();
    run(&mut rig, &mut [&mut recorder, &mut live], &mut |_| true).unwrap();
    assert_eq!(live.estimators.len(), crane::NAMES.len());
    let mut replayed = Vec::new();
    let mut vouched = 0;
    for (name, samples) in &live.estimators {
        let columns = &recorder.columns;
        let estimator = crane::build(name, &columns.vehicle, []).unwrap();
        play(columns, estimator, &mut replayed);
        vouched += samples
            .iter()
            .filter(|x| x.mass_valid && x.slope_valid)
            .count();
        let bits = |x: &monorig_lab::series::Sample| {
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
        for (a, b) in samples.iter().zip(&replayed) {
            assert_eq!(bits(a), bits(b), "{name} at {} s", a.t_s);
        }
    }
    assert!(vouched > 1000, "nothing to compare: {vouched}");
}

/// Estimators beside the loop are left out of the recording: it is the same without them.
#[test]
fn estimators_beside_the_loop_do_not_change_the_recording() {
    let with = record(&eventful("5"), 1, &mut |_| true).unwrap().unwrap();
    let mut bare = eventful("5");
    bare.file.estimators.clear();
    let without = record(&bare, 1, &mut |_| true).unwrap().unwrap();
    assert!(with == without);
}

#[test]
fn a_recording_comes_back_from_disk_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let s = eventful("3");
    let made = cache.get(&s, 1, &mut |_| true).unwrap().unwrap();
    let place = cache.place(&s, 1).unwrap();
    assert!(cache::load(&place).unwrap() == made);

    // found again without running: a run would be stopped at once
    let found = cache.get(&s, 1, &mut |_| false).unwrap();
    assert!(found.unwrap() == made);
    // another seed, another scenario: not this one
    assert!(cache.get(&s, 2, &mut |_| false).unwrap().is_none());
    assert!(
        cache
            .get(&eventful("2"), 1, &mut |_| false)
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
        assert!(cache::load(&place).is_none(), "{} bytes", bad.len());
    }
    // and is then made anew
    assert!(cache.get(&s, 1, &mut |_| true).unwrap().unwrap() == made);
    assert!(cache::load(&place).is_some());
    let names = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(names, 1, "something was left behind");
}
