//! Start of a plant, and its surroundings.

use super::obstacles::ObstacleBox;
use super::train::adhesion::AdhesionZone;
use crate::rail::Rail;
use crate::train::Train;
use std::sync::Arc;

/// Start and surroundings of a plant.
#[derive(Clone, Debug, Default)]
pub struct PlantOptions {
    /// Chainage of the vehicle's front, m.
    pub front_m: f64,
    /// Speed at the start, m/s.
    pub speed_mps: f64,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
    /// Index of the mount that carries the IMU (`Train::mounts`); a car has one only.
    pub imu: usize,
    /// Indices of all mounts that carry an instrument; the other entries of `Truth::mounts` keep their values of the
    /// start.
    pub mounts: Vec<usize>,
    /// Slippery stretches.
    pub zones: Vec<AdhesionZone>,
    /// Obstacles and walls; only rigid bodies meet them.
    pub obstacles: Vec<ObstacleBox>,
}

/// Vehicle, track and start that a plant is built from.
#[derive(Clone, Copy, Debug)]
pub struct PlantSetup<'a> {
    /// The vehicle, with the load of the scenario; of a car its consist.
    pub train: &'a Train,
    /// The rail or road.
    pub rail: &'a Arc<Rail>,
    /// Start and surroundings.
    pub options: &'a PlantOptions,
}
