//! A folder with a good scenario and all it names in it, and the real binary run there.

use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

/// A text without the line breaks that a terminal needs.
pub fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A scenario that uses every part of the format.
pub const GOOD: &str = "\
version: 1
why: A sample.
track: track.yaml
train: train.yaml
load: {mass_kg: 2500}
start: {chainage_m: 25, speed_mps: 0}
stop: {after_s: 60}
physics: {dt_ms: 2, plant: rapier}
drive:
  speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1.0}]
  controller: {kp: 1.5, ki: 0.5, feedforward: estimate, hold: true}
sensors: sensors.yaml
estimators:
  dffrls_aekf_robust: {lambda0: 0.98}
in_loop: dffrls_aekf_robust
events:
  - {at_s: 30, load_mass_kg: 1500}
  - {from_m: 80, to_m: 95, adhesion: 0.12}
  - {from_s: 40, to_s: 43, sensor: imu, fault: stuck}
obstacles: [{at_m: 50, left_m: 2, up_m: -1, size_m: [1, 1, 1]}]
seeds: 1..10
record: {rate_hz: 50}
expect:
  - {estimator: dffrls_aekf_robust, metric: mass_error_rel_max, after_s: 10, at_most: 0.032}
availability: {mass: 0.1}
integrity: {max_misleading_share: 1}
";

/// A track with elements of many kinds, 124 m long.
pub const TRACK: &str = "\
version: 1
name: sample
profile: rails/i140e.yaml
horizontal:
  - {kind: line, length_m: 40}
  - {kind: arc, radius_m: 10, angle_deg: 90, easement_m: 2}
  - {kind: clothoid, length_m: 3, to_radius_m: -20}
  - {kind: repeat, times: 2, elements: [{kind: line, length_m: 10}]}
vertical:
  - {kind: grade, grade_deg: 0, length_m: 60}
  - {kind: arc, radius_m: 20, to_grade_deg: 8}
  - {kind: transition, length_m: 10, to_grade_deg: 5}
  - {kind: grade, length_m: 50}
joints: {every_m: 3, kink_deg: 0.1, step_m: 0}
";

/// A surveyed track, for `--set track=surveyed.yaml`.
pub const SURVEYED: &str = "\
version: 1
name: surveyed
profile: rails/i140e.yaml
survey: {file: survey.csv, height_noise_m: 0.003}
";

/// Its survey.
pub const SURVEY: &str = "\
# made up
s_m,height_m
0,0
20,0.1
40,0.3
60,0.9
80,1.4
100,1.2
120,1.1
140,1.0
";

/// A train of one unit.
pub const TRAIN: &str = "\
version: 1
name: sample
consist:
  - {name: drive_1, unit: units/drive_unit.yaml}
drawbar: {stiffness_npm: 5.0e+6, damping_nspm: 2.0e+4}
load: {name: load, unit: units/load_block.yaml, under: drive_1}
drive: {torque_max_nm: 160, power_kw: 60}
limits: {min_radius_horizontal_m: 4, min_radius_vertical_m: 8, max_grade_deg: 30, max_speed_mps: 2.4, max_load_kg: 2500}
resistance: {clamped_wheel: 0, running_wheel: 0.4, guide_wheel: 0, bearing_n: 0, bearing_nspm: 0, air_nspm2: 0}
";

/// A sensor sheet.
pub const SENSORS: &str = "\
version: 1
source: A sample.
accelerometer: {mount: imu_link, sampling: {rate_hz: 200}, errors: {noise_density: 0.001, range: [-50, 50]}}
gyro: {mount: drive_1/imu_link, sampling: {rate_hz: 100}, misalignment_sd_deg: 0.5, errors: {random_walk_of_integral: 5.8e-5}}
wheel_speed: {sampling: {rate_hz: 125, jitter_ms: 1, latency_ms: 5, dropout: 0.01}, errors: {noise_sd: 0.005}}
motor_torque: {sampling: {rate_hz: 250}}
";

/// Files of the project itself that go into the folder.
const OWN: &[(&str, &[&str])] = &[
    ("rails", &["i140e.yaml"]),
    ("road", &["hongqi_ehs3.yaml"]),
    (
        "units",
        &[
            "drive_unit.yaml",
            "drive_unit.urdf",
            "load_block.yaml",
            "load_block.urdf",
            "cab.yaml",
            "cab.urdf",
            "carrier_trolley.yaml",
            "carrier_trolley.urdf",
            "meshes/cab_shell.stl",
            "meshes/clamp_arm.stl",
        ],
    ),
];

/// The project's folder.
pub fn project() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The folder; gone when dropped.
pub struct TestFolder(tempfile::TempDir);

impl TestFolder {
    /// With the good scenario and the files it names.
    pub fn new() -> Self {
        let dir = Self(tempfile::tempdir().unwrap());
        for (name, text) in [
            ("scenario.yaml", GOOD),
            ("track.yaml", TRACK),
            ("surveyed.yaml", SURVEYED),
            ("survey.csv", SURVEY),
            ("train.yaml", TRAIN),
            ("sensors.yaml", SENSORS),
        ] {
            dir.write(name, text.as_bytes());
        }
        std::fs::create_dir_all(dir.path("units/meshes")).unwrap();
        std::fs::create_dir_all(dir.path("rails")).unwrap();
        std::fs::create_dir_all(dir.path("road")).unwrap();
        for (folder, names) in OWN {
            for name in *names {
                let from = project().join("assets").join(folder).join(name);
                std::fs::copy(from, dir.path(folder).join(name)).unwrap();
            }
        }
        dir
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    /// A file's text.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// Write a file.
    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.0.path().join(name), bytes).unwrap();
    }

    /// Make a link to itself: a file even root cannot read.
    pub fn circle(&self, name: &str) {
        let path = self.path(name);
        std::os::unix::fs::symlink(path.file_name().unwrap(), &path).unwrap();
    }

    /// Run monorig in the folder: exit code, standard output, standard error.
    pub fn monorig(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        self.monorig_to(arguments, Stdio::piped())
    }

    /// The same with standard output somewhere else.
    pub fn monorig_to(&self, arguments: &[&str], out: Stdio) -> (Option<i32>, String, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monorig"));
        self.output(command.args(arguments).stdout(out))
    }

    /// Run any command in the folder: exit code, standard output, standard error.
    pub fn output(&self, command: &mut Command) -> (Option<i32>, String, String) {
        let child = command
            .current_dir(self.0.path())
            .env("NO_COLOR", "1")
            .env_remove("CLICOLOR_FORCE")
            .env("COLUMNS", "100")
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let output = child.unwrap().wait_with_output().unwrap();
        (
            output.status.code(),
            self.plain(&output.stdout),
            self.plain(&output.stderr),
        )
    }

    /// Runs monorig, which must refuse: code 2, no panic, nothing left behind. Returns its words.
    pub fn refused(&self, arguments: &[&str]) -> String {
        let before = self.names();
        let (code, out, err) = self.monorig(arguments);
        assert_eq!(code, Some(2), "{arguments:?}\n{out}{err}");
        assert!(!err.contains("panicked"), "{err}");
        assert_eq!(self.names(), before, "something was left behind");
        assert!(!err.is_empty());
        format!("{out}{err}")
    }

    /// Every file and folder there is.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        list(self.0.path(), &mut names);
        names.sort();
        names
    }

    fn plain(&self, bytes: &[u8]) -> String {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        text.replace(&self.0.path().display().to_string(), "FOLDER")
    }
}

fn list(folder: &Path, names: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        names.push(entry.path().display().to_string());
        if entry.file_type().unwrap().is_dir() {
            list(&entry.path(), names);
        }
    }
}

/// All columns by name; NaN = null.
pub fn columns(folder: &Path) -> BTreeMap<String, Vec<f64>> {
    use arrow_array::Array;
    use arrow_array::cast::AsArray;
    use arrow_array::types::Float64Type;
    let file = File::open(folder.join("channels.parquet")).unwrap();
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for batch in ParquetRecordBatchReaderBuilder::try_new(file)
        .unwrap()
        .build()
        .unwrap()
    {
        let batch = batch.unwrap();
        for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
            let column = column.as_primitive::<Float64Type>();
            let values = (0..column.len()).map(|i| {
                if column.is_null(i) {
                    f64::NAN
                } else {
                    column.value(i)
                }
            });
            all.entry(field.name().clone()).or_default().extend(values);
        }
    }
    all
}

/// Words of a message, and the kind of error that has them; the first that fits counts. An error with none of them
/// breaks a rule.
const KINDS: &[(&str, &str)] = &[
    ("invalid value '", "usage"),
    ("unexpected argument", "usage"),
    ("required arguments", "usage"),
    ("the argument '", "usage"),
    ("unrecognized subcommand", "usage"),
    ("unknown key", "unknown key"),
    ("` is missing", "missing key"),
    ("is given twice", "key twice"),
    ("format version", "version"),
    ("expected ", "wrong type"),
    ("nested too deeply", "too deep"),
    ("is empty", "empty"),
    ("does not exist", "no file"),
    ("is a folder, not a file", "no file"),
    ("not a regular file", "no file"),
    ("cannot be read", "unreadable"),
    ("symbolic links", "unreadable"),
    ("not text in UTF-8", "not text"),
    ("not a URDF file", "unreadable"),
    ("STL file", "unreadable"),
    ("not a number", "wrong number"),
    ("is not above zero", "wrong number"),
    ("is too large; write", "wrong number"),
    ("too large for a mine", "wrong number"),
    ("is infinite", "wrong number"),
    ("is not known here", "unknown name"),
    ("there is no ", "unknown name"),
    ("needs a list", "unknown name"),
    ("the list has only", "unknown name"),
    ("no estimator in the loop", "unknown name"),
    ("no estimator is given", "unknown name"),
    ("no metric is called", "unknown name"),
    ("have no metric", "unknown name"),
    ("no seed is given", "unknown name"),
    ("has no bound", "unknown name"),
    ("has no column", "unknown name"),
    ("has no condition", "unknown name"),
    ("has no scenario", "unknown name"),
    ("has no unit", "unknown name"),
    ("has no parameter", "unknown name"),
    ("is not among", "unknown name"),
    ("has no link", "unknown name"),
    ("has no suitable link", "unknown name"),
    ("no sensor", "unknown name"),
    ("files cannot be used", "bad files"),
];

/// A row of a table of refusals: the case, then kind and place (file:line:column) of each error, and its key. That each
/// error with a place shows the line with a mark, and what would be right, is checked here.
pub fn row(case: &str, told: &str) -> String {
    let errors = || told.lines().filter_map(|l| l.strip_prefix("error: "));
    let rows: Vec<[&str; 3]> = errors().map(kind_place_and_key).collect();
    // a file that is not text has no line to show
    let has_column = |place: &str| {
        place
            .rsplit(':')
            .next()
            .is_some_and(|c| c.parse::<u32>().is_ok())
    };
    let marked = |row: &&[&str; 3]| has_column(row[1]) && row[0] != "not text";
    let marks = told.lines().filter(|l| l.trim_end().ends_with('^'));
    assert_eq!(
        marks.count(),
        rows.iter().filter(marked).count(),
        "{case}: {told}"
    );
    let helped = |row: &&[&str; 3]| !["usage", "unreadable", "bad files"].contains(&row[0]);
    let help = told.matches("\n  help: ").count();
    assert!(help >= rows.iter().filter(helped).count(), "{case}: {told}");
    let rows: Vec<String> = rows.iter().map(|row| row.join(" | ")).collect();
    format!("{case:<44} {}", rows.join(" + "))
}

fn kind_place_and_key(error: &str) -> [&str; 3] {
    let kind = KINDS.iter().find(|(words, _)| error.contains(words));
    let kind = kind.map_or("rule", |(_, kind)| *kind);
    let is_place = |p: &str| p == "." || p.contains(['.', '/']) && !p.contains(' ');
    let (place, rest) = match error.split_once(": ") {
        Some((place, rest)) if is_place(place) => (place, rest),
        _ => ("-", error),
    };
    let is_key = |k: &str| !k.contains(' ') || k.starts_with("link `") || k.starts_with("joint `");
    let key = rest.split_once(": ").map(|(key, _)| key);
    [kind, place, key.filter(|k| is_key(k)).unwrap_or("-")]
}

/// Compiles a source of the project into the folder, with these words defined. False where there is no compiler.
#[cfg(unix)]
pub fn compile(dir: &TestFolder, library: &str, source: &str, defined: &str) -> bool {
    let Some(mut cc) = monorig_testing::c_compiler() else {
        return false;
    };
    let project = project();
    cc.args(["-shared", "-fPIC", "-O2", "-std=c99", "-I"]);
    cc.arg(project.join("interfaces/c/include"));
    cc.args(defined.split_whitespace().map(|word| format!("-D{word}")));
    cc.arg("-o").arg(dir.path(library));
    cc.arg(project.join(source)).arg("-lm");
    assert!(cc.status().unwrap().success());
    true
}

/// Compiles the filter in C of the example into the folder. False where there is no compiler.
#[cfg(unix)]
pub fn two_state(dir: &TestFolder) -> bool {
    let source = "examples/own_estimator_c/two_state.c";
    compile(dir, "two_state.so", source, "")
}

/// The scenario of the example in C, for a folder elsewhere.
pub fn climb_in_c() -> String {
    let example = project().join("examples/own_estimator_c/climb.yaml");
    let assets = project().join("assets").canonicalize().unwrap();
    let text = std::fs::read_to_string(example).unwrap();
    text.replace("../../assets", &assets.display().to_string())
}
