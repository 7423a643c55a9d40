//! Fits instruments to the vehicle of a scenario, with the faults of its events.

use crate::config::scenario::Scenario;
use crate::error::{DataError, Error};
use crate::sensors::instruments::KINDS;
use crate::sensors::spec::InstrumentSpecs;
use crate::sensors::{Fitting, Instrument, Suite};
use std::path::Path;

/// An instrument or a fault that cannot be fitted, with its file.
pub enum Unfit {
    /// A value of the data sheet.
    Sheet(DataError),
    /// A value of the scenario.
    Scenario(DataError),
}

impl Unfit {
    /// Adds the file to the error.
    pub fn in_file(self, scenario: &Scenario, sheet: &Path) -> Error {
        match self {
            Unfit::Sheet(e) => e.in_file(sheet),
            Unfit::Scenario(e) => scenario.error(e.key, e.message, e.help),
        }
    }
}

/// The instruments of a data sheet and `others` (of a user's own), fitted to a vehicle, with the faults of the
/// scenario's events.
pub fn fit(
    scenario: &Scenario,
    specs: &InstrumentSpecs,
    others: Vec<Box<dyn Instrument>>,
    on: &Fitting<'_>,
) -> Result<Suite, Unfit> {
    let file = &scenario.file;
    check_vehicle(specs, file.car.is_some()).map_err(Unfit::Sheet)?;
    let mut suite = Suite::new(specs, on).map_err(Unfit::Sheet)?;
    let dt_s = file.physics.dt_ms.get() * 1e-3;
    suite.check_step(dt_s).map_err(Unfit::Sheet)?;
    let others_wrong = |e: DataError| Unfit::Scenario(e.under("instruments"));
    for other in others {
        suite.fit(other).map_err(others_wrong)?;
    }
    suite.check_step(dt_s).map_err(others_wrong)?;
    for (i, event) in file.events.iter().enumerate() {
        let fault = event.sensor_fault().and_then(|fault| match fault {
            Some((sensor, window)) => suite.add_fault(sensor, window),
            None => Ok(()),
        });
        fault.map_err(|e| Unfit::Scenario(e.under(&format!("events[{i}]"))))?;
    }
    Ok(suite)
}

/// The instruments can be fitted to this vehicle: only a car is steered, only a train has clamps.
fn check_vehicle(specs: &InstrumentSpecs, car: bool) -> Result<(), DataError> {
    for kind in KINDS.iter().filter(|k| specs.contains_key(k.name)) {
        if let Some(reason) = (kind.unsuited)(car) {
            return Err(DataError::new(
                kind.name,
                reason,
                "remove the instrument from the sheet",
            ));
        }
    }
    Ok(())
}
