//! Signals between the rig and an estimator, as Python sees them.

use crate::class::python_class;
use crate::errors::refused;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{
    self, MAX_AUXILIARY, MAX_DRIVES, Measurand, Sample, Slot, Value,
};
use pyo3::prelude::*;

/// Value, standard deviation, valid.
pub(crate) type Triple = (f64, f64, bool);

/// New samples since the last step. A field is `None` where there is no new sample.
#[pyclass(frozen, module = "monorig", skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct Measurements {
    pub(crate) z: signals::Measurements,
    pub(crate) u: signals::Command,
    pub(crate) drives: usize,
}

fn three(v: [f64; 3]) -> (f64, f64, f64) {
    (v[0], v[1], v[2])
}

type PerUnit = [Option<Sample<f64>>];

fn values(of: &PerUnit, count: usize) -> Vec<Option<f64>> {
    of.iter().take(count).map(|s| s.map(|s| s.value)).collect()
}

/// One value a drive unit, as Python gives them.
fn put(to: &mut PerUnit, t: Time, from: Option<Vec<Option<f64>>>, what: &str) -> PyResult<usize> {
    let from = from.unwrap_or_default();
    if from.len() > to.len() {
        let most = to.len();
        return Err(refused(
            format!("{what} has {} values", from.len()),
            format!("at most {most}"),
        ));
    }
    for (to, value) in to.iter_mut().zip(&from) {
        *to = value
            .filter(|x| !x.is_nan())
            .map(|value| Sample { t, value });
    }
    Ok(from.len())
}

python_class! {
    Measurements, self => {
        t_ns: i64 = self.z.t.ns();
        t_s: f64 = self.z.t.s();
        specific_force: Option<(f64, f64, f64)> = self.z.specific_force_mps2.map(|s| three(s.value));
        angular_rate: Option<(f64, f64, f64)> = self.z.angular_rate_radps.map(|s| three(s.value));
        motor_torque: Vec<Option<f64>> = values(&self.z.motor_torque_nm, self.drives);
        wheel_speed: Vec<Option<f64>> = values(&self.z.wheel_speed_mps, self.drives);
        clamp_pressure: Vec<Option<f64>> = values(&self.z.clamp_pressure_mpa, self.drives);
        inclination: Option<f64> = self.z.inclination_rad.map(|s| s.value);
        steering_angle: Option<f64> = self.z.steering_angle_rad.map(|s| s.value);
        auxiliary: Vec<Option<f64>> = values(&self.z.auxiliary, MAX_AUXILIARY);
        command: Command = Command::of(&self.u, self.drives);
    }
    #[new]
    #[pyo3(signature = (t_ns, *, specific_force=None, angular_rate=None, motor_torque=None, wheel_speed=None,
        clamp_pressure=None, inclination=None, steering_angle=None, auxiliary=None, command=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        t_ns: i64,
        specific_force: Option<[f64; 3]>,
        angular_rate: Option<[f64; 3]>,
        motor_torque: Option<Vec<Option<f64>>>,
        wheel_speed: Option<Vec<Option<f64>>>,
        clamp_pressure: Option<Vec<Option<f64>>>,
        inclination: Option<f64>,
        steering_angle: Option<f64>,
        auxiliary: Option<Vec<Option<f64>>>,
        command: Option<&Command>,
    ) -> PyResult<Self> {
        let t = Time::from_ns(t_ns);
        let mut z = signals::Measurements::at(t);
        z.specific_force_mps2 = specific_force.map(|value| Sample { t, value });
        z.angular_rate_radps = angular_rate.map(|value| Sample { t, value });
        z.inclination_rad = inclination.map(|value| Sample { t, value });
        z.steering_angle_rad = steering_angle.map(|value| Sample { t, value });
        let mut drives = 1;
        drives = drives.max(put(
            &mut z.motor_torque_nm,
            t,
            motor_torque,
            "motor_torque",
        )?);
        drives = drives.max(put(&mut z.wheel_speed_mps, t, wheel_speed, "wheel_speed")?);
        drives = drives.max(put(
            &mut z.clamp_pressure_mpa,
            t,
            clamp_pressure,
            "clamp_pressure",
        )?);
        put(&mut z.auxiliary, t, auxiliary, "auxiliary")?;
        let u = command.map_or_else(signals::Command::default, |c| {
            c.over(&signals::Command::default())
        });
        Ok(Self { z, u, drives })
    }
    /// The instant at which the sample was taken, ns; None where there is no new one.
    #[pyo3(signature = (name, index=0))]
    fn stamp_ns(&self, name: &str, index: usize) -> PyResult<Option<i64>> {
        let measurand = Measurand::named(name).ok_or_else(|| {
            let names: Vec<&str> = Measurand::ALL.iter().map(|m| m.name()).collect();
            refused(format!("nothing measures `{name}`"), names.join(", "))
        })?;
        if index >= measurand.shape().slots() {
            return Err(refused(
                format!("{name} has no sample {index}"),
                "samples count from 0",
            ));
        }
        let slot: Slot = measurand.slot(index);
        Ok(slot.get(&self.z).map(|s| s.t.ns()))
    }
    fn __repr__(&self) -> String {
        format!("Measurements(t_s={}, {} drives)", self.z.t.s(), self.drives)
    }
}

/// An estimate: (value, standard deviation, valid) of each quantity.
#[pyclass(frozen, eq, module = "monorig", skip_from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Estimate(pub(crate) signals::Estimate);

fn value((value, sd, valid): Triple) -> Value {
    Value { value, sd, valid }
}

fn triple(v: Value) -> Triple {
    (v.value, v.sd, v.valid)
}

const NONE: Triple = (0.0, 0.0, false);

python_class! {
    Estimate, self => {
        t_ns: i64 = self.0.t.ns();
        total_mass: Triple = triple(self.0.total_mass_kg);
        grade: Triple = triple(self.0.grade_rad);
        effective_grade: Triple = triple(self.0.effective_grade_rad);
        speed: Triple = triple(self.0.speed_mps);
        innovation: f64 = self.0.innovation;
        nis: f64 = self.0.nis;
        protection: (f64, f64, f64) = (self.0.protection.total_mass_kg, self.0.protection.grade_rad,
            self.0.protection.effective_grade_rad);
        flags: (bool, bool, bool) = (self.0.flags.moving, self.0.flags.excited, self.0.flags.saturated);
    }
    #[new]
    #[pyo3(signature = (*, total_mass=NONE, grade=NONE, effective_grade=None, speed=NONE, innovation=0.0, nis=0.0,
        flags=(false, false, false), t_ns=0, protection=(0.0, 0.0, 0.0)))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        total_mass: Triple,
        grade: Triple,
        effective_grade: Option<Triple>,
        speed: Triple,
        innovation: f64,
        nis: f64,
        flags: (bool, bool, bool),
        t_ns: i64,
        protection: (f64, f64, f64),
    ) -> Self {
        let (total_mass_kg, grade_rad, effective_grade_rad) = protection;
        Self(signals::Estimate {
            protection: signals::Protection {
                total_mass_kg,
                grade_rad,
                effective_grade_rad,
            },
            t: Time::from_ns(t_ns),
            total_mass_kg: value(total_mass),
            grade_rad: value(grade),
            effective_grade_rad: value(effective_grade.unwrap_or(grade)),
            speed_mps: value(speed),
            innovation,
            nis,
            flags: signals::Flags {
                moving: flags.0,
                excited: flags.1,
                saturated: flags.2,
            },
        })
    }
    fn __repr__(&self) -> String {
        let of = |v: Value| {
            format!(
                "({}, {}, {})",
                v.value,
                v.sd,
                if v.valid { "True" } else { "False" }
            )
        };
        let e = &self.0;
        format!(
            "Estimate(total_mass={}, grade={}, effective_grade={}, speed={})",
            of(e.total_mass_kg),
            of(e.grade_rad),
            of(e.effective_grade_rad),
            of(e.speed_mps)
        )
    }
}

/// A command to the train; what is None stays as the events of the scenario ask.
#[pyclass(frozen, eq, module = "monorig", get_all, skip_from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Command {
    /// Motor torque of each drive unit, N·m.
    motor_torque: Vec<f64>,
    /// Clamp pressure, MPa.
    clamp_pressure: Option<f64>,
    /// Share of the brake force, 0…1.
    brake: Option<f64>,
}

#[pymethods]
impl Command {
    #[new]
    #[pyo3(signature = (motor_torque, *, clamp_pressure=None, brake=None))]
    fn new(
        motor_torque: Vec<f64>,
        clamp_pressure: Option<f64>,
        brake: Option<f64>,
    ) -> PyResult<Self> {
        if motor_torque.len() > MAX_DRIVES {
            let told = format!("{} torques", motor_torque.len());
            return Err(refused(
                told,
                format!("at most {MAX_DRIVES}, one a drive unit"),
            ));
        }
        Ok(Self {
            motor_torque,
            clamp_pressure,
            brake,
        })
    }
    fn __repr__(&self) -> String {
        format!("Command({:?})", self.motor_torque)
    }
}

impl Command {
    fn of(u: &signals::Command, drives: usize) -> Self {
        Self {
            motor_torque: u.motor_torque_nm.iter().take(drives).copied().collect(),
            clamp_pressure: Some(u.clamp_pressure_mpa),
            brake: Some(u.brake),
        }
    }

    /// The command of the rig: what is not said is that of `base`.
    fn over(&self, base: &signals::Command) -> signals::Command {
        let mut u = *base;
        for (to, from) in u.motor_torque_nm.iter_mut().zip(&self.motor_torque) {
            *to = *from;
        }
        u.clamp_pressure_mpa = self.clamp_pressure.unwrap_or(u.clamp_pressure_mpa);
        u.brake = self.brake.unwrap_or(u.brake);
        u
    }

    /// The command that Python gives: a `Command`, one torque for all drive units, or one for each.
    pub(crate) fn from_python(
        said: &Bound<'_, PyAny>,
        base: &signals::Command,
        drives: usize,
    ) -> PyResult<signals::Command> {
        let help =
            "use a Command, a torque (N·m) for all drive units, or a list with a torque for each";
        let command = if let Ok(command) = said.cast::<Self>() {
            command.get().clone()
        } else if let Ok(torque) = said.extract::<f64>() {
            Self::new(vec![torque; drives], None, None)?
        } else if let Ok(torques) = said.extract::<Vec<f64>>() {
            Self::new(torques, None, None)?
        } else {
            return Err(refused(format!("{} is not a command", kind(said)), help));
        };
        if command.motor_torque.len() != drives {
            let told = format!(
                "{} torques for {drives} drive units",
                command.motor_torque.len()
            );
            return Err(refused(told, help));
        }
        let u = command.over(base);
        let mut numbers = u
            .motor_torque_nm
            .iter()
            .chain([&u.clamp_pressure_mpa, &u.brake]);
        match numbers.all(|x| x.is_finite()) {
            true => Ok(u),
            false => Err(refused("a number of the command is not finite", help)),
        }
    }
}

/// The name of an object's type, for messages.
pub(crate) fn kind(object: &Bound<'_, PyAny>) -> String {
    object
        .get_type()
        .name()
        .map_or_else(|_| "this".into(), |name| name.to_string())
}
