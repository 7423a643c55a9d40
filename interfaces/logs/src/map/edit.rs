//! Inserting values into the text of a map file: comments, order and layout stay as they are.

use super::Map;
use monorig_sim::config::file::{Document, Sets, read_result};
use monorig_sim::config::input_files::may_change;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::ops::Range;

/// Beginning of the written comments, by which earlier comments are found.
const MARK: &str = "# ";

/// A key that gets a value.
#[derive(Clone, Debug)]
pub(crate) struct Edit {
    /// Its path, such as `channels.wheel_speed[0].gain`.
    pub key: String,
    /// The value, as YAML.
    pub value: String,
    /// The comment above it.
    pub comment: String,
}

/// Puts values into a map file. What was written is read again and compared: where that is not what `--set` would make
/// of the file, the file stays as it is, and the error says what is to be written by hand.
pub(crate) fn write(map: &Map, edits: &[Edit]) -> Result<(), Error> {
    let path = map.document.path();
    let by_hand = || {
        let lines: Vec<String> = edits
            .iter()
            .map(|e| format!("{}: {}", e.key, e.value))
            .collect();
        map.error(
            "",
            "the layout of this map file does not allow inserted values; the file was not changed",
            format!("write by hand: {}", lines.join("; ")),
        )
    };
    let mut text = read_result(path)?;
    let mut expected = Document::read(path)?;
    let sets: Vec<_> = edits
        .iter()
        .map(|e| (e.key.clone(), e.value.clone()))
        .collect();
    expected.apply(&Sets::new(&sets))?;
    for edit in edits {
        text = put(&text, edit).ok_or_else(by_hand)?;
    }
    if !expected.is_of(&text) {
        return Err(by_hand());
    }
    may_change(path);
    whole::write(path, text.as_bytes())
}

/// The part of a text that a value is in.
#[derive(Clone, Debug)]
enum Region {
    /// Lines of a block, from this indentation on.
    Block(Range<usize>, usize),
    /// `{…}` or `[…]`, with its brackets.
    Flow(Range<usize>),
    /// Anything else on a line.
    Scalar(Range<usize>),
}

/// A step of a path.
#[derive(Clone, Debug, PartialEq)]
enum PathStep {
    Key(String),
    Index(usize),
}

fn steps(path: &str) -> Vec<PathStep> {
    let mut all = Vec::new();
    for part in path.split('.') {
        let (name, rest) = part.split_once('[').map_or((part, ""), |(n, r)| (n, r));
        all.push(PathStep::Key(name.to_owned()));
        let indices = rest
            .split('[')
            .filter_map(|i| i.strip_suffix(']')?.parse().ok());
        all.extend(indices.map(PathStep::Index));
    }
    all
}

/// The text with one value inserted; `None` if its layout is not understood.
fn put(text: &str, edit: &Edit) -> Option<String> {
    let path = steps(&edit.key);
    let mut mask = masked(text);
    let mut region = Region::Block(0..text.len(), 0);
    for (i, step) in path.iter().enumerate() {
        let Some(next) = child(&mut mask, &region, step) else {
            // what is left of the path is new
            let rest = path.get(i + 1..)?;
            let PathStep::Key(key) = step else {
                return None;
            };
            let mut value = edit.value.clone();
            for step in rest.iter().rev() {
                let PathStep::Key(key) = step else {
                    return None;
                };
                value = format!("{{{key}: {value}}}");
            }
            return insert(text, &mask, &region, &format!("{key}: {value}"), edit);
        };
        region = next;
    }
    let range = match region {
        Region::Flow(range) | Region::Scalar(range) => range,
        Region::Block(..) => return None,
    };
    let mut new = text.to_owned();
    new.replace_range(range.clone(), &edit.value);
    Some(commented(&new, range.start, edit))
}

/// The text with comments and quoted strings as letters, so that no bracket or colon of them counts. Every byte keeps
/// its place.
fn masked(text: &str) -> Vec<u8> {
    let mut mask = text.as_bytes().to_vec();
    let (mut quote, mut comment) = (None, false);
    for (i, &c) in text.as_bytes().iter().enumerate() {
        let before = i
            .checked_sub(1)
            .and_then(|j| text.as_bytes().get(j))
            .copied();
        match (c, quote) {
            (b'\n', _) => (quote, comment) = (None, false),
            _ if comment => mask[i] = b'#',
            (c, Some(q)) => {
                if c == q {
                    quote = None;
                }
                mask[i] = b'q';
            }
            (b'#', None) if before.is_none_or(|b| b.is_ascii_whitespace()) => {
                comment = true;
                mask[i] = b'#';
            }
            (b'"' | b'\'', None) if before.is_none_or(|b| !b.is_ascii_alphanumeric()) => {
                quote = Some(c);
                mask[i] = b'q';
            }
            _ => {}
        }
    }
    mask
}

/// Lines of a range: the start of each, and its end without the line break.
fn lines(mask: &[u8], range: &Range<usize>) -> Vec<Range<usize>> {
    let (mut all, mut from) = (Vec::new(), range.start);
    for i in range.clone() {
        if mask.get(i) == Some(&b'\n') {
            all.push(from..i);
            from = i + 1;
        }
    }
    if from < range.end {
        all.push(from..range.end);
    }
    all
}

/// Indentation of a line; none of one that is empty or a comment.
fn indent(mask: &[u8], line: &Range<usize>) -> Option<usize> {
    let text = mask.get(line.clone())?;
    let spaces = text.iter().take_while(|c| **c == b' ').count();
    let first = text.get(spaces)?;
    (*first != b'#' && *first != b'\r').then_some(spaces)
}

/// The value of a key or an entry of a list in a region.
fn child(mask: &mut [u8], region: &Region, step: &PathStep) -> Option<Region> {
    match region {
        Region::Scalar(_) => None,
        Region::Flow(range) => {
            let (i, value) = items(mask, range)
                .into_iter()
                .enumerate()
                .find_map(|(i, item)| match step {
                    PathStep::Index(n) => (i == *n).then_some((i, item)),
                    PathStep::Key(key) => Some((i, value_of(mask, &item, key)?)),
                })?;
            let _ = i;
            Some(region_at(mask, value))
        }
        Region::Block(range, at) => {
            let all = lines(mask, range);
            let here: Vec<(usize, &Range<usize>)> = all
                .iter()
                .enumerate()
                .filter(|(_, l)| indent(mask, l) == Some(*at))
                .collect();
            let (number, value) = match step {
                PathStep::Key(key) => here.iter().find_map(|(n, line)| {
                    let item = line.start + at..line.end;
                    Some((*n, value_of(mask, &item, key)?))
                })?,
                PathStep::Index(i) => {
                    let dashes = here
                        .iter()
                        .filter(|(_, l)| mask.get(l.start + at) == Some(&b'-'));
                    let (n, line) = dashes.clone().nth(*i)?;
                    // the rest of the line is the first one of the entry, as if the dash were a space
                    let dash = line.start + at;
                    mask[dash] = b' ';
                    (*n, trimmed(mask, dash..line.end))
                }
            };
            let first = mask.get(value.start).copied();
            if matches!(first, Some(b'{' | b'[')) {
                return Some(region_at(mask, value));
            }
            // lines that are further in belong to it
            let end = all
                .iter()
                .skip(number + 1)
                .find(|l| indent(mask, l).is_some_and(|i| i <= *at))
                .map_or(range.end, |l| l.start);
            let from = match step {
                PathStep::Index(_) => all.get(number)?.start,
                PathStep::Key(_) => all.get(number)?.end.min(range.end.saturating_sub(1)) + 1,
            };
            if matches!(step, PathStep::Key(_)) && !value.is_empty() {
                return Some(Region::Scalar(value));
            }
            let within = from..end.max(from);
            let inner = lines(mask, &within).iter().find_map(|l| indent(mask, l))?;
            (inner > *at || matches!(step, PathStep::Key(_)))
                .then_some(Region::Block(within, inner))
        }
    }
}

/// A region of a value on one line, or in brackets over several.
fn region_at(mask: &[u8], value: Range<usize>) -> Region {
    match mask.get(value.start) {
        Some(b'{' | b'[') => Region::Flow(value.start..closing(mask, value.start)),
        _ => Region::Scalar(value),
    }
}

/// The place behind the bracket that closes the one here.
fn closing(mask: &[u8], from: usize) -> usize {
    let mut depth = 0;
    for (i, c) in mask.iter().enumerate().skip(from) {
        match c {
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i + 1;
        }
    }
    mask.len()
}

/// The entries between the brackets of a flow, without spaces around them.
fn items(mask: &[u8], range: &Range<usize>) -> Vec<Range<usize>> {
    let inner = range.start + 1..range.end.saturating_sub(1);
    let (mut depth, mut from, mut all) = (0, inner.start, Vec::new());
    for i in inner.clone() {
        match mask.get(i) {
            Some(b'{' | b'[') => depth += 1,
            Some(b'}' | b']') => depth -= 1,
            Some(b',') if depth == 0 => {
                all.push(trimmed(mask, from..i));
                from = i + 1;
            }
            _ => {}
        }
    }
    all.push(trimmed(mask, from..inner.end));
    all.retain(|r| !r.is_empty());
    all
}

/// Where the value of `key: value` is, if the item has this key.
fn value_of(mask: &[u8], item: &Range<usize>, key: &str) -> Option<Range<usize>> {
    let item = trimmed(mask, item.clone());
    let rest = mask.get(item.clone())?.strip_prefix(key.as_bytes())?;
    let spaces = rest.iter().take_while(|c| **c == b' ').count();
    (rest.get(spaces) == Some(&b':')).then(|| {
        let from = item.start + key.len() + spaces + 1;
        trimmed(mask, from..item.end)
    })
}

/// A range without spaces, line breaks and comments at its ends.
fn trimmed(mask: &[u8], range: Range<usize>) -> Range<usize> {
    let idle = |i: usize| {
        mask.get(i)
            .is_none_or(|c| c.is_ascii_whitespace() || *c == b'#')
    };
    let (mut from, mut to) = (range.start, range.end);
    while from < to && idle(from) {
        from += 1;
    }
    while from < to && idle(to - 1) {
        to -= 1;
    }
    from..to
}

/// The text with a new entry in a region.
fn insert(text: &str, mask: &[u8], region: &Region, entry: &str, edit: &Edit) -> Option<String> {
    let mut new = text.to_owned();
    match region {
        Region::Scalar(_) => None,
        Region::Flow(range) => {
            let last = items(mask, range).last().cloned();
            let (at, entry) = match last {
                Some(last) => (last.end, format!(", {entry}")),
                None => (range.start + 1, entry.to_owned()),
            };
            new.insert_str(at, &entry);
            Some(commented(&new, at, edit))
        }
        Region::Block(range, at) => {
            let all = lines(mask, range);
            let last = all.iter().rfind(|l| indent(mask, l).is_some())?;
            let line = format!("\n{}{entry}", " ".repeat(*at));
            new.insert_str(last.end, &line);
            Some(commented(&new, last.end + 1, edit))
        }
    }
}

/// The text with the comment above the line of this place, instead of one of an earlier time.
fn commented(text: &str, at: usize, edit: &Edit) -> String {
    let start = text
        .get(..at)
        .and_then(|t| t.rfind('\n'))
        .map_or(0, |i| i + 1);
    let (head, tail) = text.split_at(start);
    let spaces: String = tail.chars().take_while(|c| *c == ' ').collect();
    let name = edit.key.rsplit('.').next().unwrap_or_default();
    let begin = format!("{MARK}{name} calibrated");
    let mut kept: Vec<&str> = head.lines().collect();
    let mut i = kept.len();
    while let Some(line) = i.checked_sub(1).and_then(|j| kept.get(j)) {
        if !line.trim_start().starts_with('#') {
            break;
        }
        i -= 1;
        if line.trim_start().starts_with(&begin) {
            kept.remove(i);
        }
    }
    let mut new: String = kept.iter().flat_map(|l| [l, "\n"]).collect();
    new += &format!("{spaces}{MARK}{name} {}\n{tail}", edit.comment);
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: &str = "\
# a drive
version: 1   # of the format
files: {log: \"a, {b}.csv\"}
nominal:
  tare_kg: 1500   # weighed
  wheel_radius_m: 0.31
channels:
  # the box
  specific_force: {columns: ['f: x', fy, fz], unit: m/s2,
    bias: [0, 0, 0]}   # behind the seat
  wheel_speed:
    - {columns: [v], unit: m/s}
    - columns: [w]
      unit: m/s
";

    fn edited(edits: &[(&str, &str)]) -> String {
        let mut text = MAP.to_owned();
        for (key, value) in edits {
            let edit = Edit {
                key: (*key).into(),
                value: (*value).into(),
                comment: "calibrated by x.csv: 1 ± 2".into(),
            };
            text = put(&text, &edit).unwrap_or_else(|| panic!("{key}"));
        }
        text
    }

    /// Whatever is put in, the file is what `--set` makes of it, and every comment of its author is still there.
    #[test]
    fn a_text_is_edited_as_set_does_it() {
        let edits = [
            ("nominal.wheel_radius_m", "0.305"),
            ("nominal.running_resistance", "0.012"),
            ("channels.specific_force.bias", "[0.1, 0, -0.2]"),
            ("channels.specific_force.lean_deg_per_g", "0.31"),
            ("channels.wheel_speed[0].gain", "1.01"),
            ("channels.wheel_speed[1].gain", "1.02"),
            ("trim.from_s", "5"),
            ("channels.specific_force.bias", "[0.3, 0, -0.2]"),
        ];
        let text = edited(&edits);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.yaml");
        std::fs::write(&path, MAP).unwrap();
        let mut expected = Document::read(&path).unwrap();
        let sets = edits.map(|(k, v)| (k.to_owned(), v.to_owned()));
        expected.apply(&Sets::new(&sets)).unwrap();
        assert!(expected.is_of(&text), "{text}");
        for comment in [
            "# a drive",
            "# of the format",
            "# weighed",
            "# the box",
            "# behind the seat",
        ] {
            assert!(text.contains(comment), "{comment} in\n{text}");
        }
        // the second time of one key replaces the comment of the first
        assert_eq!(text.matches("# bias calibrated by").count(), 1, "{text}");
    }
}
