//! `monorig log track`: drive, map, and drive on the map.

use crate::common::{TestFolder, project};
use monorig_sim::rail::Rail;
use monorig_sim::record::readback;

const SCENARIO: &str = "liu2023_section1";

/// Drives a scenario with `rail_fusion` in the loop and maps the run.
fn drive_and_map(dir: &TestFolder, scenario: &str, seed: u64) -> Vec<Vec<f64>> {
    let file = project().join(format!("scenarios/{scenario}.yaml"));
    let seed = seed.to_string();
    let (code, out, err) = dir.monorig(&[
        "run",
        &file.display().to_string(),
        "--seed",
        &seed,
        "--set",
        "estimators={\"rail_fusion\": {}}",
        "--set",
        "in_loop=rail_fusion",
        "--set",
        "vehicle.exact.all=a test",
        "--set",
        "expect=[]",
        "--set",
        "known_failures=[]",
        "--set",
        "published=[]",
        "--no-rerun",
        "--name",
        "drive",
        "--out",
        "runs",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let run = format!("runs/{scenario}@drive/{seed}");
    let profile = project().join("assets/rails/i140e.yaml");
    let profile = profile.display().to_string();
    std::fs::create_dir_all(dir.path("maps")).unwrap();
    let (code, out, err) = dir.monorig(&[
        "map",
        &run,
        "--profile",
        &profile,
        "--out",
        "maps/rail.yaml",
    ]);
    assert_eq!(code, Some(0), "{out}{err}");
    let csv = dir.read("maps/rail.csv");
    assert!(csv.contains("s_m,grade_deg,sd_deg,heading_deg,heading_sd_deg"));
    let rows = csv
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    rows.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        // rail that was not read has 1.1°
        .filter(|row: &Vec<f64>| row[2] < 1.0)
        .collect()
}

fn track_of(name: &str) -> Rail {
    Rail::load(&project().join(format!("assets/tracks/{name}.yaml"))).unwrap()
}

/// Maps a run of seed `seed`; returns for each place that was read: chainage, error of the grade over its standard
/// deviation.
fn mapped(dir: &TestFolder, seed: u64) -> Vec<(f64, f64)> {
    let track = track_of("liu2023_section1");
    let rows = drive_and_map(dir, SCENARIO, seed);
    let error = |row: &Vec<f64>| {
        let grade = track.grade(row[0]).to_degrees();
        (row[0], (row[1] - grade) / row[2])
    };
    rows.iter().map(error).collect()
}

/// Bends to both sides: the heading against that of the first place is the track's within its standard deviation, and
/// the map is a track with bends.
#[test]
fn the_bends_of_the_map_are_those_of_the_track() {
    let dir = TestFolder::new();
    let track = track_of("rail_bends");
    let rows = drive_and_map(&dir, "monorail_bends", 1);
    let first = rows[0].clone();
    let turned = |s: f64| (track.heading(s) - track.heading(first[0])).to_degrees();
    let errors: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| (row[3] - first[3] - turned(row[0]), row[4]))
        .collect();
    let most = rows
        .iter()
        .fold(0.0, |most: f64, row| most.max(turned(row[0]).abs()));
    assert!(most > 30.0, "{most}° of bends");
    let within = errors.iter().filter(|(error, sd)| error.abs() < 3.0 * sd);
    let share = within.count() as f64 / errors.len() as f64;
    let rms = (errors.iter().map(|(e, _)| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    println!("heading {rms:.3}° off, within three standard deviations {share:.3}");
    assert!(share > 0.98, "{share}");
    assert!(rms < 1.0, "{rms}°");
    let map = Rail::load(&dir.path("maps/rail.yaml")).unwrap();
    let last = rows[rows.len() - 1][0];
    let of_map = (map.heading(last) - map.heading(first[0])).to_degrees();
    assert!((of_map - turned(last)).abs() < 2.0, "{of_map}°");
}

/// The map is the track within its standard deviation: normalised errors of five drives are those of a standard normal
/// variable, as far as five biases tell. The train comes from 21.5 m to 77 m.
#[test]
fn the_map_of_a_drive_is_the_track_within_its_standard_deviation() {
    let dir = TestFolder::new();
    let (mut within, mut all, mut squares) = (0.0, 0.0, 0.0);
    for seed in 1..=5 {
        let places = mapped(&dir, seed);
        let (first, last) = (places[0].0, places[places.len() - 1].0);
        assert!(first < 23.0 && last > 75.0, "{first} {last}");
        for (_, z) in places {
            all += 1.0;
            squares += z * z;
            within += if z.abs() < 3.0 { 1.0 } else { 0.0 };
        }
    }
    assert!(within / all > 0.98, "{}", within / all);
    assert!((0.1..3.0).contains(&(squares / all)), "{}", squares / all);
}

/// A scenario drives on the map as it did on the track.
#[test]
fn a_scenario_drives_on_the_map() {
    let dir = TestFolder::new();
    mapped(&dir, 1);
    let scenario = project().join(format!("scenarios/{SCENARIO}.yaml"));
    let scenario = scenario.display().to_string();
    let map = format!("track={}", dir.path("maps/rail.yaml").display());
    let (_, out, err) = dir.monorig(&[
        "run",
        &scenario,
        "--seed",
        "1",
        "--set",
        &map,
        "--set",
        "expect=[]",
        "--set",
        "known_failures=[]",
        "--set",
        "published=[]",
        "--no-rerun",
        "--name",
        "map",
        "--out",
        "runs",
    ]);
    let of = |variant: &str| {
        let file = format!("runs/liu2023_section1@{variant}/1/channels.parquet");
        let columns = readback::columns(&dir.path(&file), |c| c.starts_with("truth/"));
        let (_, columns) = columns.unwrap_or_else(|e| panic!("{e}: {out}{err}"));
        columns
            .get("truth/grade_at_imu")
            .unwrap()
            .last()
            .copied()
            .unwrap()
    };
    // the rail's last grade is 8° on both
    assert!((of("drive") - of("map")).abs().to_degrees() < 0.2);
}

#[test]
fn a_run_without_an_attitude_filter_is_told() {
    let dir = TestFolder::new();
    let (code, out, err) = dir.monorig(&["run", "scenario.yaml", "--no-rerun", "--out", "runs"]);
    assert!(code.is_some(), "{out}{err}");
    let map = |estimator: &str| {
        let args = [
            "map",
            "runs/scenario/1",
            "--estimator",
            estimator,
            "--road-width",
            "3.5",
        ];
        dir.monorig(&args)
    };
    for (estimator, word) in [
        ("dffrls_aekf_robust", "pitch_rad"),
        ("rail_fusion", "no estimator"),
    ] {
        let (code, _, err) = map(estimator);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.contains(word), "{err}");
    }
}
