//! The command line of monorig: read the arguments, build, run, report.
//!
//! The program `monorig` is [`App`] with what monorig has of its own. A program of one's own adds its estimators and
//! controllers; every command then takes them from a scenario as it takes ours:
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
//!
//! A command of one's own is a struct with its arguments:
//!
//! ```no_run
//! use monorig_cli::{App, CliError, Command, CommandOutcome, Program, clap};
//!
//! /// Print the names of all estimators.
//! #[derive(clap::Parser)]
//! #[command(name = "names")]
//! struct Names {
//!     /// List only names with this text
//!     #[arg(long, default_value = "")]
//!     filter: String,
//! }
//! impl Command for Names {
//!     fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
//!         let names = program.registry.estimators().iter().map(|e| e.name());
//!         names.filter(|n| n.contains(&self.filter)).for_each(|n| println!("{n}"));
//!         Ok(CommandOutcome::Held)
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     App::new().command::<Names>().main()
//! }
//! ```

pub use clap;
pub use command::{Command, CommandOutcome, Program};
pub use monorig_estimators;
pub use monorig_sim;
pub use ui::errors::CliError;

mod arguments;
#[cfg(doctest)]
mod book;
mod command;
mod commands;
mod files;
mod identity;
mod recording;
mod ui;
mod verdicts;
mod viewer;

use clap::{ArgMatches, CommandFactory, FromArgMatches};
use command::CommandEntry;
use commands::COMMANDS;
use identity::version;
use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::params::Parameters;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::control::{Controller, ControllerSetup};
use monorig_sim::plant::{Plant, PlantSetup};
use monorig_sim::sensors::{Fitting, Instrument};
use std::ffi::OsString;
use std::fmt::Display;
use std::process::ExitCode;
use ui::terminal::TerminalArgs;
use ui::{errors, note, output};

const AFTER_HELP: &str = "\
More commands: merge, ecu, dbc, completions. Options: monorig COMMAND -h;
every command has -q (quiet), -v (verbose), --color WHEN; -V is the version.
Exit codes: 0 all held, 1 an expectation failed, 2 could not run (bad input).";
/// The program's own help: one screen.
const TEMPLATE: &str = "{about}\n\n{usage-heading} {usage}\n\n{subcommands}{after-help}";

/// A physics-simulated test rig for mass and slope estimators of monorail cranes
#[derive(Debug, clap::Parser)]
#[command(name = "monorig", version, after_help = AFTER_HELP, help_template = TEMPLATE, max_term_width = 100)]
#[command(subcommand_required = true, arg_required_else_help = true)]
struct Arguments {
    #[command(flatten)]
    terminal: TerminalArgs,
    /// Run estimators of libraries inside this program: faster, but a crash in a library ends the program
    #[arg(long, global = true, hide = true)]
    in_process: bool,
}

/// The program: commands over a registry of estimators, controllers, instruments and plants.
#[derive(Debug)]
pub struct App {
    registry: Registry,
    commands: Vec<CommandEntry>,
    /// First mistake in the added parts.
    wrong: Option<String>,
}

impl Default for App {
    fn default() -> Self {
        Self::with_registry(Registry::default())
    }
}

impl App {
    /// Makes a program with the parts of monorig.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes a program with only the parts of this registry.
    pub fn with_registry(registry: Registry) -> Self {
        Self {
            registry,
            commands: COMMANDS.to_vec(),
            wrong: None,
        }
    }

    /// Adds a type of estimator with the parameters `P`. A name that exists already, or that cannot be part of a
    /// channel's path, is an error of [`App::main`].
    pub fn estimator<P, E>(
        mut self,
        name: &str,
        build: impl Fn(&Vehicle, &P) -> E + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        E: Estimator + Send + 'static,
    {
        let mistake = self.registry.estimator(name, build).err();
        self.keep_first(mistake.map(|e| e.to_string()));
        self
    }

    /// Adds a type of estimator that may refuse a vehicle or its parameters, with a reason in words, as
    /// [`App::estimator`] does.
    pub fn try_estimator<P, E, R>(
        mut self,
        name: &str,
        build: impl Fn(&Vehicle, &P) -> Result<E, R> + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        E: Estimator + Send + 'static,
        R: Display,
    {
        let mistake = self.registry.try_estimator(name, build).err();
        self.keep_first(mistake.map(|e| e.to_string()));
        self
    }

    /// Adds a type of controller with the parameters `P`, as [`App::estimator`] does.
    pub fn controller<P, C>(
        mut self,
        name: &str,
        build: impl Fn(&Vehicle, &ControllerSetup, &P) -> C + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        C: Controller + Send + 'static,
    {
        let mistake = self.registry.controller(name, build).err();
        self.keep_first(mistake.map(|e| e.to_string()));
        self
    }

    /// Adds a type of instrument with the parameters `P`, which a scenario names under `instruments`, as
    /// [`App::estimator`] does. [`Instrument::name`] of the built instrument is this name.
    pub fn instrument<P, I>(
        mut self,
        name: &str,
        build: impl Fn(&Fitting<'_>, &P) -> I + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        I: Instrument + 'static,
    {
        let mistake = self.registry.instrument(name, build).err();
        self.keep_first(mistake.map(|e| e.to_string()));
        self
    }

    /// Adds a type of plant with the parameters `P`, which a scenario names as `physics.plant`, as [`App::estimator`]
    /// does. It may refuse a vehicle or its parameters with a reason in words.
    pub fn plant<P, T, R>(
        mut self,
        name: &str,
        build: impl Fn(&PlantSetup<'_>, &P) -> Result<T, R> + Send + Sync + 'static,
    ) -> Self
    where
        P: Parameters + 'static,
        T: Plant + 'static,
        R: Display,
    {
        let mistake = self.registry.plant(name, build).err();
        self.keep_first(mistake.map(|e| e.to_string()));
        self
    }

    /// Adds a command. A name that exists already is an error of [`App::main`].
    pub fn command<C: Command>(mut self) -> Self {
        let name = C::command().get_name().to_owned();
        let mut there = self.commands.iter().map(|c| c.describe(&self.registry));
        let taken = name == "help" || there.any(|c| c.get_name() == name);
        self.keep_first(taken.then(|| format!("the command `{name}` exists already")));
        self.commands.push(CommandEntry::of::<C>());
        self
    }

    /// Keeps the result's error if it is the first mistake.
    fn keep_first(&mut self, mistake: Option<String>) {
        self.wrong = self.wrong.take().or(mistake);
    }

    /// Runs the command that the command line names, and returns the exit code.
    pub fn main(self) -> ExitCode {
        self.main_with(std::env::args_os())
    }

    /// Runs the command that these words name, as a test of a program of one's own does, and returns the exit code. The
    /// first word is the program's name.
    pub fn main_with(mut self, words: impl IntoIterator<Item = OsString>) -> ExitCode {
        let words: Vec<OsString> = words.into_iter().collect();
        #[cfg(all(unix, feature = "plugins"))]
        if words.get(1).is_some_and(|word| word == SERVE) {
            return monorig_plugin::serve();
        }
        if let Some(wrong) = self.wrong {
            errors::show(&CliError::Program(wrong));
            return ExitCode::from(2);
        }
        let command_line = self.command_line();
        let names = command_line.get_subcommands();
        let names: Vec<&str> = names.map(clap::Command::get_name).collect();
        let words = commands::of_today(words, &names);
        let helps = ui::help::for_words(command_line.clone(), &words);
        let parsed = helps.try_get_matches_from(words);
        let parsed = parsed.and_then(|m| Ok((Arguments::from_arg_matches(&m)?, m)));
        let (arguments, matches) = match parsed {
            Ok(parsed) => parsed,
            Err(e) => return errors::usage(&e),
        };
        ui::terminal::set(arguments.terminal);
        self.registry = with_libraries(self.registry, arguments.in_process);
        let program = Program {
            registry: &self.registry,
            command_line: &command_line,
        };
        let done = self.run(&matches, &program);
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
            Err(CliError::Usage(e)) => errors::usage(&e),
            Err(e) => {
                errors::show(&e);
                ExitCode::from(2)
            }
        }
    }

    /// The command line with every command.
    fn command_line(&self) -> clap::Command {
        let commands = self.commands.iter().map(|c| c.describe(&self.registry));
        Arguments::command()
            .version(version())
            .subcommands(commands)
    }

    /// Runs the command that the parsed words name.
    fn run(&self, matches: &ArgMatches, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let (name, of_command) = matches.subcommand().unwrap_or(("", matches));
        let names = program
            .command_line
            .get_subcommands()
            .map(clap::Command::get_name);
        let entry = names.zip(&self.commands).find(|(n, _)| *n == name);
        match entry {
            Some((_, entry)) => {
                let inner = std::iter::successors(Some(of_command), |m| Some(m.subcommand()?.1));
                inner.last().map_or(Ok(()), output::check)?;
                (entry.run)(of_command, program)
            }
            // clap has refused every other name
            None => Ok(CommandOutcome::Held),
        }
    }
}

/// Word with which the program starts itself to run a part.
#[cfg(all(unix, feature = "plugins"))]
const SERVE: &str = "serve-part";

/// Registry with estimators of libraries, which run in processes of this program or, by option, inside it.
fn with_libraries(registry: Registry, _in_process: bool) -> Registry {
    #[cfg(all(unix, feature = "plugins"))]
    if !_in_process && let Ok(program) = this_program() {
        return monorig_plugin::guards_libraries(registry, vec![program.into(), SERVE.into()]);
    }
    #[cfg(feature = "plugins")]
    let registry = monorig_plugin::loads_libraries(registry);
    registry
}

/// File of this program. On Linux it is the running file, even if another file has replaced it.
#[cfg(all(unix, feature = "plugins"))]
fn this_program() -> std::io::Result<std::path::PathBuf> {
    match cfg!(target_os = "linux") {
        true => Ok("/proc/self/exe".into()),
        false => std::env::current_exe(),
    }
}
