//! The published methods as printed, including their errors, so that each error can be run and seen to fail.
//!
//! One file for each document, [`slope_ekf`] for the filter that two of them print alike, [`curvature_rls`] for the
//! curvature of the DFFRLS-AUKF paper; nothing outside this folder uses it but the registry. Behind the cargo feature
//! `printed`.
//!
//! Every erratum that can be executed is a parameter named after its equation: `printed`, or `corrected`; where the
//! print can be read in two ways, `other` is the other reading. All default to `printed`. With all `corrected` but one,
//! that one stands alone. Slips of notation, and what cannot be executed, have no switch; the book lists them.
//!
//! | name | document |
//! |---|---|
//! | `dffrls_aekf_printed` | Liu et al. 2023, eq. 6–30: [`liu_2023`] |
//! | `resistance_dffrls_printed` | Liu et al. 2023, eq. 8–15: [`liu_2023_resistance`] |
//! | `dffrls_aukf_printed` | the DFFRLS-AUKF paper: [`huainan`] |
//! | `imm_stf_printed` | Guo et al. 2024: [`guo_2024`] |
//! | `mmrls_sh_stf_printed` | patent CN 111507019 B: [`patent`] |
//!
//! Nothing here limits an estimate to what a crane can be: a mass may come out negative. Only numbers that are no
//! longer finite, or beyond a million, or a covariance without a root where the print takes one, end a run: the filter
//! then *breaks down*, starts again from where it was built, and counts it (internal `breakdowns`). So nothing leaves
//! an estimator that is not finite.

pub(crate) mod curvature_rls;
pub mod guo_2024;
pub(crate) mod guo_2024_mass;
pub mod huainan;
pub mod liu_2023;
pub mod liu_2023_resistance;
pub mod patent;
pub(crate) mod slope_ekf;

use crate::api::params::choices;
use crate::api::real::sqrt;
use crate::api::signals::{Estimate, Flags, Value};
use crate::{Real, Time};

/// Largest size of a number that can be an estimate.
const USABLE: Real = 1e6;

choices! {
    /// The reading of an equation with an erratum.
    Erratum {
        /// Letter by letter.
        Printed = "printed",
        /// In the corrected form.
        Corrected = "corrected",
    }
}

choices! {
    /// The reading of an equation with two possible readings, neither of which is right.
    PrintReading {
        /// Letter by letter.
        Printed = "printed",
        /// The other reading of the print.
        Other = "other",
        /// In the corrected form.
        Corrected = "corrected",
    }
}

impl Erratum {
    fn is_printed(self) -> bool {
        self == Self::Printed
    }
}

impl PrintReading {
    fn is_printed(self) -> bool {
        self != Self::Corrected
    }
}

/// Returns true if all numbers can still be used.
fn usable<'a>(numbers: impl IntoIterator<Item = &'a Real>) -> bool {
    numbers.into_iter().all(|x| x.abs() <= USABLE)
}

/// A mass from M/M₀ or M₀/M, which may have any finite value.
fn mass_from_inverse(mass0_kg: Real, inverse: Real) -> Real {
    let least = if inverse < 0.0 { -1e-6 } else { 1e-6 };
    mass0_kg / if inverse.abs() < 1e-6 { least } else { inverse }
}

/// Answer of a printed method: value and variance of each quantity, valid while the train runs.
struct PrintedAnswer {
    mass: (Real, Real),
    grade: (Real, Real),
    speed_mps: Real,
    innovation: Real,
    nis: Real,
}

impl PrintedAnswer {
    fn estimate(&self, t: Time, moving: bool, running: bool) -> Estimate {
        let value = |(value, variance): (Real, Real)| Value::new(value, sqrt(variance), running);
        let grade_rad = value(self.grade);
        Estimate {
            t,
            total_mass_kg: value(self.mass),
            grade_rad,
            effective_grade_rad: grade_rad,
            speed_mps: value((self.speed_mps, 1e-4)),
            innovation: self.innovation,
            nis: self.nis.max(0.0),
            flags: Flags {
                moving,
                excited: running,
                saturated: false,
            },
            ..Estimate::default()
        }
    }
}
