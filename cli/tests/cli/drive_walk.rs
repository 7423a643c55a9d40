//! The walk from three files to a trusted slope in the chapter on logs: its commands are run in their order on a copy
//! of the example, what the page shows of them is what they print, and what is wrong with the car is found.

use monorig_testing::tools;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .into()
}

/// The section of the page, line by line.
fn walk() -> Vec<String> {
    let page = std::fs::read_to_string(root().join("docs/src/logs.md")).unwrap();
    let lines = page
        .lines()
        .skip_while(|l| *l != "## From three files to a trusted slope");
    let section = lines
        .enumerate()
        .take_while(|(i, l)| *i == 0 || !l.starts_with("## "));
    section.map(|(_, l)| l.to_owned()).collect()
}

fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn the_walk_is_what_happens() {
    if !tools(&["sh"]) {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let example = dir.path().join("examples/car_drive");
    std::fs::create_dir_all(&example).unwrap();
    for file in ["imu.csv", "can.csv", "ref.csv", "drive.map.yaml"] {
        let from = root().join("examples/car_drive").join(file);
        std::fs::copy(from, example.join(file)).unwrap();
    }
    let (mut printed, mut outputs, mut shown) = (String::new(), Vec::new(), false);
    let mut commands = 0;
    for line in walk() {
        if let Some(command) = line.strip_prefix("    monorig ") {
            let full = format!("'{}' {command}", env!("CARGO_BIN_EXE_monorig"));
            let run = Command::new("sh")
                .args(["-c", &full])
                .current_dir(dir.path())
                .env("NO_COLOR", "1")
                .output()
                .unwrap();
            printed = String::from_utf8_lossy(&run.stderr).into_owned()
                + &String::from_utf8_lossy(&run.stdout);
            assert!(
                matches!(run.status.code(), Some(0 | 1)),
                "{command}\n{printed}"
            );
            outputs.push((command.to_owned(), printed.clone()));
            commands += 1;
        } else if line.starts_with("```") {
            shown = line == "```text";
        } else if shown && !words(&line).is_empty() && !line.starts_with('…') {
            let there = printed.lines().any(|l| words(l).contains(&words(&line)));
            assert!(there, "the page shows\n{line}\nbut there is\n{printed}");
        }
    }
    assert!(commands >= 6, "{commands} commands");
    // before and after: the slope of each estimator on the whole drive
    let rmse = |output: &str, estimator: &str| -> f64 {
        let lines = output.lines().skip_while(|l| l.trim() != estimator);
        let row = lines.map(words).find(|l| l.starts_with("slope °")).unwrap();
        row.split(' ').nth(2).unwrap().parse().unwrap()
    };
    let replays: Vec<&String> = outputs
        .iter()
        .filter(|(c, _)| c.starts_with("replay") && !c.contains("--check"))
        .map(|(_, o)| o)
        .collect();
    let [before, .., after] = replays.as_slice() else {
        panic!("two replays")
    };
    for estimator in ["attitude", "ekf_v_theta_biases"] {
        let (before, after) = (rmse(before, estimator), rmse(after, estimator));
        assert!(
            after < 0.5 * before && after < 0.4,
            "{estimator}: {before}° {after}°"
        );
    }
    // what make.py planted is in the map, within what the page says of it
    let map = std::fs::read_to_string(example.join("drive.map.yaml")).unwrap();
    let value = |key: &str| -> f64 {
        let (_, rest) = map
            .split_once(&format!(" {key}: "))
            .unwrap_or_else(|| panic!("{key} in\n{map}"));
        let number = rest
            .trim_start_matches('[')
            .split([',', '}', ']', '\n'])
            .next()
            .unwrap();
        number.trim().parse().unwrap()
    };
    for (key, planted, within) in [
        ("gain", 1.05, 0.02),
        ("running_resistance", 0.013, 0.003),
        ("lean_deg_per_g", 0.03f64.to_degrees(), 0.6),
    ] {
        assert!((value(key) - planted).abs() < within, "{key} in\n{map}");
    }
    assert!(map.contains("# the rear wheels are not driven"), "{map}");
    let report = std::fs::read_to_string(dir.path().join("runs/drive/1/report.html")).unwrap();
    assert!(report.contains("<h1>drive, replayed") && report.contains("against the reference"));
    for not_of_a_log in ["no data", "comfort", "simulated"] {
        assert!(!report.contains(not_of_a_log), "{not_of_a_log}");
    }
}
