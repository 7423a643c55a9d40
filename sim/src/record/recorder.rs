//! Recorder: an observer that collects the channels of every step and hands them to sinks in chunks.

use super::{Channel, Chunk, Layout, Sink};
use crate::closed_loop::estimators::RunningEstimator;
use crate::closed_loop::run::{Observer, StepFrame};
use crate::config::scenario::Record;
use crate::error::Error;
use monorig_estimators::api::signals::{MAX_DRIVES, Measurements};

/// Records a run.
pub struct Recorder<'a> {
    sinks: Vec<&'a mut dyn Sink>,
    chunk: Chunk,
    chunk_ns: i64,
    next_chunk_ns: i64,
    row_ns: i64,
    next_row_ns: i64,
    pose_ns: i64,
    next_pose_ns: i64,
    latest: Measurements,
    row: Vec<f64>,
    rows: usize,
}

/// Channels of a run, in the order in which [`Recorder`] fills them: those of a train with so many drive units, or of a car (`road`).
pub fn channels(drives: usize, road: bool, estimators: &[RunningEstimator]) -> Vec<Channel> {
    let mut c = Vec::new();
    let mut add = |path: String, unit: &'static str| c.push(Channel { path, unit });
    for (name, unit) in TRUTH {
        add(format!("truth/{name}"), unit);
    }
    for d in 1..=drives {
        for (name, unit) in TRUTH_DRIVE {
            add(format!("truth/drive_{d}/{name}"), unit);
        }
    }
    if road {
        for (name, unit) in TRUTH_ROAD {
            add(format!("truth/road/{name}"), unit);
        }
    }
    for (name, unit) in IMU {
        add(format!("sensors/imu/{name}"), unit);
    }
    for d in 1..=drives {
        for (name, unit) in SENSOR_DRIVE {
            add(format!("sensors/drive_{d}/{name}"), unit);
        }
    }
    if road {
        add("sensors/steering_angle".into(), "rad");
    }
    for (name, unit) in CONTROL {
        add(format!("control/{name}"), unit);
    }
    for m in estimators {
        for (name, unit) in ESTIMATE {
            add(format!("estimates/{}/{name}", m.name), unit);
        }
        for i in m.list_internals() {
            let unit = if i.unit == "-" { "" } else { i.unit };
            add(format!("internals/{}/{}", m.name, i.name), unit);
        }
    }
    c
}

const TRUTH: [(&str, &str); 20] = [
    ("chainage", "m"),
    ("speed", "m/s"),
    ("acceleration", "m/s²"),
    ("grade_at_imu", "rad"),
    ("pitch_at_imu", "rad"),
    ("grade_effective", "rad"),
    ("curvature_vertical", "1/m"),
    ("curvature_horizontal", "1/m"),
    ("total_mass", "kg"),
    ("load_mass", "kg"),
    ("traction", "N"),
    ("resistance", "N"),
    ("brake", "N"),
    ("running_resistance", "1"),
    ("sway_longitudinal", "rad"),
    ("sway_lateral", "rad"),
    ("off_rail", "m"),
    ("clearance", "m"),
    ("clamp_pressure", "MPa"),
    ("largest_slip", "m/s"),
];
const TRUTH_DRIVE: [(&str, &str); 4] = [
    ("motor_torque", "N·m"),
    ("traction", "N"),
    ("slip", "m/s"),
    ("adhesion", "1"),
];
const TRUTH_ROAD: [(&str, &str); 10] = [
    ("steering_angle", "rad"),
    ("offset", "m"),
    ("heading", "rad"),
    ("sideslip", "rad"),
    ("yaw_rate", "rad/s"),
    ("lateral_acceleration", "m/s²"),
    ("load_front_left", "N"),
    ("load_front_right", "N"),
    ("load_rear_left", "N"),
    ("load_rear_right", "N"),
];
const IMU: [(&str, &str); 6] = [
    ("specific_force_x", "m/s²"),
    ("specific_force_y", "m/s²"),
    ("specific_force_z", "m/s²"),
    ("angular_rate_x", "rad/s"),
    ("angular_rate_y", "rad/s"),
    ("angular_rate_z", "rad/s"),
];
const SENSOR_DRIVE: [(&str, &str); 3] = [
    ("motor_torque", "N·m"),
    ("wheel_speed", "m/s"),
    ("clamp_pressure", "MPa"),
];
const CONTROL: [(&str, &str); 7] = [
    ("reference_speed", "m/s"),
    ("reference_acceleration", "m/s²"),
    ("perceived_speed", "m/s"),
    ("feedforward_grade", "rad"),
    ("feedforward_mass", "kg"),
    ("motor_torque", "N·m"),
    ("brake", "1"),
];
const ESTIMATE: [(&str, &str); 15] = [
    ("total_mass", "kg"),
    ("total_mass_sd", "kg"),
    ("total_mass_valid", "1"),
    ("grade", "rad"),
    ("grade_sd", "rad"),
    ("grade_valid", "1"),
    ("effective_grade", "rad"),
    ("effective_grade_sd", "rad"),
    ("speed", "m/s"),
    ("speed_sd", "m/s"),
    ("innovation", "m/s"),
    ("nis", "1"),
    ("moving", "1"),
    ("excited", "1"),
    ("saturated", "1"),
];

fn flag(b: bool) -> f64 {
    if b { 1.0 } else { 0.0 }
}

impl<'a> Recorder<'a> {
    /// A recorder for a run laid out like `layout`, handed on every `chunk_s` of simulated time; tells the sinks.
    pub fn new(
        mut sinks: Vec<&'a mut dyn Sink>,
        layout: &Layout<'_>,
        record: &Record,
        chunk_s: f64,
    ) -> Result<Self, Error> {
        for s in &mut sinks {
            s.begin(layout)?;
        }
        let period = |hz: f64| libm::round(1e9 / hz) as i64;
        let chunk_ns = period(1.0 / chunk_s);
        let mut recorder = Self {
            sinks,
            chunk: Chunk::default(),
            chunk_ns,
            next_chunk_ns: chunk_ns,
            row_ns: period(record.rate_hz.get()),
            next_row_ns: 0,
            pose_ns: period(record.pose_rate_hz.get()),
            next_pose_ns: 0,
            latest: Measurements::default(),
            row: Vec::with_capacity(layout.channels.len()),
            rows: 0,
        };
        recorder.chunk.values = vec![Vec::new(); layout.channels.len()];
        recorder.chunk.poses = vec![Vec::new(); layout.train.bodies.len()];
        recorder.chunk.wheel_angles = vec![Vec::new(); layout.train.drives.len()];
        Ok(recorder)
    }

    /// Rows recorded so far.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Note something that happened.
    pub fn event(&mut self, time_ns: i64, text: String) {
        self.chunk.events.push((time_ns, text));
    }

    fn row(&mut self, f: &StepFrame<'_>) {
        let (t, z) = (f.truth, &self.latest);
        let finite = |x: f64| if x.is_finite() { x } else { f64::NAN };
        let row = &mut self.row;
        row.clear();
        let clamp = t
            .drives
            .iter()
            .map(|d| d.clamp_mpa)
            .fold(f64::INFINITY, f64::min);
        let slip = t
            .drives
            .iter()
            .map(|d| d.slip_mps)
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        row.extend([
            t.chainage_m,
            t.speed_mps,
            t.accel_mps2,
            t.grade_at_imu_rad,
            t.pitch_at_imu_rad,
            t.grade_effective_rad,
            t.curvature_vertical_1pm,
            t.curvature_horizontal_1pm,
            t.total_mass_kg,
            t.load_mass_kg,
            t.traction_n,
            t.resistance_n,
            t.brake_n,
            t.running_resistance,
            t.sway_rad[0],
            t.sway_rad[1],
            t.off_rail_m,
            finite(t.clearance_m),
            finite(clamp),
            slip,
        ]);
        for d in &t.drives {
            row.extend([d.motor_torque_nm, d.traction_n, d.slip_mps, d.adhesion]);
        }
        if let Some(r) = &t.road {
            row.extend([
                r.steering_rad,
                r.offset_m,
                r.heading_rad,
                r.sideslip_rad,
                r.yaw_rate_radps,
                r.lateral_mps2,
            ]);
            row.extend(r.wheel_load_n);
        }
        row.extend(z.specific_force_mps2.map_or([f64::NAN; 3], |s| s.value));
        row.extend(z.angular_rate_radps.map_or([f64::NAN; 3], |s| s.value));
        for d in 0..t.drives.len().min(MAX_DRIVES) {
            row.extend(
                [
                    z.motor_torque_nm[d],
                    z.wheel_speed_mps[d],
                    z.clamp_pressure_mpa[d],
                ]
                .map(|s| s.map_or(f64::NAN, |s| s.value)),
            );
        }
        if t.road.is_some() {
            row.push(z.steering_angle_rad.map_or(f64::NAN, |s| s.value));
        }
        let drives = t.drives.len().max(1) as f64;
        row.extend([
            f.reference.speed_mps,
            f.reference.accel_mps2,
            f.perception.speed_mps,
            f.perception.grade_rad,
            f.perception.total_mass_kg,
            f.command.motor_torque_nm.iter().sum::<f64>() / drives,
            f.command.brake,
        ]);
        for m in f.estimators {
            let e = &m.estimate;
            row.extend([
                e.total_mass_kg.value,
                e.total_mass_kg.sd,
                flag(e.total_mass_kg.valid),
                e.grade_rad.value,
                e.grade_rad.sd,
                flag(e.grade_rad.valid),
                e.effective_grade_rad.value,
                e.effective_grade_rad.sd,
                e.speed_mps.value,
                e.speed_mps.sd,
                e.innovation,
                e.nis,
                flag(e.flags.moving),
                flag(e.flags.excited),
                flag(e.flags.saturated),
            ]);
            m.internals(row);
        }
        for (column, value) in self.chunk.values.iter_mut().zip(row.iter()) {
            column.push(*value);
        }
        self.rows += 1;
    }

    fn poses(&mut self, f: &StepFrame<'_>) {
        for (column, (p, q)) in self.chunk.poses.iter_mut().zip(&f.truth.poses) {
            column.push(([p.x, p.y, p.z], [q.i, q.j, q.k, q.w]));
        }
        for (column, d) in self.chunk.wheel_angles.iter_mut().zip(&f.truth.drives) {
            column.push(d.wheel_angle_rad);
        }
    }

    fn flush(&mut self) -> Result<(), Error> {
        let c = &mut self.chunk;
        if c.time_ns.is_empty() && c.pose_time_ns.is_empty() && c.events.is_empty() {
            return Ok(());
        }
        for s in &mut self.sinks {
            s.chunk(c)?;
        }
        c.time_ns.clear();
        c.pose_time_ns.clear();
        c.events.clear();
        c.values.iter_mut().for_each(Vec::clear);
        c.poses.iter_mut().for_each(Vec::clear);
        c.wheel_angles.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl Observer for Recorder<'_> {
    fn wants_truth(&self, time_ns: i64) -> bool {
        time_ns >= self.next_row_ns || time_ns >= self.next_pose_ns
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        if f.sampled {
            self.latest.merge(f.measurements);
        }
        for text in f.events {
            self.event(f.time_ns, text.clone());
        }
        if f.time_ns >= self.next_row_ns {
            self.chunk.time_ns.push(f.time_ns);
            self.row(f);
            // A value stands in the row of the period it arrived in, and in no other.
            self.latest = Measurements::default();
            while self.next_row_ns <= f.time_ns {
                self.next_row_ns += self.row_ns;
            }
        }
        if f.time_ns >= self.next_pose_ns {
            self.chunk.pose_time_ns.push(f.time_ns);
            self.poses(f);
            while self.next_pose_ns <= f.time_ns {
                self.next_pose_ns += self.pose_ns;
            }
        }
        if f.time_ns >= self.next_chunk_ns {
            self.next_chunk_ns += self.chunk_ns;
            self.flush()?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.flush()?;
        for s in &mut self.sinks {
            s.finish()?;
        }
        Ok(())
    }
}
