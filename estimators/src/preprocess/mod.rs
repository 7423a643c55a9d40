//! From samples to signals: freshness, stuck sensors, resampling.

pub mod resampler;
pub mod sample_hold;
pub mod stuck_detector;
