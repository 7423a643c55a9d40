//! The road under a car: its centre of gravity rides on the chord between the axles.
//!
//! With a, b the ways from the centre of gravity to the front and rear axle, the height of the centre of gravity over
//! its place on a level road is (b z_front + a z_rear) / (a + b). Its derivative along the track is the grade that
//! weight works against, and the chord's own angle is the pitch of the car.

use crate::rail::{Cursor, Rail, RailFrame};

/// The road under the car.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The lane's middle beside the centre of gravity.
    pub middle: RailFrame,
    /// Sine of the grade that acts on the weight, along the lane's middle.
    pub sine: f64,
    /// Derivative of the grade, 1/m, which presses the car on the road in a sag.
    pub sag_1pm: f64,
    /// Angle of the chord between the axles, rad, + nose up.
    pub pitch_rad: f64,
    /// Growth of that angle along the lane, rad/m.
    pub pitch_1pm: f64,
    /// Curvature in the road's plane, 1/m, + left.
    pub bend_1pm: f64,
}

/// Finds the road under a car, fast when the car has hardly moved.
#[derive(Clone, Copy, Debug, Default)]
pub struct Finder {
    cursors: [Cursor; 3],
}

impl Finder {
    /// The road at chainage `s` (m) under axles `front_m` ahead and `rear_m` behind it.
    pub fn at(&mut self, rail: &Rail, s: f64, front_m: f64, rear_m: f64) -> Surface {
        let [c0, c1, c2] = &mut self.cursors;
        let middle = rail.frame_at(s, c0);
        let front = rail.frame_at(s + front_m, c1);
        let rear = rail.frame_at(s - rear_m, c2);
        let wheelbase = front_m + rear_m;
        let rise = ((front.p.z - rear.p.z) / wheelbase).clamp(-1.0, 1.0);
        let pitch = libm::asin(rise);
        let share = |f: f64, r: f64| (rear_m * f + front_m * r) / wheelbase;
        Surface {
            middle,
            sine: share(front.t.z, rear.t.z),
            sag_1pm: share(front.k.dot(&front.u), rear.k.dot(&rear.u)),
            pitch_rad: pitch,
            pitch_1pm: (front.t.z - rear.t.z) / (wheelbase * libm::cos(pitch)),
            bend_1pm: middle.k.dot(&middle.l),
        }
    }
}
