//! Published methods with their errata corrected: one file a source, in which the equations can be counted, and the
//! baselines.

#[cfg(feature = "baseline")]
pub mod complementary_filter;
#[cfg(feature = "baseline")]
pub mod ekf_v_theta_biases;
#[cfg(feature = "guo2024")]
pub mod guo_2024;
#[cfg(feature = "huainan")]
pub mod huainan;
#[cfg(feature = "liu2023")]
pub mod joint_ekf;
#[cfg(feature = "liu2023")]
pub mod liu_2023;
#[cfg(feature = "resistance")]
pub mod liu_2023_resistance;
pub(crate) mod method;
#[cfg(feature = "patent")]
pub mod patent;
pub(crate) mod published;
pub(crate) mod signal_source;
