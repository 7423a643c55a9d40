//! From samples to signals: checks, freshness, one speed out of many wheels, matched filters.

pub mod arrivals;
pub mod conditioning;
pub mod drive_hold;
pub mod front_end;
pub mod gyro_calibration;
pub mod input_check;
pub mod noise_learning;
pub mod resampler;
pub mod sample_hold;
pub mod wheel_speed_vote;
