//! All forces between train and rail and inside the train. Knows no physics engine: body states in, wrenches out.

use super::adhesion::{self, AdhesionZone};
use super::balance::{Directions, ForceBalance};
use super::body_state::{BodyState, Wrench};
use super::coupling::{self, Pull};
use super::friction::{Bristle, Contact};
use super::implicit::Implicit;
use super::motor::{Lag, TractionMotor, wheel_damping, wheel_torque};
use super::resistance;
use super::running_gear::{Grip, grip};
use crate::rail::{Cursor, Rail};
use crate::train::{Drive, SHOE_SIGMA1, Train};
use monorig_estimators::api::signals::Command;
use nalgebra::Vector3;

/// Half the width of a friction wheel's face: the clamped pair resists roll with at most clamp force × this, m.
const WHEEL_HALF_WIDTH_M: f64 = 0.03;
/// Roll stiffness of a clamped pair, N·m/rad, and its damping, N·m·s/rad.
pub(super) const CLAMP_ROLL_STIFFNESS: f64 = 2.0e4;
const CLAMP_ROLL_DAMPING: f64 = 2.0e2;

/// State of one drive unit beyond its rigid body.
#[derive(Clone, Copy, Debug)]
pub struct DriveUnit {
    /// Data of the drive unit.
    pub spec: Drive,
    pub(super) cursor: Cursor,
    /// Motor.
    pub motor: TractionMotor,
    /// Clamp pressure, MPa.
    pub clamp: Lag,
    /// Limit force of the clamp brake, N.
    pub brake: Lag,
    /// Left and right friction wheel.
    pub wheels: [Contact; 2],
    /// Torque of the gear at both wheels, and of the rolling against each, as expected in the last step, N·m, with what
    /// each rad/s more takes from the first and adds to the others, N·m·s.
    torques: [[f64; 2]; 3],
    /// Torque at the motor's shaft, N·m, mean over the last step.
    shaft: f64,
    /// Place at which the wheels touch the web, m, and the rail's direction there.
    at: Vector3<f64>,
    tangent: Vector3<f64>,
    /// Angles of the wheels, rad.
    pub angles: [f64; 2],
    /// Brake shoes.
    pub shoes: Contact,
    /// Adhesion under the wheels.
    pub adhesion: f64,
    /// Chainage of the wheels, m.
    pub chainage_m: f64,
}

/// Sums of one step, N and W.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// Friction of the driven wheels on the train along the rail, N.
    pub traction_n: f64,
    /// Running resistances against the motion, N, rolling of the clamped wheels included.
    pub resistance_n: f64,
    /// The part of it that acts on the bodies (all but the rolling of the clamped wheels), N.
    pub body_resistance_n: f64,
    /// Clamp brakes, N along the rail.
    pub brake_n: f64,
    /// Σ m g cos θ of the rail-bound bodies and what they carry, N.
    pub normal_n: f64,
    /// Σ m sin θ, kg.
    pub mass_sin: f64,
    /// Σ of all wheel loads, N.
    pub wheel_load_n: f64,
    /// Power of the motors at their shafts, W.
    pub drive_w: f64,
    /// Power lost in gears, slip, rolling, bearings, brakes and dampers, W.
    pub loss_w: f64,
    /// Largest deviation of a station from the rail's line, m.
    pub off_rail_m: f64,
    /// Sum of all forces of the rail on the train, N, world.
    pub external: Vector3<f64>,
    /// Σ Fᵢ·tᵢ of all forces but weight on the bodies, N along the rail.
    pub along_n: f64,
    /// Terms of the force balance along the rail but for what the bodies' motion adds: of `curve_n` the part of the
    /// forces.
    pub balance: ForceBalance,
}

/// All force laws of a train, with their internal states.
#[derive(Clone, Debug)]
pub struct Dynamics {
    /// The train.
    pub train: Train,
    /// Drive units.
    pub drives: Vec<DriveUnit>,
    /// Slippery stretches.
    pub zones: Vec<AdhesionZone>,
    /// Largest pressure of the clamps, MPa; below the command after a fault.
    pub clamp_limit_mpa: f64,
    /// Gravity, m/s².
    pub gravity: f64,
    /// Two cursors per rail-bound body, in the order of the stations.
    pub(super) cursors: Vec<Cursor>,
    /// Rolling resistance of each station.
    pub(super) rolling: Vec<Contact>,
    /// Mass that each body brings onto the rail, kg: its own and its share of what hangs from it; 0 for suspended
    /// bodies.
    carried: Vec<f64>,
    /// Directions of the rail at the bodies.
    directions: Directions,
    grips: Vec<Grip>,
    pulls: Vec<Pull>,
    implicit: Implicit,
    web_half: f64,
}

impl Dynamics {
    /// A train whose front stands at chainage `front`.
    pub fn new(train: Train, rail: &Rail, front: f64, gravity: f64) -> Self {
        let mut cursors = Vec::new();
        for b in &train.bodies {
            for st in &b.stations {
                cursors.push(Cursor::at(front + b.start_s + st.x_m));
            }
        }
        let drives = train
            .drives
            .iter()
            .map(|d| DriveUnit {
                spec: *d,
                cursor: Cursor::at(front + train.bodies[d.body].start_s + d.contact.x),
                motor: TractionMotor::default(),
                clamp: Lag { value: d.clamp_mpa },
                brake: Lag::default(),
                wheels: [Contact::default(); 2],
                torques: [[0.0; 2]; 3],
                shaft: 0.0,
                at: Vector3::zeros(),
                tangent: Vector3::x(),
                angles: [0.0; 2],
                shoes: Contact::default(),
                adhesion: d.adhesion,
                chainage_m: front + train.bodies[d.body].start_s + d.contact.x,
            })
            .collect();
        let web_half = rail.profile().map_or(0.0, |p| p.web_m) / 2.0;
        let mut this = Self {
            train,
            drives,
            zones: Vec::new(),
            clamp_limit_mpa: f64::INFINITY,
            gravity,
            rolling: vec![Contact::default(); cursors.len()],
            cursors,
            carried: Vec::new(),
            directions: Directions::default(),
            grips: Vec::new(),
            pulls: Vec::new(),
            implicit: Implicit::default(),
            web_half,
        };
        this.distribute_masses();
        let count = this.train.bodies.len();
        this.directions = Directions::new(count, this.train.suspended_bodies());
        this
    }

    /// Distributes each suspended body's mass over the bodies that carry it, down to the rail.
    pub fn distribute_masses(&mut self) {
        let mass = |i: usize| self.train.bodies[i].mass_kg;
        self.carried = self.train.resting(mass);
        self.implicit.reset();
    }

    /// Advance the internal states by `dt` and compute the wrench on every body (gravity excluded), mean over the step,
    /// from places and velocities in its middle as they are expected.
    pub fn forces(
        &mut self,
        rail: &Rail,
        bodies: &[BodyState],
        command: &Command,
        dt: f64,
        out: &mut [Wrench],
    ) -> Sums {
        out.fill(Wrench::ZERO);
        let mut sums = Sums::default();
        self.running_gear(rail, bodies, dt, out, &mut sums);
        self.drive_units(rail, bodies, command, dt, out, &mut sums);
        for w in out.iter() {
            sums.external += w.force;
        }
        self.directions.complete();
        self.pulls.clear();
        for c in &self.train.connections {
            let p = coupling::pull(c, &bodies[c.a], &bodies[c.b]);
            out[c.a].add(&bodies[c.a], &p.force, &p.at_a);
            out[c.b].add(&bodies[c.b], &-p.force, &p.at_b);
            sums.loss_w += p.loss;
            self.pulls.push(p);
        }
        let train = &self.train;
        self.implicit.solve(train, bodies, self.gravity, dt, out);
        let mut grips = self.grips.iter();
        for (i, body) in train.bodies.iter().enumerate() {
            for (st, g) in body.stations.iter().zip(&mut grips) {
                let more = &self.implicit.more[i];
                let gained = g.gained(st, &bodies[i], more);
                sums.external += g.press(st, &bodies[i], 0.0, gained, &mut out[i]);
                let load = |side: usize| (g.loads[side] + gained[side]).abs();
                sums.wheel_load_n += load(0) + load(1);
            }
        }
        let more = |i: usize, at: &Vector3<f64>| bodies[i].change(&self.implicit.more[i], at);
        for (c, p) in train.connections.iter().zip(&self.pulls) {
            let force = p.gains(c, &(more(c.b, &p.at_b) - more(c.a, &p.at_a)), dt);
            out[c.a].add(&bodies[c.a], &force, &p.at_a);
            out[c.b].add(&bodies[c.b], &-force, &p.at_b);
        }
        for unit in &mut self.drives {
            let i = unit.spec.body;
            let more = more(i, &unit.at);
            let force = unit.end(&more, dt, &mut sums);
            out[i].add(&bodies[i], &force, &unit.at);
            sums.external += force;
        }
        self.balance(out, &mut sums);
        sums
    }

    /// Completes the force balance from all forces.
    fn balance(&self, wrenches: &[Wrench], sums: &mut Sums) {
        let bodies = self.train.bodies.iter();
        let each = bodies.zip(wrenches).zip(self.directions.now());
        let (mut along, mut weight) = (0.0, 0.0);
        for ((body, wrench), t) in each {
            along += wrench.force.dot(t);
            weight += body.mass_kg * t.z;
        }
        let b = &mut sums.balance;
        b.brake_n = sums.brake_n;
        b.grade_n = -self.gravity * weight;
        let rolling = b.running_rolling_n + b.guide_rolling_n;
        let named = sums.traction_n + rolling + b.bearing_n + b.air_n + b.brake_n;
        b.curve_n = along - named;
        sums.along_n = along;
    }

    /// Directions of the rail at the bodies in the last step.
    pub(crate) fn directions(&self) -> &Directions {
        &self.directions
    }

    fn running_gear(
        &mut self,
        rail: &Rail,
        bodies: &[BodyState],
        dt: f64,
        out: &mut [Wrench],
        sums: &mut Sums,
    ) {
        let res = &self.train.resistance;
        let mut stations = self.cursors.iter_mut().zip(&mut self.rolling);
        self.grips.clear();
        let mut air_v = None;
        for (i, spec) in self.train.bodies.iter().enumerate() {
            let body = &bodies[i];
            let (mut tangents, mut sines) = (Vector3::zeros(), 0.0);
            for (k, st) in spec.stations.iter().enumerate() {
                let Some((cursor, rolling)) = stations.next() else {
                    return;
                };
                let at = body.p + body.r.column(0) * st.x_m;
                let f = rail.track(&at, cursor);
                let g = grip(st, body, &at, &f, dt);
                self.grips.push(g);
                let [by_running, by_guides] = resistance::rolling(res, &g);
                let limit = by_running + by_guides;
                let gained = body.change(&body.gained, &at).dot(&f.t);
                rolling.begin(&resistance::ROLLING, limit, [0.0; 2], [g.v_t, gained], dt);
                let held = rolling.end(&resistance::ROLLING, 0.0, dt);
                let mut against = 0.0;
                if k == 0 {
                    let bearing = resistance::bearing(res, g.v_t);
                    against += bearing;
                    sums.balance.bearing_n -= bearing;
                }
                if air_v.is_none() {
                    air_v = Some(());
                    let air = resistance::air(res, g.v_t);
                    against += air;
                    sums.balance.air_n -= air;
                }
                if limit > 0.0 {
                    sums.balance.running_rolling_n += held * by_running / limit;
                    sums.balance.guide_rolling_n += held * by_guides / limit;
                }
                g.press(st, body, held - against, g.loads, &mut out[i]);
                sums.resistance_n += against - held;
                sums.loss_w += g.loss + against * g.v_t + rolling.loss;
                sums.off_rail_m = sums.off_rail_m.max(g.off[0].abs()).max(g.off[1].abs());
                tangents += f.t;
                sines += rail.sine_without_steps(&f, cursor);
            }
            if !spec.stations.is_empty() {
                self.directions.set(i, &tangents);
                let sin = sines / spec.stations.len() as f64;
                sums.mass_sin += self.carried[i] * sin;
                sums.normal_n += self.carried[i] * self.gravity * (1.0 - sin * sin).max(0.0).sqrt();
            }
        }
        sums.body_resistance_n = sums.resistance_n;
    }

    fn drive_units(
        &mut self,
        rail: &Rail,
        bodies: &[BodyState],
        command: &Command,
        dt: f64,
        out: &mut [Wrench],
        sums: &mut Sums,
    ) {
        let res = &self.train.resistance;
        for (i, unit) in self.drives.iter_mut().enumerate() {
            let d = unit.spec;
            let body = &bodies[d.body];
            let wheels = body.point(&d.contact);
            let f = rail.track(&wheels, &mut unit.cursor);
            // The wheels press on the web from both sides, so they touch it where it is and not on the body's axis,
            // which is a chord of the bend; their height is that of the body.
            let at = f.p + f.u * (wheels - f.p).dot(&f.u);
            // Speed of the body at the left and the right wheel, and at the shoe, for velocities.
            let speeds = |v: &[Vector3<f64>; 2]| {
                let (along, turning) = (body.change(v, &at).dot(&f.t), v[1].dot(&f.u));
                [-1.0, 1.0, 0.0].map(|left| along + left * turning * self.web_half)
            };
            let v = speeds(&[body.v, body.w]);
            let gained = speeds(&body.gained);
            unit.chainage_m = f.s + 0.5 * dt * v[2];

            let omega = 0.5 * (unit.wheels[0].expected() + unit.wheels[1].expected());
            let asked = command.motor_torque_nm.get(i).copied().unwrap_or(0.0);
            let motor = unit.motor.step(&d, asked, omega, dt);
            let friction_wheel = d.friction_wheel();
            unit.shaft = motor;
            let gear = [
                wheel_torque(&d, motor, omega),
                wheel_damping(&d, motor, omega),
            ];
            unit.torques[0] = gear;
            let pressure = unit.clamp.step(
                command.clamp_pressure_mpa.min(self.clamp_limit_mpa),
                d.clamp_lag_s,
                dt,
            );
            let clamp = pressure * 1e6 * d.piston_area_m2;
            unit.adhesion = adhesion::at(&self.zones, unit.cursor.s, d.adhesion);

            let r = d.wheel_radius_m;
            let mut along = 0.0;
            for (side, wheel) in unit.wheels.iter_mut().enumerate() {
                let rate = wheel.expected();
                let rolling = [
                    resistance::clamped_wheel(res, clamp, r, rate),
                    resistance::clamped_damping(res, clamp, r, rate),
                ];
                unit.torques[1 + side] = rolling;
                let torque = [0.5 * gear[0] - rolling[0], 0.5 * gear[1] + rolling[1]];
                let limit = unit.adhesion * clamp;
                let under = [v[side], gained[side]];
                along += wheel.begin(&friction_wheel, limit, torque, under, dt);
            }

            let limit = unit
                .brake
                .step(command.brake * d.brake_max_n, d.brake_lag_s, dt);
            let limit = if command.brake <= 0.0 && limit < 1e-6 {
                0.0
            } else {
                limit
            };
            along += unit
                .shoes
                .begin(&d.shoe(), limit, [0.0; 2], [v[2], gained[2]], dt);

            // The clamped pair resists roll up to what its clamp force carries.
            let roll = body.r.column(1).dot(&f.u);
            let roll_rate = body.w.dot(&f.t);
            let most = clamp * WHEEL_HALF_WIDTH_M;
            let moment =
                (-CLAMP_ROLL_STIFFNESS * roll - CLAMP_ROLL_DAMPING * roll_rate).clamp(-most, most);
            sums.loss_w += CLAMP_ROLL_DAMPING * roll_rate * roll_rate;

            (unit.at, unit.tangent) = (at, f.t);
            out[d.body].add(body, &(f.t * along), &at);
            out[d.body].torque += f.t * moment;
        }
    }
}

impl DriveUnit {
    /// Ends a step of `dt` (s): the body's speed at the wheels has changed by `more` (m/s) than expected. Returns what
    /// the force on it changes by, N.
    fn end(&mut self, more: &Vector3<f64>, dt: f64, sums: &mut Sums) -> Vector3<f64> {
        let (d, more) = (self.spec, more.dot(&self.tangent));
        let r = d.wheel_radius_m;
        let expected = self.shoes.force + self.traction_n();
        let (mut turned, mut more_turning) = (0.0, 0.0);
        for (side, wheel) in self.wheels.iter_mut().enumerate() {
            wheel.end(&d.friction_wheel(), more, dt);
            let [rolling, damping] = self.torques[1 + side];
            let rolling = rolling + damping * wheel.more;
            more_turning += 0.5 * wheel.more;
            let rate = wheel.omega - 0.5 * wheel.gained;
            self.angles[side] += dt * rate;
            turned += 0.5 * rate;
            sums.loss_w += wheel.loss + rolling * rate;
            sums.resistance_n += rolling / r;
            sums.balance.clamped_rolling_n -= rolling / r;
        }
        let torque = self.torques[0][0] - self.torques[0][1] * more_turning;
        sums.balance.drive_n += torque / r;
        let power = self.shaft * d.gear_ratio * turned;
        sums.drive_w += power;
        sums.loss_w += power - torque * turned;
        let brake = self.shoes.end(&d.shoe(), more, dt);
        sums.loss_w += self.shoes.loss;
        sums.brake_n += brake;
        sums.traction_n += self.traction_n();
        self.tangent * (self.traction_n() + brake - expected)
    }

    /// Friction force of both wheels on the train along the rail, N.
    pub(crate) fn traction_n(&self) -> f64 {
        self.wheels[0].force + self.wheels[1].force
    }
}

impl Drive {
    /// Bristles of one of the two friction wheels of a drive, with half of the motor.
    fn friction_wheel(&self) -> Bristle {
        Bristle {
            sigma0: self.sigma0,
            sigma1: self.sigma1,
            kappa: self.kappa,
            radius: self.wheel_radius_m,
            inertia: self.turning_inertia(),
        }
    }

    /// Bristles of the brake shoes: the limit is the brake's force.
    fn shoe(&self) -> Bristle {
        Bristle {
            sigma0: self.sigma0,
            sigma1: SHOE_SIGMA1,
            kappa: 0.0,
            radius: 0.0,
            inertia: f64::INFINITY,
        }
    }
}
