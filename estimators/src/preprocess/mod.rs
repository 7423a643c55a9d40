//! From samples to signals: checks, freshness, one speed out of many wheels, matched filters.

pub(crate) mod conditioning;
pub(crate) mod front_end;
pub(crate) mod input_check;
pub(crate) mod resampler;
pub(crate) mod sample_hold;
pub(crate) mod sorted;
pub mod wheel_speed_vote;
