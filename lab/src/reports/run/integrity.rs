//! Integrity: what the estimators' marks of validity are worth, in a table and in Stanford diagrams.

use crate::metrics::Quantity;
use crate::reports::findings::integrity;
use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::stanford::Stanford;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use monorig_sim::config::scenario::IntegrityLimits;
use monorig_sim::error::Error;

/// Table and diagrams.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let limits = run.summary.limits;
    let section = Section::new("Integrity").text(format!(
        "Is what is marked valid right? A valid sample is misleading when its error exceeds the protection level, {} reported standard \
         deviations, and the alert limit. Right of the diagonal of a Stanford diagram the error is beyond the protection level. Counted \
         from the start of the run, and in every step of the estimator; drawn are the recorded rows.",
        limits.k
    ));
    let mut section = section.table(integrity([&run.summary]));
    for quantity in Quantity::ALL {
        for (name, ink) in run.estimators() {
            section = section.figures(diagram(run, quantity, name, ink, &limits)?);
        }
    }
    Ok(section)
}

/// None where nothing is marked valid.
fn diagram(
    run: &Recorded,
    quantity: Quantity,
    name: &str,
    ink: Ink,
    limits: &IntegrityLimits,
) -> Result<Option<Figure>, Error> {
    let channel = format!("estimates/{name}/{}", quantity.channel());
    // recordings of earlier versions do not have it for the effective grade
    let Some(valid) = run.find(&format!("{channel}_valid")) else {
        return Ok(None);
    };
    let truth = run.column(quantity.truth_channel())?;
    let estimates = run.column(&channel)?;
    let sd = run.column(&format!("{channel}_sd"))?;
    let rows = estimates.iter().zip(truth).zip(sd).zip(valid);
    let samples = rows.filter(|(_, v)| **v == 1.0).map(|(((x, t), sd), _)| {
        let unit = match quantity {
            Quantity::Mass => 100.0 / t,
            _ => DEGREES,
        };
        ((x - t).abs() * unit, limits.k * sd * unit)
    });
    let samples: Vec<(f64, f64)> = samples.collect();
    if samples.is_empty() {
        return Ok(None);
    }
    let (unit, factor) = quantity.unit();
    let diagram = Stanford {
        title: format!("{}: {name}", quantity.title()),
        unit: unit.into(),
        k: limits.k,
        alert: factor * quantity.alert(limits),
        ink,
        samples,
    };
    Ok(Some(diagram.figure()))
}
