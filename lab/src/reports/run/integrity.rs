//! Integrity: what the estimators' marks of validity are worth, in a table and in Stanford diagrams.

use crate::metrics::Quantity;
use crate::reports::findings::integrity;
use crate::reports::page::Section;
use crate::reports::plot::Figure;
use crate::reports::plot::stanford::Stanford;
use crate::reports::plot::theme::Ink;
use crate::reports::run::recorded::{DEGREES, Recorded};
use crate::text::number;
use monorig_sim::config::scenario::IntegrityLimits;
use monorig_sim::error::Error;

/// Table and diagrams.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let limits = run.summary.limits;
    let section = Section::new("Integrity").text(format!(
        "Are the values marked valid right? A valid sample is misleading if its error exceeds both the alert limit and \
         the protection level (of the estimator, else {} reported standard deviations; at most 43 % or 9°). Right of the diagonal of a Stanford \
         diagram the error exceeds the protection level. The counts use every step of the estimator from the start of \
         the run; the diagram shows the recorded rows.",
        limits.k
    ));
    let mut section = section.table(integrity([&run.summary]));
    for quantity in Quantity::ALL {
        let mut figures = Vec::new();
        for (name, ink) in run.estimators() {
            let figure = diagram(run, quantity, name, ink, &limits)?;
            figures.extend(figure.map(|figure| (name.to_owned(), figure)));
        }
        section = run.folding(section, quantity.title(), figures);
    }
    Ok(section)
}

/// `None` if no value is marked valid.
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
    let own = run.find(&format!("{channel}_protection"));
    let (name_of_unit, factor) = quantity.unit();
    let rows = estimates.iter().zip(truth).zip(sd).zip(valid).enumerate();
    let samples = rows.filter(|(_, (_, v))| **v == 1.0);
    let samples = samples.map(|(i, (((x, t), sd), _))| {
        let own = own.and_then(|own| own.get(i)).filter(|own| **own > 0.0);
        let level = own.map_or(limits.k * sd, |own| own * limits.of_reported());
        let unit = match quantity {
            Quantity::Mass => 100.0 / t,
            _ => DEGREES,
        };
        let protection = (level * unit).min(factor * quantity.max_protection());
        ((x - t).abs() * unit, protection)
    });
    let samples: Vec<(f64, f64)> = samples.collect();
    if samples.is_empty() {
        return Ok(None);
    }
    let alert = factor * quantity.alert(limits);
    let beyond = samples.iter().filter(|(_, protection)| *protection > alert);
    let uncertain = beyond.count() as f64 / samples.len() as f64;
    let diagram = Stanford {
        title: format!("{}: {name}", quantity.title()),
        note: note(run, quantity, name, uncertain),
        unit: name_of_unit.into(),
        alert,
        ink,
        samples,
    };
    Ok(Some(diagram.figure()))
}

/// Shares of the table above, and the share of samples that are too uncertain to use.
fn note(run: &Recorded, quantity: Quantity, name: &str, uncertain: f64) -> String {
    let mut all = run.summary.integrity.iter();
    let Some(of) = all.find(|i| i.estimator == name && i.quantity == quantity) else {
        return String::new();
    };
    let overconfident = of.overconfident as f64 / of.judged as f64;
    let all = [of.share(), overconfident, uncertain].map(|x| number(100.0 * x));
    let [misleading, overconfident, uncertain] = all;
    format!(
        "{misleading} % of the valid samples mislead, {overconfident} % have an error beyond the protection level, and {uncertain} % have a protection \
         level beyond the alert limit: these are too uncertain to use."
    )
}
