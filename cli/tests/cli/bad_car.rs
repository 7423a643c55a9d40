//! A car on a road: what is refused, and with which reason. Each case is a change to a good scenario or to a file it
//! names.

use crate::common::{TestFolder, project};

const SCENARIO: &str = "\
version: 1
why: A car.
track: road.yaml
car: road/hongqi_ehs3.yaml
sensors: car_sensors.yaml
stop: {after_s: 3}
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 2, mps: 2}]}
estimators: {dffrls_aekf_robust: {}}
integrity: {max_misleading_share: 1}
";

const ROAD: &str = "\
version: 1
name: road
road_width_m: 3.75
horizontal: [{kind: line, length_m: 20}, {kind: arc, radius_m: 40, angle_deg: 60}]
vertical: [{kind: grade, length_m: 20}, {kind: transition, to_grade_deg: 5, length_m: 20}]
";

const SENSORS: &str = "\
version: 1
source: A sample.
accelerometer: {mount: imu_link, sampling: {rate_hz: 100}}
wheel_speed: {sampling: {rate_hz: 100}}
motor_torque: {sampling: {rate_hz: 100}}
steering_angle: {sampling: {rate_hz: 100}, errors: {noise_sd: 0.001}}
";

/// File, text to replace, replacement, and what monorig must say.
#[rustfmt::skip] // a table
const CASES: &[(&str, &str, &str, &[&str])] = &[
    ("car.yaml", "car: road", "train: train.yaml\ncar: road", &["car.yaml:5:6: car:", "keep one of them"]),
    ("car.yaml", "car: road/hongqi_ehs3.yaml\n", "", &["this scenario has no vehicle", "`car: "]),
    ("car.yaml", "hongqi_ehs3", "hongqi_ehs9", &["car.yaml:4:6: car:", "hongqi_ehs3"]),
    ("car.yaml", "track: road.yaml", "track: track.yaml", &["car.yaml:3:8: track:", "road_width_m"]),
    ("car.yaml", "car: road/hongqi_ehs3.yaml", "train: train.yaml", &["track:", "`profile`"]),
    ("car.yaml", "stop:", "physics: {plant: rapier}\nstop:", &["physics.plant", "trains, not cars"]),
    ("car.yaml", "stop:", "load: {mass_kg: 100}\nstop:", &["load.mass_kg", "only a train has this"]),
    ("car.yaml", "stop:", "roadway: {width_m: 4, above_m: 1, below_m: 1}\nstop:", &["roadway", "only a train has this"]),
    ("car.yaml", "stop:", "events: [{at_s: 1, clamp_mpa: 5}]\nstop:", &["events[0].clamp_mpa", "only to a train"]),
    ("car.yaml", "stop:", "start: {speed_mps: -1}\nstop:", &["start.speed_mps", "backwards"]),
    ("car.yaml", "mps: 2}", "mps: -2}", &["drive.speed[1].mps", "backwards"]),
    ("car.yaml", "stop:", "events: [{from_s: 1, sensor: gyro, fault: off}]\nstop:", &["events[0].sensor", "steering_angle"]),
    ("road.yaml", "road_width_m: 3.75", "road_width_m: 3.75\nprofile: rails/i140e.yaml", &["road.yaml:3:15: road_width_m:", "keep `profile`"]),
    ("road.yaml", "road_width_m: 3.75\n", "", &["neither a rail nor a road"]),
    ("road.yaml", "road_width_m: 3.75", "road_width_m: 0", &["road.yaml:3:15", "above zero"]),
    ("road.yaml", "radius_m: 40", "radius_m: 4", &["horizontal[1].radius_m", "at least 6"]),
    ("road.yaml", "to_grade_deg: 5", "to_grade_deg: 25", &["vertical[1].to_grade_deg", "at most 20"]),
    ("car_sensors.yaml", "steering_angle", "clamp_pressure", &["a car has no clamps"]),
    ("car_sensors.yaml", "noise_sd: 0.001", "noise_sd: -1", &["steering_angle.errors.noise_sd"]),
    ("road/hongqi_ehs3.yaml", "mass_kg: 2170", "mass_kg: -2170", &["hongqi_ehs3.yaml", "body.mass_kg", "above zero"]),
    ("road/hongqi_ehs3.yaml", "gravity_height_m: 0.58", "gravity_height_m: 1.2", &["body.gravity_height_m", "tips over"]),
    ("road/hongqi_ehs3.yaml", "track_width_m: 1.60", "track_width_m: 2.60", &["wheels.track_width_m", "at most the width"]),
    ("road/hongqi_ehs3.yaml", "size_m: [4.49", "size_m: [2.49", &["body.size_m[0]", "the axles are 2.75 m apart"]),
    ("road/hongqi_ehs3.yaml", "efficiency: 0.97", "efficiency: 0", &["motors.efficiency", "transmits no power"]),
    ("road/hongqi_ehs3.yaml", "efficiency: 0.97", "efficiency: 1.2", &["motors.efficiency", "from 0 to 1"]),
    ("road/hongqi_ehs3.yaml", "steering_max_deg: 35", "steering_max_deg: 95", &["wheels.steering_max_deg", "at most 60"]),
    ("road/hongqi_ehs3.yaml", "relaxation_m: 0.3", "relaxation: 0.3", &["relaxation", "relaxation_m"]),
];

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    for (name, text) in [
        ("car.yaml", SCENARIO),
        ("road.yaml", ROAD),
        ("car_sensors.yaml", SENSORS),
    ] {
        dir.write(name, text.as_bytes());
    }
    dir
}

#[test]
fn wrong_cars_roads_and_scenarios_are_refused_with_their_reason() {
    for (file, from, to, told) in CASES {
        let dir = dir();
        let good = dir.read(file);
        assert_eq!(
            good.matches(from).count(),
            1,
            "{file}: `{from}` must be there once"
        );
        dir.write(file, good.replace(from, to).as_bytes());
        let said = dir.refused(&["run", "car.yaml"]);
        for part in *told {
            assert!(
                said.contains(part),
                "{file}: {from} → {to}: no `{part}` in\n{said}"
            );
        }
    }
}

/// The good scenario runs, with everything recorded, and what it leaves behind is whole; a train is not steered.
#[test]
fn a_car_is_recorded_like_a_train() {
    let dir = dir();
    let (code, out, err) = dir.monorig(&["run", "car.yaml"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let files = [
        "channels.parquet",
        "run.rrd",
        "manifest.json",
        "metrics.json",
    ]
    .map(|f| format!("runs/car/1/{f}"));
    for file in &files {
        let (code, out, err) = dir.monorig(&["check", file]);
        assert_eq!(code, Some(0), "{out}{err}");
    }
    let manifest = dir.read("runs/car/1/manifest.json");
    assert!(
        manifest.contains("\"plant\": \"road\"") && manifest.contains("road/hongqi_ehs3.yaml"),
        "{manifest}"
    );

    let steered = project().join("assets/sensors/guo2024.yaml");
    let set = format!("sensors={}", steered.display());
    let said = dir.refused(&["run", "scenario.yaml", "--set", &set]);
    assert!(said.contains("a train is not steered"), "{said}");
}
