//! An instrument repeated on every drive unit: motor torque, wheel speed and clamp pressure share this.

use crate::error::Error;
use crate::plant::{DriveState, Truth};
use crate::sensors::fault::FaultWindow;
use crate::sensors::shake::Ride;
use crate::sensors::signal_path::SignalPath;
use crate::sensors::spec::InstrumentSpec;
use crate::sensors::value_sampler::SamplingMode;
use crate::sensors::{Fitting, Instrument, SensorChannel, StepInterval};
use crate::train::Drive;
use monorig_estimators::api::signals::{Measurand, Measurements};

/// A quantity measured on every drive unit.
#[derive(Clone, Copy)]
pub struct DriveQuantity {
    /// Name in data sheets, events and channels; single units are `name[0]`, `name[1]`, ….
    pub name: &'static str,
    /// The place of its samples in the measurements.
    pub measurand: Measurand,
    /// The ideal value from the state of a drive unit and its nominal data.
    pub ideal: fn(&DriveState, &Drive) -> f64,
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
            rate_hz: spec.sampling.rate_hz.get(),
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
        let slots = self.quantity.measurand.slots();
        for ((unit, state), slot) in self.units.iter_mut().zip(&truth.drives).zip(slots) {
            let now = (self.quantity.ideal)(state, &unit.drive);
            let before = unit.before.replace(now).unwrap_or(now);
            let ride = Ride {
                chainage_m: state.chainage_m,
                speed_mps: truth.speed_mps,
            };
            unit.path.observe(step, ride, [before], [now])?;
            let new = unit.path.deliver(step.to_ns);
            if new.is_some() {
                slot.set(z, new);
            }
        }
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        for (unit, slot) in self.units.iter().zip(self.quantity.measurand.slots()) {
            slot.set(z, unit.path.ideal());
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
        let slots = self.quantity.measurand.slots().take(self.units.len());
        slots.flat_map(SensorChannel::of).collect()
    }
}
