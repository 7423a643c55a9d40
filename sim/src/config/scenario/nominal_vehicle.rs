//! Nominal vehicle: the values with which estimators and controller are built.

use crate::config::checked::{Finite, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Nominal values given to estimators and controller, where they differ from the train's data sheet. What is not given
/// is drawn about the truth with the seed of the run, unless it is under `exact`; of a car nothing is drawn.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NominalVehicle {
    /// kg.
    pub tare_kg: Option<Positive>,
    /// First guess of the total mass for estimators and feed-forward, kg.
    pub total_mass_guess_kg: Option<Positive>,
    /// Running-resistance coefficient.
    pub running_resistance: Option<NonNegative>,
    /// m.
    pub wheel_radius_m: Option<Positive>,
    /// Share of motor power that reaches the wheel rim when driving.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub efficiency: Option<Positive>,
    /// Distance of the IMU ahead of the middle of its unit, m; of a train only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu_arm_m: Option<Finite>,
    /// Length of the load's chains, m; of a train only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain_m: Option<NonNegative>,
    /// False: where the masses of the train sit is not told; of a train only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layout: Option<bool>,
    /// Nominal values that equal the true values, each with the reason.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub exact: BTreeMap<ToldValue, String>,
}

/// Nominal value of the vehicle that differs from the truth as the values of a data sheet do.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum ToldValue {
    /// All of them.
    All,
    /// Direction of the IMU's axes in its unit.
    Mount,
    /// Mass of the empty train.
    TareKg,
    /// First guess of the total mass. Not exact it is anywhere between tare and tare with the rated load, exact it is
    /// tare and half the rated load.
    TotalMassGuessKg,
    /// Running-resistance coefficient.
    RunningResistance,
    /// Radius of the wheels.
    WheelRadiusM,
    /// Efficiency of the drives.
    Efficiency,
    /// Length of the load's chains.
    ChainM,
}

impl NominalVehicle {
    /// Returns true if the nominal value is the true value.
    pub fn is_exact(&self, value: ToldValue) -> bool {
        self.exact.contains_key(&ToldValue::All) || self.exact.contains_key(&value)
    }
}
