//! `monorig`.

use std::process::ExitCode;

fn main() -> ExitCode {
    monorig_cli::App::new().main()
}
