//! Limits of URDF files, counted before the XML reader starts: it recurses once a level, and compares every attribute
//! of a tag with every other (quick-xml 0.39, RUSTSEC-2026-0194 and -0195, on which urdf-rs 0.10 depends).

use super::file::File;
use crate::error::Error;

/// Longest file, bytes; meshes are files of their own.
const MAX_BYTES: usize = 1 << 20;
/// Most tags.
const MAX_TAGS: usize = 20_000;
/// Longest tag, bytes.
const MAX_TAG_BYTES: usize = 4096;
/// Most attributes of a tag: URDF needs six.
const MAX_ATTRIBUTES: usize = 16;
/// Deepest nesting: URDF needs five levels.
const MAX_NESTING: usize = 50;

/// Refuses a file beyond the limits, or with XML features that URDF does not need. Any other mistake is left to the
/// reader.
pub(super) fn check(file: &File<'_>) -> Result<(), Error> {
    let text = file.text.as_str();
    let fault = |message: String, help: &str| Err(file.fault("", "", message, help));
    if text.len() > MAX_BYTES {
        let message = format!("this file has {} kB", text.len() >> 10);
        return fault(
            message,
            "use at most 1024 kB; put meshes into their own files",
        );
    }
    if text.contains("<!DOCTYPE") || text.contains("<!ENTITY") {
        let message = "document types and entities are not read".into();
        return fault(message, "write the values themselves");
    }
    if text.matches('<').count() > MAX_TAGS {
        let message = "this file has far too many tags".into();
        return fault(message, "at most 20000 tags");
    }
    for tag in tags(text) {
        if tag.len() > MAX_TAG_BYTES {
            return fault(
                "a tag is longer than 4096 bytes".into(),
                "every tag ends with `>`",
            );
        }
        if tag.matches('=').count() > MAX_ATTRIBUTES {
            let message = format!("a tag has more than {MAX_ATTRIBUTES} attributes");
            return fault(message, "the attributes that URDF knows");
        }
    }
    if nesting(text) > MAX_NESTING {
        let message = format!("elements are nested more than {MAX_NESTING} deep");
        return fault(message, "URDF needs five levels");
    }
    Ok(())
}

/// The texts between `<` and `>`, comments included.
fn tags(text: &str) -> impl Iterator<Item = &str> {
    let after = text.split('<').skip(1);
    after.map(|rest| rest.split('>').next().unwrap_or_default())
}

/// Depth of the deepest element.
fn nesting(text: &str) -> usize {
    let (mut depth, mut deepest, mut rest) = (0_usize, 0, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        if rest.starts_with("!--") {
            rest = rest.find("-->").map_or("", |end| &rest[end..]);
            continue;
        }
        let tag = rest.split('>').next().unwrap_or_default();
        if tag.starts_with('/') {
            depth = depth.saturating_sub(1);
        } else if !tag.starts_with(['?', '!']) && !tag.ends_with('/') {
            depth += 1;
            deepest = deepest.max(depth);
        }
    }
    deepest
}
