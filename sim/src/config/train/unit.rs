//! A unit: its URDF and a YAML file with what URDF has no words for.

use super::unit_file::UnitFile;
use crate::config::checked::Fraction;
use crate::config::file::{input_error, named, read_yaml};
use crate::config::urdf::{LinkPlace, UrdfUnit};
use crate::error::Error;
use crate::train::inertia::MassProperties;
use crate::train::{Drive, Station};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// A unit as read: its own file, its URDF, and what follows from both.
#[derive(Clone, Debug)]
pub struct Unit {
    /// The YAML file.
    pub(crate) path: PathBuf,
    /// Content of the unit file.
    pub(crate) file: UnitFile,
    /// The URDF.
    pub(crate) urdf: UrdfUnit,
    /// Stations of each URDF body, rear to front; empty for suspended bodies.
    pub(crate) stations: Vec<Vec<Station>>,
    /// The drive, if there are friction wheels; its body index counts the unit's own bodies.
    pub(crate) drive: Option<Drive>,
    /// The trolley above, if the unit is suspended.
    pub(crate) trolley: Option<Box<Unit>>,
    /// Highest speed its friction wheels allow, m/s; infinite without.
    pub(crate) max_speed_mps: f64,
}

impl Unit {
    /// Read a unit file, its URDF, and the trolley it hangs from.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let unit = Self::load_one(path)?;
        let Some(carried) = &unit.file.carried_by else {
            return Ok(unit);
        };
        let trolley = Self::load_one(&named(path, "carried_by.trolley", &carried.trolley)?)?;
        if trolley.stations.first().is_none_or(Vec::is_empty) || trolley.file.carried_by.is_some() {
            return Err(input_error(
                path,
                "carried_by.trolley",
                "this unit does not run on the rail itself",
                "a unit with running wheels",
            ));
        }
        trolley.link("hanger")?;
        if carried.links.len() < 2 {
            return Err(input_error(
                path,
                "carried_by.links",
                "a hung unit needs two hangers or more",
                "front and rear hanger links",
            ));
        }
        for (i, link) in carried.links.iter().enumerate() {
            if unit.urdf.place(link).is_none_or(|p| p.body != 0) {
                return Err(unit.unknown_link(format!("carried_by.links[{i}]"), link));
            }
        }
        Ok(Self {
            trolley: Some(Box::new(trolley)),
            ..unit
        })
    }

    fn load_one(path: &Path) -> Result<Self, Error> {
        let file: UnitFile = read_yaml(path)?;
        let urdf = UrdfUnit::load(&named(path, "urdf", &file.urdf)?)?;
        let mut unit = Self {
            path: path.into(),
            stations: vec![Vec::new(); urdf.bodies.len()],
            file,
            urdf,
            drive: None,
            trolley: None,
            max_speed_mps: f64::INFINITY,
        };
        for body in 0..unit.stations.len() {
            unit.stations[body] = unit.stations_of(body)?;
        }
        if unit.file.carried_by.is_some() && !unit.stations[0].is_empty() {
            return Err(input_error(
                path,
                "carried_by",
                "a unit with its own running wheels cannot hang from another unit",
                "remove either carried_by or the wheels",
            ));
        }
        unit.add_drive()?;
        unit.check_connections()?;
        Ok(unit)
    }

    /// Returns a link that must exist.
    pub(crate) fn link(&self, name: &str) -> Result<&LinkPlace, Error> {
        self.urdf
            .place(name)
            .ok_or_else(|| self.unknown_link("urdf".into(), name))
    }

    /// Error for a missing link.
    pub(crate) fn unknown_link(&self, key: String, name: &str) -> Error {
        let known: Vec<&str> = self.urdf.places.iter().map(|p| p.link.as_str()).collect();
        input_error(
            &self.path,
            key,
            format!("the URDF has no suitable link `{name}`"),
            format!("its links are: {}", known.join(", ")),
        )
    }

    fn check_connections(&self) -> Result<(), Error> {
        for (i, c) in self.file.connections.iter().enumerate() {
            for (key, link) in [("from", &c.from), ("to", &c.to)] {
                if self.urdf.place(link).is_none() {
                    return Err(self.unknown_link(format!("connections[{i}].{key}"), link));
                }
            }
        }
        let body = |link: &String| self.urdf.place(link).map(|p| p.body);
        let held = |b: usize| {
            self.file
                .connections
                .iter()
                .any(|c| (body(&c.from) == Some(b)) != (body(&c.to) == Some(b)))
        };
        match (1..self.urdf.bodies.len()).find(|b| !held(*b)) {
            Some(b) => {
                let message = format!(
                    "nothing holds `{}`, which has a floating joint",
                    self.urdf.bodies[b].root
                );
                Err(input_error(
                    &self.path,
                    "connections",
                    message,
                    "a hanger, drawbar or chain to a link of another body",
                ))
            }
            None => Ok(()),
        }
    }

    /// Running wheels in pairs at the same x; guide wheels go to the nearest pair.
    fn stations_of(&self, body: usize) -> Result<Vec<Station>, Error> {
        let named = |prefix: &'static str| {
            self.urdf
                .places
                .iter()
                .filter(move |p| p.body == body && p.link.starts_with(prefix))
        };
        let mut wheels: Vec<&LinkPlace> = named("running_wheel").collect();
        if wheels.is_empty() {
            return Ok(Vec::new());
        }
        let urdf = self.path.with_file_name("").join(&self.file.urdf);
        let fault = |message: String, help: &str| Err(input_error(&urdf, "", message, help));
        let Some(gear) = self.file.running_gear else {
            return Err(input_error(
                &self.path,
                "running_gear",
                "missing, though the URDF has running wheels",
                "stiffness and damping of wheels and guides, holddown_play_m",
            ));
        };
        wheels.sort_by(|a, b| a.pose.translation.x.total_cmp(&b.pose.translation.x));
        let mut stations = Vec::new();
        for pair in wheels.chunks(2) {
            let help = "running_wheel… links come in pairs: same x, y mirrored, same cylinder";
            let [a, b] = pair else {
                return fault(
                    format!("running wheel `{}` has no partner", pair[0].link),
                    help,
                );
            };
            let ([xa, ya], [xb, yb]) = (
                a.pose.translation.vector.xy().into(),
                b.pose.translation.vector.xy().into(),
            );
            let (Some(radius), true) = (a.radius_m, a.radius_m == b.radius_m) else {
                return fault(
                    format!(
                        "running wheels `{}` and `{}` are not the same cylinder",
                        a.link, b.link
                    ),
                    help,
                );
            };
            if f64::abs(xa - xb) > 1e-6 || f64::abs(ya + yb) > 1e-6 || f64::abs(ya) < 1e-3 {
                return fault(
                    format!(
                        "running wheels `{}` and `{}` are not a pair",
                        a.link, b.link
                    ),
                    help,
                );
            }
            stations.push(Station {
                x_m: xa,
                half_gauge_m: f64::abs(ya),
                wheel_radius_m: radius,
                wheel_k: gear.wheel_stiffness_npm.get(),
                wheel_c: gear.wheel_damping_nspm.get(),
                holddown_play_m: gear.holddown_play_m.get(),
                guide_k: gear.guide_stiffness_npm.get(),
                guide_c: gear.guide_damping_nspm.get(),
                guide_z_m: f64::NAN,
            });
        }
        if stations.len() < 2 {
            return fault(
                "one pair of running wheels cannot keep a body level".into(),
                "two pairs, front and rear",
            );
        }
        let xs: Vec<f64> = stations.iter().map(|s| s.x_m).collect();
        for (i, station) in stations.iter_mut().enumerate() {
            let here = |p: &&LinkPlace| {
                let away = |x: &f64| (x - p.pose.translation.x).abs();
                xs.iter().all(|x| away(&xs[i]) <= away(x))
            };
            let z: Vec<f64> = named("guide_wheel")
                .filter(here)
                .map(|p| p.pose.translation.z)
                .collect();
            if z.is_empty() {
                return fault(
                    format!("no guide wheel near the running wheels at x = {} m", xs[i]),
                    "guide_wheel… links beside each pair of running wheels",
                );
            }
            station.guide_z_m = z.iter().sum::<f64>() / z.len() as f64;
        }
        Ok(stations)
    }

    fn add_drive(&mut self) -> Result<(), Error> {
        let wheels = &self.urdf.friction_wheels;
        let Some(d) = self.file.drive else {
            return match wheels.first() {
                None => Ok(()),
                Some(_) => Err(input_error(
                    &self.path,
                    "drive",
                    "missing, though the URDF has friction wheels",
                    "motor, gear, clamp, friction, brake",
                )),
            };
        };
        let urdf = self.path.with_file_name("").join(&self.file.urdf);
        let fault = |message: &str| {
            input_error(
                &urdf,
                "",
                message,
                "two links on continuous joints, one left and one right of the web, same x, z and cylinder",
            )
        };
        let [a, b] = wheels.as_slice() else {
            return Err(fault(&format!(
                "the number of friction wheels is {}, not 2",
                wheels.len()
            )));
        };
        let (pa, pb) = (&self.urdf.places[a.place], &self.urdf.places[b.place]);
        let (ta, tb) = (pa.pose.translation.vector, pb.pose.translation.vector);
        let mirrored = (ta - Vector3::new(tb.x, -tb.y, tb.z)).norm() < 1e-6 && ta.y.abs() > 1e-3;
        let same = (a.inertia - b.inertia).abs() <= 1e-9 * a.inertia;
        let (Some(radius), true) = (
            pa.radius_m,
            mirrored && same && pa.radius_m == pb.radius_m && pa.body == pb.body,
        ) else {
            return Err(fault("the friction wheels are not a pair"));
        };
        if self.stations[pa.body].is_empty() {
            return Err(fault("friction wheels on a body without running wheels"));
        }
        let share = |value: Fraction, key: &str| match value.get() {
            x if x > 0.0 => Ok(x),
            _ => Err(input_error(
                &self.path,
                key,
                "this gear transmits no power",
                "a share above 0, at most 1",
            )),
        };
        let drive = Drive {
            body: pa.body,
            contact: 0.5 * (ta + tb),
            wheel_radius_m: radius,
            wheel_inertia: a.inertia,
            motor_inertia: d.motor.inertia_kgm2.get(),
            gear_ratio: d.gear.ratio.get(),
            efficiency_drive: share(d.gear.efficiency_drive, "drive.gear.efficiency_drive")?,
            efficiency_brake: share(d.gear.efficiency_brake, "drive.gear.efficiency_brake")?,
            torque_max_nm: d.motor.torque_max_nm.get(),
            power_w: 1e3 * d.motor.power_kw.get(),
            speed_max_radps: d.motor.speed_max_rpm.get() * std::f64::consts::TAU / 60.0,
            lag_s: d.motor.lag_s.get(),
            rate_nmps: d.motor.torque_rate_nmps.get(),
            piston_area_m2: 0.25
                * std::f64::consts::PI
                * d.clamp.piston_diameter_m.get()
                * d.clamp.piston_diameter_m.get(),
            clamp_mpa: d.clamp.pressure_mpa.get(),
            clamp_lag_s: d.clamp.lag_s.get(),
            adhesion: d.friction.adhesion.get(),
            sigma0: d.friction.sigma0_npm.get(),
            sigma1: d.friction.sigma1_nspm.get(),
            kappa: d.friction.kappa_1pm.get(),
            brake_max_n: d.brake.force_max_n.get(),
            brake_lag_s: d.brake.lag_s.get(),
        };
        let rate_max = a.rate_max_radps.min(b.rate_max_radps);
        let effort = a.torque_max_nm.min(b.torque_max_nm);
        check_wheel_limits(&self.path, "drive", &drive, rate_max, effort)?;
        self.max_speed_mps = radius * rate_max.min(drive.speed_max_radps / drive.gear_ratio);
        self.drive = Some(drive);
        Ok(())
    }

    /// The highest torque of one friction wheel, N·m, by the URDF.
    pub(crate) fn wheel_torque_max_nm(&self) -> f64 {
        self.urdf
            .friction_wheels
            .iter()
            .map(|w| w.torque_max_nm)
            .fold(f64::INFINITY, f64::min)
    }

    /// The highest rate of a friction wheel, rad/s, by the URDF.
    pub(crate) fn wheel_rate_max_radps(&self) -> f64 {
        self.urdf
            .friction_wheels
            .iter()
            .map(|w| w.rate_max_radps)
            .fold(f64::INFINITY, f64::min)
    }

    /// A load's payload and lifting gear, in the body frame.
    pub(crate) fn payload(&self, link: &str) -> Option<(MassProperties, MassProperties)> {
        let payload = self.urdf.place(link)?.mass?;
        let others = self
            .urdf
            .places
            .iter()
            .filter(|p| p.body == 0 && p.link != link);
        let gear = others
            .filter_map(|p| p.mass)
            .fold(MassProperties::zero(), |sum, m| sum.plus(&m));
        (gear.mass_kg > 0.0).then_some((payload, gear))
    }
}

/// Checks that the motor stays within the limits of the wheels' joints in the URDF.
pub(super) fn check_wheel_limits(
    path: &Path,
    key: &str,
    drive: &Drive,
    rate_max: f64,
    torque_max: f64,
) -> Result<(), Error> {
    let rate = drive.speed_max_radps / drive.gear_ratio;
    if rate > rate_max * 1.001 {
        let message = format!("the motor turns the friction wheels at up to {rate:.2} rad/s");
        return Err(input_error(
            path,
            key,
            message,
            format!("the URDF joint allows {rate_max} rad/s"),
        ));
    }
    let torque = 0.5 * drive.torque_max_nm * drive.gear_ratio;
    if torque > torque_max * 1.001 {
        let message = format!("the motor gives each friction wheel up to {torque:.0} N·m");
        return Err(input_error(
            path,
            key,
            message,
            format!("the URDF joint allows {torque_max} N·m"),
        ));
    }
    Ok(())
}
