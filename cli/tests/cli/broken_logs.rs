//! Logs as loggers, spreadsheets and clocks break them: the drive of the walk in the chapter on logs, with one of its
//! files edited. Each is the result of the sound log, or an error with file, line and column, or found by `--check`.

use crate::common::{TestFolder, project, words};

/// A folder with the drive in `log`.
struct Drive(TestFolder);

impl Drive {
    fn new() -> Self {
        let dir = TestFolder::new();
        std::fs::create_dir(dir.path("log")).unwrap();
        let drive = Self(dir);
        for file in ["imu.csv", "can.csv", "ref.csv", "drive.map.yaml"] {
            drive.write(file, &sound(file));
        }
        drive
    }

    fn write(&self, file: &str, text: &str) {
        std::fs::write(self.0.path("log").join(file), text).unwrap();
    }

    /// RMSE of the slope by `attitude`, °.
    fn rmse_deg(&self) -> f64 {
        let map = ["replay", "--map", "log/drive.map.yaml", "--no-rerun"];
        let how = ["--estimators", "attitude", "--out", "out"];
        let (code, out, err) = self.0.monorig(&[&map[..], &how[..]].concat());
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
        let metrics = self.0.path("out/drive/1/metrics.json");
        let metrics = std::fs::read_to_string(metrics).unwrap();
        let metrics: serde_json::Value = serde_json::from_str(&metrics).unwrap();
        let rmse = &metrics["estimators"]["attitude"]["slope_rmse_deg"];
        rmse.as_f64().unwrap()
    }

    /// Returns the lines of `--check` that call something wrong.
    fn bad(&self, sets: &[&str]) -> Vec<String> {
        let mut arguments = vec!["replay", "--map", "log/drive.map.yaml", "--check"];
        arguments.extend(sets.iter().flat_map(|s| ["--set", s]));
        let (code, out, err) = self.0.monorig(&arguments);
        assert!(matches!(code, Some(0 | 1)), "{out}{err}");
        let bad = out.lines().filter(|l| l.starts_with("BAD"));
        bad.map(str::to_owned).collect()
    }
}

fn sound(file: &str) -> String {
    std::fs::read_to_string(project().join("examples/car_drive").join(file)).unwrap()
}

/// The file with its rows edited: their fields by number, from 0; a row of none is left out.
fn rows(file: &str, edit: impl Fn(usize, Vec<String>) -> Vec<Vec<String>>) -> String {
    let text = sound(file);
    let mut lines = text.lines();
    let mut out = vec![lines.next().unwrap().to_owned()];
    for (i, line) in lines.enumerate() {
        let fields = line.split(',').map(str::to_owned).collect();
        out.extend(edit(i, fields).iter().map(|row| row.join(",")));
    }
    out.join("\n") + "\n"
}

/// One field of one row is this word.
fn with_word(file: &str, row: usize, field: usize, word: &str) -> String {
    rows(file, |i, mut fields| {
        if i == row {
            fields[field] = word.to_owned();
        }
        vec![fields]
    })
}

/// Every time is another.
fn times(file: &str, of: impl Fn(f64) -> f64) -> String {
    rows(file, |_, mut fields| {
        fields[0] = format!("{:.6}", of(fields[0].parse().unwrap()));
        vec![fields]
    })
}

fn only(file: &str, holds: impl Fn(usize) -> bool) -> String {
    rows(file, |i, fields| match holds(i) {
        true => vec![fields],
        false => Vec::new(),
    })
}

/// Other separators, marks of the file, rows of units and rows written twice change no digit; slower wheels hardly any.
#[test]
fn what_loggers_write_differently_is_the_same_log() {
    let drive = Drive::new();
    let good = drive.rmse_deg();
    let imu = sound("imu.csv");
    let units = "s,m/s2,m/s2,m/s2,rad/s,rad/s,rad/s";
    for (what, text) in [
        ("decimal commas", imu.replace(',', ";").replace('.', ",")),
        ("tabs", imu.replace(',', "\t")),
        ("bars", imu.replace(',', "|")),
        ("Windows", format!("\u{feff}{}", imu.replace('\n', "\r\n"))),
        ("units", imu.replacen('\n', &format!("\n{units}\n"), 1)),
        ("twice", rows("imu.csv", |_, f| vec![f.clone(), f])),
        ("end", imu.lines().map(|l| l.to_owned() + ",\n").collect()),
    ] {
        drive.write("imu.csv", &text);
        assert_eq!(drive.rmse_deg(), good, "{what}");
    }
    drive.write("imu.csv", &with_word("imu.csv", 100, 2, ""));
    let empty = drive.rmse_deg();
    for word in [
        "NaN",
        "-nan",
        "-nan(ind)",
        "null",
        "None",
        "N/A",
        "#N/A",
        "-",
    ] {
        drive.write("imu.csv", &with_word("imu.csv", 100, 2, word));
        assert_eq!(drive.rmse_deg(), empty, "{word}");
    }
    drive.write("imu.csv", &imu);
    drive.write("can.csv", &only("can.csv", |i| i % 7 == 0));
    assert!((drive.rmse_deg() - good).abs() < 0.1);
}

/// A file that cannot be read is told with its place and what would be right.
#[test]
fn what_cannot_be_read_is_told_with_its_place() {
    let imu = sound("imu.csv");
    let (head, body) = imu.split_once('\n').unwrap();
    let quoted = |line: &str| {
        let fields = line.split(',');
        let fields: Vec<String> = fields
            .map(|f| format!("\"{f}\"").replace('.', ","))
            .collect();
        fields.join(",")
    };
    let commas: Vec<String> = body.lines().map(quoted).collect();
    let again = imu
        .lines()
        .take(500)
        .chain([head])
        .chain(imu.lines().skip(500));
    let again: Vec<&str> = again.collect();
    let restart = rows("imu.csv", |i, mut f| {
        let t: f64 = f[0].parse().unwrap();
        f[0] = format!("{:.2}", if i > 3000 { t - 60.02 } else { t });
        vec![f]
    });
    for (file, text, told) in [
        (
            "imu.csv",
            format!("{head}\n{}\n", commas.join("\n")),
            &["imu.csv:2:1", "`0,00`", "is no time"][..],
        ),
        (
            "imu.csv",
            format!("{head}\n{}", body.replace('.', ",")),
            &["imu.csv:2:1", "14 values", "7 names"],
        ),
        (
            "imu.csv",
            imu.replace(',', "   "),
            &["imu.csv:1:1", "nothing separates", "a comma, semicolon"],
        ),
        (
            "imu.csv",
            body.to_owned(),
            &[
                "imu.csv:1:1",
                "holds numbers",
                "a line with a name for each column",
            ],
        ),
        (
            "imu.csv",
            format!("{head}\n"),
            &["imu.csv", "no row after the names"],
        ),
        (
            "imu.csv",
            restart,
            &["imu.csv:3003:1", "goes back by 60.000", "pieces"],
        ),
        (
            "imu.csv",
            with_word("imu.csv", 100, 2, "#REF!"),
            &["imu.csv:102:12", "`#REF!`", "`acc_y`", "empty where"],
        ),
        (
            "can.csv",
            with_word("can.csv", 0, 5, "\"1,200.5\""),
            &["can.csv:2:26", "`1,200.5`", "a decimal point"],
        ),
        (
            "imu.csv",
            imu.replace("\n2.00,", "\n2.00,,"),
            &["imu.csv:102:1", "8 values"],
        ),
        (
            "imu.csv",
            again.join("\n"),
            &["imu.csv:501:1", "`t` in the column `t` is no time"],
        ),
        (
            "imu.csv",
            imu.replace("\n2.00,", "\n,"),
            &["imu.csv:102:1", "is no time"],
        ),
    ] {
        let drive = Drive::new();
        drive.write(file, &text);
        let error = drive
            .0
            .refused(&["replay", "--map", "log/drive.map.yaml", "--no-rerun"]);
        for part in told {
            assert!(words(&error).contains(part), "{part} in\n{error}");
        }
    }
}

/// A log that can be read and is wrong is found by the check, which finds nothing like it in the sound log.
#[test]
fn what_reads_well_and_is_wrong_is_found_by_the_check() {
    let drive = Drive::new();
    let sound_bad = drive.bad(&[]);
    let silent = "time without samples";
    let mph = "channels.wheel_speed=[{file: can, columns: ['speed_rl [km/h]', 'speed_rr [km/h]'], unit: mph}]";
    let spurious = rows("imu.csv", |i, fields| {
        let mut other = fields.clone();
        other[1] = "5.0".into();
        match i % 50 {
            0 => vec![fields, other],
            _ => vec![fields],
        }
    });
    for (what, text, sets, named) in [
        (
            "ten seconds are lost",
            only("imu.csv", |i| !(2000..2500).contains(&i)),
            &[][..],
            silent,
        ),
        ("the IMU stops", only("imu.csv", |i| i < 3000), &[], silent),
        (
            "the IMU begins late",
            only("imu.csv", |i| i > 5000),
            &[],
            silent,
        ),
        ("one row", only("imu.csv", |i| i == 0), &[], silent),
        ("minutes", times("imu.csv", |t| t / 60.0), &[], silent),
        ("milliseconds", times("imu.csv", |t| 1e3 * t), &[], ": rate"),
        ("two values at a time", spurious, &[], "sample and another"),
        (
            "miles per hour",
            sound("imu.csv"),
            &[mph],
            "gain of f on dv/dt",
        ),
    ] {
        drive.write("imu.csv", &text);
        let bad = drive.bad(sets);
        let new = || bad.iter().filter(|b| !sound_bad.contains(b));
        assert!(new().any(|b| b.contains(named)), "{what}: {bad:?}");
    }
}
