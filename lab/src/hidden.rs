//! Characters that change how text is shown without being seen: control characters, and marks for writing from right to left. A
//! terminal obeys the former, and the latter show a name other than it is (Boucher and Anderson 2021, "Trojan Source").

/// Whether a character is one of these. Line ends and tabs are none.
pub fn is_hidden(c: char) -> bool {
    (c.is_control() && !matches!(c, '\n' | '\t'))
        || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// The text with hidden characters as their code points, such as `\u{1b}`.
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

/// The text with a mark in place of each hidden character: as long as it was.
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
}
