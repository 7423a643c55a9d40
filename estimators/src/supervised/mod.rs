//! Published methods under supervision: one form a source.

pub mod curvature_rls;
pub mod differenced_rls;
pub mod force_balance_ekf;
pub mod force_balance_rls;
#[cfg(feature = "guo2024")]
pub mod guo_2024;
#[cfg(feature = "huainan")]
pub mod huainan;
pub mod imm;
pub mod inertial;
#[cfg(feature = "liu2023")]
pub mod liu_2023;
pub mod multi_model_rls;
#[cfg(feature = "patent")]
pub mod patent;
#[cfg(feature = "resistance")]
pub mod resistance;
pub mod supervision;
pub mod two_stage;
