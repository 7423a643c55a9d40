//! The commands, a file each: its arguments with their help, and what it does. A new one is a file, its `mod` and its
//! line in the list.

mod calibrate;
mod check;
mod compare;
mod completions;
mod dbc;
mod draw;
#[cfg(feature = "plugins")]
mod ecu;
mod explain;
mod export;
#[cfg(feature = "plugins")]
mod fmu;
mod inspect;
mod judge;
mod list;
mod man;
mod map;
mod merge;
mod new_estimator;
mod replay;
mod report;
mod run;
mod runs;
mod schema;
mod sensors;
mod stress;
mod study;
mod test;
mod tune;

use crate::command::CommandEntry;

/// The commands of monorig, in the order of the help.
pub(crate) const COMMANDS: &[CommandEntry] = &[
    CommandEntry::of::<run::RunArgs>(),
    CommandEntry::of::<test::TestArgs>(),
    CommandEntry::of::<compare::CompareArgs>(),
    CommandEntry::of::<study::StudyArgs>(),
    CommandEntry::of::<stress::StressArgs>(),
    CommandEntry::of::<merge::MergeArgs>(),
    CommandEntry::of::<tune::TuneArgs>(),
    CommandEntry::of::<report::ReportArgs>(),
    CommandEntry::of::<explain::ExplainArgs>(),
    CommandEntry::of::<draw::DrawArgs>(),
    CommandEntry::of::<map::MapArgs>(),
    CommandEntry::of::<sensors::SensorsArgs>(),
    CommandEntry::of::<runs::RunsArgs>(),
    CommandEntry::of::<list::ListArgs>(),
    CommandEntry::of::<replay::ReplayArgs>(),
    CommandEntry::of::<export::ExportArgs>(),
    CommandEntry::of::<dbc::DbcArgs>(),
    #[cfg(feature = "plugins")]
    CommandEntry::of::<ecu::EcuArgs>(),
    #[cfg(feature = "plugins")]
    CommandEntry::of::<fmu::FmuArgs>(),
    CommandEntry::of::<judge::JudgeArgs>(),
    CommandEntry::of::<calibrate::CalibrateArgs>(),
    CommandEntry::of::<inspect::InspectArgs>(),
    CommandEntry::of::<new_estimator::NewEstimatorArgs>(),
    CommandEntry::of::<check::CheckArgs>(),
    CommandEntry::of::<schema::SchemaArgs>(),
    CommandEntry::of::<completions::CompletionsArgs>(),
    CommandEntry::of::<man::ManArgs>(),
];
