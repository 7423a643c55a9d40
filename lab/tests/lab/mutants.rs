//! The files that a search of parameters keeps between its runs, given almost right: an error, nothing, or a result;
//! never a panic.
//!
//! As `cli/tests/cli/mutants.rs`: by hand as many as one likes, `MONORIG_MUTANTS=10000 cargo test --release
//! --test lab mutants::`.

use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurements, Sample};
use monorig_lab::campaign::{Campaign, CampaignKind, RunList, Store};
use monorig_lab::metrics::series::Target;
use monorig_lab::replay::{ReplayData, cache};
use monorig_lab::tuning::trial_store::Trial;
use monorig_sim::record::identity::Identity;
use monorig_sim::testing::vehicle;
use monorig_testing::{mutant, mutants};
use sha2::{Digest, Sha256};

/// Mutants of each kind in the normal suite.
const MUTANTS: u64 = 1000;
/// First bytes of a recording: format and check sum of what follows.
const FORMAT_BYTES: usize = 16;
const HEAD_BYTES: usize = FORMAT_BYTES + 32;

/// A recording of 60 steps, some with everything and some with little.
fn recording() -> ReplayData {
    let mut data = ReplayData::new(vehicle());
    for k in 0..60_u32 {
        let t = Time::from_s(f64::from(k) * 0.01);
        let z = Measurements {
            t,
            specific_force_mps2: (k % 2 == 0).then_some(Sample {
                t,
                value: [0.1, 0.0, 9.8],
            }),
            wheel_speed_mps: std::array::from_fn(|i| {
                (k as usize)
                    .is_multiple_of(i + 2)
                    .then_some(Sample { t, value: 1.0 })
            }),
            ..Measurements::default()
        };
        let target = Target {
            t_s: t.s(),
            total_mass_kg: 19e3,
            ..Target::default()
        };
        let command = Command::default();
        data.push(&z, (k % 5 == 0).then_some(&command), target);
    }
    data
}

#[test]
fn mutants_of_recordings_to_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("a.replay");
    cache::save(&place, &recording()).unwrap();
    let good = std::fs::read(&place).unwrap();
    assert_eq!(cache::load(&place, vehicle()).unwrap(), recording());
    let mut decoded = 0;
    for seed in 0..mutants::count(MUTANTS) {
        let mut bytes = mutant(&good, 0, seed);
        std::fs::write(&place, &bytes).unwrap();
        let same = bytes == good;
        assert_eq!(
            cache::load(&place, vehicle()).is_some(),
            same,
            "mutant {seed}"
        );
        // and with the check sum of what is in it: the decoder is on its own
        bytes = mutant(&good, HEAD_BYTES, seed);
        let sum = Sha256::digest(&bytes[HEAD_BYTES..]);
        bytes[FORMAT_BYTES..HEAD_BYTES].copy_from_slice(&sum);
        std::fs::write(&place, &bytes).unwrap();
        let Some(data) = cache::load(&place, vehicle()) else {
            continue;
        };
        decoded += 1;
        assert!(data.len() <= bytes.len() / 8, "mutant {seed}");
        let mut steps = data.steps();
        let mut n = 0;
        while steps.advance().is_some() {
            n += 1;
        }
        assert!(n <= data.len(), "mutant {seed}");
    }
    assert!(decoded > 0, "the decoder refused all of them");
}

#[test]
fn mutants_of_trials() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trials.jsonl");
    let identity = Identity::of_program(None);
    let (list, inputs) = (
        vec![RunList::new("trials", 0..20)],
        [("a".into(), "b".into())].into(),
    );
    let values = serde_json::json!({"budget": 20});
    let header = Campaign::new(CampaignKind::Tune, "quick", list, &identity, inputs, values);
    let mut store = Store::replace(&path, &header).unwrap();
    for trial in 0..20 {
        let of = Trial {
            trial,
            origin: "search".into(),
            parameters: Default::default(),
            losses: vec![1.0 / (trial + 1) as f64],
            violation: 0.0,
            failed: None,
        };
        store.append(&of).unwrap();
    }
    drop(store);
    let good = std::fs::read(&path).unwrap();
    let mut resumed = 0;
    for seed in 0..mutants::count(MUTANTS) {
        std::fs::write(&path, mutant(&good, 0, seed)).unwrap();
        let mut trials: Vec<Trial> = Vec::new();
        match Store::resume(&path, &header, |trial| trials.push(trial)) {
            Ok(_) => {
                resumed += 1;
                let numbers = trials.iter().map(|t| t.trial);
                assert!(numbers.eq(0..trials.len()), "mutant {seed}");
            }
            Err(e) => assert!(e.to_string().contains("trials.jsonl"), "mutant {seed}: {e}"),
        }
    }
    assert!(resumed > 0, "none of them was read");
}
