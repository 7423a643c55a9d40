use super::*;
use crate::error::Error;
use std::path::PathBuf;

const GOOD: &str = "\
version: 1
why: A sample.
track: tracks/level.yaml
train: train.yaml
stop: {after_s: 60}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1.0}], controller: {feedforward: estimate}}
sensors: sensors.yaml
estimators: {dffrls_aekf_robust: {lambda0: 0.98}, jekf: {}}
in_loop: jekf
events: [{at_s: 30, load_mass_kg: 10000}, {from_s: 40, sensor: gyro, fault: drift, size: 0.1}]
seeds: 3..5
expect: [{estimator: jekf, metric: mass_error_rel_max, after_s: 10, at_most: 0.032}]
";

struct TestFolder {
    folder: tempfile::TempDir,
}

impl TestFolder {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("tracks")).unwrap();
        for name in ["tracks/level.yaml", "train.yaml", "sensors.yaml"] {
            std::fs::write(folder.path().join(name), "version: 1\n").unwrap();
        }
        std::fs::write(folder.path().join("sample.yaml"), text).unwrap();
        Self { folder }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("sample.yaml")
    }

    fn load(&self, sets: &[(&str, &str)]) -> Result<Scenario, Error> {
        let sets: Vec<_> = sets
            .iter()
            .map(|(a, b)| ((*a).to_owned(), (*b).to_owned()))
            .collect();
        Scenario::load(&self.path(), &sets)
    }
}

#[test]
fn files_are_found_from_the_scenarios_folder_and_defaults_are_filled_in() {
    let folder = TestFolder::new(GOOD);
    let scenario = folder.load(&[]).unwrap();
    assert_eq!(scenario.name, "sample");
    assert_eq!(
        scenario.track,
        folder.folder.path().join("tracks/level.yaml")
    );
    assert_eq!(scenario.seeds(), [3, 4, 5]);
    assert_eq!(scenario.file.plant(), PlantKind::Rapier);
    assert_eq!(scenario.file.start.speed_mps.get(), 0.0);
}

#[test]
fn the_json_names_no_path_of_this_machine_and_reads_back_as_the_same_scenario() {
    let folder = TestFolder::new(GOOD);
    let scenario = folder.load(&[]).unwrap();
    let json = serde_json::to_string_pretty(&scenario).unwrap();
    assert!(!json.contains(&folder.folder.path().display().to_string()));
    let mut tree: serde_json::Value = serde_json::from_str(&json).unwrap();
    tree.as_object_mut().unwrap().remove("name");
    // JSON is YAML: the manifest's scenario can be run again
    let again = TestFolder::new(&tree.to_string()).load(&[]).unwrap();
    assert_eq!(serde_json::to_string_pretty(&again).unwrap(), json);
}

#[test]
fn sets_apply_in_order_and_are_checked_like_the_file() {
    let folder = TestFolder::new(GOOD);
    let scenario = folder
        .load(&[
            ("load.mass_kg", "1"),
            ("load.mass_kg", "2.5e3"),
            ("drive.speed[1].mps", "0.5"),
            ("physics.plant", "point-mass"),
            ("seeds", "9"),
        ])
        .unwrap();
    assert_eq!(scenario.file.load.mass_kg.unwrap().get(), 2500.0);
    assert_eq!(scenario.file.drive.speed[1].mps.get(), 0.5);
    assert_eq!(scenario.file.plant(), PlantKind::PointMass);
    assert_eq!(scenario.seeds(), [9]);
    for (path, value) in [
        ("load.mass_kg", "-1"),
        ("track", "none.yaml"),
        ("in_loop", "nobody"),
        ("drive.speed", "[]"),
        ("version", "2"),
    ] {
        let told = folder.load(&[(path, value)]).unwrap_err().to_string();
        assert!(told.contains(&format!("--set {path}={value}")), "{told}");
    }
}

/// Every line of a good scenario left out, and every byte replaced: a reason or a scenario, never a panic.
#[test]
fn no_mangled_scenario_makes_the_reader_panic() {
    let folder = TestFolder::new(GOOD);
    let mut refused = 0;
    for at in 0..GOOD.len() {
        for junk in ["", "-", "[", "\u{0}", "9", "{a: ", "é"] {
            let text = format!("{}{junk}{}", &GOOD[..at], &GOOD[at + 1..]);
            std::fs::write(folder.path(), text).unwrap();
            if let Err(Error::Input(e)) = folder.load(&[]) {
                assert!(!e.message.is_empty() && !e.help.is_empty(), "{e}");
                refused += 1;
            }
        }
    }
    assert!(refused > GOOD.len());
}

#[test]
fn a_cycle_that_starts_over_is_by_time_whole_and_ends_as_it_began() {
    let cycle = |text: &str| {
        let folder = TestFolder::new(GOOD);
        folder.load(&[("drive", text)]).map_err(|e| e.to_string())
    };
    let points = "speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}, {at_s: 9, mps: 0}]";
    assert!(cycle(&format!("{{{points}, every_s: 9}}")).is_ok());
    for (text, reason) in [
        (format!("{{{points}, every_s: 8}}"), "later"),
        (
            "{speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}], every_s: 9}".into(),
            "ends at 1 m/s",
        ),
        (
            "{speed: [{at_m: 0, mps: 1}], every_s: 9}".into(),
            "by chainage",
        ),
    ] {
        let told = cycle(&text).unwrap_err();
        assert!(
            told.contains("drive.every_s") && told.contains(reason),
            "{told}"
        );
    }
    let endless = "[{at_s: 1, load_mass_kg: 0, every_s: 1.0e-9}]";
    let told = TestFolder::new(GOOD)
        .load(&[("events", endless)])
        .unwrap_err();
    assert!(
        told.to_string().contains("shorter than a physics step"),
        "{told}"
    );
}
