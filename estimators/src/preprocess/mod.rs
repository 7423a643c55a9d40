//! From samples to signals: checks, freshness, one speed out of many wheels, matched filters.

pub mod front_end;
pub mod input_check;
pub mod resampler;
pub mod sample_hold;
pub mod stuck_detector;
pub mod wheel_speed_vote;
