//! The macro that declares the named estimators of one source.

/// Declares the named estimators of one source as a table: name and pipeline type, groups of parameters, construction
/// from vehicle and parameters. Each becomes a module with `Params`, the pipeline and `new`.
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

                /// Builds the estimator from the vehicle's nominal values and the parameters.
                pub fn new(vehicle: &Vehicle, params: &Params) -> $pipeline {
                    let build: fn(&Vehicle, &Params) -> $pipeline = $build;
                    build(vehicle, params)
                }
            }
        )*
    };
}

/// Declares the published methods of one source, as `variants!` declares estimators. The construction gives the corner
/// and the sampling rate of the signals, Hz, and the method; what becomes of it is a
/// [`Published`](crate::methods::published::Published).
#[allow(unused_macros)]
macro_rules! methods {
    ($(
        $(#[$about:meta])*
        $name:ident: $pipeline:ident = $method:ty, { $($field:ident: $group:ident),* }, $build:expr;
    )*) => {
        variants! {$(
            $(#[$about])*
            $name: $pipeline = $crate::methods::published::Published<$method>, { $($field: $group),* }, |vehicle, params| {
                let build: fn(&Vehicle, &Params) -> ([Real; 2], $method) = $build;
                let (rates_hz, method) = build(vehicle, params);
                $crate::methods::published::Published::new(vehicle, rates_hz, method)
            };
        )*}
    };
}
