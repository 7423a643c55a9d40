//! Rows into steps: latency, several samples in a step, gaps, clocks, orders; and what a map file must not contain.

use monorig_logs::drive::{Drive, Plan, Step};
use monorig_logs::map::Map;
use monorig_logs::replay::{ReplayOptions, simulation};
use monorig_sim::{Registry, StepFrame};
use std::path::{Path, PathBuf};

struct Log {
    dir: tempfile::TempDir,
}

impl Log {
    fn new(files: &[(&str, &str)]) -> Self {
        let log = Self {
            dir: tempfile::tempdir().unwrap(),
        };
        for (name, text) in files {
            std::fs::write(log.path(name), text).unwrap();
        }
        log
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn map(&self, text: &str) -> Result<Map, monorig_sim::Error> {
        std::fs::write(self.path("x.map.yaml"), text).unwrap();
        Map::load(&self.path("x.map.yaml"))
    }

    fn steps(&self, map: &str) -> Vec<Step> {
        let map = self.map(map).unwrap();
        let plan = Plan::new(&map).unwrap();
        let mut drive = Drive::open(&map, &plan).unwrap();
        std::iter::from_fn(|| drive.next(&map).unwrap()).collect()
    }

    fn refused(&self, map: &str) -> String {
        match self.map(map) {
            Err(e) => e.to_string(),
            Ok(map) => match Plan::new(&map) {
                Err(e) => e.to_string(),
                Ok(_) => simulation(&map, &ReplayOptions::default(), &Registry::default())
                    .map(|_| ())
                    .unwrap_err()
                    .to_string(),
            },
        }
    }
}

const WHEEL: &str = "\
version: 1
files: {log: log.csv}
step: {rate_hz: 10}
nominal: {tare_kg: 4000, wheel_radius_m: 0.17}
channels:
  wheel_speed: [{columns: [v], unit: m/s}]
estimators: {ekf_v_theta_biases: {}}
";

/// When the speed was delivered and taken (ms), and the speed.
fn speeds(steps: &[Step]) -> Vec<(i64, i64, f64)> {
    let ms = |ns: i64| ns / 1_000_000;
    steps
        .iter()
        .filter_map(|s| s.z.wheel_speed_mps[0].map(|v| (ms(s.t_ns), ms(v.t.ns()), v.value)))
        .collect()
}

#[test]
fn several_samples_in_a_step() {
    // a step ends with the row that stands at its end
    let log = Log::new(&[("log.csv", "t,v\n5.00,1\n5.04,2\n5.10,6\n5.15,4\n5.31,5\n")]);
    let of = |many: &str| {
        speeds(&log.steps(&WHEEL.replace("rate_hz: 10", &format!("rate_hz: 10, many: {many}"))))
    };
    assert_eq!(
        of("mean"),
        [
            (0, 0, 1.0),
            (100, 70, 4.0),
            (200, 150, 4.0),
            (400, 310, 5.0)
        ]
    );
    assert_eq!(
        of("newest"),
        [
            (0, 0, 1.0),
            (100, 100, 6.0),
            (200, 150, 4.0),
            (400, 310, 5.0)
        ]
    );
    assert_eq!(
        of("oldest"),
        [
            (0, 0, 1.0),
            (100, 40, 2.0),
            (200, 150, 4.0),
            (400, 310, 5.0)
        ]
    );
}

#[test]
fn latency_delivers_later_with_the_stamp_it_was_taken_at() {
    let log = Log::new(&[("log.csv", "t,v\n0,1\n0.1,2\n0.2,3\n")]);
    let late = WHEEL.replace("unit: m/s}", "unit: m/s, latency_ms: 250}");
    assert_eq!(
        speeds(&log.steps(&late)),
        [(300, 0, 1.0), (400, 100, 2.0), (500, 200, 3.0)]
    );
}

#[test]
fn a_gap_begins_a_segment_and_takes_no_steps() {
    let log = Log::new(&[("log.csv", "t,v\n0,1\n0.1,2\n3600.05,3\n3600.1,4\n3640,5\n")]);
    let steps = log.steps(WHEEL);
    let segments: Vec<_> = steps
        .iter()
        .filter(|s| s.z.any())
        .map(|s| (s.t_ns / 1_000_000, s.segment))
        .collect();
    assert_eq!(segments, [(0, 0), (100, 0), (3_600_100, 1), (3_640_000, 1)]);
    assert!(steps.len() < 1000, "{} steps", steps.len());
    let longer = WHEEL.replace("step:", "time: {segment_gap_s: 4000}\nstep:");
    assert!(log.steps(&longer).iter().all(|s| s.segment == 0));
}

#[test]
fn clocks_and_units_and_expressions_of_two_files() {
    let log = Log::new(&[
        (
            "a.csv",
            "time_ms;v [km/h];ok\n1000;36,0;1\n1100;72;0\n1200;18;1\n",
        ),
        ("b.csv", "t,fx,fy,fz\n0.9,0,0,1\n1.0,0.1,0,1\n1.1,0,0.2,1\n"),
    ]);
    let steps = log.steps(
        "\
version: 1
files: {a: a.csv, b: b.csv}
time: {origin: zero}
clocks: {b: {offset_s: 0.1}}
step: {rate_hz: 10}
nominal: {tare_kg: 4000, wheel_radius_m: 0.17}
channels:
  wheel_speed: [{file: a, columns: ['= `v [km/h]` * 2'], unit: km/h, sign: -1, valid_if: ok == 1}]
  specific_force: {file: b, columns: [fx, '= -fy', '= -fz'], unit: g, axes: [forward, right, down]}
",
    );
    assert_eq!(speeds(&steps), [(1000, 1000, -20.0), (1200, 1200, -10.0)]);
    let forces: Vec<_> = steps
        .iter()
        .filter_map(|s| s.z.specific_force_mps2)
        .map(|s| (s.t.ns() / 1_000_000, s.value))
        .collect();
    let g = 9.80665;
    assert_eq!(forces.len(), 3);
    assert_eq!(forces[1].0, 1100);
    for (x, y) in forces[1].1.iter().zip([0.1 * g, 0.0, g]) {
        assert!((x - y).abs() < 1e-12, "{forces:?}");
    }
    assert!(
        (forces[2].1[1] - 0.2 * g).abs() < 1e-12,
        "to the left is what the right axis counts down"
    );
}

/// The clock of a file runs 1000 ppm slow: a stamp 100 s after its first is 0.1 s later.
#[test]
fn drift_grows_from_the_first_stamp() {
    let log = Log::new(&[("log.csv", "t,v\n50,1\n150,2\n")]);
    let steps = log.steps(&WHEEL.replace(
        "step:",
        "time: {segment_gap_s: 1000}\nclocks: {log: {drift_ppm: 1000}}\nstep:",
    ));
    assert_eq!(speeds(&steps), [(0, 0, 1.0), (100_100, 100_100, 2.0)]);
}

/// The messages of ROS 2 were logged 2 ms after they were stamped.
#[test]
fn order_of_arrival() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/cdr_zstd.mcap");
    let log = Log::new(&[]);
    let map = format!(
        "\
version: 1
files: {{log: {}}}
time: {{order: ORDER}}
step: {{rate_hz: 1000}}
nominal: {{tare_kg: 4000, wheel_radius_m: 0.17}}
channels:
  wheel_speed: [{{columns: [/twist.twist.linear.x], unit: m/s}}]
  angular_rate: {{columns: [/imu/data.angular_velocity.x, /imu/data.angular_velocity.y, /imu/data.angular_velocity.z], unit: rad/s}}
",
        file.display()
    );
    let by_stamp = log.steps(&map.replace("ORDER", "stamp"));
    let by_arrival = log.steps(&map.replace("ORDER", "arrival"));
    let delays = |steps: &[Step]| -> Vec<i64> {
        steps
            .iter()
            .filter_map(|s| s.z.wheel_speed_mps[0].map(|v| (s.t_ns - v.t.ns()) / 1_000_000))
            .collect()
    };
    let (stamp, arrival) = (delays(&by_stamp), delays(&by_arrival));
    assert_eq!((stamp.len(), arrival.len()), (90, 90));
    assert!(stamp.iter().all(|d| *d == 0), "{stamp:?}");
    assert!(arrival.iter().all(|d| *d == 2), "{arrival:?}");
}

/// Traction as force and as power become the torques that make this force: F r / (i η), in equal shares.
#[test]
fn force_and_power_become_torques() {
    let log = Log::new(&[(
        "log.csv",
        "t,v,f,p\n0,2,1000,4000\n0.1,2,1000,4000\n0.2,0.1,1000,4000\n",
    )]);
    let of =
        |traction: &str| -> Vec<f64> {
            let nominal = "tare_kg: 4000, wheel_radius_m: 0.2, gear_ratio: 10, efficiency: 0.8";
            let map = WHEEL.replace("tare_kg: 4000, wheel_radius_m: 0.17", nominal);
            let map = map
                .replace("estimators", &format!("  traction: {traction}\nestimators"))
                .replace("columns: [v]", "columns: [v, v]");
            let steps = log.steps(&map);
            assert!(steps.iter().all(|s| s.z.motor_torque_nm[0].map(|x| x.value)
                == s.z.motor_torque_nm[1].map(|x| x.value)));
            steps
                .iter()
                .filter_map(|s| s.z.motor_torque_nm[0].map(|x| x.value * 2.0))
                .collect()
        };
    let near = |found: &[f64], expected: &[f64]| {
        assert!(
            found.len() == expected.len()
                && found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-9),
            "{found:?} {expected:?}"
        );
    };
    // the last row is below 0.5 m/s
    near(&of("{force: f, unit: N}"), &[25.0, 25.0, 25.0]);
    near(&of("{power: p, unit: W, efficiency: 0.5}"), &[25.0, 25.0]);
    near(
        &of("{torque: [f], unit: Nm, gear_ratio: 20}"),
        &[2000.0, 2000.0, 2000.0],
    );
}

#[test]
fn mistakes_in_a_map_are_told_with_line_and_key() {
    let log = Log::new(&[
        ("log.csv", "t,v,w\n0,1,1\n1,1,1\n"),
        ("other.csv", "t,v\n0,1\n1,1\n"),
    ]);
    for (from, to, words) in [
        (
            "unit: m/s",
            "unit: furlong",
            &["x.map.yaml:6", "furlong", "km/h"][..],
        ),
        (
            "unit: m/s",
            "unit: Nm",
            &[
                "x.map.yaml:6",
                "wheel_speed[0].unit",
                "is not a unit of a speed",
            ],
        ),
        (
            "columns: [v]",
            "columns: ['= v +']",
            &["x.map.yaml:6", "character"],
        ),
        (
            "columns: [v]",
            "columns: [speed]",
            &["x.map.yaml:6", "no column `speed`"],
        ),
        ("columns: [v]", "columns: []", &["x.map.yaml:6", "0 wheels"]),
        (
            "unit: m/s",
            "unit: m/s, sign: 2",
            &["sign", "2 is not a sign"],
        ),
        (
            "unit: m/s",
            "unit: m/s, file: engine",
            &["no file `engine`", "log"],
        ),
        (
            "files: {log: log.csv}",
            "files: {log: lag.csv}",
            &["x.map.yaml:2", "files.log", "lag.csv"],
        ),
        (
            "files: {log: log.csv}",
            "files: {a: log.csv, b: other.csv}",
            &["several files", "a, b"],
        ),
        ("files: {log: log.csv}", "files: {}", &["has no file"]),
        ("tare_kg: 4000, ", "", &["x.map.yaml", "tare_kg"]),
        ("tare_kg: 4000", "tare_kg: -1", &["x.map.yaml:4", "-1"]),
        (
            "rate_hz: 10",
            "rate_hz: 0.1",
            &["x.map.yaml:3", "step.rate_hz"],
        ),
        ("channels:", "chanels:", &["x.map.yaml:5", "chanels"]),
        (
            "ekf_v_theta_biases",
            "ekf_v_theta_bias",
            &["x.map.yaml:7", "ekf_v_theta_biases"],
        ),
        (
            "estimators: {ekf_v_theta_biases: {}}",
            "estimators: {}",
            &["no estimator"],
        ),
        (
            "step:",
            "clocks: {imu: {offset_s: 1}}\nstep:",
            &["clocks.imu"],
        ),
        (
            "step:",
            "reference: {slope: {sd_deg: 1}}\nstep:",
            &["reference.slope", "exactly one"],
        ),
        (
            "step:",
            "reference: {mass: {sd_kg: 1, steps: []}}\nstep:",
            &["reference.mass.steps"],
        ),
        (
            "step:",
            "reference: {slope: {sd_deg: 1, column: w, unit: kg}}\nstep:",
            &["kg"],
        ),
        (
            "step:",
            "reference: {slope: {sd_deg: 1, column: grade, unit: deg}}\nstep:",
            &["no column `grade`"],
        ),
        (
            "wheel_speed:",
            "specific_force: {columns: [v, v, w], unit: g, axes: [forward, right, up]}\n  wheel_speed:",
            &["x.map.yaml:6", "left-handed"],
        ),
        (
            "wheel_speed:",
            "specific_force: {columns: [v, v, w], unit: g, axes: [forward, forward, up]}\n  wheel_speed:",
            &["two axes"],
        ),
        (
            "wheel_speed:",
            "traction: {torque: [w], force: w, unit: N}\n  wheel_speed:",
            &["exactly one of"],
        ),
        (
            "step:",
            "expect: [{estimator: x, metric: slope_rmse_deg, at_most: 1}]\nstep:",
            &["expect[0]", "`x`"],
        ),
    ] {
        let map = WHEEL.replace(from, to);
        assert_ne!(map, WHEEL, "{from}");
        let told = log.refused(&map);
        assert!(words.iter().all(|w| told.contains(w)), "{to}:\n{told}");
    }
    let back = Log::new(&[("log.csv", "t,v\n0,1\n1,1\n0.5,1\n")]);
    let told = back
        .map(WHEEL)
        .and_then(|m| simulation(&m, &ReplayOptions::default(), &Registry::default()))
        .and_then(|mut s| s.run(&mut []).map(|_| ()))
        .unwrap_err();
    assert!(
        told.to_string().contains("log.csv:4") && told.to_string().contains("goes back by 0.5"),
        "{told}"
    );
}

/// An estimator starts anew where a segment begins: its estimates there are those of a log that begins there.
#[test]
fn estimators_are_reset_at_a_segment() {
    let rows = |from: f64, v: f64| -> String {
        (0..200)
            .map(|i| {
                format!(
                    "{},{}\n",
                    from + f64::from(i) * 0.1,
                    v + 0.01 * f64::from(i)
                )
            })
            .collect()
    };
    let both = Log::new(&[(
        "log.csv",
        &format!("t,v\n{}{}", rows(0.0, 1.0), rows(500.0, 3.0)),
    )]);
    let second = Log::new(&[("log.csv", &format!("t,v\n{}", rows(500.0, 3.0)))]);
    let last = |log: &Log| {
        let map = log.map(WHEEL).unwrap();
        let mut replay = simulation(&map, &ReplayOptions::default(), &Registry::default()).unwrap();
        let mut speed = (0.0, 0.0);
        let mut watch = |f: &StepFrame<'_>| {
            speed = (
                f.estimators[0].estimate.speed_mps.value,
                f.estimators[0].estimate.speed_mps.sd,
            )
        };
        replay.run(&mut [&mut watch]).unwrap();
        speed
    };
    let (a, b) = (last(&both), last(&second));
    assert!(
        (a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6,
        "{a:?} {b:?}"
    );
}
