//! Bounds that a scenario promises to hold, and those that it is known not to hold; measured by `monorig-lab`.

use super::Moment;
use crate::config::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A bound on a metric: `metric`, over the time from `after_s` or `after` to `until_s` or `until`, is `at_most` and/or `at_least` so
/// much.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// The estimator judged; none for metrics of the train or the controller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<String>,
    /// Name of the metric, such as `mass_error_rel_max`.
    pub metric: String,
    /// Measured from here, s; none = from the start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_s: Option<NonNegative>,
    /// Measured to here, s; none = to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<Positive>,
    /// Measured from this place or event on, instead of `after_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<Moment>,
    /// Measured to this place or event, instead of `until_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<Moment>,
    /// Upper bound, in the metric's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<Finite>,
    /// Lower bound, in the metric's unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<Finite>,
    /// Over several seeds: the share of runs that must hold the bound (0.5 = the median run); none = every run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantile: Option<Fraction>,
    /// Of an error of an estimator: the share of the same time in which the estimate must be marked valid; none = the scenario's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub availability: Option<Fraction>,
}

impl Expectation {
    /// The time it is measured over, in words, such as ` from 5 s` or ` from where the rear enters climb`; empty for the whole run.
    pub fn window(&self) -> String {
        let end = |word: &str, s: Option<f64>, moment: &Option<Moment>| match (s, moment) {
            (Some(s), _) => format!(" {word} {s} s"),
            (None, Some(moment)) => format!(" {word} {moment}"),
            (None, None) => String::new(),
        };
        let from = end("from", self.after_s.map(f64::from), &self.after);
        from + &end("to", self.until_s.map(f64::from), &self.until)
    }

    /// Whether the known failure is about this bound.
    pub fn is_meant_by(&self, known: &KnownFailure) -> bool {
        fn fits<T: PartialEq>(given: &Option<T>, ours: &Option<T>) -> bool {
            given.is_none() || given == ours
        }
        self.estimator == known.estimator
            && self.metric == known.metric
            && fits(&known.after_s, &self.after_s)
            && fits(&known.until_s, &self.until_s)
            && fits(&known.after, &self.after)
            && fits(&known.until, &self.until)
    }
}

/// A bound that does not hold, for reasons of physics: shown as a known failure, and an error once it does hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownFailure {
    /// The estimator of the bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<String>,
    /// The metric of the bound.
    pub metric: String,
    /// The bound's `after_s`, where several bounds differ by it; likewise the next three.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_s: Option<NonNegative>,
    /// See above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<Positive>,
    /// See above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<Moment>,
    /// See above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<Moment>,
    /// Why physics or the method does not allow it.
    pub why: String,
}

/// Shares of the time in which estimates must be marked valid wherever an error of theirs is bounded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Availability {
    /// Of the mass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<Fraction>,
    /// Of the slope at the IMU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<Fraction>,
    /// Of the effective slope of the whole vehicle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effective_slope: Option<Fraction>,
}
