//! Runs of the real program: what they leave behind, that they repeat to the bit, and that the recording says what the
//! columns say.

use crate::common::columns;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn monorig(out: &Path, scenario: &str, more: &[&str]) -> Command {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut c = Command::new(env!("CARGO_BIN_EXE_monorig"));
    c.current_dir(root)
        .arg("run")
        .arg(format!("scenarios/{scenario}.yaml"))
        .arg("--out")
        .arg(out)
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    c
}

fn run(out: &Path, scenario: &str, more: &[&str]) -> PathBuf {
    let done = monorig(out, scenario, more).output().unwrap();
    assert!(
        done.status.code().is_some_and(|c| c < 2),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    only(&only_run(out, scenario))
}

/// The folder of a scenario or of its only variant.
fn only_run(out: &Path, scenario: &str) -> PathBuf {
    let all = std::fs::read_dir(out).unwrap().map(|e| e.unwrap());
    let variant = format!("{scenario}@");
    let of_scenario = |name: &str| name == scenario || name.starts_with(&variant);
    let mut found = all.filter(|e| of_scenario(&e.file_name().to_string_lossy()));
    let first = found.next().unwrap().path();
    assert!(found.next().is_none());
    first
}

fn only(folder: &Path) -> PathBuf {
    let entry = std::fs::read_dir(folder).unwrap().next().unwrap();
    entry.unwrap().path()
}

fn bits(c: &[f64]) -> Vec<u64> {
    c.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn a_run_leaves_four_files_with_everything_in_them() {
    let out = tempfile::tempdir().unwrap();
    let folder = run(out.path(), "minimal", &[]);
    for name in [
        "manifest.json",
        "channels.parquet",
        "metrics.json",
        "run.rrd",
    ] {
        assert!(folder.join(name).metadata().unwrap().len() > 100, "{name}");
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4);
    let all = columns(&folder);
    assert_eq!(all["time"].len(), 3001, "60 s at 50 Hz, and the start");
    for name in [
        "truth/grade_at_imu",
        "sensors/imu/specific_force_x",
        "sensors/drive_8/wheel_speed",
        "estimates/dffrls_aekf_robust/total_mass_sd",
        "internals/dffrls_aekf_robust/lambda",
        "control/reference_speed",
    ] {
        assert!(all.contains_key(name), "{name}");
    }
    // units in the metadata
    let file = File::open(folder.join("channels.parquet")).unwrap();
    let schema = ParquetRecordBatchReaderBuilder::try_new(file)
        .unwrap()
        .schema()
        .clone();
    let unit = |name: &str| schema.field_with_name(name).unwrap().metadata()["unit"].clone();
    assert_eq!(unit("truth/total_mass"), "kg");
    assert_eq!(unit("truth/acceleration"), "m/s²");
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("manifest.json")).unwrap()).unwrap();
    let inputs = manifest["inputs"].as_object().unwrap();
    assert!(
        inputs.contains_key("../assets/units/drive_unit.urdf"),
        "{:?}",
        inputs.keys()
    );
}

#[test]
fn two_processes_at_once_write_the_same_bits() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let set = [
        "--set",
        "stop.after_s=30",
        "--set",
        "start.chainage_m=30",
        "--set",
        "expect=[]",
        "--set",
        "known_failures=[]",
        "--set",
        "integrity={max_misleading_share: 1}",
    ];
    let one = monorig(a.path(), "winding", &set).spawn().unwrap();
    let two = monorig(b.path(), "winding", &set).spawn().unwrap();
    for child in [one, two] {
        assert!(child.wait_with_output().unwrap().status.success());
    }
    for name in ["channels.parquet", "metrics.json", "manifest.json"] {
        let read = |d: &Path| std::fs::read(only_run(d, "winding").join("1").join(name)).unwrap();
        assert!(read(a.path()) == read(b.path()), "{name} differs");
    }
}

/// 10 t and 5 t are two runs for the disk and for a viewer: folder and recording id differ. The same change again is
/// the same run.
#[cfg(feature = "viewer")]
#[test]
fn two_variants_of_a_scenario_are_kept_apart() {
    let out = tempfile::tempdir().unwrap();
    let load = |kg: &str| format!("load.mass_kg={kg}");
    let go = |more: &[&str]| {
        let mut all = vec!["--set", "stop.after_s=6"];
        all.extend(more);
        let done = monorig(out.path(), "minimal", &all).output().unwrap();
        assert!(done.status.code().is_some_and(|c| c < 2));
    };
    go(&["--set", &load("10000")]);
    go(&["--set", &load("5000")]);
    go(&["--set", &load("5000")]);
    go(&["--set", &load("5000"), "--name", "light"]);
    go(&["--plant", "point-mass"]);
    let mut ids = Vec::new();
    for folder in std::fs::read_dir(out.path()).unwrap() {
        let folder = folder.unwrap().path().join("1");
        let id = monorig_viz::readback::read(&folder.join("run.rrd"))
            .unwrap()
            .id;
        let name = folder
            .parent()
            .unwrap()
            .file_name()
            .unwrap()
            .to_string_lossy()
            .into_owned();
        assert_eq!(id, format!("{name}-1"));
        ids.push(id);
    }
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), 4, "{ids:?}");
    assert!(ids.contains(&"minimal@light-1".to_owned()), "{ids:?}");
    // and the list of runs says what differs
    let listed = Command::new(env!("CARGO_BIN_EXE_monorig"))
        .arg("runs")
        .env("MONORIG_OUT", out.path())
        .output()
        .unwrap();
    let listed = String::from_utf8(listed.stdout).unwrap();
    for part in [
        "minimal@light",
        "load.mass_kg=5000",
        "load.mass_kg=10000",
        "physics.plant=point-mass",
    ] {
        assert!(listed.contains(part), "{listed}");
    }
    assert!(listed.lines().all(|l| l.chars().count() <= 80), "{listed}");
    // the folder may be named; a file is told
    let of = |place: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        command.arg("runs").arg(place).output().unwrap()
    };
    assert_eq!(of(out.path()).stdout, listed.as_bytes());
    let file = out.path().join("minimal@light/1/manifest.json");
    let refused = of(&file);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is a file"));
}

/// Recordings of two variants have names of their own, by which a viewer keeps them apart, and each its own truth and
/// its own estimates.
#[cfg(feature = "viewer")]
#[test]
fn two_variants_are_two_recordings() {
    let out = tempfile::tempdir().unwrap();
    let files = ["10000", "5000"].map(|kg| {
        let name = format!("load{kg}");
        let load = format!("load.mass_kg={kg}");
        let after = "stop.after_s=20";
        let set = ["--set", after, "--set", &load, "--name", &name];
        let done = monorig(out.path(), "minimal", &set).output().unwrap();
        assert!(done.status.code().is_some_and(|c| c < 2));
        let folder = out.path().join(format!("minimal@{name}/1"));
        folder.join("run.rrd")
    });
    let store = files.map(|file| monorig_viz::readback::read(&file).unwrap());
    let ids = store.each_ref().map(|r| r.id.as_str());
    assert_eq!(ids, ["minimal@load10000-1", "minimal@load5000-1"]);
    assert!(store[0].entities.keys().eq(store[1].entities.keys()));
    let [a, b] = [0, 1].map(|i: usize| &store[i].entities["/truth/total_mass"].scalars);
    assert!(!a.is_empty() && a.len() == b.len());
    for (a, b) in a.iter().zip(b) {
        assert!((a - b - 5000.0).abs() < 1e-6, "{a} {b}");
    }
    let estimates = "/estimates/dffrls_aekf_robust/total_mass";
    let [a, b] = [0, 1].map(|i: usize| &store[i].entities[estimates]);
    assert!(a.scalars != b.scalars, "both have the estimates of one");
}

#[test]
fn several_files_and_seeds_in_one_command() {
    let out = tempfile::tempdir().unwrap();
    let more = [
        "scenarios/reversal.yaml",
        "--seed",
        "2..3",
        "--no-rerun",
        "--plant",
        "point-mass",
        "--name",
        "point",
    ];
    let done = monorig(out.path(), "minimal", &more).output().unwrap();
    assert!(done.status.code().is_some_and(|c| c < 2), "{done:?}");
    for folder in [
        "minimal@point/2",
        "minimal@point/3",
        "reversal@point/2",
        "reversal@point/3",
    ] {
        assert!(
            out.path().join(folder).join("manifest.json").is_file(),
            "{folder}"
        );
    }
}

#[test]
fn another_seed_differs_by_its_noise_and_by_nothing_else() {
    // Without noise two seeds are the same run; with noise they are not.
    let noise_free = [
        "--no-rerun",
        "--set",
        "sensors=../assets/sensors/ideal.yaml",
        "--set",
        "vehicle.exact.all=a test",
    ];
    let go = |seed: &str, more: &[&str]| {
        let out = tempfile::tempdir().unwrap();
        let mut all = vec!["--seed", seed];
        all.extend(more);
        columns(&run(out.path(), "minimal", &all))
    };
    let (one, two) = (go("1", &noise_free), go("2", &noise_free));
    for (name, column) in &one {
        assert_eq!(bits(column), bits(&two[name]), "{name}");
    }
    let (one, two) = (go("1", &["--no-rerun"]), go("2", &["--no-rerun"]));
    assert_ne!(
        bits(&one["sensors/imu/specific_force_x"]),
        bits(&two["sensors/imu/specific_force_x"])
    );
}

#[cfg(feature = "viewer")]
#[test]
fn the_recording_says_what_the_columns_say() {
    let out = tempfile::tempdir().unwrap();
    let folder = run(out.path(), "minimal", &["--full-rate"]);
    let recording = monorig_viz::readback::read(&folder.join("run.rrd")).unwrap();
    assert!(recording.complete);
    assert_eq!(recording.application, "monorig");
    let all = columns(&folder);
    let time: Vec<i64> = all["time"]
        .iter()
        .map(|t| (t * 1e9).round() as i64)
        .collect();
    let mut compared = 0;
    for (name, column) in all.iter().filter(|(name, _)| *name != "time") {
        let there: Vec<(i64, f64)> = time
            .iter()
            .copied()
            .zip(column.iter().copied())
            .filter(|(_, x)| x.is_finite())
            .collect();
        if there.is_empty() {
            continue;
        }
        let entity = &recording.entities[&format!("/{name}")];
        let here: Vec<(i64, f64)> = entity
            .times
            .iter()
            .copied()
            .zip(entity.scalars.iter().copied())
            .collect();
        assert_eq!(here, there, "{name}");
        compared += 1;
    }
    assert!(compared > 80, "{compared} channels compared");
    // 60 s of poses at 25 Hz, and the start, for every body, wheels that turn, a load that is there.
    let body = &recording.entities["/world/train/load"];
    assert_eq!(body.times.len(), 1501);
    let wheels = recording
        .entities
        .iter()
        .filter(|(name, e)| {
            (name.ends_with("friction_wheel_left/spin")
                || name.ends_with("friction_wheel_right/spin"))
                && e.times.len() == 1501
        })
        .count();
    assert_eq!(wheels, 16);
    assert!(
        !recording.layout.is_empty(),
        "the viewer's layout is in the file"
    );
}

/// By default lines are thinned: they reach as low and as high in each fifth of a second as all rows do. What lies
/// between two rows of the same value is drawn without a row of its own.
#[cfg(feature = "viewer")]
#[test]
fn thinned_lines_show_what_all_rows_show() {
    type Rows = Vec<(i64, u64)>;
    let out = tempfile::tempdir().unwrap();
    let read = |name: &str, more: &[&str]| {
        let path = run(&out.path().join(name), "minimal", more).join("run.rrd");
        let bytes = std::fs::metadata(&path).unwrap().len();
        (monorig_viz::readback::read(&path).unwrap(), bytes)
    };
    let ((thinned, small), (full, large)) = (read("thinned", &[]), read("full", &["--full-rate"]));
    assert!(2 * small < large, "{small} bytes of {large}");
    let rows = |line: &monorig_viz::readback::Entity| -> Rows {
        let bits = line.scalars.iter().map(|x| x.to_bits());
        line.times.iter().copied().zip(bits).collect()
    };
    let is_drawn = |line: &Rows, row: &(i64, u64)| {
        let next = line.partition_point(|other| other.0 < row.0);
        let has_value = |other: Option<&(i64, u64)>| other.is_some_and(|other| other.1 == row.1);
        let on_flat = next > 0 && has_value(line.get(next - 1)) && has_value(line.get(next));
        on_flat || line.get(next) == Some(row)
    };
    let (mut lines, mut samples) = (0, 0);
    for (name, all) in &full.entities {
        let (here, all) = (rows(&thinned.entities[name]), rows(all));
        let of = |groups: &[&str]| groups.iter().any(|group| name.starts_with(group));
        let (line, sample) = (of(&["/truth/", "/control/"]), of(&["/sensors/", "/aid/"]));
        if line || sample {
            for period in all.chunk_by(|a, b| a.0 / 200_000_000 == b.0 / 200_000_000) {
                let number = |row: &&(i64, u64)| f64::from_bits(row.1);
                let by_value = |a: &&(i64, u64), b: &&(i64, u64)| number(a).total_cmp(&number(b));
                for end in [
                    period.iter().min_by(by_value),
                    period.iter().max_by(by_value),
                ] {
                    let same = |row: &&(i64, u64)| end.is_some_and(|end| row.1 == end.1);
                    let drawn = period.iter().filter(same).any(|row| is_drawn(&here, row));
                    assert!(drawn, "{name} at {} ns", period[0].0);
                }
            }
        } else {
            continue;
        }
        lines += usize::from(line);
        samples += usize::from(sample);
        assert!(here.iter().all(|row| all.contains(row)), "{name}");
    }
    assert!(
        lines > 20 && samples > 20,
        "{lines} lines, {samples} streams of samples"
    );
    let events = |of: &monorig_viz::readback::Recording| {
        let events = of.entities.get("/events");
        events.map(|e| (e.times.clone(), e.texts.clone()))
    };
    assert_eq!(events(&thinned), events(&full));
    for (name, all) in full
        .entities
        .iter()
        .filter(|(_, e)| !e.positions.is_empty())
    {
        assert_eq!(&thinned.entities[name], all, "{name}");
    }
}

/// The bound stands beside the errors: in the columns, and in the recording as a band of
/// two standard deviations round zero.
#[cfg(feature = "viewer")]
#[test]
fn the_cramer_rao_bound_is_recorded() {
    let out = tempfile::tempdir().unwrap();
    let folder = run(out.path(), "minimal", &[]);
    let all = columns(&folder);
    let recording = monorig_viz::readback::read(&folder.join("run.rrd")).unwrap();
    let band = &recording.entities["/display/bound/grade/two_sigma"];
    let times = band.times.iter().zip(band.scalars.chunks_exact(2));
    let mut compared = 0;
    for (ns, ends) in times.filter(|(_, ends)| ends[0].is_finite()) {
        let same = |t: &f64| (t * 1e9).round() as i64 == *ns;
        let i = all["time"].iter().position(same).unwrap();
        let half = 2.0 * all["bound/grade"][i].to_degrees();
        assert!((ends[1] - half).abs() < 1e-9 && ends[0] == -ends[1]);
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

#[cfg(feature = "viewer")]
#[test]
fn live_without_a_viewer_does_not_hang() {
    let out = tempfile::tempdir().unwrap();
    let start = std::time::Instant::now();
    let folder = run(out.path(), "minimal", &["--live"]);
    assert!(start.elapsed().as_secs() < 20);
    assert!(
        monorig_viz::readback::read(&folder.join("run.rrd"))
            .unwrap()
            .complete
    );
}
