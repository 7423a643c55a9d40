//! Alignment: an angle (heading ψ or grade θ) as a function of chainage, stretch by stretch.
//!
//! Angles accumulate from element to element, so the tangent has no jump whatever the elements are. The curvature may
//! jump (an arc right beside a line), as it does on rails bent that way; clothoids, easements and transitions avoid it.

use crate::error::DataError;

/// Longest track, m; a longer track counts as a typing error.
pub(crate) const MAX_LENGTH_M: f64 = 50_000.0;
/// Shortest element, m.
const MIN_PIECE_M: f64 = 1e-3;
/// Sharpest bend, 1/m: no rail is bent to less than half a metre.
const MAX_CURVATURE_1PM: f64 = 2.0;
/// Largest number of stretches of a track.
const MAX_PIECES: usize = 1_000_000;

/// Growth of an angle with x = s − from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Law {
    /// angle = Σ cᵢ xⁱ.
    Polynomial([f64; 4]),
    /// sin(angle) = Σ cᵢ xⁱ: the grade under a height given as a cubic.
    Sine([f64; 3]),
}

impl Law {
    fn value(&self, x: f64) -> f64 {
        match self {
            Self::Polynomial(c) => c[0] + x * (c[1] + x * (c[2] + x * c[3])),
            Self::Sine(c) => libm::asin((c[0] + x * (c[1] + x * c[2])).clamp(-1.0, 1.0)),
        }
    }

    fn slope(&self, x: f64) -> f64 {
        match self {
            Self::Polynomial(c) => c[1] + x * (2.0 * c[2] + x * 3.0 * c[3]),
            Self::Sine(c) => {
                let sine = c[0] + x * (c[1] + x * c[2]);
                (c[1] + 2.0 * x * c[2]) / (1.0 - sine * sine).max(1e-6).sqrt()
            }
        }
    }
}

/// One stretch of an angle.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) law: Law,
    /// Key of the track file that sets the curvature here.
    pub(crate) bend_key: String,
    /// Key of the track file that sets the angle here.
    pub(crate) angle_key: String,
}

impl Piece {
    /// Largest |curvature| and largest |angle| on the stretch.
    pub(crate) fn extremes(&self) -> (f64, f64) {
        let length = self.to - self.from;
        let turn = match self.law {
            Law::Polynomial(c) => -c[1] / (2.0 * c[2]),
            Law::Sine(c) => -c[1] / (2.0 * c[2]),
        };
        let mut bend = 0.0_f64;
        let mut angle = 0.0_f64;
        for x in [
            0.0,
            0.25 * length,
            0.5 * length,
            0.75 * length,
            length,
            turn,
        ] {
            if (0.0..=length).contains(&x) {
                bend = bend.max(self.law.slope(x).abs());
                angle = angle.max(self.law.value(x).abs());
            }
        }
        (bend, angle)
    }
}

/// An angle along the chainage: constant before 0 and behind the last stretch.
#[derive(Clone, Debug)]
pub struct Angle {
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) pieces: Vec<Piece>,
}

impl Angle {
    /// Chainage at which the last stretch ends, m.
    pub fn length(&self) -> f64 {
        self.pieces.last().map_or(0.0, |p| p.to)
    }

    fn piece(&self, s: f64) -> Option<&Piece> {
        let i = self.pieces.partition_point(|p| p.to <= s);
        self.pieces.get(i).filter(|p| p.from <= s)
    }

    /// The angle at s, rad.
    pub fn value(&self, s: f64) -> f64 {
        match self.piece(s) {
            Some(p) => p.law.value(s - p.from),
            None if s < 0.0 => self.start,
            None => self.end,
        }
    }

    /// Returns the derivative at s, 1/m.
    pub fn slope(&self, s: f64) -> f64 {
        self.piece(s).map_or(0.0, |p| p.law.slope(s - p.from))
    }
}

/// A named stretch of the track: an element that the track file gives a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Name.
    pub name: String,
    /// Chainage of its beginning, m.
    pub from_m: f64,
    /// Chainage of its end, m.
    pub to_m: f64,
}

/// Strings stretches together.
pub(crate) struct AlignmentBuilder {
    start: f64,
    s: f64,
    pub(crate) angle: f64,
    pub(crate) curvature: f64,
    /// Named elements so far, each with its key path.
    pub(crate) places: Vec<(String, Place)>,
    pieces: Vec<Piece>,
}

impl AlignmentBuilder {
    pub(crate) fn new(start: f64) -> Self {
        Self {
            start,
            s: 0.0,
            angle: start,
            curvature: 0.0,
            places: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// Chainage so far, m.
    pub(crate) fn chainage_m(&self) -> f64 {
        self.s
    }

    /// A stretch whose curvature goes linearly from k0 to k1. Its keys: what bends it, what sets its angle.
    pub(crate) fn bend(
        &mut self,
        length: f64,
        [k0, k1]: [f64; 2],
        [bend_key, angle_key]: [&str; 2],
    ) -> Result<(), DataError> {
        if k0.abs().max(k1.abs()) > MAX_CURVATURE_1PM {
            let radius = 1.0 / k0.abs().max(k1.abs());
            return Err(DataError::new(
                bend_key,
                format!("the rail is bent to a radius of {radius:.3} m"),
                "a radius of at least 0.5 m; a longer element bends less",
            ));
        }
        if length < 1e-9 {
            return Ok(());
        }
        self.pieces.push(Piece {
            from: self.s,
            to: self.s + length,
            law: Law::Polynomial([self.angle, k0, (k1 - k0) / (2.0 * length), 0.0]),
            bend_key: bend_key.into(),
            angle_key: angle_key.into(),
        });
        self.s += length;
        self.angle += 0.5 * (k0 + k1) * length;
        self.curvature = k1;
        if self.s > MAX_LENGTH_M || self.pieces.len() > MAX_PIECES {
            return Err(DataError::new(
                bend_key,
                format!(
                    "the track is {:.0} m long by here, in {} pieces",
                    self.s,
                    self.pieces.len()
                ),
                format!("at most {MAX_LENGTH_M} m and {MAX_PIECES} pieces"),
            ));
        }
        Ok(())
    }

    /// A circular arc through `turn` rad, with curvature rising from and falling to zero over an easement at each end:
    /// curvature 1/R, length R·|turn| + easement. Exactly one of radius and length is given.
    pub(crate) fn arc(
        &mut self,
        turn: f64,
        radius: Option<f64>,
        length: Option<f64>,
        easement: f64,
        path: &str,
        angle_key: &str,
    ) -> Result<(), DataError> {
        let (key, value) = self.one_of(radius, length, path)?;
        let radius = if length.is_some() {
            (value - easement) / turn.abs()
        } else {
            value
        };
        let middle = radius * turn.abs() - easement;
        if radius <= 0.0 || middle < -1e-9 {
            return Err(DataError::new(
                format!("{path}.easement_m"),
                format!("two easements of {easement} m are longer than the whole arc"),
                format!(
                    "at most {:.3} m here",
                    if length.is_some() {
                        0.5 * value
                    } else {
                        value * turn.abs()
                    }
                ),
            ));
        }
        self.long_enough(middle + 2.0 * easement, &key)?;
        let k = turn.signum() / radius;
        let keys = [key.as_str(), angle_key];
        self.bend(easement, [0.0, k], keys)?;
        self.bend(middle.max(0.0), [k, k], keys)?;
        self.bend(easement, [k, 0.0], keys)
    }

    /// A transition through `turn` rad: the curvature rises linearly from zero to its greatest value at the middle and
    /// falls back. Length L = 2 R |turn| where R is the least radius. Exactly one of radius and length is given.
    pub(crate) fn transition(
        &mut self,
        turn: f64,
        radius: Option<f64>,
        length: Option<f64>,
        path: &str,
        angle_key: &str,
    ) -> Result<(), DataError> {
        let (key, value) = self.one_of(radius, length, path)?;
        let length = if length.is_some() {
            value
        } else {
            2.0 * value * turn.abs()
        };
        self.long_enough(length, &key)?;
        let k = 2.0 * turn / length;
        let keys = [key.as_str(), angle_key];
        self.bend(0.5 * length, [0.0, k], keys)?;
        self.bend(0.5 * length, [k, 0.0], keys)
    }

    /// Checks that an element is at least `MIN_PIECE_M` long; a shorter element counts as a typing error.
    pub(crate) fn long_enough(&self, length: f64, key: &str) -> Result<(), DataError> {
        if length < MIN_PIECE_M {
            return Err(DataError::new(
                key,
                format!("the element is {length:e} m long"),
                format!("at least {MIN_PIECE_M} m"),
            ));
        }
        Ok(())
    }

    fn one_of(
        &self,
        radius: Option<f64>,
        length: Option<f64>,
        path: &str,
    ) -> Result<(String, f64), DataError> {
        match (radius, length) {
            (Some(r), None) => Ok((format!("{path}.radius_m"), r)),
            (None, Some(l)) => Ok((format!("{path}.length_m"), l)),
            _ => Err(DataError::new(
                path,
                "needs either radius_m or length_m",
                "give one of them; the other follows from the angle",
            )),
        }
    }

    pub(crate) fn finish(self) -> Angle {
        Angle {
            start: self.start,
            end: self.angle,
            pieces: self.pieces,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built(f: impl FnOnce(&mut AlignmentBuilder) -> Result<(), DataError>) -> Angle {
        let mut b = AlignmentBuilder::new(0.2);
        f(&mut b).unwrap();
        b.finish()
    }

    /// Every law: the slope is the derivative of the value, and neither the angle nor, between eased elements, the
    /// curvature jumps.
    #[test]
    fn slope_is_the_derivative_and_eased_elements_join_smoothly() {
        let a = built(|b| {
            b.bend(5.0, [0.0, 0.0], ["", ""])?;
            b.arc(0.7, Some(4.0), None, 1.0, "", "")?;
            b.transition(-1.1, None, Some(9.0), "", "")?;
            b.arc(0.5, None, Some(6.0), 3.0, "", "")
        });
        assert!((a.end - (0.2 + 0.7 - 1.1 + 0.5)).abs() < 1e-14);
        assert!((a.length() - (5.0 + 4.0 * 0.7 + 1.0 + 9.0 + 6.0)).abs() < 1e-12);
        let h = 1e-5;
        let mut s = -1.0;
        while s < a.length() + 1.0 {
            let difference = (a.value(s + h) - a.value(s - h)) / (2.0 * h);
            assert!((difference - a.slope(s)).abs() < 1e-5, "s = {s}");
            assert!(
                (a.slope(s + h) - a.slope(s - h)).abs() < 2e-5,
                "curvature jumps at {s}"
            );
            s += 0.0137;
        }
    }

    #[test]
    fn the_sine_law_is_the_grade_under_a_cubic_height() {
        let c = [0.1, 0.02, -0.01];
        let law = Law::Sine(c);
        for x in [0.0, 0.7, 2.0] {
            let h = 1e-6;
            assert!((libm::sin(law.value(x)) - (c[0] + c[1] * x + c[2] * x * x)).abs() < 1e-15);
            let difference = (law.value(x + h) - law.value(x - h)) / (2.0 * h);
            assert!((difference - law.slope(x)).abs() < 1e-9);
        }
    }

    #[test]
    fn an_easement_longer_than_the_arc_is_named() {
        let mut b = AlignmentBuilder::new(0.0);
        let e = b
            .arc(0.5, Some(4.0), None, 2.5, "vertical[3]", "")
            .unwrap_err()
            .to_string();
        assert!(
            e.contains("vertical[3].easement_m") && e.contains("at most 2.000"),
            "{e}"
        );
    }
}
