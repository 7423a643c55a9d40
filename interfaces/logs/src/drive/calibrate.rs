//! Calibration while the vehicle stands: bias of the gyro, roll and pitch of the accelerometer's mount.

use super::channel::Target;
use super::plan::{Plan, turned};
use super::steps::Drive;
use crate::map::{Calibrate, Many, Map};
use monorig_estimators::api::signals::Measurand;
use monorig_sim::config::checked::Finite;
use monorig_sim::error::Error;
use nalgebra::Vector3;
use serde::Serialize;

/// A calibrated value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Its name, such as `angular_rate bias left`.
    pub what: String,
    /// Its value.
    pub value: f64,
    /// Standard deviation of the mean that it is from, of samples taken for independent.
    pub sd: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// Largest speed and angular rate of a standing vehicle, m/s and rad/s.
const STANDING_MPS: f64 = 0.02;
const STANDING_RADPS: f64 = 0.1;
/// Fewest samples of a mean.
const MIN_SAMPLES: f64 = 50.0;

/// VectorSums of a vector.
#[derive(Default)]
struct VectorSums {
    n: f64,
    sum: Vector3<f64>,
    squares: Vector3<f64>,
}

impl VectorSums {
    fn push(&mut self, v: [f64; 3]) {
        let v = Vector3::from(v);
        self.n += 1.0;
        self.sum += v;
        self.squares += v.component_mul(&v);
    }

    fn mean(&self) -> Vector3<f64> {
        self.sum / self.n
    }

    /// Standard deviation of the samples.
    fn sd(&self) -> Vector3<f64> {
        let m = self.mean();
        (self.squares / self.n - m.component_mul(&m)).map(|x| x.max(0.0).sqrt())
    }
}

/// Finds the values that the map asks for, and puts them into the plan.
pub fn calibrate(map: &Map, plan: &mut Plan) -> Result<Vec<Found>, Error> {
    let c = &map.file.channels;
    let of = |measurand| c.vector(measurand).and_then(|v| v.calibrate);
    let (force, rate) = (of(Measurand::SpecificForce), of(Measurand::AngularRate));
    let longest = [force, rate]
        .iter()
        .flatten()
        .map(|c| c.standing_s.get())
        .fold(0.0, f64::max);
    if longest == 0.0 {
        return Ok(Vec::new());
    }
    let within = |c: Option<Calibrate>, t_ns: i64| {
        c.is_some_and(|c| t_ns as f64 * 1e-9 <= c.standing_s.get())
    };
    let mut map_of_all = map.clone();
    map_of_all.file.step.many = Many::Newest;
    let mut drive = Drive::open(&map_of_all, plan)?;
    let (mut forces, mut rates, mut fastest, mut t_ns) =
        (VectorSums::default(), VectorSums::default(), 0.0f64, 0);
    while let Some(step) = drive.next(&map_of_all)? {
        t_ns = step.t_ns;
        if t_ns as f64 * 1e-9 > longest || step.segment > 0 {
            break;
        }
        let z = &step.z;
        if within(force, t_ns) {
            z.specific_force_mps2
                .iter()
                .for_each(|s| forces.push(s.value));
        }
        if within(rate, t_ns) {
            z.angular_rate_radps
                .iter()
                .for_each(|s| rates.push(s.value));
        }
        fastest = z
            .wheel_speed_mps
            .iter()
            .flatten()
            .fold(fastest, |m, s| m.max(s.value.abs()));
    }
    let key = if rate.is_some() {
        "channels.angular_rate.calibrate"
    } else {
        "channels.specific_force.calibrate"
    };
    let refused = |message: String| {
        map.error(key, message, "use a `standing_s` in which the vehicle stands, or your own values (`bias`, `mount_deg`)")
    };
    if fastest > STANDING_MPS {
        return Err(refused(format!(
            "the wheels turn at up to {fastest:.3} m/s within the first {longest} s"
        )));
    }
    let mut found = Vec::new();
    if rate.is_some() {
        let (mean, sd) = (rates.mean(), rates.sd());
        if rates.n < MIN_SAMPLES {
            return Err(refused(format!(
                "the angular rate has only {} samples in {:.1} s",
                rates.n,
                t_ns as f64 * 1e-9
            )));
        }
        if sd.max() > STANDING_RADPS {
            return Err(refused(format!(
                "the angular rate varies by {:.3} rad/s: this is not a standstill",
                sd.max()
            )));
        }
        put(plan, Measurand::AngularRate, |path| path.found_bias = mean);
        for (axis, i) in [("forward", 0), ("left", 1), ("up", 2)] {
            found.push(Found {
                what: format!("angular_rate bias {axis}"),
                value: mean[i],
                sd: sd[i] / rates.n.sqrt(),
                unit: "rad/s",
            });
        }
    }
    if let Some(calibrate) = force {
        if forces.n < MIN_SAMPLES {
            return Err(refused(format!(
                "the specific force has only {} samples in {:.1} s",
                forces.n,
                t_ns as f64 * 1e-9
            )));
        }
        let slope = calibrate.slope_deg.map_or(0.0, Finite::get).to_radians();
        let (f, sd) = (forces.mean(), forces.sd());
        let roll = f.y.atan2(f.z);
        let pitch = f.x.atan2(f.y.hypot(f.z)) - slope;
        put(plan, Measurand::SpecificForce, |path| {
            path.turn = turned(roll, pitch, 0.0).matrix() * path.turn
        });
        let g = f.norm();
        for (what, angle, noise) in [("roll", roll, sd.y), ("pitch", pitch, sd.x)] {
            let sd = noise / forces.n.sqrt() / g;
            found.push(Found {
                what: format!("specific_force mount {what}"),
                value: angle.to_degrees(),
                sd: sd.to_degrees(),
                unit: "°",
            });
        }
    }
    Ok(found)
}

fn put(plan: &mut Plan, vector: Measurand, change: impl FnOnce(&mut super::channel::VectorPath)) {
    let target = Target::Measured(vector.slot(0));
    let channel = plan.channels.iter_mut().find(|c| c.target == target);
    if let Some(path) = channel.and_then(|c| c.vector.as_mut()) {
        change(path);
    }
}
