//! The eight regressions on a crane's signals that the literature has: y = hᵀ χ, one row for each sample.
//!
//! | id | y | h | χ | source |
//! |---|---|---|---|---|
//! | R-A | a | [F − J v̇, −g √(1 + μ²)] | [1/M, sin(θ + s θ_μ)], θ_μ = atan μ | Liu et al. 2023, eq. 16–18 |
//! | R-B | (F − J v̇)/M − a | s g c | μ | Liu et al. 2023, eq. 8–10 |
//! | R-C | Δ(F − J v̇) | Δa | M | Guo et al. 2024, eq. 2–4 |
//! | R-D | F | a + s μ g c + (J/M₀) v̇ | M | patent CN 111507019 B, eq. 20 |
//! | R-E | F cos δ − J v̇ | a + s μ g c + ½ a_y sin δ | M | the same, eq. 22 |
//! | R-F | d(f − v̇)/dt | g v c | ρ = dθ/ds | DFFRLS-AUKF paper, eq. 6 and 11 |
//! | R-G | F − J v̇ | a + s μ g c | M | from the force balance, μ known |
//! | R-H | F − J v̇ | [a, 1] | [M, M (s μ g − b)] | from the force balance, μ free |
//!
//! F traction at the rims, N; J rotating masses reflected to the rim, kg (no g in them); s sign of the speed; c = cos θ; δ steering angle;
//! a_y lateral acceleration. Which acceleration a is, is a choice ([`AccelSource`]):
//!
//! - *specific force*: what the accelerometer reads, f = v̇ + g sin θ + b. Then (F − J v̇) = M (f + s μ g c) holds on any slope.
//! - *kinematic*: v̇ from the wheels. R-A, R-C and R-H then have the slope in their free term, or differenced away: it must not change.
//!   R-B, R-D, R-E and R-G need it; a = v̇ + g sin θ is put together with the θ of the slope filter that is given this very mass, and mass and
//!   slope chase each other.
//!
//! Rows are divided by the first mass M₀ where that makes y an acceleration, so that one noise (m/s²) fits all but R-F.

use nalgebra::{Vector2, vector};

use crate::Real;
use crate::api::params::choices;
use crate::api::real::{GRAVITY, cos, sin, sqrt};
use crate::models::force_balance::ForceBalance;
use crate::preprocess::resampler::ResampledSample;
use crate::supervised::force_balance_rls::AccelSource;

choices! {
    /// Which regression.
    Regressor {
        /// R-A: inverse mass and slope from the acceleration.
        Coupled = "coupled",
        /// R-B: running resistance of a known mass.
        Resistance = "resistance",
        /// R-C: mass from changes.
        Differenced = "differenced",
        /// R-D: mass driving straight.
        Straight = "straight",
        /// R-E: mass in a bend.
        Turning = "turning",
        /// R-F: vertical curvature of the rail.
        Curvature = "curvature",
        /// R-G: mass from the specific force, running resistance known.
        KnownResistance = "known_resistance",
        /// R-H: mass from the specific force, running resistance free.
        FreeResistance = "free_resistance",
    }
}

/// What χ₁ of a regression is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finds {
    /// M/M₀.
    Mass,
    /// M₀/M.
    InverseMass,
    /// Running-resistance coefficient μ.
    Resistance,
    /// Vertical curvature ρ, 1/m.
    Curvature,
}

/// What a regression takes as known beside the signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The mass rows are divided by; for R-B the mass itself, kg.
    pub mass0_kg: Real,
    /// Running-resistance coefficient.
    pub mu: Real,
    /// Rotating masses reflected to the rim, kg.
    pub rotating_mass_kg: Real,
    /// What stands for the acceleration.
    pub source: AccelSource,
}

/// The filtered signals at one instant, all delayed alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Now.
    pub now: ResampledSample,
    /// The sample before it.
    pub before: Option<ResampledSample>,
    /// Grade angle of the slope filter, rad.
    pub theta: Real,
    /// Steering angle, rad, and lateral acceleration, m/s².
    pub turning: (Real, Real),
    /// d(f − v̇)/dt, m/s³, and the speed behind the same filters, m/s.
    pub jerk: Option<(Real, Real)>,
}

/// One row y = hᵀ χ. A regression with one parameter has h₂ = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Left side, m/s² (R-F: m/s³).
    pub y: Real,
    /// Right side.
    pub h: Vector2<Real>,
}

impl Regressor {
    /// What χ₁ is.
    pub fn finds(self) -> Finds {
        match self {
            Regressor::Coupled => Finds::InverseMass,
            Regressor::Resistance => Finds::Resistance,
            Regressor::Curvature => Finds::Curvature,
            _ => Finds::Mass,
        }
    }

    /// Whether χ₂ is there; it belongs to one direction of travel, but for R-A on the specific force.
    pub fn has_free_term(self) -> bool {
        matches!(self, Regressor::Coupled | Regressor::FreeResistance)
    }

    /// The row of this instant; `None` if a signal is missing.
    pub fn row(self, signals: &Signals, known: &Known) -> Option<Row> {
        let now = signals.now;
        let direction = if now.speed_mps < 0.0 { -1.0 } else { 1.0 };
        let felt = felt(&now, known.source, signals.theta)?;
        let cosine = ForceBalance::cosine(felt, now.acceleration_mps2);
        let resisted = felt + direction * known.mu * GRAVITY * cosine;
        let force = net_force(&now, known) / known.mass0_kg;
        let one = |y, h| {
            Some(Row {
                y,
                h: vector![h, 0.0],
            })
        };
        match self {
            Regressor::Coupled => {
                let resultant = GRAVITY * sqrt(1.0 + known.mu * known.mu);
                let (y, against) = match known.source {
                    // Resistance alone is left in the free term, and turns with the speed.
                    AccelSource::SpecificForce => (felt, direction * resultant),
                    AccelSource::Kinematic => (now.acceleration_mps2, resultant),
                };
                Some(Row {
                    y,
                    h: vector![force, -against],
                })
            }
            Regressor::Resistance => one(force - felt, direction * GRAVITY * cosine),
            Regressor::Differenced => {
                let before = signals.before?;
                let change = match known.source {
                    AccelSource::SpecificForce => {
                        now.specific_force_mps2? - before.specific_force_mps2?
                    }
                    AccelSource::Kinematic => now.acceleration_mps2 - before.acceleration_mps2,
                };
                one(force - net_force(&before, known) / known.mass0_kg, change)
            }
            Regressor::Straight => {
                let rotating = known.rotating_mass_kg / known.mass0_kg * now.acceleration_mps2;
                one(now.force_n / known.mass0_kg, resisted + rotating)
            }
            Regressor::Turning => {
                let (steer, across) = signals.turning;
                let lost = now.force_n * (1.0 - cos(steer)) / known.mass0_kg;
                one(force - lost, resisted + 0.5 * across * sin(steer))
            }
            Regressor::Curvature => {
                let (jerk, speed) = signals.jerk?;
                one(jerk, GRAVITY * speed * cosine)
            }
            Regressor::KnownResistance => one(force, resisted),
            Regressor::FreeResistance => {
                let a = match known.source {
                    AccelSource::SpecificForce => felt,
                    AccelSource::Kinematic => now.acceleration_mps2,
                };
                Some(Row {
                    y: force,
                    h: vector![a, 1.0],
                })
            }
        }
    }
}

/// F − J v̇, N.
fn net_force(sample: &ResampledSample, known: &Known) -> Real {
    sample.force_n - known.rotating_mass_kg * sample.acceleration_mps2
}

/// v̇ + g sin θ, from the accelerometer or from the wheels and a slope.
fn felt(now: &ResampledSample, source: AccelSource, theta: Real) -> Option<Real> {
    match source {
        AccelSource::SpecificForce => now.specific_force_mps2,
        AccelSource::Kinematic => Some(now.acceleration_mps2 + GRAVITY * sin(theta)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signals of a force balance that holds exactly.
    fn exact(known: &Known, mass: Real, v: Real, a: Real, theta: Real) -> ResampledSample {
        let direction = v.signum();
        let force = (mass + known.rotating_mass_kg) * a
            + mass * GRAVITY * (theta.sin() + direction * known.mu * theta.cos());
        ResampledSample {
            force_n: force,
            speed_mps: v,
            acceleration_mps2: a,
            specific_force_mps2: Some(a + GRAVITY * theta.sin()),
            curvature_per_m: 0.0,
            period_s: 0.1,
        }
    }

    #[test]
    fn every_row_holds_exactly_for_the_truth_in_both_directions_and_on_any_slope() {
        let (mass, mu): (Real, Real) = (17_000.0, 0.02);
        for source in [AccelSource::SpecificForce, AccelSource::Kinematic] {
            for v in [1.2, -0.7 as Real] {
                for (a, theta) in [(0.3, 0.0 as Real), (-0.2, 0.25), (0.1, -0.4)] {
                    for &regressor in Regressor::ALL {
                        let direction = v.signum();
                        // R-D has a constant for 1 + J/M: right only at the mass it is for.
                        let mass0_kg = match regressor {
                            Regressor::Straight | Regressor::Resistance => mass,
                            _ => 12_000.0,
                        };
                        let known = Known {
                            mass0_kg,
                            mu,
                            rotating_mass_kg: 1_045.0,
                            source,
                        };
                        let (steer, across): (Real, Real) = (0.2, 0.8);
                        let mut now = exact(&known, mass, v, a, theta);
                        if regressor == Regressor::Turning {
                            // Part of the driven axle's force turns the vehicle.
                            now.force_n =
                                (now.force_n + 0.5 * mass * across * steer.sin()) / steer.cos();
                        }
                        let signals = Signals {
                            now,
                            before: Some(exact(&known, mass, v, a - 0.15, theta)),
                            theta,
                            turning: (steer, across),
                            jerk: Some((GRAVITY * v * theta.cos() * 0.04, v)),
                        };
                        let row = regressor.row(&signals, &known).unwrap();
                        let resistance = mass / mass0_kg * mu * GRAVITY * direction;
                        let theta_mu = mu.atan();
                        let chi = match (regressor, source) {
                            (Regressor::Coupled, AccelSource::SpecificForce) => {
                                vector![mass0_kg / mass, theta_mu.sin() * theta.cos()]
                            }
                            (Regressor::Coupled, AccelSource::Kinematic) => {
                                vector![mass0_kg / mass, (theta + direction * theta_mu).sin()]
                            }
                            (Regressor::Resistance, _) => vector![mu, 0.0],
                            (Regressor::Curvature, _) => vector![0.04, 0.0],
                            (Regressor::FreeResistance, AccelSource::SpecificForce) => {
                                vector![mass / mass0_kg, resistance * theta.cos()]
                            }
                            (Regressor::FreeResistance, AccelSource::Kinematic) => {
                                let weight = mass / mass0_kg * GRAVITY * theta.sin();
                                vector![mass / mass0_kg, resistance * theta.cos() + weight]
                            }
                            _ => vector![mass / mass0_kg, 0.0],
                        };
                        let off = row.y - row.h.dot(&chi);
                        assert!(
                            off.abs() < 1e-9,
                            "{regressor:?} {source:?} {v} {a} {theta}: {off}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn without_an_accelerometer_the_rows_that_need_it_stop() {
        let known = Known {
            mass0_kg: 1e4,
            mu: 0.02,
            rotating_mass_kg: 0.0,
            source: AccelSource::SpecificForce,
        };
        let mut now = exact(&known, 1e4, 1.0, 0.1, 0.0);
        now.specific_force_mps2 = None;
        let signals = Signals {
            now,
            before: None,
            theta: 0.0,
            turning: (0.0, 0.0),
            jerk: None,
        };
        assert!(
            Regressor::ALL
                .iter()
                .all(|r| r.row(&signals, &known).is_none())
        );
        let wheels = Known {
            source: AccelSource::Kinematic,
            ..known
        };
        let count = Regressor::ALL
            .iter()
            .filter(|r| r.row(&signals, &wheels).is_some());
        assert_eq!(count.count(), 6); // all but the differences and the curvature
    }

    /// The column χ of the table.
    #[test]
    fn what_each_regression_finds_is_that_of_the_table() {
        let column: std::vec::Vec<(Finds, bool)> = Regressor::ALL
            .iter()
            .map(|regressor| (regressor.finds(), regressor.has_free_term()))
            .collect();
        let expected = [
            (Finds::InverseMass, true),
            (Finds::Resistance, false),
            (Finds::Mass, false),
            (Finds::Mass, false),
            (Finds::Mass, false),
            (Finds::Curvature, false),
            (Finds::Mass, false),
            (Finds::Mass, true),
        ];
        assert_eq!(column, expected);
    }
}
