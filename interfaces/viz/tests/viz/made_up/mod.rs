//! A made-up run without physics, to measure and test recordings: 18 bodies on a winding rail, 150 channels.

use monorig_sim::rail::RailFrame;
use monorig_sim::record::{Channel, Chunk, Layout};
use monorig_sim::train::{
    Body, Connection, ConnectionKind, Drive, Geometry, Limits, Resistance, Shape, Train,
};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Channels every 20 ms.
const CHANNEL_NS: i64 = 20_000_000;
/// Poses every 40 ms.
const POSE_NS: i64 = 40_000_000;
/// m.
const RAIL_STEP: f64 = 0.25;
/// m/s.
const SPEED: f64 = 1.2;

pub struct Run {
    pub train: Train,
    pub channels: Vec<Channel>,
    pub rail: Vec<RailFrame>,
    pub profile: Vec<[f64; 2]>,
    pub obstacles: Vec<(Isometry3<f64>, Vector3<f64>)>,
}

impl Run {
    pub fn new(channels: usize) -> Self {
        let rail = rail(1800);
        let beside = &rail[160];
        let side = beside.p + beside.l * 1.6 - beside.u * 1.2;
        Self {
            train: train(),
            channels: names(channels),
            obstacles: vec![(pose(beside, &side), Vector3::new(2.0, 0.4, 2.4))],
            rail,
            profile: i_beam(0.155, 0.068, 0.0105, 0.007),
        }
    }

    pub fn layout(&self) -> Layout<'_> {
        Layout {
            scenario: "synthetic",
            seed: 1,
            why: "Made up, to measure and test recordings.",
            channels: &self.channels,
            train: &self.train,
            rail: &self.rail,
            profile: &self.profile,
            obstacles: &self.obstacles,
            zones: &[],
            emphasis: Default::default(),
        }
    }

    /// The rows from `from_s` to before `to_s`.
    pub fn chunk(&self, from_s: f64, to_s: f64) -> Chunk {
        let grid = |step: i64| -> Vec<i64> {
            let ns = |s: f64| (s * 1e9) as i64;
            (ns(from_s) / step..ns(to_s) / step)
                .map(|i| i * step)
                .collect()
        };
        let (time_ns, pose_time_ns) = (grid(CHANNEL_NS), grid(POSE_NS));
        let seconds: Vec<f64> = time_ns.iter().map(|&t| t as f64 * 1e-9).collect();
        let values = self.channels.iter().enumerate();
        let values = values.map(|(i, c)| seconds.iter().map(|&t| self.value(i, c, t)).collect());
        let pose_s: Vec<f64> = pose_time_ns.iter().map(|&t| t as f64 * 1e-9).collect();
        let bodies = self.train.bodies.iter();
        let poses = bodies.map(|b| pose_s.iter().map(|&t| self.body(b, t)).collect());
        let turn = |t: f64| {
            let angle = SPEED * t / 0.17;
            [angle, -angle]
        };
        let drives = self.train.drives.iter();
        Chunk {
            values: values.collect(),
            poses: poses.collect(),
            wheel_angles: drives
                .map(|_| pose_s.iter().map(|&t| turn(t)).collect())
                .collect(),
            events: vec![((from_s * 1e9) as i64, format!("chunk from {from_s} s"))],
            time_ns,
            pose_time_ns,
        }
    }

    fn frame(&self, s: f64) -> &RailFrame {
        &self.rail[((s / RAIL_STEP) as usize).min(self.rail.len() - 1)]
    }

    fn value(&self, i: usize, channel: &Channel, t: f64) -> f64 {
        let row = (t * 50.0).round() as u64;
        let noise = noise(i as u64, row);
        let grade = self.frame(25.0 + SPEED * t).t.z.asin();
        let speed = SPEED * (t / 3.0).min(1.0);
        let settle = (-t / 8.0).exp();
        match channel.path.as_str() {
            "truth/total_mass" => 29_000.0,
            "truth/grade_at_imu" => grade,
            "truth/pitch_at_imu" => grade + 0.004 * (t / 2.0).sin(),
            "truth/speed" => speed,
            "control/reference_speed" => SPEED,
            "truth/traction" => 9.81 * 29_000.0 * grade.sin() + 4000.0,
            "truth/resistance" => 4000.0,
            "truth/sway_longitudinal" => 0.03 * (1.7 * t).sin() * settle,
            "truth/sway_lateral" => 0.02 * (1.7 * t).cos(),
            "truth/clearance" => f64::INFINITY,
            p if p.starts_with("sensors/") && !row.is_multiple_of(1 + i as u64 % 3) => f64::NAN,
            p if p.ends_with("wheel_speed") => speed + 0.02 * noise,
            p if p.ends_with("/total_mass") => 29_000.0 + 3000.0 * settle + 5.0 * noise,
            p if p.ends_with("/total_mass_sd") => 1800.0 * settle + 150.0,
            p if p.ends_with("/grade") => grade + 0.02 * settle + 0.001 * noise,
            p if p.ends_with("/grade_sd") => 0.012 * settle + 0.003,
            p if p.ends_with("/speed") => speed + 0.005 * noise,
            p if p.ends_with("/speed_sd") => 0.01,
            _ => noise + i as f64 * 0.1,
        }
    }

    fn body(&self, body: &Body, t: f64) -> ([f64; 3], [f64; 4]) {
        let frame = self.frame(25.0 + SPEED * t + body.start_s);
        let swing = match self.train.bodies.len() - 1 {
            last if self.train.bodies[last].name == body.name => 0.03 * (1.7 * t).sin(),
            _ => 0.0,
        };
        let hang = Isometry3::rotation(Vector3::y() * swing);
        let along = pose(frame, &frame.p) * hang * body.start_pose;
        let q = along.rotation.coords;
        (along.translation.vector.into(), [q.x, q.y, q.z, q.w])
    }
}

fn noise(stream: u64, row: u64) -> f64 {
    2.0 * monorig_testing::Random::new((stream << 32) ^ row).unit() - 1.0
}

fn names(count: usize) -> Vec<Channel> {
    let mut all: Vec<(String, &'static str)> = vec![
        ("truth/total_mass".into(), "kg"),
        ("truth/grade_at_imu".into(), "rad"),
        ("truth/pitch_at_imu".into(), "rad"),
        ("truth/speed".into(), "m/s"),
        ("truth/traction".into(), "N"),
        ("truth/resistance".into(), "N"),
        ("truth/sway_longitudinal".into(), "rad"),
        ("truth/sway_lateral".into(), "rad"),
        ("truth/clearance".into(), "m"),
        ("control/reference_speed".into(), "m/s"),
    ];
    for axis in ["x", "y", "z"] {
        all.push((format!("sensors/imu/specific_force_{axis}"), "m/s²"));
        all.push((format!("sensors/imu/angular_rate_{axis}"), "rad/s"));
    }
    for e in ["dffrls_aekf_robust", "jekf"] {
        for (q, unit) in [("total_mass", "kg"), ("grade", "rad"), ("speed", "m/s")] {
            all.push((format!("estimates/{e}/{q}"), unit));
            all.push((format!("estimates/{e}/{q}_sd"), unit));
        }
        all.push((format!("estimates/{e}/nis"), "1"));
        all.push((format!("internals/{e}/lambda"), "1"));
    }
    for d in 1..=8 {
        all.push((format!("sensors/drive_{d}/wheel_speed"), "m/s"));
        all.push((format!("sensors/drive_{d}/motor_torque"), "N·m"));
        all.push((format!("truth/drive_{d}/slip"), "m/s"));
        all.push((format!("truth/drive_{d}/clamp_pressure"), "MPa"));
    }
    let more = (all.len()..).map(|i| (format!("internals/jekf/state_{i}"), "1"));
    let all: Vec<_> = all.clone().into_iter().chain(more).take(count).collect();
    all.into_iter()
        .map(|(path, unit)| Channel { path, unit })
        .collect()
}

/// Curves left and right, hills and dales.
fn rail(n: usize) -> Vec<RailFrame> {
    let mut p = Vector3::zeros();
    (0..n)
        .map(|i| {
            let s = i as f64 * RAIL_STEP;
            let heading = 0.9 * (s / 22.0).sin();
            let grade = 0.16 * (s / 17.0).sin();
            let t = Vector3::new(
                grade.cos() * heading.cos(),
                grade.cos() * heading.sin(),
                grade.sin(),
            );
            let l = Vector3::new(-heading.sin(), heading.cos(), 0.0);
            p += t * RAIL_STEP;
            RailFrame {
                s,
                p,
                t,
                l,
                u: t.cross(&l),
                k: Vector3::zeros(),
            }
        })
        .collect()
}

fn pose(frame: &RailFrame, at: &Vector3<f64>) -> Isometry3<f64> {
    let axes =
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[frame.t, frame.l, frame.u]));
    let rotation = UnitQuaternion::from_rotation_matrix(&axes);
    Isometry3::from_parts(Translation3::from(*at), rotation)
}

/// Outline of an I-beam, counter-clockwise in (l, u).
fn i_beam(height: f64, width: f64, flange: f64, web: f64) -> Vec<[f64; 2]> {
    let (h, w, i, b) = (height / 2.0, width / 2.0, height / 2.0 - flange, web / 2.0);
    let right = [[w, -h], [w, -i], [b, -i], [b, i], [w, i], [w, h]];
    let left = right.iter().rev().map(|[l, u]| [-l, *u]);
    right.iter().copied().chain(left).collect()
}

/// Cab, four drives, two trolleys with the beam, four drives, cab; frames, and the load.
fn train() -> Train {
    let grey = [0.25, 0.27, 0.30, 1.0];
    let mut bodies: Vec<Body> = Vec::new();
    let mut drives = Vec::new();
    let mut x = 0.0;
    for i in 0..8 {
        if i == 4 {
            x -= 4.2;
        }
        let drive = bodies.len();
        let wheel = |side: usize, y: f64| Shape {
            spins: Some((drives.len(), side)),
            ..shape(
                ["wheel_left", "wheel_right"][side],
                [0.0, y, 0.0],
                Geometry::Cylinder(0.17, 0.09),
                [0.03, 0.03, 0.035, 1.0],
            )
        };
        let runner = |x: f64, y: f64| Shape {
            pose: Isometry3::new(
                Vector3::new(x, y, -0.05),
                Vector3::x() * std::f64::consts::FRAC_PI_2,
            ),
            ..shape("runner", [0.0; 3], Geometry::Cylinder(0.0875, 0.05), grey)
        };
        let motor = [0.55, 0.08, 0.04, 1.0];
        let shapes = vec![
            shape(
                "frame",
                [0.0, 0.0, -0.28],
                Geometry::Box(Vector3::new(1.0, 0.56, 0.22)),
                [0.75, 0.42, 0.02, 1.0],
            ),
            shape(
                "motor",
                [0.0, 0.28, -0.30],
                Geometry::Box(Vector3::new(0.42, 0.30, 0.34)),
                motor,
            ),
            shape(
                "motor",
                [0.0, -0.28, -0.30],
                Geometry::Box(Vector3::new(0.42, 0.30, 0.34)),
                motor,
            ),
            wheel(0, 0.174),
            wheel(1, -0.174),
            runner(0.38, 0.055),
            runner(0.38, -0.055),
            runner(-0.38, 0.055),
            runner(-0.38, -0.055),
        ];
        bodies.push(body(&format!("drive_{}", i + 1), x, shapes));
        drives.push(a_drive(drive));
        x -= 1.35;
    }
    for (i, x) in [1.6, -12.7].into_iter().enumerate() {
        let green = [0.05, 0.35, 0.12, 1.0];
        let glass = [0.10, 0.25, 0.35, 1.0];
        let shapes = vec![
            shape(
                "cab",
                [0.0, 0.0, -0.95],
                Geometry::Box(Vector3::new(1.5, 0.9, 1.3)),
                green,
            ),
            shape(
                "window",
                [0.0, 0.0, -0.65],
                Geometry::Box(Vector3::new(1.52, 0.92, 0.4)),
                glass,
            ),
            shape(
                "hanger",
                [0.0, 0.0, -0.22],
                Geometry::Box(Vector3::new(0.5, 0.2, 0.2)),
                grey,
            ),
        ];
        bodies.push(body(&format!("cab_{}", i + 1), x, shapes));
    }
    for (i, x) in [-4.9, -5.7, -7.3, -8.1, -3.6].into_iter().enumerate() {
        let frame = Geometry::Box(Vector3::new(0.5, 0.3, 0.18));
        bodies.push(body(
            &format!("trolley_{}", i + 1),
            x,
            vec![shape("frame", [0.0, 0.0, -0.2], frame, grey)],
        ));
    }
    let steel = [0.10, 0.20, 0.45, 1.0];
    for (i, x) in [-5.4, -7.6].into_iter().enumerate() {
        let beam = Geometry::Box(Vector3::new(1.9, 0.24, 0.24));
        bodies.push(body(
            &format!("beam_{}", i + 1),
            x,
            vec![shape("beam", [0.0, 0.0, -0.5], beam, steel)],
        ));
    }
    let cargo = [0.35, 0.24, 0.12, 1.0];
    let load = Shape {
        pose: Isometry3::translation(0.0, 0.0, -1.7),
        ..shape(
            "load",
            [0.0; 3],
            Geometry::Box(Vector3::new(3.6, 1.1, 1.3)),
            cargo,
        )
    };
    bodies.push(body("load/cargo", -6.5, vec![load]));
    let last = bodies.len() - 1;
    let mut connections = Vec::new();
    for (beam, x) in [(last - 2, 1.5), (last - 1, -1.5)] {
        for y in [-0.4, 0.4] {
            connections.push(chain([beam, last], [0.0, y * 0.3, -0.6], [x, y, -1.05]));
        }
    }
    Train {
        name: "made up".into(),
        load: Some(last),
        bodies,
        connections,
        drives,
        mounts: vec![],
        limits: Limits {
            min_radius_horizontal_m: 4.0,
            min_radius_vertical_m: 10.0,
            max_grade_rad: 0.5,
            max_speed_mps: 2.4,
            length_m: 15.7,
            max_load_kg: 20_000.0,
        },
        resistance: Resistance {
            clamped_wheel: 0.0,
            running_wheel: 0.0,
            guide_wheel: 0.0,
            bearing_n: 0.0,
            bearing_nspm: 0.0,
            air_nspm2: 0.0,
        },
        ..Default::default()
    }
}

fn body(name: &str, start_s: f64, shapes: Vec<Shape>) -> Body {
    Body {
        name: name.into(),
        mass_kg: 800.0,
        com: Vector3::zeros(),
        inertia: Matrix3::identity(),
        start_s,
        start_pose: Isometry3::identity(),
        stations: vec![],
        shapes,
    }
}

fn shape(link: &str, at: [f64; 3], geometry: Geometry, rgba: [f32; 4]) -> Shape {
    Shape {
        link: link.into(),
        pose: Isometry3::translation(at[0], at[1], at[2]),
        geometry,
        rgba,
        collides: false,
        spins: None,
    }
}

fn chain([a, b]: [usize; 2], anchor_a: [f64; 3], anchor_b: [f64; 3]) -> Connection {
    Connection {
        kind: ConnectionKind::Chain,
        a,
        b,
        anchor_a: anchor_a.into(),
        anchor_b: anchor_b.into(),
        k: 4e6,
        c: 1e4,
        length_m: 0.5,
    }
}

fn a_drive(body: usize) -> Drive {
    Drive {
        body,
        contact: Vector3::zeros(),
        wheel_radius_m: 0.17,
        wheel_inertia: 2.0,
        motor_inertia: 0.1,
        gear_ratio: 20.0,
        efficiency_drive: 0.9,
        efficiency_brake: 0.9,
        torque_max_nm: 200.0,
        power_w: 60e3,
        speed_max_radps: 272.0,
        lag_s: 0.05,
        rate_nmps: 1e4,
        piston_area_m2: 1e-3,
        clamp_mpa: 9.0,
        clamp_lag_s: 0.2,
        adhesion: 0.35,
        sigma0: 1.2e7,
        sigma1: 6e4,
        kappa: 0.0,
        brake_max_n: 1e5,
        brake_lag_s: 0.3,
    }
}
