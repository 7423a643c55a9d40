//! Supervision of the robust estimators: small pieces around the published mathematics, each with a name and a switch.
//!
//! | piece | switch | what it does | off |
//! |---|---|---|---|
//! | [`ExcitationGate`](excitation_gate::ExcitationGate) | `excitation_gate` | gives samples little weight while the regressor does not vary | all samples weigh alike |
//! | [`LoadChangeDetector`](load_change::LoadChangeDetector) | `load_change_detector` | reopens the mass when residuals keep to one side | another load is learnt only by forgetting |
//! | [`SlipDetector`](slip::SlipDetector) | `slip_detector` | a grade found with slipping wheels is not valid | it is |
//! | grade map ([`DistributedTrain`](crate::models::distributed_train::DistributedTrain)) | `grade_map` | means of the grade over where a long train rests | the train is a point |
//! | [`GradeObservability`](observability::GradeObservability) | – | a grade carried on by dead reckoning is not valid | – |
//! | [`ValidityGate`](validity::ValidityGate) | `validity_gate` | marks only values that meet the validity rule as valid | all estimated values are |
//!
//! Measurements pass three layers: [`control`] (new, held, or out of use), gate (how far it is to be believed), and fuse (the filter's
//! update). What became of the last one is published for each source as [`AidStatus`](crate::api::aid::AidStatus).

pub mod control;
pub mod excitation_gate;
pub mod load_change;
pub mod observability;
pub mod slip;
pub mod validity;

use crate::api::params::params;
use crate::api::vehicle::Vehicle;

params! {
    /// Which supervisors of an estimator are on.
    Supervision {
        grade_map [flag] = true, "Keep a map of the grade under a long train; off: the train is a point.";
        validity_gate [flag] = true, "Mark only values that meet the validity rule as valid; off: all estimated values are.";
    }
}

params! {
    /// Which supervisors of a two-stage estimator are on.
    TwoStageSupervision {
        slip_detector [flag] = true, "No grade is valid while wheel speed does not follow the force balance.";
        grade_map [flag] = true, "Keep a map of the grade under a long train; off: the train is a point.";
        validity_gate [flag] = true, "Mark only values that meet the validity rule as valid; off: all estimated values are.";
    }
}

/// The vehicle as it is with a grade map, a point without.
pub fn mapped(vehicle: &Vehicle, grade_map: bool) -> Vehicle {
    if grade_map {
        *vehicle
    } else {
        vehicle.as_point()
    }
}
