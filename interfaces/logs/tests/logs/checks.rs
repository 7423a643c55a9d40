//! Each check of a log fires on a log that is broken that way on purpose, and none on the whole one. The log is a
//! vehicle of 5 t over hills, computed from v(t) and θ(s): f = v̇ + g sin θ, ω_left = −θ̇, T = m r / i (f + μ g).

use monorig_logs::check::{Verdict, check};
use monorig_logs::map::Map;
use std::fmt::Write;
use std::path::PathBuf;

const G: f64 = 9.80665;

/// A row: time, specific force, rate, two wheels, torque.
struct Row {
    t: f64,
    f: [f64; 3],
    w: [f64; 3],
    wheels: [f64; 2],
    torque: f64,
}

fn drive() -> Vec<Row> {
    let (mut s, mut random) = (0.0, monorig_testing::Random::new(1));
    let mut white = || random.unit() - 0.5;
    (0..12_000)
        .map(|i| {
            let t = f64::from(i) * 0.01;
            // at rest for 10 s, then between 0.4 and 3.6 m/s
            let (v, a) = match t {
                t if t < 10.0 => (0.0, 0.0),
                t if t < 14.0 => (0.5 * (t - 10.0), 0.5),
                t => (
                    2.0 + 1.6 * (0.5 * (t - 14.0)).sin(),
                    0.8 * (0.5 * (t - 14.0)).cos(),
                ),
            };
            s += v * 0.01;
            let theta = 0.15 * (s / 12.0).sin();
            let rate = 0.15 / 12.0 * (s / 12.0).cos() * v;
            let f = a + G * theta.sin();
            Row {
                t,
                f: [
                    f + 0.02 * white(),
                    0.02 * white(),
                    G * theta.cos() + 0.02 * white(),
                ],
                w: [0.001 * white(), -rate + 0.001 * white(), 0.001 * white()],
                wheels: [v, v],
                torque: if v > 0.0 {
                    5000.0 * (f + 0.02 * G) * 0.17 / 20.0 + white()
                } else {
                    0.3 * white()
                },
            }
        })
        .collect()
}

const MAP: &str = "\
version: 1
files: {log: log.csv}
nominal: {tare_kg: 4000, mass_range_kg: [4000, 12000], wheel_radius_m: 0.17, gear_ratio: 20}
channels:
  specific_force: {columns: [fx, fy, fz], unit: m/s2}
  angular_rate: {columns: [wx, wy, wz], unit: rad/s}
  wheel_speed: [{columns: [v1, v2], unit: m/s}]
  traction: {torque: [torque], unit: Nm}
estimators: {ekf_v_theta_biases: {}}
";

/// Findings of the checks on the drive, broken by `row`, with this map.
fn told(map: &str, header: &str, mut row: impl FnMut(&mut Row)) -> Vec<(String, String)> {
    let dir = tempfile::tempdir().unwrap();
    let mut text = format!("{header}\n");
    for mut r in drive() {
        row(&mut r);
        let ([fx, fy, fz], [wx, wy, wz], [v1, v2]) = (r.f, r.w, r.wheels);
        writeln!(
            text,
            "{:.3},{fx},{fy},{fz},{wx},{wy},{wz},{v1},{v2},{}",
            r.t, r.torque
        )
        .unwrap();
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    let file: PathBuf = dir.path().join("log.map.yaml");
    std::fs::write(&file, map).unwrap();
    let all = check(&Map::load(&file).unwrap()).unwrap();
    all.into_iter()
        .filter_map(|c| match c.verdict {
            Verdict::Bad(why) => Some((c.what, why)),
            _ => None,
        })
        .collect()
}

const HEADER: &str = "t,fx,fy,fz,wx,wy,wz,v1,v2,torque";

/// One way to break a log: its name, the check that must fire and a word of what it says, what is done to each row.
type Break = (&'static str, &'static str, &'static str, fn(&mut Row));

#[test]
fn each_check_fires_on_a_log_broken_that_way_and_on_no_good_one() {
    assert_eq!(told(MAP, HEADER, |_| ()), []);
    let breaks: [Break; 12] = [
        ("specific force in g", "|f| at rest", "unit: g", |r| {
            r.f = r.f.map(|x| x / G)
        }),
        (
            "no gravity",
            "|f| at rest",
            "does not include gravity",
            |r| r.f = [r.f[0], r.f[1], r.f[2] - G],
        ),
        ("speed in km/h", "gain of f on dv/dt", "km/h", |r| {
            r.wheels = r.wheels.map(|v| v * 3.6)
        }),
        ("box backwards", "gain of f on dv/dt", "sign", |r| {
            r.f = [-r.f[0], -r.f[1], r.f[2]]
        }),
        ("gyro in deg/s", "gain of the gyro", "deg/s", |r| {
            r.w = r.w.map(f64::to_degrees)
        }),
        ("gyro axis turned", "gain of the gyro", "sign", |r| {
            r.w = [-r.w[0], -r.w[1], r.w[2]]
        }),
        ("gyro bias", "bias of the gyro, left", "calibrate", |r| {
            r.w[1] += 0.03
        }),
        ("one wheel worn", "a wheel's speed", "differs", |r| {
            r.wheels[1] *= 1.12
        }),
        (
            "torque has the other sign",
            "mass by traction",
            "sign",
            |r| r.torque = -r.torque,
        ),
        (
            "torque in another unit",
            "mass by traction",
            "impossible",
            |r| r.torque *= 10.0,
        ),
        ("clipped", "specific force x", "clipped", |r| {
            r.f[0] = r.f[0].clamp(-1.0, 1.0)
        }),
        ("not connected", "angular rate z", "never changes", |r| {
            r.w[2] = 0.25
        }),
    ];
    for (name, what, word, row) in breaks {
        let told = told(MAP, HEADER, row);
        assert!(
            told.iter()
                .any(|(w, why)| w.starts_with(what) && why.contains(word)),
            "{name}: {told:?}"
        );
    }
}

/// Of an instrument turned in any of the 24 ways the axes are named as they are, and of one that is not turned none.
#[test]
fn axes_are_named_as_they_are() {
    let directions: [(&str, [f64; 3]); 6] = [
        ("forward", [1.0, 0.0, 0.0]),
        ("backward", [-1.0, 0.0, 0.0]),
        ("left", [0.0, 1.0, 0.0]),
        ("right", [0.0, -1.0, 0.0]),
        ("up", [0.0, 0.0, 1.0]),
        ("down", [0.0, 0.0, -1.0]),
    ];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let mut ways = 0;
    for (a, x) in directions {
        for (b, y) in directions {
            let cross = [
                x[1] * y[2] - x[2] * y[1],
                x[2] * y[0] - x[0] * y[2],
                x[0] * y[1] - x[1] * y[0],
            ];
            let Some((c, z)) = directions.into_iter().find(|(_, d)| *d == cross) else {
                continue;
            };
            ways += 1;
            let told = told(MAP, HEADER, |r| r.f = [x, y, z].map(|d| dot(d, r.f)));
            let axes = format!("`axes: [{a}, {b}, {c}]`");
            let named: Vec<_> = told
                .iter()
                .filter(|(_, why)| why.contains("axes: ["))
                .collect();
            match ways {
                1 => assert!(named.is_empty(), "{named:?}"),
                _ => assert!(
                    named.iter().any(|(_, why)| why.contains(&axes)),
                    "{axes}: {told:?}"
                ),
            }
        }
    }
    assert_eq!(ways, 24);
}

/// A box that is turned clips in its own axes: the check looks at the columns, before the turn.
#[test]
fn clipping_is_that_of_the_columns() {
    let (pitch, map) = (
        20f64.to_radians(),
        MAP.replace("unit: m/s2}", "unit: m/s2, mount_deg: {pitch: 20}}"),
    );
    let turned = |r: &mut Row, most: f64| {
        let [x, y, z] = r.f;
        let (x, z) = (
            x * pitch.cos() + z * pitch.sin(),
            z * pitch.cos() - x * pitch.sin(),
        );
        r.f = [x.min(most), y, z];
    };
    let clipped = |most: f64| {
        let told = told(&map, HEADER, |r| turned(r, most));
        told.iter()
            .any(|(what, why)| what.starts_with("specific force x") && why.contains("clipped"))
    };
    assert!(!clipped(100.0) && clipped(4.0));
}

#[test]
fn a_column_that_is_not_there_is_named() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("log.csv"),
        "t,fx,fy,fz,wx,wy,wz,v1,v3,torque\n0,0,0,9.8,0,0,0,1,1,0\n",
    )
    .unwrap();
    let file = dir.path().join("log.map.yaml");
    std::fs::write(&file, MAP).unwrap();
    let told = check(&Map::load(&file).unwrap()).unwrap_err().to_string();
    assert!(
        told.contains("`v2`") && told.contains("wheel_speed") && told.contains("map.yaml:7"),
        "{told}"
    );
}

/// Calibration finds what is not known: the bias of the gyro, and how the box sits, to within what noise allows.
#[test]
fn calibration_finds_what_was_planted() {
    let dir = tempfile::tempdir().unwrap();
    let (pitch, roll, bias) = (4.0f64.to_radians(), -2.0f64.to_radians(), 0.021);
    let mut text = format!("{HEADER}\n");
    for r in drive() {
        // the box rolled, then pitched: what it reads is turned the other way round
        let [x, y, z] = r.f;
        let (x, z) = (
            x * pitch.cos() + z * pitch.sin(),
            -x * pitch.sin() + z * pitch.cos(),
        );
        let (y, z) = (
            y * roll.cos() + z * roll.sin(),
            -y * roll.sin() + z * roll.cos(),
        );
        let [wx, wy, wz] = r.w;
        let [v1, v2] = r.wheels;
        writeln!(
            text,
            "{:.3},{x},{y},{z},{wx},{},{wz},{v1},{v2},{}",
            r.t,
            wy + bias,
            r.torque
        )
        .unwrap();
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    let file = dir.path().join("log.map.yaml");
    let calibrated = MAP
        .replace("unit: m/s2}", "unit: m/s2, calibrate: {standing_s: 9}}")
        .replace("unit: rad/s}", "unit: rad/s, calibrate: {standing_s: 9}}");
    std::fs::write(&file, &calibrated).unwrap();
    let map = Map::load(&file).unwrap();
    let mut plan = monorig_logs::drive::Plan::new(&map).unwrap();
    let found = monorig_logs::drive::calibrate(&map, &mut plan).unwrap();
    let value = |what: &str| {
        found
            .iter()
            .find(|f| f.what == what)
            .map(|f| (f.value, f.sd))
            .unwrap()
    };
    for (what, planted) in [
        ("angular_rate bias left", bias),
        ("specific_force mount pitch", 4.0),
        ("specific_force mount roll", -2.0),
    ] {
        let (x, sd) = value(what);
        assert!(
            (x - planted).abs() < 4.0 * sd + 1e-9,
            "{what}: {x} ± {sd}, planted {planted}"
        );
    }
    assert_eq!(
        check(&map)
            .unwrap()
            .iter()
            .filter(|c| matches!(c.verdict, Verdict::Bad(_)))
            .count(),
        0
    );
    // a time in which it drives is refused
    std::fs::write(&file, calibrated.replace("standing_s: 9", "standing_s: 30")).unwrap();
    let map = Map::load(&file).unwrap();
    let mut plan = monorig_logs::drive::Plan::new(&map).unwrap();
    let told = monorig_logs::drive::calibrate(&map, &mut plan)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("wheels turn") && told.contains("calibrate"),
        "{told}"
    );
}
