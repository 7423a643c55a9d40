//! A simulation ready to run. It is made by the [builder](super::builder) and run by [`run`](super::run::run).

use super::end::EndCondition;
use super::estimators::RunningEstimator;
use super::events::EventSchedule;
use super::registry::BoxedController;
use crate::config::scenario::Scenario;
use crate::control::{Cycle, PerceptionModel};
use crate::plant::Plant;
use crate::plant::obstacles::ObstacleBox;
use crate::rail::{Rail, RailFrame};
use crate::sensors::Suite;
use crate::sensors::spec::InstrumentSpecs;
use crate::train::Train;
use monorig_estimators::api::signals::Vehicle;
use std::sync::Arc;

/// A simulation ready to run: everything a run needs, checked against each other.
#[non_exhaustive]
pub struct Simulation {
    /// Scenario from which the simulation was built.
    pub scenario: Scenario,
    /// Seed of this run.
    pub seed: u64,
    /// The rail.
    pub rail: Arc<Rail>,
    /// The train as it starts; a car as [`Car::consist`](crate::road::Car::consist) describes it.
    pub train: Train,
    /// The train or the car in motion.
    pub plant: Box<dyn Plant>,
    /// True for a plant of monorig, false for a plant of another program.
    pub(crate) plant_is_ours: bool,
    /// The instruments.
    pub sensors: Suite,
    /// Specifications of the instruments; empty for a recorded drive.
    pub instruments: InstrumentSpecs,
    /// Nominal vehicle given to estimators and controller.
    pub vehicle: Vehicle,
    /// The estimators.
    pub estimators: Vec<RunningEstimator>,
    /// Index of the estimator whose output the controller uses.
    pub in_loop: Option<usize>,
    /// The drive cycle.
    pub(crate) cycle: Cycle,
    /// Makes the input of the controller.
    pub(crate) perception: PerceptionModel,
    /// The controller.
    pub(crate) controller: BoxedController,
    /// Events still to come.
    pub(crate) events: EventSchedule,
    /// When the run ends.
    pub(crate) end: EndCondition,
    /// Step, s.
    pub dt_s: f64,
    /// Chainage of the IMU minus chainage of the front, m.
    pub imu_offset_m: f64,
    /// Obstacles and roadway walls.
    pub(crate) obstacles: Vec<ObstacleBox>,
}

impl Simulation {
    /// Chainage of the train's front, m: a positioning system on the track is assumed for the drive cycle.
    pub fn front_m(&self) -> f64 {
        self.plant.truth().chainage_m - self.imu_offset_m
    }

    /// The rail sampled for drawing; none where nothing runs on it: the rail of a recorded drive is not known.
    pub fn rail_samples(&self) -> Vec<RailFrame> {
        match self.train.bodies.is_empty() {
            true => Vec::new(),
            false => self.rail.samples(0.5),
        }
    }
}
