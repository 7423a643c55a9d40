//! Does a scenario expect things that can be measured? Found out before the run, not after it.

use crate::metrics::{estimator_metrics, run_metrics};
use monorig_sim::config::file::nearest;
use monorig_sim::config::scenario::Scenario;
use monorig_sim::error::Error;

/// Every expectation must name a metric there is: one of an estimator if it names an estimator, else one of the train and
/// the controller.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    let of_estimators: Vec<&str> = estimator_metrics().map(|m| m.name).collect();
    let of_run: Vec<&str> = run_metrics().map(|m| m.name).collect();
    for (i, e) in scenario.file.expect.iter().enumerate() {
        let (known, others) = match e.estimator {
            Some(_) => (&of_estimators, &of_run),
            None => (&of_run, &of_estimators),
        };
        let metric = e.metric.as_str();
        if known.contains(&metric) {
            continue;
        }
        let key = format!("expect[{i}].metric");
        return Err(match (others.contains(&metric), e.estimator.is_some()) {
            (true, true) => scenario.error(
                key,
                format!("`{metric}` is a metric of the train and the controller"),
                "remove `estimator` from this expectation",
            ),
            (true, false) => scenario.error(
                key,
                format!("`{metric}` is a metric of an estimator"),
                "add `estimator:` with the name of one",
            ),
            _ => {
                let list = format!("known metrics: {}", known.join(", "));
                let help = match nearest(metric, known.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`? {list}"),
                    None => list,
                };
                scenario.error(key, format!("there is no metric `{metric}`"), help)
            }
        });
    }
    for (i, p) in scenario.file.published.iter().enumerate() {
        if !of_estimators.contains(&p.metric.as_str()) {
            let near = nearest(&p.metric, of_estimators.iter().copied());
            return Err(scenario.error(
                format!("published[{i}].metric"),
                format!("there is no metric `{}` of estimators", p.metric),
                match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("known metrics: {}", of_estimators.join(", ")),
                },
            ));
        }
    }
    Ok(())
}
