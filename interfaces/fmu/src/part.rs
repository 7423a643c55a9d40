//! Content of an FMU, as it stands in `resources/part.json`.

use monorig_estimators::Vehicle;
use monorig_estimators::api::signals::{Command, Shape, Slot};
use monorig_logs::drive::VehicleFile;
use monorig_sim::closed_loop::{Simulation, SimulationBuilder};
use monorig_sim::config::scenario::{ParameterValue, Scenario};
use monorig_sim::control::{Controller, FeedForward, Perception, Reference};
use monorig_sim::error::Error;
use monorig_sim::sensors::SensorChannel;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the file in `resources/`.
pub(crate) const FILE: &str = "part.json";
/// Name of a user's library in `resources/`.
pub(crate) const LIBRARY: &str = "library.bin";

/// Content of an FMU.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Part {
    /// An estimator.
    Estimator(Box<EstimatorPart>),
    /// The plant with its instruments.
    Plant(PlantPart),
}

/// An estimator for a vehicle.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EstimatorPart {
    /// Name of its type.
    pub name: String,
    /// True for an estimator of the library beside this file, false for one of monorig.
    pub in_library: bool,
    /// Nominal values of the vehicle.
    pub vehicle: VehicleFile,
    /// Parameters that start with another value than their default.
    pub parameters: BTreeMap<String, ParameterValue>,
    /// Quantities that the vehicle measures.
    pub measured: Vec<String>,
    /// True if the state can be saved.
    pub keeps_state: bool,
}

/// The plant of a scenario.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlantPart {
    /// Name of the scenario.
    pub name: String,
    /// Name of the file in `resources/`.
    pub file: String,
    /// Values that are changed in it.
    pub set: Vec<(String, String)>,
}

impl Part {
    /// Name of what it holds.
    pub fn name(&self) -> &str {
        match self {
            Self::Estimator(part) => &part.name,
            Self::Plant(part) => &part.name,
        }
    }

    /// True if the state of an instance can be saved and restored.
    pub fn keeps_state(&self) -> bool {
        matches!(self, Self::Estimator(part) if part.keeps_state)
    }
}

/// Returns the samples of the instruments of a simulation, without the user's own instruments.
pub(crate) fn measured(simulation: &Simulation) -> impl Iterator<Item = Slot> {
    let channels = simulation.sensors.channels();
    let fitted = move |slot: &Slot| {
        let own = slot.measurand.shape() == Shape::Auxiliary;
        let columns = SensorChannel::of(*slot);
        !own && columns
            .iter()
            .all(|c| channels.iter().any(|there| there.path == c.path))
    };
    Slot::all().filter(fitted)
}

/// The plant of a scenario without estimators, to be driven from outside for 28 hours at most.
pub(crate) fn plant_alone(
    scenario: &Path,
    set: &[(String, String)],
) -> Result<SimulationBuilder, Error> {
    /// Placeholder for the controller, which is never called.
    struct Outside;
    impl Controller for Outside {
        fn control(&mut self, reference: &Reference, _: &Perception, _: f64) -> Command {
            reference.command()
        }
    }
    let endless = ("stop".to_owned(), "{after_s: 1e5}".to_owned());
    let set = [set, &[endless]].concat();
    let alone = SimulationBuilder::from_scenario(Scenario::load(scenario, &set)?)?
        .edit(|file| {
            file.estimators.clear();
            file.in_loop = None;
            file.expect.clear();
            file.known_failures.clear();
            file.published.clear();
            file.availability = Default::default();
        })
        .feedforward(FeedForward::None)
        .controller(Box::new(Outside));
    Ok(alone)
}

/// The vehicle of an estimator.
pub(crate) fn vehicle(file: &VehicleFile) -> Result<Vehicle, String> {
    let data = file.data().ok_or("too few numbers for a mass layout")?;
    Vehicle::new(data).map_err(|e| e.to_string())
}

/// Computes the token of a part, by which an FMU that was put together from two FMUs is refused.
pub(crate) fn token(part: &[u8]) -> String {
    let digest = Sha256::digest(part);
    let hex: String = digest.iter().take(16).map(|b| format!("{b:02x}")).collect();
    format!("{{{hex}}}")
}
