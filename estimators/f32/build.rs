//! The same source as `monorig-estimators`, with single precision for a scalar.
fn main() {
    println!("cargo::rustc-check-cfg=cfg(single_precision)");
    println!("cargo::rustc-cfg=single_precision");
}
