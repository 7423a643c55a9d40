//! Registry: the estimators, controllers, instruments and plants that a scenario can name, each with its parameters.
//!
//! [`Registry::default`] has ours. A program adds its own, and hands the registry to whatever builds simulations; a
//! scenario then names them like ours, and their parameters are checked like ours.
//!
//! ```
//! use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements, Vehicle};
//! use monorig_sim::closed_loop::registry::Registry;
//!
//! monorig_estimators::params! {
//!     /// Parameters of my estimator.
//!     MyParams {
//!         mass_kg ["kg"] = 15e3, 1.0 => 1e6, "The mass it always reports.";
//!     }
//! }
//! struct Constant(f64);
//! impl Estimator for Constant {
//!     fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
//!         let mut estimate = Estimate::at(z.t);
//!         estimate.total_mass_kg.value = self.0;
//!         Ok(estimate)
//!     }
//!     fn reset(&mut self) {}
//! }
//!
//! let mut registry = Registry::default();
//! registry
//!     .estimator("constant", |_: &Vehicle, p: &MyParams| Constant(p.mass_kg))?
//!     .about("Reports a constant mass.");
//! assert!(registry.find_estimator("constnat").unwrap_err().help.contains("did you mean `constant`"));
//! # Ok::<(), monorig_sim::closed_loop::registry::RegistryError>(())
//! ```

use super::answers::AnswerCounter;
use super::wall_clock::WallClock;
use crate::config::file::suggestion;
use crate::config::scenario::{
    ControllerSettings, DEFAULT_CONTROLLER, PlantKind, Settings, valid_name,
};
use crate::control::{Controller, ControllerSetup, SpeedController, SpeedControllerParams};
use crate::plant::{Plant, PlantSetup};
use crate::sensors::{Fitting, Instrument};
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::{Key, ParamError, Parameters, Setting};
use monorig_estimators::api::signals::Vehicle;
use monorig_estimators::registry::{self as ours, Kind};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

/// An estimator as a run holds it.
pub type BoxedEstimator = Box<dyn Estimator + Send>;
/// A controller as a run holds it.
pub type BoxedController = Box<dyn Controller + Send>;
/// Values of parameters by name; missing parameters have their defaults.
pub type NamedSettings<'a> = &'a [(&'a str, Setting<'a>)];

/// Builds an estimator for a nominal vehicle.
pub(crate) type BuildEstimator =
    dyn Fn(&Vehicle, NamedSettings<'_>) -> Result<BoxedEstimator, Refusal> + Send + Sync;
/// Builds a controller for a nominal vehicle.
pub(crate) type BuildController = dyn Fn(&Vehicle, &ControllerSetup, NamedSettings<'_>) -> Result<BoxedController, Refusal>
    + Send
    + Sync;
/// Builds an instrument on a vehicle.
pub(crate) type BuildOwnInstrument =
    dyn Fn(&Fitting<'_>, NamedSettings<'_>) -> Result<Box<dyn Instrument>, Refusal> + Send + Sync;
/// Builds a plant.
pub(crate) type BuildPlant =
    dyn Fn(&PlantSetup<'_>, NamedSettings<'_>) -> Result<Box<dyn Plant>, Refusal> + Send + Sync;

/// Finds the estimator that the settings name, or the only estimator, in a library or an FMU, or outside the program.
type LoadLibrary = dyn Fn(&Path, &Settings, Option<&Arc<WallClock>>) -> Result<EstimatorType, Refusal>
    + Send
    + Sync;
/// Finds the controller in an FMU.
type LoadController =
    dyn Fn(&Path, &ControllerSettings) -> Result<ControllerType, Refusal> + Send + Sync;

/// A type of estimator, controller, instrument or plant: its name, its parameters, and how it is built.
pub struct PartType<B: ?Sized> {
    name: String,
    about: String,
    groups: &'static [&'static [Key]],
    build: Arc<B>,
    /// A published method as in its source, without supervision: for comparison, not for use. One that a program adds
    /// is none.
    pub(super) reference: bool,
    /// Counts of the answers of an estimator outside the program in real time.
    pub(super) answers: Option<AnswerCounter>,
}

/// A type of estimator.
pub type EstimatorType = PartType<BuildEstimator>;
/// A type of controller.
pub type ControllerType = PartType<BuildController>;
/// A type of instrument that a program adds.
pub type InstrumentType = PartType<BuildOwnInstrument>;
/// A type of plant that a program adds.
pub type PlantType = PartType<BuildPlant>;

/// The registered types of parts. Cheap to clone; can be shared between threads.
#[derive(Clone)]
pub struct Registry {
    estimators: Vec<EstimatorType>,
    controllers: Vec<ControllerType>,
    instruments: Vec<InstrumentType>,
    plants: Vec<PlantType>,
    load_library: Option<Arc<LoadLibrary>>,
    load_controller: Option<Arc<LoadController>>,
    clock: Option<Arc<WallClock>>,
    /// The only names under which a scenario may run foreign parts; `None`: every name.
    foreign: Option<BTreeSet<String>>,
}

impl std::fmt::Debug for Registry {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let lists = (
            &self.estimators,
            &self.controllers,
            &self.instruments,
            &self.plants,
        );
        out.debug_tuple("Registry").field(&lists).finish()
    }
}

/// A name, a value or a part that cannot be used: what is wrong, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}; {help}")]
pub struct Refusal {
    /// The mistake.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl Refusal {
    /// The mistake and its remedy.
    pub fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
        }
    }
}

impl From<ParamError> for Refusal {
    fn from(e: ParamError) -> Self {
        Self::new(e.to_string(), "use values that fit this vehicle")
    }
}

/// Reason for which a type cannot be added to a registry.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RegistryError {
    /// A part of this name exists already.
    #[error("{0} called `{1}` exists already")]
    NameTaken(&'static str, String),
    /// The name cannot be part of a channel's path.
    #[error("`{0}` is not a name: write letters, digits, `_` and `-`")]
    NotAName(String),
    /// A scenario uses this key for something else.
    #[error(
        "`{0}` cannot have a parameter called `{1}`: this key has another meaning in scenarios"
    )]
    ReservedKey(String, &'static str),
}

/// Keys of a scenario's estimator that are not parameters.
const ESTIMATOR_KEYS: &[&str] = &["is", "from", "library", "fmu", "external", "map"];
/// Keys of a scenario's controller that are not parameters.
const CONTROLLER_KEYS: &[&str] = &["kind", "fmu", "map", "feedforward"];
/// Keys of a scenario's plant that are not parameters.
const PLANT_KEYS: &[&str] = &["kind"];

/// Our estimator that is built only for a vehicle on a rail.
const RAIL_ONLY: &str = "rail_fusion";

impl Default for Registry {
    fn default() -> Self {
        let mut registry = Self::empty();
        let names = ours::NAMES.iter().chain(ours::PRINTED_NAMES);
        registry.estimators = names
            .map(|name| {
                let groups = ours::key_groups(name).unwrap_or_default();
                let build = |vehicle: &Vehicle, settings: NamedSettings<'_>| {
                    if *name == RAIL_ONLY && vehicle.road.is_some() {
                        let message = "this estimator is made for a rail: its force balance has no air drag, but this is a road vehicle";
                        let help = "`attitude`, or the supervised method `dffrls_aekf_robust`";
                        return Err(Refusal::new(message, help));
                    }
                    let built = ours::build(name, vehicle, settings.iter().copied())?;
                    Ok(Box::new(built) as BoxedEstimator)
                };
                PartType {
                    about: ours::about(name).unwrap_or_default().into(),
                    reference: !ours::kind(name).is_some_and(Kind::has_validity_rule),
                    ..EstimatorType::new(name, groups, build)
                }
            })
            .collect();
        let pi = |vehicle: &Vehicle, setup: &ControllerSetup, params: &SpeedControllerParams| {
            SpeedController::new(*params, *vehicle, setup)
        };
        registry.controllers = vec![controller_type(DEFAULT_CONTROLLER, pi)];
        if let Some(pi) = registry.controllers.first_mut() {
            pi.about("PI speed control with feed-forward, anti-windup, torque sharing and hold on slopes.");
        }
        registry
    }
}

impl Registry {
    /// A registry without any part.
    pub fn empty() -> Self {
        Self {
            estimators: Vec::new(),
            controllers: Vec::new(),
            instruments: Vec::new(),
            plants: Vec::new(),
            load_library: None,
            load_controller: None,
            clock: None,
            foreign: None,
        }
    }

    /// Add a type of estimator with the parameters `P`: `registry.estimator("mine", |vehicle, params: &MyParams| …)?`.
    pub fn estimator<P, E>(
        &mut self,
        name: &str,
        build: impl Fn(&Vehicle, &P) -> E + Send + Sync + 'static,
    ) -> Result<&mut EstimatorType, RegistryError>
    where
        P: Parameters + 'static,
        E: Estimator + Send + 'static,
    {
        self.try_estimator(name, move |vehicle, params: &P| {
            Ok::<E, Refusal>(build(vehicle, params))
        })
    }

    /// Add a type of estimator that may refuse a vehicle or its parameters, with a reason in words.
    pub fn try_estimator<P, E, R>(
        &mut self,
        name: &str,
        build: impl Fn(&Vehicle, &P) -> Result<E, R> + Send + Sync + 'static,
    ) -> Result<&mut EstimatorType, RegistryError>
    where
        P: Parameters + 'static,
        E: Estimator + Send + 'static,
        R: Display,
    {
        let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
            let built = build(vehicle, &params_of::<P>(settings)?);
            let help = "use a vehicle and parameters for which this estimator can be built";
            let built = built.map_err(|why| Refusal::new(why.to_string(), help))?;
            Ok(Box::new(built) as BoxedEstimator)
        };
        self.add(EstimatorType::new(name, P::GROUPS, build))
    }

    /// Add a type of estimator whose parameters are known only when the program runs.
    pub fn add(&mut self, new: EstimatorType) -> Result<&mut EstimatorType, RegistryError> {
        add(&mut self.estimators, new, "an estimator", ESTIMATOR_KEYS)
    }

    /// Add a type of controller whose parameters are known only when the program runs.
    pub fn add_controller(
        &mut self,
        new: ControllerType,
    ) -> Result<&mut ControllerType, RegistryError> {
        add(&mut self.controllers, new, "a controller", CONTROLLER_KEYS)
    }

    /// Add a type of controller with the parameters `P`:
    /// `registry.controller("mine", |vehicle, setup, params: &MyParams| …)?`.
    pub fn controller<P, C>(
        &mut self,
        name: &str,
        build: impl Fn(&Vehicle, &ControllerSetup, &P) -> C + Send + Sync + 'static,
    ) -> Result<&mut ControllerType, RegistryError>
    where
        P: Parameters + 'static,
        C: Controller + Send + 'static,
    {
        self.add_controller(controller_type(name, build))
    }

    /// Add a type of instrument with the parameters `P`: `registry.instrument("radar", |on, params: &MyParams| …)?`.
    /// [`Instrument::name`] of what it builds is this name.
    pub fn instrument<P, I>(
        &mut self,
        name: &str,
        build: impl Fn(&Fitting<'_>, &P) -> I + Send + Sync + 'static,
    ) -> Result<&mut InstrumentType, RegistryError>
    where
        P: Parameters + 'static,
        I: Instrument + 'static,
    {
        let build = move |on: &Fitting<'_>, settings: NamedSettings<'_>| {
            Ok(Box::new(build(on, &params_of::<P>(settings)?)) as Box<dyn Instrument>)
        };
        let new = InstrumentType::of(name, P::GROUPS, Arc::new(build));
        add(&mut self.instruments, new, "an instrument", &[])
    }

    /// Add a type of plant with the parameters `P`, which may refuse a vehicle or its parameters with a reason in
    /// words: `registry.plant("mine", |setup, params: &MyParams| …)?`.
    pub fn plant<P, T, R>(
        &mut self,
        name: &str,
        build: impl Fn(&PlantSetup<'_>, &P) -> Result<T, R> + Send + Sync + 'static,
    ) -> Result<&mut PlantType, RegistryError>
    where
        P: Parameters + 'static,
        T: Plant + 'static,
        R: Display,
    {
        if PlantKind::names().any(|ours| ours == name) {
            return Err(RegistryError::NameTaken("a plant", name.into()));
        }
        let build = move |setup: &PlantSetup<'_>, settings: NamedSettings<'_>| {
            let built = build(setup, &params_of::<P>(settings)?);
            let help = "use a vehicle and parameters for which this plant can be built";
            let built = built.map_err(|why| Refusal::new(why.to_string(), help))?;
            Ok(Box::new(built) as Box<dyn Plant>)
        };
        let new = PlantType::of(name, P::GROUPS, Arc::new(build));
        add(&mut self.plants, new, "a plant", PLANT_KEYS)
    }

    /// The types of estimators, in the order in which they were added.
    pub fn estimators(&self) -> &[EstimatorType] {
        &self.estimators
    }

    /// The types of controllers, in the order in which they were added.
    pub fn controllers(&self) -> &[ControllerType] {
        &self.controllers
    }

    /// The types of instruments that the program adds, in the order in which they were added.
    pub fn instruments(&self) -> &[InstrumentType] {
        &self.instruments
    }

    /// The types of plants that the program adds, in the order in which they were added.
    pub fn plants(&self) -> &[PlantType] {
        &self.plants
    }

    /// The type of estimator of this name.
    pub fn find_estimator(&self, name: &str) -> Result<&EstimatorType, Refusal> {
        find(&self.estimators, name, "estimator", &[])
    }

    /// Lets scenarios name shared libraries, FMUs and outside programs, whose estimators `load` finds.
    pub fn load_libraries_with(
        &mut self,
        load: impl Fn(&Path, &Settings, Option<&Arc<WallClock>>) -> Result<EstimatorType, Refusal>
        + Send
        + Sync
        + 'static,
    ) {
        self.load_library = Some(Arc::new(load));
    }

    /// Makes the registry for runs on a wall clock, where deadlines hold for estimators outside the program.
    pub fn on_clock(mut self, clock: Option<Arc<WallClock>>) -> Self {
        self.clock = clock;
        self
    }

    /// Makes the registry for files from others: of their libraries, FMUs and programs only the estimators with these
    /// names are run. The user names them, and not the file.
    pub fn only_foreign(mut self, names: impl IntoIterator<Item = String>) -> Self {
        self.foreign = Some(names.into_iter().collect());
        self
    }

    /// Checks that an estimator (the controller has the name "") may run a foreign part.
    pub fn allows_foreign(&self, name: &str) -> Result<(), Refusal> {
        match &self.foreign {
            Some(names) if !names.contains(name) => Err(Refusal::new(
                "this is foreign code, which this command does not run on the request of a file",
                "`--allow-foreign` runs it, with your rights",
            )),
            _ => Ok(()),
        }
    }

    /// Removes the foreign estimators that the registry does not run; returns their descriptions.
    pub fn leave_out_foreign(&self, estimators: &mut BTreeMap<String, Settings>) -> Vec<String> {
        let out = |name: &String, settings: &mut Settings| {
            settings.is_foreign() && self.allows_foreign(name).is_err()
        };
        let all = estimators.extract_if(.., out);
        all.map(|(name, settings)| format!("{name} ({})", settings.origin(&name)))
            .collect()
    }

    /// Returns the type of an estimator of a scenario: from its library, outside of the program, or by its name.
    pub fn estimator_of(&self, name: &str, settings: &Settings) -> Result<EstimatorType, Refusal> {
        if !settings.is_foreign() {
            return self.find_estimator(settings.type_name(name)).cloned();
        }
        self.allows_foreign(name)?;
        let load = self.load_library.as_ref().ok_or_else(runs_none)?;
        // found when the scenario was loaded; one put together in code has the name alone
        let file = settings.library_file.as_deref();
        let named = settings.file().unwrap_or_default();
        load(
            file.unwrap_or(Path::new(named)),
            settings,
            self.clock.as_ref(),
        )
    }

    /// Lets scenarios name FMUs, whose controllers `load` finds.
    pub fn load_controllers_with(
        &mut self,
        load: impl Fn(&Path, &ControllerSettings) -> Result<ControllerType, Refusal>
        + Send
        + Sync
        + 'static,
    ) {
        self.load_controller = Some(Arc::new(load));
    }

    /// Returns the type of the controller of a scenario: from its FMU, or by its name.
    pub fn controller_of(&self, settings: &ControllerSettings) -> Result<ControllerType, Refusal> {
        let Some(fmu) = &settings.fmu else {
            let kind = settings.kind.as_deref().unwrap_or(DEFAULT_CONTROLLER);
            return self.find_controller(kind).cloned();
        };
        self.allows_foreign("")?;
        let load = self.load_controller.as_ref().ok_or_else(runs_none)?;
        let file = settings.fmu_file.as_deref();
        load(file.unwrap_or(Path::new(fmu)), settings)
    }

    /// The type of controller of this name.
    pub(crate) fn find_controller(&self, name: &str) -> Result<&ControllerType, Refusal> {
        find(&self.controllers, name, "controller", &[])
    }

    /// The type of instrument of this name.
    pub(crate) fn find_instrument(&self, name: &str) -> Result<&InstrumentType, Refusal> {
        find(&self.instruments, name, "instrument", &[])
    }

    /// The type of plant of this name.
    pub(crate) fn find_plant(&self, name: &str) -> Result<&PlantType, Refusal> {
        let ours: Vec<&str> = PlantKind::names().collect();
        find(&self.plants, name, "plant", &ours)
    }
}

impl<B: ?Sized> PartType<B> {
    fn of(name: &str, groups: &'static [&'static [Key]], build: Arc<B>) -> Self {
        Self {
            name: name.into(),
            about: String::new(),
            groups,
            build,
            reference: false,
            answers: None,
        }
    }

    /// Sets the description, one sentence.
    pub fn about(&mut self, sentence: &str) -> &mut Self {
        self.about = sentence.into();
        self
    }

    /// Adds the counter for the answers of an estimator outside the program.
    pub fn counted_by(mut self, counter: AnswerCounter) -> Self {
        self.answers = Some(counter);
        self
    }

    /// Returns the name in scenarios.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Description in one sentence; empty if there is none.
    pub fn description(&self) -> &str {
        &self.about
    }

    /// Returns the parameters of the type.
    pub fn keys(&self) -> impl Iterator<Item = &'static Key> + use<B> {
        self.groups.iter().copied().flatten()
    }

    /// The parameter of this name.
    pub fn key(&self, key: &str) -> Result<&'static Key, Refusal> {
        self.keys().find(|k| k.name == key).ok_or_else(|| {
            let names: Vec<&str> = self.keys().map(|k| k.name).collect();
            Refusal {
                message: format!("{} has no parameter `{key}`", self.name),
                help: suggestion(key, names.iter().copied(), "its parameters"),
            }
        })
    }

    /// Refuses a parameter that does not exist, and a value out of its range.
    pub fn check(&self, key: &str, value: Setting<'_>) -> Result<(), Refusal> {
        let key = self.key(key)?;
        key.check(value).map_err(|_| Refusal {
            message: format!("{value} is not {}", key.kind),
            help: format!("{}: {}", key.name, key.doc),
        })
    }
}

impl EstimatorType {
    /// A type with these parameters, in groups, and a builder that may refuse.
    pub fn new(
        name: &str,
        groups: &'static [&'static [Key]],
        build: impl Fn(&Vehicle, NamedSettings<'_>) -> Result<BoxedEstimator, Refusal>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        Self::of(name, groups, Arc::new(build))
    }

    /// Builds a part for a nominal vehicle.
    pub fn build(
        &self,
        vehicle: &Vehicle,
        settings: NamedSettings<'_>,
    ) -> Result<BoxedEstimator, Refusal> {
        (self.build)(vehicle, settings)
    }
}

impl ControllerType {
    /// A type with these parameters, in groups, and a builder that may refuse.
    pub fn new(
        name: &str,
        groups: &'static [&'static [Key]],
        build: impl Fn(
            &Vehicle,
            &ControllerSetup,
            NamedSettings<'_>,
        ) -> Result<BoxedController, Refusal>
        + Send
        + Sync
        + 'static,
    ) -> Self {
        Self::of(name, groups, Arc::new(build))
    }

    /// Builds a part for a nominal vehicle.
    pub fn build(
        &self,
        vehicle: &Vehicle,
        setup: &ControllerSetup,
        settings: NamedSettings<'_>,
    ) -> Result<BoxedController, Refusal> {
        (self.build)(vehicle, setup, settings)
    }
}

impl InstrumentType {
    /// Builds an instrument on a vehicle.
    pub(crate) fn build(
        &self,
        on: &Fitting<'_>,
        settings: NamedSettings<'_>,
    ) -> Result<Box<dyn Instrument>, Refusal> {
        (self.build)(on, settings)
    }
}

impl PlantType {
    /// Builds a plant.
    pub(crate) fn build(
        &self,
        setup: &PlantSetup<'_>,
        settings: NamedSettings<'_>,
    ) -> Result<Box<dyn Plant>, Refusal> {
        (self.build)(setup, settings)
    }
}

impl<B: ?Sized> Clone for PartType<B> {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            about: self.about.clone(),
            groups: self.groups,
            reference: self.reference,
            answers: self.answers.clone(),
            build: self.build.clone(),
        }
    }
}

impl<B: ?Sized> std::fmt::Debug for PartType<B> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(&self.name)
    }
}

fn controller_type<P, C>(
    name: &str,
    build: impl Fn(&Vehicle, &ControllerSetup, &P) -> C + Send + Sync + 'static,
) -> ControllerType
where
    P: Parameters + 'static,
    C: Controller + Send + 'static,
{
    let build = move |vehicle: &Vehicle, setup: &ControllerSetup, settings: NamedSettings<'_>| {
        let built = build(vehicle, setup, &params_of::<P>(settings)?);
        Ok(Box::new(built) as BoxedController)
    };
    ControllerType::new(name, P::GROUPS, build)
}

/// The default parameters, with these values replaced.
fn params_of<P: Parameters>(settings: NamedSettings<'_>) -> Result<P, ParamError> {
    let mut params = P::default();
    for (key, value) in settings {
        params.set(key, *value)?;
    }
    Ok(params)
}

fn add<'a, B: ?Sized>(
    list: &'a mut Vec<PartType<B>>,
    new: PartType<B>,
    what: &'static str,
    reserved: &[&'static str],
) -> Result<&'a mut PartType<B>, RegistryError> {
    if !valid_name(&new.name) {
        return Err(RegistryError::NotAName(new.name));
    }
    if list.iter().any(|part| part.name == new.name) {
        return Err(RegistryError::NameTaken(what, new.name));
    }
    if let Some(key) = reserved.iter().find(|r| new.keys().any(|k| k.name == **r)) {
        return Err(RegistryError::ReservedKey(new.name, key));
    }
    list.push(new);
    let last = list.len() - 1;
    Ok(&mut list[last])
}

fn runs_none() -> Refusal {
    let help = "the program `monorig` with its feature `plugins`, which is on by default";
    Refusal::new(
        "this program does not run foreign estimators or controllers",
        help,
    )
}

/// `others`: names of parts that are in no list.
fn find<'a, B: ?Sized>(
    list: &'a [PartType<B>],
    name: &str,
    what: &str,
    others: &[&str],
) -> Result<&'a PartType<B>, Refusal> {
    list.iter().find(|part| part.name == name).ok_or_else(|| {
        let names = list.iter().map(|part| part.name.as_str());
        let names: Vec<&str> = others.iter().copied().chain(names).collect();
        Refusal {
            message: format!("there is no {what} `{name}`"),
            help: suggestion(name, names.iter().copied(), &format!("known {what}s")),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Perception, Reference};
    use crate::testing::vehicle;
    use monorig_estimators::api::params::KeyKind;
    use monorig_estimators::api::signals::Command;
    use monorig_estimators::registry::AnyEstimator;

    monorig_estimators::params! {
        /// Parameters of a controller with one motor torque.
        Constant { torque_nm ["N·m"] = 1.0, 0.0 => 10.0, "The torque."; }
    }
    monorig_estimators::params! {
        /// Parameters with a name that scenarios use themselves.
        Reserved { kind ["-"] = 1.0, 0.0 => 10.0, "A number."; }
    }

    struct ConstantTorque(f64);
    impl Controller for ConstantTorque {
        fn control(&mut self, r: &Reference, _: &Perception, _: f64) -> Command {
            let mut c = r.command();
            c.motor_torque_nm[0] = self.0;
            c
        }
    }

    fn constant(_: &Vehicle, _: &ControllerSetup, p: &Constant) -> ConstantTorque {
        ConstantTorque(p.torque_nm)
    }

    #[test]
    fn a_name_is_given_once_and_can_be_part_of_a_path() {
        let mut registry = Registry::default();
        assert!(registry.controller("constant", constant).is_ok());
        let taken = registry.controller("constant", constant).unwrap_err();
        assert!(matches!(taken, RegistryError::NameTaken(..)), "{taken}");
        let taken = registry.controller("pi", constant).unwrap_err();
        assert!(matches!(taken, RegistryError::NameTaken(..)), "{taken}");
        for bad in ["", "a/b", "a b"] {
            let bad = registry.controller(bad, constant).unwrap_err();
            assert!(matches!(bad, RegistryError::NotAName(_)), "{bad}");
        }
        let reserved = |_: &Vehicle, _: &ControllerSetup, _: &Reserved| ConstantTorque(0.0);
        let refused = registry.controller("reserved", reserved).unwrap_err();
        assert!(
            matches!(refused, RegistryError::ReservedKey(..)),
            "{refused}"
        );
    }

    #[test]
    fn names_keys_and_values_are_checked_with_what_may_have_been_meant() {
        let mut registry = Registry::empty();
        registry.controller("constant", constant).unwrap();
        let told = registry.find_controller("constnat").unwrap_err().help;
        assert!(told.contains("did you mean `constant`"), "{told}");
        let kind = registry.find_controller("constant").unwrap();
        let told = kind.check("torqe_nm", 1.0.into()).unwrap_err().help;
        assert!(told.contains("did you mean `torque_nm`"), "{told}");
        let told = kind.check("torque_nm", 11.0.into()).unwrap_err();
        assert!(told.message.contains("0…10 N·m"), "{told}");
        assert!(kind.check("torque_nm", true.into()).is_err());
        assert!(kind.check("torque_nm", 9.0.into()).is_ok());
    }

    /// A type made while the program runs, and one that refuses, in the words of its author.
    #[test]
    fn a_type_without_a_struct_of_parameters_and_a_refusal_in_words() {
        const KEYS: &[Key] = &[Key {
            name: "gain",
            doc: "A gain.",
            kind: KeyKind::Flag { default: true },
        }];
        let mut registry = Registry::empty();
        let refuses = |_: &Vehicle, settings: NamedSettings<'_>| {
            let (key, value) = settings.first().copied().unwrap();
            Err(Refusal::new(format!("{key} is {value}"), "another gain"))
        };
        registry
            .add(EstimatorType::new("foreign", &[KEYS], refuses))
            .unwrap();
        let of_type = registry.find_estimator("foreign").unwrap();
        assert!(of_type.check("gain", true.into()).is_ok());
        assert!(of_type.check("gain", 1.0.into()).is_err());
        let told = of_type.build(&vehicle(), &[("gain", true.into())]).err();
        assert_eq!(told, Some(Refusal::new("gain is true", "another gain")));
        let again = EstimatorType::new("foreign", &[], refuses);
        assert!(matches!(
            registry.add(again),
            Err(RegistryError::NameTaken(..))
        ));
        let reasons = |_: &Vehicle, _: &Constant| Err::<AnyEstimator, _>("no drive unit");
        registry.try_estimator("reasons", reasons).unwrap();
        let told = registry.find_estimator("reasons").unwrap();
        let told = told.build(&vehicle(), &[]).err().unwrap();
        assert_eq!(told.message, "no drive unit");
    }

    #[test]
    fn ours_have_a_sentence_each() {
        let registry = Registry::default();
        for part in registry.estimators() {
            assert!(part.description().ends_with('.'), "{}", part.name());
        }
        for part in registry.controllers() {
            assert!(part.description().ends_with('.'), "{}", part.name());
        }
    }

    #[test]
    fn a_registry_can_be_shared_between_threads() {
        fn shared<T: Send + Sync + Clone + 'static>(_: &T) {}
        shared(&Registry::default());
    }
}
