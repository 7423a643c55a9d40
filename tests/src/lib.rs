//! Shared by the tests of the whole simulator: [`monorig_sim::testing`].

pub use monorig_sim::testing::{
    Cruise, G, asset, asset_track, car, imu, options, road, run, scenario, slope, torque, track,
    train, world,
};
