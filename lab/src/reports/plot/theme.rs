//! Colours. A drawing names them by role; the page's style sheet gives each a value in light, dark and print.
//!
//! plotters writes colours as numbers. So each role has a number that nothing else uses, and when the drawing is
//! finished the numbers are replaced by the role's name in the style sheet.

use monorig_sim::record::palette;
use plotters::style::RGBColor;

/// Number of colours for series; further series are dashed.
pub(crate) const SERIES: u8 = 6;

/// The role of a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Text, axes, the truth.
    Text,
    /// Secondary items.
    Muted,
    /// Grid lines.
    Grid,
    /// Held.
    Good,
    /// Failed.
    Bad,
    /// One of several things of a kind: 0, 1, 2 …
    Series(u8),
}

/// First numbers of the roles; series are counted from `FIRST_SERIES`.
const MARK: (u8, u8) = (1, 2);
const ROLES: [(Ink, &str); 5] = [
    (Ink::Text, "text"),
    (Ink::Muted, "muted"),
    (Ink::Grid, "grid"),
    (Ink::Good, "good"),
    (Ink::Bad, "bad"),
];
const FIRST_SERIES: u8 = 16;

impl Ink {
    /// Colour of series number `i`, for any number of series.
    pub fn series(i: usize) -> Self {
        Self::Series((i % (u8::MAX - FIRST_SERIES) as usize) as u8)
    }

    /// The colour of an estimator, the same in every plot and in the viewer.
    pub fn of_estimator(name: &str) -> Self {
        Self::series(palette::place(name))
    }

    pub(super) fn rgb(self) -> RGBColor {
        match self {
            Self::Series(i) => RGBColor(MARK.0, MARK.1, FIRST_SERIES.saturating_add(i)),
            role => {
                let i = ROLES.iter().position(|r| r.0 == role).unwrap_or(0);
                RGBColor(MARK.0, MARK.1, i as u8)
            }
        }
    }

    /// The colour in CSS.
    pub(super) fn css(self) -> String {
        match self {
            Self::Series(i) => format!("var(--s{})", i % SERIES),
            role => ROLES
                .iter()
                .find(|r| r.0 == role)
                .map_or(String::new(), |r| format!("var(--{})", r.1)),
        }
    }

    /// Dashes of a line; `None` for a solid one.
    pub(super) fn dashes(self) -> Option<&'static str> {
        let Self::Series(i) = self else {
            return None;
        };
        match i / SERIES {
            0 => None,
            1 => Some("14 7"),
            2 => Some("3 7"),
            _ => Some("14 6 3 6"),
        }
    }

    /// Attributes of a line in this colour.
    fn stroke(self) -> String {
        let dashes = self.dashes().map(|d| format!(" stroke-dasharray=\"{d}\""));
        format!("stroke=\"{}\"{}", self.css(), dashes.unwrap_or_default())
    }
}

/// A finished drawing with the style sheet's colours, which fits any width.
pub(super) fn themed(svg: &str) -> String {
    let mark = format!("#{:02X}{:02X}", MARK.0, MARK.1);
    let mut out = String::with_capacity(svg.len());
    let mut rest = match svg.find("viewBox") {
        Some(at) => {
            out.push_str("<svg ");
            &svg[at..]
        }
        None => svg,
    };
    while let Some(at) = rest.find(&mark) {
        let (before, after) = rest.split_at(at);
        let number = after
            .get(5..7)
            .and_then(|n| u8::from_str_radix(n, 16).ok())
            .unwrap_or(0);
        let ink = match number {
            n if n >= FIRST_SERIES => Ink::Series(n - FIRST_SERIES),
            n => ROLES.get(n as usize).map_or(Ink::Text, |r| r.0),
        };
        match before.strip_suffix("stroke=\"") {
            // the closing quote belongs to `stroke()`
            Some(before) => {
                out.push_str(before);
                out.push_str(&ink.stroke());
                rest = after.get(8..).unwrap_or("");
            }
            None => {
                out.push_str(before);
                out.push_str(&ink.css());
                rest = after.get(7..).unwrap_or("");
            }
        }
    }
    out.push_str(rest);
    // inside HTML the name space is known, and so is what a shape is without a word; thousands of dots make the rest
    // count
    let out = out.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
    fill_opacity(&out.replace(" stroke=\"none\" stroke-width=\"1\"", ""))
}

/// Opacity of fills: opacity of whole elements makes a printed page a hundred times as large.
fn fill_opacity(svg: &str) -> String {
    const WHOLE: &str = " opacity=\"";
    let mut parts = svg.split(WHOLE);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let next = part.split_once('"').map_or("", |p| p.1);
        let filled = next.starts_with(" fill=\"") && !next.starts_with(" fill=\"none");
        out.push_str(if filled { " fill-opacity=\"" } else { WHOLE });
        out.push_str(part);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_become_names_and_late_series_are_dashed() {
        let RGBColor(r, g, b) = Ink::Series(7).rgb();
        let svg = format!(
            "<svg width=\"9\" height=\"9\" viewBox=\"0 0 9 9\" xmlns=\"http://www.w3.org/2000/svg\">\
             <line stroke=\"#{r:02X}{g:02X}{b:02X}\" x1=\"0\"/><rect fill=\"#{r:02X}{g:02X}{b:02X}\"/></svg>"
        );
        assert_eq!(
            themed(&svg),
            "<svg viewBox=\"0 0 9 9\"><line stroke=\"var(--s1)\" stroke-dasharray=\"14 7\" x1=\"0\"/>\
             <rect fill=\"var(--s1)\"/></svg>"
        );
    }
}
