//! Our own estimators: an attitude filter, a memory of the rail and a force balance in which the load swings.

pub(crate) mod attitude;
#[cfg(feature = "rail_fusion")]
pub mod attitude_alone;
pub(crate) mod effective;
#[cfg(feature = "rail_fusion")]
pub mod rail_fusion;
pub(crate) mod swing_balance;
pub(crate) mod train_core;
pub(crate) mod train_source;
