//! `judge` and `calibrate`, over a run and over its export.

use crate::common::{TestFolder, columns};
use std::fmt::Write as _;

/// A drive with speed changes on the sample's track that has kept its samples.
fn run(dir: &TestFolder) -> String {
    let (code, out, err) = dir.monorig(&[
        "run",
        "scenario.yaml",
        "--keep-samples",
        "--no-rerun",
        "--plant",
        "point-mass",
        "--set",
        "events=[]",
        "--set",
        "vehicle.exact.all=a test",
        "--set",
        "stop.after_s=80",
        "--set",
        "drive.speed=[{at_s: 0, mps: 0}, {at_s: 3, mps: 1}, {at_s: 20, mps: 0.5}, {at_s: 35, mps: 1.4}, {at_s: 50, mps: 0.7}, {at_s: 65, mps: 1.2}]",
    ]);
    assert!(matches!(code, Some(0 | 1)), "{out}{err}");
    let name = std::fs::read_dir(dir.path("runs")).unwrap().next().unwrap();
    format!(
        "runs/{}/1",
        name.unwrap().file_name().into_string().unwrap()
    )
}

/// The estimates of the run itself, judged as if they were made elsewhere, are as good as those of the run; with 1 t on
/// top they are 1 t off.
#[test]
fn estimates_of_the_run_are_judged_as_the_run_judged_them() {
    let dir = TestFolder::new();
    let run = run(&dir);
    let all = columns(&dir.path(&run));
    let of = |name: &str| &all[&format!("estimates/dffrls_aekf_robust/{name}")];
    for (file, more_kg) in [("same.csv", 0.0), ("heavy.csv", 1000.0)] {
        let mut text = String::from("t,mass_kg,mass_sd_kg,mass_valid,slope_rad,slope_valid\n");
        for (row, t) in all["time"].iter().enumerate() {
            let at = |name: &str| of(name)[row];
            writeln!(
                text,
                "{t},{},{},{},{},{}",
                at("total_mass") + more_kg,
                at("total_mass_sd"),
                at("total_mass_valid"),
                at("grade"),
                at("grade_valid")
            )
            .unwrap();
        }
        dir.write(file, text.replace("NaN", "").as_bytes());
    }
    let printed = std::cell::Cell::new(String::new());
    let judged = |file: &str| -> serde_json::Value {
        let (code, out, err) = dir.monorig(&[
            "judge",
            &run,
            "--estimates",
            file,
            "--no-rerun",
            "--out",
            "judged",
        ]);
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
        printed.set(out);
        let folder = std::fs::read_dir(dir.path("judged")).unwrap();
        let mut names = folder.map(|e| e.unwrap().file_name().into_string().unwrap());
        let name = names.next().unwrap();
        assert_eq!(names.next(), None, "something is left beside the results");
        let metrics = dir.read(&format!("judged/{name}/1/metrics.json"));
        let (code, out, err) = dir.monorig(&["report", &format!("judged/{name}/1")]);
        assert_eq!(code, Some(0), "{out}{err}");
        serde_json::from_str(&metrics).unwrap()
    };
    let metrics = judged("same.csv");
    let of = |estimator: &str, metric: &str| {
        metrics["estimators"][estimator][metric]
            .as_f64()
            .unwrap_or_else(|| panic!("{estimator} {metric} in {metrics}"))
    };
    for metric in ["mass_rmse_kg", "slope_rmse_deg"] {
        let (ours, theirs) = (of("dffrls_aekf_robust", metric), of("judged", metric));
        // the table has every tenth step only
        assert!(
            (ours / theirs - 1.0).abs() < 0.02,
            "{metric}: {ours} {theirs}"
        );
    }
    // the error of the mass at the end is printed, in two digits
    let printed = printed.take();
    let row = printed
        .lines()
        .find(|l| l.trim_start().starts_with("judged"));
    let shown: f64 = row
        .unwrap()
        .split_whitespace()
        .nth(1)
        .and_then(|cell| cell.split('±').next()?.parse().ok())
        .unwrap();
    let share = 100.0 * of("judged", "mass_error_rel_end");
    assert!((shown / share - 1.0).abs() < 0.06, "{share} in\n{printed}");
    // |mean |e + 1000| − 1000| is at most mean |e|
    let mae = |metrics: &serde_json::Value| {
        metrics["estimators"]["judged"]["mass_mae_kg"]
            .as_f64()
            .unwrap()
    };
    let (same, heavy) = (mae(&metrics), mae(&judged("heavy.csv")));
    assert!((heavy - 1000.0).abs() <= same + 1e-6, "{same} {heavy}");
    let told = dir.refused(&["judge", "nowhere", "--estimates", "same.csv"]);
    assert!(told.contains("not the folder of a run"), "{told}");
    dir.write("bad.csv", b"t,m\n0,1\n");
    let told = dir.refused(&["judge", &run, "--estimates", "bad.csv"]);
    assert!(told.contains("mass_kg"), "{told}");
}

/// Simulator → log → parameters: a torque read 8 % too large and the running resistance of the train come out of the
/// log within three standard deviations.
#[test]
fn what_was_planted_in_a_run_is_found_in_its_log() {
    let dir = TestFolder::new();
    let run = run(&dir);
    let (code, out, err) = dir.monorig(&["export", &run, "--to", "parquet", "--out", "log"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let map = out
        .lines()
        .find_map(|l| l.strip_prefix("monorig replay --map "))
        .unwrap();
    let (code, out, err) = dir.monorig(&[
        "calibrate",
        "--map",
        map,
        "--known",
        "mass,slope",
        "--json",
        "found.json",
        "--set",
        "faults=[{from_s: 0, channel: traction, fault: scale, size: 1.08}]",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let found: serde_json::Value = serde_json::from_str(&dir.read("found.json")).unwrap();
    let get = |name: &str| {
        let all = found.as_array().unwrap().iter();
        let p = all.clone().find(|p| p["name"] == name).unwrap();
        (p["value"].as_f64().unwrap(), p["sd"].as_f64().unwrap())
    };
    let resistance = columns(&dir.path(&run))["truth/running_resistance"].clone();
    let known: Vec<f64> = resistance.into_iter().filter(|x| x.is_finite()).collect();
    let resistance = known[known.len() / 2];
    for (name, planted) in [
        ("torque gain", 1.0 / 1.08),
        ("running resistance", resistance),
    ] {
        let (value, sd) = get(name);
        let off = (value - planted).abs();
        assert!(
            off < 3.0 * sd && sd < 0.2 * planted,
            "{name}: {value} ± {sd}, planted {planted}\n{out}"
        );
    }
    let told = dir.refused(&["calibrate", "--map", map, "--known", "mass"]);
    assert!(told.contains("--known mass,slope"), "{told}");
}

/// A minute at rest with white noise of a known density, then a drive: `--noise from-log` shows the random walk of the
/// integral of each axis (standard deviation of a sample times the root of its period) within three standard
/// deviations, and nothing of a bias that is not there; it stands in the manifest. Of a log that never stands it says
/// so.
#[test]
fn allan_figures_are_those_of_the_standing_part_of_a_log() {
    let dir = TestFolder::new();
    let mut noise = monorig_sim::sensors::stream::Stream::new(3, "standing");
    let (force_sd, rate_sd, period_s) = (0.04, 0.002, 0.01);
    let mut lines = Vec::new();
    for k in 0..9000 {
        let t = f64::from(k) * period_s;
        let v = if t < 60.0 { 0.0 } else { 0.8 };
        let mut line = format!("{t},{v}");
        for (mean, sd) in [(0.0, force_sd), (0.0, force_sd), (9.81, force_sd)] {
            write!(line, ",{}", mean + sd * noise.normal()).unwrap();
        }
        for _ in 0..3 {
            // it shakes while it drives
            let sd = if t < 60.0 { rate_sd } else { 0.1 };
            write!(line, ",{}", sd * noise.normal()).unwrap();
        }
        lines.push(line);
    }
    let title = "t,v,fx,fy,fz,wx,wy,wz\n";
    dir.write(
        "stands.csv",
        (title.to_owned() + &lines.join("\n")).as_bytes(),
    );
    dir.write(
        "drives.csv",
        (title.to_owned() + &lines[6000..].join("\n")).as_bytes(),
    );
    let map = "version: 1
files: {log: stands.csv}
noise: from-log
nominal: {tare_kg: 10000, wheel_radius_m: 0.2}
channels:
  specific_force: {columns: [fx, fy, fz], unit: m/s2}
  angular_rate: {columns: [wx, wy, wz], unit: rad/s}
  wheel_speed: [{columns: [v], unit: m/s}]
estimators: {attitude: {}}
";
    dir.write("log.map.yaml", map.as_bytes());
    let played = |log: &str, out: &str| {
        let args = [
            "replay",
            log,
            "--map",
            "log.map.yaml",
            "--no-rerun",
            "--out",
            out,
        ];
        let (code, said, err) = dir.monorig(&args);
        assert!(matches!(code, Some(0 | 1)), "{said}{err}");
        let manifest: serde_json::Value =
            serde_json::from_str(&dir.read(&format!("{out}/log/1/manifest.json"))).unwrap();
        (err, manifest.to_string())
    };
    let (_, manifest) = played("stands.csv", "a");
    let value = |what: &str| -> (f64, f64) {
        let from = manifest
            .find(&format!("\"{what}\""))
            .unwrap_or_else(|| panic!("{what}: {manifest}"));
        // the object around the name
        let begin = manifest[..from].rfind('{').unwrap();
        let end = from + manifest[from..].find('}').unwrap();
        let found: serde_json::Value = serde_json::from_str(&manifest[begin..=end]).unwrap();
        (
            found["value"].as_f64().unwrap(),
            found["sd"].as_f64().unwrap(),
        )
    };
    for (walk, name, sd) in [
        ("velocity", "specific force", force_sd),
        ("angle", "angular rate", rate_sd),
    ] {
        for axis in ["forward", "left", "up"] {
            let (value, value_sd) = value(&format!("{walk} random walk of the {name} {axis}"));
            let planted = sd * period_s.sqrt();
            let off = (value - planted).abs();
            assert!(
                off < 3.0 * value_sd && value_sd < 0.02 * planted,
                "{name} {axis}: {value} ± {value_sd}, planted {planted}"
            );
        }
    }
    assert!(!manifest.contains("bias instability"), "{manifest}");
    let (told, manifest) = played("drives.csv", "b");
    assert!(told.contains("no Allan figures"), "{told}");
    assert!(!manifest.contains("random walk"), "{manifest}");
}
