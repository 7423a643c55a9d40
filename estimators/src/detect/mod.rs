//! Detectors, gates and the validity rule: small pieces, each with a name and a switch.
//!
//! | piece | switch | what it does | off |
//! |---|---|---|---|
//! | [`ExcitationGate`](excitation_gate::ExcitationGate) | `excitation_gate` | gives samples little weight while the regressor does not vary | all samples weigh alike |
//! | [`LoadChangeDetector`](load_change::LoadChangeDetector) | `load_change_detector` | reopens the mass when residuals keep to one side | another load is learnt only by forgetting |
//! | [`SlipDetector`](slip::SlipDetector) | `slip_detector` | slipping wheels end the grade of a method | it goes on |
//! | rail memory ([`RailMemory`](crate::rail::rail_memory::RailMemory)) | `rail_memory` | means of the grade over where a long train rests | the train is a point |
//! | [`GradeObservability`](observability::GradeObservability) | – | a grade carried on by dead reckoning is not valid | – |
//! | [`Gate`](crate::instruments::gate::Gate) | `innovation_gate` (baselines) | keeps outliers out of the filters, and reopens | all measurements enter |
//! | [`NisMonitor`](nis_monitor::NisMonitor) | `nis_monitor` | nothing is valid while innovations are larger than the noise allows | no part of validity |
//! | [`Plausibility`](plausibility::Plausibility) | `plausibility` | nothing is valid while instruments contradict gravity, geometry or each other | no part of validity |
//! | [`DynamicLag`](dynamic_lag::DynamicLag) | `lag_share` | adds to the standard deviation of a grade what it moves by while its filter settles | it does not |
//! | [`StandingLoad`](standing_load::StandingLoad) | `standing_load_s` | a standstill opens the mass | it stays |
//! | [`Validity`](validity::Validity) | `validity_gate` | marks only values that meet the validity rule as valid | all estimated values are |
//! | [`Conditioning`](crate::preprocess::conditioning::Conditioning) | `outlier_hold`, `noise` | holds out jumps, learns the noise | samples as they come, noise of the parameters |
//!
//! Measurements pass three layers: [`control`] (new, held, or out of use), gate (whether and with what weight it
//! enters), and fuse (the filter's update). What became of the last one is published for each source as
//! [`AidStatus`](crate::api::aid::AidStatus).

pub mod control;
pub mod cusum;
pub mod dynamic_lag;
pub mod excitation_gate;
pub mod gravity_check;
pub mod kinematic_consistency;
pub mod load_change;
pub mod nis_monitor;
pub mod observability;
pub mod plausibility;
pub mod slip;
pub mod standing_load;
pub mod validity;
