//! The macro that declares the named estimators of one source.

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
