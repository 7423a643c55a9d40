//! Parameters of vehicle and instruments from a log whose mass and slope are known: torque gain, running resistance,
//! lean and bias of the accelerometer, noise, and with a reference of the way the radius of the wheels. The force
//! balance of Liu et al. (2023, §2.2) regressed over windows of a second.

mod noise;
mod standing;
mod wheel_radius;

pub(crate) use noise::Noise;
pub use standing::{Instrument, StandingAxis, standing};

use crate::drive::{Drive, Plan, Reference, Way, calibrate};
use crate::map::Map;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use crate::wrong;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::error::Error;
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use wheel_radius::Rolled;

/// Length of a window, s.
const WINDOW_S: f64 = 1.0;
/// Below this speed friction is not the running resistance, m/s.
const MIN_SPEED_MPS: f64 = 0.2;
/// Fewest windows of a regression.
const MIN_WINDOWS: usize = 20;

/// A parameter that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation: residuals, their correlation from window to window, and that of the known mass and
    /// slope.
    pub sd: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Its key in a map, or its meaning for the vehicle.
    pub meaning: &'static str,
}

/// Means of a window, and the speeds at its ends.
#[derive(Clone, Copy, Debug)]
struct ForceWindow {
    /// Mean acceleration from the speeds at both ends, m/s².
    acceleration: f64,
    speed: f64,
    /// Force of the motors at the rims as the nominal vehicle has it, N.
    force_n: f64,
    specific_force_x: f64,
    slope_rad: f64,
    effective_slope_rad: f64,
    mass_kg: f64,
}

/// Finds the parameters of a log.
pub fn identify(map: &Map) -> Result<Vec<Parameter>, Error> {
    let mut plan = Plan::new(map)?;
    calibrate(map, &mut plan)?;
    let mut seen = Seen::default();
    let mut windows = windows(map, &plan, &mut seen)?;
    let mut found = Vec::new();
    let radius = radius_ratio(map, &seen)?;
    if let Some((ratio, sd)) = radius {
        let nominal_m = plan.vehicle.wheel_radius_m;
        found.push(Parameter {
            name: "wheel radius".into(),
            value: ratio * nominal_m,
            sd: sd * nominal_m,
            unit: "m",
            meaning: "nominal.wheel_radius_m, where the wheel speeds of the log were made with the nominal one",
        });
        // what follows is with this radius: speeds are larger by it, and the force of the same torque smaller
        for w in &mut windows {
            w.acceleration *= ratio;
            w.speed *= ratio;
            w.force_n /= ratio;
        }
    }
    found.extend(drive_parameters(map, &plan, &windows, &seen, radius)?);
    found.extend(accelerometer_parameters(&windows, &seen));
    found.extend(seen.noise.figures().into_iter().map(|figure| Parameter {
        name: format!("noise of the {}", figure.channel),
        value: figure.sd,
        sd: figure.sd_of_sd,
        unit: figure.unit,
        meaning: "standard deviation of a sample",
    }));
    Ok(found)
}

/// The radius of the wheels over the nominal one, and its standard deviation; none without a reference of the way.
fn radius_ratio(map: &Map, seen: &Seen) -> Result<Option<(f64, f64)>, Error> {
    let Some(rolled) = &seen.rolled else {
        return Ok(None);
    };
    rolled.ratio().map(Some).ok_or_else(|| {
        let help = "a reference that covers at least four times 5 m of the way in one stretch";
        let why = "too little of the way has both wheel speeds and a reference";
        map.error("reference", why, help)
    })
}

/// Torque gain and running resistance, by the force balance along the track while the vehicle moves.
fn drive_parameters(
    map: &Map,
    plan: &Plan,
    windows: &[ForceWindow],
    seen: &Seen,
    radius: Option<(f64, f64)>,
) -> Result<[Parameter; 2], Error> {
    let moves = |w: &&ForceWindow| w.speed.abs() > MIN_SPEED_MPS;
    let moving: Vec<&ForceWindow> = windows.iter().filter(moves).collect();
    let balance = |w: &&ForceWindow| {
        let m = w.mass_kg;
        let (sin, cos) = w.effective_slope_rad.sin_cos();
        let y = (m + plan.vehicle.rotating_mass_kg) * w.acceleration + m * G * sin;
        (Vector2::new(w.force_n, -m * G * cos * w.speed.signum()), y)
    };
    let Some(fit) = regression(moving.iter().map(balance)) else {
        let file = map.files.values().next().cloned().unwrap_or_default();
        return Err(wrong(
            &file,
            None,
            format!(
                "of this log {} windows of a second have speed, traction, mass and slope while the vehicle moves",
                moving.len()
            ),
            format!(
                "at least {MIN_WINDOWS}, with forces that differ; a map with wheel_speed, traction, reference.mass and reference.slope"
            ),
        ));
    };
    let mean_mass = moving.iter().map(|w| w.mass_kg).sum::<f64>() / moving.len() as f64;
    let [gain, resistance] = fit.value;
    let gain = Parameter {
        name: "torque gain".into(),
        value: gain,
        sd: fit.sd[0]
            .hypot(gain * seen.mass_sd / mean_mass)
            .hypot(gain * radius.map_or(0.0, |(ratio, sd)| sd / ratio)),
        unit: "1",
        meaning: match radius {
            Some(_) => {
                "force at the rims over that of the radius found and the nominal gear and efficiency"
            }
            None => "force at the rims over that of the nominal radius, gear and efficiency",
        },
    };
    let resistance = Parameter {
        name: "running resistance".into(),
        value: resistance,
        sd: fit.sd[1].hypot(seen.slope_sd),
        unit: "1",
        meaning: "nominal.running_resistance",
    };
    Ok([gain, resistance])
}

/// Lean and bias of the accelerometer, by its specific force along the vehicle; none of a log that does not show them.
fn accelerometer_parameters(windows: &[ForceWindow], seen: &Seen) -> Vec<Parameter> {
    let inertial = windows.iter().filter(|w| w.specific_force_x.is_finite());
    let inertial = inertial.map(|w| {
        let f = w.acceleration + G * w.slope_rad.sin();
        (Vector2::new(f, 1.0), w.specific_force_x)
    });
    let Some(fit) = regression(inertial) else {
        return Vec::new();
    };
    let to_deg = 180.0 / std::f64::consts::PI;
    let lean = Parameter {
        name: "lean".into(),
        value: (fit.value[0] - 1.0) * to_deg,
        sd: fit.sd[0] * to_deg,
        unit: "deg/g",
        meaning: "channels.specific_force.lean_deg_per_g; an error of scale shows as the same",
    };
    let bias = Parameter {
        name: "accelerometer bias".into(),
        value: fit.value[1],
        sd: fit.sd[1].hypot(G * seen.slope_sd),
        unit: "m/s2",
        meaning: "forward; with the pitch of its mount times g",
    };
    vec![lean, bias]
}

/// Figures of a log beside its windows.
#[derive(Default)]
struct Seen {
    noise: Noise,
    /// Standard deviations of the references, rad and kg.
    slope_sd: f64,
    mass_sd: f64,
    /// The way by the wheels beside that by the reference, if there is one.
    rolled: Option<Rolled>,
}

/// Windows in which all that the force balance needs is known.
fn windows(map: &Map, plan: &Plan, seen: &mut Seen) -> Result<Vec<ForceWindow>, Error> {
    let mut drive = Drive::open(map, plan)?;
    let mut reference = Reference::load(map, drive.origin_ns())?;
    (seen.slope_sd, seen.mass_sd) = (reference.slope_sd_rad, reference.mass_sd_kg);
    seen.rolled = Way::load(map, drive.origin_ns())?.map(Rolled::new);
    let mut windows = Vec::new();
    let mut sums = WindowSums::default();
    let mut last = LastValues::default();
    while let Some(step) = drive.next(map)? {
        seen.noise.see(&step.z);
        last.see(&step.z, &plan.vehicle);
        if let Some(rolled) = &mut seen.rolled {
            rolled.see(step.t_ns, step.segment, last.speed());
        }
        let (slope, mass) = reference.at(step.t_ns);
        let effective = reference.effective_at(step.t_ns).unwrap_or(slope);
        let t_s = step.t_ns as f64 * 1e-9;
        if sums.segment != step.segment {
            sums = WindowSums::default();
            sums.segment = step.segment;
        }
        sums.add(t_s, [last.speed(), last.force_n, slope, effective, mass]);
        if let Some(sample) = &step.z.specific_force_mps2 {
            sums.inertial = (sums.inertial.0 + 1.0, sums.inertial.1 + sample.value[0]);
        }
        if sums.from.is_some_and(|(from, _)| t_s - from >= WINDOW_S) {
            windows.extend(sums.window(t_s, last.speed()));
            // the end of a window is the beginning of the next one
            sums = WindowSums {
                segment: step.segment,
                from: Some((t_s, last.speed())),
                ..WindowSums::default()
            };
        }
    }
    Ok(windows)
}

/// Last values of channels that do not come in every step.
#[derive(Default)]
pub(crate) struct LastValues {
    wheels: [Option<f64>; monorig_estimators::api::signals::MAX_DRIVES],
    torques: [Option<f64>; monorig_estimators::api::signals::MAX_DRIVES],
    /// Of the motors at the rims as the nominal vehicle has it, N; not a number without a torque.
    pub force_n: f64,
}

impl LastValues {
    /// Takes what is new.
    pub fn see(&mut self, z: &monorig_estimators::api::signals::Measurements, v: &Vehicle) {
        for (last, new) in self.wheels.iter_mut().zip(&z.wheel_speed_mps) {
            *last = new.map(|s| s.value).or(*last);
        }
        for (last, new) in self.torques.iter_mut().zip(&z.motor_torque_nm) {
            *last = new.map(|s| s.value).or(*last);
        }
        let speed = self.speed();
        let ideal = |torque: f64| torque * v.gear_ratio / v.wheel_radius_m;
        // what is lost in the gear is lost on the way of the power
        let force = |torque: &f64| match torque * speed >= 0.0 {
            true => ideal(*torque) * v.efficiency,
            false => ideal(*torque) / v.efficiency,
        };
        self.force_n = match self.torques.iter().flatten().count() {
            0 => f64::NAN,
            _ => self.torques.iter().flatten().map(force).sum(),
        };
    }

    /// Mean of the wheels, m/s.
    pub fn speed(&self) -> f64 {
        mean(&self.wheels)
    }

    /// Mean of the motors, N·m.
    pub fn torque(&self) -> f64 {
        mean(&self.torques)
    }

    /// Motors whose torque is known.
    pub fn motors(&self) -> usize {
        self.torques.iter().flatten().count()
    }
}

/// Mean of those that are known; not a number of none.
fn mean(all: &[Option<f64>]) -> f64 {
    let known = all.iter().flatten();
    let (n, sum) = known.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
    sum / n
}

/// WindowSums of a window: speed, force, slope, effective slope, mass.
#[derive(Default)]
struct WindowSums {
    segment: u32,
    from: Option<(f64, f64)>,
    n: f64,
    sum: [f64; 5],
    inertial: (f64, f64),
}

impl WindowSums {
    fn add(&mut self, t_s: f64, values: [f64; 5]) {
        self.from.get_or_insert((t_s, values[0]));
        self.n += 1.0;
        for (sum, x) in self.sum.iter_mut().zip(values) {
            *sum += x;
        }
    }

    /// The window that ends now; none if something of it is not known.
    fn window(&self, t_s: f64, end_speed: f64) -> Option<ForceWindow> {
        let (from_s, from_speed) = self.from?;
        let [speed, force_n, slope_rad, effective_slope_rad, mass_kg] =
            self.sum.map(|sum| sum / self.n);
        let window = ForceWindow {
            acceleration: (end_speed - from_speed) / (t_s - from_s),
            speed,
            force_n,
            specific_force_x: self.inertial.1 / self.inertial.0,
            slope_rad,
            effective_slope_rad,
            mass_kg,
        };
        let needed = [
            window.acceleration,
            speed,
            force_n,
            slope_rad,
            effective_slope_rad,
            mass_kg,
        ];
        needed.iter().all(|x| x.is_finite()).then_some(window)
    }
}

/// Two parameters and their standard deviations.
struct Fit {
    value: [f64; 2],
    sd: [f64; 2],
}

/// Least squares; correlated residuals of successive rows count as fewer. None of too few rows, and none where the two
/// columns are nearly proportional.
fn regression(rows: impl Iterator<Item = (Vector2<f64>, f64)>) -> Option<Fit> {
    let rows: Vec<_> = rows.collect();
    if rows.len() < MIN_WINDOWS {
        return None;
    }
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (h, y) in &rows {
        normal += h * h.transpose();
        right += h * *y;
    }
    // scaled to ones in the diagonal, so that the determinant shows how alike the two are
    let alike = normal[(0, 1)].powi(2) / (normal[(0, 0)] * normal[(1, 1)]);
    if alike.is_nan() || alike >= 1.0 - 1e-9 {
        return None;
    }
    let inverse = normal.try_inverse()?;
    let value = inverse * right;
    let residuals: Vec<f64> = rows.iter().map(|(h, y)| y - h.dot(&value)).collect();
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let lagged: f64 = residuals
        .iter()
        .zip(residuals.iter().skip(1))
        .map(|(a, b)| a * b)
        .sum();
    let correlation = if squares > 0.0 {
        (lagged / squares).clamp(0.0, 0.95)
    } else {
        0.0
    };
    let variance = squares / (rows.len() - 2) as f64 * (1.0 + correlation) / (1.0 - correlation);
    let sd = |i: usize| (variance * inverse[(i, i)]).sqrt();
    Some(Fit {
        value: [value[0], value[1]],
        sd: [sd(0), sd(1)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::sensors::stream::Stream;

    /// A drive up and down with noise: gain, resistance, lean and bias that were planted are found within three
    /// standard deviations, which are small against the values.
    #[test]
    fn planted_values_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let (gain, resistance, lean, bias) = (1.08, 0.021, 0.03, 0.12);
        let (mass, radius) = (10_000.0, 0.2);
        let mut noise = Stream::new(7, "test");
        let mut text = String::from("t,v,fx,fy,fz,torque,slope\n");
        for k in 0..30_000 {
            let t = f64::from(k) * 0.01;
            let v = 1.5 + 0.8 * (0.25 * t).sin();
            let a = 0.2 * (0.25 * t).cos();
            let slope: f64 = 0.1 * (0.03 * t).sin();
            let f = a + G * slope.sin();
            let force = (mass * a + mass * G * (slope.sin() + resistance * slope.cos())) / gain;
            text += &format!(
                "{t},{},{},0,9.8,{},{slope}\n",
                v + 0.003 * noise.normal(),
                f * (1.0 + lean) + bias + 0.05 * noise.normal(),
                force * radius + 5.0 * noise.normal(),
            );
        }
        std::fs::write(dir.path().join("log.csv"), text).unwrap();
        let map = "version: 1
files: {log: log.csv}
nominal: {tare_kg: 8000, wheel_radius_m: 0.2}
channels:
  specific_force: {columns: [fx, fy, fz], unit: m/s2}
  wheel_speed: [{columns: [v], unit: m/s}]
  traction: {torque: [torque], unit: Nm}
reference: {slope: {column: slope, unit: rad, sd_deg: 0}, mass: {kg: 10000, sd_kg: 0}}
";
        let path = dir.path().join("log.map.yaml");
        std::fs::write(&path, map).unwrap();
        let found = identify(&Map::load(&path).unwrap()).unwrap();
        let near = |name: &str, planted: f64, most: f64| {
            let p = found.iter().find(|p| p.name == name).unwrap();
            let off = (p.value - planted).abs();
            assert!(
                off < 3.0 * p.sd,
                "{name}: {} ± {}, planted {planted}",
                p.value,
                p.sd
            );
            assert!(p.sd < most, "{name}: ± {}", p.sd);
        };
        near("torque gain", gain, 0.01);
        near("running resistance", resistance, 0.001);
        near("lean", lean * 180.0 / std::f64::consts::PI, 0.3);
        near("accelerometer bias", bias, 0.01);
        near("noise of the specific force forward", 0.05, 0.001);
        near("noise of the wheel speed 1", 0.003, 1e-4);
    }

    /// A vehicle whose wheels are 2.5 % smaller than the map has them, along marks every 7 m that were surveyed to 5
    /// mm, or beside a laser that measures the speed: the radius is found within two standard deviations, which are
    /// below a thousandth of it, and the torque gain is then that of gear and efficiency alone.
    #[test]
    fn the_radius_is_found_by_marks_and_by_a_laser() {
        let (said, radius, gain, resistance, mass) = (0.2, 0.195, 0.97, 0.018, 10_000.0);
        let mut noise = Stream::new(11, "test");
        let dir = tempfile::tempdir().unwrap();
        let (mut log, mut marks) = (String::from("t,v,torque,laser\n"), String::from("t,d\n"));
        let mut passed = 0.0;
        for k in 0..30_000 {
            let t = f64::from(k) * 0.01;
            let v = 1.5 + 0.8 * (0.25 * t).sin();
            let way = 1.5 * t + 3.2 * (1.0 - (0.25 * t).cos());
            let force = mass * (0.2 * (0.25 * t).cos() + G * resistance) / gain;
            let wheel = v * said / radius + 0.003 * noise.normal();
            let (torque, laser) = (force * radius, v + 0.01 * noise.normal());
            log += &format!("{t},{wheel},{torque},{laser}\n");
            if way >= passed {
                let t = t - (way - passed) / v;
                marks += &format!("{t},{}\n", passed + 0.005 * noise.normal());
                passed += 7.0;
            }
        }
        std::fs::write(dir.path().join("log.csv"), log).unwrap();
        std::fs::write(dir.path().join("marks.csv"), marks).unwrap();
        for reference in [
            "distance: {file: marks, column: d, unit: m, sd: 0.005}",
            "speed: {file: log, column: laser, unit: m/s, sd: 0.0005}",
        ] {
            let map = format!(
                "version: 1
files: {{log: log.csv, marks: marks.csv}}
nominal: {{tare_kg: 8000, wheel_radius_m: {said}}}
channels:
  wheel_speed: [{{file: log, columns: [v], unit: m/s}}]
  traction: {{file: log, torque: [torque], unit: Nm}}
reference: {{slope: {{deg: 0, sd_deg: 0}}, mass: {{kg: 10000, sd_kg: 0}}, {reference}}}
"
            );
            let path = dir.path().join("log.map.yaml");
            std::fs::write(&path, map).unwrap();
            let found = identify(&Map::load(&path).unwrap()).unwrap();
            for (name, planted, most) in [
                ("wheel radius", radius, 2e-4),
                ("torque gain", gain, 0.01),
                ("running resistance", resistance, 0.001),
            ] {
                let p = found.iter().find(|p| p.name == name).unwrap();
                let off = (p.value - planted).abs();
                let told = format!("{reference}: {name} {} ± {}", p.value, p.sd);
                assert!(off < 2.0 * p.sd && p.sd < most, "{told}, planted {planted}");
            }
        }
    }

    /// At one force on the level gain and resistance are one: refused, and not made up.
    #[test]
    fn what_cannot_be_told_apart_is_refused() {
        let same = (0..100).map(|_| (Vector2::new(1e4, -1e5), 0.0));
        assert!(regression(same).is_none());
    }
}
