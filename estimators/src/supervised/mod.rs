//! A published method under supervision: `dffrls_aekf_robust`, the example of how to make one.

pub(crate) mod force_balance_ekf;
pub(crate) mod force_balance_rls;
#[cfg(feature = "liu2023")]
pub mod liu_2023;
pub(crate) mod pipeline;
pub(crate) mod sample;
pub(crate) mod two_stage;
