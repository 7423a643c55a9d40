//! Bounds that a scenario must hold, and its known failures; measured by `monorig-lab`.

use super::Moment;
use crate::config::checked::{Finite, Fraction, NonNegative, Positive};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// A bound on a metric: `metric`, over the time from `after_s` or `after` to `until_s` or `until`, is `at_most` and/or
/// `at_least` so much.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Estimator that the bound is for; none for metrics of the train or the controller.
    pub estimator: Option<String>,
    /// Name of the metric, such as `mass_error_rel_max`.
    pub metric: String,
    /// Begin of the window, s; none = from the start.
    pub after_s: Option<NonNegative>,
    /// End of the window, s; none = to the end.
    pub until_s: Option<Positive>,
    /// Place or event at the begin of the window, instead of `after_s`.
    pub after: Option<Moment>,
    /// Place or event at the end of the window, instead of `until_s`.
    pub until: Option<Moment>,
    /// Upper bound, in the metric's unit.
    pub at_most: Option<Finite>,
    /// Lower bound, in the metric's unit.
    pub at_least: Option<Finite>,
    /// Over several seeds: the share of runs that must hold the bound; none = 0.6 (three of five, both of two) of an
    /// estimator, 1 (every run) of the train and the controller.
    pub quantile: Option<Fraction>,
    /// Over several seeds: the mean of the runs must hold the bound, and no single run; of ten runs or more.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mean: bool,
    /// Of an error of an estimator: the share of the same time in which the estimate must be marked valid; none = the
    /// scenario's.
    pub availability: Option<Fraction>,
}

impl Expectation {
    /// Window of the measurement in words, such as ` from 5 s` or ` from where the rear enters climb`; empty for the
    /// whole run.
    pub fn window(&self) -> String {
        let end = |word: &str, s: Option<f64>, moment: &Option<Moment>| match (s, moment) {
            (Some(s), _) => format!(" {word} {s} s"),
            (None, Some(moment)) => format!(" {word} {moment}"),
            (None, None) => String::new(),
        };
        let from = end("from", self.after_s.map(f64::from), &self.after);
        from + &end("to", self.until_s.map(f64::from), &self.until)
    }

    /// Share of the runs that must hold the bound.
    pub fn share_of_runs(&self) -> f64 {
        match (self.quantile, &self.estimator) {
            _ if self.mean => 1.0,
            (Some(share), _) => share.get(),
            (None, Some(_)) => 0.6,
            (None, None) => 1.0,
        }
    }

    /// True if the known failure belongs to this bound.
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

/// A bound that does not hold, for reasons of physics: shown as a known failure. It is an error once it is worse than
/// is known, and once ten runs or more all hold the bound.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KnownFailure {
    /// Place of its entry in the file; an entry may belong to several bounds.
    #[serde(skip)]
    pub entry: usize,
    /// The estimator of the bound.
    pub estimator: Option<String>,
    /// The metric of the bound.
    pub metric: String,
    /// The bound's `after_s`, if several bounds differ in it.
    pub(crate) after_s: Option<NonNegative>,
    /// The bound's `until_s`, if several bounds differ in it.
    pub(crate) until_s: Option<Positive>,
    /// The bound's `after`, if several bounds differ in it.
    pub(crate) after: Option<Moment>,
    /// The bound's `until`, if several bounds differ in it.
    pub(crate) until: Option<Moment>,
    /// Bound of the known failure: a value beyond it is worse than known.
    pub no_worse_than: Finite,
    /// Reason in the physics or in the method.
    pub why: String,
}

/// Bounds that cannot hold for one reason of physics: shown as known failures. They are an error once they are worse
/// than is known, and once ten runs or more all hold them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "KnownFailure")] // the name in the JSON schema
pub struct KnownFailureEntry {
    /// The estimator of the bound, or a list of them.
    #[serde(default)]
    pub(crate) estimator: Option<OneOrMore>,
    /// The metric of the bound, or a list of them: of each of the estimators.
    pub(crate) metric: OneOrMore,
    /// The bound's `after_s`, if several bounds differ in it.
    #[serde(default)]
    pub(crate) after_s: Option<NonNegative>,
    /// The bound's `until_s`, if several bounds differ in it.
    #[serde(default)]
    pub(crate) until_s: Option<Positive>,
    /// The bound's `after`, if several bounds differ in it.
    #[serde(default)]
    pub(crate) after: Option<Moment>,
    /// The bound's `until`, if several bounds differ in it.
    #[serde(default)]
    pub(crate) until: Option<Moment>,
    /// In the metric's unit: what is beyond this, by the rule of the bound, is worse than what is known, and fails.
    pub(crate) no_worse_than: Finite,
    /// Reason in the physics or in the method.
    pub(crate) why: String,
}

/// A name, or a list of names.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OneOrMore {
    /// A name.
    One(String),
    /// Names.
    More(Vec<String>),
}

impl OneOrMore {
    fn names(self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name],
            Self::More(names) => names,
        }
    }
}

impl KnownFailureEntry {
    /// One known failure for each estimator and metric in the entry.
    fn each(self, entry: usize) -> Vec<KnownFailure> {
        let estimators = match self.estimator {
            Some(names) => names.names().into_iter().map(Some).collect(),
            None => vec![None],
        };
        let metrics = self.metric.names();
        let pairs = estimators
            .iter()
            .flat_map(|estimator| metrics.iter().map(move |metric| (estimator, metric)));
        pairs
            .map(|(estimator, metric)| KnownFailure {
                entry,
                estimator: estimator.clone(),
                metric: metric.clone(),
                after_s: self.after_s,
                until_s: self.until_s,
                after: self.after.clone(),
                until: self.until.clone(),
                no_worse_than: self.no_worse_than,
                why: self.why.clone(),
            })
            .collect()
    }
}

/// Reads the entries of a file: one known failure for each named bound.
pub fn known_failures<'de, D: Deserializer<'de>>(file: D) -> Result<Vec<KnownFailure>, D::Error> {
    let entries = Vec::<KnownFailureEntry>::deserialize(file)?.into_iter();
    Ok(entries.enumerate().flat_map(|(i, e)| e.each(i)).collect())
}

/// Least shares of the time in which estimates are marked valid, for quantities whose error is bounded.
#[serde_with::skip_serializing_none]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Availability {
    /// Of the mass.
    pub mass: Option<Fraction>,
    /// Of the slope at the IMU.
    pub slope: Option<Fraction>,
    /// Of the effective slope of the whole vehicle.
    pub effective_slope: Option<Fraction>,
}
