//! Springs and masses of the train as it stands on a straight rail.

use super::{Body, ConnectionKind, Drive, SHOE_SIGMA1, Train};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Share of a spring's force that is taken from each end of a step, and not from its middle: β of Newmark's method. With
/// 1/12 periods are right to the fourth order (Fox and Goodwin 1949).
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

    fn new(k: f64, c: f64, ends: [Option<End>; 2]) -> Self {
        let share = SPRING_SHARE;
        Self { k, c, share, ends }
    }

    /// Returns what each m/s by which the rate changes more than expected in a step of `dt` (s) adds to the force, N·s/m.
    pub(crate) fn yielding(&self, dt: f64) -> f64 {
        0.5 * self.c + self.share * dt * self.k
    }
}

impl Body {
    /// Mass, kg, and inertia about the centre of mass, kg·m², in the body frame.
    pub(crate) fn mass_matrix(&self) -> Matrix6<f64> {
        let mut m = Matrix6::from_diagonal_element(self.mass_kg);
        m.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.inertia);
        m
    }
}

impl Train {
    /// Masses of all bodies, then of the friction wheels at their rims.
    pub(crate) fn masses(&self) -> Vec<Matrix6<f64>> {
        let bodies = self.bodies.iter().map(Body::mass_matrix);
        let wheels = self.drives.iter().flat_map(|d| {
            let rim = d.turning_inertia() / (d.wheel_radius_m * d.wheel_radius_m);
            [Matrix6::from_diagonal_element(rim); 2]
        });
        bodies.chain(wheels).collect()
    }

    /// Effect of body `i` on the rate of a spring at its point `at` along a direction of the rail.
    fn end(&self, i: usize, at: Vector3<f64>, along: Vector3<f64>) -> Option<End> {
        let b = &self.bodies[i];
        let along = b.start_pose.rotation.inverse() * along;
        let about = (at - b.com).cross(&along);
        let rate = Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z);
        Some((i, rate))
    }

    /// Every spring on a straight level rail but those of brake shoes: of running gear, connections and friction wheels.
    pub(crate) fn springs(&self) -> Vec<Spring> {
        let mut springs = self.running_gear();
        springs.extend(self.springs_of_connections());
        springs.extend(self.springs_of_friction());
        springs
    }

    /// Running wheels upright, and guides across.
    fn running_gear(&self) -> Vec<Spring> {
        let mut springs = Vec::new();
        for (i, b) in self.bodies.iter().enumerate() {
            for s in &b.stations {
                let ends = [s.half_gauge_m, -s.half_gauge_m].map(|y| {
                    (
                        Vector3::new(s.x_m, y, 0.0),
                        Vector3::z(),
                        s.wheel_k,
                        s.wheel_c,
                    )
                });
                let guide = Vector3::new(s.x_m, 0.0, s.guide_z_m);
                let guide = (guide, Vector3::y(), s.guide_k, s.guide_c);
                for (at, along, k, c) in ends.into_iter().chain([guide]) {
                    let ends = [self.end(i, at, along), None];
                    springs.push(Spring::new(k, c, ends));
                }
            }
        }
        springs
    }

    /// Connections between bodies.
    fn springs_of_connections(&self) -> Vec<Spring> {
        let place = |body: usize, at: &Vector3<f64>| {
            let b = &self.bodies[body];
            b.start_pose * nalgebra::Point3::from(*at) + Vector3::new(b.start_s, 0.0, 0.0)
        };
        let mut springs = Vec::new();
        for c in &self.connections {
            let line = place(c.b, &c.anchor_b) - place(c.a, &c.anchor_a);
            let directions = match c.kind {
                ConnectionKind::Hanger => vec![Vector3::x(), Vector3::y(), Vector3::z()],
                ConnectionKind::Drawbar | ConnectionKind::Chain => {
                    line.try_normalize(1e-9).into_iter().collect()
                }
            };
            springs.extend(directions.into_iter().map(|d| {
                let ends = [self.end(c.a, c.anchor_a, d), self.end(c.b, c.anchor_b, -d)];
                Spring::new(c.k, c.c, ends)
            }));
        }
        springs
    }

    /// Bristles of friction wheels, which are counted on behind the bodies.
    fn springs_of_friction(&self) -> Vec<Spring> {
        let mut springs = Vec::new();
        for (i, d) in self.drives.iter().enumerate() {
            for side in [0, 1] {
                let rim = (self.bodies.len() + 2 * i + side, -Vector6::x());
                springs.push(self.bristle(d, d.sigma1, Some(rim)));
            }
        }
        springs
    }

    /// Bristles of brake shoes.
    pub(crate) fn shoes(&self) -> impl Iterator<Item = Spring> + '_ {
        let drives = self.drives.iter();
        drives.map(|d| self.bristle(d, SHOE_SIGMA1, None))
    }

    fn bristle(&self, d: &Drive, c: f64, other: Option<End>) -> Spring {
        let ends = [self.end(d.body, d.contact, Vector3::x()), other];
        Spring {
            share: BRISTLE_SHARE,
            ..Spring::new(d.sigma0, c, ends)
        }
    }
}
