//! `monorig` with an estimator of one's own: every command takes `mine` from scenarios and studies as it takes those of
//! monorig.

mod complementary;

use complementary::{Complementary, ComplementaryParams};
use std::process::ExitCode;

fn main() -> ExitCode {
    monorig_cli::App::new()
        .estimator("mine", |vehicle, params: &ComplementaryParams| {
            Complementary::new(vehicle, params)
        })
        .main()
}
