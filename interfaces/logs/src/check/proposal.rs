//! A map proposed for the files of a log, by the names, units and values of their columns.

use super::inspect::{ColumnReport, Inspection, TableReport};
use crate::notation::{Quantity, STANDARD_GRAVITY_MPS2, Title, is_one};
use crate::read::full_name;
use std::ptr;

/// A file of a log for which a map is proposed: its name in the map, that of the file, and what is in it.
pub type InspectedFile<'a> = (String, String, &'a Inspection);

/// A column with the words that describe it.
struct Candidate<'a> {
    /// Name of its file in the map.
    file: &'a str,
    /// Place of its table among all.
    table: usize,
    /// Name as a map writes it.
    name: String,
    title: Title,
    /// Words of file and table.
    around: Title,
    values: &'a ColumnReport,
}

/// Words of accelerometers and gyros; stems of their columns that are too short for a word: `ax`, `wx`.
const FORCE: Kind = Kind {
    words: "g acc accel acceleration accelerometer beschleunigung force",
    stems: "a f acc accel acceleration",
    quantity: Quantity::Acceleration,
};
const RATE: Kind = Kind {
    words: "gyro gyr gyroscope gyrometer angular rate omega drehrate",
    stems: "w g gyro gyr omega",
    quantity: Quantity::AngularRate,
};
/// Words of columns beside them that are neither: gravity taken off or alone, angles, magnetic fields.
const NOT_IMU: &str = "gravity user uncalibrated bias mag quat ref truth";

/// Words of wheel speeds, of single wheels, and of torques.
const SPEEDS: &str = "wheel wheels vel velocity speed v vf geschwindigkeit";
const WHEELS: &str = "wheel wheels wheelspeed fl fr rl rr";
const TORQUES: &str = "torque trq moment drehmoment motormoment effort wheeltorque enginetorque";
/// Words of columns that are none of these.
const OTHERS: &str = "steer steering engine rpm slope wind request requested accuracy limit target max min ref truth vertical angular fan rotation acc sd lateral";
/// Words of a speed that no wheel has.
const NO_WHEEL: &str = "gps gnss location ground laser";

/// Axes of an unknown instrument.
pub(super) const AXES: &str = "axes: [forward, left, up]";

/// A kind of instrument with three axes.
struct Kind {
    words: &'static str,
    stems: &'static str,
    quantity: Quantity,
}

/// A map file for the files of a log, to be checked by the user: a comment marks guesses from names.
pub fn proposed_map(files: &[InspectedFile<'_>]) -> String {
    let names: Vec<String> = files
        .iter()
        .map(|(name, file, _)| format!("{}: {}", quoted(name), quoted(file)))
        .collect();
    let mut lines = vec![
        "version: 1".to_owned(),
        format!("files: {{{}}}", names.join(", ")),
    ];
    if let Some(dbc) = files.iter().find_map(|(_, _, found)| found.dbc.as_ref()) {
        lines.push(format!("dbc: {}", quoted(&dbc.to_string_lossy())));
    }
    lines.extend(pieces(files));
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
    let all = candidates(files);
    let channels = channels(&all, files.len() > 1);
    if channels.is_empty() {
        lines.push(
            "  wheel_speed: [{columns: [???], unit: m/s}]   # no column name shows a wheel speed"
                .into(),
        );
    }
    lines.extend(channels);
    let references = references(&all, files.len() > 1);
    if !references.iter().any(|line| line.starts_with("  slope")) {
        lines.push(
            "  # no reference and no mount: the slope may be 3° off; mount_deg: {pitch: …}".into(),
        );
    }
    lines.extend(references);
    lines.push("estimators: {ekf_v_theta_biases: {}}".into());
    lines.join("\n") + "\n"
}

/// The column that tells the pieces of a log whose time begins anew: the only one without a number, of every table.
fn pieces(files: &[InspectedFile<'_>]) -> Option<String> {
    let tables = || files.iter().flat_map(|(_, _, found)| &found.tables);
    if tables().all(|t| t.backwards == 0) {
        return None;
    }
    let word = |t: &TableReport| {
        let mut words = t.columns.iter().filter(|c| c.values == 0);
        let first = words.next()?.name.clone();
        words.next().is_none().then_some(first)
    };
    let first = word(tables().next()?)?;
    let same = tables().all(|t| word(t).as_ref() == Some(&first));
    same.then(|| {
        format!(
            "time: {{pieces: {}}}   # the time begins again with each",
            quoted(&first)
        )
    })
}

/// Every column with a value.
fn candidates<'a>(files: &'a [InspectedFile<'_>]) -> Vec<Candidate<'a>> {
    let mut all = Vec::new();
    let mut tables = 0;
    for (file, path, found) in files {
        for table in &found.tables {
            tables += 1;
            let stem = path
                .rsplit_once('.')
                .map_or(path.as_str(), |(stem, _)| stem);
            for values in table.columns.iter().filter(|c| c.values > 0) {
                let mut title = Title::of(&values.name);
                if !values.unit.is_empty() {
                    title.unit.clone_from(&values.unit);
                }
                all.push(Candidate {
                    file,
                    table: tables,
                    name: full_name(&table.name, &values.name),
                    title,
                    around: Title::of(&format!("{stem} {}", table.name)),
                    values,
                });
            }
        }
    }
    all
}

/// The channels, a line each; `several`: where there are several files a channel says which.
fn channels<'a>(all: &'a [Candidate<'a>], several: bool) -> Vec<String> {
    let mut lines = Vec::new();
    let of = |c: &Candidate<'_>| match several {
        true => format!("file: {}, ", quoted(c.file)),
        false => String::new(),
    };
    let list = |columns: &[&Candidate<'_>]| {
        let columns: Vec<String> = columns.iter().map(|c| quoted(&c.name)).collect();
        columns.join(", ")
    };
    let mut used: Vec<&Candidate<'_>> = Vec::new();
    for (channel, kind) in [("specific_force", FORCE), ("angular_rate", RATE)] {
        if let Some(axes) = triple(all, &kind, &used) {
            let [first, ..] = axes;
            used.extend(axes);
            let unit = unit(&axes, kind.quantity);
            lines.push(format!(
                "  {channel}: {{{}columns: [{}], unit: {unit}, {AXES}}}",
                of(first),
                list(&axes)
            ));
        }
    }
    let wheels = speeds(all);
    if let [first, ..] = wheels.as_slice() {
        let unit = unit(&wheels, Quantity::Speed);
        lines.push(format!(
            "  wheel_speed: [{{{}columns: [{}], unit: {unit}}}]",
            of(first),
            list(&wheels)
        ));
    }
    let torques = of_one_table(all.iter().filter(|c| {
        c.title.has(TORQUES)
            && !c
                .title
                .has("steering steer request requested limit max min")
            && fits(c, Quantity::Torque)
    }));
    if let [first, ..] = torques.as_slice() {
        let unit = unit(&torques, Quantity::Torque);
        lines.push(format!(
            "  traction: {{{}torque: [{}], unit: {unit}}}   # gear ratio and radius: `nominal`",
            of(first),
            list(&torques)
        ));
    }
    lines
}

/// True if its unit belongs to this quantity, or is unknown.
fn fits(c: &Candidate<'_>, quantity: Quantity) -> bool {
    c.title.unit.is_empty() || c.title.known_unit().is_some_and(|u| u.quantity == quantity)
}

/// The first eight of those that are of the first one's table.
fn of_one_table<'a>(of: impl Iterator<Item = &'a Candidate<'a>>) -> Vec<&'a Candidate<'a>> {
    let mut found: Vec<&Candidate<'_>> = Vec::new();
    for c in of {
        if found.first().is_none_or(|f| f.table == c.table) && found.len() < 8 {
            found.push(c);
        }
    }
    found
}

/// The speeds of wheels; without any, the first speed of another name, with a satellite receiver last.
fn speeds<'a>(all: &'a [Candidate<'a>]) -> Vec<&'a Candidate<'a>> {
    let speeds = || {
        all.iter().filter(|c| {
            let numbered = |w: &String| is_one(w.trim_end_matches(char::is_numeric), SPEEDS);
            let named = c.title.words.iter().any(numbered) || c.title.has(WHEELS);
            named && !c.title.has(OTHERS) && fits(c, Quantity::Speed)
        })
    };
    let wheels = of_one_table(speeds().filter(|c| c.title.has(WHEELS)));
    if !wheels.is_empty() {
        return wheels;
    }
    let no_wheel = |c: &Candidate<'_>| c.title.has(NO_WHEEL) || c.around.has(NO_WHEEL);
    let first = speeds().find(|c| !no_wheel(c)).or_else(|| speeds().next());
    let name = |c: &Candidate<'_>| -> Vec<String> {
        let words = c.title.words.iter();
        words
            .filter(|w| !is_one(w, "l r left right") && w.parse::<u8>().is_err())
            .cloned()
            .collect()
    };
    let alike = |c: &&Candidate<'_>| first.is_some_and(|f| name(f) == name(c));
    of_one_table(speeds().filter(alike))
}

/// Three columns of one table, the axes x, y and z of an instrument; of several accelerometers the first that shows
/// gravity.
fn triple<'a>(
    all: &'a [Candidate<'a>],
    kind: &Kind,
    used: &[&Candidate<'_>],
) -> Option<[&'a Candidate<'a>; 3]> {
    let firsts = all.iter().filter_map(|c| Some((c, stem(c, kind, "x")?)));
    let triples = firsts.filter_map(|(first, name)| {
        let other = |axis: &str| {
            let mut beside = all.iter().filter(|c| c.table == first.table);
            beside.find(|c| stem(c, kind, axis).as_ref() == Some(&name))
        };
        let axes = [first, other("y")?, other("z")?];
        let free = axes.iter().all(|c| !used.iter().any(|u| ptr::eq(*u, *c)));
        free.then_some(axes)
    });
    let triples: Vec<_> = triples.collect();
    let shows = |axes: &&[&Candidate<'_>; 3]| gravity_unit(mean_norm(*axes)).is_some();
    let shown = triples
        .iter()
        .find(shows)
        .filter(|_| kind.quantity == Quantity::Acceleration);
    shown.or(triples.first()).copied()
}

/// Length of the vector of the means.
fn mean_norm(axes: &[&Candidate<'_>]) -> f64 {
    let squares = axes.iter().map(|c| c.values.mean * c.values.mean);
    squares.sum::<f64>().sqrt()
}

/// The unit in which gravity is about so much.
fn gravity_unit(norm: f64) -> Option<&'static str> {
    let units = [("m/s2", STANDARD_GRAVITY_MPS2), ("g", 1.0), ("mg", 1000.0)];
    let found = units
        .into_iter()
        .find(|(_, g)| (norm / g - 1.0).abs() < 0.1);
    found.map(|(unit, _)| unit)
}

/// The name without the axis, of a column of this kind of instrument and this axis.
fn stem(c: &Candidate<'_>, kind: &Kind, axis: &str) -> Option<String> {
    let (last, before) = c.title.words.split_last()?;
    let rest = last.strip_suffix(axis)?;
    if c.title.has(NOT_IMU) || c.around.has(NOT_IMU) || !fits(c, kind.quantity) {
        return None;
    }
    let in_name = before.iter().any(|w| is_one(w, kind.words)) || is_one(rest, kind.stems);
    // `x` alone is of the instrument that file or table are named after
    let in_file = rest.is_empty() && before.is_empty() && c.around.has(kind.words);
    (in_name || in_file).then(|| format!("{} {rest}", before.join(" ")))
}

/// The unit of columns: as told, else what the values look like.
fn unit(columns: &[&Candidate<'_>], quantity: Quantity) -> &'static str {
    let told = columns.iter().find_map(|c| c.title.known_unit());
    if let Some(unit) = told {
        return unit.name;
    }
    let most = columns
        .iter()
        .map(|c| c.values.max.abs().max(c.values.min.abs()));
    let most = most.fold(0.0, f64::max);
    match quantity {
        Quantity::Acceleration => gravity_unit(mean_norm(columns)).unwrap_or("m/s2"),
        // no vehicle turns so fast, and none drives so fast
        Quantity::AngularRate if most > 10.0 => "deg/s",
        Quantity::Speed if most > 70.0 => "km/h",
        _ => quantity.si_name(),
    }
}

/// The references of a map: columns of the slope and of a mass that stays.
fn references(all: &[Candidate<'_>], several: bool) -> Vec<String> {
    let mut lines = Vec::new();
    let slope = all.iter().find(|c| {
        let is_slope = c
            .title
            .words
            .last()
            .is_some_and(|w| w == "slope" || w == "grade");
        let known = c.title.known_unit().map(|u| u.name);
        is_slope && known.is_some_and(|u| Quantity::Slope.unit(u).is_some())
    });
    let file = |c: &Candidate<'_>| match several {
        true => format!("file: {}, ", quoted(c.file)),
        false => String::new(),
    };
    if let Some(c) = slope {
        lines.push(format!(
            "  slope: {{{}column: {}, unit: {}, sd_deg: 0.1}}   # sd_deg: its standard deviation",
            file(c),
            quoted(&c.name),
            c.title.known_unit().map_or("deg", |u| u.name)
        ));
    }
    let named = |words: &[&str]| all.iter().find(|c| words.iter().any(|w| c.title.has(w)));
    let altitude = named(&["altitude", "alt", "height"]);
    let position = named(&["latitude", "lat"]).zip(named(&["longitude", "lon", "lng"]));
    if let (None, Some(altitude), Some((latitude, longitude))) = (slope, altitude, position)
        && [latitude, longitude]
            .iter()
            .all(|c| c.table == altitude.table)
    {
        let [column, latitude, longitude] =
            [altitude, latitude, longitude].map(|c| quoted(&c.name));
        lines.push(format!(
            "  slope: {{{}altitude: {{column: {column}, latitude: {latitude}, longitude: {longitude}, unit: m, \
             window_m: 20}}, sd_deg: 1}}   # sd_deg: its standard deviation",
            file(altitude),
        ));
    }
    let mass = all.iter().find(|c| {
        let stays = c.values.min == c.values.max && c.values.min > 0.0;
        let kg = c.title.unit == "kg" || c.title.words.last().is_some_and(|w| w == "kg");
        stays && kg && c.title.has("mass")
    });
    if let Some(c) = mass {
        lines.push(format!(
            "  mass: {{kg: {}, sd_kg: {:.0}}}",
            c.values.min,
            0.02 * c.values.min
        ));
    }
    if !lines.is_empty() {
        lines.insert(0, "reference:".into());
    }
    lines
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
