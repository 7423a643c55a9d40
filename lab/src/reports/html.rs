//! Text that goes into HTML.

use crate::text::is_hidden;

/// An address as it may stand in `href`: of the web, or of a file beside the page; never one that runs something.
pub fn link(to: &str) -> String {
    let web = ["https://", "http://"].iter().any(|s| to.starts_with(s));
    let scheme = to.split(['/', '?', '#']).next().unwrap_or_default();
    match !web && scheme.contains(':') {
        true => escape(&format!("./{to}")), // a name with a colon in it, and no scheme
        false => escape(to),
    }
}

/// Text as it may stand between tags and in attributes.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // XML knows no other control characters, not even escaped ones
            c if is_hidden(c) => out.push(char::REPLACEMENT_CHARACTER),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_and_control_characters_are_harmless() {
        assert_eq!(
            escape("<a href=\"x\">'&'\u{1}"),
            "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;\u{fffd}"
        );
    }

    #[test]
    fn links_lead_to_the_web_or_to_files() {
        for (to, text) in [
            ("run.rrd", "run.rrd"),
            ("../a b/run.rrd", "../a b/run.rrd"),
            ("https://doi.org/1", "https://doi.org/1"),
            ("javascript:alert(1)", "./javascript:alert(1)"),
            (
                "JavaScript:alert(1)/run.rrd",
                "./JavaScript:alert(1)/run.rrd",
            ),
            ("data:text/html,x", "./data:text/html,x"),
            ("java\tscript:x", "./java\tscript:x"),
            ("a/b:c", "a/b:c"),
        ] {
            assert_eq!(link(to), text);
        }
    }
}
