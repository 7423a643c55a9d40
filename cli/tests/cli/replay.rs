//! Recorded logs: `inspect`, `replay`, its checks and its results.

use crate::common::{TestFolder, project, words};

const HUSKY: &str = "tests/data/real/husky/husky.map.yaml";
const TRAIN: &str = "tests/data/real/train_standstill/train_standstill.map.yaml";

fn of_project(file: &str) -> String {
    project().join(file).display().to_string()
}

#[test]
fn a_log_leaves_what_a_run_leaves() {
    let dir = TestFolder::new();
    let map = of_project(HUSKY);
    let (code, out, err) = dir.monorig(&[
        "replay",
        "--map",
        &map,
        "--estimators",
        "ekf_v_theta_biases",
        "--no-rerun",
        "--out",
        "a",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(
        out.contains("ekf_v_theta_biases") && out.contains("times real time"),
        "{out}"
    );
    for name in ["manifest.json", "channels.parquet", "metrics.json"] {
        assert!(dir.path("a/husky/1").join(name).is_file(), "{name}");
    }
    let metrics = std::fs::read_to_string(dir.path("a/husky/1/metrics.json")).unwrap();
    let metrics: serde_json::Value = serde_json::from_str(&metrics).unwrap();
    let of = |name: &str| &metrics["estimators"]["ekf_v_theta_biases"][name];
    assert!(of("slope_rmse_deg").is_number() && of("slope_nees_mean").is_number());
    assert!(of("mass_rmse_kg").is_null(), "no mass is known of it");
    let manifest = std::fs::read_to_string(dir.path("a/husky/1/manifest.json")).unwrap();
    assert!(manifest.contains("imu_flooring_03.csv") && manifest.contains("\"channels\""));
    let (code, out, err) = dir.monorig(&[
        "check",
        "a/husky/1/channels.parquet",
        "a/husky/1/manifest.json",
        "a/husky/1/metrics.json",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let (code, out, err) = dir.monorig(&["report", "a/husky/1"]);
    assert_eq!(code, Some(0), "{out}{err}");
    // the same log, the same bits
    let (code, ..) = dir.monorig(&[
        "replay",
        "--map",
        &map,
        "--estimators",
        "ekf_v_theta_biases",
        "--no-rerun",
        "--out",
        "b",
    ]);
    assert_eq!(code, Some(0));
    for name in ["manifest.json", "channels.parquet", "metrics.json"] {
        let of = |folder: &str| std::fs::read(dir.path(folder).join("husky/1").join(name)).unwrap();
        assert!(of("a") == of("b"), "{name} differs");
    }
}

#[test]
fn a_log_is_a_regression_test() {
    let dir = TestFolder::new();
    let map = std::fs::read_to_string(of_project(TRAIN)).unwrap();
    let expect = "expect: [{estimator: attitude, metric: nis_mean, after_s: 0.5, at_least: 1000, availability: 0.01}]\n";
    std::fs::write(dir.path("train.map.yaml"), map + expect).unwrap();
    let folder = of_project("tests/data/real/train_standstill");
    let task = [
        "replay",
        &folder,
        "--map",
        "train.map.yaml",
        "--no-rerun",
        "--junit",
        "junit.xml",
    ];
    let (code, out, err) = dir.monorig(&task);
    assert_eq!(code, Some(1), "{out}{err}");
    let junit = std::fs::read_to_string(dir.path("junit.xml")).unwrap();
    assert!(
        junit.contains("<failure") && junit.contains("nis_mean"),
        "{junit}"
    );
}

#[test]
fn checks_and_mistakes_have_their_exit_codes() {
    let dir = TestFolder::new();
    let map = of_project(HUSKY);
    let (code, out, err) = dir.monorig(&["replay", "--map", &map, "--check"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(
        out.contains("|f|") && out.contains("found nothing wrong"),
        "{out}"
    );
    let in_g = "channels.specific_force.unit=g";
    let (code, out, err) = dir.monorig(&["replay", "--map", &map, "--check", "--set", in_g]);
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(out.contains("BAD"), "{out}");
    let told = dir.refused(&[
        "replay",
        "--map",
        &map,
        "--set",
        "channels.specific_force.unit=Nm",
    ]);
    assert!(told.contains("is not a unit of an acceleration"), "{told}");
    let told = dir.refused(&["replay", "--map", &map, "--estimators", "rail_fusoin"]);
    assert!(told.contains("rail_fusion"), "{told}");
    let told = dir.refused(&["replay", "nowhere", "--map", &map]);
    assert!(told.contains("names 2 files"), "{told}");
}

#[test]
fn a_log_is_inspected() {
    let dir = TestFolder::new();
    let log = of_project("tests/data/real/husky/imu_flooring_03.csv");
    let (code, out, err) = dir.monorig(&["inspect", &log]);
    assert_eq!(code, Some(0), "{err}");
    for words in [
        "5001 rows over 50.000 s, 100.0 Hz",
        "columns: [ax, ay, az], unit: m/s2",
        "columns: [wx, wy, wz], unit: rad/s",
    ] {
        assert!(out.contains(words), "{words} in\n{out}");
    }
    let bus = of_project("interfaces/logs/tests/data/can.log");
    assert!(dir.refused(&["inspect", &bus]).contains("--dbc"));
    let (code, out, _) = dir.monorig(&[
        "inspect",
        &bus,
        "--dbc",
        &of_project("interfaces/logs/tests/data/crane.dbc"),
    ]);
    assert!(
        code == Some(0) && out.contains("IMU_ACC: 200 rows"),
        "{out}"
    );
}

/// A map is a kind of file that `check` knows.
#[test]
fn a_map_is_checked() {
    let dir = TestFolder::new();
    let map = of_project(HUSKY);
    let (code, out, err) = dir.monorig(&["check", &map]);
    assert_eq!((code, out), (Some(0), format!("{map}: map ok\n")), "{err}");
}

/// `rail_fusion` has no drag in its force balance: a road vehicle is refused, whether it is told by its drag or by the
/// file of a car, with what to take in its place.
#[test]
fn rail_fusion_is_refused_for_a_road_vehicle() {
    let dir = TestFolder::new();
    let map = of_project("examples/car_drive/drive.map.yaml");
    let replay = [
        "replay",
        "--map",
        &map,
        "--estimators",
        "rail_fusion",
        "--no-rerun",
    ];
    let car = format!("vehicle={}", of_project("assets/road/hongqi_ehs3.yaml"));
    for sets in [&[][..], &["--set", "nominal={}", "--set", &car]] {
        let told = words(&dir.refused(&[&replay[..], sets].concat()));
        for part in [
            "rail_fusion",
            "made for a rail",
            "road vehicle",
            "`attitude`",
        ] {
            assert!(told.contains(part), "{part} in\n{told}");
        }
    }
    // without drag it is a vehicle on a rail
    let rail = ["--set", "nominal.drag_area_m2=null", "--out", "rail"];
    let (code, out, err) = dir.monorig(&[&replay[..], &rail[..]].concat());
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
}

/// A part of a log is judged from 5 s after its start: `calibrate --split` and a replay of that part agree.
#[test]
fn a_part_of_a_log_has_one_error() {
    let dir = TestFolder::new();
    let map = of_project("examples/car_drive/drive.map.yaml");
    let split = [
        "calibrate",
        "--map",
        &map,
        "--known",
        "mass,slope",
        "--split",
        "75",
    ];
    let (code, out, err) = dir.monorig(&split);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("from 80 s on"), "{out}");
    let part = [
        "replay",
        "--map",
        &map,
        "--set",
        "trim.from_s=75",
        "--no-rerun",
        "-v",
    ];
    let (code, replayed, err) = dir.monorig(&part);
    assert!(matches!(code, Some(0 | 1)), "{replayed}{err}");
    assert!(replayed.contains("from 80 s on"), "{replayed}");
    // behind the name of an estimator, the first row with this title: its first number
    let error = |text: &str, title: &str| {
        let lines = text
            .lines()
            .skip_while(|l| l.trim() != "ekf_v_theta_biases");
        let row = lines.map(words).find(|l| l.starts_with(title)).unwrap();
        let number = row.strip_prefix(title).unwrap().split_whitespace().next();
        number.unwrap().to_owned()
    };
    assert_eq!(error(&out, "before"), error(&replayed, "slope °"));
}
