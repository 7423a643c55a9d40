//! `monorig ecu`: an estimator behind CAN frames, as a controller would run it.

use crate::arguments::{Signals, assignment, value_of};
use crate::command::{Command, CommandOutcome, Program};
use crate::files::share;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_plugin::external::{serve_can, serve_lines, serve_udp};
use monorig_sim::config::scenario::Settings;
use std::io::{BufReader, stdin, stdout};
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;

const ECU_EXAMPLES: &str = "\
Examples:
  monorig ecu rail_fusion --scenario scenarios/minimal.yaml --udp 127.0.0.1:47800
      beside it: monorig run scenarios/minimal.yaml \\
        --set 'estimators.ecu={external: {udp: \"127.0.0.1:47800\"}}'
  monorig ecu rail_fusion --scenario scenarios/minimal.yaml < frames.log
      lines of candump in, the answers out";

/// Run an estimator as an external estimator: it reads CAN frames and answers with CAN frames.
#[derive(Debug, clap::Parser)]
#[command(name = "ecu", after_help = ECU_EXAMPLES)]
pub struct EcuArgs {
    /// Name of the estimator (`monorig list estimators`)
    name: String,
    /// Scenario with the estimator's vehicle
    #[arg(long, value_name = "SCENARIO", value_parser = share::named())]
    scenario: PathBuf,
    /// Set a parameter to another value than its default; may be given several times
    #[arg(long = "set", value_name = "PARAMETER=VALUE", value_parser = assignment)]
    sets: Vec<(String, String)>,
    #[command(flatten)]
    signals: Signals,
    /// Listen at this address for datagrams of cannelloni, until Ctrl-C; without this option and `--can`, standard
    /// input has lines of candump
    #[arg(long, value_name = "HOST:PORT")]
    udp: Option<SocketAddr>,
    /// Listen on this interface of SocketCAN, until Ctrl-C; for programs built with the feature `socketcan`
    #[arg(long, value_name = "INTERFACE", conflicts_with = "udp")]
    can: Option<String>,
}

impl Command for EcuArgs {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let mut settings = Settings::of_type(&self.name);
        for (key, value) in &self.sets {
            settings = settings.set(key, value_of(value));
        }
        let build = || monorig_fmu::built(&self.name, &settings, program.registry, &self.scenario);
        let numbers = self.signals.numbers();
        let broken =
            |e: std::io::Error| CliError::refused(e.to_string(), "check the bus or the address");
        match (self.udp, &self.can) {
            (Some(address), _) => {
                let socket = UdpSocket::bind(address).map_err(|e| {
                    let help = "use an address of this machine with a free port";
                    CliError::refused(format!("{address}: {e}"), help)
                })?;
                note(&format!("{} listens at {address}", self.name));
                let mut first = Some(build()?);
                let next = || {
                    first
                        .take()
                        .map_or_else(build, Ok)
                        .map_err(std::io::Error::other)
                };
                serve_udp(next, numbers, &socket).map_err(broken)?;
            }
            (None, Some(interface)) => {
                serve_can(build()?, numbers, interface)
                    .map_err(|refusal| CliError::refused(refusal.message, refusal.help))?;
            }
            (None, None) => {
                let from = BufReader::with_capacity(1 << 16, stdin());
                serve_lines(build()?, numbers, from, stdout().lock()).map_err(broken)?;
            }
        }
        Ok(CommandOutcome::Held)
    }
}
