//! Which supervisors of a supervised method are on.

use crate::api::params::params;
use crate::api::vehicle::Vehicle;
use crate::detect::validity::Integrity;
use crate::preprocess::conditioning::ConditioningParams;

params! {
    /// Which supervisors of an estimator are on.
    Supervision {
        grade_map [flag] = true, "Keep the rail under a long train in memory; off: the train is a point.";
    }
}

params! {
    /// Which supervisors of a two-stage estimator are on.
    TwoStageSupervision {
        slip_detector [flag] = true, "No grade is valid while wheel speed does not follow the force balance.";
        grade_map [flag] = true, "Keep the rail under a long train in memory; off: the train is a point.";
    }
}

/// The supervisors of an estimator, as its parameters have them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Supervisors {
    /// True if the rail is kept in memory.
    pub grade_map: bool,
    /// True if a slip detector is on.
    pub slip_detector: bool,
    /// Innovation gates and validity rule.
    pub integrity: Integrity,
    /// Conditioning of the channels.
    pub conditioning: ConditioningParams,
}

impl Supervision {
    /// With innovation gates, validity rule and conditioning.
    pub fn with(&self, integrity: Integrity, conditioning: ConditioningParams) -> Supervisors {
        Supervisors {
            grade_map: self.grade_map,
            slip_detector: false,
            integrity,
            conditioning,
        }
    }
}

impl TwoStageSupervision {
    /// With innovation gates, validity rule and conditioning.
    pub fn with(&self, integrity: Integrity, conditioning: ConditioningParams) -> Supervisors {
        Supervisors {
            grade_map: self.grade_map,
            slip_detector: self.slip_detector,
            integrity,
            conditioning,
        }
    }
}

/// The vehicle as it is with a rail memory, a point without.
pub fn mapped(vehicle: &Vehicle, grade_map: bool) -> Vehicle {
    if grade_map {
        *vehicle
    } else {
        vehicle.as_point()
    }
}
