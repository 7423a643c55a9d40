//! Checks that a train can run on a rail: radii, grades, length. The track's element that is wrong is named.

use super::Rail;
use super::alignment::{Angle, Piece};
use crate::error::DataError;
use crate::train::Limits;

/// Tolerance for radii and angles at a limit, for rounding.
const ROUNDING: f64 = 1.0 + 1e-9;

impl Rail {
    /// Checks radii, grades and length against the limits of a train; keys in errors are keys of the track file. Kinks
    /// and steps of rail joints are not counted.
    pub(crate) fn check(&self, limits: &Limits) -> Result<(), DataError> {
        self.radii(
            &self.horizontal,
            limits.min_radius_horizontal_m,
            "horizontal",
        )?;
        self.radii(&self.vertical, limits.min_radius_vertical_m, "vertical")?;
        let most = limits.max_grade_rad;
        for p in &self.vertical.pieces {
            let (_, grade) = p.extremes();
            if grade > most * ROUNDING {
                return Err(self.wrong_at(
                    &p.angle_key,
                    p,
                    format!("the grade reaches {:.3}°", grade.to_degrees()),
                    format!("the train climbs at most {:.3}°", most.to_degrees()),
                ));
            }
        }
        if self.length < limits.length_m {
            return Err(DataError::new(
                "",
                format!("the track is {:.3} m long", self.length),
                format!(
                    "the train alone is {:.3} m long; lengthen the last element",
                    limits.length_m
                ),
            ));
        }
        Ok(())
    }

    fn radii(&self, angle: &Angle, least: f64, which: &str) -> Result<(), DataError> {
        for p in &angle.pieces {
            let (bend, _) = p.extremes();
            if bend * least > ROUNDING {
                return Err(self.wrong_at(
                    &p.bend_key,
                    p,
                    format!("the {which} radius comes down to {:.3} m", 1.0 / bend),
                    format!("the train needs at least {least:.3} m"),
                ));
            }
        }
        Ok(())
    }

    fn wrong_at(&self, key: &str, p: &Piece, message: String, help: String) -> DataError {
        let message = format!("{message} between chainage {:.3} and {:.3} m", p.from, p.to);
        DataError::new(key, message, help)
    }
}
