//! Checks that a physics step is short enough for the train's springs.
//!
//! Dampers are implicit (`plant/train/implicit.rs`), so springs alone limit a step of dt: modes stay bounded while dt²
//! λ < 1 for λ, the largest eigenvalue of M⁻¹ Σ (1/4 − β) K with every contact held, found here by power iteration.

use super::springs::{BRISTLE_SHARE, Spring};
use super::{SHOE_SIGMA1, Train};
use crate::error::DataError;
use nalgebra::{Matrix6, Vector3, Vector6};

/// Share of the longest stable step that is used: the rest is kept back for curves, hold-down contacts and the clamp's
/// roll stiffness.
const USED_SHARE: f64 = 0.9;
const ITERATIONS: usize = 300;

impl Train {
    /// Refuse a physics step, s, that is too long for this train's stiffnesses and masses.
    pub(crate) fn check_step(&self, dt_s: f64) -> Result<(), DataError> {
        let (most, body) = self.longest_step();
        if dt_s <= most {
            return Ok(());
        }
        let name = self.bodies.get(body).map_or("a wheel", |b| b.name.as_str());
        Err(DataError::new(
            "",
            format!(
                "springs on `{name}` are too stiff for its mass at a step of {} ms",
                libm::round(1e6 * dt_s) / 1e3
            ),
            format!(
                "a step of at most {:.2} ms, softer springs, or more mass",
                1e3 * most
            ),
        ))
    }

    /// Longest step that [`Train::check_step`] accepts, s, and the body that moves most in the mode that limits it.
    pub(crate) fn longest_step(&self) -> (f64, usize) {
        let (lambda, body) = self.stiffest_mode();
        (USED_SHARE / lambda.sqrt(), body)
    }

    /// λ (see the top of this file), 1/s², and the body that moves most in its mode.
    fn stiffest_mode(&self) -> (f64, usize) {
        let mut springs = self.springs();
        springs.extend(self.drives.iter().map(|d| Spring {
            k: d.sigma0,
            c: SHOE_SIGMA1,
            share: BRISTLE_SHARE,
            ends: [self.end(d.body, d.contact, Vector3::x()), None],
        }));
        let masses = self.masses();
        let inverse: Vec<Matrix6<f64>> = masses
            .iter()
            .map(|m| m.try_inverse().unwrap_or_default())
            .collect();
        // A start that no mode is blind to: different numbers for every coordinate, the same on every machine.
        let mut x: Vec<Vector6<f64>> = (0..masses.len())
            .map(|i| Vector6::from_fn(|j, _| 1.0 + libm::sin((7 * i + 3 * j + 1) as f64)))
            .collect();
        let mut lambda = 0.0;
        for _ in 0..ITERATIONS {
            let mut y = vec![Vector6::zeros(); x.len()];
            for s in &springs {
                let ends = s.ends.iter().flatten();
                let rate: f64 = ends.clone().map(|(i, rate)| rate.dot(&x[*i])).sum();
                for (i, along) in ends {
                    y[*i] += along * ((0.25 - s.share) * s.k * rate);
                }
            }
            // Rayleigh quotient in the norm of the masses, in which the matrix is symmetric: it grows towards λ from
            // below.
            let mut products = [0.0; 3];
            for (i, (x, y)) in x.iter().zip(&mut y).enumerate() {
                let force = *y;
                *y = inverse[i] * force;
                let each = [x.dot(&(masses[i] * x)), x.dot(&force), y.dot(&force)];
                products = [0, 1, 2].map(|k| products[k] + each[k]);
            }
            let [xx, xy, yy] = products;
            if xx <= 0.0 || yy <= 0.0 {
                return (lambda, 0);
            }
            lambda = xy / xx;
            x = y.iter().map(|y| y / yy.sqrt()).collect();
        }
        let motion = |i: &usize| x[*i].dot(&(masses[*i] * x[*i]));
        let most = (0..self.bodies.len()).max_by(|a, b| motion(a).total_cmp(&motion(b)));
        (lambda, most.unwrap_or(0))
    }
}

#[allow(clippy::unwrap_used)]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::{Body, Connection, ConnectionKind, Station};
    use nalgebra::{Isometry3, Matrix3};

    fn body(mass_kg: f64, stations: Vec<Station>) -> Body {
        Body {
            name: "b".into(),
            mass_kg,
            com: Vector3::zeros(),
            inertia: Matrix3::identity() * 1e9,
            start_s: 0.0,
            start_pose: Isometry3::identity(),
            stations,
            shapes: Vec::new(),
        }
    }

    fn bar(a: usize, b: usize, k: f64, c: f64) -> Connection {
        let (anchor_a, anchor_b) = (Vector3::zeros(), Vector3::x());
        Connection {
            kind: ConnectionKind::Drawbar,
            a,
            b,
            anchor_a,
            anchor_b,
            k,
            c,
            length_m: 1.0,
        }
    }

    #[test]
    fn two_masses_on_a_spring_have_the_textbook_frequency() {
        // ω² = k (1/m₁ + 1/m₂)
        let train = Train {
            bodies: vec![body(2.0, vec![]), body(3.0, vec![])],
            connections: vec![bar(0, 1, 600.0, 0.0)],
            ..Train::default()
        };
        let omega2: f64 = 600.0 * (1.0 / 2.0 + 1.0 / 3.0);
        // (1/4 − 1/12) dt² ω² = 1 is the limit.
        let limit = USED_SHARE * (6.0 / omega2).sqrt();
        assert!((train.longest_step().0 - limit).abs() < 1e-9);
    }

    /// Largest excursion of a damped oscillator stepped as the world steps it.
    fn excursion(k: f64, c: f64, m: f64, dt: f64) -> f64 {
        let (mut x, mut v, mut most) = (1e-3, 0.0, 0.0_f64);
        let mass = m + 0.5 * dt * c + dt * dt * k / 12.0;
        for _ in 0..20_000 {
            x += 0.5 * dt * v;
            v -= dt * (k * x + c * v) / mass;
            x += 0.5 * dt * v;
            most = most.max(f64::abs(x));
        }
        most
    }

    #[test]
    fn springs_alone_limit_the_step() {
        for (k, c) in [(1e4, 0.0), (1e4, 50.0), (1e3, 200.0)] {
            let train = Train {
                bodies: vec![body(1.0, vec![]), body(1e12, vec![])],
                connections: vec![bar(0, 1, k, c)],
                ..Train::default()
            };
            let limit = train.longest_step().0 / USED_SHARE;
            assert!(excursion(k, c, 1.0, 0.99 * limit) < 1.0);
            assert!(excursion(k, c, 1.0, 1.01 * limit) > 1e3);
        }
    }

    #[test]
    fn too_long_a_step_names_the_body_and_the_longest_step() {
        let mut heavy = body(1e6, vec![]);
        heavy.name = "heavy".into();
        let mut light = body(1.0, vec![]);
        light.name = "light".into();
        let train = Train {
            bodies: vec![heavy, light],
            connections: vec![bar(0, 1, 1e6, 0.0)],
            ..Train::default()
        };
        assert!(train.check_step(2e-3).is_ok());
        let error = train.check_step(3e-3).unwrap_err().to_string();
        assert!(
            error.contains("`light`") && error.contains("2.20 ms"),
            "{error}"
        );
    }
}
