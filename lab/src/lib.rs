//! monorig-lab: what is done with runs.

pub mod compare;
pub mod expected;
pub mod interval;
pub mod metrics;
pub mod replay;
pub mod report;
pub mod series;
pub mod study;
pub mod summary;
pub mod tune;
pub mod verdict;
