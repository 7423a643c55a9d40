//! Names the shared library after the number of its header, so that a program finds the one it was linked with.

fn main() {
    const HEADER: &str = "include/monorig_estimator.h";
    println!("cargo::rerun-if-changed={HEADER}");
    let header = std::fs::read_to_string(HEADER).unwrap_or_default();
    let number = header
        .split("MONORIG_ABI ")
        .nth(1)
        .and_then(|s| s.split('u').next());
    let number = number.expect("the header has `#define MONORIG_ABI 1u`");
    let name = match std::env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("linux") => format!("-Wl,-soname,libmonorig_c.so.{number}"),
        Ok("macos") => format!("-Wl,-install_name,@rpath/libmonorig_c.{number}.dylib"),
        _ => return,
    };
    println!("cargo::rustc-cdylib-link-arg={name}");
}
