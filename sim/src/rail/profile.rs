//! The I-beam: a handful of lengths, and the outline they give.
//!
//! Coordinates across the rail are (l, u), m. The rail's line, the origin, is the middle of the web at half the height.

use crate::error::DataError;

/// Lengths of a symmetric I-beam whose flanges taper from the web to their tips.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProfileSpec {
    /// Name, such as `I140E`.
    pub name: String,
    /// Overall height, m.
    pub height_m: f64,
    /// Width of the flanges, m.
    pub flange_width_m: f64,
    /// Thickness of the web, m.
    pub web_m: f64,
    /// Thickness of a flange at its tips, m.
    pub flange_tip_m: f64,
    /// Thickness of a flange at the web, m; not less than at the tips.
    pub flange_root_m: f64,
}

/// A rail profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name.
    pub(crate) name: String,
    /// Overall height, m.
    pub(crate) height_m: f64,
    /// Width of the flanges, m.
    pub(crate) flange_width_m: f64,
    /// Thickness of the web, m.
    pub(crate) web_m: f64,
    /// Thickness of a flange at its tips, m.
    pub(crate) flange_tip_m: f64,
    /// Thickness of a flange at the web, m.
    pub(crate) flange_root_m: f64,
    /// Closed outline in (l, u), counter-clockwise (l to the right, u up), 12 points from the lower flange's underside.
    pub(crate) outline: Vec<[f64; 2]>,
}

/// Convex parts of the outline, as indices into it, counter-clockwise: lower flange, web, upper flange.
pub(crate) const PARTS: [&[usize]; 3] =
    [&[0, 1, 2, 3, 10, 11], &[10, 3, 4, 9], &[4, 5, 6, 7, 8, 9]];

impl Profile {
    /// Makes the profile with these lengths. Keys in errors are those of [`ProfileSpec`].
    pub(crate) fn new(p: &ProfileSpec) -> Result<Self, DataError> {
        let bad = |key: &str, message: &str, help: &str| Err(DataError::new(key, message, help));
        let (h, b, web) = (p.height_m, p.flange_width_m, p.web_m);
        let (tip, root) = (p.flange_tip_m, p.flange_root_m);
        if h > 2.0 || b > 2.0 {
            return bad(
                "height_m",
                "no rail is larger than 2 m",
                "metres, such as 0.155",
            );
        }
        if web >= b {
            return bad(
                "web_m",
                "the web is not thinner than the flanges are wide",
                "less than flange_width_m",
            );
        }
        if tip > root {
            return bad(
                "flange_tip_m",
                "the flange is thicker at its tips than at the web",
                "at most flange_root_m",
            );
        }
        if 2.0 * root >= h {
            return bad(
                "flange_root_m",
                "the two flanges leave no web between them",
                "less than half of height_m",
            );
        }
        let (b, w, h) = (0.5 * b, 0.5 * web, 0.5 * h);
        Ok(Self {
            name: p.name.clone(),
            height_m: p.height_m,
            flange_width_m: p.flange_width_m,
            web_m: web,
            flange_tip_m: tip,
            flange_root_m: root,
            outline: vec![
                [-b, -h],
                [b, -h],
                [b, tip - h],
                [w, root - h],
                [w, h - root],
                [b, h - tip],
                [b, h],
                [-b, h],
                [-b, h - tip],
                [-w, h - root],
                [-w, root - h],
                [-b, tip - h],
            ],
        })
    }

    /// Height of the lower flange's upper face over the rail's line at a distance from the middle, m (negative): where
    /// running wheels roll. Constant under the web and beyond the tips.
    #[cfg(test)]
    pub(crate) fn running_surface(&self, left_m: f64) -> f64 {
        let (tip, web) = (0.5 * self.flange_width_m, 0.5 * self.web_m);
        let share = ((left_m.abs() - web) / (tip - web)).clamp(0.0, 1.0);
        self.flange_root_m + share * (self.flange_tip_m - self.flange_root_m) - 0.5 * self.height_m
    }

    /// Width and height of the box around the section, m.
    pub(crate) fn bounding_box(&self) -> [f64; 2] {
        [self.flange_width_m, self.height_m]
    }

    /// Area of the cross-section, m².
    #[cfg(test)]
    pub(crate) fn area(&self) -> f64 {
        let last = self.outline.len();
        let cross = |i: usize| {
            let (a, b) = (self.outline[i], self.outline[(i + 1) % last]);
            a[0] * b[1] - a[1] * b[0]
        };
        0.5 * (0..last).map(cross).sum::<f64>()
    }
}
