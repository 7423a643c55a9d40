//! Text for people: numbers with enough digits, names with units, and no hidden characters.
//!
//! Hidden characters change how text is shown without being seen: control characters, and marks for writing from
//! right to left. A terminal obeys the former. The latter show another name than the true one (Boucher and Anderson
//! 2021, "Trojan Source").

/// Returns true for a hidden character. Line ends and tabs are not hidden.
pub(crate) fn is_hidden(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// Text with hidden characters replaced by their code points, such as `\u{1b}`.
pub fn spelled_out(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match is_hidden(c) {
            true => out.extend(c.escape_unicode()),
            false => out.push(c),
        }
    }
    out
}

/// Text with a mark instead of each hidden character: as long as it was.
pub fn marked(text: &str) -> String {
    let mark = |c| {
        if is_hidden(c) {
            char::REPLACEMENT_CHARACTER
        } else {
            c
        }
    };
    text.chars().map(mark).collect()
}

/// A number for people: three significant digits or more, a dash for what could not be measured.
pub fn number(x: f64) -> String {
    match x.abs() {
        a if !a.is_finite() => "–".into(),
        0.0 => "0".into(),
        a if !(1e-4..1e7).contains(&a) => format!("{x:.2e}"),
        a if a < 1e-2 => format!("{x:.5}"),
        a if a < 0.1 => format!("{x:.4}"),
        a if a < 10.0 => format!("{x:.3}"),
        a if a < 100.0 => format!("{x:.2}"),
        a if a < 1000.0 => format!("{x:.1}"),
        _ => format!("{x:.0}"),
    }
}

/// A name with its unit, if it has one.
pub(crate) fn with_unit(name: &str, unit: &str) -> String {
    match unit {
        "1" => name.to_owned(),
        unit => format!("{name}, {unit}"),
    }
}

/// A word quoted for a shell.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "._-/=@:+,".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_shown_and_all_others_stay() {
        let good = "a\tä\n°²μ→中 –";
        assert_eq!(spelled_out(good), good);
        assert_eq!(marked(good), good);
        let bad = "\u{1b}[31m\u{202e}\u{7}\r\u{2066}\u{9b}";
        let told = spelled_out(bad);
        assert_eq!(told, "\\u{1b}[31m\\u{202e}\\u{7}\\u{d}\\u{2066}\\u{9b}");
        assert!(!marked(bad).chars().any(is_hidden));
        assert_eq!(marked(bad).chars().count(), bad.chars().count());
    }

    #[test]
    fn numbers_keep_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (f64::NAN, "–"),
            (0.001234, "0.00123"),
            (-0.5, "-0.500"),
            (92.68, "92.68"),
            (12345.6, "12346"),
            (1e-9, "1.00e-9"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
