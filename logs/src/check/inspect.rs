//! The contents of a log: tables, columns, units, rates, jitter, gaps, ranges; and a map proposed for it, by names and
//! units of the columns.

use crate::notation::{NS, UNITS};
use crate::read::{Part, ReadOptions, full_name};
use monorig_sim::error::Error;
use std::path::Path;

/// Steps of time that are kept of a table, to find their median.
const KEPT_STEPS: usize = 100_000;
/// A step this many times the median is a gap.
const GAP: i64 = 5;

/// The contents of a file.
#[derive(Clone, Debug)]
pub struct Inspection {
    /// The name of its format.
    pub format: &'static str,
    is_can: bool,
    /// Its tables with a row.
    pub tables: Vec<TableReport>,
}

/// The contents of a table.
#[derive(Clone, Debug, Default)]
pub struct TableReport {
    /// Name; empty in a file of one table.
    pub name: String,
    /// Rows.
    pub rows: u64,
    /// First stamp, ns.
    pub from_ns: i64,
    /// Last stamp, ns.
    pub to_ns: i64,
    /// Median step of time, ns.
    pub step_ns: i64,
    /// Standard deviation of the steps that are no gaps, ns.
    pub jitter_ns: f64,
    /// Steps of more than five times the median.
    pub gaps: u64,
    /// Rows whose time is before that of the row before.
    pub backwards: u64,
    /// Its columns.
    pub columns: Vec<ColumnReport>,
    steps: Vec<i64>,
    last_ns: Option<i64>,
}

/// The contents of a column.
#[derive(Clone, Debug, Default)]
pub struct ColumnReport {
    /// Name.
    pub name: String,
    /// Unit in the file; empty if there is none.
    pub unit: String,
    /// Values that are numbers.
    pub values: u64,
    /// Least value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean value.
    pub mean: f64,
}

impl TableReport {
    /// Rows per second, Hz, by the median step.
    pub fn rate_hz(&self) -> f64 {
        NS as f64 / self.step_ns as f64
    }

    fn push(&mut self, stamp_ns: i64, values: &[f64]) {
        if self.rows == 0 {
            self.from_ns = stamp_ns;
        }
        if let Some(last) = self.last_ns.replace(stamp_ns) {
            let step = stamp_ns.saturating_sub(last);
            self.backwards += u64::from(step < 0);
            if self.steps.len() < KEPT_STEPS {
                self.steps.push(step);
            } else if self.step_ns == 0 {
                self.settle();
            }
            self.gaps += u64::from(self.step_ns > 0 && step > GAP * self.step_ns);
        }
        self.rows += 1;
        self.to_ns = stamp_ns;
        for (column, &x) in self
            .columns
            .iter_mut()
            .zip(values)
            .filter(|(_, x)| !x.is_nan())
        {
            if column.values == 0 {
                (column.min, column.max) = (x, x);
            }
            column.values += 1;
            column.min = column.min.min(x);
            column.max = column.max.max(x);
            column.mean += (x - column.mean) / column.values as f64;
        }
    }

    /// The figures of the steps kept so far.
    fn settle(&mut self) {
        let mut sorted = self.steps.clone();
        sorted.sort_unstable();
        self.step_ns = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let regular = |s: &&i64| **s <= GAP * self.step_ns;
        self.gaps += self.steps.iter().filter(|s| !regular(s)).count() as u64;
        let kept: Vec<f64> = self
            .steps
            .iter()
            .filter(regular)
            .map(|s| *s as f64)
            .collect();
        let n = kept.len().max(1) as f64;
        let mean = kept.iter().sum::<f64>() / n;
        self.jitter_ns = (kept.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n).sqrt();
    }
}

/// Reads a whole file, and reports its contents.
pub fn inspect(path: &Path, options: &ReadOptions) -> Result<Inspection, Error> {
    let file = Part::whole(path, options)?;
    let mut tables: Vec<TableReport> = Vec::new();
    file.scan(&mut |chunk| {
        for (i, table) in chunk.tables.iter().enumerate() {
            if i >= tables.len() {
                tables.push(TableReport {
                    name: table.name.clone(),
                    ..TableReport::default()
                });
            }
            let known = tables.get_mut(i).map(|t| &mut t.columns);
            if let Some(known) = known.filter(|k| k.len() < table.columns.len()) {
                let more = table.columns.iter().skip(known.len());
                known.extend(more.map(|c| ColumnReport {
                    name: c.name.clone(),
                    unit: c.unit.clone(),
                    ..ColumnReport::default()
                }));
            }
        }
        for row in &chunk.rows {
            if let Some(table) = tables.get_mut(row.table as usize) {
                table.push(row.stamp_ns, chunk.values_of(row));
            }
        }
        true
    })?;
    for table in &mut tables {
        if table.step_ns == 0 {
            table.settle();
        }
    }
    tables.retain(|t| t.rows > 0);
    Ok(Inspection {
        format: file.format.name(),
        is_can: file.format.is_can(),
        tables,
    })
}

/// A file of a log that a map is proposed for: its name in the map, that of the file, and what is in it.
pub type InspectedFile<'a> = (String, String, &'a Inspection);

/// A map file for the files of a log, to be looked through: a comment marks guesses from names.
pub fn proposed_map(files: &[InspectedFile<'_>]) -> String {
    let names: Vec<String> = files
        .iter()
        .map(|(name, file, _)| format!("{name}: {}", quoted(file)))
        .collect();
    let mut lines = vec![
        "version: 1".to_owned(),
        format!("files: {{{}}}", names.join(", ")),
    ];
    if files.iter().any(|(_, _, found)| found.is_can) {
        lines.push("dbc: DATABASE.dbc".into());
    }
    let tables = || files.iter().flat_map(|(_, _, found)| &found.tables);
    let rate = tables().map(TableReport::rate_hz);
    let rate = rate.filter(|r| r.is_finite()).fold(1.0, f64::max);
    lines.push(format!(
        "step: {{rate_hz: {}}}",
        rate.round().clamp(1.0, 200.0)
    ));
    lines.push("nominal: {tare_kg: ???, wheel_radius_m: ???}   # or vehicle: FILE".into());
    lines.push(
        "channels:   # guessed from the names of the columns: check each unit and axis".into(),
    );
    // where there are several files a channel says which
    let of = |name: &str| match files.len() {
        1 => String::new(),
        _ => format!("file: {name}, "),
    };
    let list = |columns: &[(String, Option<&str>)]| {
        let columns: Vec<String> = columns.iter().map(|c| quoted(&c.0)).collect();
        columns.join(", ")
    };
    let (mut found, mut used) = (false, Vec::new());
    for (channel, unit, axes) in [
        ("specific_force", "m/s2", &ACCELERATION[..]),
        ("angular_rate", "rad/s", &RATE[..]),
    ] {
        let mut all = files.iter();
        let first = all.find_map(|(name, _, file)| Some((name, file.triple(axes)?)));
        if let Some((name, (columns, told))) = first {
            found = true;
            used.extend(columns.clone());
            let columns: Vec<String> = columns.iter().map(|c| quoted(c)).collect();
            lines.push(format!(
                "  {channel}: {{{}columns: [{}], unit: {}, axes: [forward, left, up]}}",
                of(name),
                columns.join(", "),
                told.unwrap_or(unit)
            ));
        }
    }
    let first = |words: &[&str], units: &[&str], used: &[String]| {
        let mut all = files
            .iter()
            .map(|(name, _, file)| (name, file.like(words, units, used)));
        all.find(|(_, columns)| !columns.is_empty())
    };
    if let Some((name, wheels)) = first(&WHEELS, &["m/s", "km/h"], &used) {
        found = true;
        let unit = wheels.iter().find_map(|w| w.1).unwrap_or("m/s");
        lines.push(format!(
            "  wheel_speed: [{{{}columns: [{}], unit: {unit}}}]",
            of(name),
            list(&wheels)
        ));
    }
    if let Some((name, torques)) = first(&TORQUES, &["Nm", "kNm"], &used) {
        found = true;
        let unit = torques.iter().find_map(|w| w.1).unwrap_or("Nm");
        lines.push(format!(
            "  traction: {{{}torque: [{}], unit: {unit}}}   # gear ratio and radius: `nominal`",
            of(name),
            list(&torques)
        ));
    }
    if !found {
        lines.push("  wheel_speed: [{columns: [???], unit: m/s}]   # no column has a name that says what it is".into());
    }
    lines.extend(references(files, &of));
    lines.push("estimators: {ekf_v_theta_biases: {}}".into());
    lines.join("\n") + "\n"
}

/// The references of a map: columns of the slope and of a mass that stays.
fn references(files: &[InspectedFile<'_>], of: &dyn Fn(&str) -> String) -> Vec<String> {
    let mut lines = Vec::new();
    let slope = [
        ("slope_deg", "deg"),
        ("grade_deg", "deg"),
        ("slope_rad", "rad"),
        ("slope_percent", "%"),
    ];
    let columns = || {
        let each = files.iter().flat_map(|(name, _, file)| {
            let tables = file.tables.iter();
            tables.flat_map(move |t| t.columns.iter().map(move |c| (name, t, c)))
        });
        each.filter(|(_, _, c)| c.values > 0)
    };
    let named = |c: &ColumnReport, word: &str| ends_with_word(&c.name, word);
    let found = columns().find_map(|(name, t, c)| {
        let (_, unit) = slope.iter().find(|(word, _)| named(c, word))?;
        Some((name, full_name(&t.name, &c.name), *unit))
    });
    if let Some((name, column, unit)) = found {
        lines.push(format!(
            "  slope: {{{}column: {}, unit: {unit}, sd_deg: 0.1}}   # sd_deg: how well it is known",
            of(name),
            quoted(&column)
        ));
    }
    let mass = columns().find(|(_, _, c)| named(c, "mass_kg") && c.min == c.max && c.min > 0.0);
    if let Some((_, _, c)) = mass {
        lines.push(format!(
            "  mass: {{kg: {}, sd_kg: {:.0}}}",
            c.min,
            0.02 * c.min
        ));
    }
    if !lines.is_empty() {
        lines.insert(0, "reference:".into());
    }
    lines
}

impl Inspection {
    /// A map file for this log alone.
    pub fn proposed_map(&self, file: &str) -> String {
        proposed_map(&[("log".to_owned(), file.to_owned(), self)])
    }

    /// Three columns of one table whose names end as one of these triples, and their unit.
    fn triple(&self, endings: &[[&str; 3]]) -> Option<(Vec<String>, Option<&'static str>)> {
        for table in &self.tables {
            for axes in endings {
                let column = |ending: &&str| {
                    table
                        .columns
                        .iter()
                        .find(|c| ends_with_word(&c.name, ending))
                };
                let columns: Vec<&ColumnReport> = axes.iter().filter_map(column).collect();
                if columns.len() == 3 {
                    let unit = columns.first().and_then(|c| known_unit(&c.unit));
                    return Some((
                        columns
                            .iter()
                            .map(|c| full_name(&table.name, &c.name))
                            .collect(),
                        unit,
                    ));
                }
            }
        }
        None
    }

    /// Columns with one of these words in their name, of one of these units or none.
    fn like(
        &self,
        words: &[&str],
        units: &[&str],
        used: &[String],
    ) -> Vec<(String, Option<&'static str>)> {
        let mut found = Vec::new();
        for table in &self.tables {
            for c in &table.columns {
                let name = c.name.to_lowercase();
                let full = full_name(&table.name, &c.name);
                let unit = known_unit(&c.unit);
                let fits = unit.map_or(c.unit.is_empty(), |u| units.contains(&u));
                if fits
                    && words
                        .iter()
                        .any(|w| (w.len() > 2 && name.contains(w)) || ends_with_word(&name, w))
                    && !OTHERS.iter().any(|w| name.contains(w))
                    && !used.contains(&full)
                    && found.len() < 8
                {
                    found.push((full, unit));
                }
            }
        }
        found
    }
}

/// Words of wheel speeds and of torques in names of columns.
const WHEELS: [&str; 7] = ["wheel", "vel", "speed", "fl", "fr", "rl", "rr"];
const TORQUES: [&str; 4] = ["torque", "trq", "moment", "effort"];
/// Words of columns that are neither.
const OTHERS: [&str; 7] = [
    "steer",
    "engine",
    "motor_speed",
    "rpm",
    "slope",
    "wind",
    "request",
];

/// Endings of the columns of an accelerometer, axis by axis.
const ACCELERATION: [[&str; 3]; 5] = [
    [
        "linear_acceleration.x",
        "linear_acceleration.y",
        "linear_acceleration.z",
    ],
    ["acc_x", "acc_y", "acc_z"],
    ["accel_x", "accel_y", "accel_z"],
    ["fx", "fy", "fz"],
    ["ax", "ay", "az"],
];
/// The same of a gyro.
const RATE: [[&str; 3]; 4] = [
    [
        "angular_velocity.x",
        "angular_velocity.y",
        "angular_velocity.z",
    ],
    ["gyro_x", "gyro_y", "gyro_z"],
    ["wx", "wy", "wz"],
    ["gx", "gy", "gz"],
];

/// True if a name, without a unit in brackets, ends with this word.
fn ends_with_word(name: &str, word: &str) -> bool {
    let name = name.to_lowercase();
    let bare = name.split([' ', '[', '(']).next().unwrap_or_default();
    bare.strip_suffix(word)
        .is_some_and(|rest| rest.chars().last().is_none_or(|c| !c.is_alphanumeric()))
}

fn known_unit(unit: &str) -> Option<&'static str> {
    UNITS.iter().find(|u| u.is_called(unit)).map(|u| u.name)
}

/// A name in quotes where YAML needs them.
fn quoted(name: &str) -> String {
    let plain = name
        .chars()
        .all(|c| c.is_alphanumeric() || "_./".contains(c))
        && name.starts_with(|c: char| c.is_alphabetic() || c == '/');
    match plain {
        true => name.to_owned(),
        false => format!("'{}'", name.replace('\'', "''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_jitter_gaps_and_a_map() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("drive.csv");
        let mut text = "t,ax,ay,az,speed [km/h]\n".to_owned();
        for i in 0..1000 {
            let t = f64::from(i) * 0.01 + if i >= 500 { 3.0 } else { 0.0 };
            text += &format!("{t:.3},0.5,{},9.81,3.6\n", f64::from(i % 7));
        }
        std::fs::write(&path, text).unwrap();
        let found = inspect(&path, &ReadOptions::default()).unwrap();
        let [table] = found.tables.as_slice() else {
            panic!()
        };
        assert_eq!((table.rows, table.gaps, table.backwards), (1000, 1, 0));
        assert!((table.rate_hz() - 100.0).abs() < 1e-9 && table.jitter_ns < 1.0);
        let ay = &table.columns[1];
        assert_eq!(
            (ay.name.as_str(), ay.min, ay.max, ay.values),
            ("ay", 0.0, 6.0, 1000)
        );
        let map = found.proposed_map("drive.csv");
        for line in [
            "columns: [ax, ay, az], unit: m/s2",
            "columns: ['speed [km/h]'], unit: km/h",
            "rate_hz: 100",
        ] {
            assert!(map.contains(line), "{line} in\n{map}");
        }
    }

    /// Three files make one map: the IMU, the four wheels without the steering, the torque, and the references.
    #[test]
    fn files_of_a_folder_make_one_map() {
        let dir = tempfile::tempdir().unwrap();
        let found: Vec<(String, String, Inspection)> = [
            ("imu", "acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"),
            (
                "can",
                "fl [km/h],fr [km/h],rl [km/h],rr [km/h],steering_wheel_speed,torque [Nm]",
            ),
            ("ref", "slope_deg,mass_kg"),
        ]
        .map(|(name, columns)| {
            let path = dir.path().join(format!("{name}.csv"));
            let n = columns.split(',').count();
            let row = |i: i32| format!("{}{}\n", f64::from(i) * 0.02, ",1720".repeat(n));
            let text = format!("t,{columns}\n{}", (0..50).map(row).collect::<String>());
            std::fs::write(&path, text).unwrap();
            let found = inspect(&path, &ReadOptions::default()).unwrap();
            (name.to_owned(), format!("{name}.csv"), found)
        })
        .into();
        let files: Vec<_> = found
            .iter()
            .map(|(a, b, c)| (a.clone(), b.clone(), c))
            .collect();
        let map = proposed_map(&files);
        for line in [
            "files: {imu: imu.csv, can: can.csv, ref: ref.csv}",
            "specific_force: {file: imu, columns: [acc_x, acc_y, acc_z]",
            "wheel_speed: [{file: can, columns: ['fl [km/h]', 'fr [km/h]', 'rl [km/h]', 'rr [km/h]'], unit: km/h}]",
            "traction: {file: can, torque: ['torque [Nm]'], unit: Nm}",
            "slope: {file: ref, column: slope_deg, unit: deg",
            "mass: {kg: 1720, sd_kg: 34}",
        ] {
            assert!(map.contains(line), "{line} in\n{map}");
        }
    }
}
