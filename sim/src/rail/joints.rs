//! Rail joints: real rails are suspended in pieces of 2–3 m, whose joints deflect a little and are not quite flush.
//!
//! Both are small additions to the grade angle, so the curve stays continuous and s stays its arc length:
//! - a kink turns the grade by ±`kink_deg`, the sign alternating from joint to joint, so that pieces zigzag about the
//!   alignment; the turn is spread over [`ROUNDING_M`];
//! - a step lifts the rail by `step_m` at one joint and lowers it at the next. A wheel of radius r meets a step of
//!   height h over a length √(2 r h) (Pythagoras at the wheel's rim, h ≪ r): the grade rises and falls linearly over
//!   that length, with peak √(2h/r).
//!
//! Only points nearer to the rail's line than r/2 (the radius of curvature within a step) project uniquely there.

use crate::error::DataError;

/// Length over which a kink turns, m: chosen, about the play of a bolted joint, and ten times a step of the physics at
/// walking pace.
pub const ROUNDING_M: f64 = 0.02;
const MAX_KINK_DEG: f64 = 2.0;
const MAX_STEP_M: f64 = 0.005;

/// Joints of a rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointSpec {
    /// Length of a piece of rail, m.
    pub every_m: f64,
    /// Deflection at a joint, degrees; signs alternate.
    pub kink_deg: f64,
    /// Height step at a joint, m; signs alternate.
    pub step_m: f64,
    /// Radius of the wheel that rolls over the step, m.
    pub wheel_radius_m: f64,
}

/// Rail joints along a track: kink and step angles by chainage.
#[derive(Clone, Copy, Debug)]
pub struct Joints {
    every: f64,
    count: usize,
    kink: f64,
    step: f64,
    ramp: f64,
}

impl Joints {
    /// Makes the joints of a rail of this length, m. Keys in errors are those of [`JointSpec`].
    pub fn new(j: &JointSpec, length: f64) -> Result<Self, DataError> {
        let bad =
            |key: &str, message: String, help: String| Err(DataError::new(key, message, help));
        let (every, kink, step) = (j.every_m, j.kink_deg, j.step_m);
        if kink > MAX_KINK_DEG {
            return bad(
                "kink_deg",
                format!("a kink of {kink}°"),
                format!("at most {MAX_KINK_DEG}°"),
            );
        }
        if step > MAX_STEP_M {
            return bad(
                "step_m",
                format!("a step of {step} m"),
                format!("at most {MAX_STEP_M} m"),
            );
        }
        if step > 0.1 * j.wheel_radius_m {
            return bad(
                "wheel_radius_m",
                format!("a step of {step} m is too large for this wheel"),
                "at least ten times step_m".into(),
            );
        }
        let ramp = (2.0 * j.wheel_radius_m * step).sqrt();
        let width = ramp.max(ROUNDING_M);
        if every < 4.0 * width {
            return bad(
                "every_m",
                format!("pieces of {every} m are shorter than their joints"),
                format!(
                    "use at least {:.3} m; usual lengths are 2 to 3 m",
                    4.0 * width
                ),
            );
        }
        Ok(Self {
            every,
            // the last joint lies whole on the track
            count: ((length - width) / every).floor().max(0.0) as usize,
            kink: kink.to_radians(),
            step,
            ramp,
        })
    }

    /// Returns the joints without their steps; `None` if they have no steps.
    pub(crate) fn without_steps(&self) -> Option<Self> {
        (self.step > 0.0).then_some(Self { step: 0.0, ..*self })
    }

    /// Chainages of the joints, m.
    pub fn chainages(&self) -> impl Iterator<Item = f64> + '_ {
        (1..=self.count).map(|i| i as f64 * self.every)
    }

    /// Chainages at which the angle below bends, m.
    pub(crate) fn borders(&self) -> impl Iterator<Item = f64> + '_ {
        let (a, b) = (0.5 * ROUNDING_M, 0.5 * self.ramp);
        self.chainages()
            .flat_map(move |s| [s - a, s - b, s, s + b, s + a])
    }

    /// Contribution of the joints to the grade angle at s, rad, and its derivative, 1/m.
    pub fn angle(&self, s: f64) -> (f64, f64) {
        // the nearest joint decides; before the first and behind the last its outer side goes on
        let nearest = (s / self.every)
            .round()
            .clamp(1.0, self.count.max(1) as f64);
        if self.count == 0 {
            return (0.0, 0.0);
        }
        // + at odd joints (down-kink, up-step), − at even ones
        let sign = if nearest % 2.0 == 1.0 { 1.0 } else { -1.0 };
        let x = s - nearest * self.every;
        let half = 0.5 * ROUNDING_M;
        let (mut angle, mut slope) = if x.abs() < half {
            (-0.5 * self.kink * x / half, -0.5 * self.kink / half)
        } else {
            (-0.5 * self.kink * x.signum(), 0.0)
        };
        let half = 0.5 * self.ramp;
        if x.abs() < half {
            let peak = self.step / half;
            angle += peak * (1.0 - x.abs() / half);
            slope -= peak * x.signum() / half;
        }
        (sign * angle, sign * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(kink_deg: f64, step_m: f64) -> JointSpec {
        JointSpec {
            every_m: 3.0,
            kink_deg,
            step_m,
            wheel_radius_m: 0.0875,
        }
    }

    fn joints(kink_deg: f64, step_m: f64) -> Joints {
        Joints::new(&spec(kink_deg, step_m), 30.0).unwrap()
    }

    /// Height gained between two chainages by the midpoint rule.
    fn rise(j: &Joints, from: f64, to: f64) -> f64 {
        let n = 200_000;
        let h = (to - from) / n as f64;
        (0..n)
            .map(|i| j.angle(from + (i as f64 + 0.5) * h).0 * h)
            .sum()
    }

    #[test]
    fn steps_go_up_and_down_by_their_height() {
        let j = joints(0.0, 0.001);
        assert_eq!(j.chainages().count(), 9);
        assert!((rise(&j, 2.0, 4.0) - 0.001).abs() < 1e-8);
        assert!((rise(&j, 5.0, 7.0) + 0.001).abs() < 1e-8);
        assert_eq!(rise(&j, 4.0, 5.0), 0.0);
    }

    #[test]
    fn kinks_turn_by_their_angle_and_do_not_wind_up() {
        let j = joints(0.2, 0.0);
        let kink = 0.2_f64.to_radians();
        for (i, s) in j.chainages().enumerate() {
            let turn = j.angle(s + 0.5).0 - j.angle(s - 0.5).0;
            let sign = if i % 2 == 0 { -1.0 } else { 1.0 };
            assert!((turn - sign * kink).abs() < 1e-15);
        }
        assert!(
            rise(&j, 3.0, 27.0).abs() < 1e-9,
            "four pairs of pieces cancel"
        );
    }

    #[test]
    fn slope_is_the_derivative_and_borders_are_where_it_jumps() {
        let j = joints(0.3, 0.002);
        let borders: Vec<f64> = j.borders().collect();
        let h = 1e-7;
        for i in 0..30_000 {
            let s = i as f64 * 1e-3 + 0.000_31;
            if borders.iter().any(|b| (b - s).abs() < 2.0 * h) {
                continue;
            }
            let difference = (j.angle(s + h).0 - j.angle(s - h).0) / (2.0 * h);
            assert!((difference - j.angle(s).1).abs() < 1e-6, "s = {s}");
        }
    }

    #[test]
    fn a_joint_that_is_too_much_is_named() {
        let (kinked, stepped) = (spec(0.1, 0.0), spec(0.0, 0.004));
        for (key, spec) in [
            (
                "every_m",
                JointSpec {
                    every_m: 0.05,
                    ..kinked
                },
            ),
            ("kink_deg", spec(20.0, 0.0)),
            ("step_m", spec(0.0, 0.1)),
            (
                "wheel_radius_m",
                JointSpec {
                    wheel_radius_m: 0.005,
                    ..stepped
                },
            ),
        ] {
            assert_eq!(Joints::new(&spec, 30.0).unwrap_err().key, key);
        }
    }
}
