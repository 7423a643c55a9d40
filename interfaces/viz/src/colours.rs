//! Colours: one for each estimator in every plot, white for the truth; the rail by its slope.

use monorig_sim::record::palette;

/// The truth.
const TRUTH: [u8; 3] = [235, 235, 235];
const REFERENCE: [u8; 3] = [190, 160, 255];
/// Limits: thin and grey.
pub const LIMIT: [u8; 3] = [150, 150, 150];
/// The Cramér-Rao bound: in plots of errors, where there is no line of the truth.
const BOUND: [u8; 3] = [235, 235, 235];
/// Colours of estimators and of other lines, in the order of the reports' dark theme (`lab/src/reports/style.css`), so
/// that an estimator has the same colour in both.
const PALETTE: [[u8; 3]; 6] = [
    [0x4a, 0xa8, 0xe8],
    [0xff, 0x8c, 0x42],
    [0x2f, 0xcf, 0x9f],
    [0xe3, 0x91, 0xc2],
    [0xf0, 0xb9, 0x3a],
    [0xb8, 0xe3, 0xff],
];
/// Names of the colours.
const NAMES: [&str; PALETTE.len()] = ["blue", "orange", "green", "pink", "yellow", "pale blue"];
/// Colours of a level rail, of a climbing rail and of a descending rail at [`FULL_GRADE_RAD`].
const LEVEL: [f64; 3] = [165.0, 168.0, 172.0];
const CLIMB: [f64; 3] = [230.0, 120.0, 30.0];
const DESCENT: [f64; 3] = [50.0, 130.0, 230.0];
/// Steeper slopes have the same colour: 12°.
const FULL_GRADE_RAD: f64 = 0.21;

/// The name of an estimator's colour.
pub fn name(estimator: &str) -> &'static str {
    NAMES[palette::place(estimator) % NAMES.len()]
}

/// The colour of the line of a channel. `index`: its place among the channels.
pub fn line(path: &str, index: usize) -> [u8; 3] {
    let mut parts = path.split('/');
    match (parts.next(), parts.next(), parts.next()) {
        (Some("truth"), Some("pitch_at_imu"), None) => [170, 170, 200],
        (Some("truth"), Some(leaf), None)
            if !["resistance", "brake", "load_mass"].contains(&leaf)
                && !leaf.starts_with("sway") =>
        {
            TRUTH
        }
        (Some("control"), Some(leaf), None) if leaf.starts_with("reference") => REFERENCE,
        (Some("bound"), ..) => BOUND,
        (Some("estimates"), Some(name), _) => PALETTE[palette::place(name) % PALETTE.len()],
        _ => PALETTE[index % PALETTE.len()],
    }
}

/// The colour of a rail of this grade (rad): grey on the level, orange uphill, blue downhill.
pub fn of_grade(grade_rad: f64) -> [u8; 4] {
    let end = if grade_rad > 0.0 { CLIMB } else { DESCENT };
    let share = (grade_rad.abs() / FULL_GRADE_RAD).min(1.0);
    let mix = |k: usize| (LEVEL[k] + share * (end[k] - LEVEL[k])).round() as u8;
    [mix(0), mix(1), mix(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_told_apart_by_colour() {
        let [up, level, down] = [0.1, 0.0, -0.1].map(of_grade);
        assert_eq!(level[..3], LEVEL.map(|x| x as u8));
        assert!(up[0] > level[0] && up[2] < level[2]);
        assert!(down[0] < level[0] && down[2] > level[2]);
        assert_eq!(of_grade(0.3), of_grade(0.9));
    }
}
