//! Keys of the map file under `reference`.

use super::formula::{Condition, Formula};
use crate::notation::UnitName;
use monorig_sim::config::checked::{Finite, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// References with which estimates are compared, with their standard deviations.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct References {
    /// The slope under the vehicle.
    pub slope: Option<SlopeReference>,
    /// The effective slope, asin(Σ mᵢ sin θᵢ / Σ mᵢ) over the length of the vehicle; none = the slope under the vehicle
    /// if the vehicle is a point, else unknown.
    pub effective_slope: Option<SlopeReference>,
    /// The total mass.
    pub mass: Option<MassReference>,
    /// The speed of the vehicle, by an instrument that does not roll with its wheels: of this or `distance` `monorig
    /// calibrate` finds the radius of the wheels.
    pub speed: Option<WayReference>,
    /// The distance along the track: marks that were surveyed, a laser, a measuring wheel.
    pub distance: Option<WayReference>,
}

/// A reference of the speed or of the distance.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WayReference {
    /// File of the column, by its name under `files`.
    pub file: Option<String>,
    /// The column; a row without a value does not count.
    pub column: Formula,
    /// Its unit.
    pub unit: UnitName,
    /// Standard deviation, in this unit: of a speed one error of the whole log, of a distance one of each row.
    pub sd: NonNegative,
    /// Samples count only where this is true.
    pub valid_if: Option<Condition>,
}

/// A reference of the slope: one of `deg`, `column` and `altitude`.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SlopeReference {
    /// A constant slope, degrees.
    pub deg: Option<Finite>,
    /// File of the column, by its name under `files`.
    pub file: Option<String>,
    /// A column of slopes, linear between its samples.
    pub column: Option<Formula>,
    /// Unit of the column: rad, deg, sin, tan or %.
    pub unit: Option<UnitName>,
    /// From columns of altitude and distance.
    pub altitude: Option<Altitude>,
    /// Standard deviation of the reference, degrees.
    pub sd_deg: NonNegative,
    /// Samples count only where this is true.
    pub valid_if: Option<Condition>,
}

/// The slope from altitude over distance, or over the distance between positions: the regression over a stated window,
/// centred.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Altitude {
    /// Column of the altitude.
    pub column: Formula,
    /// Column of the distance along the track, in the same file; or `latitude` and `longitude`.
    pub distance: Option<Formula>,
    /// Column of the latitude, degrees (WGS 84), in the same file.
    pub latitude: Option<Formula>,
    /// Column of the longitude, degrees, in the same file.
    pub longitude: Option<Formula>,
    /// Unit of altitude and distance.
    pub unit: UnitName,
    /// Length of the window, m.
    pub window_m: Positive,
}

/// A reference of the mass: `kg`, or `steps`.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MassReference {
    /// Total mass, kg.
    pub kg: Option<Positive>,
    /// Total mass from certain times on.
    pub steps: Option<Vec<MassStep>>,
    /// Standard deviation, kg.
    pub sd_kg: NonNegative,
}

/// The mass from a time on.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MassStep {
    /// Begin, s of the replay.
    pub at_s: NonNegative,
    /// Total mass, kg.
    pub kg: Positive,
}
