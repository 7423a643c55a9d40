//! Estimate against truth, one plot for each estimator and quantity.

use crate::reports::page::Section;
use crate::reports::plot::axis::{Axis, without_outliers};
use crate::reports::plot::line::{Band, Line, LineChart, stretches_without};
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use monorig_sim::error::Error;

/// A quantity that estimators estimate.
struct DrawnQuantity {
    title: &'static str,
    axis: &'static str,
    estimate: &'static str,
    truth: &'static str,
    factor: f64,
    /// Reference in a map, key of its standard deviation, and factor of this standard deviation.
    reference: (&'static str, &'static str, f64),
}

const QUANTITIES: [DrawnQuantity; 2] = [
    DrawnQuantity {
        title: "Total mass",
        axis: "total mass, t",
        estimate: "total_mass",
        truth: "truth/total_mass",
        factor: 1e-3,
        reference: ("mass", "sd_kg", 1e-3),
    },
    DrawnQuantity {
        title: "Slope",
        axis: "slope, °",
        estimate: "grade",
        truth: "truth/grade_at_imu",
        factor: DEGREES,
        reference: ("slope", "sd_deg", 1.0),
    },
];
/// Least difference of the effective slope from the slope at the IMU for a plot, rad.
const MIN_DIFFERENCE_RAD: f64 = 0.1 / DEGREES;

/// Plots of the estimates.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let mut section = Section::new(match run.is_replay() {
        true => "Estimates against the reference",
        false => "Estimates against the truth",
    });
    for quantity in &QUANTITIES {
        let (mut figures, mut never_valid) = (Vec::new(), Vec::new());
        for (name, ink) in run.estimators() {
            let valid = format!("estimates/{name}/{}_valid", quantity.estimate);
            if run.column(&valid)?.contains(&1.0) {
                let chart = chart(run, quantity, name, ink)?;
                figures.push((name.to_owned(), chart.figure()));
            } else {
                never_valid.push(name);
            }
        }
        section = run.folding(section, quantity.title, figures);
        if !never_valid.is_empty() {
            let what = quantity.title.to_lowercase();
            section = section.text(format!(
                "Never marked a {what} valid: {}.",
                never_valid.join(", ")
            ));
        }
    }
    Ok(section)
}

fn chart(
    run: &Recorded,
    quantity: &DrawnQuantity,
    name: &str,
    ink: Ink,
) -> Result<LineChart, Error> {
    let channel = format!("estimates/{name}/{}", quantity.estimate);
    let values = run.over_time(&channel, quantity.factor)?;
    let sd = run.column(&format!("{channel}_sd"))?;
    let valid = run.column(&format!("{channel}_valid"))?;
    let band = values.iter().zip(sd).map(|((t, x), sd)| {
        let half = 2.0 * sd * quantity.factor;
        (*t, x - half, x + half)
    });
    let band = band.collect();
    let flags = values.iter().zip(valid).map(|((t, _), v)| (*t, *v == 1.0));
    let shades = stretches_without(flags);
    let valid_values = values.iter().zip(valid).map(|((t, x), v)| match v {
        1.0 => (*t, *x),
        _ => (*t, f64::NAN),
    });
    let valid_values: Vec<_> = valid_values.collect();

    let title = format!("{}: {name}", quantity.title);
    let mut chart = run.chart(title, Axis::linear(quantity.axis));
    chart.bands.push(Band {
        name: "± 2 σ".into(),
        ink,
        rows: band,
    });
    chart.shades = Some(("not valid".into(), shades));
    let truth = run.over_time(quantity.truth, quantity.factor)?;
    let halves = valid_values.iter().zip(sd).filter(|(v, _)| v.1.is_finite());
    let halves = halves.map(|(_, sd)| 2.0 * sd * quantity.factor);
    let half = without_outliers(halves, USUAL, 0.1).map_or(0.0, |ends| ends.1);
    chart.y.range = range(&valid_values, &truth, half);
    chart.add(Line::new("", ink, values).faintly());
    chart.add(Line::new("estimate", ink, valid_values));
    if quantity.estimate == "grade" && effective_differs(run)? {
        let effective = run.over_time("truth/grade_effective", quantity.factor)?;
        chart.add(Line::new("truth, whole vehicle", Ink::Muted, effective));
    }
    let called = match run.is_replay() {
        true => "reference",
        false => "truth",
    };
    let (of, key, factor) = quantity.reference;
    let sd = run.reference_sd(of, key).map(|sd| 2.0 * sd * factor);
    if let Some(half) = sd.filter(|half| *half > 0.0) {
        let rows = truth.iter().map(|(t, x)| (*t, x - half, x + half));
        chart.bands.push(Band {
            name: "reference ± 2 σ".into(),
            ink: Ink::Muted,
            rows: rows.collect(),
        });
    }
    chart.add(Line::new(called, Ink::Text, truth));
    Ok(chart)
}

fn effective_differs(run: &Recorded) -> Result<bool, Error> {
    let pairs = run
        .column("truth/grade_at_imu")?
        .iter()
        .zip(run.column("truth/grade_effective")?);
    Ok(pairs
        .into_iter()
        .any(|(a, b)| (a - b).abs() > MIN_DIFFERENCE_RAD))
}

/// One half width of a band in this number may lie outside the axis.
const USUAL: f64 = 0.1;

/// Range of the valid values and the truth, with room for a band of this half width if the band is not too wide: values
/// that are not valid may be far off.
fn range(valid: &[(f64, f64)], truth: &[(f64, f64)], half: f64) -> Option<(f64, f64)> {
    let all = valid.iter().chain(truth).map(|p| p.1);
    let ends = all
        .filter(|x| x.is_finite())
        .fold(None, |ends, x| match ends {
            None => Some((x, x)),
            Some((low, high)) => Some((x.min(low), x.max(high))),
        });
    let (low, high): (f64, f64) = ends?;
    let room = (0.3 * (high - low))
        .max(half.min(3.0 * (high - low)))
        .max(0.03 * high.abs().max(low.abs()))
        .max(1e-6);
    Some((low - room, high + room))
}
