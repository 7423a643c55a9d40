//! Names the shared library after the number of its header, so that a program finds the one it was linked with.

fn main() {
    println!("cargo::rerun-if-changed=include/monorig_estimator.h");
    let header = include_str!("include/monorig_estimator.h");
    let number = header
        .split("MONORIG_ABI ")
        .nth(1)
        .and_then(|s| s.split('u').next());
    let name = format!("libmonorig_c.so.{}", number.unwrap_or_default());
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,{name}");
    }
}
