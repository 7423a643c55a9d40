//! Fits the instruments of a scenario to its vehicle, with their faults.

use crate::config::scenario::Scenario;
use crate::config::sensor_sheet::Sheet;
use crate::error::Error;
use crate::sensors::Suite;
use crate::train::Train;

/// The instruments of a sheet fitted to `train`, with the faults of the scenario's events.
pub fn fit(
    scenario: &Scenario,
    sheet: &Sheet,
    train: &Train,
    dt_s: f64,
    seed: u64,
) -> Result<Suite, Error> {
    let file = &scenario.file;
    sheet.check_vehicle(file.car.is_some())?;
    let gravity = file.physics.gravity_mps2.get();
    let mut suite = Suite::new(&sheet.specs(), train, gravity, seed)
        .and_then(|suite| suite.check_step(dt_s).map(|()| suite))
        .map_err(|e| e.in_file(&sheet.file))?;
    for (i, event) in file.events.iter().enumerate() {
        let fault = event.sensor_fault().and_then(|fault| match fault {
            Some((sensor, window)) => suite.add_fault(sensor, window),
            None => Ok(()),
        });
        fault.map_err(|e| {
            let e = e.under(&format!("events[{i}]"));
            scenario.error(e.key, e.message, e.help)
        })?;
    }
    Ok(suite)
}
