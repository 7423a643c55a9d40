//! Compiles the logger of FMI 2.0.

fn main() {
    println!("cargo:rerun-if-changed=src/fmu/log.c");
    cc::Build::new()
        .file("src/fmu/log.c")
        .compile("monorig_fmi2_log");
}
