//! An instrument repeated on every drive unit: motor torque, wheel speed and clamp pressure share this.

use super::fault::FaultWindow;
use super::shake::Ride;
use super::signal_path::{SamplingMode, SignalPath, StepInterval, scalar};
use super::spec::InstrumentSpec;
use super::{Fitting, Instrument, SensorChannel};
use crate::error::Error;
use crate::plant::{DriveState, Truth};
use crate::train::Drive;
use monorig_estimators::api::signals::{MAX_DRIVES, Measurements, Sample};

/// Samples of one quantity, one for each drive unit from the front.
type DriveSamples = [Option<Sample<f64>>; MAX_DRIVES];

/// A quantity measured on every drive unit.
#[derive(Clone, Copy)]
pub struct DriveQuantity {
    /// Name in data sheets, events and channels; single units are `name[0]`, `name[1]`, ….
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// The ideal value from the state of a drive unit and its nominal data.
    pub ideal: fn(&DriveState, &Drive) -> f64,
    /// Where its samples are in the measurements.
    pub samples: fn(&Measurements) -> &DriveSamples,
    /// The same to be written.
    pub samples_mut: fn(&mut Measurements) -> &mut DriveSamples,
}

/// One instrument for each drive unit.
pub struct DriveInstruments {
    quantity: DriveQuantity,
    rate_hz: f64,
    units: Vec<DriveInstrument>,
}

struct DriveInstrument {
    drive: Drive,
    path: SignalPath<1>,
    before: Option<f64>,
}

impl DriveInstruments {
    /// Instruments `name[0]`, `name[1]`, … from the front, all of the same specification.
    pub fn new(quantity: DriveQuantity, spec: &InstrumentSpec, on: &Fitting<'_>) -> Self {
        let unit = |(i, drive): (usize, &Drive)| {
            let name = format!("{}[{i}]", quantity.name);
            DriveInstrument {
                drive: *drive,
                path: SignalPath::scalar(&name, SamplingMode::Instant, spec, on),
                before: None,
            }
        };
        Self {
            quantity,
            rate_hz: spec.sampling.rate_hz,
            units: on.train.drives.iter().enumerate().map(unit).collect(),
        }
    }
}

impl Instrument for DriveInstruments {
    fn name(&self) -> &str {
        self.quantity.name
    }

    fn units(&self) -> usize {
        self.units.len()
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error> {
        let samples = (self.quantity.samples_mut)(z);
        for ((unit, state), sample) in self.units.iter_mut().zip(&truth.drives).zip(samples) {
            let now = (self.quantity.ideal)(state, &unit.drive);
            let before = unit.before.replace(now).unwrap_or(now);
            let ride = Ride {
                chainage_m: state.chainage_m,
                speed_mps: truth.speed_mps,
            };
            unit.path.observe(step, ride, [before], [now])?;
            if let Some(new) = scalar(unit.path.deliver(step.to_ns)) {
                *sample = Some(new);
            }
        }
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        let samples = (self.quantity.samples_mut)(z);
        for (unit, sample) in self.units.iter().zip(samples) {
            *sample = scalar(unit.path.ideal());
        }
    }

    fn add_fault(&mut self, unit: Option<usize>, fault: FaultWindow) {
        for (i, u) in self.units.iter_mut().enumerate() {
            if unit.is_none_or(|wanted| wanted == i) {
                u.path.add_fault(fault);
            }
        }
    }

    fn channels(&self) -> Vec<SensorChannel> {
        let DriveQuantity {
            name,
            unit,
            samples,
            ..
        } = self.quantity;
        (0..self.units.len())
            .map(|i| {
                SensorChannel::new(format_args!("drive_{}/{name}", i + 1), unit, move |z| {
                    samples(z)[i].map(|s| s.value)
                })
            })
            .collect()
    }
}
