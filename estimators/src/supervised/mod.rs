//! Published methods under supervision: one form a source.

pub(crate) mod curvature_rls;
pub(crate) mod differenced_rls;
pub(crate) mod force_balance_ekf;
pub(crate) mod force_balance_rls;
#[cfg(feature = "guo2024")]
pub mod guo_2024;
#[cfg(feature = "huainan")]
pub mod huainan;
pub(crate) mod imm;
pub(crate) mod inertial;
#[cfg(feature = "liu2023")]
pub mod liu_2023;
pub(crate) mod multi_model_rls;
#[cfg(feature = "patent")]
pub mod patent;
pub(crate) mod pipeline;
#[cfg(feature = "resistance")]
pub mod resistance;
pub(crate) mod sample;
pub(crate) mod two_stage;
