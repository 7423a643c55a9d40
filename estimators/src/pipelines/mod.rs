//! Whole estimators, put together from stages: one file for each source, in which its variants are a table.

/// Declares the named estimators of one source as a table: name and pipeline type, groups of parameters, construction from vehicle and
/// parameters. Each becomes a module with `Params`, the pipeline and `new`.
#[allow(unused_macros)]
macro_rules! variants {
    ($(
        $(#[$about:meta])*
        $name:ident: $pipeline:ident = $type:ty, { $($field:ident: $group:ident),* }, $build:expr;
    )*) => {
        $(
            $(#[$about])*
            pub mod $name {
                use super::*;
                use crate::api::params::param_groups;
                use crate::api::signals::Vehicle;

                param_groups! {
                    /// Its parameters.
                    Params { $($field: $group),* }
                }

                /// The pipeline.
                pub type $pipeline = $type;

                /// From the vehicle's nominal values and the parameters.
                pub fn new(vehicle: &Vehicle, params: &Params) -> $pipeline {
                    let build: fn(&Vehicle, &Params) -> $pipeline = $build;
                    build(vehicle, params)
                }
            }
        )*
    };
}

#[cfg(feature = "rail_fusion")]
pub mod attitude;
#[cfg(feature = "baseline")]
pub mod complementary_filter;
#[cfg(feature = "baseline")]
pub mod ekf_v_theta_biases;
#[cfg(feature = "liu2023")]
pub mod ffrls_robust;
#[cfg(feature = "guo2024")]
pub mod guo_2024;
#[cfg(feature = "guo2024")]
pub mod guo_2024_robust;
#[cfg(feature = "huainan")]
pub mod huainan;
#[cfg(feature = "huainan")]
pub mod huainan_robust;
#[cfg(feature = "liu2023")]
pub mod joint_ekf;
#[cfg(feature = "liu2023")]
pub mod joint_ekf_robust;
#[cfg(feature = "liu2023")]
pub mod liu_2023;
#[cfg(feature = "resistance")]
pub mod liu_2023_resistance;
#[cfg(feature = "liu2023")]
pub mod liu_2023_robust;
#[cfg(any(
    feature = "baseline",
    feature = "liu2023",
    feature = "huainan",
    feature = "guo2024",
    feature = "patent",
    feature = "resistance",
    feature = "rail_fusion"
))]
pub mod method;
#[cfg(feature = "patent")]
pub mod patent;
#[cfg(feature = "patent")]
pub mod patent_robust;
#[cfg(feature = "rail_fusion")]
pub mod rail_fusion;
#[cfg(feature = "bench")]
pub mod regression;
#[cfg(feature = "resistance")]
pub mod resistance_robust;
pub mod runner;
pub mod two_stage;
