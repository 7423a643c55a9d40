//! The same instrument on every drive unit: motor torque, wheel speed and clamp pressure share this.

use super::fault::Window;
use super::instrument::{Instrument, SamplingMode, StepInterval};
use crate::config::sensor_sheet_file::PlainSensor;
use crate::error::Error;
use crate::plant::DriveState;
use crate::train::Drive;
use monorig_estimators::api::signals::Sample;

/// What such an instrument measures: the ideal value from the state of a drive unit and its nominal data.
pub type Ideal = fn(&DriveState, &Drive) -> f64;

/// One instrument for each drive unit.
#[derive(Clone, Debug)]
pub struct PerDrive {
    ideal: Ideal,
    units: Vec<DriveInstrument>,
}

#[derive(Clone, Debug)]
struct DriveInstrument {
    drive: Drive,
    instrument: Instrument<1>,
    before: Option<f64>,
}

impl PerDrive {
    /// Instruments `name[0]`, `name[1]`, … from the front.
    pub fn new(name: &str, sheet: &PlainSensor, ideal: Ideal, drives: &[Drive], seed: u64) -> Self {
        let unit = |(i, drive): (usize, &Drive)| DriveInstrument {
            drive: *drive,
            instrument: Instrument::new(
                &format!("{name}[{i}]"),
                SamplingMode::Instant,
                (&sheet.sampling, &sheet.errors),
                [("", 0.0)],
                seed,
            ),
            before: None,
        };
        Self {
            ideal,
            units: drives.iter().enumerate().map(unit).collect(),
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.units.len()
    }

    /// Add a fault to one, or to all.
    pub fn add_fault(&mut self, unit: Option<usize>, window: Window) {
        for (i, u) in self.units.iter_mut().enumerate() {
            if unit.is_none_or(|wanted| wanted == i) {
                u.instrument.add_fault(window);
            }
        }
    }

    /// Look at the drive units at the end of `span`; hand over what arrived.
    pub fn measure(
        &mut self,
        span: StepInterval,
        drives: &[DriveState],
        out: &mut [Option<Sample<f64>>],
    ) -> Result<(), Error> {
        for ((unit, state), out) in self.units.iter_mut().zip(drives).zip(out) {
            let now = (self.ideal)(state, &unit.drive);
            let before = unit.before.replace(now).unwrap_or(now);
            unit.instrument.observe(span, [before], [now])?;
            if let Some(sample) = unit.instrument.deliver(span.to_ns) {
                *out = Some(Sample {
                    t: sample.t,
                    value: sample.value[0],
                });
            }
        }
        Ok(())
    }

    /// The ideal values behind the samples last handed over.
    pub fn ideal(&self, out: &mut [Option<Sample<f64>>]) {
        for (unit, out) in self.units.iter().zip(out) {
            *out = unit.instrument.ideal().map(|s| Sample {
                t: s.t,
                value: s.value[0],
            });
        }
    }
}
