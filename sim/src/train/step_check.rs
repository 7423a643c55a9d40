//! Checks that a physics step is short enough for the train's springs and dampers.
//!
//! With forces computed from the state before the step and velocities advanced first (semi-implicit Euler), a mode of
//! stiffness k, damping c and mass m stays bounded while dt² k + 2 dt c < 4 m (Jury's test on
//! z² − (2 − dt c/m − dt² k/m) z + 1 − dt c/m). For the whole train the left side is λ, the largest eigenvalue of
//! M⁻¹ (dt² K + 2 dt C), found here by power iteration on the train as it stands on a straight rail.

use super::{ConnectionKind, Train};
use crate::error::DataError;
use nalgebra::{Matrix3, Vector3};

/// Stability ends at λ = 4; a quarter is kept back for curves, hold-down contacts and the clamp's roll stiffness.
const MAX_STIFFNESS_NUMBER: f64 = 3.0;
const ITERATIONS: usize = 300;

/// A body at one end of a spring, and the effect of its unit velocity (linear, angular) on the spring's rate.
type End = (usize, Vector3<f64>, Vector3<f64>);

/// A spring-damper between two bodies, or a body and the rail.
struct Spring {
    k: f64,
    c: f64,
    ends: [Option<End>; 2],
}

impl Train {
    /// Refuse a physics step, s, that is too long for this train's stiffnesses, dampings and masses.
    pub(crate) fn check_step(&self, dt_s: f64) -> Result<(), DataError> {
        let (lambda, body) = self.stiffness_number(dt_s);
        if lambda <= MAX_STIFFNESS_NUMBER {
            return Ok(());
        }
        let most = self.longest_step_s();
        let name = self.bodies.get(body).map_or("?", |b| b.name.as_str());
        Err(DataError::new(
            "",
            format!(
                "springs on `{name}` are too stiff for its mass at a step of {} ms",
                libm::round(1e6 * dt_s) / 1e3
            ),
            format!(
                "a step of at most {:.2} ms, softer springs and dampers, or more mass",
                1e3 * most
            ),
        ))
    }

    /// Longest step that [`Train::check_step`] accepts, s.
    pub(crate) fn longest_step_s(&self) -> f64 {
        let (mut short, mut long) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (short + long);
            if self.stiffness_number(middle).0 <= MAX_STIFFNESS_NUMBER {
                short = middle
            } else {
                long = middle
            }
        }
        short
    }

    /// λ (see the top of this file) and the body that moves most in its mode. Unstable from 4 on.
    pub(crate) fn stiffness_number(&self, dt_s: f64) -> (f64, usize) {
        let springs = self.springs();
        let inverse: Vec<Matrix3<f64>> = self
            .bodies
            .iter()
            .map(|b| b.inertia.try_inverse().unwrap_or_default())
            .collect();
        // A start that no mode is blind to: different numbers for every coordinate, the same on every machine.
        let mut x: Vec<[Vector3<f64>; 2]> = (0..self.bodies.len())
            .map(|i| {
                let odd = |j: usize| 1.0 + libm::sin((7 * i + 3 * j + 1) as f64);
                [
                    Vector3::new(odd(0), odd(1), odd(2)),
                    Vector3::new(odd(3), odd(4), odd(5)),
                ]
            })
            .collect();
        let mut lambda = 0.0;
        for _ in 0..ITERATIONS {
            let mut y = vec![[Vector3::zeros(); 2]; x.len()];
            for s in &springs {
                let ends = s.ends.iter().flatten();
                let rate: f64 = ends
                    .clone()
                    .map(|(i, v, w)| v.dot(&x[*i][0]) + w.dot(&x[*i][1]))
                    .sum();
                let force = (dt_s * dt_s * s.k + 2.0 * dt_s * s.c) * rate;
                for (i, v, w) in ends {
                    y[*i][0] += v * (force / self.bodies[*i].mass_kg);
                    y[*i][1] += inverse[*i] * w * force;
                }
            }
            // Rayleigh quotient in the energy norm, in which M⁻¹ K is symmetric: it grows towards λ from below.
            let energy = |p: &[[Vector3<f64>; 2]], q: &[[Vector3<f64>; 2]]| -> f64 {
                let bodies = self.bodies.iter().enumerate();
                bodies
                    .map(|(i, b)| {
                        b.mass_kg * p[i][0].dot(&q[i][0]) + p[i][1].dot(&(b.inertia * q[i][1]))
                    })
                    .sum()
            };
            let (xx, xy, yy) = (energy(&x, &x), energy(&x, &y), energy(&y, &y));
            if xx <= 0.0 || yy <= 0.0 {
                return (lambda, 0);
            }
            lambda = xy / xx;
            let scale = 1.0 / yy.sqrt();
            x = y.iter().map(|[v, w]| [v * scale, w * scale]).collect();
        }
        let motion = |i: &usize| {
            let b = &self.bodies[*i];
            b.mass_kg * x[*i][0].norm_squared() + x[*i][1].dot(&(b.inertia * x[*i][1]))
        };
        let most = (0..self.bodies.len()).max_by(|a, b| motion(a).total_cmp(&motion(b)));
        (lambda, most.unwrap_or(0))
    }

    /// Every spring on a straight level rail: running wheels upright, guides across, connections between bodies.
    fn springs(&self) -> Vec<Spring> {
        let end = |body: usize, at: Vector3<f64>, along: Vector3<f64>| {
            let b = &self.bodies[body];
            let arm = b.start_pose.rotation * (at - b.com);
            let about = b.start_pose.rotation.inverse() * arm.cross(&along);
            Some((body, along, about))
        };
        let mut springs = Vec::new();
        for (i, b) in self.bodies.iter().enumerate() {
            for s in &b.stations {
                for y in [s.half_gauge_m, -s.half_gauge_m] {
                    let wheel = end(i, Vector3::new(s.x_m, y, 0.0), Vector3::z());
                    springs.push(Spring {
                        k: s.wheel_k,
                        c: s.wheel_c,
                        ends: [wheel, None],
                    });
                }
                let guide = end(i, Vector3::new(s.x_m, 0.0, s.guide_z_m), Vector3::y());
                springs.push(Spring {
                    k: s.guide_k,
                    c: s.guide_c,
                    ends: [guide, None],
                });
            }
        }
        for c in &self.connections {
            let place = |body: usize, at: &Vector3<f64>| {
                let b = &self.bodies[body];
                b.start_pose * nalgebra::Point3::from(*at) + Vector3::new(b.start_s, 0.0, 0.0)
            };
            let line = place(c.b, &c.anchor_b) - place(c.a, &c.anchor_a);
            let directions = match c.kind {
                ConnectionKind::Hanger => vec![Vector3::x(), Vector3::y(), Vector3::z()],
                ConnectionKind::Drawbar | ConnectionKind::Chain => {
                    line.try_normalize(1e-9).into_iter().collect()
                }
            };
            for d in directions {
                springs.push(Spring {
                    k: c.k,
                    c: c.c,
                    ends: [end(c.a, c.anchor_a, d), end(c.b, c.anchor_b, -d)],
                });
            }
        }
        springs
    }
}

#[allow(clippy::unwrap_used)]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::{Body, Connection, Station};
    use nalgebra::Isometry3;

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
        let omega2 = 600.0 * (1.0 / 2.0 + 1.0 / 3.0);
        assert!((train.stiffness_number(0.01).0 - omega2 * 1e-4).abs() < 1e-12);
        assert!((train.longest_step_s() - (3.0 / omega2).sqrt()).abs() < 1e-9);
    }

    /// Largest excursion of a damped oscillator stepped as the world steps it.
    fn excursion(k: f64, c: f64, m: f64, dt: f64) -> f64 {
        let (mut x, mut v, mut most) = (1e-3, 0.0, 0.0_f64);
        for _ in 0..20_000 {
            v -= dt * (k * x + c * v) / m;
            x += dt * v;
            most = most.max(f64::abs(x));
        }
        most
    }

    #[test]
    fn the_number_four_is_where_the_step_breaks_down() {
        for (k, c) in [(1e4, 0.0), (1e4, 50.0), (1e3, 200.0)] {
            let train = Train {
                bodies: vec![body(1.0, vec![]), body(1e12, vec![])],
                connections: vec![bar(0, 1, k, c)],
                ..Train::default()
            };
            // λ is dt² k + 2 dt c here: solve for λ = 4.
            let dt4 = (-c + (c * c + 4.0 * k).sqrt()) / k;
            assert!((train.stiffness_number(dt4).0 - 4.0).abs() < 1e-6);
            assert!(excursion(k, c, 1.0, 0.99 * dt4) < 1.0);
            assert!(excursion(k, c, 1.0, 1.01 * dt4) > 1e3);
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
        assert!(train.check_step(1e-3).is_ok());
        let error = train.check_step(2e-3).unwrap_err().to_string();
        assert!(
            error.contains("`light`") && error.contains("1.73 ms"),
            "{error}"
        );
    }
}
