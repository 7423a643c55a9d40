//! Bad files under a good scenario: every case is a change to one of them. The snapshots hold kind and place of each
//! error.
//!
//! None may panic, every one must end with code 2, none may leave anything where results go, and `check` must find all
//! that `run` does. New snapshots: see `bad_input.rs`.

use crate::common::{TestFolder, row};

/// Case, text to replace, replacement. An empty text to replace means the whole file.
type Change = (&'static str, &'static str, &'static str);

#[rustfmt::skip] // a table
const SCENARIO: &[Change] = &[
    ("start_off_the_rear", "chainage_m: 25", "chainage_m: 0.1"),
    ("start_off_the_end", "chainage_m: 25", "chainage_m: 500"),
    ("stop_off_the_end", "stop: {after_s: 60}", "stop: {at_m: 500}"),
    ("load_over_the_rating", "load: {mass_kg: 2500}", "load: {mass_kg: 20000}"),
    ("event_load_over_the_rating", "load_mass_kg: 1500", "load_mass_kg: 20000"),
    ("sensor_faster_than_the_step", "dt_ms: 2, plant: rapier", "dt_ms: 4.5, plant: point-mass"),
    ("fault_on_an_unknown_sensor", "sensor: imu", "sensor: radar"),
    ("fault_on_an_absent_drive", "sensor: imu", "sensor: 'wheel_speed[3]'"),
    ("fault_on_a_sensor_not_fitted", "sensor: imu", "sensor: clamp_pressure"),
    ("zone_beyond_the_track", "from_m: 80, to_m: 95", "from_m: 800, to_m: 950"),
    ("zone_ends_beyond_the_track", "from_m: 80, to_m: 95", "from_m: 80, to_m: 950"),
    ("obstacle_beyond_the_track", "{at_m: 50, left_m", "{at_m: 5000, left_m"),
    ("unknown_estimator", "dffrls_aekf_robust: {lambda0: 0.98}", "dffrls_aekf_robust: {}\n  jekf: {}"),
    ("unknown_parameter", "lambda0: 0.98", "lamda0: 0.98"),
    ("parameter_out_of_range", "lambda0: 0.98", "lambda0: 1.98"),
    ("unknown_metric", "metric: mass_error_rel_max", "metric: mass_error_max"),
    ("metric_like_no_other", "metric: mass_error_rel_max", "metric: beauty"),
    ("metric_of_an_estimator", "estimator: dffrls_aekf_robust, metric", "metric"),
    ("metric_of_the_train", "metric: mass_error_rel_max", "metric: speed_rmse_mps"),
    ("track_is_a_train", "track: track.yaml", "track: train.yaml"),
    ("train_is_a_unit", "train: train.yaml", "train: units/drive_unit.yaml"),
    ("track_is_a_drawing", "track: track.yaml", "track: units/meshes/cab_shell.stl"),
];

#[rustfmt::skip] // a table
const TRACK: &[Change] = &[
    ("empty", "", ""),
    ("version", "version: 1", "version: 2"),
    ("version_text", "version: 1", "version: one"),
    ("unknown_key", "horizontal:", "horizontel:"),
    ("no_elements", "", "version: 1\nname: x\nprofile: rails/i140e.yaml\n"),
    ("radius_under_the_minimum", "radius_m: 10", "radius_m: 3"),
    ("clothoid_under_the_minimum", "to_radius_m: -20", "to_radius_m: -2"),
    ("vertical_radius_under_the_minimum", "radius_m: 20", "radius_m: 7"),
    ("slope_over_the_maximum", "to_grade_deg: 8", "to_grade_deg: 35"),
    ("slope_of_a_wall", "to_grade_deg: 8", "to_grade_deg: 85"),
    (
        "shorter_than_the_train",
        "",
        "version: 1\nname: x\nprofile: rails/i140e.yaml\nhorizontal: [{kind: line, length_m: 0.5}]\n",
    ),
    ("grades_do_not_join", "{kind: grade, length_m: 50}", "{kind: grade, grade_deg: 7, length_m: 50}"),
    ("grade_reached_already", "to_grade_deg: 8", "to_grade_deg: 0"),
    ("length_zero", "length_m: 40", "length_m: 0"),
    ("length_negative", "length_m: 40", "length_m: -40"),
    ("length_tiny", "length_m: 40", "length_m: 1.0e-9"),
    ("length_nan", "length_m: 40", "length_m: .nan"),
    ("length_huge", "length_m: 40", "length_m: 1.0e+9"),
    ("length_missing", "{kind: line, length_m: 40}", "{kind: line}"),
    ("radius_zero", "radius_m: 10", "radius_m: 0"),
    ("radius_and_length", "radius_m: 10", "radius_m: 10, length_m: 10"),
    ("neither_radius_nor_length", "radius_m: 10, ", ""),
    ("angle_zero", "angle_deg: 90", "angle_deg: 0"),
    ("angle_missing", "angle_deg: 90, ", ""),
    ("easement_too_long", "easement_m: 2", "easement_m: 200"),
    ("to_radius_zero", "to_radius_m: -20", "to_radius_m: 0"),
    ("key_of_another_kind", "{kind: line, length_m: 40}", "{kind: line, length_m: 40, angle_deg: 3}"),
    ("kind_unknown", "kind: clothoid", "kind: spiral"),
    ("repeat_never", "times: 2", "times: 0"),
    ("repeat_endless", "times: 2", "times: 100000"),
    ("repeat_negative", "times: 2", "times: -2"),
    ("repeat_nothing", "elements: [{kind: line, length_m: 10}]", "elements: []"),
    ("wrong_inside_a_repeat", "[{kind: line, length_m: 10}]", "[{kind: line, length_m: 0}]"),
    ("joints_too_dense", "every_m: 3", "every_m: 0.001"),
    ("joint_kink_too_large", "kink_deg: 0.1", "kink_deg: 10"),
    ("joint_step_too_large", "step_m: 0}", "step_m: 0.5}"),
    ("profile_not_there", "rails/i140e.yaml", "rails/i140.yaml"),
    ("profile_in_no_folder", "rails/i140e.yaml", "rail/i140e.yaml"),
    ("profile_is_a_folder", "rails/i140e.yaml", "rails"),
    ("profile_is_a_track", "rails/i140e.yaml", "track.yaml"),
    ("survey_as_well", "joints:", "survey: {file: survey.csv, height_noise_m: 0.01}\njoints:"),
];

#[rustfmt::skip] // a table
const SURVEYED: &[Change] = &[
    ("file_not_there", "survey.csv", "surveys.csv"),
    ("file_is_a_folder", "survey.csv", "units"),
    ("noise_negative", "height_noise_m: 0.003", "height_noise_m: -0.003"),
    ("noise_nan", "height_noise_m: 0.003", "height_noise_m: .nan"),
    ("noise_missing", ", height_noise_m: 0.003", ""),
];

#[rustfmt::skip] // a table
const SURVEY: &[Change] = &[
    ("empty", "", ""),
    ("column_missing", "s_m,height_m", "s_m"),
    ("column_named_otherwise", "s_m,height_m", "chainage,height"),
    ("title_missing", "s_m,height_m\n", ""),
    ("not_sorted", "60,0.9", "30,0.9"),
    ("same_place_twice", "60,0.9", "40,0.9"),
    ("not_a_number", "60,0.9", "60,NaN"),
    ("a_word", "60,0.9", "60,high"),
    ("a_gap", "60,0.9", "60,"),
    ("a_value_missing", "60,0.9", "60"),
    ("a_value_too_many", "60,0.9", "60,0.9,1"),
    ("decimal_commas", "60,0.9", "60,0,9"),
    ("a_cliff", "60,0.9", "60,90"),
    ("too_steep", "60,0.9", "60,16"),
    ("too_steep_for_the_train", "60,0.9", "60,8"),
    ("too_few_points", "", "s_m,height_m\n0,0\n60,0\n120,0\n"),
    ("too_long", "140,1.0", "1.0e+7,1.0"),
];

#[rustfmt::skip] // a table
const PROFILE: &[Change] = &[
    ("version", "version: 1", "version: 3"),
    ("in_millimetres", "height_m: 0.155", "height_m: 155"),
    ("height_zero", "height_m: 0.155", "height_m: 0"),
    ("height_negative", "height_m: 0.155", "height_m: -0.155"),
    ("web_too_thick", "web_m: 0.007", "web_m: 0.07"),
    ("tips_thicker_than_roots", "flange_tip_m: 0.0125", "flange_tip_m: 0.0225"),
    ("no_web_left", "flange_root_m: 0.0165", "flange_root_m: 0.0865"),
    ("key_missing", "web_m: 0.007\n", ""),
    ("unknown_key", "web_m: 0.007", "wep_m: 0.007"),
];

#[rustfmt::skip] // a table
const TRAIN: &[Change] = &[
    ("version", "version: 1", "version: 2"),
    ("unknown_key", "drawbar:", "drawbars:"),
    ("unit_not_there", "units/drive_unit.yaml", "units/drive-unit.yaml"),
    ("unit_is_a_urdf", "units/drive_unit.yaml", "units/drive_unit.urdf"),
    ("unit_is_a_load", "units/drive_unit.yaml", "units/load_block.yaml"),
    ("no_units", "  - {name: drive_1, unit: units/drive_unit.yaml}\n", "  []\n"),
    ("unit_without_length", "units/drive_unit.yaml", "units/carrier_trolley.yaml"),
    ("no_drives", "", NO_DRIVES),
    (
        "duplicate_names",
        "  - {name: drive_1, unit: units/drive_unit.yaml}\n",
        "  - {name: drive_1, unit: units/drive_unit.yaml}\n  - {name: drive_1, unit: units/drive_unit.yaml}\n",
    ),
    ("load_named_as_a_unit", "{name: load,", "{name: drive_1,"),
    ("name_with_a_slash", "{name: drive_1,", "{name: drive/1,"),
    ("name_empty", "{name: drive_1,", "{name: '',"),
    ("load_over_the_rating", "max_load_kg: 2500", "max_load_kg: 1000"),
    ("load_under_nobody", "under: drive_1", "under: drive_2"),
    ("load_is_no_load", "units/load_block.yaml", "units/cab.yaml"),
    ("load_not_there", "units/load_block.yaml", "units/load_blok.yaml"),
    ("drawbar_without_stiffness", "stiffness_npm: 5.0e+6", "stiffness_npm: 0"),
    ("damping_negative", "damping_nspm: 2.0e+4", "damping_nspm: -2"),
    ("damping_nan", "damping_nspm: 2.0e+4", "damping_nspm: .nan"),
    ("radius_limit_negative", "min_radius_horizontal_m: 4", "min_radius_horizontal_m: -4"),
    ("grade_limit_of_a_hoist", "max_grade_deg: 30", "max_grade_deg: 90"),
    ("faster_than_its_motors", "max_speed_mps: 2.4", "max_speed_mps: 24"),
    ("torque_over_the_gear", "torque_max_nm: 160", "torque_max_nm: 1600"),
    ("resistance_negative", "running_wheel: 0.4", "running_wheel: -0.4"),
    ("limits_missing", "max_grade_deg: 30, ", ""),
];

const NO_DRIVES: &str = "\
version: 1
name: cabs
consist: [{name: cab_1, unit: units/cab.yaml}, {name: cab_2, unit: units/cab.yaml}]
drawbar: {stiffness_npm: 5.0e+6, damping_nspm: 2.0e+4}
limits: {min_radius_horizontal_m: 4, min_radius_vertical_m: 8, max_grade_deg: 30, max_speed_mps: 2.4, max_load_kg: 2500}
resistance: {clamped_wheel: 0, running_wheel: 0.4, guide_wheel: 0, bearing_n: 0, bearing_nspm: 0, air_nspm2: 0}
";

#[rustfmt::skip] // a table
const DRIVE_UNIT: &[Change] = &[
    ("version", "version: 1", "version: 2"),
    ("urdf_not_there", "urdf: drive_unit.urdf", "urdf: drive.urdf"),
    ("urdf_is_yaml", "urdf: drive_unit.urdf", "urdf: drive_unit.yaml"),
    ("stiffness_too_high", "wheel_stiffness_npm: 1.0e+7", "wheel_stiffness_npm: 1.0e+11"),
    ("stiffness_huge", "wheel_stiffness_npm: 1.0e+7", "wheel_stiffness_npm: 1.0e+20"),
    ("stiffness_negative", "wheel_stiffness_npm: 1.0e+7", "wheel_stiffness_npm: -1"),
    ("efficiency_above_one", "efficiency_drive: 0.95", "efficiency_drive: 95"),
    ("efficiency_zero", "efficiency_brake: 0.95", "efficiency_brake: 0"),
    ("length_missing", "length_m: 1.1\n", ""),
    ("faster_than_its_wheels", "speed_max_rpm: 2600", "speed_max_rpm: 26000"),
    ("key_missing", "kappa_1pm: 5", ""),
    (
        "unknown_link",
        "length_m: 1.1\n",
        "length_m: 1.1\nconnections: [{kind: hanger, from: frame, to: fram, stiffness_npm: 1, damping_nspm: 1}]\n",
    ),
    (
        "without_running_gear",
        "running_gear:",
        "carried_by: {trolley: carrier_trolley.yaml, links: [hook_1, hook_3], stiffness_npm: 1, damping_nspm: 1}\nrunning_gear:",
    ),
];

#[rustfmt::skip] // a table
const LOAD: &[Change] = &[
    ("payload_unknown", "payload_link: payload", "payload_link: paylod"),
    ("payload_without_mass", "payload_link: payload", "payload_link: hook_1"),
    ("chain_to_nowhere", "hook_4]", "hook_9]"),
    ("chain_from_nowhere", "hook_4]", "payload]"),
    ("no_chains", "[hook_1, hook_2, hook_3, hook_4]", "[]"),
    ("drop_zero", "drop_m: 0.6", "drop_m: 0"),
];

#[rustfmt::skip] // a table
const DRIVE_URDF: &[Change] = &[
    ("empty", "", ""),
    ("another_xml", "", "<html><body/></html>"),
    ("broken_xml", "<link name=\"motor\">", "<link name=\"motor\""),
    ("closed_otherwise", "</robot>", "</robots>"),
    ("deeply_nested", "</robot>", "<a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a><a></robot>"),
    (
        "without_inertia",
        "<inertia ixx=\"0.7679\" ixy=\"0\" ixz=\"0\" iyy=\"0.7679\" iyz=\"0\" izz=\"0.2025\"/>",
        "",
    ),
    (
        "without_inertial",
        "    <inertial>\n      <origin xyz=\"0 0 0\" rpy=\"0 1.5708 0\"/>\n      <mass value=\"50\"/>\n      <inertia ixx=\"0.7679\" ixy=\"0\" ixz=\"0\" iyy=\"0.7679\" iyz=\"0\" izz=\"0.2025\"/>\n    </inertial>\n",
        "",
    ),
    ("mass_negative", "<mass value=\"226\"/>", "<mass value=\"-226\"/>"),
    ("mass_zero", "<mass value=\"226\"/>", "<mass value=\"0\"/>"),
    ("mass_nan", "<mass value=\"226\"/>", "<mass value=\"NaN\"/>"),
    ("mass_huge", "<mass value=\"226\"/>", "<mass value=\"1e20\"/>"),
    ("mass_a_word", "<mass value=\"226\"/>", "<mass value=\"heavy\"/>"),
    ("inertia_of_no_body", "ixx=\"5.462\"", "ixx=\"54.62\""),
    (
        "cyclic",
        "</robot>",
        "<joint name=\"ring\" type=\"fixed\"><parent link=\"imu_link\"/><child link=\"frame\"/></joint></robot>",
    ),
    (
        "cycle_beside_the_root",
        "</robot>",
        "<link name=\"a\"/><link name=\"b\"/><joint name=\"ab\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></joint><joint name=\"ba\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>",
    ),
    ("two_roots", "</robot>", "<link name=\"stray\"/></robot>"),
    ("two_parents", "<parent link=\"frame\"/><child link=\"hook_2\"/>", "<parent link=\"frame\"/><child link=\"hook_1\"/>"),
    ("child_unknown", "<child link=\"imu_link\"/>", "<child link=\"imu\"/>"),
    ("link_twice", "<link name=\"hook_2\"/>", "<link name=\"hook_1\"/>"),
    ("joint_of_a_kind_unknown_here", "<joint name=\"imu_link_joint\" type=\"fixed\">", "<joint name=\"imu_link_joint\" type=\"planar\">"),
    ("joint_of_no_kind", "<joint name=\"imu_link_joint\" type=\"fixed\">", "<joint name=\"imu_link_joint\" type=\"glued\">"),
    ("mesh_not_there", "filename=\"meshes/clamp_arm.stl\"/>", "filename=\"meshes/clamp.stl\"/>"),
    ("mesh_of_another_kind", "filename=\"meshes/clamp_arm.stl\"/>", "filename=\"meshes/clamp_arm.obj\"/>"),
    ("mesh_is_no_mesh", "filename=\"meshes/clamp_arm.stl\"/>", "filename=\"../notes.stl\"/>"),
    ("size_negative", "size=\"0.8 0.5 0.2\"/></geometry><material", "size=\"0.8 -0.5 0.2\"/></geometry><material"),
    ("one_wheel_missing", "<joint name=\"friction_axle_right\" type=\"continuous\">", "<joint name=\"friction_axle_right\" type=\"fixed\">"),
    ("wheels_no_pair", "<origin xyz=\"0 -0.02 0.16\"/>\n    <axis", "<origin xyz=\"0 -0.03 0.16\"/>\n    <axis"),
    ("coupling_missing", "<link name=\"coupling_front\"/>", "<link name=\"coupler_front\"/>"),
    ("floats_away", "<joint name=\"motor_joint\" type=\"fixed\">", "<joint name=\"motor_joint\" type=\"floating\">"),
    ("origin_infinite", "<origin xyz=\"0 0.43 -0.22\"/>", "<origin xyz=\"0 inf -0.22\"/>"),
];

#[rustfmt::skip] // a table
const SENSORS: &[Change] = &[
    ("version", "version: 1", "version: 2"),
    ("no_instrument", "", "version: 1\nsource: none\n"),
    ("unknown_instrument", "wheel_speed:", "wheelspeed:"),
    ("rate_zero", "rate_hz: 200", "rate_hz: 0"),
    ("rate_negative", "rate_hz: 200", "rate_hz: -200"),
    ("rate_above_the_step_rate", "rate_hz: 200", "rate_hz: 2000"),
    ("rate_missing", "sampling: {rate_hz: 200}", "sampling: {}"),
    ("mount_not_there", "mount: drive_1/imu_link", "mount: drive_2/imu_link"),
    ("mount_misspelt", "mount: imu_link", "mount: imu"),
    ("noise_negative", "noise_density: 0.001", "noise_density: -0.001"),
    ("noise_nan", "noise_density: 0.001", "noise_density: .nan"),
    ("noise_huge", "noise_density: 0.001", "noise_density: 1.0e+300"),
    ("range_backwards", "range: [-50, 50]", "range: [50, -50]"),
    ("range_of_one", "range: [-50, 50]", "range: [50]"),
    ("linearity_of_nothing", "errors: {noise_sd: 0.005}", "errors: {linearity: 0.01}"),
    ("jitter_too_large", "jitter_ms: 1", "jitter_ms: 10"),
    ("latency_endless", "latency_ms: 5", "latency_ms: 1.0e+6"),
    ("dropout_above_one", "dropout: 0.01", "dropout: 10"),
    ("misalignment_too_large", "misalignment_sd_deg: 0.5", "misalignment_sd_deg: 45"),
];

/// Each file with its changes, and what is set on the scenario so that the file is in use.
#[rustfmt::skip] // a table
const FILES: &[(&str, &[Change], Option<&str>)] = &[
    ("scenario.yaml", SCENARIO, None),
    ("track.yaml", TRACK, None),
    ("surveyed.yaml", SURVEYED, Some("surveyed.yaml")),
    ("survey.csv", SURVEY, Some("surveyed.yaml")),
    ("rails/i140e.yaml", PROFILE, None),
    ("train.yaml", TRAIN, None),
    ("units/drive_unit.yaml", DRIVE_UNIT, None),
    ("units/load_block.yaml", LOAD, None),
    ("units/drive_unit.urdf", DRIVE_URDF, None),
    ("sensors.yaml", SENSORS, None),
];

#[test]
fn a_changed_file_is_refused_with_its_reason_by_run_and_check() {
    let mut rows = Vec::new();
    for (file, changes, track) in FILES {
        for (case, from, to) in *changes {
            let dir = TestFolder::new();
            dir.write("notes.stl", b"not a mesh");
            if let Some(track) = track {
                let scenario = dir.read("scenario.yaml");
                let other = scenario.replace("track: track.yaml", &format!("track: {track}"));
                dir.write("scenario.yaml", other.as_bytes());
            }
            let good = dir.read(file);
            let bad = match *from {
                "" => (*to).to_owned(),
                from => {
                    let hits = good.matches(from).count();
                    assert_eq!(
                        hits, 1,
                        "{file} {case}: the change must hit exactly one place"
                    );
                    good.replace(from, to)
                }
            };
            dir.write(file, bad.as_bytes());
            let told = dir.refused(&["run", "scenario.yaml"]);
            let name = file.replace(['/', '.'], "_").replace("_yaml", "");
            rows.push(row(&format!("{name}__{case}"), &told));
            let checked = dir.refused(&["check", "scenario.yaml"]);
            assert!(
                checked.starts_with(&told),
                "{file} {case}: check said\n{checked}run said\n{told}"
            );
        }
    }
    let snapshot = rows.join("\n");
    insta::assert_snapshot!("files", snapshot);
}

/// A file named by another one that cannot be read at all.
#[test]
fn an_unreadable_file_below_the_scenario_is_refused() {
    let mut rows = Vec::new();
    for file in [
        "track.yaml",
        "train.yaml",
        "sensors.yaml",
        "rails/i140e.yaml",
        "units/drive_unit.urdf",
        "survey.csv",
    ] {
        for (case, bytes) in [
            ("not_text", Some(&b"a: \xff\xfe\n"[..])),
            ("empty", Some(&b""[..])),
            ("circle", None),
        ] {
            let dir = TestFolder::new();
            if file == "survey.csv" {
                let scenario = dir.read("scenario.yaml");
                dir.write(
                    "scenario.yaml",
                    scenario
                        .replace("track: track.yaml", "track: surveyed.yaml")
                        .as_bytes(),
                );
            }
            match bytes {
                Some(bytes) => dir.write(file, bytes),
                None => {
                    std::fs::remove_file(dir.path(file)).unwrap();
                    dir.circle(file);
                }
            }
            let told = dir.refused(&["run", "scenario.yaml"]);
            let name = file.rsplit('/').next().unwrap().replace('.', "_");
            rows.push(row(&format!("{name}__{case}"), &told));
        }
    }
    let snapshot = rows.join("\n");
    insta::assert_snapshot!("unreadable", snapshot);
}
