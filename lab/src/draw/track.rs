//! A track: a line in plan and a profile, drawn element by element.

use super::{Draws, TrackRanges};
use std::f64::consts::PI;

/// Least difference between two consecutive grades, degrees.
const LEAST_CHANGE_DEG: f64 = 0.5;
/// Largest share of a bend's turn in its easements.
const EASED: f64 = 0.8;

/// Distance within which two parts of a line come too near to each other: a wide train, m; the way between them beyond
/// which they are two, m; and the number of lines that are drawn until a straight one is taken.
const TOO_NEAR_M: f64 = 2.0;
const TWO_PARTS_M: f64 = 12.0;
const LINES: usize = 100;

/// A drawn track: the text of its lists, and how long it is.
pub(crate) struct Track {
    /// The lists `horizontal`, `vertical` and `joints` of a track file.
    pub(crate) text: String,
    pub(crate) length_m: f64,
}

/// A track for a train of this length (m) that can climb up to `steepest_deg`.
pub(crate) fn draw(ranges: &TrackRanges, seed: u64, train_m: f64, steepest_deg: f64) -> Track {
    let mut draws = Draws::new(seed, "length");
    // level rail for the train to stand on, and way to go
    let length_m = round(draws.within(ranges.length_m).max(2.0 * train_m), 1);
    let text = [
        plan(ranges, &mut Draws::new(seed, "plan"), length_m),
        profile(
            ranges,
            &mut Draws::new(seed, "profile"),
            train_m,
            length_m,
            steepest_deg,
        ),
        joints(ranges, &mut Draws::new(seed, "joints")),
    ];
    Track {
        text: text.concat(),
        length_m,
    }
}

/// The line in plan. It does not come near to itself: the train would run into the rail from which it hangs.
fn plan(ranges: &TrackRanges, draws: &mut Draws, length_m: f64) -> String {
    if draws.chance(ranges.straight_share.get()) {
        return String::new();
    }
    let lines = (0..LINES).map(|_| line(ranges, draws, length_m));
    let apart = lines.into_iter().find(|(_, points)| !meets_itself(points));
    apart.map_or_else(String::new, |(text, _)| text)
}

/// A line in plan, and its points some metre apart, m.
fn line(ranges: &TrackRanges, draws: &mut Draws, length_m: f64) -> (String, Vec<[f64; 2]>) {
    let mut text = "horizontal:\n".to_owned();
    let (mut way, mut heading, mut points) = (0.0, 0.0, vec![[0.0; 2]]);
    while way < length_m {
        let straight = round(draws.within(ranges.straight_m), 1);
        let radius = round(draws.log_within(ranges.radius_m), 1);
        let turn = round(draws.within(ranges.bend_deg), 0);
        let easement = easement(ranges, draws, radius, turn);
        let side = if draws.chance(0.5) { 1.0 } else { -1.0 };
        text += &format!("  - {{kind: line, length_m: {straight}}}\n");
        text += &format!(
            "  - {{kind: arc, radius_m: {radius}, angle_deg: {}, easement_m: {easement}}}\n",
            side * turn
        );
        let arc = radius * turn * PI / 180.0;
        way += straight + arc;
        for (length, turned) in [(straight, 0.0), (arc, side * arc / radius)] {
            let pieces = length.ceil();
            for _ in 0..pieces as usize {
                heading += turned / pieces;
                let [x, y] = points[points.len() - 1];
                let piece = length / pieces;
                points.push([
                    x + piece * libm::cos(heading),
                    y + piece * libm::sin(heading),
                ]);
            }
        }
    }
    (text, points)
}

/// Returns true if parts of a line with a point in every metre come too near to each other.
fn meets_itself(points: &[[f64; 2]]) -> bool {
    let near = |[a, b]: [[f64; 2]; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]) < TOO_NEAR_M;
    let later = |k: usize| points.iter().skip(k + TWO_PARTS_M as usize);
    let mut from = points.iter().enumerate();
    from.any(|(k, a)| later(k).any(|b| near([*a, *b])))
}

fn profile(
    ranges: &TrackRanges,
    draws: &mut Draws,
    train_m: f64,
    length_m: f64,
    steepest_deg: f64,
) -> String {
    let [low, high] = ranges
        .grade_deg
        .map(|g| g.get().clamp(-steepest_deg, steepest_deg));
    let first = round(train_m + draws.within(ranges.grade_length_m), 1);
    let mut text = format!("vertical:\n  - {{kind: grade, length_m: {first}}}\n");
    let (mut way, mut grade) = (first, 0.0);
    while way < length_m {
        let mut next = round(draws.within([low, high]), 1);
        if (next - grade).abs() < LEAST_CHANGE_DEG {
            next = if grade + LEAST_CHANGE_DEG <= high {
                grade + LEAST_CHANGE_DEG
            } else {
                grade - LEAST_CHANGE_DEG
            };
        }
        let turn = (next - grade).abs();
        let radius = round(draws.log_within(ranges.vertical_radius_m), 1);
        let easement = easement(ranges, draws, radius, turn);
        let constant = round(draws.within(ranges.grade_length_m), 1);
        let next = round(next, 1);
        text += &match draws.chance(0.5) {
            true => format!("  - {{kind: transition, to_grade_deg: {next}, radius_m: {radius}}}\n"),
            false => format!(
                "  - {{kind: arc, to_grade_deg: {next}, radius_m: {radius}, easement_m: {easement}}}\n"
            ),
        };
        text += &format!("  - {{kind: grade, length_m: {constant}}}\n");
        way += radius * turn * PI / 180.0 + constant;
        grade = next;
    }
    text
}

fn joints(ranges: &TrackRanges, draws: &mut Draws) -> String {
    let jointed = draws.chance(ranges.jointed_share.get());
    let every = round(draws.within(ranges.joint_every_m), 2);
    let kink = round(draws.within(ranges.joint_kink_deg), 3);
    let step = round(draws.within(ranges.joint_step_m), 5);
    match jointed {
        true => format!("joints: {{every_m: {every}, kink_deg: {kink}, step_m: {step}}}\n"),
        false => String::new(),
    }
}

/// The drawn easement, shortened if the arc has no room for it.
fn easement(ranges: &TrackRanges, draws: &mut Draws, radius_m: f64, turn_deg: f64) -> f64 {
    let room = EASED * radius_m * turn_deg * PI / 180.0;
    let drawn = draws.within(ranges.easement_m);
    // rounded down, so that it stays within the room
    libm::floor(drawn.min(room) * 100.0) / 100.0
}

/// A number with so many digits behind the point: what a person would write.
pub(crate) fn round(x: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    libm::round(x * scale) / scale
}
