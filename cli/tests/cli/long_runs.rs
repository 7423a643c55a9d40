//! Runs of many rows: their recordings are thinned, `--full-rate` records all, and their reports are no longer than
//! those of short runs.

use crate::common::{GOOD, TestFolder};

/// The good scenario on a point, 100 rows a second.
fn scenario(after_s: u32) -> String {
    let (head, _) = GOOD.split_once("drive:").unwrap();
    head.replace("after_s: 60", &format!("after_s: {after_s}"))
        .replace("rapier", "point-mass")
        .replace("dt_ms: 2", "dt_ms: 10")
        + "\
drive: {speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}, {at_s: 20, mps: 1}, {at_s: 24, mps: 0}], every_s: 3600}
sensors: seldom.yaml
record: {rate_hz: 100, pose_rate_hz: 1}
estimators: {ffrls: {}}
"
}

fn dir() -> TestFolder {
    let dir = TestFolder::new();
    let seldom = "\
version: 1
source: A sample.
accelerometer: {mount: imu_link, sampling: {rate_hz: 10}}
gyro: {mount: imu_link, sampling: {rate_hz: 10}}
wheel_speed: {sampling: {rate_hz: 10}}
motor_torque: {sampling: {rate_hz: 10}}
";
    dir.write("seldom.yaml", seldom.as_bytes());
    dir.write("short.yaml", scenario(370).as_bytes());
    dir.write("long.yaml", scenario(3700).as_bytes());
    dir
}

/// Runs a scenario; how many rows `check` finds in its recording.
fn rows(dir: &TestFolder, name: &str, more: &[&str]) -> usize {
    let file = format!("{name}.yaml");
    let mut arguments = vec!["run", &file, "--no-rerun"];
    arguments.extend(more);
    let (code, _, told) = dir.monorig(&arguments);
    assert!(matches!(code, Some(0 | 1)), "{told}");
    let (code, out, told) = dir.monorig(&["check", &format!("runs/{name}/1/channels.parquet")]);
    assert_eq!(code, Some(0), "{told}");
    let (before, _) = out.split_once(" rows").unwrap();
    before.rsplit(' ').next().unwrap().parse().unwrap()
}

/// 370 000 steps, each a row: 360 000 at the full rate, then every second one.
#[test]
fn recordings_are_thinned_unless_told_not_to_be() {
    let dir = dir();
    assert_eq!(rows(&dir, "short", &[]), 37_000);
    let thinned = rows(&dir, "long", &[]);
    assert!(thinned.abs_diff(365_000) <= 1, "{thinned} rows");
    assert_eq!(rows(&dir, "long", &["--full-rate"]), 370_000);
}

/// A plot has as many points as it has pixels, however many rows there are.
#[test]
fn reports_do_not_grow_with_the_rows() {
    let dir = dir();
    let bytes = |name: &str| {
        rows(&dir, name, &[]);
        let (code, _, told) = dir.monorig(&["report", &format!("runs/{name}/1")]);
        assert_eq!(code, Some(0), "{told}");
        dir.read(&format!("runs/{name}/1/report.html")).len()
    };
    let (short, long) = (bytes("short"), bytes("long"));
    assert!(
        long < 2 * short,
        "{short} bytes of 37 000 rows, {long} of 365 000"
    );
    assert!(long < 4_000_000, "{long} bytes");
}
