//! A sensor sheet with scaled noise and biases.

use monorig_sim::config::file::Document;
use monorig_sim::error::Error;
use serde_yaml::Value;
use std::path::Path;

const NOISES: [&str; 4] = [
    "noise_density",
    "noise_sd",
    "noise_sd_rel",
    "random_walk_of_integral",
];
const BIASES: [&str; 4] = [
    "bias_sd",
    "bias_random_walk",
    "scale_error_sd",
    "misalignment_sd_deg",
];

/// Text of the sheet in `path`, with these factors on its noise and its bias.
pub(crate) fn scaled(path: &Path, noise: f64, bias: f64) -> Result<String, Error> {
    let document = Document::read(path)?;
    let mut sheet: Value = document.parse()?;
    scale(&mut sheet, noise, bias);
    serde_yaml::to_string(&sheet).map_err(|e| document.error("", e.to_string(), "a sensor sheet"))
}

fn scale(value: &mut Value, noise: f64, bias: f64) {
    let Value::Mapping(entries) = value else {
        return;
    };
    for (key, value) in entries.iter_mut() {
        let key = key.as_str().unwrap_or_default();
        let factor = match key {
            _ if NOISES.contains(&key) => noise,
            _ if BIASES.contains(&key) => bias,
            _ => {
                scale(value, noise, bias);
                continue;
            }
        };
        multiply(value, factor);
    }
}

fn multiply(value: &mut Value, factor: f64) {
    match value {
        Value::Number(n) => {
            if let Some(x) = n.as_f64() {
                *value = Value::from(four_digits(x * factor));
            }
        }
        Value::Sequence(items) => items.iter_mut().for_each(|x| multiply(x, factor)),
        _ => {}
    }
}

/// A number with few digits.
pub(crate) fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
