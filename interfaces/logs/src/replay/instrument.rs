//! The instrument of a replay: it delivers the samples of the step that is played.

use super::playback::{Shared, lock};
use crate::drive::Target;
use monorig_estimators::api::signals::{Measurand, Measurements, Shape, Slot};
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::sensors::fault::FaultWindow;
use monorig_sim::sensors::{Instrument, SensorChannel, StepInterval};

/// The instrument of a replay: the samples of the step.
pub(super) struct RecordedInstrument {
    pub shared: Shared,
    pub targets: Vec<Target>,
    pub drives: usize,
}

impl Instrument for RecordedInstrument {
    fn name(&self) -> &str {
        "log"
    }

    fn rate_hz(&self) -> f64 {
        0.0
    }

    fn mount(&self) -> Option<usize> {
        None
    }

    fn measure(&mut self, _: StepInterval, _: &Truth, z: &mut Measurements) -> Result<(), Error> {
        // of all that there is of a replay nothing else measures
        *z = lock(&self.shared).step().z;
        Ok(())
    }

    fn add_fault(&mut self, _: Option<usize>, _: FaultWindow) {}

    fn channels(&self) -> Vec<SensorChannel> {
        let traction = self.targets.iter().any(|t| t.is_traction());
        let is_there = |slot: &Slot| match slot.measurand {
            Measurand::MotorTorque => traction,
            _ => self.targets.contains(&Target::Measured(*slot)),
        };
        let on_vehicle =
            |slot: &Slot| slot.measurand.shape() != Shape::PerDrive || slot.index < self.drives;
        let slots = Slot::all().filter(is_there).filter(on_vehicle);
        slots.flat_map(SensorChannel::of).collect()
    }
}
