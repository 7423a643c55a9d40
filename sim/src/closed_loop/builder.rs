//! Builds a simulation from a scenario: rail, train, plant, instruments, estimators, controller.

use crate::closed_loop::estimators::RunningEstimator;
use crate::closed_loop::events::EventSchedule;
use crate::closed_loop::instruments;
use crate::closed_loop::nominal_vehicle;
use crate::closed_loop::obstacles;
use crate::closed_loop::parts;
use crate::closed_loop::registry::{BoxedController, Registry};
use crate::config::scenario::{Event, PlantKind, Scenario};
use crate::config::sensor_sheet::Sheet;
use crate::control::{ControllerSetup, Cycle, PerceptionModel};
use crate::error::Error;
use crate::plant::Plant;
use crate::plant::obstacles::ObstacleBox;
use crate::plant::point_mass::{PointMass, PointMassOptions};
use crate::plant::rapier::{World, WorldOptions};
use crate::plant::road::{Car, RoadOptions, RoadPlant};
use crate::plant::train::adhesion::Zone;
use crate::rail::{Rail, RailFrame};
use crate::sensors::Suite;
use crate::train::Train;
use monorig_estimators::api::signals::Vehicle;
use std::sync::Arc;

/// A simulation ready to run: everything a run needs, checked against each other.
pub struct Simulation {
    /// The scenario it was built from.
    pub scenario: Scenario,
    /// Seed of this run.
    pub seed: u64,
    /// The rail.
    pub rail: Arc<Rail>,
    /// The train as it starts; a car as [`Car::consist`] describes it.
    pub train: Train,
    /// What moves.
    pub plant: Box<dyn Plant>,
    /// The instruments.
    pub sensors: Suite,
    /// Nominal vehicle given to estimators and controller.
    pub vehicle: Vehicle,
    /// The estimators.
    pub estimators: Vec<RunningEstimator>,
    /// The controller.
    pub controller: BoxedController,
    /// The drive cycle.
    pub cycle: Cycle,
    /// Events still to come.
    pub events: EventSchedule,
    /// Index of the estimator whose output the controller uses.
    pub in_loop: Option<usize>,
    /// What the controller sees.
    pub perception: PerceptionModel,
    /// Step, s.
    pub dt_s: f64,
    /// Chainage of the IMU minus that of the front, m.
    pub imu_offset_m: f64,
    /// End of the track, m.
    pub track_length_m: f64,
    /// When the run ends.
    pub stop: StopAt,
    /// Obstacles and roadway walls.
    pub obstacles: Vec<ObstacleBox>,
}

/// When a run ends.
#[derive(Clone, Copy, Debug)]
pub struct StopAt {
    /// s.
    pub after_s: f64,
    /// Chainage of the front, m.
    pub at_m: f64,
}

/// Room left behind the last wheel at the start when the scenario does not say where to start, m.
const REAR_ROOM: f64 = 1.0;

impl Simulation {
    /// Read every file a scenario names, check them against each other, and build; estimators and controller come from the registry.
    pub fn build(scenario: Scenario, registry: &Registry, seed: u64) -> Result<Self, Error> {
        let s = &scenario.file;
        let rail = Arc::new(Rail::load_with(&scenario.track, &scenario.sets("track"))?);
        let car = match &s.car {
            Some(_) => Some(Car::load_with(&scenario.vehicle, &scenario.sets("car"))?),
            None => None,
        };
        check_track(&scenario, &rail, car.is_some())?;
        let mut train = match &car {
            Some(car) => car.consist(),
            None => Train::load_with(&scenario.vehicle, &scenario.sets("train"))?,
        };
        rail.check(&train.limits)?;
        if let Some(kg) = s.load.mass_kg {
            let limit = train.limits.max_load_kg;
            train = train.with_load_mass(kg.get()).map_err(|_| {
                scenario.error(
                    "load.mass_kg",
                    format!("the train cannot carry a load of {} kg", kg.get()),
                    format!("a load from 0 to {limit} kg"),
                )
            })?;
        }
        let dt_s = s.physics.dt_ms.get() * 1e-3;
        if s.plant() == PlantKind::Rapier {
            check_step(&scenario, &train, dt_s)?;
        }
        check_loads(&scenario, &train)?;
        let front = place(&scenario, &rail, &train)?;
        let sheet = Sheet::load_with(&scenario.sensors, &scenario.sets("sensors"))?;
        let sensors = instruments::fit(&scenario, &sheet, Vec::new(), &train, seed)?;
        let imu = sensors
            .imu_mount()
            .or_else(|| train.mount("imu_link"))
            .unwrap_or(0);
        let mut mounts = sensors.mounts();
        if !mounts.contains(&imu) {
            mounts.push(imu);
        }
        let zones = zones(&scenario, &rail)?;
        let obstacles = obstacles::place(&scenario, &rail)?;

        let (speed, gravity) = (s.start.speed_mps.get(), s.physics.gravity_mps2.get());
        let vehicle = match &car {
            Some(car) => car.nominal_vehicle(&s.vehicle, gravity),
            None => nominal_vehicle::vehicle(&scenario, &train, imu),
        };
        let vehicle = Vehicle::new(vehicle).map_err(|e| {
            let help = "values that the data sheet of a vehicle can have";
            scenario.error("vehicle", e.to_string(), help)
        })?;
        let guess = s
            .vehicle
            .total_mass_guess_kg
            .map_or(nominal_vehicle::nominal_mass_kg(&train), f64::from);
        let estimators = parts::estimators(&scenario, registry, &vehicle)?;
        let in_loop = match &s.in_loop {
            None => None,
            Some(name) => estimators.iter().position(|m| m.name == *name),
        };
        let plant: Box<dyn Plant> = match (&car, s.plant()) {
            (Some(car), _) => {
                let o = RoadOptions {
                    front_m: front,
                    speed_mps: speed,
                    gravity_mps2: gravity,
                    zones,
                };
                Box::new(RoadPlant::new(car, rail.clone(), &o))
            }
            (None, PlantKind::PointMass) => {
                let o = PointMassOptions {
                    front_m: front,
                    speed_mps: speed,
                    gravity_mps2: gravity,
                    imu,
                    mounts,
                    zones,
                };
                Box::new(PointMass::new(train.clone(), rail.clone(), &o))
            }
            (None, _) => {
                let o = WorldOptions {
                    front_m: front,
                    speed_mps: speed,
                    gravity_mps2: gravity,
                    imu,
                    mounts,
                    zones,
                    obstacles: obstacles.clone(),
                };
                Box::new(World::new(train.clone(), rail.clone(), &o)?)
            }
        };
        let setup = ControllerSetup {
            motor_torque_max_nm: train.drives.first().map_or(0.0, |d| d.torque_max_nm),
            gravity_mps2: gravity,
            start_speed_mps: speed,
        };
        let clamp = train.drives.first().map_or(0.0, |d| d.clamp_mpa);
        let imu_offset_m = plant.truth().chainage_m - front;
        Ok(Self {
            controller: parts::controller(&scenario, registry, &vehicle, &setup)?,
            cycle: Cycle::new(&s.drive, speed),
            events: EventSchedule::new(&s.events, clamp),
            perception: PerceptionModel::new(s.drive.controller.feedforward, guess),
            stop: StopAt {
                after_s: s.stop.time_limit_s(),
                at_m: s.stop.at_m.map_or(f64::INFINITY, f64::from),
            },
            track_length_m: rail.length(),
            imu_offset_m,
            dt_s,
            seed,
            rail,
            train,
            plant,
            sensors,
            vehicle,
            estimators,
            in_loop,
            obstacles,
            scenario,
        })
    }

    /// The rail sampled for drawing.
    pub fn rail_samples(&self) -> Vec<RailFrame> {
        self.rail.samples(0.5)
    }
}

/// A car runs on a road, a train on a rail.
fn check_track(scenario: &Scenario, rail: &Rail, car: bool) -> Result<(), Error> {
    match (car, rail.profile()) {
        (true, Some(_)) => Err(scenario.error(
            "track",
            "this track is a rail, and a car needs a road",
            "a track with `road_width_m` in place of `profile`",
        )),
        (false, None) => Err(scenario.error(
            "track",
            "this track is a road, and a train needs a rail",
            "a track with `profile` in place of `road_width_m`",
        )),
        _ => Ok(()),
    }
}

/// The physics step suits the train's springs. The scenario is blamed: it chose the step.
fn check_step(scenario: &Scenario, train: &Train, dt_s: f64) -> Result<(), Error> {
    train.check_step(dt_s).map_err(|e| match e {
        Error::Input(e) => scenario.error(
            "physics.dt_ms",
            format!("{} (train {})", e.message, scenario.vehicle.display()),
            e.help,
        ),
        other => other,
    })
}

/// No event hangs more on the hook than the train may carry.
fn check_loads(scenario: &Scenario, train: &Train) -> Result<(), Error> {
    let most = if train.load.is_some() {
        train.limits.max_load_kg
    } else {
        0.0
    };
    for (i, e) in scenario.file.events.iter().enumerate() {
        if let Event::LoadMass { load_mass_kg, .. } = e
            && load_mass_kg.get() > most
        {
            return Err(scenario.error(
                format!("events[{i}].load_mass_kg"),
                format!("the train cannot carry a load of {} kg", load_mass_kg.get()),
                format!("a load from 0 to {most} kg"),
            ));
        }
    }
    Ok(())
}

/// Chainage of the front at the start.
fn place(scenario: &Scenario, rail: &Rail, train: &Train) -> Result<f64, Error> {
    let length = train.limits.length_m;
    let least = length + REAR_ROOM;
    let front = scenario.file.start.chainage_m.map_or(least, f64::from);
    if front < length || front > rail.length() {
        return Err(scenario.error(
            "start.chainage_m",
            format!("with its front at {front} m the train does not stand on the track"),
            format!(
                "a chainage from {} m (the train is that long) to {} m (the track ends there)",
                libm::ceil(length * 1e3 - 1e-6) / 1e3,
                rail.end_m()
            ),
        ));
    }
    if let Some(end) = scenario
        .file
        .stop
        .at_m
        .filter(|end| end.get() > rail.length())
    {
        return Err(scenario.error(
            "stop.at_m",
            format!("{} m is beyond the end of the track", end.get()),
            format!("a chainage of at most {} m", rail.end_m()),
        ));
    }
    Ok(front)
}

fn zones(scenario: &Scenario, rail: &Rail) -> Result<Vec<Zone>, Error> {
    let mut zones = Vec::new();
    for (i, e) in scenario.file.events.iter().enumerate() {
        if let Event::Adhesion {
            from_m,
            to_m,
            adhesion,
        } = e
        {
            let z = Zone {
                from_m: from_m.get(),
                to_m: to_m.get(),
                adhesion: adhesion.get(),
            };
            if z.from_m >= rail.length() {
                return Err(scenario.error(
                    format!("events[{i}].from_m"),
                    format!(
                        "the zone starts at {} m, beyond the end of the track",
                        z.from_m
                    ),
                    format!("a chainage below {} m", rail.end_m()),
                ));
            }
            if z.to_m > rail.length() {
                return Err(scenario.error(
                    format!("events[{i}].to_m"),
                    format!("the zone ends at {} m, beyond the end of the track", z.to_m),
                    format!("a chainage of at most {} m", rail.end_m()),
                ));
            }
            zones.push(z);
        }
    }
    Ok(zones)
}
