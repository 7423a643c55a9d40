//! The plant steps: the one line of the loop that moves the train.

use super::simulation::Simulation;
use crate::error::Error;
use crate::guarded::guarded;
use crate::plant::divergence::Causes;
use monorig_estimators::api::signals::Command;

/// Largest speed of a train or a car, m/s.
const MAX_SPEED_MPS: f64 = 1e3;
/// Largest acceleration of a train or a car along its path, m/s².
const MAX_ACCEL_MPS2: f64 = 1e6;

/// Moves the plant by one step under this command. A plant that panics or diverges ends the run with an error.
pub(super) fn step_plant(s: &mut Simulation, command: &Command) -> Result<(), Error> {
    let causes = Causes {
        train: &s.train,
        gravity_mps2: s.scenario.file.physics.gravity_mps2.get(),
        dt_s: s.dt_s,
    };
    let plant = s.plant.as_mut();
    let t_s = plant.truth().t_s;
    let stepped = guarded(|| plant.step(command, causes.dt_s));
    let truth = plant.truth();
    let moves = truth.speed_mps.abs() <= MAX_SPEED_MPS && truth.accel_mps2.abs() <= MAX_ACCEL_MPS2;
    match stepped {
        Ok(done) if moves || plant.is_recorded() => done,
        Err(told) if !s.plant_is_ours => Err(Error::Broken {
            t_s,
            what: format!("the plant panicked: {told}"),
        }),
        // a panic of monorig's own plant is one of its arithmetic
        _ => Err(causes.broken(t_s, plant.diverging_body())),
    }
}
