//! A train on a rail or a car on a road. This file alone leads to the room of the car.

use super::nominal_vehicle;
use crate::config::file::{Document, input_error};
use crate::config::scenario::{PlantKind, Scenario};
use crate::error::Error;
use crate::plant::point_mass::PointMass;
use crate::plant::rapier::World;
use crate::plant::{Plant, PlantOptions};
use crate::rail::Rail;
use crate::road::{Car, RoadPlant};
use crate::train::Train;
use monorig_estimators::api::signals::VehicleData;
use std::path::Path;
use std::sync::Arc;

/// The vehicle of a simulation.
pub(super) enum Moving {
    /// A train on a rail.
    Train(Box<Train>),
    /// A car on a road.
    Car(Box<Car>),
}

impl Moving {
    /// Reads the vehicle that a scenario names.
    pub fn of_scenario(scenario: &Scenario) -> Result<Self, Error> {
        let path = &scenario.vehicle;
        Ok(match scenario.file.car {
            Some(_) => Self::Car(Box::new(Car::load_with(path, &scenario.sets("car"))?)),
            None => Self::Train(Box::new(Train::load_with(path, &scenario.sets("train"))?)),
        })
    }

    /// Reads a file of either kind.
    pub fn of_file(file: &Path) -> Result<Self, Error> {
        let keys = Document::read(file)?.keys();
        let has = |key: &str| keys.iter().any(|k| k == key);
        if has("consist") {
            Ok(Self::Train(Box::new(Train::load(file)?)))
        } else if has("tyres") {
            Ok(Self::Car(Box::new(Car::load(file)?)))
        } else {
            Err(input_error(
                file,
                "",
                "this is neither a train nor a car",
                "a file with `consist` (a train) or with `tyres` (a car)",
            ))
        }
    }

    /// Returns true for a car.
    pub fn is_car(&self) -> bool {
        matches!(self, Self::Car(_))
    }

    /// The bodies, drives and mounts.
    pub fn consist(&self) -> Train {
        match self {
            Self::Train(train) => train.as_ref().clone(),
            Self::Car(car) => car.consist(),
        }
    }

    /// The nominal vehicle: the data sheet, with the changes of the scenario; of a train with what is drawn about it.
    /// `imu` is the mount of the IMU in `train`.
    pub fn nominal_vehicle(
        &self,
        scenario: &Scenario,
        train: &Train,
        imu: usize,
        seed: u64,
    ) -> VehicleData {
        let Self::Car(car) = self else {
            return nominal_vehicle::of_train(scenario, train, imu, seed);
        };
        let nominal = &scenario.file.vehicle;
        let gravity = scenario.file.physics.gravity_mps2.get();
        let sheet = car.nominal_vehicle(nominal.tare_kg.map(f64::from), gravity);
        VehicleData {
            wheel_radius_m: nominal
                .wheel_radius_m
                .map_or(sheet.wheel_radius_m, f64::from),
            running_resistance: nominal
                .running_resistance
                .map_or(sheet.running_resistance, f64::from),
            efficiency: nominal.efficiency.map_or(sheet.efficiency, f64::from),
            mass_guess_kg: nominal.total_mass_guess_kg.map(f64::from),
            ..sheet
        }
    }

    /// Plant that moves the vehicle; `train` has the load of the scenario.
    pub fn plant(
        &self,
        kind: PlantKind,
        train: Train,
        rail: Arc<Rail>,
        options: &PlantOptions,
    ) -> Result<Box<dyn Plant>, Error> {
        Ok(match (self, kind) {
            (Self::Car(car), _) => Box::new(RoadPlant::new(car, rail, options)),
            (Self::Train(_), PlantKind::PointMass) => {
                Box::new(PointMass::new(train, rail, options))
            }
            (Self::Train(_), _) => Box::new(World::new(train, rail, options)?),
        })
    }
}
