//! The driver: steers along the middle of the lane.
//!
//! ```text
//! δ = κ (L + K v²) − k (n + x (ψ − ψ_s)),    ψ_s = −κ (b − a m v² / (C_r L))
//! ```
//!
//! The first term is the steering of a single-track model in a steady bend of curvature κ (K understeer gradient), the
//! second brings the car back: n is its way to the left of the lane's middle, ψ its heading against it, ψ_s that of a
//! steady bend, x how far ahead the driver looks. Source: Kapania & Gerdes 2015, "Design of a feedback-feedforward
//! steering controller for accurate path tracking and stability at the limits of handling", Vehicle System Dynamics
//! 53(12), without its terms for the limits.
//!
//! The driver belongs to the plant, as the rail belongs to the train: it has the truth and keeps the car in its lane,
//! so that the experiment is about mass and grade.

/// A driver and the steering gear.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// Lookahead distance, m.
    pub lookahead_m: f64,
    /// Steering per metre beside the line, rad/m.
    pub gain_radpm: f64,
    /// First-order lag of driver and gear, s.
    pub lag_s: f64,
    /// Largest angle of the front wheels, rad.
    pub max_angle_rad: f64,
    /// Wheelbase L, m.
    pub wheelbase_m: f64,
    /// Understeer gradient K, rad per m/s².
    pub understeer: f64,
    /// Heading of a steady bend: b, m, and a m / (C_r L), s²/m.
    pub sideslip: [f64; 2],
}

/// Input of the driver.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Curvature of the lane at the place where the steering will take effect, 1/m, + left.
    pub bend_1pm: f64,
    /// Distance to the left of the lane's middle, m.
    pub offset_m: f64,
    /// Heading against the lane, rad, + left.
    pub heading_rad: f64,
}

impl Driver {
    /// Target angle of the front wheels, rad, + left.
    pub fn wish(&self, v: &View) -> f64 {
        let square = v.speed_mps * v.speed_mps;
        let ahead = v.bend_1pm * (self.wheelbase_m + self.understeer * square);
        let steady = -v.bend_1pm * (self.sideslip[0] - self.sideslip[1] * square);
        let back = v.offset_m + self.lookahead_m * (v.heading_rad - steady);
        (ahead - self.gain_radpm * back).clamp(-self.max_angle_rad, self.max_angle_rad)
    }
}
