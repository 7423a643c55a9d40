//! The examples run to their end, and what they assert holds.

#[path = "../../examples/own_controller.rs"]
mod own_controller;
#[path = "../../examples/own_estimator.rs"]
mod own_estimator;

#[test]
fn own_estimator_beside_ours() {
    own_estimator::main().expect("it runs");
}

#[test]
fn own_controller_drives_the_train() {
    own_controller::main().expect("it runs");
}
