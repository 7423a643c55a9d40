//! Commands of a program of one's own.

use monorig_cli::monorig_sim::Registry;
use monorig_cli::{App, CliError, Command, CommandOutcome, Program, clap};
use std::ffi::OsString;
use std::process::ExitCode;

/// Fail on demand.
#[derive(clap::Parser)]
#[command(name = "own")]
struct Own {
    /// Exit code
    #[arg(long)]
    code: u8,
}

impl Command for Own {
    fn run(&self, program: &Program<'_>) -> Result<CommandOutcome, CliError> {
        let names = program.command_line.get_subcommands();
        assert!(names.map(clap::Command::get_name).any(|n| n == "own"));
        match self.code {
            0 => Ok(CommandOutcome::Held),
            1 => Ok(CommandOutcome::Failed),
            _ => Err(CliError::refused("no such code", "0 or 1")),
        }
    }
}

fn code(app: App, words: &str) -> ExitCode {
    app.main_with(words.split(' ').map(OsString::from))
}

#[test]
fn a_command_of_ones_own_runs_beside_ours() {
    for n in 0..=2 {
        let app = App::new().command::<Own>();
        let words = format!("monorig own --code {n}");
        assert_eq!(code(app, &words), ExitCode::from(n));
    }
    let app = App::new().command::<Own>();
    assert_eq!(code(app, "monorig own --cod 1"), ExitCode::from(2));
}

#[test]
fn a_name_that_is_taken_is_refused() {
    /// Nothing.
    #[derive(clap::Parser)]
    #[command(name = "run")]
    struct Again;
    impl Command for Again {
        fn run(&self, _: &Program<'_>) -> Result<CommandOutcome, CliError> {
            Ok(CommandOutcome::Held)
        }
    }
    let app = App::with_registry(Registry::default()).command::<Again>();
    assert_eq!(code(app, "monorig run"), ExitCode::from(2));
}
