//! Finds the line and column of the mistake in a URDF file that cannot be read: the URDF reader seldom gives it, so the
//! text is searched.

use super::file::File;
use crate::error::Error;

const HELP: &str = "see http://wiki.ros.org/urdf/XML";
/// Attributes that hold numbers.
const NUMBERS: &[&str] = &[
    "value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "xyz", "rpy", "size", "radius", "length",
    "scale", "lower", "upper", "effort", "velocity", "rgba",
];

/// The error for a message of the URDF reader.
pub(super) fn diagnose(file: &File<'_>, said: &str) -> Error {
    let text = without_comments(&file.text);
    let quoted = || said.split('`').nth(1).unwrap_or_default();
    let reason = said.rsplit("custom: ").next().unwrap_or(said);
    let reason = reason.rsplit("Reason: ").next().unwrap_or(reason);
    let (at, message, help) = if text.trim().is_empty() {
        (None, "this file is empty".into(), HELP.into())
    } else if let Some(at) = mismatch(&text) {
        let help = "every <tag> ends with </tag> or />, one inside the other".into();
        (
            Some(at),
            "this tag does not close the one before it".into(),
            help,
        )
    } else if said.contains("missing field") {
        let message = format!("<inertial> lacks <{}>", quoted());
        match lacking(&text, quoted()) {
            Some(at) => (Some(at), message, "mass and inertia, both".into()),
            None => (None, format!("{} is missing", quoted()), HELP.into()),
        }
    } else if said.contains("float literal") {
        match bad_number(&text) {
            Some((at, word)) => (
                Some(at),
                format!("`{word}` is not a number"),
                "numbers with decimal points, between blanks if there are several".into(),
            ),
            None => (None, "a number cannot be read".into(), HELP.into()),
        }
    } else if let Some(known) = said.split("expected one of ").nth(1) {
        let message = format!("`{}` is not known here", quoted());
        (
            text.find(&format!("\"{}\"", quoted())),
            message,
            format!("known words: {known}"),
        )
    } else {
        (
            None,
            format!("this is not a URDF file: {reason}"),
            HELP.into(),
        )
    };
    let place = at.map(|at| line_column(&text, at)).or_else(|| told(said));
    Error::input(file.path, place, "", message, help)
}

/// Comments blanked out, so that places stay where they are.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, comment)) = rest.split_once("<!--") {
        out += before;
        let end = comment.find("-->").map_or(comment.len(), |i| i + 3);
        out += "    ";
        out.extend(
            comment[..end]
                .chars()
                .map(|c| if c == '\n' { c } else { ' ' }),
        );
        rest = &comment[end..];
    }
    out + rest
}

/// The first end tag of another name than the tag it should close.
fn mismatch(text: &str) -> Option<usize> {
    let mut open = Vec::new();
    for (at, _) in text.match_indices('<') {
        let tag = text[at + 1..].split('>').next().unwrap_or_default();
        let name = |t: &str| {
            t.split([' ', '\n', '\t', '\r', '/'])
                .next()
                .map(str::to_owned)
        };
        if let Some(end) = tag.strip_prefix('/') {
            if open.pop() != name(end) {
                return Some(at);
            }
        } else if !tag.starts_with(['?', '!']) && !tag.ends_with('/') {
            open.extend(name(tag));
        }
    }
    None
}

/// The first `<inertial>` without an element of this name.
fn lacking(text: &str, element: &str) -> Option<usize> {
    text.match_indices("<inertial>")
        .map(|(at, _)| at)
        .find(|at| {
            let block = text[*at..].split("</inertial>").next().unwrap_or_default();
            !block.contains(&format!("<{element} "))
        })
}

/// The first word that is no number where numbers stand.
fn bad_number(text: &str) -> Option<(usize, &str)> {
    let places = NUMBERS.iter().flat_map(|name| {
        let attribute = format!(" {name}=\"");
        let starts = text.match_indices(&attribute);
        let starts: Vec<usize> = starts.map(|(at, _)| at + attribute.len()).collect();
        starts.into_iter().filter_map(|at| {
            let inside = text[at..].split('"').next()?;
            let word = inside
                .split_whitespace()
                .find(|w| w.parse::<f64>().is_err())?;
            Some((at, word))
        })
    });
    places.min_by_key(|(at, _)| *at)
}

/// Line and column, from 1.
fn line_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let start = before.rfind('\n').map_or(0, |n| n + 1);
    (
        before.matches('\n').count() + 1,
        before[start..].chars().count() + 1,
    )
}

/// Line and column in the words of the XML reader, `Line: 3, Column: 7`.
fn told(said: &str) -> Option<(usize, usize)> {
    let number = |word: &str| {
        let digits = said.split_once(word)?.1.trim_start();
        digits
            .split(|c: char| !c.is_ascii_digit())
            .next()?
            .parse()
            .ok()
    };
    Some((number("Line:")?, number("Column:")?))
}

#[allow(clippy::unwrap_used)]
#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn place(text: &str) -> (Option<usize>, String) {
        let said = urdf_rs::read_from_string(text).unwrap_err().to_string();
        let file = File {
            path: Path::new("unit.urdf"),
            text: text.into(),
        };
        match diagnose(&file, &said) {
            Error::Input(e) => (e.line, e.message),
            other => panic!("{other}"),
        }
    }

    #[test]
    fn the_line_that_is_wrong_is_named() {
        let robot =
            |inside: &str| format!("<robot name=\"a\">\n<!-- <b> -->\n{inside}\n</robot>\n");
        let inertial = "<mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";
        let good = format!("<link name=\"x\"><inertial>{inertial}</inertial></link>");
        assert!(urdf_rs::read_from_string(&robot(&good)).is_ok());
        for (inside, line, word) in [
            (good.replace("value=\"1\"", "value=\"one\""), 3, "`one`"),
            (good.replace("<mass value=\"1\"/>", ""), 3, "<mass>"),
            (
                format!("\n{good}").replace("izz=\"1\"", "izz=\"1,0\""),
                4,
                "`1,0`",
            ),
            (good.replace("</inertial>", "</inertia>"), 3, "close"),
            (
                format!(
                    "{good}<link name=\"y\"/>\n<joint name=\"j\" type=\"glued\"><parent link=\"x\"/><child link=\"y\"/></joint>"
                ),
                4,
                "`glued`",
            ),
        ] {
            let (at, message) = place(&robot(&inside));
            assert_eq!(at, Some(line), "{inside}: {message}");
            assert!(message.contains(word), "{message}");
        }
        assert!(place("").1.contains("empty"));
    }

    #[test]
    fn any_beginning_of_a_file_is_blamed_without_a_panic() {
        let text = "<?xml version=\"1.0\"?>\n<!-- ä -->\n<robot name=\"ö\"><link name=\"x\"><inertial><mass value=\"1\"/></inertial></link></robot>";
        for end in (0..text.len()).filter(|i| text.is_char_boundary(*i)) {
            place(&text[..end]);
        }
    }
}
