//! Equations of motion in the plane of the road.
//!
//! ```text
//! m (u̇ − v r) = Σ Fx − D u|u| − m g S cos ψ        S sine of the grade where the car is
//! m (v̇ + u r) = Σ Fy + m g S sin ψ                 u, v forward and left, r yaw rate about the road's normal
//! I ṙ = Σ (x Fy − y Fx)
//! ṡ = (u cos ψ − v sin ψ) / (1 − n κ)              n way to the left of the lane's middle, κ its curvature in the plane
//! ṅ = u sin ψ + v cos ψ                            ψ heading against the lane
//! ψ̇ = r − κ ṡ
//! N = m (g √(1 − S²) + κ_v ṡ²)                     κ_v sag, shared between the wheels as `loads` says
//! ```
//!
//! Source: Rajamani 2012, "Vehicle Dynamics and Control", chapters 2 and 4 (two-track model, path coordinates), with
//! the grade added. The height of the centre of gravity counts for load transfer only. Integrated semi-implicitly in
//! sub-steps of at most 0.5 ms (forces first, then speeds, then places); the rotation of the velocity with the yaw rate
//! is exact.

use super::driver::{Driver, View};
use super::loads::{ChassisGeometry, LeanState, Suspension};
use super::surface::{Finder, Surface};
use super::tyre::Tyre;
use super::wheel::{Acting, Wheel, WheelSpec};
use crate::plant::train::adhesion::{self, AdhesionZone};
use crate::plant::train::motor::{Lag, TractionMotor, wheel_torque};
use crate::rail::{Cursor, Rail};
use crate::train::Drive;
use monorig_estimators::api::signals::Command;

/// Longest sub-step, s: a tenth of the period of the stiffest part, a braked wheel on its tyre.
const MAX_SUBSTEP_S: f64 = 5e-4;

/// Constants of a car. Pairs are front and rear.
#[derive(Clone, Copy, Debug)]
pub struct CarModel {
    /// Mass and lengths.
    pub geometry: ChassisGeometry,
    /// Springs and dampers.
    pub suspension: Suspension,
    /// Tyres.
    pub tyres: [Tyre; 2],
    /// Wheels.
    pub wheels: [WheelSpec; 2],
    /// Motors and gears.
    pub drives: [Drive; 2],
    /// Largest brake force of one wheel, N.
    pub brake_n: [f64; 2],
    /// Lag of the brakes, s.
    pub brake_lag_s: f64,
    /// ½ ρ c_D A, N·s²/m².
    pub drag: f64,
    /// Inertia about the normal of the road, kg·m².
    pub yaw_inertia: f64,
    /// Driver.
    pub driver: Driver,
    /// Gravity, m/s².
    pub gravity: f64,
}

/// Position and motion of the car. Wheels: front left, front right, rear left, rear right.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Chainage of the centre of gravity, m.
    pub s: f64,
    /// Distance to the left of the lane's middle, m.
    pub offset: f64,
    /// Heading against the lane, rad, + left.
    pub heading: f64,
    /// Speed forward and to the left, m/s.
    pub v: [f64; 2],
    /// Yaw rate about the road's normal, rad/s, + left.
    pub yaw_rate: f64,
    /// Angle of the front wheels, rad, + left.
    pub steering: f64,
    /// Wheels.
    pub wheels: [Wheel; 4],
    /// Pitch of the body on its springs.
    pub pitch: LeanState,
    /// Roll of the body on its springs.
    pub roll: LeanState,
    /// Motors.
    pub motors: [TractionMotor; 2],
    /// Share of the brake applied.
    pub brake: Lag,
}

/// Forces in the last sub-step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Forces {
    /// Loads of the wheels, N.
    pub load_n: [f64; 4],
    /// Normal force of all wheels, N.
    pub normal_n: f64,
    /// Forces of the tyres on the body, forward and to the left, N.
    pub tyre_n: [f64; 2],
    /// Air drag against the motion, N.
    pub drag_n: f64,
    /// Adhesion relative to the dry adhesion, front and rear.
    pub grip: [f64; 2],
    /// Torque on both wheels of an axle from its motor, N·m.
    pub drive_nm: [f64; 2],
    /// Speed along the lane, m/s: what the wheels of a car dead in line would roll.
    pub along_mps: f64,
}

/// Energy since the start, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Energy from the motors after the gears.
    pub motor_j: f64,
    /// Lost in brakes.
    pub brake_j: f64,
    /// Lost in rolling.
    pub rolling_j: f64,
    /// Lost to the air.
    pub drag_j: f64,
    /// Energy lost in the contacts, and energy stored in their springs.
    pub tyre_j: f64,
}

/// A car in motion.
#[derive(Clone, Debug)]
pub struct CarBody {
    /// Constants.
    pub model: CarModel,
    /// State.
    pub state: State,
    /// Last forces.
    pub forces: Forces,
    /// Energy so far.
    pub work: Work,
    /// The road under the car now.
    pub surface: Surface,
    /// Slippery stretches.
    pub zones: Vec<AdhesionZone>,
    finder: Finder,
    ahead: Cursor,
}

impl CarBody {
    /// Places the car in the middle of the lane at chainage `s` (m), at `speed` (m/s); a standing car is held by its
    /// brake.
    pub fn new(model: CarModel, rail: &Rail, s: f64, speed: f64, zones: Vec<AdhesionZone>) -> Self {
        let mut finder = Finder::default();
        let g = &model.geometry;
        let surface = finder.at(rail, s, g.front_m, g.rear_m);
        let mut state = State {
            s,
            v: [speed, 0.0],
            yaw_rate: surface.bend_1pm * speed,
            brake: Lag {
                value: if speed == 0.0 { 1.0 } else { 0.0 },
            },
            ..State::default()
        };
        state.pitch = LeanState::settled(model.gravity * surface.sine);
        for (i, w) in state.wheels.iter_mut().enumerate() {
            w.rate = speed / model.wheels[i / 2].radius_m;
        }
        Self {
            model,
            state,
            forces: Forces::default(),
            work: Work::default(),
            surface,
            zones,
            finder,
            ahead: Cursor::at(s),
        }
    }

    /// Advance by `dt` (s) under a command.
    pub fn step(&mut self, rail: &Rail, command: &Command, dt: f64) {
        let steps = libm::ceil(dt / MAX_SUBSTEP_S - 1e-9).max(1.0);
        for _ in 0..steps as usize {
            self.sub_step(rail, command, dt / steps);
        }
    }

    fn sub_step(&mut self, rail: &Rail, command: &Command, dt: f64) {
        let m = self.model;
        self.steer(rail, dt);
        self.press();
        self.turn_wheels(command, dt);
        let x = &mut self.state;
        let (sum, moment) = tyre_forces(&m, x);
        let f = &mut self.forces;
        let mass = m.geometry.mass_kg;
        f.tyre_n = sum;
        f.drag_n = m.drag * x.v[0] * x.v[0].abs();
        self.work.drag_j += f.drag_n * x.v[0] * dt;
        let specific = [(sum[0] - f.drag_n) / mass, sum[1] / mass];
        let (sin, cos) = (libm::sin(x.heading), libm::cos(x.heading));
        // A lane's inside is shorter and so as much steeper.
        let along = 1.0 - x.offset * self.surface.bend_1pm;
        let grade = self.surface.sine / along;
        let accel = [
            specific[0] - m.gravity * grade * cos,
            specific[1] + m.gravity * grade * sin,
        ];
        let turn = x.yaw_rate * dt;
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        x.v = [
            c * x.v[0] + s * x.v[1] + accel[0] * dt,
            c * x.v[1] - s * x.v[0] + accel[1] * dt,
        ];
        x.yaw_rate += moment / m.yaw_inertia * dt;
        x.pitch.step(&m.suspension, specific[0], dt);
        x.roll.step(&m.suspension, specific[1], dt);

        f.along_mps = x.v[0] * cos - x.v[1] * sin;
        let rate = f.along_mps / along;
        x.s += rate * dt;
        x.offset += (x.v[0] * sin + x.v[1] * cos) * dt;
        x.heading += (x.yaw_rate - self.surface.bend_1pm * rate) * dt;
        self.surface = self
            .finder
            .at(rail, x.s, m.geometry.front_m, m.geometry.rear_m);
    }

    fn steer(&mut self, rail: &Rail, dt: f64) {
        let (d, x) = (&self.model.driver, &mut self.state);
        let ahead = rail.frame_at(x.s + x.v[0] * d.lag_s, &mut self.ahead);
        let wish = d.wish(&View {
            speed_mps: x.v[0],
            bend_1pm: ahead.k.dot(&ahead.l),
            offset_m: x.offset,
            heading_rad: x.heading,
        });
        x.steering += (wish - x.steering) * dt / (d.lag_s + dt);
    }

    /// Loads of the wheels.
    fn press(&mut self) {
        let (m, x, f) = (&self.model, &self.state, &mut self.forces);
        let s = &self.surface;
        let cos = libm::sqrt((1.0 - s.sine * s.sine).max(0.0));
        let press = m.gravity * cos + s.sag_1pm * x.v[0] * x.v[0];
        f.normal_n = (m.geometry.mass_kg * press).max(0.0);
        f.load_n = m
            .geometry
            .loads(&m.suspension, f.normal_n, &x.pitch, &x.roll);
    }

    /// Motors, brakes and tyres turn the wheels.
    fn turn_wheels(&mut self, command: &Command, dt: f64) {
        let m = self.model;
        let g = &m.geometry;
        let (x, f) = (&mut self.state, &mut self.forces);
        let brake = x.brake.step(command.brake, m.brake_lag_s, dt);
        for axle in 0..2 {
            let place = [g.front_m, -g.rear_m][axle];
            let (drive, spec, tyre) = (&m.drives[axle], &m.wheels[axle], &m.tyres[axle]);
            let grip =
                adhesion::at(&self.zones, x.s + place, tyre.adhesion_along) / tyre.adhesion_along;
            let mean = 0.5 * (x.wheels[2 * axle].rate + x.wheels[2 * axle + 1].rate);
            let torque = x.motors[axle].step(drive, command.motor_torque_nm[axle], mean, dt);
            let shaft = wheel_torque(drive, torque, mean);
            (f.grip[axle], f.drive_nm[axle]) = (grip, shaft);
            for side in 0..2 {
                let i = 2 * axle + side;
                let velocity = wheel_velocity(&m, x, i);
                let before = x.wheels[i].rate;
                let wheel = &mut x.wheels[i];
                let acting = Acting {
                    drive_nm: 0.5 * shaft,
                    brake_nm: brake * m.brake_n[axle] * spec.radius_m,
                    load_n: f.load_n[i],
                    grip,
                    velocity,
                };
                wheel.step(spec, tyre, &acting, dt);
                let rate = 0.5 * (before + wheel.rate);
                let slipping = wheel.force[0] * (rate * spec.radius_m - velocity[0])
                    - wheel.force[1] * velocity[1];
                self.work.motor_j += acting.drive_nm * rate * dt;
                self.work.brake_j += wheel.stopping[0] * rate * dt;
                self.work.rolling_j += wheel.stopping[1] * rate * dt;
                self.work.tyre_j += slipping * dt;
            }
        }
    }

    /// Kinetic energy of body and wheels, J.
    pub fn kinetic_j(&self) -> f64 {
        let (m, x) = (&self.model, &self.state);
        let body = m.geometry.mass_kg * (x.v[0] * x.v[0] + x.v[1] * x.v[1])
            + m.yaw_inertia * x.yaw_rate * x.yaw_rate;
        let wheels = (0..4).map(|i| m.wheels[i / 2].inertia * x.wheels[i].rate * x.wheels[i].rate);
        0.5 * (body + wheels.sum::<f64>())
    }
}

/// Place of a wheel, forward and left of the centre of gravity, m, and its steering angle, rad.
fn wheel_place(m: &CarModel, x: &State, i: usize) -> ([f64; 2], f64) {
    let g = &m.geometry;
    let side = if i.is_multiple_of(2) { 0.5 } else { -0.5 };
    let left = side * g.track_width_m;
    match i {
        0 | 1 => ([g.front_m, left], x.steering),
        _ => ([-g.rear_m, left], 0.0),
    }
}

/// Velocity of a wheel's centre, along the wheel and to its left, m/s.
fn wheel_velocity(m: &CarModel, x: &State, i: usize) -> [f64; 2] {
    let ([ahead, left], angle) = wheel_place(m, x, i);
    let v = [x.v[0] - x.yaw_rate * left, x.v[1] + x.yaw_rate * ahead];
    let (s, c) = (libm::sin(angle), libm::cos(angle));
    [c * v[0] + s * v[1], c * v[1] - s * v[0]]
}

/// Sum of the tyres' forces on the body, forward and to the left, N, and their moment about the normal, N·m.
fn tyre_forces(m: &CarModel, x: &State) -> ([f64; 2], f64) {
    let (mut sum, mut moment) = ([0.0; 2], 0.0);
    for (i, w) in x.wheels.iter().enumerate() {
        let ([ahead, left], angle) = wheel_place(m, x, i);
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let f = [
            c * w.force[0] - s * w.force[1],
            s * w.force[0] + c * w.force[1],
        ];
        sum = [sum[0] + f[0], sum[1] + f[1]];
        moment += ahead * f[1] - left * f[0];
    }
    (sum, moment)
}
