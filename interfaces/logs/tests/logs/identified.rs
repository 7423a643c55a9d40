//! Identification finds what was planted in a log.

use monorig_logs::check::identify;
use monorig_logs::identify::{Parameter, ParameterKind};
use monorig_logs::map::Map;
use monorig_sim::sensors::stream::Stream;

const G: f64 = 9.80665;

/// A drive up and down with noise: gain, resistance, lean and bias that were planted are found within three
/// standard deviations, which are small against the values.
#[test]
fn planted_values_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let (gain, resistance, lean, bias) = (1.08, 0.021, 0.03, 0.12);
    let (mass, radius) = (10_000.0, 0.2);
    let mut noise = Stream::new(7, "test");
    let mut text = String::from("t,v,fx,fy,fz,torque,slope\n");
    for k in 0..30_000 {
        let t = f64::from(k) * 0.01;
        let v = 1.5 + 0.8 * (0.25 * t).sin();
        let a = 0.2 * (0.25 * t).cos();
        let slope: f64 = 0.1 * (0.03 * t).sin();
        let f = a + G * slope.sin();
        let force = (mass * a + mass * G * (slope.sin() + resistance * slope.cos())) / gain;
        text += &format!(
            "{t},{},{},0,9.8,{},{slope}\n",
            v + 0.003 * noise.normal(),
            f * (1.0 + lean) + bias + 0.05 * noise.normal(),
            force * radius + 5.0 * noise.normal(),
        );
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    let map = "version: 1
files: {log: log.csv}
nominal: {tare_kg: 8000, wheel_radius_m: 0.2}
channels:
  specific_force: {columns: [fx, fy, fz], unit: m/s2}
  wheel_speed: [{columns: [v], unit: m/s}]
  traction: {torque: [torque], unit: Nm}
reference: {slope: {column: slope, unit: rad, sd_deg: 0}, mass: {kg: 10000, sd_kg: 0}}
";
    let path = dir.path().join("log.map.yaml");
    std::fs::write(&path, map).unwrap();
    let found = identify(&Map::load(&path).unwrap()).unwrap().0;
    let near = |found: &[Parameter], name: &str, planted: f64, most: f64| {
        let p = found.iter().find(|p| p.name == name).unwrap();
        let off = (p.value - planted).abs();
        assert!(
            off < 3.0 * p.sd,
            "{name}: {} ± {}, planted {planted}",
            p.value,
            p.sd
        );
        assert!(p.sd < most, "{name}: ± {}", p.sd);
    };
    near(&found, "torque gain", gain, 0.01);
    near(&found, "running resistance", resistance, 0.001);
    let lean = (lean / (1.0 + lean)).to_degrees();
    near(&found, "lean", lean, 0.3);
    near(&found, "accelerometer bias", bias, 0.01);
    near(&found, "noise of the specific force forward", 0.05, 0.001);
    near(&found, "noise of the wheel speed 1", 0.003, 1e-4);

    // without the mass its ratio to the gain, and the resistance
    std::fs::write(&path, map.replace(", mass: {kg: 10000, sd_kg: 0}", "")).unwrap();
    let found = identify(&Map::load(&path).unwrap()).unwrap().0;
    assert!(found.iter().all(|p| p.kind != ParameterKind::TorqueGain));
    near(&found, "mass over torque gain", mass / gain, 0.01 * mass);
    near(&found, "running resistance", resistance, 0.001);
}

/// A vehicle whose wheels are 2.5 % smaller than the map has them, along marks every 7 m that were surveyed to 5
/// mm, or beside a laser that measures the speed: the radius is found within two standard deviations, which are
/// below a thousandth of it, and the torque gain is then that of gear and efficiency alone.
#[test]
fn the_radius_is_found_by_marks_and_by_a_laser() {
    let (said, radius, gain, resistance, mass) = (0.2, 0.195, 0.97, 0.018, 10_000.0);
    let mut noise = Stream::new(11, "test");
    let dir = tempfile::tempdir().unwrap();
    let (mut log, mut marks) = (String::from("t,v,torque,laser\n"), String::from("t,d\n"));
    let mut passed = 0.0;
    for k in 0..30_000 {
        let t = f64::from(k) * 0.01;
        let v = 1.5 + 0.8 * (0.25 * t).sin();
        let way = 1.5 * t + 3.2 * (1.0 - (0.25 * t).cos());
        let force = mass * (0.2 * (0.25 * t).cos() + G * resistance) / gain;
        let wheel = v * said / radius + 0.003 * noise.normal();
        let (torque, laser) = (force * radius, v + 0.01 * noise.normal());
        log += &format!("{t},{wheel},{torque},{laser}\n");
        if way >= passed {
            let t = t - (way - passed) / v;
            marks += &format!("{t},{}\n", passed + 0.005 * noise.normal());
            passed += 7.0;
        }
    }
    std::fs::write(dir.path().join("log.csv"), log).unwrap();
    std::fs::write(dir.path().join("marks.csv"), marks).unwrap();
    for reference in [
        "distance: {file: marks, column: d, unit: m, sd: 0.005}",
        "speed: {file: log, column: laser, unit: m/s, sd: 0.0005}",
    ] {
        let map = format!(
            "version: 1
files: {{log: log.csv, marks: marks.csv}}
nominal: {{tare_kg: 8000, wheel_radius_m: {said}}}
channels:
  wheel_speed: [{{file: log, columns: [v], unit: m/s}}]
  traction: {{file: log, torque: [torque], unit: Nm}}
reference: {{slope: {{deg: 0, sd_deg: 0}}, mass: {{kg: 10000, sd_kg: 0}}, {reference}}}
"
        );
        let path = dir.path().join("log.map.yaml");
        std::fs::write(&path, map).unwrap();
        let found = identify(&Map::load(&path).unwrap()).unwrap().0;
        for (name, planted, most) in [
            ("wheel radius", radius, 2e-4),
            ("torque gain", gain, 0.01),
            ("running resistance", resistance, 0.001),
        ] {
            let p = found.iter().find(|p| p.name == name).unwrap();
            let off = (p.value - planted).abs();
            let told = format!("{reference}: {name} {} ± {}", p.value, p.sd);
            assert!(off < 2.0 * p.sd && p.sd < most, "{told}, planted {planted}");
        }
    }
}
