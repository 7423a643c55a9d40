//! The program of this package runs its scenario over all seeds, and what the scenario expects holds.

use std::process::Command;

#[test]
fn what_the_scenario_expects_holds() {
    let tested = Command::new(env!("CARGO_BIN_EXE_own_estimator"))
        .args(["test", "climb.yaml"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .status();
    assert!(tested.expect("the program runs").success());
}
