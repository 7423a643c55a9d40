//! Checks of single instruments: one type each, over one axis or several.
//!
//! | piece | finds |
//! |---|---|
//! | [`Arrivals`](arrivals::Arrivals) | samples that are late, and a channel that is stale |
//! | [`StuckDetector`](stuck_detector::StuckDetector) | an instrument that repeats a sample |
//! | [`SpikeGate`](spike_gate::SpikeGate) | jumps that do not last |
//! | [`GyroRange`](gyro_range::GyroRange) | rates that no vehicle on wheels turns with |
//! | [`NoiseLearning`](noise_learning::NoiseLearning) | the noise of a channel |
//! | [`Gate`](gate::Gate) | innovations that are too large for a filter |

pub mod arrivals;
pub mod gate;
pub mod gyro_range;
pub mod noise_learning;
pub mod spike_gate;
pub mod stuck_detector;
