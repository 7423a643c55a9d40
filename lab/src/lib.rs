//! monorig-lab: what is done with runs.

pub mod expected;
pub mod metrics;
pub mod report;
pub mod series;
pub mod summary;
