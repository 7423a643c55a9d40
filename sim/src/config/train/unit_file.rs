//! The format of a unit file: what URDF has no words for.

use crate::config::checked::{Finite, Fraction, NonNegative, Positive, Version1};
use crate::config::motor_file::MotorFile;
use crate::train::ConnectionKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A unit file, `assets/units/*.yaml`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnitFile {
    /// Format version, 1.
    pub(crate) version: Version1,
    /// URDF file, relative to this file.
    pub(crate) urdf: String,
    /// Room the unit takes along the rail, from coupling to coupling, m; not for a load.
    #[serde(default)]
    pub(crate) length_m: Option<Positive>,
    /// Springs of the wheels, for a unit with `running_wheel…` links.
    #[serde(default)]
    pub(crate) running_gear: Option<RunningGear>,
    /// Motor, gear, clamp and brake, for a unit with friction wheels.
    #[serde(default)]
    pub(crate) drive: Option<DriveFile>,
    /// Trolleys a hung unit (cab, beam) hangs from.
    #[serde(default)]
    pub(crate) carried_by: Option<CarriedBy>,
    /// Connections between links of this unit that `floating` joints set free.
    #[serde(default)]
    pub(crate) connections: Vec<ConnectionFile>,
    /// Payload and chains, for a load.
    #[serde(default)]
    pub(crate) load: Option<LoadFile>,
}

/// Springs of running wheels and guide wheels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RunningGear {
    /// One running wheel, N/m.
    pub wheel_stiffness_npm: Positive,
    /// One running wheel, N·s/m.
    pub wheel_damping_nspm: NonNegative,
    /// Way up before the hold-down side touches, m.
    pub holddown_play_m: NonNegative,
    /// Guide wheels of one station, N/m.
    pub guide_stiffness_npm: Positive,
    /// Guide wheels of one station, N·s/m.
    pub guide_damping_nspm: NonNegative,
}

/// Drive of a unit with two friction wheels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveFile {
    /// The motor.
    pub motor: MotorFile,
    /// The gear between the motor and both wheels.
    pub gear: Gear,
    /// The cylinder that presses the wheels on the web.
    pub clamp: Clamp,
    /// Friction between wheel and web (LuGre).
    pub friction: Friction,
    /// The brake that grips the web.
    pub brake: Brake,
}

/// Gear.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Gear {
    /// Motor revolutions per wheel revolution.
    pub ratio: Positive,
    /// Share of power that passes when driving.
    pub efficiency_drive: Fraction,
    /// Share of power that passes when braking.
    pub efficiency_brake: Fraction,
}

/// Clamp cylinder: each wheel of the pair is pressed on the web with pressure × piston area.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Clamp {
    /// Diameter of the piston, lever ratio of the arms included, m.
    pub piston_diameter_m: Positive,
    /// Nominal pressure, MPa.
    pub pressure_mpa: NonNegative,
    /// First-order lag of the pressure, s.
    pub lag_s: NonNegative,
}

/// LuGre friction between one wheel and the web.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Friction {
    /// Coefficient on a clean dry rail.
    pub adhesion: NonNegative,
    /// Bristle stiffness σ0, N/m.
    pub sigma0_npm: Positive,
    /// Bristle damping σ1, N·s/m.
    pub sigma1_nspm: NonNegative,
    /// Rolling term κ, 1/m: bristles let go as the wheel rolls on; creep is κ F / σ0.
    pub kappa_1pm: NonNegative,
}

/// Clamp brake.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Brake {
    /// Largest force of the unit, N.
    pub force_max_n: NonNegative,
    /// First-order lag, s.
    pub lag_s: NonNegative,
}

/// Trolleys above a hung unit, one for each hanger link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CarriedBy {
    /// Unit file of the trolley, relative to this file.
    pub trolley: String,
    /// Links of this unit that meet the trolleys' `hanger` links, front to rear.
    pub links: Vec<String>,
    /// N/m in each direction.
    pub stiffness_npm: Positive,
    /// N·s/m in each direction.
    pub damping_nspm: NonNegative,
}

/// A spring-damper between two links.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ConnectionFile {
    /// Forces that the connection can carry.
    pub kind: KindOfConnection,
    /// One link.
    pub from: String,
    /// The other link.
    pub to: String,
    /// N/m.
    pub stiffness_npm: Positive,
    /// N·s/m.
    pub damping_nspm: NonNegative,
}

/// The forces that a connection can carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "ConnectionKind")] // the name in the JSON schema
pub(crate) enum KindOfConnection {
    /// Push and pull along the line between the anchors.
    Drawbar,
    /// Holds the anchors together in all directions (a ball joint).
    Hanger,
    /// Pull only.
    Chain,
}

impl From<KindOfConnection> for ConnectionKind {
    fn from(kind: KindOfConnection) -> Self {
        match kind {
            KindOfConnection::Drawbar => Self::Drawbar,
            KindOfConnection::Hanger => Self::Hanger,
            KindOfConnection::Chain => Self::Chain,
        }
    }
}

/// A load: lifting gear that is always there, and a payload that comes and goes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadFile {
    /// The link whose mass is the payload; its inertia scales with it. Every other link is tare.
    pub payload_link: String,
    /// Links where chains end; the unit above has links of the same names.
    pub chain_links: Vec<String>,
    /// Distance below the links of the unit above, m.
    pub drop_m: Positive,
    /// One chain, N/m.
    pub stiffness_npm: Positive,
    /// One chain, N·s/m.
    pub damping_nspm: NonNegative,
    /// Offset of the load along the rail, + forward, m.
    #[serde(default = "zero")]
    pub offset_m: Finite,
}

fn zero() -> Finite {
    Finite::ZERO
}
