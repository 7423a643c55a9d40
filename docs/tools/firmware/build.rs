//! Puts memory.x where the linker finds it, and writes the estimator that MONORIG_PIPELINE names: the path of a
//! pipeline, `by name`, or none for a program without an estimator.
use std::path::Path;

fn main() {
    println!("cargo::rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-env-changed=MONORIG_PIPELINE");
    println!("cargo::rustc-check-cfg=cfg(estimator)");
    let Ok(pipeline) = std::env::var("MONORIG_PIPELINE") else {
        return;
    };
    println!("cargo::rustc-cfg=estimator");
    let built = match pipeline.as_str() {
        "by name" => "estimators::registry::build(\"dffrls_aekf_robust\", &vehicle, []).ok()".into(),
        path => format!(
            "Some(estimators::Runner::new(\"\", estimators::{path}::new, &vehicle, &estimators::{path}::Params::default()))"
        ),
    };
    let code = format!("fn estimator(vehicle: Vehicle) -> Option<impl Estimator> {{\n    {built}\n}}\n");
    let out = std::env::var("OUT_DIR").unwrap_or_default();
    std::fs::write(Path::new(&out).join("estimator.rs"), code).unwrap_or_else(|e| panic!("{e}"));
}
