//! The train in rapier, and the only file that knows rapier.
//!
//! rapier integrates the rigid bodies and handles collisions of cabs, beam and load with their surroundings. The forces
//! between wheels and rail come from [`Dynamics`], computed on the analytic rail; why wheels do not use the contact solver is
//! told in `docs/src/design.md`.

use crate::error::Error;
use crate::nearness::Fixed;
use crate::plant::{DriveState, MountState, Plant, Truth};
use crate::rail::{Cursor, Rail};
use crate::surroundings::Block;
use crate::train::adhesion::Zone;
use crate::train::body_state::{BodyState, Wrench};
use crate::train::dynamics::{Dynamics, Sums};
use crate::train::{Body, Geometry, Train};
use monorig_estimators::signals::Command;
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use rapier3d::prelude::{
    ColliderBuilder, ColliderHandle, FrictionModel, Group, InteractionGroups, InteractionTestMode,
    MassProperties, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, SharedShape,
};
use std::sync::Arc;

/// A station farther from the rail than this has left it, m (half an I140E flange).
const LOST: f64 = 0.034;
/// Before a run the train settles on its springs for at most this long, s, in steps of 1 ms with this much of each velocity kept.
const SETTLE_S: f64 = 20.0;
const SETTLE_KEEP: f64 = 0.995;
/// Speed below which it has settled, m/s.
const SETTLED: f64 = 1e-7;
/// For so many steps, so that a turning point of a swing is not taken for rest.
const SETTLED_STEPS: u32 = 500;
/// Collisions are computed while a part of the train could come within the margin of what it may touch before the next look.
/// Looks are `LOOK_S` apart or farther, as far as distances up to the reach allow.
const TOUCH_REACH: f64 = 0.3;
const TOUCH_MARGIN: f64 = 0.01;
const LOOK_S: f64 = 0.02;
/// Faster than anything along a rail, and than anything that hangs from it moves across it, m/s.
const FASTEST: f64 = 6.0;
const FASTEST_SWAY: f64 = 0.3;
/// Clearance beyond this is not looked for, m.
const CLEARANCE_REACH: f64 = 5.0;
/// Friction of steel and rock where parts touch.
const FRICTION: f64 = 0.4;
/// Pieces of rail given to the collision detection, m.
const RAIL_PIECE: f64 = 2.0;
/// Distance of the cross-sections of their mesh, m.
const RAIL_STEP: f64 = 0.5;

const TRAIN: Group = Group::GROUP_1;
const LOAD: Group = Group::GROUP_2;
const RAIL: Group = Group::GROUP_3;
const AROUND: Group = Group::GROUP_4;

/// How a world is built.
#[derive(Clone, Debug)]
pub struct WorldOptions {
    /// Chainage of the train's front, m.
    pub front_m: f64,
    /// Speed at the start, m/s.
    pub speed_mps: f64,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
    /// Index of the mount that carries the IMU (`Train::mounts`).
    pub imu: usize,
    /// Indices of all mounts whose motion sensors read; the others in `Truth::mounts` stay as they were at the start.
    pub mounts: Vec<usize>,
    /// Slippery stretches.
    pub zones: Vec<Zone>,
    /// Obstacles and walls.
    pub blocks: Vec<Block>,
}

/// The train in rapier.
pub struct World {
    rail: Arc<Rail>,
    dynamics: Dynamics,
    physics: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    parts: Vec<Part>,
    rail_hull: Fixed,
    blocks: Fixed,
    touchable: bool,
    next_look_s: f64,
    states: Vec<BodyState>,
    wrenches: Vec<Wrench>,
    truth: Truth,
    sums: Sums,
    imu: (usize, Cursor),
    sway: Option<Sway>,
    mounts: Vec<usize>,
    drive_work_j: f64,
    lost_j: f64,
    rail_impulse: Vector3<f64>,
    time: Clock,
}

/// A part of the train that can touch something.
struct Part {
    body: usize,
    pose: Pose,
    shape: SharedShape,
    collider: ColliderHandle,
    hung: bool,
}

/// The load below the middle of the upper anchors of its chains.
#[derive(Clone, Copy, Debug)]
struct Sway {
    load: usize,
    above: usize,
    anchor: Vector3<f64>,
}

impl Sway {
    fn of(train: &Train) -> Option<Self> {
        let load = train.load?;
        let above = *train.supports(load).first()?;
        let anchors: Vec<Vector3<f64>> = train
            .connections
            .iter()
            .filter_map(|c| match () {
                () if c.a == load && c.b == above => Some(c.anchor_b),
                () if c.b == load && c.a == above => Some(c.anchor_a),
                () => None,
            })
            .collect();
        Some(Self {
            load,
            above,
            anchor: anchors.iter().sum::<Vector3<f64>>() / anchors.len() as f64,
        })
    }
}

/// Time as a count of whole nanoseconds, so that a day of steps does not drift.
#[derive(Clone, Copy, Debug, Default)]
struct Clock(i64);

impl Clock {
    fn advance(&mut self, dt: f64) -> f64 {
        self.0 += libm::round(dt * 1e9) as i64;
        self.0 as f64 * 1e-9
    }
}

fn to_rapier(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

fn from_rapier(v: Vector) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

fn pose_to_rapier(iso: &Isometry3<f64>) -> Pose {
    let q = iso.rotation.quaternion();
    Pose {
        translation: to_rapier(&iso.translation.vector),
        rotation: Rotation::from_xyzw(q.i, q.j, q.k, q.w),
    }
}

fn mass_properties(b: &Body) -> MassProperties {
    let m = &b.inertia;
    let columns = [m.column(0), m.column(1), m.column(2)].map(|c| Vector::new(c[0], c[1], c[2]));
    MassProperties::with_inertia_matrix(
        to_rapier(&b.com),
        b.mass_kg,
        Matrix::from_cols(columns[0], columns[1], columns[2]),
    )
}

fn shared_shape(g: &Geometry) -> Option<(SharedShape, Pose)> {
    Some(match g {
        Geometry::Box(size) => (
            SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0),
            Pose::IDENTITY,
        ),
        // parry's cylinders stand along y, ours along z
        Geometry::Cylinder(r, l) => (
            SharedShape::cylinder(l / 2.0, *r),
            Pose {
                translation: Vector::ZERO,
                rotation: Rotation::from_axis_angle(Vector::X, std::f64::consts::FRAC_PI_2),
            },
        ),
        Geometry::Sphere(r) => (SharedShape::ball(*r), Pose::IDENTITY),
        Geometry::Mesh { vertices, .. } => {
            let points: Vec<Vector> = vertices
                .iter()
                .map(|v| Vector::new(v[0], v[1], v[2]))
                .collect();
            (SharedShape::convex_hull(&points)?, Pose::IDENTITY)
        }
    })
}

impl World {
    /// Put a train on a rail and let it settle.
    pub fn new(train: Train, rail: Arc<Rail>, options: &WorldOptions) -> Result<Self, Error> {
        let mut physics = PhysicsWorld::default();
        physics.gravity = Vector::new(0.0, 0.0, -options.gravity_mps2);
        let p = &mut physics.integration_parameters;
        p.num_solver_iterations = 1;
        p.max_ccd_substeps = 0;
        p.contact_recycling = false;
        p.friction_model = FrictionModel::Coulomb;

        let (rail_hull, blocks) = insert_surroundings(&mut physics, &rail, &options.blocks);
        let mut handles = Vec::new();
        let mut parts = Vec::new();
        for (i, b) in train.bodies.iter().enumerate() {
            let f = rail.frame(options.front_m + b.start_s);
            let x_wr = Isometry3::from_parts(
                Translation3::from(f.p),
                UnitQuaternion::from_matrix(&Matrix3::from_columns(&[f.t, f.l, f.u])),
            );
            let body = RigidBodyBuilder::dynamic()
                .pose(pose_to_rapier(&(x_wr * b.start_pose)))
                .additional_mass_properties(mass_properties(b))
                .can_sleep(false)
                .gyroscopic_forces_enabled(true);
            let handle = physics.bodies.insert(body);
            for shape in b.shapes.iter().filter(|s| s.collides) {
                let own = if Some(i) == train.load { LOAD } else { TRAIN };
                // What runs on the rail would collide with it for ever; what hangs below may touch it.
                let with = if b.stations.is_empty() {
                    AROUND | RAIL
                } else {
                    AROUND
                };
                let Some((s, turn)) = shared_shape(&shape.geometry) else {
                    continue;
                };
                let pose = pose_to_rapier(&shape.pose) * turn;
                let collider = ColliderBuilder::new(s.clone())
                    .position(pose)
                    .density(0.0)
                    .friction(FRICTION)
                    .collision_groups(groups(own, with))
                    .enabled(false);
                let collider =
                    physics
                        .colliders
                        .insert_with_parent(collider, handle, &mut physics.bodies);
                parts.push(Part {
                    body: i,
                    pose,
                    shape: s,
                    collider,
                    hung: b.stations.is_empty(),
                });
            }
            handles.push(handle);
        }
        // Masses and centres of mass read 0 until the first step.
        physics.integration_parameters.dt = 0.0;
        physics.step();

        let mut dynamics = Dynamics::new(train, &rail, options.front_m, options.gravity_mps2);
        dynamics.zones.clone_from(&options.zones);
        let n = handles.len();
        let imu_start = options.front_m
            + dynamics.train.bodies[dynamics.train.mounts[options.imu].body].start_s;
        let mut world = Self {
            sway: Sway::of(&dynamics.train),
            imu: (options.imu, Cursor::at(imu_start)),
            rail,
            physics,
            handles,
            parts,
            rail_hull,
            blocks,
            touchable: false,
            next_look_s: 0.0,
            states: Vec::with_capacity(n),
            wrenches: vec![Wrench::ZERO; n],
            truth: Truth::default(),
            sums: Sums::default(),
            mounts: options.mounts.clone(),
            dynamics,
            drive_work_j: 0.0,
            lost_j: 0.0,
            rail_impulse: Vector3::zeros(),
            time: Clock::default(),
        };
        world.read_states();
        world.settle(options.speed_mps)?;
        Ok(world)
    }

    /// Let the springs take the weight with brakes on, then give every body its speed.
    fn settle(&mut self, speed: f64) -> Result<(), Error> {
        let dt = 1e-3;
        let command = Command {
            brake: 1.0,
            clamp_pressure_mpa: self
                .dynamics
                .drives
                .iter()
                .map(|d| d.spec.clamp_mpa)
                .fold(0.0, f64::max),
            ..Default::default()
        };
        for u in &mut self.dynamics.drives {
            u.brake.value = u.spec.brake_max_n;
        }
        let mut quiet = 0;
        for _ in 0..(SETTLE_S / dt) as usize {
            self.advance(&command, dt);
            let mut fastest: f64 = 0.0;
            for h in &self.handles {
                let b = &mut self.physics.bodies[*h];
                let (v, w) = (b.linvel() * SETTLE_KEEP, b.angvel() * SETTLE_KEEP);
                fastest = fastest.max(v.length());
                b.set_linvel(v, false);
                b.set_angvel(w, false);
            }
            self.read_states();
            quiet = if fastest < SETTLED { quiet + 1 } else { 0 };
            if quiet > SETTLED_STEPS {
                break;
            }
        }
        self.drive_work_j = 0.0;
        self.lost_j = 0.0;
        self.rail_impulse = Vector3::zeros();
        if speed != 0.0 {
            for (h, s) in self.handles.iter().zip(&self.states) {
                // A body at its place on the rail moves along the tangent there.
                let t = self
                    .rail
                    .frame(self.rail.project(&s.p, &mut self.imu.1.clone()))
                    .t;
                self.physics.bodies[*h].set_linvel(to_rapier(&(t * speed)), false);
            }
            for u in &mut self.dynamics.drives {
                u.brake.value = 0.0;
                u.shoes = Default::default();
                for w in &mut u.wheels {
                    w.omega = speed / u.spec.wheel_radius_m;
                }
            }
            self.read_states();
        }
        self.time = Clock::default();
        self.truth = Truth {
            mounts: vec![
                MountState {
                    v_w: Vector3::zeros(),
                    q_wm: UnitQuaternion::identity(),
                    w_w: Vector3::zeros()
                };
                self.dynamics.train.mounts.len()
            ],
            drives: vec![DriveState::default(); self.dynamics.drives.len()],
            poses: vec![(Vector3::zeros(), UnitQuaternion::identity()); self.handles.len()],
            clearance_m: f64::INFINITY,
            ..Default::default()
        };
        self.update_truth(0.0);
        self.truth.accel_mps2 = 0.0;
        self.check()
    }

    /// One step of forces and rapier.
    fn advance(&mut self, command: &Command, dt: f64) {
        self.sums = self
            .dynamics
            .forces(&self.rail, &self.states, command, dt, &mut self.wrenches);
        for (h, w) in self.handles.iter().zip(&self.wrenches) {
            let b = &mut self.physics.bodies[*h];
            b.reset_forces(false);
            b.reset_torques(false);
            b.add_force(to_rapier(&w.force), false);
            b.add_torque(to_rapier(&w.torque), false);
        }
        self.watch_for_touch();
        self.physics.integration_parameters.dt = dt;
        self.physics.step();
    }

    /// A part where it is now.
    fn posed<'a>(&self, part: &'a Part) -> (Pose, &'a SharedShape) {
        (
            *self.physics.bodies[self.handles[part.body]].position() * part.pose,
            &part.shape,
        )
    }

    /// Wake the colliders when something could touch before the next look, let them sleep otherwise.
    fn watch_for_touch(&mut self) {
        if self.truth.t_s < self.next_look_s {
            return;
        }
        let (mut to_blocks, mut to_rail) = (TOUCH_REACH, TOUCH_REACH);
        for part in &self.parts {
            let (pose, shape) = self.posed(part);
            to_blocks = self.blocks.distance(&pose, shape, to_blocks);
            if part.hung {
                to_rail = self.rail_hull.distance(&pose, shape, to_rail);
            }
        }
        let wait = f64::min(
            (to_blocks - TOUCH_MARGIN) / FASTEST,
            (to_rail - TOUCH_MARGIN) / FASTEST_SWAY,
        );
        self.next_look_s = self.truth.t_s + wait.max(LOOK_S);
        let touchable = wait <= LOOK_S;
        if touchable != self.touchable {
            self.touchable = touchable;
            for part in &self.parts {
                if let Some(c) = self.physics.colliders.get_mut(part.collider) {
                    c.set_enabled(touchable);
                }
            }
        }
    }

    fn read_states(&mut self) {
        self.states.clear();
        for h in &self.handles {
            let b = &self.physics.bodies[*h];
            let pose = b.position();
            let q = pose.rotation;
            let m = Matrix::from_quat(q);
            self.states.push(BodyState {
                p: from_rapier(pose.translation),
                q: UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z)),
                r: Matrix3::from_columns(&[
                    from_rapier(m.x_axis),
                    from_rapier(m.y_axis),
                    from_rapier(m.z_axis),
                ]),
                c: from_rapier(b.center_of_mass()),
                v: from_rapier(b.linvel()),
                w: from_rapier(b.angvel()),
            });
        }
    }

    fn update_truth(&mut self, dt: f64) {
        let t = &mut self.truth;
        let train = &self.dynamics.train;
        for &i in &self.mounts {
            let m = &train.mounts[i];
            let s = &self.states[m.body];
            let at = s.point(&m.pose.translation.vector);
            t.mounts[i] = MountState {
                v_w: s.velocity(&at),
                q_wm: s.q * m.pose.rotation,
                w_w: s.w,
            };
        }
        let m = &train.mounts[self.imu.0];
        let s = &self.states[m.body];
        let at = s.point(&m.pose.translation.vector);
        let f = self.rail.track(&at, &mut self.imu.1);
        let speed = s.velocity(&at).dot(&f.t);
        if dt > 0.0 {
            t.accel_mps2 = (speed - t.speed_mps) / dt;
        }
        t.speed_mps = speed;
        t.chainage_m = f.s;
        t.grade_at_imu_rad = libm::asin(f.t.z.clamp(-1.0, 1.0));
        t.pitch_at_imu_rad = libm::asin(s.r[(2, 0)].clamp(-1.0, 1.0));
        t.curvature_vertical_1pm = f.k.dot(&f.u);
        let cos = libm::sqrt((1.0 - f.t.z * f.t.z).max(1e-12));
        t.curvature_horizontal_1pm = f.k.dot(&f.l) / cos;

        let sums = &self.sums;
        t.total_mass_kg = train.total_mass_kg();
        t.load_mass_kg = train.load_mass_kg();
        t.grade_effective_rad = libm::asin((sums.mass_sin / t.total_mass_kg).clamp(-1.0, 1.0));
        t.traction_n = sums.traction_n;
        t.resistance_n = sums.resistance_n;
        t.brake_n = sums.brake_n;
        t.running_resistance = if sums.normal_n > 0.0 {
            sums.resistance_n / sums.normal_n
        } else {
            0.0
        };
        t.off_rail_m = sums.off_rail_m;
        if let Some(sway) = &self.sway {
            let d = self.states[sway.load].c - self.states[sway.above].point(&sway.anchor);
            let ahead = self.states[sway.above].r.column(0).into_owned();
            let flat = Vector3::new(ahead.x, ahead.y, 0.0);
            let flat = flat / flat.norm().max(1e-9);
            let left = Vector3::new(-flat.y, flat.x, 0.0);
            t.sway_rad = [
                libm::atan2(d.dot(&flat), -d.z),
                libm::atan2(d.dot(&left), -d.z),
            ];
        }
        for (i, (out, u)) in t.drives.iter_mut().zip(&self.dynamics.drives).enumerate() {
            let r = u.spec.wheel_radius_m;
            let slip = u.wheels.map(|w| w.omega * r - u.v_t);
            *out = DriveState {
                chainage_m: self.dynamics.drive_chainage(i),
                motor_torque_nm: u.motor.torque(),
                wheel_rate_radps: u.wheels.map(|w| w.omega),
                wheel_angle_rad: u.angles,
                traction_n: u.wheels[0].force + u.wheels[1].force,
                slip_mps: if slip[0].abs() > slip[1].abs() {
                    slip[0]
                } else {
                    slip[1]
                },
                clamp_mpa: u.clamp.value,
                adhesion: u.adhesion,
            };
        }
        for (out, s) in t.poses.iter_mut().zip(&self.states) {
            *out = (s.p, s.q);
        }
    }

    /// Still on the rail, still finite?
    fn check(&self) -> Result<(), Error> {
        let off = self.sums.off_rail_m;
        let broken = |what: String| {
            Err(Error::Broken {
                t_s: self.truth.t_s,
                what,
            })
        };
        if !(self.truth.speed_mps.is_finite() && off.is_finite()) {
            return broken(
                "the motion is no longer finite: a stiffness is too high for the step".into(),
            );
        }
        if off > LOST {
            return broken(format!("a wheel is {:.0} mm off the rail", off * 1e3));
        }
        Ok(())
    }

    /// The force laws and their states.
    pub fn dynamics(&self) -> &Dynamics {
        &self.dynamics
    }

    /// The same, to change (adhesion zones, clamp faults).
    pub fn dynamics_mut(&mut self) -> &mut Dynamics {
        &mut self.dynamics
    }

    /// Motion of every body.
    pub fn bodies(&self) -> &[BodyState] {
        &self.states
    }

    /// Sums of the last step.
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    /// Impulse of the rail on the train since the start, N·s, world.
    pub fn rail_impulse(&self) -> Vector3<f64> {
        self.rail_impulse
    }

    /// Energy now, J: kinetic and potential of the bodies, springs, bristles and turning masses.
    pub fn energy(&self) -> f64 {
        let mut e = self.dynamics.stored_energy(&self.rail, &self.states);
        for (s, b) in self.states.iter().zip(&self.dynamics.train.bodies) {
            let w = s.r.transpose() * s.w;
            e += b.mass_kg * (0.5 * s.v.norm_squared() + self.dynamics.gravity * s.c.z)
                + 0.5 * w.dot(&(b.inertia * w));
        }
        e
    }

    /// Work of the motors, and energy lost, J, since the start.
    pub fn work(&self) -> (f64, f64) {
        (self.drive_work_j, self.lost_j)
    }

    /// Give a body a velocity by hand (tests).
    pub fn set_velocity(&mut self, body: usize, v: Vector3<f64>) {
        self.physics.bodies[self.handles[body]].set_linvel(to_rapier(&v), false);
        self.read_states();
    }
}

impl Plant for World {
    fn step(&mut self, command: &Command, dt_s: f64) -> Result<(), Error> {
        self.advance(command, dt_s);
        self.read_states();
        self.drive_work_j += self.sums.drive_w * dt_s;
        self.lost_j += self.sums.loss_w * dt_s;
        self.rail_impulse += self.sums.external * dt_s;
        self.truth.t_s = self.time.advance(dt_s);
        self.update_truth(dt_s);
        self.check()
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    fn set_load_mass(&mut self, mass_kg: f64) {
        let train = &mut self.dynamics.train;
        let (Some(i), Some(payload)) = (train.load, &mut train.payload) else {
            return;
        };
        payload.mass_kg = mass_kg;
        let now = payload.body_with(mass_kg);
        let body = &mut train.bodies[i];
        (body.mass_kg, body.com, body.inertia) = (now.mass_kg, now.com, now.inertia);
        self.physics.bodies[self.handles[i]]
            .set_additional_mass_properties(mass_properties(body), false);
        self.dynamics.distribute_masses();
    }

    fn set_clamp_limit(&mut self, mpa: f64) {
        self.dynamics.clamp_limit_mpa = mpa;
    }

    fn look_around(&mut self) {
        if self.blocks.is_empty() {
            return;
        }
        let mut least = CLEARANCE_REACH;
        for part in &self.parts {
            let (pose, shape) = self.posed(part);
            least = self.blocks.distance(&pose, shape, least);
        }
        self.truth.clearance_m = if least < CLEARANCE_REACH {
            least
        } else {
            f64::INFINITY
        };
    }
}

fn groups(of: Group, with: Group) -> InteractionGroups {
    InteractionGroups::new(of, with, InteractionTestMode::And)
}

/// The rail as a fixed body of mesh pieces, obstacles and walls as boxes; the same shapes for questions of distance.
fn insert_surroundings(
    physics: &mut PhysicsWorld,
    rail: &Rail,
    blocks: &[Block],
) -> (Fixed, Fixed) {
    let fixed = physics.bodies.insert(RigidBodyBuilder::fixed());
    let mut insert = |pose: Pose, shape: &SharedShape, of: Group| {
        let collider = ColliderBuilder::new(shape.clone())
            .position(pose)
            .friction(FRICTION)
            .collision_groups(groups(of, TRAIN | LOAD));
        physics
            .colliders
            .insert_with_parent(collider, fixed, &mut physics.bodies);
    };
    for piece in rail.mesh(RAIL_STEP, RAIL_PIECE) {
        let points = piece
            .vertices
            .iter()
            .map(|v| Vector::new(v[0], v[1], v[2]))
            .collect();
        if let Ok(shape) = SharedShape::trimesh(points, piece.triangles) {
            insert(Pose::IDENTITY, &shape, RAIL);
        }
    }
    let mut boxes = Vec::new();
    for b in blocks {
        let shape = SharedShape::cuboid(b.size.x / 2.0, b.size.y / 2.0, b.size.z / 2.0);
        let pose = pose_to_rapier(&b.pose);
        insert(pose, &shape, AROUND);
        boxes.push((pose, shape));
    }
    // Distances to the rail are asked of boxes around it: cheap, and some millimetres too near in the tightest curves.
    let size = rail.profile().bounding_box();
    let frames = rail.samples(RAIL_STEP);
    let hull = frames.windows(2).map(|w| {
        let middle = Block::between(&w[0], &w[1], size);
        let half = middle.size / 2.0;
        (
            pose_to_rapier(&middle.pose),
            SharedShape::cuboid(half.x, half.y, half.z),
        )
    });
    (Fixed::new(hull.collect()), Fixed::new(boxes))
}
