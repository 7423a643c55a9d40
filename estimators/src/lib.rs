//! monorig-estimators: what would be flashed on the vehicle.
//!
//! `no_std`, no allocation, no panic, no NaN: every algorithm estimates the load mass of a monorail crane and the slope
//! under it from motor torque, wheel speed and an IMU.
//!
//! Notation used in filter code: `x` state, `P` covariance, `F` transition Jacobian, `H` measurement Jacobian,
//! `Q` process noise, `R` measurement noise, `y` innovation, `S` innovation covariance, `K` gain,
//! `lambda` forgetting factor, `theta` grade angle (+ uphill in the direction of growing chainage).
#![no_std]

pub mod signals;

/// The scalar of every estimator.
pub type Real = f64;
