//! The command line of monorig: read the arguments, build, run, report.
//!
//! The program `monorig` is [`App`] with what monorig has of its own. A program of one's own adds its estimators and controllers; every
//! command then takes them from a scenario as it takes ours:
//!
//! ```no_run
//! use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements, Vehicle};
//!
//! monorig_estimators::params! {
//!     /// Parameters of my estimator.
//!     MyParams { mass_kg ["kg"] = 15e3, 1.0 => 1e6, "The mass it always reports."; }
//! }
//! struct MyEstimator { mass_kg: f64 }
//! impl Estimator for MyEstimator {
//!     fn step(&mut self, z: &Measurements, _: &Command, _: f64) -> Result<Estimate, Error> {
//!         let mut estimate = Estimate::at(z.t);
//!         estimate.total_mass_kg.value = self.mass_kg;
//!         Ok(estimate)
//!     }
//!     fn reset(&mut self) {}
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     monorig_cli::App::new()
//!         .estimator("mine", |_: &Vehicle, p: &MyParams| MyEstimator { mass_kg: p.mass_kg })
//!         .main()
//! }
//! ```

pub use monorig_estimators;
pub use monorig_sim;

mod commands;
mod files;
mod identity;
mod pace;
mod simulate;
mod ui;
mod variant;
mod viewer;

use clap::{CommandFactory, FromArgMatches};
use commands::Arguments;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::Parameters;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::closed_loop::registry::{Registry, RegistryError};
use monorig_sim::control::{Controller, ControllerSetup};
use std::process::ExitCode;
use ui::errors::{self, CliError};
use ui::note;

/// How a task that could be done has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CommandOutcome {
    /// Everything held.
    Held,
    /// An expectation failed.
    Failed,
}

/// The program: monorig's commands over a registry of estimators and controllers.
#[derive(Debug, Default)]
pub struct App {
    registry: Registry,
    wrong: Option<RegistryError>,
}

impl App {
    /// With the estimators and controllers that monorig has of its own.
    pub fn new() -> Self {
        Self::default()
    }

    /// With the estimators and controllers of this registry and no others.
    pub fn with_registry(registry: Registry) -> Self {
        Self {
            registry,
            wrong: None,
        }
    }

    /// Add a type of estimator with the parameters `P`. A name that is taken, or that cannot be part of a channel's path, is an error of
    /// [`App::main`].
    pub fn estimator<P, E>(
        mut self,
        name: &str,
        build: impl Fn(&Vehicle, &P) -> E + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        E: Estimator + Send + 'static,
    {
        let added = self.registry.estimator(name, build).err();
        self.wrong = self.wrong.or(added);
        self
    }

    /// Add a type of controller with the parameters `P`, as [`App::estimator`] does.
    pub fn controller<P, C>(
        mut self,
        name: &str,
        build: impl Fn(&Vehicle, &ControllerSetup, &P) -> C + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        C: Controller + Send + 'static,
    {
        let added = self.registry.controller(name, build).err();
        self.wrong = self.wrong.or(added);
        self
    }

    /// Read the command line, do what it says, and return the exit code.
    pub fn main(self) -> ExitCode {
        if let Some(wrong) = self.wrong {
            errors::show(&CliError::Registry(wrong));
            return ExitCode::from(2);
        }
        let command =
            commands::with_names(Arguments::command(), &self.registry).version(commands::version());
        let parsed = command
            .try_get_matches()
            .and_then(|matches| Arguments::from_arg_matches(&matches));
        let arguments = match parsed {
            Ok(arguments) => arguments,
            Err(e) => return errors::usage(&e),
        };
        ui::terminal::set(arguments.terminal);
        let done = arguments.command.run(&self.registry);
        let refused = monorig_lab::batch::refused_threads();
        if refused > 0 {
            note::note(&format!(
                "the system did not make {refused} of the threads asked for (`ulimit -u`, memory): slower, with the same results"
            ));
        }
        match done {
            Ok(CommandOutcome::Held) => ExitCode::SUCCESS,
            Ok(CommandOutcome::Failed) => ExitCode::from(1),
            Err(CliError::ReaderGone) => ExitCode::SUCCESS,
            Err(e) => {
                errors::show(&e);
                ExitCode::from(2)
            }
        }
    }
}
