//! `monorig dbc`: the messages of an external estimator, for the tools of a CAN bus.

use crate::arguments::Signals;
use crate::command::{Command, CommandOutcome, Program};
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::output;
use monorig_estimators::api::signals::MAX_DRIVES;
use monorig_wire::dbc;
use monorig_wire::message::Message;
use std::path::PathBuf;

/// Write the DBC of the CAN messages to and from an external estimator.
#[derive(Debug, clap::Parser)]
#[command(
    name = "dbc",
    after_help = "Examples:\n  monorig dbc --drives 8 --out crane.dbc\n  monorig dbc --signals float --out lossless.dbc\n\n\
    Samples, commands and step go to the estimator; its answer is estimate_mass,\nestimate_grade, estimate_status (optional) and \
    estimate_motion, each with the\nnumber of the step. `monorig log export --to can` writes logs of the same messages."
)]
pub struct DbcArgs {
    /// Drive units of the vehicle
    #[arg(long, value_name = "N", default_value_t = MAX_DRIVES as u64, value_parser = clap::value_parser!(u64).range(1..=MAX_DRIVES as u64))]
    drives: u64,
    #[command(flatten)]
    signals: Signals,
    /// File to write; without this option the DBC is printed
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Command for DbcArgs {
    fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let mut text = String::new();
        // a text takes everything
        let _ = dbc::write(
            &mut text,
            self.signals.numbers(),
            Message::all(self.drives as usize),
        );
        match &self.out {
            Some(out) => {
                output::write(out, &text)?;
                note(&format!("the messages are in {}", out.display()));
            }
            None => output::print(&text)?,
        }
        Ok(CommandOutcome::Held)
    }
}
