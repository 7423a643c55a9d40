//! One HTML file with the web viewer and recordings inside: it opens from disk, offline, and loads and sends nothing.
//!
//! A content security policy forbids every connection: left alone, the viewer would send usage data. The module is
//! packed with gzip, which the browser unpacks; all of it stands in the page as base64.

use super::web_viewer::WebViewer;
use crate::ui::errors::CliError;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use monorig_lab::reports::html::escape;
use std::io::Write;

/// Page with places for the viewer and the recordings.
const PAGE: &str = include_str!("view.html");
/// Browsers and mail programs have trouble with larger files.
const MAX_BYTES: usize = 60_000_000;
/// Replacement for the address of an inline script, which has none: the viewer reads this address, but does not need it
/// here.
const ADDRESS: (&str, &str) = (
    "new URL(document.currentScript.src, location.href)",
    "new URL(location.href)",
);

/// A recording to put into a page.
pub struct Recording {
    /// Its name.
    pub name: String,
    /// The bytes of its `.rrd` file.
    pub bytes: Vec<u8>,
}

/// Makes the page. A page that would be too large is an error.
pub fn page(title: &str, viewer: &WebViewer, runs: &[Recording]) -> Result<String, CliError> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    let packed = packed
        .write_all(&viewer.module)
        .and_then(|()| packed.finish())
        .map_err(CliError::Output)?;
    let script = viewer.script.replace(ADDRESS.0, ADDRESS.1);
    // an end tag within the script would end it
    let script = script.replace("</script", "<\\/script");
    let recordings: String = runs.iter().map(element).collect();
    let page = filled(&[
        ("{{TITLE}}", &escape(title)),
        ("{{MODULE}}", &STANDARD.encode(packed)),
        ("{{RECORDINGS}}", &recordings),
        ("{{SCRIPT}}", &script),
    ]);
    within_limit(page.len(), recordings.len())?;
    Ok(page)
}

fn element(run: &Recording) -> String {
    let (name, data) = (escape(&run.name), STANDARD.encode(&run.bytes));
    format!(
        "<script type=\"text/plain\" class=\"recording\" data-name=\"{name}\">{data}</script>\n"
    )
}

/// Fills in the places of the page in their order; filled-in text is not searched again.
fn filled(places: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = PAGE;
    for (place, text) in places {
        if let Some((before, after)) = rest.split_once(place) {
            out += before;
            out += text;
            rest = after;
        }
    }
    out + rest
}

fn within_limit(page: usize, recordings: usize) -> Result<(), CliError> {
    let mega = |bytes: usize| format!("{:.0} MB", bytes as f64 / 1e6);
    if page <= MAX_BYTES {
        return Ok(());
    }
    Err(CliError::Refused {
        message: format!(
            "the page would have {}, of which recordings have {}; the limit is {}",
            mega(page),
            mega(recordings),
            mega(MAX_BYTES)
        ),
        help: "record less: a shorter run (`--set stop.after_s=…`), or a lower rate (`--set record.rate_hz=…`, `record.pose_rate_hz`); \
               or open run.rrd with `rerun`"
            .into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn viewer() -> WebViewer {
        WebViewer {
            script: format!("let x = \"</script>\"; {};", ADDRESS.0),
            module: b"module".to_vec(),
        }
    }

    fn run(name: &str) -> Recording {
        Recording {
            name: name.into(),
            bytes: vec![0, 159, 146],
        }
    }

    #[test]
    fn everything_is_in_the_page_and_nothing_outside_of_it() {
        let page = page("a<b", &viewer(), &[run("x\"y"), run("{{SCRIPT}}")]).unwrap();
        assert!(page.contains("<title>a&lt;b</title>"));
        assert!(page.contains("data-name=\"x&quot;y\">AJ+S</script>"));
        assert!(
            page.contains("data-name=\"{{SCRIPT}}\""),
            "a name is not a place"
        );
        assert!(page.contains("<\\/script>\"; new URL(location.href);"));
        for other in [
            "src=",
            "href=",
            "http:",
            "https:",
            "{{TITLE}}",
            "{{MODULE}}",
        ] {
            assert!(!page.contains(other), "{other}");
        }
        assert!(page.contains("connect-src 'none'") && page.contains("default-src 'none'"));
    }

    #[test]
    fn a_page_too_large_says_what_to_do() {
        assert!(within_limit(MAX_BYTES, 0).is_ok());
        let refused = within_limit(75_000_000, 58_000_000)
            .unwrap_err()
            .to_string();
        assert!(
            refused.contains("75 MB, 58 MB of it recordings; 60 MB"),
            "{refused}"
        );
        assert!(refused.contains("stop.after_s"));
    }
}
