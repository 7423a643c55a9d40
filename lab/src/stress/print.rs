//! Fingerprint of the inputs of the estimators in a run: two runs differ in it if a condition changed anything for
//! them.

use monorig_estimators::api::signals::Slot;
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::error::Error;
use std::hash::{DefaultHasher, Hasher};

/// Observer of the measurements, the commands' instants and the nominal vehicle.
#[derive(Default)]
pub(crate) struct Print {
    hasher: DefaultHasher,
    slots: Vec<Slot>,
}

impl Print {
    /// The fingerprint, as 16 hexadecimal digits.
    pub(crate) fn text(&self) -> String {
        format!("{:016x}", self.hasher.finish())
    }
}

impl Observer for Print {
    fn begin(&mut self, s: &Simulation) -> Result<(), Error> {
        self.slots = Slot::all().collect();
        self.hasher.write(format!("{:?}", s.vehicle).as_bytes());
        Ok(())
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        if !f.estimated {
            return Ok(());
        }
        for (i, slot) in self.slots.iter().enumerate() {
            if let Some(sample) = slot.get(f.measurements) {
                self.hasher.write_usize(i);
                self.hasher.write_i64(f.time_ns);
                self.hasher.write_u64(sample.t.s().to_bits());
                sample
                    .value
                    .iter()
                    .for_each(|x| self.hasher.write_u64(x.to_bits()));
            }
        }
        Ok(())
    }
}
