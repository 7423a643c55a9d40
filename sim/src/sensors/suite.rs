//! All instruments of a train, from data sheet to measurements.

use super::accelerometer::{self, Accelerometer};
use super::fault::{self, Window};
use super::gyro::{self, Gyro};
use super::instrument::StepInterval;
use super::per_drive::{Ideal, PerDrive};
use super::sampling::to_ns;
use super::steering_angle::{self, SteeringAngle};
use super::{Sensors, clamp_pressure, motor_torque, wheel_speed};
use crate::config::file::input_error;
use crate::config::scenario::Event;
use crate::config::sensor_sheet::Sheet;
use crate::config::sensor_sheet_file::{PlainSensor, Sampling};
use crate::error::Error;
use crate::plant::{MountState, Truth};
use crate::train::Train;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{MAX_DRIVES, Measurements};
use std::path::Path;

/// Name in events for accelerometer and gyro together.
const IMU: &str = "imu";

/// All instruments of a train during one run.
#[derive(Clone, Debug)]
pub struct Suite {
    /// Instant of the last look, ns, and how the mounts moved then.
    last_ns: Option<i64>,
    accelerometer: Option<(Accelerometer, Option<MountState>)>,
    gyro: Option<(Gyro, Option<MountState>)>,
    motor_torque: Option<PerDrive>,
    wheel_speed: Option<PerDrive>,
    clamp_pressure: Option<PerDrive>,
    steering_angle: Option<SteeringAngle>,
    mounts: usize,
    drives: usize,
    rates: Vec<(&'static str, f64)>,
    sheet: Sheet,
}

impl Suite {
    /// The instruments of a sheet on a train. The same seed gives the same errors, bit for bit.
    pub fn new(sheet: &Sheet, train: &Train, gravity_mps2: f64, seed: u64) -> Result<Self, Error> {
        let d = &sheet.data;
        if train.drives.len() > MAX_DRIVES {
            return Err(sheet.wrong(
                "",
                format!(
                    "the train `{}` has {} drive units",
                    train.name,
                    train.drives.len()
                ),
                format!("measurements have room for {MAX_DRIVES}"),
            ));
        }
        let accelerometer = match &d.accelerometer {
            Some(s) => {
                let mount = sheet.find_mount(train, accelerometer::NAME, &s.mount)?;
                Some((Accelerometer::new(s, mount, gravity_mps2, seed), None))
            }
            None => None,
        };
        let gyro = match &d.gyro {
            Some(s) => Some((
                Gyro::new(s, sheet.find_mount(train, gyro::NAME, &s.mount)?, seed),
                None,
            )),
            None => None,
        };
        let per_drive = |name: &str, sensor: &Option<PlainSensor>, ideal: Ideal| {
            sensor
                .as_ref()
                .map(|s| PerDrive::new(name, s, ideal, &train.drives, seed))
        };
        let rate = |name, sampling: Option<&Sampling>| sampling.map(|s| (name, s.rate_hz.get()));
        let rates = [
            rate(
                accelerometer::NAME,
                d.accelerometer.as_ref().map(|s| &s.sampling),
            ),
            rate(gyro::NAME, d.gyro.as_ref().map(|s| &s.sampling)),
            rate(
                motor_torque::NAME,
                d.motor_torque.as_ref().map(|s| &s.sampling),
            ),
            rate(
                wheel_speed::NAME,
                d.wheel_speed.as_ref().map(|s| &s.sampling),
            ),
            rate(
                clamp_pressure::NAME,
                d.clamp_pressure.as_ref().map(|s| &s.sampling),
            ),
            rate(
                steering_angle::NAME,
                d.steering_angle.as_ref().map(|s| &s.sampling),
            ),
        ];
        Ok(Self {
            last_ns: None,
            accelerometer,
            gyro,
            motor_torque: per_drive(motor_torque::NAME, &d.motor_torque, motor_torque::ideal),
            wheel_speed: per_drive(wheel_speed::NAME, &d.wheel_speed, wheel_speed::ideal),
            clamp_pressure: per_drive(
                clamp_pressure::NAME,
                &d.clamp_pressure,
                clamp_pressure::ideal,
            ),
            steering_angle: d
                .steering_angle
                .as_ref()
                .map(|s| SteeringAngle::new(s, seed)),
            mounts: train.mounts.len(),
            drives: train.drives.len(),
            rates: rates.into_iter().flatten().collect(),
            sheet: sheet.clone(),
        })
    }

    /// Whether a physics step can serve every sensor: at most one sample a step.
    pub fn check_step(&self, dt_s: f64) -> Result<(), Error> {
        for (name, rate_hz) in &self.rates {
            if rate_hz * dt_s > 1.0 + 1e-9 {
                return Err(self.sheet.wrong(
                    format!("{name}.sampling.rate_hz"),
                    format!(
                        "{rate_hz} Hz is more than one sample per physics step of {} ms",
                        libm::round(dt_s * 1e6) / 1e3
                    ),
                    format!(
                        "at most {} Hz, or a smaller `physics.dt_ms` in the scenario",
                        libm::floor(1e3 / dt_s) / 1e3
                    ),
                ));
            }
        }
        Ok(())
    }

    /// Take the sensor faults out of a scenario's events; `scenario` is named in errors.
    pub fn add_faults(&mut self, scenario: &Path, events: &[Event]) -> Result<(), Error> {
        for (index, event) in events.iter().enumerate() {
            if let Some((sensor, window)) = fault::read(scenario, index, event)?
                && !self.add_fault(sensor, window)
            {
                return Err(input_error(
                    scenario,
                    format!("events[{index}].sensor"),
                    format!("no sensor `{sensor}` is fitted"),
                    format!("known here: {}", self.names().join(", ")),
                ));
            }
        }
        Ok(())
    }

    /// Index in `Train::mounts` of the accelerometer's place, else the gyro's.
    pub fn imu_mount(&self) -> Option<usize> {
        let accelerometer = self.accelerometer.as_ref().map(|(a, _)| a.mount);
        accelerometer.or(self.gyro.as_ref().map(|(g, _)| g.mount))
    }

    /// What `measure` would have put out last without errors of the sensors: same samples, same stamps.
    pub fn ideal(&self) -> Measurements {
        let mut z = Measurements {
            t: Time::from_ns(self.last_ns.unwrap_or(0)),
            specific_force_mps2: self
                .accelerometer
                .as_ref()
                .and_then(|(a, _)| a.instrument.ideal()),
            angular_rate_radps: self.gyro.as_ref().and_then(|(g, _)| g.instrument.ideal()),
            steering_angle_rad: self.steering_angle.as_ref().and_then(SteeringAngle::ideal),
            ..Measurements::default()
        };
        let per_drive = [
            (&self.motor_torque, &mut z.motor_torque_nm),
            (&self.wheel_speed, &mut z.wheel_speed_mps),
            (&self.clamp_pressure, &mut z.clamp_pressure_mpa),
        ];
        for (sensors, out) in per_drive {
            if let Some(sensors) = sensors {
                sensors.ideal(out);
            }
        }
        z
    }

    /// Names an event can use on this train. Units count from 0 at the front, as in [`Measurements`].
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        let (accelerometer, gyro) = (self.accelerometer.is_some(), self.gyro.is_some());
        for (name, fitted) in [
            (IMU, accelerometer || gyro),
            (accelerometer::NAME, accelerometer),
            (gyro::NAME, gyro),
        ] {
            if fitted {
                names.push(name.to_string());
            }
        }
        for (name, sensors) in [
            (motor_torque::NAME, &self.motor_torque),
            (wheel_speed::NAME, &self.wheel_speed),
            (clamp_pressure::NAME, &self.clamp_pressure),
        ] {
            if let Some(sensors) = sensors {
                names.push(name.to_string());
                names.extend((0..sensors.count()).map(|i| format!("{name}[{i}]")));
            }
        }
        if self.steering_angle.is_some() {
            names.push(steering_angle::NAME.to_string());
        }
        names
    }

    /// Whether there is a sensor of this name; it gets the fault.
    fn add_fault(&mut self, sensor: &str, window: Window) -> bool {
        if !self.names().iter().any(|n| n == sensor) {
            return false;
        }
        let (name, unit) = match sensor.split_once('[') {
            Some((name, rest)) => (name, rest.trim_end_matches(']').parse().ok()),
            None => (sensor, None),
        };
        if let (Some((a, _)), IMU | accelerometer::NAME) = (&mut self.accelerometer, name) {
            a.instrument.add_fault(window);
        }
        if let (Some((g, _)), IMU | gyro::NAME) = (&mut self.gyro, name) {
            g.instrument.add_fault(window);
        }
        if let (Some(s), steering_angle::NAME) = (&mut self.steering_angle, name) {
            s.add_fault(window);
        }
        for (own, sensors) in [
            (motor_torque::NAME, &mut self.motor_torque),
            (wheel_speed::NAME, &mut self.wheel_speed),
            (clamp_pressure::NAME, &mut self.clamp_pressure),
        ] {
            if let (true, Some(sensors)) = (own == name, sensors) {
                sensors.add_fault(unit, window);
            }
        }
        true
    }

    /// The stretch of time since the last look. Time must not run backwards, and the truth must be this train's.
    fn span(&mut self, truth: &Truth) -> Result<StepInterval, Error> {
        let broken = |what: String| Error::Broken {
            t_s: truth.t_s,
            what,
        };
        if truth.mounts.len() != self.mounts || truth.drives.len() != self.drives {
            return Err(broken(format!(
                "the sensors are on a train with {} links and {} drive units, the truth has {} and {}",
                self.mounts,
                self.drives,
                truth.mounts.len(),
                truth.drives.len()
            )));
        }
        if !truth.t_s.is_finite() {
            return Err(broken("the time is not finite".into()));
        }
        let to_ns = to_ns(truth.t_s);
        let from_ns = self.last_ns.replace(to_ns).unwrap_or(to_ns);
        if to_ns < from_ns {
            return Err(broken(format!(
                "the sensors had already seen t = {} s",
                from_ns as f64 * 1e-9
            )));
        }
        Ok(StepInterval { from_ns, to_ns })
    }
}

impl Sensors for Suite {
    fn measure(&mut self, truth: &Truth, z: &mut Measurements) -> Result<(), Error> {
        let span = self.span(truth)?;
        z.t = Time::from_s(truth.t_s);
        if let Some((sensor, last)) = &mut self.accelerometer {
            let now = truth.mounts[sensor.mount];
            let before = last.replace(now).unwrap_or(now);
            sensor.observe(span, &before, &now)?;
            z.specific_force_mps2 = sensor.instrument.deliver(span.to_ns);
        }
        if let Some((sensor, last)) = &mut self.gyro {
            let now = truth.mounts[sensor.mount];
            let before = last.replace(now).unwrap_or(now);
            sensor.observe(span, &before, &now)?;
            z.angular_rate_radps = sensor.instrument.deliver(span.to_ns);
        }
        if let Some(sensors) = &mut self.motor_torque {
            sensors.measure(span, &truth.drives, &mut z.motor_torque_nm)?;
        }
        if let Some(sensors) = &mut self.wheel_speed {
            sensors.measure(span, &truth.drives, &mut z.wheel_speed_mps)?;
        }
        if let Some(sensors) = &mut self.clamp_pressure {
            sensors.measure(span, &truth.drives, &mut z.clamp_pressure_mpa)?;
        }
        if let Some(sensor) = &mut self.steering_angle {
            z.steering_angle_rad = sensor.measure(span, truth)?;
        }
        Ok(())
    }
}
