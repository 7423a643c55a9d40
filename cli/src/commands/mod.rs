//! The commands, a file each, with its arguments, its help and its work. A new command needs a file, its `mod` and its
//! line in the list.

mod check;
mod compare;
mod completions;
mod dbc;
#[cfg(feature = "plugins")]
mod ecu;
mod explain;
#[cfg(feature = "plugins")]
mod fmu;
mod list;
mod log;
mod man;
mod merge;
mod new;
mod replay;
mod report;
mod run;
mod stress;
mod study;
mod test;
mod tune;

use crate::command::CommandEntry;
use std::ffi::OsString;

/// Commands of monorig, in the order of the help; rarely needed commands are hidden in its list.
pub(crate) const COMMANDS: &[CommandEntry] = &[
    CommandEntry::of::<run::RunArgs>(),
    CommandEntry::of::<test::TestArgs>(),
    CommandEntry::of::<study::StudyArgs>(),
    CommandEntry::of::<stress::StressArgs>(),
    CommandEntry::of::<tune::TuneArgs>(),
    CommandEntry::of::<compare::CompareArgs>(),
    CommandEntry::of::<explain::ExplainArgs>(),
    CommandEntry::of::<report::ReportArgs>(),
    CommandEntry::of::<replay::ReplayArgs>(),
    CommandEntry::of::<log::LogArgs>(),
    CommandEntry::of::<new::NewArgs>(),
    CommandEntry::of::<list::ListArgs>(),
    CommandEntry::of::<check::CheckArgs>(),
    #[cfg(feature = "plugins")]
    CommandEntry::of::<fmu::FmuArgs>(),
    CommandEntry::of::<merge::MergeArgs>().unlisted(),
    #[cfg(feature = "plugins")]
    CommandEntry::of::<ecu::EcuArgs>().unlisted(),
    CommandEntry::of::<dbc::DbcArgs>().unlisted(),
    CommandEntry::of::<completions::CompletionsArgs>().unlisted(),
];

/// Names of commands before version 0.1, each with the words that replace it now.
const OLD_NAMES: [(&str, &[&str]); 11] = [
    ("calibrate", &["log", "calibrate"]),
    ("draw", &["new", "courses"]),
    ("export", &["log", "export"]),
    ("inspect", &["log", "info"]),
    ("judge", &["replay"]),
    ("man", &["completions", "--man"]),
    ("map", &["log", "track"]),
    ("new-estimator", &["new", "estimator"]),
    ("runs", &["list", "runs"]),
    ("schema", &["check", "--schema"]),
    ("sensors", &["log", "imu"]),
];

/// Words of a command line, with an old name of the command replaced. `commands`: present names, which are found before
/// old names.
pub(crate) fn of_today(mut words: Vec<OsString>, commands: &[&str]) -> Vec<OsString> {
    let is_new = |word: &OsString| commands.iter().any(|c| word == c);
    let old = |word: &OsString| OLD_NAMES.iter().find(|(name, _)| word == name);
    let mut all = words.iter().enumerate().skip(1);
    let first = all.find(|(_, word)| is_new(word) || old(word).is_some());
    let first = first.filter(|(_, word)| !is_new(word));
    if let Some((at, (name, new))) = first.and_then(|(at, word)| Some((at, old(word)?))) {
        // `sensors` had one task
        let fit = *name == "sensors" && words.get(at + 1).is_some_and(|w| w == "fit");
        words.splice(at..=at + usize::from(fit), new.iter().map(OsString::from));
    }
    words
}
