//! Every key of a scenario does something: a change of its value changes the motion or the estimates.

use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::closed_loop::run::{StepFrame, run};
use monorig_tests::scenario;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};

/// The part of a run that a key is to change.
#[derive(Clone, Copy, PartialEq)]
enum Changes {
    /// The motion of the train.
    Motion,
    /// The estimates, and nothing of the motion: no estimator drives.
    Estimates,
    /// The estimates; the motion may follow, since the controller sees the wheels and has the data sheet.
    Seen,
    /// Only how long, or from what other file, the run is: shown by its length or its motion.
    Run,
}
use Changes::{Estimates, Motion, Run, Seen};

/// Keys of the schema with a value that differs from that of the base. `[]` stands for a list, which is set as a whole.
const KEYS: &[(&str, &str, &str, Changes)] = &[
    ("drive.accel_mps2", "drive.accel_mps2", "0.1", Motion),
    (
        "drive.controller.feedforward",
        "drive.controller.feedforward",
        "none",
        Motion,
    ),
    ("drive.every_s", "drive.every_s", "4", Motion),
    (
        "drive.speed[].at_m",
        "drive.speed",
        "[{at_m: 0, mps: 0.7}, {at_m: 33, mps: 0.3}]",
        Motion,
    ),
    (
        "drive.speed[].at_s",
        "drive.speed",
        "[{at_s: 0, mps: 0}, {at_s: 4, mps: 1}]",
        Motion,
    ),
    (
        "drive.speed[].mps",
        "drive.speed",
        "[{at_s: 0, mps: 0}, {at_s: 3, mps: 0.5}]",
        Motion,
    ),
    (
        "events[].at_s",
        "events",
        "[{at_s: 3, load_mass_kg: 5000}]",
        Motion,
    ),
    (
        "events[].every_s",
        "events",
        "[{at_s: 2, brake: 0.2, every_s: 1}, {at_s: 2.5, brake: 0, every_s: 1}]",
        Motion,
    ),
    (
        "events[].load_mass_kg",
        "events",
        "[{at_s: 4, load_mass_kg: 5500}]",
        Motion,
    ),
    (
        "events[].load_speed_mps",
        "events",
        "[{at_s: 4, load_mass_kg: 15000, load_speed_mps: 0}]",
        Motion,
    ),
    (
        "events[].adhesion",
        "events",
        "[{from_m: 20, to_m: 60, adhesion: 0.01}]",
        Motion,
    ),
    (
        "events[].from_m",
        "events",
        "[{from_m: 25, to_m: 60, adhesion: 0.01}]",
        Motion,
    ),
    (
        "events[].to_m",
        "events",
        "[{from_m: 25, to_m: 29, adhesion: 0.01}]",
        Motion,
    ),
    (
        "events[].fault",
        "events",
        "[{from_s: 3, sensor: imu, fault: stuck}]",
        Estimates,
    ),
    (
        "events[].axis",
        "events",
        "[{from_s: 3, sensor: accelerometer, fault: bias, size: 0.5, axis: left}]",
        Estimates,
    ),
    (
        "events[].from_s",
        "events",
        "[{from_s: 4, sensor: imu, fault: stuck}]",
        Estimates,
    ),
    (
        "events[].to_s",
        "events",
        "[{from_s: 4, to_s: 5, sensor: imu, fault: stuck}]",
        Estimates,
    ),
    (
        "events[].sensor",
        "events",
        "[{from_s: 4, sensor: wheel_speed, fault: stuck}]",
        Seen,
    ),
    (
        "events[].size",
        "events",
        "[{from_s: 4, sensor: wheel_speed, fault: scale, size: 1.1}]",
        Seen,
    ),
    (
        "events[].clamp_mpa",
        "events",
        "[{at_s: 3, clamp_mpa: 1}]",
        Motion,
    ),
    (
        "events[].brake",
        "events",
        "[{at_s: 3, brake: 0.5}]",
        Motion,
    ),
    (
        "events[].dragging_brake",
        "events",
        "[{at_s: 3, dragging_brake: 0.1}]",
        Motion,
    ),
    (
        "events[].isolated_drive",
        "events",
        "[{at_s: 3, isolated_drive: 0}]",
        Motion,
    ),
    (
        "events[].restart_s",
        "events",
        "[{at_s: 3, restart_s: 1}]",
        Estimates,
    ),
    ("in_loop", "in_loop", "rail_fusion", Motion),
    ("load.mass_kg", "load.mass_kg", "9000", Motion),
    ("physics.dt_ms", "physics.dt_ms", "1", Run),
    (
        "physics.gravity_mps2",
        "physics.gravity_mps2",
        "9.7",
        Motion,
    ),
    ("physics.plant", "physics.plant", "point-mass", Motion),
    ("seeds", "seeds", "9", Seen),
    ("seeds[]", "seeds", "[9]", Seen),
    (
        "sensors",
        "sensors",
        "../../assets/sensors/harsh.yaml",
        Seen,
    ),
    ("start.chainage_m", "start.chainage_m", "33", Motion),
    ("start.speed_mps", "start.speed_mps", "0.5", Motion),
    ("stop.after_s", "stop.after_s", "7", Run),
    ("stop.at_m", "stop.at_m", "33", Run),
    (
        "track",
        "track",
        "../../assets/tracks/level_200m.yaml",
        Motion,
    ),
    (
        "train",
        "train",
        "../../assets/trains/dx80_176y_50t.yaml",
        Seen,
    ),
    ("vehicle.chain_m", "vehicle.chain_m", "2.5", Estimates),
    ("vehicle.efficiency", "vehicle.efficiency", "0.8", Seen),
    ("vehicle.exact.*", "vehicle.exact.all", "a test", Seen),
    ("vehicle.imu_arm_m", "vehicle.imu_arm_m", "0.1", Estimates),
    ("vehicle.layout", "vehicle.layout", "false", Estimates),
    (
        "vehicle.running_resistance",
        "vehicle.running_resistance",
        "0.05",
        Seen,
    ),
    ("vehicle.tare_kg", "vehicle.tare_kg", "7000", Estimates),
    (
        "vehicle.total_mass_guess_kg",
        "vehicle.total_mass_guess_kg",
        "30000",
        Estimates,
    ),
    (
        "vehicle.wheel_radius_m",
        "vehicle.wheel_radius_m",
        "0.16",
        Seen,
    ),
];

/// Keys that change neither, with the test or the page that has what they do.
const OTHERS: &[(&str, &str)] = &[
    ("availability", "judges"),
    (
        "car",
        "a road vehicle in place of the train: tests/laws/road_laws.rs",
    ),
    ("drive.controller.kind", "one kind of ours"),
    (
        "physics.plant.kind",
        "`physics.plant` with parameters: of a program's own",
    ),
    (
        "drive.controller.fmu",
        "interfaces/foreign/tests/foreign/controllers.rs",
    ),
    (
        "drive.controller.map",
        "interfaces/foreign/tests/foreign/controllers.rs",
    ),
    ("estimators", "parts: tests/laws/own_parts.rs"),
    ("expect", "judges"),
    ("integrity", "judges"),
    ("known_failures", "judges"),
    (
        "obstacles",
        "what is measured to them: tests/laws/events.rs",
    ),
    ("published", "shown beside the results"),
    ("record", "what is written, not what happens"),
    ("roadway", "what is measured to it: tests/laws/events.rs"),
    ("version", "of the file"),
    ("why", "text"),
];

/// Hashes of the motion and of the estimates of a drive of 8 s, and its number of steps.
fn drive(set: &[(&str, &str)]) -> [u64; 3] {
    let base = [
        ("stop.after_s", "8"),
        ("in_loop", "dffrls_aekf_robust"),
        ("load.mass_kg", "12000"),
        ("drive.controller.feedforward", "truth"),
        ("drive.speed", "[{at_s: 0, mps: 0}, {at_s: 3, mps: 1}]"),
        ("estimators", "{rail_fusion: {}, dffrls_aekf_robust: {}}"),
    ];
    let set: Vec<_> = base.iter().chain(set).copied().collect();
    let s = scenario("stress/whole_train", &set);
    let seed = s.file.seeds.as_slice()[0];
    let mut rig = Simulation::build(s, &Registry::default(), seed).expect("rig");
    let (mut motion, mut estimates, mut steps) = (DefaultHasher::new(), DefaultHasher::new(), 0);
    let mut text = String::new();
    let mut look = |f: &StepFrame<'_>| {
        let t = f.truth;
        let moved = [
            t.chainage_m,
            t.speed_mps,
            t.grade_effective_rad,
            t.total_mass_kg,
        ];
        moved.map(f64::to_bits).hash(&mut motion);
        text.clear();
        for e in f.estimators {
            let _ = write!(text, "{:?}", e.estimate);
        }
        text.hash(&mut estimates);
        steps += 1;
    };
    run(&mut rig, &mut [&mut look], &mut |_| true).expect("run");
    [motion.finish(), estimates.finish(), steps]
}

/// Further keys that are set in both drives where a key needs them.
const WITH: &[(&str, &[(&str, &str)])] = &[
    (
        "drive.every_s",
        &[(
            "drive.speed",
            "[{at_s: 0, mps: 0}, {at_s: 2, mps: 1}, {at_s: 4, mps: 0}]",
        )],
    ),
    (
        "in_loop",
        &[
            ("drive.controller.feedforward", "estimate"),
            ("stop.after_s", "30"),
        ],
    ),
];

#[test]
fn every_key_of_a_scenario_changes_what_it_is_about() {
    assert_eq!(drive(&[]), drive(&[]), "the same drive twice");
    let base = drive(&[]);
    let mut dead = Vec::new();
    for (key, set, value, changes) in KEYS {
        let with = WITH.iter().find(|w| w.0 == *key).map(|w| w.1);
        let before = with.map_or(base, drive);
        let now = drive(&[with.unwrap_or_default(), &[(*set, *value)]].concat());
        let [motion, estimates, steps] = [0, 1, 2].map(|i| before[i] != now[i]);
        let acts = match changes {
            Motion => motion,
            Estimates => estimates && !motion,
            Seen => estimates,
            Run => steps,
        };
        if !acts {
            dead.push(format!("{key}: {set} = {value}"));
        }
    }
    assert!(dead.is_empty(), "these do nothing: {dead:#?}");
}

#[test]
fn every_key_of_the_schema_is_tried() {
    let schema: Value =
        serde_json::from_str(include_str!("../../docs/schema/scenario.json")).expect("schema");
    let mut leaves = BTreeSet::new();
    gather(&schema, &schema, "", &mut leaves);
    assert!(leaves.len() > 60, "{leaves:?}");
    let tried: BTreeMap<_, _> = KEYS.iter().map(|k| (k.0, k.2)).collect();
    for leaf in &leaves {
        let excused = OTHERS.iter().any(|(key, _)| {
            leaf.strip_prefix(key)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        });
        let name = leaf.ends_with("[].name");
        assert!(
            excused || name || tried.contains_key(leaf.as_str()),
            "`{leaf}` is not tried"
        );
    }
    for key in tried.keys() {
        assert!(leaves.contains(*key), "the schema has no `{key}`");
    }
}

/// Paths of the leaves of a schema.
fn gather(root: &Value, node: &Value, path: &str, leaves: &mut BTreeSet<String>) {
    if let Some(place) = node["$ref"].as_str() {
        return gather(
            root,
            root.pointer(&place[1..]).expect("definition"),
            path,
            leaves,
        );
    }
    let alternatives = ["anyOf", "oneOf", "allOf"]
        .iter()
        .find_map(|key| node[key].as_array());
    if let Some(all) = alternatives {
        all.iter().for_each(|one| gather(root, one, path, leaves));
    } else if let Some(properties) = node["properties"].as_object() {
        for (key, value) in properties {
            let dot = if path.is_empty() { "" } else { "." };
            gather(root, value, &format!("{path}{dot}{key}"), leaves);
        }
    } else if node["items"].is_object() {
        gather(root, &node["items"], &format!("{path}[]"), leaves);
    } else if node["additionalProperties"].is_object() {
        gather(
            root,
            &node["additionalProperties"],
            &format!("{path}.*"),
            leaves,
        );
    } else if node["type"] != "null" {
        leaves.insert(path.to_owned());
    }
}
