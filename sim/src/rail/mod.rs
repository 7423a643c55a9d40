//! The rail: an analytic curve in space and its I-beam profile.
//!
//! A track file ([`config::track`](crate::config::track)) lists a horizontal alignment and a vertical profile along the
//! chainage s, the arc length in space. They become two angle functions (`alignment`): heading ψ(s) and grade θ(s),
//! whose derivatives are the curvatures κ_h and κ_v. A surveyed track
//! ([`config::track::survey`](crate::config::track::survey)) gives the same functions through a smoothing spline; rail
//! joints ([`joints`]) add small kinks and steps to θ. The curve is the integral of t = (cos θ cos ψ, cos θ sin ψ, sin
//! θ), kept as short polynomials (`nodes`) so that a frame takes the physics loop some tens of nanoseconds.

pub(crate) mod alignment;
mod check;
mod frame;
pub(crate) mod joints;
pub(crate) mod mesh;
mod nodes;
pub mod profile;
pub(crate) mod spline;

use alignment::Angle;
pub use alignment::Place;
pub(crate) use frame::pieces;
pub use frame::{Cursor, RailFrame};
use joints::Joints;
use nalgebra::Vector3;
use nodes::Nodes;
use profile::Profile;

/// Cross-section along the line: a rail or a road.
#[derive(Clone, Debug)]
pub(crate) enum Section {
    /// An I-beam; the line is the middle of its web.
    Rail(Profile),
    /// A lane: its outline in (l, u), m; the line is the middle of its surface.
    Road([[f64; 2]; 4]),
}

impl Section {
    /// A lane of this width, m.
    pub(crate) fn road(width_m: f64) -> Self {
        let (half, below) = (0.5 * width_m, -ROAD_THICKNESS_M);
        Section::Road([[-half, below], [half, below], [half, 0.0], [-half, 0.0]])
    }
}

/// A rail, or a road, ready to be run on. Outside 0…length it goes on straight along its end tangents.
#[derive(Clone, Debug)]
pub struct Rail {
    /// Name from the track file.
    pub name: String,
    /// Named elements of the rail; of a repeated element the first.
    pub places: Vec<Place>,
    horizontal: Angle,
    vertical: Angle,
    joints: Option<Joints>,
    section: Section,
    nodes: Nodes,
    /// Line without the steps of joints, if the rail has steps.
    without_steps: Option<Nodes>,
    length: f64,
}

impl Rail {
    /// A rail or road from its two angles along the chainage; `start` = where it begins in the world, m.
    pub(crate) fn new(
        name: &str,
        start: Vector3<f64>,
        horizontal: Angle,
        vertical: Angle,
        joints: Option<Joints>,
        section: Section,
    ) -> Self {
        let length = horizontal.length().max(vertical.length());
        let build =
            |joints: Option<&Joints>| Nodes::build(start, &horizontal, &vertical, joints, length);
        let nodes = build(joints.as_ref());
        let smooth = joints.as_ref().and_then(Joints::without_steps);
        let without_steps = smooth.map(|j| build(Some(&j)));
        Self {
            name: name.to_owned(),
            places: Vec::new(),
            horizontal,
            vertical,
            joints,
            section,
            nodes,
            without_steps,
            length,
        }
    }

    /// Returns the end of the rail for messages, m: whole millimetres, never beyond the end.
    pub(crate) fn end_m(&self) -> f64 {
        libm::floor(self.length() * 1e3 + 1e-6) / 1e3
    }

    /// Chainages of its joints, ascending, m.
    pub(crate) fn joint_chainages(&self) -> impl Iterator<Item = f64> + '_ {
        self.joints.iter().flat_map(Joints::chainages)
    }

    /// Length, m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The I-beam; none on a road.
    pub(crate) fn profile(&self) -> Option<&Profile> {
        match &self.section {
            Section::Rail(profile) => Some(profile),
            Section::Road(_) => None,
        }
    }

    /// Returns the closed visible outline of the rail in (l, u), m, around the line.
    pub(crate) fn outline(&self) -> &[[f64; 2]] {
        match &self.section {
            Section::Rail(profile) => &profile.outline,
            Section::Road(outline) => outline,
        }
    }

    /// The rail joints, if the track has any.
    #[cfg(test)]
    pub(crate) fn joints(&self) -> Option<&Joints> {
        self.joints.as_ref()
    }

    /// Grade angle θ of the alignment at s, rad, + uphill towards growing s. Kinks and steps of rail joints are not in
    /// it.
    pub fn grade(&self, s: f64) -> f64 {
        self.vertical.value(s)
    }

    /// Returns the heading ψ of the alignment at s, rad, + left (counter-clockwise about the world's z axis, from the x
    /// axis).
    pub fn heading(&self, s: f64) -> f64 {
        self.horizontal.value(s)
    }

    /// Vertical curvature dθ/ds of the alignment at s, 1/m, + sag. At a jump, the value behind it. Without joints.
    pub fn curvature_vertical(&self, s: f64) -> f64 {
        self.vertical.slope(s)
    }

    /// Horizontal curvature dψ/ds at s, 1/m, + left. At a jump, the value behind it.
    pub fn curvature_horizontal(&self, s: f64) -> f64 {
        self.horizontal.slope(s)
    }

    /// The frame at s.
    pub fn frame(&self, s: f64) -> RailFrame {
        self.frame_at(s, &mut Cursor::at(s))
    }

    /// The frame at s; the cursor is moved there. Faster than [`Rail::frame`] when s is near the cursor.
    pub fn frame_at(&self, s: f64, cursor: &mut Cursor) -> RailFrame {
        frame_of(&self.nodes, s, cursor)
    }

    /// Chainage of the point of the rail's line in whose cross-section `p` lies: (p − p(s))·t(s) = 0, solved by
    /// Newton's method from the cursor, which is moved there. `p` must be nearer to the line than its radius of
    /// curvature.
    pub fn project(&self, p: &Vector3<f64>, cursor: &mut Cursor) -> f64 {
        self.nodes.project(p, cursor)
    }

    /// The frame at the projection of `p`, for the hot loop: as [`Rail::project`] and then [`Rail::frame_at`], to 1e-9
    /// m, with one evaluation of the curve while `p` moves a few millimetres between calls.
    pub fn track(&self, p: &Vector3<f64>, cursor: &mut Cursor) -> RailFrame {
        self.nodes.track(p, cursor)
    }

    /// As [`Rail::track`], on the line without the steps of joints: a step is no grade, and a point well below the rail
    /// has no one place beside it. Kinks of joints are in it.
    pub(crate) fn track_without_steps(&self, p: &Vector3<f64>, cursor: &mut Cursor) -> RailFrame {
        self.smooth().track(p, cursor)
    }

    /// Returns the frame as [`Rail::frame_at`] does, on the line without the steps of joints: a point has no wheels
    /// that roll over them.
    pub(crate) fn frame_without_steps(&self, s: f64, cursor: &mut Cursor) -> RailFrame {
        frame_of(self.smooth(), s, cursor)
    }

    /// The line without the steps of joints.
    fn smooth(&self) -> &Nodes {
        self.without_steps.as_ref().unwrap_or(&self.nodes)
    }

    /// Sine of the grade at a frame of the rail at the cursor, without the steps of joints.
    pub(crate) fn sine_without_steps(&self, f: &RailFrame, cursor: &mut Cursor) -> f64 {
        let Some(nodes) = &self.without_steps else {
            return f.t.z;
        };
        cursor.smooth = nodes.find(f.s, cursor.smooth);
        nodes.eval(cursor.smooth, f.s).t.z
    }

    /// Cursor at the point of the rail nearest to `p`, searched along the whole rail: a cold start.
    pub fn nearest(&self, p: &Vector3<f64>) -> Cursor {
        self.nodes.nearest(p)
    }

    /// Frames every `step_m` from 0, and at the end. A step that is not above zero gives the two ends only.
    pub(crate) fn samples(&self, step_m: f64) -> Vec<RailFrame> {
        let pieces = pieces(self.length, step_m);
        let mut cursor = Cursor::default();
        let mut frames = Vec::with_capacity(pieces + 1);
        for i in 0..pieces {
            frames.push(self.frame_at(step_m * i as f64, &mut cursor));
        }
        frames.push(self.frame_at(self.length, &mut cursor));
        frames
    }
}

/// The frame of a line at s; the cursor is moved there.
fn frame_of(nodes: &Nodes, s: f64, cursor: &mut Cursor) -> RailFrame {
    cursor.node = nodes.find(s, cursor.node);
    cursor.s = s;
    let at = nodes.eval(cursor.node, s);
    RailFrame::new(s, at.p, at.t, at.k)
}

/// Thickness with which a road is drawn, m.
const ROAD_THICKNESS_M: f64 = 0.1;

#[cfg(test)]
mod tests;
