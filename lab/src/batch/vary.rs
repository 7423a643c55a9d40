//! Values that are drawn for each run.
//!
//! A variable is drawn from a stream of its own, made from the seed of the run and the variable's path: adding
//! another one, or changing their order, leaves the draws of this one as they were.

use monorig_sim::config::checked::{Finite, Positive};
use monorig_sim::sensors::stream::Stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A value drawn for each run; exactly one of the distributions.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Vary {
    /// Varied value: a path as in `--set`, such as `load.mass_kg` or `track.vertical[1].to_grade_deg`.
    pub(crate) path: String,
    /// Paths that get the same draw.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) also: Vec<String>,
    /// Evenly from the first to the second number.
    pub(crate) uniform: Option<[Finite; 2]>,
    /// Normal.
    pub(crate) normal: Option<Normal>,
    /// Lognormal.
    pub(crate) lognormal: Option<Lognormal>,
    /// One of these values, with equal probability.
    pub(crate) choice: Option<Vec<Value>>,
}

/// A normal distribution.
#[serde_with::skip_serializing_none]
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Normal {
    /// Mean.
    pub(crate) mean: Finite,
    /// Standard deviation.
    pub(crate) sd: Positive,
    /// Lower limit: a smaller draw is repeated.
    pub(crate) min: Option<Finite>,
    /// Upper limit: a larger draw is repeated.
    pub(crate) max: Option<Finite>,
}

/// A lognormal distribution: the logarithm is normal.
#[serde_with::skip_serializing_none]
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Lognormal {
    /// Median.
    pub(crate) median: Positive,
    /// Standard deviation of the natural logarithm.
    pub(crate) sd_of_log: Positive,
    /// Lower limit: a smaller draw is repeated.
    pub(crate) min: Option<Positive>,
    /// Upper limit: a larger draw is repeated.
    pub(crate) max: Option<Positive>,
}

/// Limits must leave room within this number of standard deviations of the middle, else the draw would repeat for ever.
const REACH: f64 = 3.0;

impl Vary {
    /// All paths that get the draw.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &String> {
        std::iter::once(&self.path).chain(&self.also)
    }

    /// Checks it. The error holds what is wrong, and what would be right.
    pub(super) fn check(&self) -> Result<(), (String, &'static str)> {
        let given = [
            self.uniform.is_some(),
            self.normal.is_some(),
            self.lognormal.is_some(),
            self.choice.is_some(),
        ];
        if given.iter().filter(|g| **g).count() != 1 {
            return Err((
                "a variable has exactly one distribution".into(),
                "one of `uniform: [1, 2]`, `normal: {mean: 0, sd: 1}`, `lognormal: {median: 1, sd_of_log: 0.2}`, `choice: [1, 2]`",
            ));
        }
        if let Some([low, high]) = self.uniform
            && high <= low
        {
            return Err((
                format!("no value lies between {} and {}", low.get(), high.get()),
                "write the smaller number first",
            ));
        }
        if self.choice.as_ref().is_some_and(Vec::is_empty) {
            return Err((
                "this choice has no values".into(),
                "give at least one value",
            ));
        }
        if let Some((middle, sd, min, max)) = self.bell() {
            let low = min.max(middle - REACH * sd);
            let high = max.min(middle + REACH * sd);
            if high - low < 0.01 * sd {
                return Err((
                    "almost no draw lies within these limits".into(),
                    "use `min` below `max`, with a part of the middle (3 standard deviations) between them",
                ));
            }
        }
        Ok(())
    }

    /// Middle, standard deviation and limits of the normal distribution behind it, if there is one.
    fn bell(&self) -> Option<(f64, f64, f64, f64)> {
        let (least, most) = (f64::NEG_INFINITY, f64::INFINITY);
        if let Some(n) = self.normal {
            let (min, max) = (
                n.min.map_or(least, f64::from),
                n.max.map_or(most, f64::from),
            );
            return Some((n.mean.get(), n.sd.get(), min, max));
        }
        let l = self.lognormal?;
        let log = |x: Positive| x.get().ln();
        let (min, max) = (l.min.map_or(least, log), l.max.map_or(most, log));
        Some((log(l.median), l.sd_of_log.get(), min, max))
    }

    /// The value for the run with this seed.
    pub(crate) fn draw(&self, seed: u64) -> Value {
        let mut stream = Stream::new(seed, &format!("vary/{}", self.path));
        if let Some([low, high]) = self.uniform {
            return number(low.get() + (high.get() - low.get()) * stream.uniform());
        }
        if let Some(values) = &self.choice {
            let place = (stream.uniform() * values.len() as f64) as usize;
            return values.get(place).cloned().unwrap_or_default();
        }
        let Some((middle, sd, min, max)) = self.bell() else {
            return Value::Null;
        };
        let drawn = loop {
            let x = middle + sd * stream.normal();
            if (min..=max).contains(&x) {
                break x;
            }
        };
        match self.lognormal {
            Some(_) => number(drawn.exp()),
            None => number(drawn),
        }
    }
}

fn number(x: f64) -> Value {
    serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vary(json: Value) -> Vary {
        serde_json::from_value(json).unwrap()
    }

    fn draws(v: &Vary, n: u64) -> Vec<f64> {
        (0..n).map(|seed| v.draw(seed).as_f64().unwrap()).collect()
    }

    fn moments(x: &[f64]) -> (f64, f64) {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let var = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        (mean, var.sqrt())
    }

    /// Means and spreads over seeds in a row, within 5 standard errors.
    #[test]
    fn draws_follow_their_distributions() {
        let n = 20_000;
        let error = 5.0 / f64::sqrt(n as f64);
        let uniform = draws(
            &vary(serde_json::json!({"path": "a", "uniform": [2, 4]})),
            n,
        );
        let (mean, sd) = moments(&uniform);
        assert!((mean - 3.0).abs() < error && (sd - 1.0 / 3f64.sqrt()).abs() < error);
        let normal = vary(serde_json::json!({"path": "a", "normal": {"mean": 5, "sd": 1}}));
        let (mean, sd) = moments(&draws(&normal, n));
        assert!((mean - 5.0).abs() < error && (sd - 1.0).abs() < error);
        let log =
            vary(serde_json::json!({"path": "a", "lognormal": {"median": 2, "sd_of_log": 1}}));
        let logs: Vec<f64> = draws(&log, n).iter().map(|x| x.ln()).collect();
        let (mean, sd) = moments(&logs);
        assert!((mean - 2f64.ln()).abs() < error && (sd - 1.0).abs() < error);
        let choice = vary(serde_json::json!({"path": "a", "choice": [0, 1]}));
        assert!((moments(&draws(&choice, n)).0 - 0.5).abs() < error);
    }

    #[test]
    fn limits_hold() {
        let v = vary(
            serde_json::json!({"path": "a", "normal": {"mean": 0, "sd": 1, "min": 0.5, "max": 0.7}}),
        );
        v.check().unwrap();
        assert!(draws(&v, 500).iter().all(|x| (0.5..=0.7).contains(x)));
    }

    #[test]
    fn other_variables_change_nothing_and_are_something_else() {
        let a = vary(serde_json::json!({"path": "a", "uniform": [0, 1]}));
        let b = vary(serde_json::json!({"path": "b", "uniform": [0, 1]}));
        assert_eq!(a.draw(7), a.draw(7));
        let products = draws(&a, 10_000).into_iter().zip(draws(&b, 10_000));
        let r: f64 = products.map(|(x, y)| (x - 0.5) * (y - 0.5)).sum::<f64>() / 10_000.0 * 12.0;
        assert!(r.abs() < 0.05, "correlation {r}");
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        for bad in [
            serde_json::json!({"path": "a"}),
            serde_json::json!({"path": "a", "uniform": [0, 1], "choice": [1]}),
            serde_json::json!({"path": "a", "uniform": [1, 1]}),
            serde_json::json!({"path": "a", "choice": []}),
            serde_json::json!({"path": "a", "normal": {"mean": 0, "sd": 1, "min": 2, "max": 1}}),
            serde_json::json!({"path": "a", "normal": {"mean": 0, "sd": 1, "min": 9}}),
            serde_json::json!({"path": "a", "lognormal": {"median": 1, "sd_of_log": 0.1, "min": 9}}),
        ] {
            assert!(vary(bad.clone()).check().is_err(), "{bad}");
        }
    }
}
