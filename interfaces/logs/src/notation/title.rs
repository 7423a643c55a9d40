//! Titles of columns: the words of a name and its unit, in the ways that loggers write them.

use super::units::{UNITS, Unit};

/// The title of a column: `Speed [km/h]`, `AccX(m/s^2)`, `imu_gyr_z_dps`, `field.linear_acceleration.x`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Title {
    /// Its words in lower case, without the unit.
    pub words: Vec<String>,
    /// Its unit as it is written; empty if there is none.
    pub unit: String,
}

impl Title {
    /// Takes a title apart: the unit stands in brackets at the end, or is the last word.
    pub fn of(title: &str) -> Self {
        let title = title.trim();
        let (name, unit) = in_brackets(title).unwrap_or((title, ""));
        let mut words = words(name);
        let mut unit = unit.trim().to_owned();
        if unit.is_empty()
            && words.len() > 1
            && let Some(last) = words.last()
            && is_unit_word(last)
        {
            unit = words.pop().unwrap_or_default();
        }
        Self { words, unit }
    }

    /// The unit of the list that it is; none where it is not known.
    pub fn known_unit(&self) -> Option<&'static Unit> {
        let exact = UNITS.iter().find(|u| u.is_called(&self.unit));
        exact.or_else(|| {
            let lower = self.unit.to_lowercase();
            UNITS.iter().find(|u| u.is_called(&lower))
        })
    }

    /// True if one of its words is among these, which blanks separate.
    pub fn has(&self, words: &str) -> bool {
        self.words.iter().any(|w| is_one(w, words))
    }
}

/// True if a word is one of these, which blanks separate.
pub(crate) fn is_one(word: &str, words: &str) -> bool {
    words.split(' ').any(|w| w == word)
}

/// Name and unit of a title with a unit in brackets at its end. `G(x)` has none: x is no unit.
fn in_brackets(title: &str) -> Option<(&str, &str)> {
    let square = || title.strip_suffix(']').and_then(|t| t.rsplit_once('['));
    let round = || title.strip_suffix(')').and_then(|t| t.rsplit_once('('));
    square()
        .or_else(round)
        .filter(|(_, unit)| !AXES.contains(unit))
}

const AXES: [&str; 6] = ["x", "y", "z", "X", "Y", "Z"];

/// Units that are also words at the end of a name: `speed_mps`, `t_ms`. A single letter is an axis or a name.
fn is_unit_word(word: &str) -> bool {
    let of_time = ["ms", "us", "ns", "sec", "seconds", "s"];
    let named = |u: &Unit| word.len() > 1 && u.is_called(word);
    of_time.contains(&word) || UNITS.iter().any(named) || ["nm", "knm"].contains(&word)
}

/// The words of a name: `WheelSpeedFL`, `wheel_speed.fl` and `wheel speed-FL` are wheel, speed, fl.
fn words(name: &str) -> Vec<String> {
    let (mut all, mut word) = (Vec::new(), String::new());
    let mut before = ' ';
    let mut letters = name.chars().peekable();
    while let Some(c) = letters.next() {
        let next_is_small = letters.peek().is_some_and(|n| n.is_lowercase());
        let begins =
            c.is_uppercase() && (before.is_lowercase() || (before.is_uppercase() && next_is_small));
        if (begins || !c.is_alphanumeric()) && !word.is_empty() {
            all.push(std::mem::take(&mut word));
        }
        if c.is_alphanumeric() {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    if !word.is_empty() {
        all.push(word);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_units_in_the_ways_of_loggers() {
        for (title, words, unit) in [
            ("Speed [km/h]", "speed", "km/h"),
            ("Geschwindigkeit [km/h]", "geschwindigkeit", "km/h"),
            ("AccX(m/s^2)", "acc x", "m/s^2"),
            ("imu_gyr_z_dps", "imu gyr z", "dps"),
            (
                "field.linear_acceleration.x",
                "field linear acceleration x",
                "",
            ),
            ("WheelSpeedFL", "wheel speed fl", ""),
            ("G(x)", "g x", ""),
            ("Speed (OBD)(km/h)", "speed obd", "km/h"),
            ("MotorTorque_Nm", "motor torque", "nm"),
            ("ax", "ax", ""),
            ("a_g", "a g", ""),
            ("t_ms", "t", "ms"),
            ("%time", "time", ""),
            ("Drehrate Z [°/s]", "drehrate z", "°/s"),
            ("velL", "vel l", ""),
            ("GPSSpeed", "gps speed", ""),
            ("", "", ""),
        ] {
            let found = Title::of(title);
            assert_eq!(
                (found.words.join(" ").as_str(), found.unit.as_str()),
                (words, unit),
                "{title}"
            );
        }
        let unit = |title: &str| Title::of(title).known_unit().map(|u| u.name);
        assert_eq!(unit("v (Km/h)"), Some("km/h"));
        assert_eq!(unit("torque_nm"), Some("Nm"));
        assert_eq!(unit("p [MPa]"), Some("MPa"));
        assert_eq!(unit("x [furlong]"), None);
    }
}
