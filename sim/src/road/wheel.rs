//! Spin of a wheel: J ω̇ = T − R Fx − (brake and rolling resistance, which only ever stop it).

use super::tyre::{Slide, Tyre};

/// Parameters of a wheel.
#[derive(Clone, Copy, Debug)]
pub struct WheelSpec {
    /// Rolling radius, m.
    pub radius_m: f64,
    /// Inertia about the axle with its half of the motor, kg·m².
    pub inertia: f64,
    /// Rolling resistance over load.
    pub rolling: f64,
}

/// A turning wheel and its tyre.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wheel {
    /// Rate, rad/s.
    pub rate: f64,
    /// Angle, rad, for viewing.
    pub angle: f64,
    /// Slip of the tyre, along and across.
    pub slip: [f64; 2],
    /// Force of the road on the wheel of the last step, along the wheel and to its left, N.
    pub force: [f64; 2],
    /// Torque lost in brake and in rolling, of the last step, N·m, with the sign of the motion they act against.
    pub stopping: [f64; 2],
}

/// Torques and forces on a wheel over a step.
#[derive(Clone, Copy, Debug)]
pub struct Acting {
    /// Torque of the drive shaft, N·m.
    pub drive_nm: f64,
    /// Largest holding torque of the brake, N·m.
    pub brake_nm: f64,
    /// Load, N.
    pub load_n: f64,
    /// Adhesion relative to the clean dry road.
    pub grip: f64,
    /// Speed of the centre, along the wheel and to its left, m/s.
    pub velocity: [f64; 2],
}

impl Wheel {
    /// Advance by `dt` (s). Sets the force on the wheel.
    pub fn step(&mut self, spec: &WheelSpec, tyre: &Tyre, a: &Acting, dt: f64) {
        let slide = Slide {
            rim: self.rate * spec.radius_m,
            along: a.velocity[0],
            across: a.velocity[1],
        };
        self.slip = tyre.relax(self.slip, &slide, a.load_n, a.grip, dt);
        self.force = tyre.force(self.slip, &slide, a.load_n, a.grip);
        let per_torque = dt / spec.inertia;
        let free = self.rate + per_torque * (a.drive_nm - spec.radius_m * self.force[0]);
        // Brake and rolling take what spin they can within the step, and no more; rolling resistance first, it is
        // always there.
        let take = |free: f64, torque: f64| free.clamp(-per_torque * torque, per_torque * torque);
        let rolling = take(free, spec.rolling * a.load_n * spec.radius_m);
        let brake = take(free - rolling, a.brake_nm);
        self.stopping = [brake / per_torque, rolling / per_torque];
        self.rate = free - rolling - brake;
        self.angle = libm::remainder(self.angle + self.rate * dt, 2.0 * std::f64::consts::PI);
    }
}
