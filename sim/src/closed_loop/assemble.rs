//! Assembles a simulation from what a builder holds: checks, sensors, estimators, plant, controller.

use super::builder::SimulationBuilder;
use super::end::EndCondition;
use super::events::EventSchedule;
use super::registry::Registry;
use super::simulation::Simulation;
use super::told::Told;
use super::{checks, instruments, nominal_vehicle, obstacles, parts};
use crate::config::scenario::{PlantKind, Scenario};
use crate::control::{ControllerSetup, PerceptionModel};
use crate::error::Error;
use crate::plant::divergence::Causes;
use crate::plant::{PlantOptions, PlantSetup};
use crate::rail::Rail;
use crate::sensors::Fitting;
use crate::train::Train;
use monorig_estimators::api::signals::Vehicle;
use std::path::Path;

impl SimulationBuilder {
    /// Checks all parts against each other, and builds the simulation. The same seed gives the same run, bit for bit.
    pub fn build(mut self, seed: u64) -> Result<Simulation, Error> {
        if let Some(wrong) = self.wrong.take() {
            return Err(wrong);
        }
        self.scenario.check()?;
        assemble(self, seed)
    }
}

impl Simulation {
    /// A builder for a train on a rail, without a scenario file.
    pub fn builder(rail: Rail, train: Train) -> SimulationBuilder {
        SimulationBuilder::of_train(rail, train)
    }

    /// A builder with all values of a scenario file.
    pub fn from_file(path: impl AsRef<Path>) -> Result<SimulationBuilder, Error> {
        SimulationBuilder::from_scenario(Scenario::load(path.as_ref(), &[])?)
    }

    /// Reads every file that a scenario names, checks the files against each other, and builds the simulation; named
    /// parts come from the registry.
    pub fn build(scenario: Scenario, registry: &Registry, seed: u64) -> Result<Self, Error> {
        SimulationBuilder::from_scenario(scenario)?
            .registry(registry)
            .build(seed)
    }
}

fn assemble(builder: SimulationBuilder, seed: u64) -> Result<Simulation, Error> {
    let SimulationBuilder {
        scenario,
        rail,
        moving,
        sensors,
        instruments: mut others,
        registry,
        mut estimators,
        controller,
        mut plant,
        ..
    } = builder;
    let s = &scenario.file;
    let (speed, gravity) = (s.start.speed_mps.get(), s.physics.gravity_mps2.get());
    checks::track(&scenario, &rail, moving.is_car())?;
    let mut train = moving.consist();
    rail.check(&train.limits)
        .map_err(|e| e.in_file(&scenario.track))?;
    if let Some(kg) = s.load.mass_kg {
        train = loaded(&scenario, train, kg.get())?;
    }
    let dt_s = s.physics.dt_ms.get() * 1e-3;
    if s.plant() == PlantKind::Rapier && plant.is_none() {
        checks::step(&scenario, &train, dt_s)?;
    }
    checks::events(&scenario, &train)?;
    checks::windows(&scenario, &rail)?;
    let front_m = checks::front(&scenario, &rail, &train)?;

    let Some((specs, sheet_file)) = sensors else {
        return Err(scenario.error(
            "sensors",
            "the vehicle has no instruments",
            "`.sensors(Sheet::load(…)?)`, or specifications by name",
        ));
    };
    let turned = nominal_vehicle::turned(&specs, Told::new(&scenario, seed).mount_deg());
    let joints_m: Vec<f64> = rail.joint_chainages().collect();
    let on = Fitting {
        joints_m: &joints_m,
        ..Fitting::new(&train, gravity, seed)
    };
    others.extend(parts::instruments(&scenario, &registry, &on)?);
    let sensors = instruments::fit(&scenario, &turned, others, &on)
        .map_err(|e| e.in_file(&scenario, &sheet_file))?;
    let imu = sensors
        .imu_mount()
        .or_else(|| train.mount("imu_link"))
        .unwrap_or(0);
    let mut mounts = sensors.mounts();
    if !mounts.contains(&imu) {
        mounts.push(imu);
    }
    let options = PlantOptions {
        front_m,
        speed_mps: speed,
        gravity_mps2: gravity,
        imu,
        mounts,
        zones: checks::zones(&scenario, &rail)?,
        obstacles: obstacles::place(&scenario, &rail)?,
    };

    if plant.is_none() {
        let setup = PlantSetup {
            train: &train,
            rail: &rail,
            options: &options,
        };
        plant = parts::plant(&scenario, &registry, &setup)?;
    }
    let vehicle = moving.nominal_vehicle(&scenario, &train, imu, seed);
    let vehicle = nominal_vehicle::with_biases(vehicle, &specs, gravity);
    let vehicle = Vehicle::new(vehicle).map_err(|e| {
        let help = "use values that the data sheet of a vehicle can have";
        scenario.error("vehicle", e.to_string(), help)
    })?;
    let nominal_mass_kg = vehicle
        .mass_guess_kg
        .unwrap_or(nominal_vehicle::nominal_mass_kg(&train));
    let estimators = parts::estimators(&scenario, &registry, &vehicle, &mut estimators)?;
    let in_loop = s.in_loop.as_ref();
    let in_loop = in_loop.and_then(|name| estimators.iter().position(|e| e.name == *name));
    let drive = train.drives.first();
    let setup = ControllerSetup {
        motor_torque_max_nm: drive.map_or(0.0, |d| d.torque_max_nm),
        gravity_mps2: gravity,
        start_speed_mps: speed,
    };
    let controller = match controller {
        Some(controller) => controller,
        None => parts::controller(&scenario, &registry, &vehicle, &setup)?,
    };
    let plant_is_ours = plant.is_none();
    let plant = match plant {
        Some(plant) => plant,
        None => {
            let causes = Causes {
                train: &train,
                gravity_mps2: gravity,
                dt_s,
            };
            let at_start = |e| match e {
                Error::Broken { what, .. } => {
                    let told = format!("the train does not come to rest there: {what}");
                    let help = "a place where nothing touches the train, on springs that carry it";
                    scenario.error("start", told, help)
                }
                other => other,
            };
            let (train, rail) = (train.clone(), rail.clone());
            causes.build(|| {
                let plant = moving.plant(s.plant(), train, rail, &options);
                plant.map_err(at_start)
            })?
        }
    };
    Ok(Simulation {
        imu_offset_m: plant.truth().chainage_m - front_m,
        cycle: s.drive.cycle(speed),
        events: EventSchedule::new(&s.events, drive.map_or(0.0, |d| d.clamp_mpa)),
        perception: PerceptionModel::new(s.drive.controller.feedforward, nominal_mass_kg, &vehicle),
        end: EndCondition {
            after_s: s.stop.time_limit_s(),
            at_m: s.stop.at_m.map_or(f64::INFINITY, f64::from),
            start_m: front_m,
            train_length_m: train.limits.length_m,
            track_length_m: rail.length(),
        },
        obstacles: options.obstacles,
        controller,
        dt_s,
        seed,
        rail,
        train,
        plant,
        plant_is_ours,
        sensors,
        instruments: specs,
        vehicle,
        estimators,
        in_loop,
        scenario,
    })
}

/// The train with this load (kg) on the hook.
fn loaded(scenario: &Scenario, train: Train, mass_kg: f64) -> Result<Train, Error> {
    let limit = train.limits.max_load_kg;
    train.with_load_mass(mass_kg).map_err(|_| {
        scenario.error(
            "load.mass_kg",
            format!("the train cannot carry a load of {mass_kg} kg"),
            format!("a load from 0 to {limit} kg"),
        )
    })
}
