//! Puts memory.x where the linker finds it, and makes constants of the vehicle: the file of nominal values that
//! MONORIG_VEHICLE names, as `monorig log export` writes it; without it that of `vehicle.yaml`.
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

fn main() {
    println!("cargo::rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo::rerun-if-changed=memory.x");
    for name in ["MONORIG_VEHICLE", "MONORIG_ESTIMATOR", "MONORIG_SIGNALS"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    let file = std::env::var("MONORIG_VEHICLE").unwrap_or("vehicle.yaml".into());
    println!("cargo::rerun-if-changed={file}");
    let text = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{file}: {e}"));
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("nominal_vehicle: "));
    let line = line.unwrap_or_else(|| panic!("{file}: there is no line with the nominal vehicle"));
    let values: Value = serde_json::from_str(line).unwrap_or_else(|e| panic!("{file}: {e}"));
    let mut code = String::from("VehicleData {\n");
    for (key, value) in values.as_object().into_iter().flatten() {
        let value = match (key.as_str(), value) {
            ("drives", value) => value.to_string(),
            ("layout", numbers) => {
                let next = format!(
                    "{{ let mut all = {}.into_iter(); move || all.next() }}",
                    float(numbers)
                );
                format!("MassLayout::from_numbers({next})")
            }
            ("mass_guess_kg" | "accel_bias_sd_mps2" | "gyro_bias_sd_radps", number) => {
                format!("Some({})", float(number))
            }
            (_, value) => float(value),
        };
        let _ = writeln!(code, "    {key}: {value},");
    }
    code += "    ..VehicleData::default()\n}\n";
    let out = std::env::var("OUT_DIR").unwrap_or_default();
    std::fs::write(Path::new(&out).join("vehicle.rs"), code).unwrap_or_else(|e| panic!("{e}"));
}

/// A number, or a list of numbers, as constants of f64.
fn float(value: &Value) -> String {
    match value {
        Value::Array(all) => format!("[{}]", all.iter().map(float).collect::<Vec<_>>().join(", ")),
        Value::Number(number) => format!("{:?}_f64", number.as_f64().unwrap_or(f64::NAN)),
        other => panic!("{other} is no number"),
    }
}
