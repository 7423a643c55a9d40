use super::*;
use crate::config::checked::{Positive, Version1};
use crate::error::InputError;
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Sample {
    version: Version1,
    arcs: Vec<Arc>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Arc {
    radius_m: Positive,
    bend: Option<Bend>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Bend {
    Left,
    Right,
}

/// The error of reading this text, and the folder that keeps its file.
fn wrong(text: &[u8]) -> (InputError, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.yaml");
    std::fs::write(&path, text).unwrap();
    match read_yaml::<Sample>(&path) {
        Err(Error::Input(e)) => (*e, folder),
        other => panic!("{other:?}"),
    }
}

/// The text of the file from the error's place on must start with `target`.
fn points_at(text: &str, target: &str, key: &str) {
    let (e, _folder) = wrong(text.as_bytes());
    assert_eq!(e.key, key, "{e}");
    let line = text.lines().nth(e.line.unwrap() - 1).unwrap();
    let rest: String = line.chars().skip(e.column.unwrap() - 1).collect();
    assert!(rest.starts_with(target), "{e} points at {rest}");
    assert!(!e.help.is_empty());
}

#[test]
fn an_error_points_at_what_is_wrong() {
    points_at(
        "version: 1\narcs:\n  - radius_m: 4\n  - radius_m: -7\n",
        "-7",
        "arcs[1].radius_m",
    );
    points_at(
        "version: 1\narcs: [{radius_m: 4}, {radius_m: .nan}]\n",
        ".nan",
        "arcs[1].radius_m",
    );
    points_at(
        "version: 1\narcs:\n  - radius_m: 4\n    bent: left\n",
        "bent",
        "arcs[0].bent",
    );
    points_at(
        "version: 1\narcs:\n  - radius_m: 4\n    bend: up\n",
        "up",
        "arcs[0].bend",
    );
    points_at(
        "version: 1\narcs:\n  - radius_m: '4'\n",
        "'4'",
        "arcs[0].radius_m",
    );
    points_at(
        "version: 1\narcs:\n  - radius_m: 1e99\n",
        "1e99",
        "arcs[0].radius_m",
    );
    points_at("version: 1\narcs:\n  - {}\n", "{}", "arcs[0]");
    points_at(
        "version: 1\narcs:\n  - radius_m: !about 4\n",
        "!about",
        "arcs[0].radius_m",
    );
    points_at("version: 2\narcs: []\n", "2", "version");
    points_at("version: 1\narcs: []\nwhat: é\n", "what", "what");
    points_at(
        "version: 1\narcs:\n  - radius_m: 4\n    radius_m: 5\n",
        "radius_m: 5",
        "arcs[0].radius_m",
    );
    points_at("version: 1\nversion: 1\narcs: []\n", "version", "version");
}

#[test]
fn the_second_of_two_equal_keys_is_named() {
    let (e, _folder) = wrong(b"version: 1\narcs: []\nversion: 1\n");
    assert_eq!((e.line, e.column), (Some(3), Some(1)), "{e}");
}

#[test]
fn bytes_that_are_not_text_are_counted_in_characters() {
    let (e, _folder) = wrong(b"version: 1\n# \xc3\xa9\xff\n");
    assert_eq!((e.line, e.column), (Some(2), Some(4)), "{e}");
}

#[test]
fn near_words_are_offered() {
    let (e, _folder) = wrong(b"version: 1\narcs:\n  - radus_m: 4\n");
    assert!(e.help.contains("did you mean `radius_m`?"), "{e}");
}

#[test]
fn later_errors_find_their_line_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.yaml");
    std::fs::write(&path, "a: 1\nb:\n  - {c: 2}\n  - {c: [3, 4]}\n").unwrap();
    for (key, place) in [
        ("a", (1, 4)),
        ("b[1].c", (4, 9)),
        ("b[1].c[1]", (4, 13)),
        ("b[0].missing", (3, 5)),
        ("b[7]", (2, 1)),
    ] {
        match input_error(&path, key, "m", "h") {
            Error::Input(e) => {
                assert_eq!((e.line, e.column), (Some(place.0), Some(place.1)), "{key}")
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_key_of_a_file_that_is_not_yaml_gets_no_line_rather_than_a_wrong_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.urdf");
    std::fs::write(&path, "<robot>\n  <link name=\"a\"/>: &\n").unwrap();
    match input_error(&path, "link.a", "m", "h") {
        Error::Input(e) => assert_eq!(e.line, None),
        other => panic!("{other:?}"),
    }
}

fn one(path: &str, value: &str) -> Sets {
    Sets::new(&[(path.to_owned(), value.to_owned())])
}

#[test]
fn setting_a_value_makes_the_way_and_is_named_in_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.yaml");
    std::fs::write(&path, "version: 1\narcs: [{radius_m: 4}]\n").unwrap();
    let mut document = Document::read(&path).unwrap();
    document.apply(&one("arcs[0].radius_m", "9")).unwrap();
    let sample: Sample = document.parse().unwrap();
    assert_eq!(sample.arcs[0].radius_m.get(), 9.0);
    document.apply(&one("arcs[0].radius_m", "0")).unwrap();
    let e = document.parse::<Sample>().unwrap_err().to_string();
    assert!(e.contains("--set arcs[0].radius_m=0"), "{e}");
    for (path, value) in [
        ("arcs[4]", "1"),
        ("version.x", "1"),
        ("a..b", "1"),
        ("version[0]", "1"),
        ("arcs", "["),
    ] {
        assert!(document.apply(&one(path, value)).is_err(), "{path}");
    }
    document.apply(&one("arcs", "[]")).unwrap();
    document.apply(&one("new.deep.key", "{a: 1}")).unwrap();
    assert!(
        document
            .parse::<Sample>()
            .unwrap_err()
            .to_string()
            .contains("unknown key `new`")
    );
}

#[test]
fn no_mangled_file_makes_the_reader_panic() {
    let good = "version: 1\narcs:\n  - {radius_m: 4, bend: left}\n  - radius_m: 5\n";
    for cut in 0..good.len() {
        for junk in [
            "", "{", "[", "]", ":", "-", "\t", "&a", "*a", "!x", "\"", "\0", "%", "---\n", "- - -",
            "? ",
        ] {
            let text = format!("{}{junk}{}", &good[..cut], &good[cut..]);
            let folder_text = text.as_bytes();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.yaml");
            std::fs::write(&path, folder_text).unwrap();
            if let Err(e) = read_yaml::<Sample>(&path) {
                assert!(!e.to_string().is_empty());
            }
        }
    }
}

/// `[+]` adds to a list, makes one where there is none, and refuses what is no list; later errors name the change.
#[test]
fn a_value_is_added_to_a_list() {
    let set = |sets: &[(&str, &str)]| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sample.yaml");
        std::fs::write(&path, "version: 1\narcs: [{radius_m: 1}]\n").unwrap();
        let sets = sets.iter().map(|(p, v)| ((*p).to_owned(), (*v).to_owned()));
        let sets = Sets::new(&sets.collect::<Vec<_>>());
        let read = read_yaml_with::<Sample>(&path, &sets);
        read.map(|s| s.arcs.iter().map(|a| a.radius_m.get()).collect::<Vec<_>>())
    };
    let both = [("arcs[+]", "{radius_m: 2}"), ("arcs[+]", "{radius_m: 3}")];
    assert_eq!(set(&both).unwrap(), [1.0, 2.0, 3.0]);
    let anew = [("arcs", "null"), ("arcs[+]", "{radius_m: 4}")];
    assert_eq!(set(&anew).unwrap(), [4.0]);
    let no_list = set(&[("version[+]", "1")]).unwrap_err().to_string();
    assert!(
        no_list.contains("[+] needs a list, but this is not a list"),
        "{no_list}"
    );
    let bad = set(&[("arcs[+]", "{radius_m: -1}")])
        .unwrap_err()
        .to_string();
    assert!(bad.contains("--set arcs[+]={radius_m: -1}"), "{bad}");
}

/// A text that looks like YAML and is none is named, at its line.
#[test]
fn what_only_looks_like_yaml_is_named() {
    for (text, told, line) in [
        ("version: 1\n\u{a0}\u{a0}arcs: []\n", "U+00A0", 2),
        ("version: 1\narcs:\u{a0}[{radius_m: 4}]\n", "U+00A0", 2),
        ("version: 1\narcs:\u{3000}[]\n", "U+3000", 2),
        (
            "version: 1\narcs:\n  - radius_m:\u{a0}4\n    bend: left\n",
            "U+00A0",
            3,
        ),
        (
            "version: 1\narcs:\n  - {radius_m: 1,0}\n",
            "the number 0 is in the place of",
            3,
        ),
        (
            "version: 1\na: &a {radius_m: 4}\narcs:\n  - <<: *a\n",
            "merge keys",
            4,
        ),
    ] {
        let (e, _folder) = wrong(text.as_bytes());
        assert!(e.message.contains(told), "{text}: {e}");
        assert_eq!(e.line, Some(line), "{text}: {e}");
    }
}

/// The same characters are text in a value: a column of a log may be called so.
#[test]
fn values_may_hold_any_space() {
    let columns = "a: \"Speed:\u{a0}km/h\"\nb: [\"\u{3000}v\", \"<<\"]\n";
    assert_eq!(limits::yaml(columns), Ok(()));
}
