//! Error messages of the YAML reader and serde, rewritten in plain words, each with a correction.

use super::suggest::suggestion;

/// An error in plain words.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ErrorMessage {
    /// The mistake.
    pub message: String,
    /// The remedy.
    pub help: String,
    /// The unknown key, if this is the mistake.
    pub unknown_key: Option<String>,
}

/// An error of tree → checked type.
pub(super) fn plain(serde: &str) -> ErrorMessage {
    let told = |message: String, help: String| ErrorMessage {
        message,
        help,
        unknown_key: None,
    };
    if let Some((key, known)) = unknown(serde, "unknown field ") {
        return ErrorMessage {
            message: format!("unknown key `{key}`"),
            help: choices(&key, &known, "known keys"),
            unknown_key: Some(key),
        };
    }
    if let Some((word, known)) = unknown(serde, "unknown variant ") {
        return told(
            format!("`{word}` is not known here"),
            choices(&word, &known, "known words"),
        );
    }
    if let Some(key) = serde.strip_prefix("missing field ") {
        let key = key.trim_matches('`');
        return told(
            format!("the key `{key}` is missing"),
            format!("add a line such as {}", example(key)),
        );
    }
    for prefix in ["invalid type: ", "invalid value: ", "invalid length "] {
        if let Some((what, wanted)) = serde
            .strip_prefix(prefix)
            .and_then(|rest| rest.rsplit_once(", expected "))
        {
            let what = match prefix {
                "invalid length " => format!("a list of {what}"),
                _ => found(what),
            };
            if wanted == "field identifier" {
                return told(
                    format!("{what} is in the place of the name of a key"),
                    "`key: value`; numbers have a decimal point, not a comma".to_owned(),
                );
            }
            let wanted = expected(wanted);
            return told(
                format!("expected {wanted}, found {what}"),
                format!("write {wanted} here"),
            );
        }
    }
    // A checked type's own words: `message; help`.
    match serde.split_once("; ") {
        Some((message, help)) => told(message.to_owned(), help.to_owned()),
        None => told(
            serde.to_owned(),
            "`monorig check --schema` shows the right values".to_owned(),
        ),
    }
}

/// Makes the message of a syntax error; `line` is the line of the error.
pub(super) fn syntax(yaml: &str, line: &str) -> ErrorMessage {
    let said = yaml.split(" at line ").next().unwrap_or(yaml);
    let (message, help) = if said.contains("more than one document") {
        (
            "this file holds more than one YAML document",
            "remove the `---` lines",
        )
    } else if said.contains("recursion limit") || said.contains("repetition limit") {
        (
            "this file is nested too deeply, or has too many repetitions",
            "write the file without deep nesting and aliases",
        )
    } else if line.trim_start_matches(' ').starts_with('\t') {
        (
            "this line is indented with a tab",
            "YAML is indented with spaces",
        )
    } else if line.contains("???") {
        (
            "a value must be filled in here",
            "replace `???` by your value",
        )
    } else if said.contains("unknown anchor") {
        (
            "this refers to an unknown anchor",
            "put text that starts with `*` in quotes",
        )
    } else {
        (
            said,
            "this is not YAML: look for a missing colon, quote or bracket, or uneven indentation, here or just above",
        )
    };
    ErrorMessage {
        message: message.to_owned(),
        help: help.to_owned(),
        unknown_key: None,
    }
}

/// The key in "duplicate entry with key …".
pub(super) fn key_given_twice(yaml: &str) -> Option<String> {
    let (_, rest) = yaml.split_once("duplicate entry with key ")?;
    let rest = rest.split(" at line ").next().unwrap_or(rest);
    Some(rest.trim_matches('"').to_owned())
}

/// "unknown field `a`, expected one of `b`, `c`" → a, [b, c].
fn unknown(serde: &str, prefix: &str) -> Option<(String, Vec<String>)> {
    let rest = serde.strip_prefix(prefix)?;
    let end = rest.find(", expected ").or(rest.find(", there are no "))?;
    let (word, known) = rest.split_at(end);
    let known = known.split('`').skip(1).step_by(2).map(str::to_owned);
    Some((word.trim_matches('`').to_owned(), known.collect()))
}

fn choices(word: &str, known: &[String], title: &str) -> String {
    if known.is_empty() {
        return "nothing can stand here".to_owned();
    }
    suggestion(word, known.iter().map(String::as_str), title)
}

fn found(what: &str) -> String {
    for (kind, name) in [
        ("string ", "the text "),
        ("integer ", "the number "),
        ("floating point ", "the number "),
        ("boolean ", ""),
    ] {
        if let Some(value) = what.strip_prefix(kind) {
            return format!("{name}{}", value.trim_matches('`'));
        }
    }
    match what {
        "map" => "a mapping",
        "sequence" => "a list",
        "unit value" | "null" | "Option value" => "nothing",
        other => other,
    }
    .to_owned()
}

fn expected(wanted: &str) -> String {
    match wanted {
        "f64" => "a number".to_owned(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, zero or above".to_owned(),
        "i32" | "i64" => "a whole number".to_owned(),
        "a string" | "string" => "text".to_owned(),
        "a boolean" => "`true` or `false`".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" => "a mapping (`key: value`)".to_owned(),
        w if w.starts_with("struct ") => "a mapping (`key: value`)".to_owned(),
        w if w.starts_with("an array of length ") => {
            format!("a list of {}", &w["an array of length ".len()..])
        }
        w if w.starts_with("enum ") || w == "string or singleton map" => "one word".to_owned(),
        w => w.to_owned(),
    }
}

/// A line that could be added for a missing key, from its unit suffix.
fn example(key: &str) -> String {
    let whole = match key {
        "version" => "1",
        "why" => "what this file shows, in a sentence",
        "track" => "../assets/tracks/liu2023_section1.yaml",
        "train" => "../assets/trains/dx80_176y.yaml",
        "sensors" => "../assets/sensors/huainan.yaml",
        "stop" => "{after_s: 60}",
        "drive" => "{speed: [{at_s: 0, mps: 0}, {at_s: 4, mps: 1}]}",
        "speed" => "[{at_s: 0, mps: 0}, {at_s: 4, mps: 1}]",
        "metric" => "mass_error_rel_max",
        "mps" => "1.0",
        "height_noise_m" => "0.003",
        _ => "",
    };
    if !whole.is_empty() {
        return format!("`{key}: {whole}`");
    }
    let (value, unit) = match key.rsplit('_').next().unwrap_or_default() {
        "m" => ("10", "metres"),
        "mm" => ("10", "millimetres"),
        "kg" => ("1000", "kilograms"),
        "s" => ("10", "seconds"),
        "ms" => ("2", "milliseconds"),
        "hz" => ("100", "hertz"),
        "deg" => ("8", "degrees"),
        "mps" => ("1.0", "metres per second"),
        "mps2" => ("0.5", "metres per second squared"),
        "mpa" => ("10", "megapascals"),
        "n" => ("1000", "newtons"),
        "nm" => ("100", "newton metres"),
        _ => return format!("`{key}: …`"),
    };
    format!("`{key}: {value}` ({unit})")
}
