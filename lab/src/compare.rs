//! Estimators against each other on the same runs: means with confidence intervals, paired differences, published figures.

use crate::study::RunResult;
use monorig_sim::scenario::Published;
use monorig_sim::sensors::stream::Stream;
use serde::Serialize;

/// A mean and the interval that holds it with a confidence of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// One metric of one estimator over all runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cell {
    /// Estimator.
    pub estimator: String,
    /// Metric.
    pub metric: String,
    /// Runs in which it could be measured.
    pub measured: usize,
    /// All runs.
    pub runs: usize,
    /// Mean over these; none with fewer than two.
    pub mean: Option<Interval>,
    /// Median over these.
    pub median: Option<f64>,
    /// Mean of estimator minus reference, run by run, over the runs in which both could be measured; none for the reference.
    pub difference: Option<Interval>,
    /// What was published for it.
    pub published: Option<Published>,
}

/// Resamples of a bootstrap.
const RESAMPLES: usize = 4000;

/// Every metric of every estimator over the runs, metrics outermost.
pub fn compare(
    runs: &[RunResult],
    estimators: &[String],
    metrics: &[String],
    reference: &str,
    published: &[Published],
) -> Vec<Cell> {
    let mut cells = Vec::new();
    for metric in metrics {
        let reference_values = column(runs, reference, metric);
        for estimator in estimators {
            let values = column(runs, estimator, metric);
            let measured: Vec<f64> = values.iter().flatten().copied().collect();
            let pairs = values.iter().zip(&reference_values);
            let differences: Vec<f64> = pairs.filter_map(|(a, b)| Some((*a)? - (*b)?)).collect();
            cells.push(Cell {
                estimator: estimator.clone(),
                metric: metric.clone(),
                measured: measured.len(),
                runs: runs.len(),
                mean: interval(&measured),
                median: median(&measured),
                difference: (estimator != reference)
                    .then(|| interval(&differences))
                    .flatten(),
                published: published
                    .iter()
                    .find(|p| p.estimator == *estimator && p.metric == *metric)
                    .cloned(),
            });
        }
    }
    cells
}

fn column(runs: &[RunResult], estimator: &str, metric: &str) -> Vec<Option<f64>> {
    let value = |run: &RunResult| {
        let summary = run.summary.as_ref().filter(|s| s.finished)?;
        summary.estimators.get(estimator)?.get(metric).copied()?
    };
    runs.iter().map(value).collect()
}

/// Mean with the percentile bootstrap's interval (Efron & Tibshirani 1993, chapter 13); its draws are the same every time.
pub fn interval(x: &[f64]) -> Option<Interval> {
    if x.len() < 2 {
        return None;
    }
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let mut stream = Stream::new(1, "bootstrap");
    let mut means: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let draw = |_| x.get((stream.uniform() * n) as usize).copied();
            (0..x.len()).filter_map(draw).sum::<f64>() / n
        })
        .collect();
    means.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| means.get((share * (RESAMPLES - 1) as f64).round() as usize);
    Some(Interval {
        mean,
        low: *at(0.025)?,
        high: *at(0.975)?,
    })
}

fn median(x: &[f64]) -> Option<f64> {
    let mut x = x.to_vec();
    x.sort_unstable_by(f64::total_cmp);
    let (low, high) = (x.get(x.len().checked_sub(1)? / 2)?, x.get(x.len() / 2)?);
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 400 samples of 30 normals each, the interval of about 95 % holds the true mean: the percentile bootstrap of 30 values
    /// is a little too narrow (about 93.5 %); the share has a standard error of 1.2 %.
    #[test]
    fn intervals_hold_the_true_mean_as_often_as_they_say() {
        let mut stream = Stream::new(5, "samples");
        let holds = (0..400).filter(|_| {
            let x: Vec<f64> = (0..30).map(|_| 3.0 + stream.normal()).collect();
            interval(&x).is_some_and(|i| i.low <= 3.0 && 3.0 <= i.high)
        });
        let share = holds.count() as f64 / 400.0;
        assert!((0.90..=0.98).contains(&share), "{share}");
    }

    #[test]
    fn medians() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
        assert_eq!(interval(&[1.0]), None);
    }
}
