//! Fits instruments to the vehicle of a scenario, with the faults of its events.

use crate::config::scenario::Scenario;
use crate::config::sensor_sheet::Sheet;
use crate::error::Error;
use crate::sensors::{Instrument, Suite};
use crate::train::Train;

/// The instruments of a sheet and `others` (of a user's own), fitted to `train`, with the faults of the scenario's events.
pub fn fit(
    scenario: &Scenario,
    sheet: &Sheet,
    others: Vec<Box<dyn Instrument>>,
    train: &Train,
    seed: u64,
) -> Result<Suite, Error> {
    let file = &scenario.file;
    sheet.check_vehicle(file.car.is_some())?;
    let mut suite = Suite::new(&sheet.specs(), train, file.physics.gravity_mps2.get(), seed)
        .map_err(|e| e.in_file(&sheet.file))?;
    for other in others {
        suite.fit(other)?;
    }
    suite
        .check_step(file.physics.dt_ms.get() * 1e-3)
        .map_err(|e| e.in_file(&sheet.file))?;
    for (i, event) in file.events.iter().enumerate() {
        let fault = event.sensor_fault().and_then(|fault| match fault {
            Some((sensor, window)) => suite.add_fault(sensor, window),
            None => Ok(()),
        });
        fault.map_err(|e| e.under(&format!("events[{i}]")).in_file(scenario.path()))?;
    }
    Ok(suite)
}
