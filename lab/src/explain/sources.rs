//! The sources of error, and the changes to a scenario that switch them off.

use super::excitation;
use monorig_sim::config::scenario::{PlantKind, Scenario};
use monorig_sim::config::sensor_sheet::Sheet;
use monorig_sim::error::Error;

/// A source of error.
#[derive(Clone, Debug)]
pub struct Source {
    pub(crate) name: &'static str,
    /// Description of the source.
    pub(crate) what: String,
    /// Changes to the scenario that switch the source off, in the form of `--set`.
    pub changes: Vec<(String, String)>,
}

/// A key of an instrument, and its value without the error.
type Off = (&'static str, &'static str);

const NOISE: &[Off] = &[
    ("errors.noise_sd", "0"),
    ("errors.noise_sd_rel", "0"),
    ("errors.noise_density", "0"),
    ("errors.random_walk_of_integral", "0"),
    ("errors.quantisation", "null"),
    ("errors.vibration", "null"),
    ("errors.hits", "null"),
];
const BIAS: &[Off] = &[
    ("errors.bias", "0"),
    ("errors.bias_sd", "0"),
    ("errors.switch_on_bias", "null"),
    ("errors.bias_random_walk", "0"),
    ("errors.gauss_markov", "null"),
    ("errors.warm_up", "null"),
];
/// Instruments with three axes.
const MOUNTING: &[Off] = &[
    ("axis_bias", "null"),
    ("misalignment_deg", "null"),
    ("misalignment_sd_deg", "null"),
    ("lean", "null"),
];
const SCALE: &[Off] = &[
    ("errors.scale_error", "0"),
    ("errors.scale_error_sd", "0"),
    ("errors.linearity", "0"),
];
const DELIVERY: &[Off] = &[
    ("errors.bandwidth_hz", "null"),
    ("sampling.latency_ms", "0"),
    ("sampling.jitter_ms", "0"),
    ("sampling.dropout", "0"),
    ("sampling.arrival_jitter", "null"),
    ("sampling.bunching_ms", "0"),
    ("sampling.reordering", "null"),
    ("sampling.clock", "{}"),
];
const THREE_AXES: [&str; 2] = ["accelerometer", "gyro"];

/// Names of the sources that combine others.
pub(super) const ALL: &str = "all of these";
pub(super) const EXCITATION: &str = "excitation";

/// The sources of a scenario. One that cannot be switched off in it is not among them.
pub fn sources(scenario: &Scenario) -> Result<Vec<Source>, Error> {
    let sheet = Sheet::load_with(&scenario.sensors, &scenario.sets("sensors"))?;
    let fitted: Vec<&str> = sheet.specs().keys().copied().collect();
    let of = |keys: &[Off], instruments: &[&str]| -> Vec<(String, String)> {
        let each = instruments.iter().flat_map(|i| {
            let keys = keys.iter();
            keys.map(move |(key, off)| (format!("sensors.{i}.{key}"), (*off).to_owned()))
        });
        each.collect()
    };
    let inertial: Vec<&str> = fitted
        .iter()
        .copied()
        .filter(|i| THREE_AXES.contains(i))
        .collect();
    let source = |name, what: &str, changes| Source {
        name,
        what: what.to_owned(),
        changes,
    };
    let mut bias = of(BIAS, &fitted);
    bias.extend(of(MOUNTING, &inertial));
    let mut all = vec![
        source(
            "noise",
            "noise, quantisation, vibration and hits of the instruments",
            of(NOISE, &fitted),
        ),
        source(
            "bias",
            "biases of the instruments, drift, misalignment and lean of their mounts",
            bias,
        ),
        source(
            "scale",
            "errors of scale and linearity of the instruments",
            of(SCALE, &fitted),
        ),
        source(
            "delivery",
            "latency, jitter, loss, clocks and bandwidth of the instruments",
            of(DELIVERY, &fitted),
        ),
        model(scenario),
    ];
    let together = all.iter().flat_map(|s| s.changes.clone()).collect();
    all.push(source(
        ALL,
        "all of the above at once: the remaining error is the method's own",
        together,
    ));
    if let Some(speed) = excitation::excited(&scenario.file.drive) {
        let changes = vec![("drive.speed".to_owned(), speed)];
        all.push(source(EXCITATION, excitation::WHAT, changes));
    }
    Ok(all)
}

/// The vehicle's parameters as on its data sheet; a train as a point on the rail.
fn model(scenario: &Scenario) -> Source {
    let mut changes = vec![(
        "vehicle".to_owned(),
        "{exact: {all: nothing is drawn}}".to_owned(),
    )];
    let mut what = "the nominal values for estimators are the true values".to_owned();
    if scenario.file.plant() == PlantKind::Rapier {
        changes.push(("physics.plant".into(), "point-mass".into()));
        what += "; the train is a point on the rail: no sway, no slack, no length";
    }
    Source {
        name: "model",
        what,
        changes,
    }
}
