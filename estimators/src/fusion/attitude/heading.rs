//! Heading of the unit since the start with its standard deviation: the integral of the yaw rate. Nothing measures the
//! heading itself, so it drifts; maps of the rail take their bends from it.

use crate::Real;
use crate::api::real::{PI, sqrt};
use crate::api::snapshot::state;
use crate::tuning::{HEADING, RAIL};

/// Heading since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heading {
    angle_rad: Real,
    sd_rad: Real,
}

/// Input of a step of the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingInput {
    /// Rate of the heading, rad/s; `None` while there is no gyro.
    pub rate_radps: Option<Real>,
    /// Standard deviation of its bias, rad/s.
    pub bias_sd_radps: Real,
    /// Random walk of its integral, rad/√s.
    pub walk: Real,
    /// Speed, m/s.
    pub speed_mps: Real,
}

impl Heading {
    /// Integrates the heading over `dt` seconds. Errors of bias and scale add up as if they always had one sign:
    /// cautious where bends to the left and to the right follow each other. The random walk adds by squares to what
    /// there is.
    pub fn step(&mut self, turn: &HeadingInput, dt: Real) {
        match turn.rate_radps {
            Some(rate) => {
                let angle = self.angle_rad + rate * dt;
                // one turn at most in a step
                self.angle_rad = match angle {
                    angle if angle > PI => angle - 2.0 * PI,
                    angle if angle < -PI => angle + 2.0 * PI,
                    angle => angle,
                }
                .clamp(-PI, PI);
                let walked = sqrt(self.sd_rad * self.sd_rad + turn.walk * turn.walk * dt);
                self.sd_rad = walked + (turn.bias_sd_radps + HEADING.scale * rate.abs()) * dt;
            }
            None => self.sd_rad += RAIL.max_track_per_m * turn.speed_mps.abs() * dt,
        }
        // Beyond half a turn nothing is known.
        self.sd_rad = self.sd_rad.min(PI);
    }

    /// Heading relative to the start, + left, within ±π, rad.
    pub fn angle_rad(&self) -> Real {
        self.angle_rad
    }

    /// Its standard deviation, rad, at most π.
    pub fn sd_rad(&self) -> Real {
        self.sd_rad
    }
}

state!(Heading { angle_rad, sd_rad; });

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: HeadingInput = HeadingInput {
        rate_radps: Some(0.5),
        bias_sd_radps: 1e-4,
        walk: 1e-3,
        speed_mps: 1.0,
    };

    /// 10 s at 0.5 rad/s are 5 rad, which is 5 − 2π, to the right as to the left; bias 1e-3 and scale 5e-3 rad add up,
    /// the walk is 1e-3 √10: the standard deviation is between the root of their squares and their sum.
    #[test]
    fn it_is_the_integral_of_the_rate_and_wraps() {
        for sign in [1.0, -1.0] {
            let mut heading = Heading::default();
            let turn = HeadingInput {
                rate_radps: Some(sign * 0.5),
                ..LEFT
            };
            (0..1000).for_each(|_| heading.step(&turn, 0.01));
            assert!((heading.angle_rad() - sign * (5.0 - 2.0 * PI)).abs() < 1e-9);
            let (drift, walk): (Real, Real) = (6e-3, sqrt(1e-5));
            let sd = heading.sd_rad();
            assert!(
                sd >= sqrt(drift * drift + walk * walk) && sd <= drift + walk,
                "{sd}"
            );
        }
    }

    /// Without a gyro for 4 m a bend of 2 m radius may have been gone round: 2 rad.
    #[test]
    fn without_a_gyro_it_may_have_gone_round_a_bend() {
        let mut heading = Heading::default();
        let without = HeadingInput {
            rate_radps: None,
            ..LEFT
        };
        (0..400).for_each(|_| heading.step(&without, 0.01));
        assert_eq!(heading.angle_rad(), 0.0);
        assert!((heading.sd_rad() - 2.0).abs() < 1e-9);
        (0..4000).for_each(|_| heading.step(&without, 0.01));
        assert_eq!(heading.sd_rad(), PI);
    }

    /// The walk alone is known to w √t, bias and scale to (b + 0.001 |r|) t; all is at most half a turn.
    #[test]
    fn the_walk_grows_by_squares_and_errors_of_one_sign_by_time() {
        for (rate, bias, walk) in [
            (0.0, 0.0, 1e-3),
            (0.0, 2e-3, 0.0),
            (0.4, 0.0, 0.0),
            (-0.4, 2e-3, 0.0),
            (0.4, 0.0, 10.0),
        ] {
            let mut heading = Heading::default();
            let turn = HeadingInput {
                rate_radps: Some(rate),
                bias_sd_radps: bias,
                walk,
                speed_mps: 1.0,
            };
            for k in 1..=300 {
                heading.step(&turn, 0.01);
                let t = 0.01 * Real::from(k);
                let expected = walk * t.sqrt() + (bias + 0.001 * rate.abs()) * t;
                let expected = expected.min(PI);
                assert!((heading.sd_rad() - expected).abs() < 1e-9 + 1e-3 * expected * rate.abs());
                assert!((heading.angle_rad() - rate * t).abs() < 1e-12);
            }
        }
    }
}
