//! Noise of a log's IMU by averaging time, at standstill, as `replay --noise from-log` and `calibrate` show it.

use crate::ui::errors::CliError;
use crate::ui::note::note;
use monorig_lab::recordings::{allan, noise_fit};
use monorig_logs::identify::{Instrument, Parameter, ParameterKind, StandingAxis, standing};
use monorig_logs::map::Map;

/// Random walk of the integral and bias instability of each axis (IEEE Std 952-1997, annex C, fitted to the overlapping
/// Allan deviation). A log in which the vehicle does not stand has none, and a note is shown.
pub fn figures(map: &Map) -> Result<Vec<Parameter>, CliError> {
    let axes = standing(map)?;
    if axes.is_empty() {
        note(
            "no Allan figures: the wheels in this log never stand for 12 s (10 s, and 1 s to settle at each end) while an IMU measures",
        );
    }
    Ok(axes.iter().flat_map(of_axis).collect())
}

fn of_axis(axis: &StandingAxis) -> Vec<Parameter> {
    let pieces: Vec<&[f64]> = axis.pieces.iter().map(Vec::as_slice).collect();
    let samples: usize = pieces.iter().map(|p| p.len()).sum();
    let points = allan::overlapping(&pieces, axis.period_s);
    let Some(fit) = noise_fit::fit(&points) else {
        return Vec::new();
    };
    // relative, of so many independent averages: 1/√(2n) of one averaging time, and up to 1/√n of a fit to several that
    // share samples
    let relative = |averages: f64| 1.0 / averages.sqrt();
    let (name, walk, unit, walk_unit) = match axis.instrument {
        Instrument::SpecificForce => ("specific force", "velocity", "m/s2", "m/s/√s"),
        Instrument::AngularRate => ("angular rate", "angle", "rad/s", "rad/√s"),
    };
    let of = format!("of the {name} {}", axis.axis);
    let mut found = vec![Parameter {
        name: format!("{walk} random walk {of}"),
        value: fit.white,
        sd: fit.white * relative(samples as f64),
        unit: walk_unit,
        meaning: "random_walk_of_integral of a sensor sheet; times √2 the noise density",
        kind: ParameterKind::Figure,
    }];
    if let (Some(instability), Some(at_s)) = (fit.instability, fit.instability_s) {
        found.push(Parameter {
            name: format!("bias instability {of}"),
            value: instability,
            sd: instability * relative(samples as f64 * axis.period_s / at_s),
            unit,
            meaning: "standing: gauss_markov.sd of a sensor sheet",
            kind: ParameterKind::Figure,
        });
    }
    found
}
