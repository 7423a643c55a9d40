//! Checks of expectations, known failures, alert limits and the names of events.

use super::ScenarioFile;
use super::wrong::{Wrong, wrong};
use crate::config::checked::{Fraction, NonNegative, Positive};
use crate::config::file::{nearest, suggestion};

/// Check them.
pub(super) fn check(file: &ScenarioFile) -> Result<(), Wrong> {
    event_names(file)?;
    expectations(file)?;
    defaults(file)?;
    known_failures(file)
}

/// Checks that events and points of the speed reference have different names; a point by chainage has no name.
fn event_names(file: &ScenarioFile) -> Result<(), Wrong> {
    let events = file.events.iter().enumerate();
    let events = events.map(|(i, e)| (format!("events[{i}].name"), e.name()));
    let points = file.drive.speed.iter().enumerate();
    let points = points.map(|(i, p)| (format!("drive.speed[{i}].name"), p.name.as_deref()));
    let mut names: Vec<&str> = Vec::new();
    for (key, name) in events.chain(points) {
        let Some(name) = name else { continue };
        if names.contains(&name) {
            return wrong(
                key,
                format!(
                    "another event or point of the speed reference already has the name `{name}`"
                ),
                "give each result its own name",
            );
        }
        names.push(name);
    }
    match file
        .drive
        .speed
        .iter()
        .position(|p| p.name.is_some() && p.at_s.is_none())
    {
        Some(i) => wrong(
            format!("drive.speed[{i}].name"),
            "only a point by time (`at_s`) has a name",
            "for a point by chainage use a name in the track file and `after: {front_enters: NAME}`",
        ),
        None => Ok(()),
    }
}

/// Checks that availabilities can fail, and that references are among the estimators.
fn defaults(file: &ScenarioFile) -> Result<(), Wrong> {
    let a = &file.availability;
    for (key, share) in [
        ("mass", a.mass),
        ("slope", a.slope),
        ("effective_slope", a.effective_slope),
    ] {
        share.map_or(Ok(()), |share| {
            can_be_missed(&format!("availability.{key}"), share)
        })?;
    }
    limits(file)?;
    for (i, name) in file.integrity.reference_only.iter().enumerate() {
        if !file.estimators.contains_key(name) {
            return wrong(
                format!("integrity.reference_only[{i}]"),
                format!("`{name}` is not among this scenario's estimators"),
                one_of_them(file, name),
            );
        }
    }
    Ok(())
}

/// Least availability that a scenario may require: less is next to nothing.
const LEAST_AVAILABILITY: f64 = 0.01;

/// Checks that a run can miss an availability.
fn can_be_missed(key: &str, share: Fraction) -> Result<(), Wrong> {
    match share.get() < LEAST_AVAILABILITY {
        true => wrong(
            key,
            "an availability this low hardly ever fails",
            format!("write a share of at least {LEAST_AVAILABILITY}, such as 0.9"),
        ),
        false => Ok(()),
    }
}

/// Largest k of a protection level; the precision approach of an aircraft has 6.
const MAX_K: f64 = 10.0;
/// Largest alert limit of the mass, as a share of the mass.
const MAX_MASS_ALERT: f64 = 1.0;
/// Largest alert limit of a slope, °.
const MAX_SLOPE_ALERT_DEG: f64 = 90.0;

/// Checks that an estimate can exceed the limits of integrity.
fn limits(file: &ScenarioFile) -> Result<(), Wrong> {
    let i = &file.integrity;
    for (key, value, most, help) in [
        (
            "k",
            Some(i.k),
            MAX_K,
            "a number of standard deviations, such as 3",
        ),
        (
            "mass_alert_rel",
            Some(i.mass_alert_rel),
            MAX_MASS_ALERT,
            "a share of the mass, such as 0.03",
        ),
        (
            "slope_alert_deg",
            Some(i.slope_alert_deg),
            MAX_SLOPE_ALERT_DEG,
            "an angle, such as 0.25",
        ),
        (
            "effective_slope_alert_deg",
            i.effective_slope_alert_deg,
            MAX_SLOPE_ALERT_DEG,
            "an angle, such as 0.25",
        ),
    ] {
        if let Some(value) = value.filter(|x| x.get() > most) {
            return wrong(
                format!("integrity.{key}"),
                format!(
                    "no estimate exceeds a limit of {}: use at most {most}",
                    value.get()
                ),
                help,
            );
        }
    }
    Ok(())
}

/// Checks that a known failure has a reason, and belongs to one bound of `expect` or to a standard bound.
fn known_failures(file: &ScenarioFile) -> Result<(), Wrong> {
    for known in &file.known_failures {
        let key = format!("known_failures[{}]", known.entry);
        if known.why.trim().is_empty() {
            return wrong(
                format!("{key}.why"),
                "a known failure needs a reason in physics or in the method",
                "write a sentence with the cause and its size",
            );
        }
        let meant = file.expect.iter().filter(|e| e.is_meant_by(known)).count();
        // a bound that holds without `expect`: `monorig-lab` checks that there is one
        let implied = ["_misleading_share", "_availability"];
        let implied = implied.iter().any(|end| known.metric.ends_with(end))
            && known
                .estimator
                .as_ref()
                .is_some_and(|name| file.estimators.contains_key(name));
        match meant {
            1 => {}
            0 if implied => {}
            0 => {
                let names = || file.expect.iter().map(|e| e.metric.as_str());
                return wrong(
                    &key,
                    "`expect` has no bound of this estimator and metric",
                    match nearest(&known.metric, names()) {
                        Some(near) => format!(
                            "`estimator` and `metric` of a bound in `expect`, such as `{near}`"
                        ),
                        None => "`estimator` and `metric` of a bound in `expect`".to_owned(),
                    },
                );
            }
            n => {
                return wrong(
                    &key,
                    format!("`expect` has {n} bounds of this estimator and metric"),
                    "add the `after_s`, `until_s`, `after` or `until` of the bound that you mean",
                );
            }
        }
    }
    Ok(())
}

/// Checks that every expectation bounds a value over a time within the run.
fn expectations(file: &ScenarioFile) -> Result<(), Wrong> {
    let end_s = file.stop.time_limit_s();
    for (i, e) in file.expect.iter().enumerate() {
        let key = format!("expect[{i}]");
        if let Some(name) = &e.estimator
            && !file.estimators.contains_key(name)
        {
            return wrong(
                format!("{key}.estimator"),
                format!("`{name}` is not among this scenario's estimators"),
                match file.estimators.is_empty() {
                    true => "add the estimator under `estimators:`".to_owned(),
                    false => one_of_them(file, name),
                },
            );
        }
        match (e.at_least, e.at_most) {
            (None, None) => {
                return wrong(
                    key,
                    "this expectation bounds nothing, so it cannot fail",
                    "add `at_most`, `at_least`, or both",
                );
            }
            (Some(least), Some(most)) if least > most => {
                return wrong(
                    key,
                    format!(
                        "no value is at least {} and at most {}",
                        least.get(),
                        most.get()
                    ),
                    "swap the two bounds",
                );
            }
            _ => {}
        }
        for (key_s, key_by_name, both) in [
            ("after_s", "after", e.after_s.is_some() && e.after.is_some()),
            ("until_s", "until", e.until_s.is_some() && e.until.is_some()),
        ] {
            if both {
                return wrong(
                    format!("{key}.{key_by_name}"),
                    format!("`{key_s}` and `{key_by_name}` both set this limit"),
                    "keep one of them",
                );
            }
        }
        if let Some(share) = e.availability {
            can_be_missed(&format!("{key}.availability"), share)?;
        }
        let after_s = e.after_s.map_or(0.0, NonNegative::get);
        let until_s = e.until_s.map_or(end_s, Positive::get);
        if until_s > end_s {
            return wrong(
                format!("{key}.until_s"),
                format!("the run ends at {end_s} s, before the end of this window"),
                "use an earlier time; leave out `until_s` to measure to the end",
            );
        }
        if after_s >= until_s.min(end_s) {
            return wrong(
                format!("{key}.after_s"),
                format!(
                    "the run has no sample between {after_s} s and {} s",
                    until_s.min(end_s)
                ),
                "write an earlier time",
            );
        }
        if e.mean && e.quantile.is_some() {
            return wrong(
                format!("{key}.quantile"),
                "a mean over the seeds has no quantile",
                "`mean: true` or `quantile`, not both",
            );
        }
        if e.quantile.is_some_and(|q| q.get() == 0.0) {
            return wrong(
                format!("{key}.quantile"),
                "a bound that need not hold in any run cannot fail",
                "write a share above 0, such as 0.5",
            );
        }
    }
    Ok(())
}

/// The estimators of the scenario by name, the nearest to `name` first.
pub(super) fn one_of_them(file: &ScenarioFile, name: &str) -> String {
    suggestion(name, file.estimators.keys().map(String::as_str), "one of")
}
