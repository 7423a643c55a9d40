//! Limits of a scenario that are weaker than usual. They are allowed, and every verdict that they are part of says so.

use crate::metrics::Window;
use crate::verdicts::integrity::Integrity;
use crate::verdicts::summary::AFTER_S;
use monorig_sim::config::scenario::{Expectation, IntegrityLimits, ScenarioFile};

/// Availability up to which a limit counts as weakened.
const LOW_AVAILABILITY: f64 = 0.05;
/// Least share of runs; a bound with a smaller share ignores the median run.
const LOW_QUANTILE: f64 = 0.5;
/// Length up to which a window counts as too short, s.
const SHORT_S: f64 = 1.0;
/// Least share of the valid samples that must have a reference.
const LOW_REFERENCE: f64 = 0.5;

/// The weakened limits of a file, in words.
pub(crate) fn of_file(file: &ScenarioFile) -> Vec<String> {
    let (limits, usual) = (IntegrityLimits::of(file), IntegrityLimits::default());
    let mut all = Vec::new();
    let mut say = |weak: bool, words: String| {
        if weak {
            all.push(words);
        }
    };
    for (key, limit, usual) in [
        ("k", limits.k, usual.k),
        ("max_misleading_share", limits.max_share, usual.max_share),
        ("mass_alert_rel", limits.mass_rel, usual.mass_rel),
        ("slope_alert_deg", limits.slope_deg, usual.slope_deg),
        (
            "effective_slope_alert_deg",
            limits.effective_slope_deg,
            usual.effective_slope_deg,
        ),
    ] {
        say(limit > usual, format!("integrity.{key} {limit}"));
    }
    for name in &file.integrity.reference_only {
        say(
            true,
            format!("{name} is not judged (integrity.reference_only)"),
        );
    }
    for (key, share) in [
        ("mass", file.availability.mass),
        ("slope", file.availability.slope),
        ("effective_slope", file.availability.effective_slope),
    ] {
        let share = share.map_or(1.0, f64::from);
        say(
            share <= LOW_AVAILABILITY,
            format!("availability.{key} {share:e}"),
        );
    }
    for from_s in file.never_s() {
        say(
            true,
            format!("an event at {from_s} s, after the end of the run"),
        );
    }
    for e in &file.expect {
        let of = words(e);
        let demanded = match e.metric.ends_with("_availability") {
            true => e.at_least.map(f64::from),
            false => None,
        };
        for share in [e.availability.map(f64::from), demanded]
            .into_iter()
            .flatten()
        {
            say(
                share <= LOW_AVAILABILITY,
                format!("{of}: an availability of {share:e}"),
            );
        }
        let quantile = e.share_of_runs();
        say(
            quantile < LOW_QUANTILE,
            format!("{of}: a quantile of {quantile:e}"),
        );
    }
    all
}

/// Text about a window of an expectation that was too short in this run, from `begin_s` to `end_s`.
pub(crate) fn of_window(
    e: &Expectation,
    window: &Window,
    begin_s: f64,
    end_s: f64,
) -> Option<String> {
    let length_s = window.until_s().min(end_s) - window.after_s().max(begin_s);
    let short = length_s <= SHORT_S || end_s - begin_s < AFTER_S;
    (short && length_s >= 0.0).then(|| format!("{}: measured over {length_s:.3} s only", words(e)))
}

/// Text about an integrity that was judged over few of the valid samples.
pub(crate) fn of_integrity(i: &Integrity) -> Option<String> {
    let few =
        i.at_most.is_some() && i.fine() > 0 && (i.fine() as f64) < LOW_REFERENCE * i.valid as f64;
    few.then(|| {
        format!(
            "{} {}: the reference is fine enough for only {} of {} valid samples",
            i.estimator,
            i.quantity.words(),
            i.fine(),
            i.valid
        )
    })
}

fn words(e: &Expectation) -> String {
    match &e.estimator {
        Some(name) => format!("{name} {}{}", e.metric, e.window()),
        None => format!("{}{}", e.metric, e.window()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdicts::expected;
    use monorig_sim::config::file::Sets;
    use monorig_sim::config::scenario::Scenario;
    use monorig_testing::Random;
    use monorig_testing::mutants;
    use std::path::Path;

    /// A limit that holds more easily than usual, by whatever factor, is refused or named; one that is as usual or
    /// stricter is neither.
    #[test]
    fn no_weak_limit_goes_unsaid() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/minimal.yaml");
        let of = |key: &str, value: f64| -> Result<Vec<String>, String> {
            let set = (key.to_owned(), format!("{value:e}"));
            let scenario =
                Scenario::load_with(&path, &Sets::new(&[set])).map_err(|e| e.to_string())?;
            expected::check(&scenario).map_err(|e| e.to_string())?;
            Ok(of_file(&scenario.file))
        };
        assert_eq!(of("integrity.k", 3.0), Ok(Vec::new()));
        let mut random = Random::new(mutants::first_seed());
        for _ in 0..mutants::count(60) {
            let (key, usual, up) = *random.of(&[
                ("integrity.k", 3.0, 1.0),
                ("integrity.max_misleading_share", 0.001, 1.0),
                ("integrity.mass_alert_rel", 0.03, 1.0),
                ("integrity.slope_alert_deg", 0.25, 1.0),
                ("integrity.effective_slope_alert_deg", 0.25, 1.0),
                ("availability.mass", LOW_AVAILABILITY, -1.0),
                ("availability.slope", LOW_AVAILABILITY, -1.0),
            ]);
            let decades = 0.01 + 12.0 * random.unit();
            let weak = usual * 10f64.powf(up * decades);
            let found = of(key, weak);
            assert!(
                found.as_ref().is_err() || found.as_ref().is_ok_and(|all| !all.is_empty()),
                "{key} {weak}: {found:?}"
            );
            let strict = usual * 10f64.powf(-up * decades.min(1.0));
            assert_eq!(of(key, strict), Ok(Vec::new()), "{key} {strict}");
        }
    }

    /// A bound, or the floor of a known failure, at the end of the range of its metric or beyond is refused; one within
    /// it is not: of every metric with an end.
    #[test]
    fn no_bound_is_beyond_the_range_of_its_metric() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/minimal.yaml");
        let of = |bounds: String, floors: String| -> Result<(), String> {
            let sets = [
                ("expect", bounds),
                ("known_failures", floors),
                ("published", "[]".into()),
            ];
            let sets = sets.map(|(key, value)| (key.to_owned(), value));
            let scenario =
                Scenario::load_with(&path, &Sets::new(&sets)).map_err(|e| e.to_string())?;
            expected::check(&scenario).map_err(|e| e.to_string())
        };
        let name = "dffrls_aekf_robust";
        let metrics = crate::metrics::estimator_metrics();
        let (mut ends, mut random) = (0, Random::new(mutants::first_seed()));
        for metric in metrics {
            let Some(end) = metric.range() else { continue };
            ends += 1;
            let beside = match metric.error_of() {
                Some(_) => ", availability: 0.5",
                None => "",
            };
            let bound = |x: f64| {
                format!(
                    "[{{estimator: {name}, metric: {}, at_most: {x:e}{beside}}}]",
                    metric.name
                )
            };
            let floor = |x: f64| {
                format!(
                    "[{{estimator: {name}, metric: {}, no_worse_than: {x:e}, why: a test}}]",
                    metric.name
                )
            };
            let within = end * (0.01 + 0.98 * random.unit());
            assert_eq!(of(bound(within), "[]".into()), Ok(()), "{}", metric.name);
            for beyond in [end, end * (1.0 + 9.0 * random.unit()), 1e11] {
                let told = of(bound(beyond), "[]".into()).unwrap_err();
                assert!(told.contains("always holds or always fails"), "{told}");
            }
            let worst = match metric.best.less_is_better() {
                Some(false) => 0.0,
                _ => end,
            };
            let told = of(bound(within), floor(worst)).unwrap_err();
            assert!(told.contains("has no floor"), "{told}");
            assert_eq!(
                of(bound(within), floor(0.5 * end)),
                Ok(()),
                "{}",
                metric.name
            );
        }
        assert!(ends > 20, "{ends}");
    }
}
