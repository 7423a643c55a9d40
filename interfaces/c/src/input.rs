//! Measurements and command of a step.

use monorig_estimators::api::signals::{Command, MAX_AUXILIARY, MAX_DRIVES, Measurements, Sample};
use monorig_estimators::{Real, Time};

/// Stamp of a sample that did not come.
const NONE: i64 = i64::MIN;

/// A measured value with its stamp.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct StampedValue<T> {
    t_ns: i64,
    value: T,
}

/// A measured value: `monorig_sample`.
pub type Value = StampedValue<f64>;
/// Three measured values: `monorig_sample3`.
pub type Triple = StampedValue<[f64; 3]>;

impl<T: Default> Default for StampedValue<T> {
    fn default() -> Self {
        Self {
            t_ns: NONE,
            value: T::default(),
        }
    }
}

impl<T: Copy> StampedValue<T> {
    fn put(&mut self, sample: &Option<Sample<T>>) {
        match sample {
            Some(s) => (self.t_ns, self.value) = (s.t.ns(), s.value),
            None => self.t_ns = NONE,
        }
    }

    fn get(&self) -> Option<Sample<T>> {
        (self.t_ns != NONE).then(|| Sample {
            t: Time::from_ns(self.t_ns),
            value: self.value,
        })
    }
}

/// New samples and command: `monorig_input`.
#[repr(C)]
#[derive(Clone, Copy)]
#[allow(missing_docs)] // the header has them
pub struct Input {
    pub size: u64,
    pub t_ns: i64,
    pub dt_s: f64,
    pub specific_force_mps2: Triple,
    pub angular_rate_radps: Triple,
    pub steering_angle_rad: Value,
    pub inclination_rad: Value,
    pub auxiliary: [Value; MAX_AUXILIARY],
    pub motor_torque_nm: [Value; MAX_DRIVES],
    pub wheel_speed_mps: [Value; MAX_DRIVES],
    pub clamp_pressure_mpa: [Value; MAX_DRIVES],
    pub command_clamp_pressure_mpa: f64,
    pub command_brake: f64,
    pub command_motor_torque_nm: [f64; MAX_DRIVES],
}

impl Default for Input {
    fn default() -> Self {
        Self {
            size: size_of::<Self>() as u64,
            t_ns: 0,
            dt_s: 0.0,
            specific_force_mps2: Triple::default(),
            angular_rate_radps: Triple::default(),
            steering_angle_rad: Value::default(),
            inclination_rad: Value::default(),
            auxiliary: [Value::default(); MAX_AUXILIARY],
            motor_torque_nm: [Value::default(); MAX_DRIVES],
            wheel_speed_mps: [Value::default(); MAX_DRIVES],
            clamp_pressure_mpa: [Value::default(); MAX_DRIVES],
            command_clamp_pressure_mpa: 0.0,
            command_brake: 0.0,
            command_motor_torque_nm: [0.0; MAX_DRIVES],
        }
    }
}

impl Input {
    /// Overwrites the previous step, only for existing drive units, so that the others stay without samples.
    pub fn fill(&mut self, z: &Measurements, u: &Command, dt_s: Real, drives: usize) {
        (self.t_ns, self.dt_s) = (z.t.ns(), dt_s);
        self.specific_force_mps2.put(&z.specific_force_mps2);
        self.angular_rate_radps.put(&z.angular_rate_radps);
        self.steering_angle_rad.put(&z.steering_angle_rad);
        self.inclination_rad.put(&z.inclination_rad);
        let auxiliary = self.auxiliary.iter_mut().zip(&z.auxiliary);
        auxiliary.for_each(|(to, from)| to.put(from));
        for (all, from) in [
            (&mut self.motor_torque_nm, &z.motor_torque_nm),
            (&mut self.wheel_speed_mps, &z.wheel_speed_mps),
            (&mut self.clamp_pressure_mpa, &z.clamp_pressure_mpa),
        ] {
            let there = all.iter_mut().zip(from).take(drives);
            there.for_each(|(to, from)| to.put(from));
        }
        self.command_clamp_pressure_mpa = u.clamp_pressure_mpa;
        self.command_brake = u.brake;
        let torques = self.command_motor_torque_nm.iter_mut();
        let torques = torques.zip(&u.motor_torque_nm).take(drives);
        torques.for_each(|(to, from)| *to = *from);
    }

    /// Measurements, command and time step for a vehicle with this number of drive units.
    pub fn read(&self, drives: usize) -> (Measurements, Command, Real) {
        let mut z = Measurements::at(Time::from_ns(self.t_ns));
        z.specific_force_mps2 = self.specific_force_mps2.get();
        z.angular_rate_radps = self.angular_rate_radps.get();
        z.steering_angle_rad = self.steering_angle_rad.get();
        z.inclination_rad = self.inclination_rad.get();
        let auxiliary = z.auxiliary.iter_mut().zip(&self.auxiliary);
        auxiliary.for_each(|(to, from)| *to = from.get());
        for (to, all) in [
            (&mut z.motor_torque_nm, &self.motor_torque_nm),
            (&mut z.wheel_speed_mps, &self.wheel_speed_mps),
            (&mut z.clamp_pressure_mpa, &self.clamp_pressure_mpa),
        ] {
            let there = to.iter_mut().zip(all).take(drives);
            there.for_each(|(to, from)| *to = from.get());
        }
        let mut u = Command {
            clamp_pressure_mpa: self.command_clamp_pressure_mpa,
            brake: self.command_brake,
            ..Command::default()
        };
        let torques = u.motor_torque_nm.iter_mut();
        let torques = torques.zip(&self.command_motor_torque_nm).take(drives);
        torques.for_each(|(to, from)| *to = *from);
        (z, u, self.dt_s)
    }
}
