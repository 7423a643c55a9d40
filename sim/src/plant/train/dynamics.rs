//! All forces between train and rail and inside the train. Knows no physics engine: body states in, wrenches out.

use super::adhesion::{self, AdhesionZone};
use super::balance::{Directions, ForceBalance};
use super::body_state::{BodyState, Wrench};
use super::friction::{Bristle, RollingContact, SlidingContact, WheelParameters};
use super::motor::{Lag, TractionMotor, wheel_torque};
use super::running_gear::grip;
use super::{coupling, resistance};
use crate::rail::{Cursor, Rail, RailFrame};
use crate::train::{Drive, Train};
use monorig_estimators::api::signals::Command;
use nalgebra::Vector3;

/// Half the width of a friction wheel's face: the clamped pair resists roll with at most clamp force × this, m.
const WHEEL_HALF_WIDTH_M: f64 = 0.03;
/// Roll stiffness of a clamped pair, N·m/rad, and its damping, N·m·s/rad.
pub(super) const CLAMP_ROLL_STIFFNESS: f64 = 2.0e4;
const CLAMP_ROLL_DAMPING: f64 = 2.0e2;
/// Friction of the brake shoes on the rail; only scales the bristles, the limit is the brake's force.
const SHOE_SIGMA1: f64 = 2.0e4;

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
    pub wheels: [RollingContact; 2],
    /// Angles of the wheels, rad.
    pub angles: [f64; 2],
    /// Brake shoes.
    pub shoes: SlidingContact,
    /// Adhesion under the wheels.
    pub adhesion: f64,
    /// Speed of the body along the rail at the wheels, m/s, before the last step.
    pub v_t: f64,
    /// Point at which the wheels touch the web, and the rail there, before the last step.
    pub(super) contact: (Vector3<f64>, RailFrame),
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
    pub(super) rolling: Vec<SlidingContact>,
    /// Mass that each body brings onto the rail, kg: its own and its share of what hangs from it; 0 for suspended
    /// bodies.
    carried: Vec<f64>,
    /// Directions of the rail at the bodies.
    directions: Directions,
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
                wheels: [RollingContact::default(); 2],
                angles: [0.0; 2],
                shoes: SlidingContact::default(),
                adhesion: d.adhesion,
                v_t: 0.0,
                contact: (Vector3::zeros(), rail.frame(front)),
            })
            .collect();
        let web_half = rail.profile().map_or(0.0, |p| p.web_m) / 2.0;
        let mut this = Self {
            train,
            drives,
            zones: Vec::new(),
            clamp_limit_mpa: f64::INFINITY,
            gravity,
            rolling: vec![SlidingContact::default(); cursors.len()],
            cursors,
            carried: Vec::new(),
            directions: Directions::default(),
            web_half,
        };
        this.distribute_masses();
        this.directions = Directions::new(this.train.bodies.len(), this.train.suspended_bodies());
        this
    }

    /// Distributes each suspended body's mass over the bodies that carry it, down to the rail.
    pub fn distribute_masses(&mut self) {
        let n = self.train.bodies.len();
        let mut mass: Vec<f64> = self.train.bodies.iter().map(|b| b.mass_kg).collect();
        // A chain of suspended bodies is at most as long as the list of bodies.
        for _ in 0..n {
            let mut moved = false;
            for i in 0..n {
                if mass[i] == 0.0 || !self.train.bodies[i].stations.is_empty() {
                    continue;
                }
                let above: Vec<usize> = self.train.supports(i);
                if above.is_empty() {
                    continue;
                }
                let share = mass[i] / above.len() as f64;
                mass[i] = 0.0;
                for a in above {
                    mass[a] += share;
                }
                moved = true;
            }
            if !moved {
                break;
            }
        }
        self.carried = mass;
    }

    /// Advance the internal states by `dt` and compute the wrench on every body (gravity excluded).
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
        for c in &self.train.connections {
            let p = coupling::pull(c, &bodies[c.a], &bodies[c.b]);
            out[c.a].add(&bodies[c.a], &p.force, &p.at_a);
            out[c.b].add(&bodies[c.b], &-p.force, &p.at_b);
            sums.loss_w += p.loss;
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
                let g = grip(st, body, &at, &f);
                let [by_running, by_guides] = resistance::rolling(res, &g);
                let limit = by_running + by_guides;
                let held = rolling.step(&resistance::ROLLING, limit, g.v_t, dt);
                let mut against = 0.0;
                if k == 0 {
                    let bearing = resistance::bearing(res, g.v_t);
                    against += bearing;
                    sums.balance.bearing_n -= bearing;
                }
                if air_v.is_none() {
                    air_v = Some(g.v_t);
                    let air = resistance::air(res, g.v_t);
                    against += air;
                    sums.balance.air_n -= air;
                }
                if limit > 0.0 {
                    sums.balance.running_rolling_n += held * by_running / limit;
                    sums.balance.guide_rolling_n += held * by_guides / limit;
                }
                let force = g.force + f.t * (held - against);
                out[i].add(body, &force, &at);
                out[i].torque += f.t * g.roll;
                sums.resistance_n += against - held;
                sums.loss_w += g.loss + against * g.v_t + rolling.loss;
                sums.wheel_load_n += g.wheel_load;
                sums.off_rail_m = sums.off_rail_m.max(g.off[0].abs()).max(g.off[1].abs());
                tangents += f.t;
                sines += rail.sine_without_steps(&f);
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
            let v_t = body.velocity(&at).dot(&f.t);
            let turning = body.w.dot(&f.u) * self.web_half;
            unit.v_t = v_t;
            unit.contact = (at, f);

            let omega = 0.5 * (unit.wheels[0].omega + unit.wheels[1].omega);
            let asked = command.motor_torque_nm.get(i).copied().unwrap_or(0.0);
            let motor = unit.motor.step(&d, asked, omega, dt);
            let torque = wheel_torque(&d, motor, omega);
            let pressure = unit.clamp.step(
                command.clamp_pressure_mpa.min(self.clamp_limit_mpa),
                d.clamp_lag_s,
                dt,
            );
            let clamp = pressure * 1e6 * d.piston_area_m2;
            unit.adhesion = adhesion::at(&self.zones, unit.cursor.s, d.adhesion);

            let friction_wheel = d.friction_wheel();
            let r = d.wheel_radius_m;
            let mut along = 0.0;
            for (side, wheel) in unit.wheels.iter_mut().enumerate() {
                let v_side = if side == 0 {
                    v_t - turning
                } else {
                    v_t + turning
                };
                let rolling = resistance::clamped_wheel(res, clamp, r, wheel.omega);
                let before = wheel.omega;
                let limit = unit.adhesion * clamp;
                along += wheel.step(&friction_wheel, limit, 0.5 * torque - rolling, v_side, dt);
                let mean = 0.5 * (before + wheel.omega);
                unit.angles[side] += dt * wheel.omega;
                sums.loss_w += wheel.loss + rolling * mean;
                sums.resistance_n += rolling / r;
                sums.balance.clamped_rolling_n -= rolling / r;
            }
            sums.balance.drive_n += torque / r;
            let rate = 0.5 * (unit.wheels[0].omega + unit.wheels[1].omega);
            let power = motor * d.gear_ratio * 0.5 * (omega + rate);
            sums.drive_w += power;
            sums.loss_w += power - torque * 0.5 * (omega + rate);
            sums.traction_n += along;

            let limit = unit
                .brake
                .step(command.brake * d.brake_max_n, d.brake_lag_s, dt);
            let shoe = Bristle {
                sigma0: d.sigma0,
                sigma1: SHOE_SIGMA1,
                kappa: 0.0,
            };
            let limit = if command.brake <= 0.0 && limit < 1.0 {
                0.0
            } else {
                limit
            };
            let brake = unit.shoes.step(&shoe, limit, v_t, dt);
            sums.loss_w += unit.shoes.loss;
            sums.brake_n += brake;

            // The clamped pair resists roll up to what its clamp force carries.
            let roll = body.r.column(1).dot(&f.u);
            let roll_rate = body.w.dot(&f.t);
            let most = clamp * WHEEL_HALF_WIDTH_M;
            let moment =
                (-CLAMP_ROLL_STIFFNESS * roll - CLAMP_ROLL_DAMPING * roll_rate).clamp(-most, most);
            sums.loss_w += CLAMP_ROLL_DAMPING * roll_rate * roll_rate;

            out[d.body].add(body, &(f.t * (along + brake)), &at);
            out[d.body].torque += f.t * moment;
        }
    }

    /// Chainage of the friction wheels of drive `i`, m.
    pub fn drive_chainage(&self, i: usize) -> f64 {
        self.drives[i].cursor.s
    }
}

impl Drive {
    /// Parameters of one of the two friction wheels of a drive, with half of the motor.
    pub(super) fn friction_wheel(&self) -> WheelParameters {
        WheelParameters {
            bristle: Bristle {
                sigma0: self.sigma0,
                sigma1: self.sigma1,
                kappa: self.kappa,
            },
            inertia: self.wheel_inertia
                + 0.5 * self.gear_ratio * self.gear_ratio * self.motor_inertia,
            radius: self.wheel_radius_m,
        }
    }
}
