//! All instruments of a vehicle: their order, the checks of time and vehicle, faults by name.

use super::fault::{Fault, FaultWindow};
use super::fitting::Fitting;
use super::instrument::{Instrument, SensorChannel};
use super::instruments::KINDS;
use super::instruments::accelerometer::IMU;
use super::sampling::to_ns;
use super::spec::InstrumentSpecs;
use super::step_interval::StepInterval;
use crate::error::{DataError, Error};
use crate::plant::Truth;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{MAX_DRIVES, Measurements};

/// Checks that an instrument can have a fault: the wrong unit must be one of its quantity, axes be there to be
/// exchanged, or to have it.
fn check_fault(instrument: &dyn Instrument, fault: &FaultWindow) -> Result<(), DataError> {
    let name = instrument.name();
    let channels = instrument.channels();
    let no_axes = |key, what| {
        Err(DataError::new(
            key,
            format!("the {name} does not have three axes{what}"),
            "accelerometer, gyro, or imu for both",
        ))
    };
    let has_axes = instrument.units() == 0 && channels.len() == 3;
    match fault.fault {
        Fault::WrongUnit(wrong) => {
            let si = wrong.si_units();
            match channels.iter().find(|c| !si.contains(&c.unit)) {
                Some(channel) => Err(DataError::new(
                    "fault",
                    format!(
                        "the {name} measures in {}, which cannot be misread in this way",
                        channel.unit
                    ),
                    format!("a sensor that measures in {}", si.join(" or ")),
                )),
                None => Ok(()),
            }
        }
        Fault::AxesSwapped(_) if !has_axes => no_axes("fault", " to be exchanged"),
        _ if fault.axis.is_some() && !has_axes => no_axes("axis", ""),
        _ => Ok(()),
    }
}

/// All instruments of a vehicle during one run.
pub struct Suite {
    /// Instant of the last step, ns.
    last_ns: Option<i64>,
    instruments: Vec<Box<dyn Instrument>>,
    mounts: usize,
    drives: usize,
}

impl Suite {
    /// The instruments of a data sheet on a train. The same seed gives the same errors, bit for bit.
    pub fn new(specs: &InstrumentSpecs, on: &Fitting<'_>) -> Result<Self, DataError> {
        let train = on.train;
        if train.drives.len() > MAX_DRIVES {
            return Err(DataError::new(
                "",
                format!(
                    "the train `{}` has {} drive units",
                    train.name,
                    train.drives.len()
                ),
                format!("measurements can hold at most {MAX_DRIVES}"),
            ));
        }
        let mut instruments = Vec::new();
        for kind in KINDS {
            if let Some(spec) = specs.get(kind.name) {
                instruments.push((kind.build)(spec, on)?);
            }
        }
        Ok(Self {
            last_ns: None,
            instruments,
            mounts: train.mounts.len(),
            drives: train.drives.len(),
        })
    }

    /// Adds an instrument, which may come from another crate. It is read after those there are.
    pub fn fit(&mut self, instrument: Box<dyn Instrument>) -> Result<(), DataError> {
        let name = instrument.name();
        let wrong = |message: String, help: String| Err(DataError::new(name, message, help));
        if self.names().iter().any(|n| n == name) {
            return wrong(
                format!("the sensor `{name}` exists already"),
                "another name".into(),
            );
        }
        match instrument.mount() {
            Some(mount) if mount >= self.mounts => wrong(
                format!(
                    "the train has no mount number {mount}: it has {} mounts",
                    self.mounts
                ),
                "an index into `Train::mounts`".into(),
            ),
            _ => {
                self.instruments.push(instrument);
                Ok(())
            }
        }
    }

    /// Checks that a physics step can serve every instrument: at most one sample a step.
    pub fn check_step(&self, dt_s: f64) -> Result<(), DataError> {
        for instrument in &self.instruments {
            let rate_hz = instrument.rate_hz();
            if rate_hz * dt_s > 1.0 + 1e-9 {
                return Err(DataError::new(
                    format!("{}.sampling.rate_hz", instrument.name()),
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

    /// Adds a fault to the sensor of this name: an instrument, a group such as `imu`, or one unit such as
    /// `wheel_speed[2]`.
    pub fn add_fault(&mut self, sensor: &str, fault: FaultWindow) -> Result<(), DataError> {
        let mut found = false;
        for instrument in &mut self.instruments {
            let name = instrument.name();
            let whole = name == sensor || instrument.group() == Some(sensor);
            let unit = (0..instrument.units()).find(|i| format!("{name}[{i}]") == sensor);
            if whole || unit.is_some() {
                check_fault(instrument.as_ref(), &fault)?;
                instrument.add_fault(unit, fault);
                found = true;
            }
        }
        match found {
            true => Ok(()),
            false => Err(DataError::new(
                "sensor",
                format!("no sensor `{sensor}` is fitted"),
                format!("known here: {}", self.names().join(", ")),
            )),
        }
    }

    /// Index in `Train::mounts` of the IMU's place: the accelerometer's, else the gyro's.
    pub fn imu_mount(&self) -> Option<usize> {
        let imu = self.instruments.iter().find(|i| i.group() == Some(IMU));
        imu.and_then(|i| i.mount())
    }

    /// Indices in `Train::mounts` of all mounts that carry an instrument, ascending.
    pub fn mounts(&self) -> Vec<usize> {
        let mut mounts: Vec<usize> = self.instruments.iter().filter_map(|i| i.mount()).collect();
        mounts.sort_unstable();
        mounts.dedup();
        mounts
    }

    /// Returns the recorded columns of the fitted instruments, the columns of one place (IMU, drive unit) together.
    pub fn channels(&self) -> Vec<SensorChannel> {
        let place = |c: &SensorChannel| c.path.rsplit_once('/').map_or("", |p| p.0).to_owned();
        let mut channels: Vec<_> = self.instruments.iter().flat_map(|i| i.channels()).collect();
        let mut places: Vec<String> = Vec::new();
        for c in &channels {
            if !places.contains(&place(c)) {
                places.push(place(c));
            }
        }
        channels.sort_by_key(|c| places.iter().position(|p| *p == place(c)));
        channels
    }

    /// The last output of `measure` without errors of the sensors: same samples, same stamps.
    pub fn ideal(&self) -> Measurements {
        let mut z = Measurements {
            t: Time::from_ns(self.last_ns.unwrap_or(0)),
            ..Measurements::default()
        };
        self.instruments.iter().for_each(|i| i.ideal(&mut z));
        z
    }

    /// Names an event can use on this vehicle. Units count from 0 at the front, as in [`Measurements`].
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for instrument in &self.instruments {
            if let Some(group) = instrument.group()
                && !names.iter().any(|n| n == group)
            {
                names.push(group.to_owned());
            }
            let name = instrument.name();
            names.push(name.to_owned());
            names.extend((0..instrument.units()).map(|i| format!("{name}[{i}]")));
        }
        names
    }

    /// Samples the truth after a step of the plant; puts new samples into `z`, cleared by the caller.
    pub fn measure(&mut self, truth: &Truth, z: &mut Measurements) -> Result<(), Error> {
        let step = self.step(truth)?;
        z.t = Time::from_s(truth.t_s);
        for instrument in &mut self.instruments {
            instrument.measure(step, truth, z)?;
        }
        Ok(())
    }

    /// The interval since the last step. Time must not run backwards, and the truth must be this train's.
    fn step(&mut self, truth: &Truth) -> Result<StepInterval, Error> {
        let broken = |what: String| Error::Broken {
            t_s: truth.t_s,
            what,
        };
        if truth.mounts.len() != self.mounts || truth.drives.len() != self.drives {
            return Err(broken(format!(
                "the sensors belong to a train with {} links and {} drive units, but the truth has {} and {}",
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
                "the sensors have already sampled t = {} s",
                from_ns as f64 * 1e-9
            )));
        }
        Ok(StepInterval { from_ns, to_ns })
    }
}
