//! Ranges of numbers by the unit at the end of their key (`mass_kg`, `dt_ms`): what no mine, train, instrument or log
//! has is refused where it is read, in every file, before a type looks at it. Types narrow them further.

use super::key_path::join;
use serde_yaml::Value;

/// Keys whose values have their own range: least and most magnitude. Zero is left to the type of the value.
const KEYS: &[(&str, f64, f64)] = &[
    // a second of smaller steps takes minutes
    ("dt_ms", 0.05, 100.0),
    ("gravity_mps2", 0.1, 100.0),
    ("bearing_n", 1e-6, 1e6),
    ("bearing_nspm", 1e-6, 1e4),
    ("air_nspm2", 1e-6, 1e4),
    ("running_wheel", 1e-9, 1.0),
    ("guide_wheel", 1e-9, 1.0),
    ("clamped_wheel", 1e-9, 1.0),
    ("efficiency_drive", 0.01, 1.0),
    ("efficiency_brake", 0.01, 1.0),
    ("ratio", 1e-3, 1e4),
    ("drives", 1.0, 16.0),
    // clocks may begin with the epoch of Unix
    ("offset_s", 1e-12, 1e11),
    ("offset_ms", 1e-9, 1e14),
];

/// Units at the end of keys: least and most magnitude, and the unit in words.
const UNITS: &[(&str, f64, f64, &str)] = &[
    ("m", 1e-9, 1e6, "m"),
    ("m2", 1e-9, 1e6, "m²"),
    ("1pm", 1e-9, 1e3, "1/m"),
    ("kg", 1e-6, 1e7, "kg"),
    ("kgm2", 1e-9, 1e9, "kg·m²"),
    ("kgpm3", 1e-6, 1e5, "kg/m³"),
    ("npm", 1e-3, 1e11, "N/m"),
    ("nspm", 1e-6, 1e8, "N·s/m"),
    ("nspm2", 1e-6, 1e5, "N·s²/m²"),
    ("n", 1e-6, 1e9, "N"),
    ("nm", 1e-6, 1e7, "N·m"),
    ("nmps", 1e-3, 1e9, "N·m/s"),
    ("kw", 1e-6, 1e6, "kW"),
    ("mpa", 1e-6, 1e3, "MPa"),
    ("mps", 1e-9, 1e3, "m/s"),
    ("mps2", 1e-9, 1e4, "m/s²"),
    ("rpm", 1e-3, 1e6, "1/min"),
    ("s", 1e-9, 1e8, "s"),
    ("ms", 1e-6, 1e7, "ms"),
    ("hz", 1e-9, 1e6, "Hz"),
    ("deg", 1e-12, 1e5, "°"),
    ("ppm", 1e-9, 1e6, "ppm"),
];

/// The first number out of its range: key path, message, help.
pub(super) fn wrong(tree: &Value) -> Option<(String, String, String)> {
    below(tree, "", "")
}

fn below(tree: &Value, path: &str, key: &str) -> Option<(String, String, String)> {
    match tree {
        Value::Number(number) => {
            let (message, help) = number.as_f64().and_then(|x| out_of_range(key, x))?;
            Some((path.to_owned(), message, help))
        }
        Value::Sequence(list) => {
            let mut items = (0..).zip(list);
            items.find_map(|(i, item): (usize, _)| below(item, &format!("{path}[{i}]"), key))
        }
        Value::Mapping(map) => map.iter().find_map(|(name, value)| {
            let name = name.as_str()?;
            // `mount_deg: {pitch: 3}` is in degrees
            let unit = range(name).map_or(key, |_| name);
            below(value, &join(path, name), unit)
        }),
        _ => None,
    }
}

/// Returns message and help for a number outside the range of its key; the type of the number refuses NaN and infinity.
fn out_of_range(key: &str, x: f64) -> Option<(String, String)> {
    if x == 0.0 || !x.is_finite() {
        return None;
    }
    // a study gives paths as keys
    let key = key.rsplit('.').next().unwrap_or(key);
    let (least, most, unit) = range(key)?;
    let size = x.abs();
    let far = if size > most {
        format!("at most {most:e} {unit}")
    } else if size < least {
        format!("0, or at least {least:e} {unit}")
    } else {
        return None;
    };
    let what = format!("{x:e} {unit} is too large for a mine, vehicle, instrument or log");
    Some((what.replace("  ", " "), far.trim_end().to_owned()))
}

/// Least and most magnitude of the numbers under a key, with their unit.
fn range(key: &str) -> Option<(f64, f64, &'static str)> {
    let unit = key.rsplit('_').next().unwrap_or(key);
    let by_unit = UNITS.iter().find(|(name, ..)| *name == unit);
    let words = by_unit.map_or("", |(.., words)| words);
    match KEYS.iter().find(|(name, ..)| *name == key) {
        Some((_, least, most)) => Some((*least, *most, words)),
        None => by_unit.map(|(_, least, most, _)| (*least, *most, words)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every row admits its own ends and refuses what is ten times beyond them, of either sign, in lists and below
    /// other keys too.
    #[test]
    fn ends_are_within_and_what_is_beyond_is_not() {
        let rows = UNITS
            .iter()
            .map(|(unit, least, most, _)| (format!("x_{unit}"), *least, *most));
        let keys = KEYS
            .iter()
            .map(|(key, least, most)| ((*key).to_owned(), *least, *most));
        for (key, least, most) in rows.chain(keys) {
            for (x, right) in [
                (least, true),
                (most, true),
                (0.0, true),
                (0.1 * least, false),
                (10.0 * most, false),
            ] {
                for x in [x, -x] {
                    let tree = format!("{{a: [{{\"{key}\": [0, {x:e}]}}]}}");
                    let found = wrong(&serde_yaml::from_str(&tree).unwrap());
                    assert_eq!(found.is_none(), right, "{tree}: {found:?}");
                    assert!(found.is_none_or(|(path, ..)| path == format!("a[0].{key}[1]")));
                }
            }
        }
        assert_eq!(range("max_stops"), None);
    }
}
