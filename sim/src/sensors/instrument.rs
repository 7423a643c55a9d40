//! The trait of every instrument, its recorded columns, and the kinds that a data sheet can name.

use super::fault::FaultWindow;
use super::fitting::Fitting;
use super::spec::InstrumentSpec;
use super::step_interval::StepInterval;
use crate::error::{DataError, Error};
use crate::plant::Truth;
use monorig_estimators::api::signals::{Measurements, Shape, Slot};

/// Measures something of the truth: takes samples at its rate and delivers them after its latency.
pub trait Instrument {
    /// Name in data sheets, events and errors, such as `wheel_speed`.
    fn name(&self) -> &str;
    /// Name of a group of instruments that an event can name as one, such as `imu`.
    fn group(&self) -> Option<&str> {
        None
    }
    /// Number of readings that an event can name one by one, as `name[0]`, `name[1]`, …; 0 if the instrument has a
    /// single reading.
    fn units(&self) -> usize {
        0
    }
    /// Samples per second, Hz; at most one per physics step.
    fn rate_hz(&self) -> f64;
    /// Index in [`Truth::mounts`] of the mount it sits on. Plants keep the motion of these mounts up to date, and of no
    /// others.
    fn mount(&self) -> Option<usize> {
        None
    }
    /// Takes the samples that are due in `step`, at whose end the truth is `truth`; puts the samples that have arrived
    /// by then into `z`.
    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error>;
    /// Puts the ideal values of the last delivered samples into `z`, with the same stamps.
    fn ideal(&self, _z: &mut Measurements) {}
    /// Adds a fault to reading number `unit`, or to all of them.
    fn add_fault(&mut self, unit: Option<usize>, fault: FaultWindow);
    /// Returns the recorded columns of the instrument.
    fn channels(&self) -> Vec<SensorChannel>;
}

/// Reads one value from the measurements; `None` without a new sample.
pub type ReadingOf = Box<dyn Fn(&Measurements) -> Option<f64>>;

/// Builds an instrument from its specification.
pub type BuildInstrument =
    fn(&InstrumentSpec, &Fitting<'_>) -> Result<Box<dyn Instrument>, DataError>;

/// A recorded column of an instrument.
pub struct SensorChannel {
    /// Path such as `sensors/drive_1/wheel_speed`.
    pub path: String,
    /// Unit such as `m/s`.
    pub unit: &'static str,
    /// Reads its value from the measurements; `None` without a new sample.
    pub value: ReadingOf,
}

impl SensorChannel {
    /// A column under `sensors/`.
    pub fn new(
        path: impl std::fmt::Display,
        unit: &'static str,
        value: impl Fn(&Measurements) -> Option<f64> + 'static,
    ) -> Self {
        Self {
            path: format!("sensors/{path}"),
            unit,
            value: Box::new(value),
        }
    }

    /// The columns of a slot of the measurements: of a vector one for each axis, under `imu/`; of a drive unit one
    /// under `drive_N/`.
    pub fn of(slot: Slot) -> Vec<Self> {
        let (name, number) = (slot.name(), slot.index + 1);
        let paths = match slot.measurand.shape() {
            Shape::Vector => ["x", "y", "z"]
                .map(|axis| format!("imu/{name}_{axis}"))
                .to_vec(),
            Shape::PerDrive => vec![format!("drive_{number}/{name}")],
            Shape::Auxiliary => vec![format!("{name}_{number}")],
            Shape::Scalar => vec![name.to_owned()],
        };
        let value = |axis: usize| {
            move |z: &Measurements| slot.get(z).and_then(|s| s.value.get(axis).copied())
        };
        let columns = paths.into_iter().enumerate();
        columns
            .map(|(axis, path)| Self::new(path, slot.unit(), value(axis)))
            .collect()
    }
}

/// A kind of instrument: its name, where it can be fitted, how one is built.
pub struct InstrumentKind {
    /// Name in data sheets, events and errors.
    pub name: &'static str,
    /// Reason why the instrument cannot be fitted to a car (`true`) or to a train (`false`); `None` if it can.
    pub unsuited: fn(car: bool) -> Option<&'static str>,
    /// Builds one from its specification.
    pub build: BuildInstrument,
}
