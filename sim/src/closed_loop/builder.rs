//! Builder of a simulation: from a scenario file, or from a rail and a train in code, with parts of one's own.

use super::moving::Moving;
use super::registry::{BoxedController, BoxedEstimator, Refusal, Registry};
use crate::config::scenario::{
    ControllerSettings, DriveCycle, Event, FeedForward, PlantKind, Scenario, ScenarioFile,
    Settings, ToldValue,
};
use crate::config::sensor_sheet::Sheet;
use crate::error::Error;
use crate::plant::Plant;
use crate::rail::Rail;
use crate::sensors::Instrument;
use crate::sensors::spec::InstrumentSpecs;
use crate::train::Train;
use monorig_estimators::api::signals::Vehicle;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Makes an estimator once the vehicle is known.
pub(super) type MakeEstimator = Box<dyn FnOnce(&Vehicle) -> Result<BoxedEstimator, Refusal>>;

/// Builds a [`Simulation`](super::Simulation). Its methods change values of the scenario, or put in parts of one's own;
/// what they are given is checked by [`SimulationBuilder::build`].
pub struct SimulationBuilder {
    pub(super) scenario: Scenario,
    pub(super) rail: Arc<Rail>,
    pub(super) moving: Moving,
    /// The instruments, and the file they are from.
    pub(super) sensors: Option<(InstrumentSpecs, PathBuf)>,
    pub(super) instruments: Vec<Box<dyn Instrument>>,
    pub(super) registry: Registry,
    pub(super) estimators: BTreeMap<String, MakeEstimator>,
    pub(super) controller: Option<BoxedController>,
    pub(super) plant: Option<Box<dyn Plant>>,
    /// First mistake found.
    pub(super) wrong: Option<Error>,
}

impl SimulationBuilder {
    /// A train on a rail, without a scenario file: sensors, drive cycle and end of the run are still to be given.
    pub fn of_train(rail: Rail, train: Train) -> Self {
        let scenario = Scenario::in_code(&rail.name, Some(&train.name), None);
        Self::new(scenario, rail, Moving::Train(Box::new(train)), None)
    }

    /// Starts with a scenario, and reads the files it names.
    pub fn from_scenario(scenario: Scenario) -> Result<Self, Error> {
        let inputs = scenario.inputs().clone();
        inputs.during(|| Self::read(scenario))
    }

    fn read(scenario: Scenario) -> Result<Self, Error> {
        let rail = Rail::load_with(&scenario.track, &scenario.sets("track"))?;
        let moving = Moving::of_scenario(&scenario)?;
        let sheet = Sheet::load_with(&scenario.sensors, &scenario.sets("sensors"))?;
        let sensors = (sheet.specs(), sheet.file);
        Ok(Self::new(scenario, rail, moving, Some(sensors)))
    }

    fn new(
        scenario: Scenario,
        rail: Rail,
        moving: Moving,
        sensors: Option<(InstrumentSpecs, PathBuf)>,
    ) -> Self {
        Self {
            scenario,
            rail: Arc::new(rail),
            moving,
            sensors,
            instruments: Vec::new(),
            registry: Registry::default(),
            estimators: BTreeMap::new(),
            controller: None,
            plant: None,
            wrong: None,
        }
    }

    /// The scenario as it stands.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The specifications of the instruments, if they are known by now.
    pub fn instruments(&self) -> Option<&InstrumentSpecs> {
        self.sensors.as_ref().map(|(specs, _)| specs)
    }

    /// Sets the registry for the parts that the scenario names, instead of [`Registry::default`].
    pub fn registry(mut self, registry: &Registry) -> Self {
        self.registry = registry.clone();
        self
    }

    /// Changes any other value of the scenario file.
    pub fn edit(mut self, edit: impl FnOnce(&mut ScenarioFile)) -> Self {
        edit(&mut self.scenario.file);
        self
    }

    /// The name of the scenario, in recordings.
    pub fn name(mut self, name: &str) -> Self {
        self.scenario.name = name.into();
        self
    }

    /// The instruments of the vehicle: a data sheet, or specifications by name.
    pub fn sensors(mut self, specs: impl Into<InstrumentSpecs>) -> Self {
        self.sensors = Some((specs.into(), PathBuf::new()));
        self
    }

    /// Adds your own instrument to the instruments of the data sheet.
    pub fn instrument(mut self, instrument: Box<dyn Instrument>) -> Self {
        self.instruments.push(instrument);
        self
    }

    /// Adds your own estimator beside the others, under this name.
    pub fn estimator(self, name: &str, estimator: BoxedEstimator) -> Self {
        self.estimator_with(name, move |_| Ok(estimator))
    }

    /// Adds an estimator that is made for the nominal vehicle, or refuses this vehicle.
    pub fn estimator_with(
        mut self,
        name: &str,
        make: impl FnOnce(&Vehicle) -> Result<BoxedEstimator, Refusal> + 'static,
    ) -> Self {
        self = self.registered_estimator(name, Settings::default());
        self.estimators.insert(name.into(), Box::new(make));
        self
    }

    /// Adds an estimator of the registry under this name; the key `is` gives its type, by default the name.
    pub fn registered_estimator(mut self, name: &str, settings: Settings) -> Self {
        let estimators = &mut self.scenario.file.estimators;
        if estimators.insert(name.into(), settings).is_some() {
            self.refuse(
                &format!("estimators.{name}"),
                "two estimators have this name",
                "another name",
            );
        }
        self
    }

    /// The estimator whose estimates the controller uses.
    pub fn in_loop(mut self, name: &str) -> Self {
        self.scenario.file.in_loop = Some(name.into());
        self.feedforward(FeedForward::Estimate)
    }

    /// Sets the source of slope and mass for the controller's feed-forward.
    pub fn feedforward(mut self, feedforward: FeedForward) -> Self {
        self.scenario.file.drive.controller.feedforward = feedforward;
        self
    }

    /// A controller of your own.
    pub fn controller(mut self, controller: BoxedController) -> Self {
        self.controller = Some(controller);
        self
    }

    /// A controller of the registry, with its parameters.
    pub fn registered_controller(mut self, settings: ControllerSettings) -> Self {
        self.scenario.file.drive.controller = settings;
        self
    }

    /// A plant of your own. Its truth has the mounts and drives of the train.
    pub fn plant(mut self, plant: Box<dyn Plant>) -> Self {
        self.plant = Some(plant);
        self
    }

    /// Chooses a plant by name, from monorig or from the registry. Default: rigid bodies in rapier.
    pub fn plant_kind(mut self, kind: PlantKind) -> Self {
        self.scenario.file.physics.plant = Some(kind);
        self
    }

    /// The speed reference. The controller stays as it is.
    pub fn drive_cycle(mut self, cycle: DriveCycle) -> Self {
        let drive = &mut self.scenario.file.drive;
        let controller = std::mem::take(&mut drive.controller);
        *drive = DriveCycle {
            controller,
            ..cycle
        };
        self
    }

    /// Load on the hook, kg.
    pub fn load_mass_kg(mut self, kg: f64) -> Self {
        self.scenario.file.load.mass_kg = self.checked("load.mass_kg", kg);
        self
    }

    /// Chainage of the front at the start, m.
    pub fn start_at_m(mut self, m: f64) -> Self {
        self.scenario.file.start.chainage_m = self.checked("start.chainage_m", m);
        self
    }

    /// Speed at the start, m/s.
    pub fn start_speed_mps(mut self, mps: f64) -> Self {
        if let Some(mps) = self.checked("start.speed_mps", mps) {
            self.scenario.file.start.speed_mps = mps;
        }
        self
    }

    /// Time after which the run ends, s.
    pub fn stop_after_s(mut self, s: f64) -> Self {
        self.scenario.file.stop.after_s = self.checked("stop.after_s", s);
        self
    }

    /// Chainage of the front at which the run ends, m.
    pub fn stop_at_m(mut self, m: f64) -> Self {
        self.scenario.file.stop.at_m = self.checked("stop.at_m", m);
        self
    }

    /// Physics step, ms.
    pub fn step_ms(mut self, ms: f64) -> Self {
        if let Some(ms) = self.checked("physics.dt_ms", ms) {
            self.scenario.file.physics.dt_ms = ms;
        }
        self
    }

    /// Gives estimators and controller the true values of the vehicle in place of drawn values, as the data sheet of a
    /// vehicle needs.
    pub fn told_exactly(self) -> Self {
        self.edit(|file| {
            let why = "the vehicle's data sheet is needed here".into();
            file.vehicle.exact.insert(ToldValue::All, why);
        })
    }

    /// An event of the run.
    pub fn event(mut self, event: Event) -> Self {
        self.scenario.file.events.push(event);
        self
    }

    /// The number as its checked type; what is wrong with it is reported by `build`.
    fn checked<T: TryFrom<f64, Error = String>>(&mut self, key: &str, x: f64) -> Option<T> {
        T::try_from(x)
            .map_err(|message| self.refuse(key, &message, "a number in the unit of the name"))
            .ok()
    }

    fn refuse(&mut self, key: &str, message: &str, help: &str) {
        let error = self.scenario.error(key, message, help);
        self.wrong.get_or_insert(error);
    }
}
