//! Expectations of a scenario: every bound, those that follow from others included. A bound that cannot be measured
//! is found before the run, not after it.

use crate::metrics::{Marks, Metric, Quantity, advice, estimator_metrics, find, mark, run_metrics};
use monorig_sim::config::checked::{Finite, Fraction};
use monorig_sim::config::scenario::{Expectation, KnownFailure, Scenario, ScenarioFile};
use monorig_sim::error::Error;

/// A bound, with its known failure if it has one.
#[derive(Clone, Debug)]
pub(crate) struct Bound {
    /// The bound.
    pub(crate) expectation: Expectation,
    /// Entry of its known failure.
    pub(crate) known: Option<KnownFailure>,
}

/// Every bound of a scenario: those of `expect`, then the availabilities that its bounds on errors bring with them,
/// each once.
pub(crate) fn bounds(file: &ScenarioFile) -> Vec<Bound> {
    let mut all = file.expect.clone();
    for e in &file.expect {
        let Some((metric, share)) = implied(file, e) else {
            continue;
        };
        let new = Expectation {
            metric: metric.to_owned(),
            at_most: None,
            at_least: Some(Finite::new(share.get())),
            availability: None,
            ..e.clone()
        };
        if !all.contains(&new) {
            all.push(new);
        }
    }
    let known = |e: &Expectation| {
        let mut known = file.known_failures.iter();
        known.find(|k| e.is_meant_by(k)).cloned()
    };
    all.into_iter()
        .map(|expectation| Bound {
            known: known(&expectation),
            expectation,
        })
        .collect()
}

/// True if the marks of this estimator are judged: the scenario does not list it as `reference_only`.
pub(crate) fn is_judged(file: &ScenarioFile, estimator: &str) -> bool {
    let mut reference_only = file.integrity.reference_only.iter();
    !reference_only.any(|name| name == estimator)
}

/// Bounds on the share of samples with a reference, which errors of a recorded drive need: as much of the time as the
/// quantity must be valid, so that an error over a few samples holds no bound. Of a simulation all have one.
pub(crate) fn of_references(file: &ScenarioFile) -> Vec<Bound> {
    let mut all: Vec<Expectation> = Vec::new();
    let needs = |e: &&Expectation| find(&e.metric).is_some_and(Metric::needs_reference);
    for e in file.expect.iter().filter(needs) {
        let Some(quantity) = error_of(e) else {
            continue;
        };
        let stated = file.expect.iter().find(|other| {
            other.estimator == e.estimator && other.metric == mark(quantity, Marks::Availability)
        });
        let share = match implied(file, e) {
            Some((_, share)) => Some(Finite::new(share.get())),
            None => stated.and_then(|other| other.at_least),
        };
        let new = Expectation {
            metric: mark(quantity, Marks::Referenced).to_owned(),
            at_most: None,
            at_least: share,
            availability: None,
            ..e.clone()
        };
        if share.is_some() && !all.contains(&new) {
            all.push(new);
        }
    }
    let bound = |expectation| Bound {
        expectation,
        known: None,
    };
    all.into_iter().map(bound).collect()
}

/// Bound on the availability over the same time that belongs to a bound on an error: its own, else the scenario's
/// default unless `expect` bounds that availability by itself.
fn implied(file: &ScenarioFile, e: &Expectation) -> Option<(&'static str, Fraction)> {
    let quantity = error_of(e)?;
    let own = e.availability;
    let metric = mark(quantity, Marks::Availability);
    let share = match own {
        Some(share) => Some(share),
        None if bounded_by_itself(file, e, metric) => None,
        None => default_of(file, quantity),
    };
    Some((metric, share?))
}

/// The quantity whose error the expectation bounds from above.
fn error_of(e: &Expectation) -> Option<Quantity> {
    e.estimator.as_ref()?;
    find(&e.metric)?.error_of()
}

fn default_of(file: &ScenarioFile, quantity: Quantity) -> Option<Fraction> {
    match quantity {
        Quantity::Mass => file.availability.mass,
        Quantity::Slope => file.availability.slope,
        Quantity::EffectiveSlope => file.availability.effective_slope,
    }
}

/// True if a separate expectation bounds the availability from below, over the same time.
fn bounded_by_itself(file: &ScenarioFile, e: &Expectation, metric: &str) -> bool {
    file.expect.iter().any(|other| {
        other.estimator == e.estimator
            && other.metric == metric
            && other.at_least.is_some_and(|x| x.get() > 0.0)
            && (other.after_s, other.until_s) == (e.after_s, e.until_s)
            && (&other.after, &other.until) == (&e.after, &e.until)
    })
}

/// Checks that every expectation names an existing metric: one of an estimator if it names an estimator, else one of
/// the train and the controller. A bound on an error needs one on the availability beside it.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    for (i, e) in scenario.file.expect.iter().enumerate() {
        metric(scenario, i, e)?;
        can_fail(scenario, i, e)?;
        accompanied(scenario, i, e)?;
    }
    known_failures(scenario)?;
    let of_estimators: Vec<&str> = estimator_metrics().map(|m| m.name).collect();
    for (i, p) in scenario.file.published.iter().enumerate() {
        if !of_estimators.contains(&p.metric.as_str()) {
            return Err(scenario.error(
                format!("published[{i}].metric"),
                format!("estimators have no metric `{}`", p.metric),
                advice(&p.metric, &of_estimators),
            ));
        }
    }
    Ok(())
}

fn metric(scenario: &Scenario, i: usize, e: &Expectation) -> Result<(), Error> {
    let of = |metrics: &mut dyn Iterator<Item = &'static Metric>| -> Vec<&'static str> {
        metrics.map(|m| m.name).collect()
    };
    let (of_estimators, of_run) = (of(&mut estimator_metrics()), of(&mut run_metrics()));
    let (known, others) = match e.estimator {
        Some(_) => (&of_estimators, &of_run),
        None => (&of_run, &of_estimators),
    };
    let metric = e.metric.as_str();
    if known.contains(&metric) {
        return Ok(());
    }
    let key = format!("expect[{i}].metric");
    Err(match (others.contains(&metric), e.estimator.is_some()) {
        (true, true) => scenario.error(
            key,
            format!("`{metric}` is a metric of the train and the controller"),
            "remove `estimator` from this expectation",
        ),
        (true, false) => scenario.error(
            key,
            format!("`{metric}` is a metric of an estimator"),
            "add `estimator:` with the name of an estimator",
        ),
        _ => {
            let message = format!("no metric is called `{metric}`");
            scenario.error(key, message, advice(metric, known))
        }
    })
}

/// Checks that a bound is within the range of its metric: no metric is negative, and quantities have ends. An
/// availability of 0 is admitted: it says that an estimator may never mark anything valid, and is shown as a weakened
/// limit.
fn can_fail(scenario: &Scenario, i: usize, e: &Expectation) -> Result<(), Error> {
    let end = find(&e.metric)
        .and_then(Metric::range)
        .unwrap_or(f64::INFINITY);
    let availability = find(&e.metric).and_then(Metric::mark_of);
    let availability = availability.is_some_and(|(_, kind)| kind == Marks::Availability);
    let (key, value, range) = match (e.at_least, e.at_most) {
        (Some(least), _) if least.get() < 0.0 || least.get() == 0.0 && !availability => {
            ("at_least", least, "is below 0")
        }
        (_, Some(most)) if most.get() < 0.0 => ("at_most", most, "is below 0"),
        (_, Some(most)) if most.get() >= end => ("at_most", most, &*format!("is above {end}")),
        (Some(least), _) if least.get() > end => ("at_least", least, &*format!("is above {end}")),
        _ => return Ok(()),
    };
    Err(scenario.error(
        format!("expect[{i}].{key}"),
        format!(
            "no {} {range}, so {} always holds or always fails",
            e.metric,
            value.get()
        ),
        "use a bound that a run can hold and can miss",
    ))
}

/// Checks that a bound on an error has a bound on the availability; only such a bound can have its own `availability`.
fn accompanied(scenario: &Scenario, i: usize, e: &Expectation) -> Result<(), Error> {
    let Some(quantity) = error_of(e) else {
        return match e.availability {
            Some(_) => Err(scenario.error(
                format!("expect[{i}].availability"),
                format!(
                    "`{}` is not an error of an estimator, so it has no validity",
                    e.metric
                ),
                "leave out `availability`",
            )),
            None => Ok(()),
        };
    };
    let metric = mark(quantity, Marks::Availability);
    let file = &scenario.file;
    if e.availability.is_some()
        || bounded_by_itself(file, e, metric)
        || default_of(file, quantity).is_some()
    {
        return Ok(());
    }
    let estimator = e.estimator.as_deref().unwrap_or_default();
    Err(scenario.error(
        format!("expect[{i}]"),
        format!(
            "this bounds an error of {estimator}, but no availability says how much of the time its {} must be valid",
            quantity.words()
        ),
        format!(
            "`availability: 0.9` in this expectation, `{{estimator: {estimator}, metric: {metric}, at_least: 0.9}}` beside it, or \
             `availability: {{{}: 0.9}}` for the whole scenario",
            quantity.name()
        ),
    ))
}

/// Checks that every known failure belongs to a bound, or to an integrity that `expect` does not bound, and can become
/// worse.
fn known_failures(scenario: &Scenario) -> Result<(), Error> {
    let bounds = bounds(&scenario.file);
    for known in &scenario.file.known_failures {
        let integrity = Quantity::ALL
            .map(|quantity| mark(quantity, Marks::Integrity))
            .contains(&known.metric.as_str());
        let floor = known.no_worse_than.get();
        let end = find(&known.metric).and_then(Metric::range);
        let from_below =
            find(&known.metric).is_some_and(|m| m.best.less_is_better() == Some(false));
        if from_below && floor <= 0.0 || !from_below && end.is_some_and(|end| floor >= end) {
            return Err(scenario.error(
                format!("known_failures[{}].no_worse_than", known.entry),
                format!(
                    "no {} is worse than {floor}, so this failure has no floor",
                    known.metric
                ),
                "at most twice what was measured",
            ));
        }
        if !integrity && !bounds.iter().any(|b| b.expectation.is_meant_by(known)) {
            return Err(scenario.error(
                format!("known_failures[{}]", known.entry),
                format!("the scenario has no bound on `{}`", known.metric),
                "use `estimator` and `metric` of a bound, or remove this known failure",
            ));
        }
    }
    Ok(())
}
