//! Mass of `imm_stf_printed`: Guo, Wang, Zhao & Dai 2024, eq. 2–7, as printed.
//!
//! - `eq3`: the rotating masses are left in: what is found is M + J
//! - `eq4`: differences of one sample of the raw signals; corrected: of a quarter of a second, low-passed, while the
//!   slope stays

use crate::Real;
use crate::api::params::params;
use crate::api::signals::Vehicle;
use crate::filters::low_pass::MatchedFilter;
use crate::printed::Erratum;

params! {
    /// Switches and constants of the mass of `imm_stf_printed`.
    DifferencesPrinted {
        eq3 [choice Erratum] = Erratum::Printed, "Printed: rotating masses left in the mass.";
        eq4 [choice Erratum] = Erratum::Printed, "Printed: differences of one raw sample.";
        omega ["-"] = 0.999, 0.5 => 1.0, "Forgetting factor ω.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        p0 ["kg²s⁴/m²"] = 1e9, 1.0 => 1e15, "P₀ of the mass, in units of the residual.";
        force_gate_n ["N"] = 100.0, 0.0 => 1e6, "Smallest change of force that counts as considerable.";
    }
}

/// Right differences: low-pass, number of samples, largest change of f − v̇ (m/s²).
const RIGHT_CUTOFF_HZ: Real = 2.0;
const RIGHT_SAMPLES: u32 = 25;
const RIGHT_SLOPE_GATE: Real = 0.05;
/// Largest value that counts as a mass, kg.
const MAX_KG: Real = 1e9;

/// Force, acceleration of the wheels, specific force.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ForceSample {
    force: Real,
    rate: Real,
    felt: Real,
}

/// The regression on differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassFromDifferences {
    own: DifferencesPrinted,
    rotating_mass_kg: Real,
    first_kg: Real,
    m: Real,
    P: Real,
    filters: [MatchedFilter; 3],
    last: Option<ForceSample>,
    last_speed: Option<Real>,
    countdown: u32,
    breakdowns: Real,
}

impl MassFromDifferences {
    /// Builds the mass filter from the vehicle's nominal values and the parameters.
    pub fn new(vehicle: &Vehicle, own: DifferencesPrinted) -> Self {
        let first_kg = vehicle.first_mass_kg(own.mass0_kg);
        Self {
            own,
            rotating_mass_kg: if own.eq3.is_printed() {
                0.0
            } else {
                vehicle.rotating_mass_kg
            },
            first_kg,
            m: first_kg,
            P: own.p0,
            filters: [MatchedFilter::new(RIGHT_CUTOFF_HZ); 3],
            last: None,
            last_speed: None,
            countdown: 0,
            breakdowns: 0.0,
        }
    }

    /// Traction, N, wheel speed, m/s, and specific force, m/s², `dt` seconds after those before.
    pub fn step(&mut self, force: Real, speed: Real, felt: Real, dt: Real) {
        let Some(now) = self.sample(force, speed, felt, dt) else {
            return;
        };
        let Some(before) = self.last.replace(now) else {
            return;
        };
        let phi = now.rate - before.rate;
        let change = now.force - before.force;
        let steady =
            self.own.eq4.is_printed() || (now.felt - before.felt - phi).abs() < RIGHT_SLOPE_GATE;
        if change.abs() < self.own.force_gate_n || !steady {
            return;
        }
        let y = change - self.rotating_mass_kg * phi;
        let L = self.P * phi / (phi * self.P * phi + self.own.omega);
        let m = self.m + L * (y - phi * self.m);
        let P = (1.0 - L * phi) * self.P / self.own.omega;
        if m.abs() < MAX_KG && P.is_finite() {
            (self.m, self.P) = (m, P);
        } else {
            (self.m, self.P) = (self.first_kg, self.own.p0);
            self.breakdowns += 1.0;
        }
    }

    fn sample(&mut self, force: Real, speed: Real, felt: Real, dt: Real) -> Option<ForceSample> {
        let last_speed = self.last_speed.replace(speed);
        if self.own.eq4.is_printed() {
            let rate = (speed - last_speed?) / dt;
            return Some(ForceSample { force, rate, felt });
        }
        let [forces, speeds, felts] = &mut self.filters;
        forces.step(force, dt);
        speeds.step(speed, dt);
        felts.step(felt, dt);
        if self.countdown > 0 {
            self.countdown -= 1;
            return None;
        }
        self.countdown = RIGHT_SAMPLES - 1;
        Some(ForceSample {
            force: forces.value()?,
            rate: speeds.rate(),
            felt: felts.value()?,
        })
    }

    /// Standing, braking or blind: the next difference starts anew.
    pub fn pause(&mut self) {
        (self.last, self.last_speed) = (None, None);
    }

    /// Mass, kg, and its variance, kg².
    pub fn kg(&self) -> (Real, Real) {
        (self.m, self.P)
    }

    /// Number of restarts.
    pub fn breakdowns(&self) -> Real {
        self.breakdowns
    }
}
