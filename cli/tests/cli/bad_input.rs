//! Bad input: every case is a change to a good file or command line. The snapshots hold kind and place of each error,
//! and a few whole messages.
//!
//! None may panic, every one must end with code 2, and none may leave anything where results go. New snapshots are
//! taken with `INSTA_UPDATE=always cargo test --release -p monorig` and read before they are committed. Cases of
//! scenarios and the command line stand here; those of another kind of file go into a file beside this one, which uses
//! the same [`common::TestFolder`].

use crate::common::{GOOD, TestFolder, row};

/// A scenario with one change: name of the case, text to replace, replacement.
const CHANGED: &[(&str, &str, &str)] = &[
    ("version_missing", "version: 1\n", ""),
    ("version_other", "version: 1", "version: 2"),
    ("version_text", "version: 1", "version: one"),
    (
        "unknown_key",
        "load: {mass_kg: 2500}",
        "laod: {mass_kg: 2500}",
    ),
    ("unknown_key_inside", "mass_kg: 2500", "mas_kg: 2500"),
    ("missing_key", "track: track.yaml\n", ""),
    ("missing_key_inside", "{at_s: 4, mps: 1.0}", "{at_s: 4}"),
    ("wrong_type_text", "mass_kg: 2500", "mass_kg: heavy"),
    ("wrong_type_list", "mass_kg: 2500", "mass_kg: [2500]"),
    ("wrong_type_mapping", "load: {mass_kg: 2500}", "load: 2500"),
    ("number_in_quotes", "mass_kg: 2500", "mass_kg: '2500'"),
    ("yes_is_no_boolean", "hold: true", "hold: yes"),
    ("nothing_given", "stop: {after_s: 60}", "stop:"),
    ("negative_mass", "mass_kg: 2500", "mass_kg: -2500"),
    ("nan", "mass_kg: 2500", "mass_kg: .nan"),
    ("infinite", "mass_kg: 2500", "mass_kg: .inf"),
    ("huge", "mass_kg: 2500", "mass_kg: 2.5e300"),
    ("step_zero", "dt_ms: 2", "dt_ms: 0"),
    ("rate_zero", "rate_hz: 50", "rate_hz: 0"),
    ("rate_above_step", "rate_hz: 50", "rate_hz: 5000"),
    ("unknown_plant", "plant: rapier", "plant: rapir"),
    (
        "unknown_feedforward",
        "feedforward: estimate",
        "feedforward: guess",
    ),
    (
        "feedforward_without_estimator",
        "in_loop: dffrls_aekf_robust\n",
        "",
    ),
    (
        "in_loop_unknown",
        "in_loop: dffrls_aekf_robust",
        "in_loop: jekf",
    ),
    ("stop_without_end", "stop: {after_s: 60}", "stop: {}"),
    (
        "stop_behind_start",
        "stop: {after_s: 60}",
        "stop: {at_m: 20}",
    ),
    ("endless", "stop: {after_s: 60}", "stop: {after_s: 1.0e12}"),
    (
        "speed_empty",
        "speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1.0}]",
        "speed: []",
    ),
    (
        "speed_unsorted",
        "{at_s: 4, mps: 1.0}",
        "{at_s: 0, mps: 1.0}",
    ),
    ("speed_mixed", "{at_s: 4, mps: 1.0}", "{at_m: 4, mps: 1.0}"),
    (
        "speed_twice_placed",
        "{at_s: 4, mps: 1.0}",
        "{at_s: 4, at_m: 4, mps: 1.0}",
    ),
    ("speed_nowhere", "{at_s: 4, mps: 1.0}", "{mps: 1.0}"),
    (
        "event_that_is_none",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 30}",
    ),
    (
        "event_short_of_a_key",
        "{at_s: 30, load_mass_kg: 1500}",
        "{load_mass_kg: 1500}",
    ),
    (
        "event_twice",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 30, load_mass_kg: 1500, brake: 1}",
    ),
    (
        "event_with_a_stray_key",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 30, load_mass_kg: 1500, to_m: 9}",
    ),
    (
        "event_unknown_key",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 30, loadmass_kg: 1500}",
    ),
    (
        "event_never",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 90, load_mass_kg: 1500}",
    ),
    ("event_backwards", "to_m: 95", "to_m: 75"),
    ("fault_unknown", "fault: stuck", "fault: broken"),
    ("fault_without_size", "fault: stuck", "fault: drift"),
    (
        "brake_above_one",
        "{at_s: 30, load_mass_kg: 1500}",
        "{at_s: 30, brake: 1.5}",
    ),
    (
        "obstacle_of_two_edges",
        "size_m: [1, 1, 1]",
        "size_m: [1, 1]",
    ),
    (
        "obstacle_of_no_size",
        "size_m: [1, 1, 1]",
        "size_m: [1, 0, 1]",
    ),
    (
        "obstacle_in_the_train",
        "at_m: 50, left_m: 2, up_m: -1",
        "at_m: 24.5, left_m: 0.2, up_m: -0.6",
    ),
    ("seeds_backwards", "seeds: 1..10", "seeds: 10..1"),
    ("seeds_endless", "seeds: 1..10", "seeds: 1..999999999999"),
    ("seeds_twice", "seeds: 1..10", "seeds: [1, 2, 1]"),
    ("seeds_no_range", "seeds: 1..10", "seeds: a few"),
    ("parameter_is_text", "lambda0: 0.98", "lambda0: high"),
    ("parameters_are_a_number", "{lambda0: 0.98}", "0.98"),
    ("expect_without_bound", "at_most: 0.032", "quantile: 0.5"),
    (
        "expect_unknown_estimator",
        "{estimator: dffrls_aekf_robust,",
        "{estimator: imm_stf,",
    ),
    ("expect_after_the_end", "after_s: 10", "after_s: 100"),
    (
        "expect_empty_range",
        "at_most: 0.032",
        "at_most: 0.032, at_least: 1",
    ),
    ("track_not_there", "track: track.yaml", "track: trak.yaml"),
    ("sensors_is_a_folder", "sensors: sensors.yaml", "sensors: ."),
    (
        "train_in_no_folder",
        "train: train.yaml",
        "train: trains/train.yaml",
    ),
    ("key_twice", "version: 1\n", "version: 1\nversion: 1\n"),
    (
        "key_twice_inside",
        "mass_kg: 2500",
        "mass_kg: 2500, mass_kg: 2600",
    ),
    ("why_empty", "why: A sample.", "why: ''"),
    ("bracket_open", "mass_kg: 2500}", "mass_kg: 2500"),
    ("tab", "\n  controller:", "\n\tcontroller:"),
    ("two_documents", "why: A sample.", "---\nwhy: A sample."),
    ("anchor_of_nobody", "why: A sample.", "why: *sample"),
    ("tag", "mass_kg: 2500", "mass_kg: !heavy 2500"),
];

/// A command line on the good scenario.
const COMMANDS: &[(&str, &[&str])] = &[
    (
        "set_no_assignment",
        &["run", "scenario.yaml", "--set", "load.mass_kg"],
    ),
    (
        "set_unknown_key",
        &["run", "scenario.yaml", "--set", "load.mas_kg=5"],
    ),
    (
        "set_bad_value",
        &["run", "scenario.yaml", "--set", "load.mass_kg=-5"],
    ),
    (
        "set_bad_path",
        &["run", "scenario.yaml", "--set", "load..mass_kg=5"],
    ),
    (
        "set_bad_index",
        &["run", "scenario.yaml", "--set", "drive.speed[7].mps=5"],
    ),
    (
        "set_through_a_number",
        &["run", "scenario.yaml", "--set", "version.x=5"],
    ),
    (
        "set_bad_yaml",
        &["run", "scenario.yaml", "--set", "load={mass_kg: 5"],
    ),
    ("seed_negative", &["run", "scenario.yaml", "--seed=-1"]),
    (
        "plant_unknown",
        &["run", "scenario.yaml", "--plant", "adams"],
    ),
    (
        "live_without_rerun",
        &["run", "scenario.yaml", "--live", "--no-rerun"],
    ),
    ("no_such_option", &["run", "scenario.yaml", "--sed", "1"]),
    ("no_such_task", &["rum", "scenario.yaml"]),
    ("no_file", &["run"]),
    ("file_not_there", &["run", "scenaro.yaml"]),
    ("file_in_no_folder", &["run", "nowhere/scenario.yaml"]),
    ("file_is_a_folder", &["run", "."]),
    ("file_is_a_device", &["run", "/dev/zero"]),
    ("file_is_a_circle", &["run", "circle.yaml"]),
    ("file_empty", &["run", "empty.yaml"]),
    ("file_only_comments", &["run", "comments.yaml"]),
    ("file_not_text", &["run", "binary.yaml"]),
    ("file_is_a_list", &["run", "list.yaml"]),
    ("file_nested_deeply", &["run", "deep.yaml"]),
    ("file_repeats_itself", &["run", "laughs.yaml"]),
    (
        "out_is_a_file",
        &["run", "scenario.yaml", "--out", "track.yaml"],
    ),
    (
        "out_not_writable",
        &["run", "scenario.yaml", "--out", "/proc/monorig"],
    ),
    ("check_of_unknown_kind", &["check", "list.yaml", "odd.yaml"]),
    (
        "check_finds_all",
        &["check", "empty.yaml", "scenario.yaml", "scenaro.yaml"],
    ),
    ("schema_of_unknown_kind", &["schema", "scenari"]),
];

/// Cases whose whole messages are held, as users see them.
const TYPICAL: &[&str] = &[
    "unknown_key",
    "missing_key",
    "wrong_type_text",
    "negative_mass",
    "track_not_there",
    "tab",
    "unknown_plant",
    "in_loop_unknown",
    "set_bad_value",
    "seed_negative",
    "no_such_task",
    "plant_unknown",
    "file_not_there",
    "out_is_a_file",
    "check_finds_all",
];

/// Compares kind and place of all errors, and the whole messages of typical ones.
fn compare(name: &str, refused: &[(&str, String)]) {
    let rows: Vec<String> = refused.iter().map(|(case, told)| row(case, told)).collect();
    let snapshot = rows.join("\n");
    insta::assert_snapshot!(name, snapshot);
    let typical = refused.iter().filter(|(case, _)| TYPICAL.contains(case));
    let messages: Vec<String> = typical
        .map(|(case, told)| format!("{case}:\n{}", told.trim_end()))
        .collect();
    let snapshot = messages.join("\n\n");
    insta::assert_snapshot!(format!("{name}_messages"), snapshot);
}

#[test]
fn a_changed_scenario_is_refused_with_its_reason() {
    let mut refused = Vec::new();
    for (name, from, to) in CHANGED {
        assert_eq!(
            GOOD.matches(from).count(),
            1,
            "{name}: the change must hit exactly one place"
        );
        let dir = TestFolder::new();
        dir.write("scenario.yaml", GOOD.replace(from, to).as_bytes());
        refused.push((*name, dir.refused(&["run", "scenario.yaml"])));
    }
    compare("scenario", &refused);
}

#[test]
fn a_wrong_command_line_or_file_is_refused_with_its_reason() {
    let mut refused = Vec::new();
    for (name, arguments) in COMMANDS {
        let dir = TestFolder::new();
        dir.write("empty.yaml", b"");
        dir.write("comments.yaml", b"# nothing\n\n");
        dir.write("binary.yaml", b"version: 1\nwhy: \xff\xfe\n");
        dir.write("list.yaml", b"- 1\n- 2\n");
        dir.write("odd.yaml", b"colour: red\n");
        dir.write("deep.yaml", "[".repeat(5000).as_bytes());
        dir.write("laughs.yaml", laughs().as_bytes());
        dir.circle("circle.yaml");
        refused.push((*name, dir.refused(arguments)));
    }
    compare("command", &refused);
}

/// A list of lists of lists … by anchors: some hundred bytes that would fill the memory.
fn laughs() -> String {
    let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
    for i in 1..10 {
        let before = format!("*a{}, ", i - 1).repeat(10);
        text += &format!("a{i}: &a{i} [{}]\n", before.trim_end_matches(", "));
    }
    text
}

#[test]
fn the_good_scenario_is_good() {
    let dir = TestFolder::new();
    let (code, out, err) = dir.monorig(&["check", "scenario.yaml"]);
    assert_eq!(
        (code, out.as_str()),
        (Some(0), "scenario.yaml: scenario ok\n"),
        "{err}"
    );
}

#[test]
fn a_full_disk_under_standard_output_is_an_error_and_a_gone_reader_is_none() {
    let dir = TestFolder::new();
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .unwrap();
    let (code, _, err) = dir.monorig_to(&["schema", "scenario"], full.into());
    assert_eq!(code, Some(2), "{err}");
    assert!(err.contains("standard output"), "{err}");

    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let (code, _, err) = dir.monorig_to(&["schema", "scenario"], writer.into());
    assert_eq!((code, err.as_str()), (Some(0), ""));
}

#[test]
fn help_and_version_are_no_errors() {
    let dir = TestFolder::new();
    for arguments in [
        &["--help"][..],
        &["run", "--help"],
        &["check", "--help"],
        &["schema", "--help"],
        &["--version"],
        &["schema"],
    ] {
        let (code, out, err) = dir.monorig(arguments);
        assert_eq!((code, err.as_str()), (Some(0), ""), "{arguments:?}");
        assert!(!out.is_empty());
    }
    assert!(
        dir.monorig(&["help", "run"])
            .1
            .contains("monorig run scenarios/")
    );
}
