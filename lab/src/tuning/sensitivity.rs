//! Sensitivity of the loss around the winner: a curve over each parameter.

use crate::tuning::baseline::Baseline;
use crate::tuning::evaluate::Evaluator;
use crate::tuning::progress::Progress;
use crate::tuning::space::Space;
use crate::tuning::study::{TuningFile, TuningStudy, Values, as_number};
use monorig_sim::config::scenario::ParameterValue;
use serde::Serialize;

/// Curves of the loss.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Sensitivity {
    /// Curves, one for each parameter.
    pub(crate) curves: Vec<Curve>,
}

/// Loss over one parameter, with the others at the winner's values.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Curve {
    pub(crate) parameter: String,
    pub(crate) values: Vec<ParameterValue>,
    /// Loss at each value; none if the trial fails or breaks a constraint.
    pub(crate) losses: Vec<Option<f64>>,
}

/// Trials that the neighbourhood of a winner takes: a curve for each parameter, with winner and defaults in it.
pub(crate) fn trials(file: &TuningFile) -> u64 {
    let parameters = file.parameters.len() as u64;
    parameters.saturating_mul(u64::from(file.sensitivity.curve) + 2)
}

/// Losses around the winner over the tuning runs. `None` if `progress` stopped it.
pub(crate) fn sensitivity(
    study: &TuningStudy,
    evaluator: &Evaluator<'_>,
    baseline: &Baseline,
    winner: &Values,
    progress: &dyn Progress,
) -> Option<Sensitivity> {
    let space = Space::new(&study.file.parameters);
    let names: Vec<String> = space.names().map(str::to_owned).collect();
    let points = study.file.sensitivity.curve;
    let defaults = study.defaults();
    let marked = [winner, &defaults];
    let all = trials(&study.file);
    let mut done = 0;
    let mut loss = |values: &Values| {
        done += 1;
        if !progress.stage("sensitivity", done as f64 / all as f64) {
            return None;
        }
        let v = baseline.judge.judge(&evaluator.evaluate(values));
        let held = v.failed.is_none() && v.violation == 0.0;
        let loss = held.then(|| v.losses.iter().sum::<f64>() / v.losses.len() as f64);
        Some(loss)
    };

    let mut found = Sensitivity::default();
    for name in &names {
        let mut values = axis(&space, winner, name, points);
        with_marked(&mut values, marked.iter().filter_map(|m| m.get(name)));
        let mut losses = Vec::new();
        for x in &values {
            let mut changed = winner.clone();
            changed.insert(name.clone(), x.clone());
            losses.push(loss(&changed)?);
        }
        found.curves.push(Curve {
            parameter: name.clone(),
            values,
            losses,
        });
    }
    Some(found)
}

/// Values of a parameter from end to end of its range, without repetition.
fn axis(space: &Space, winner: &Values, name: &str, points: u32) -> Vec<ParameterValue> {
    let Some(i) = space.names().position(|n| n == name) else {
        return Vec::new();
    };
    let start = space.point(winner);
    let last = f64::from(points.saturating_sub(1).max(1));
    let at = |k: u32| {
        let mut point = start.clone();
        if let Some(u) = point.get_mut(i) {
            *u = f64::from(k) / last;
        }
        space.values(&point).remove(name)
    };
    let mut values: Vec<ParameterValue> = (0..points).filter_map(at).collect();
    values.dedup();
    values
}

/// The numbers of a curve with those that are marked on it, winner and default, as far as they are within its range:
/// so the curve goes through the marks.
fn with_marked<'a>(
    values: &mut Vec<ParameterValue>,
    marked: impl Iterator<Item = &'a ParameterValue>,
) {
    let Some(mut all) = values.iter().map(as_number).collect::<Option<Vec<f64>>>() else {
        return;
    };
    let (low, high) = (
        all.iter().copied().fold(f64::INFINITY, f64::min),
        all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    );
    for value in marked {
        if let Some(x) = as_number(value)
            && (low..=high).contains(&x)
            && !all.contains(&x)
        {
            values.push(value.clone());
            all.push(x);
        }
    }
    let order = |value: &ParameterValue| as_number(value).unwrap_or(f64::NAN);
    values.sort_by(|a, b| order(a).total_cmp(&order(b)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_sim::config::checked::Finite;

    #[test]
    fn a_curve_goes_through_winner_and_default() {
        let number = |x: f64| ParameterValue::Number(Finite::try_from(x).unwrap());
        let mut values: Vec<_> = [0.0, 1.0, 2.0].map(number).to_vec();
        let marked = [0.3, 1.0, 1.7, 5.0].map(number);
        with_marked(&mut values, marked.iter());
        assert_eq!(values, [0.0, 0.3, 1.0, 1.7, 2.0].map(number));
        let words = vec![ParameterValue::Flag(false), ParameterValue::Flag(true)];
        let mut same = words.clone();
        with_marked(&mut same, marked.iter());
        assert_eq!(same, words);
    }
}
