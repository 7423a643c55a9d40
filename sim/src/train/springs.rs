//! Springs and masses of the train as it stands on a straight rail.

use super::{ConnectionKind, Train};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Share of a spring's force that is taken from each end of a step, and not from its middle: β of Newmark's method.
/// With 1/12 periods are right to the fourth order (Fox and Goodwin 1949).
pub(crate) const SPRING_SHARE: f64 = 1.0 / 12.0;
/// The same of bristles, which are stiffer than a step resolves: stable for steps longer by half.
pub(crate) const BRISTLE_SHARE: f64 = 1.0 / 6.0;

/// Effect of a body's unit velocity (linear, angular, in its own frame) on the rate of a spring.
pub(crate) type End = (usize, Vector6<f64>);

/// A spring-damper at one or two ends.
pub(crate) struct Spring {
    pub(crate) k: f64,
    pub(crate) c: f64,
    /// β of the spring.
    pub(crate) share: f64,
    pub(crate) ends: [Option<End>; 2],
}

impl Spring {
    /// Returns the effect of body `i`, none if it is no end.
    pub(crate) fn rate(&self, i: usize) -> Vector6<f64> {
        let mut ends = self.ends.iter().flatten();
        ends.find(|end| end.0 == i)
            .map_or_else(Vector6::zeros, |end| end.1)
    }

    /// Returns the body to which the spring joins body `i`.
    pub(crate) fn other(&self, i: usize) -> Option<usize> {
        let [Some((a, _)), Some((b, _))] = self.ends else {
            return None;
        };
        (a == i).then_some(b).or((b == i).then_some(a))
    }

    /// Returns what each m/s by which the rate changes more than expected in a step of `dt` (s) adds to the force,
    /// N·s/m.
    pub(crate) fn yielding(&self, dt: f64) -> f64 {
        0.5 * self.c + self.share * dt * self.k
    }
}

impl Train {
    /// Masses (kg) and inertias (kg·m²) of all bodies in their frames, then of the friction wheels at their rims.
    pub(crate) fn masses(&self) -> Vec<Matrix6<f64>> {
        let bodies = self.bodies.iter().map(|b| {
            let mut m = Matrix6::from_diagonal_element(b.mass_kg);
            m.fixed_view_mut::<3, 3>(3, 3).copy_from(&b.inertia);
            m
        });
        let wheels = self.drives.iter().flat_map(|d| {
            let rim = d.turning_inertia() / (d.wheel_radius_m * d.wheel_radius_m);
            [Matrix6::from_diagonal_element(rim); 2]
        });
        bodies.chain(wheels).collect()
    }

    /// Effect of body `i` on the rate of a spring at its point `at` along a direction of the rail.
    pub(crate) fn end(&self, i: usize, at: Vector3<f64>, along: Vector3<f64>) -> Option<End> {
        let b = &self.bodies[i];
        let along = b.start_pose.rotation.inverse() * along;
        let about = (at - b.com).cross(&along);
        let rate = Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z);
        Some((i, rate))
    }

    /// Every spring on a straight level rail but those of brake shoes: running wheels upright, guides across,
    /// connections between bodies, bristles of friction wheels along.
    pub(crate) fn springs(&self) -> Vec<Spring> {
        let mut springs = Vec::new();
        let mut add = |k, c, share, ends| springs.push(Spring { k, c, share, ends });
        for (i, b) in self.bodies.iter().enumerate() {
            for s in &b.stations {
                for y in [s.half_gauge_m, -s.half_gauge_m] {
                    let wheel = self.end(i, Vector3::new(s.x_m, y, 0.0), Vector3::z());
                    add(s.wheel_k, s.wheel_c, SPRING_SHARE, [wheel, None]);
                }
                let guide = self.end(i, Vector3::new(s.x_m, 0.0, s.guide_z_m), Vector3::y());
                add(s.guide_k, s.guide_c, SPRING_SHARE, [guide, None]);
            }
        }
        let place = |body: usize, at: &Vector3<f64>| {
            let b = &self.bodies[body];
            b.start_pose * nalgebra::Point3::from(*at) + Vector3::new(b.start_s, 0.0, 0.0)
        };
        for c in &self.connections {
            let line = place(c.b, &c.anchor_b) - place(c.a, &c.anchor_a);
            let directions = match c.kind {
                ConnectionKind::Hanger => vec![Vector3::x(), Vector3::y(), Vector3::z()],
                ConnectionKind::Drawbar | ConnectionKind::Chain => {
                    line.try_normalize(1e-9).into_iter().collect()
                }
            };
            for d in directions {
                let ends = [self.end(c.a, c.anchor_a, d), self.end(c.b, c.anchor_b, -d)];
                add(c.k, c.c, SPRING_SHARE, ends);
            }
        }
        for (i, d) in self.drives.iter().enumerate() {
            let body = self.end(d.body, d.contact, Vector3::x());
            for rim in [2 * i, 2 * i + 1] {
                let rim = Some((self.bodies.len() + rim, -Vector6::x()));
                add(d.sigma0, d.sigma1, BRISTLE_SHARE, [body, rim]);
            }
        }
        springs
    }
}
