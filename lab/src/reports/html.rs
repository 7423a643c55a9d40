//! Text that goes into HTML.

use crate::text::marked;
use maud::html;

/// An address for `href`: of the web, or of a file beside the page; never one that runs something.
pub(crate) fn link(to: &str) -> String {
    let web = ["https://", "http://"].iter().any(|s| to.starts_with(s));
    let scheme = to.split(['/', '?', '#']).next().unwrap_or_default();
    match !web && scheme.contains(':') {
        true => format!("./{to}"), // a name with a colon in it, and no scheme
        false => to.to_owned(),
    }
}

/// Text escaped for the content of tags and for attributes in double quotes.
pub fn escape(text: &str) -> String {
    html! { (marked(text)) }.into_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_and_control_characters_are_harmless() {
        assert_eq!(
            escape("<a href=\"x\">'&'\u{1}"),
            "&lt;a href=&quot;x&quot;&gt;'&amp;'\u{fffd}"
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
