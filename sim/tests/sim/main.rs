//! The simulator from outside of the crate.

#![allow(clippy::unwrap_used)] // helpers of tests

mod attitude_rates;
mod examples;
mod force_balance;
mod free_motion;
mod load_change;
mod mujoco;
mod own_parts;
mod speeds;
mod swing;
