//! The matrix: what every estimator comes to under every condition, over all scenarios and seeds.

use crate::metrics::Quantity;
use crate::stress::stress_run::metrics;
use crate::stress::{Classes, Group, NOMINAL, StressRun};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// A row of the matrix: a condition, or none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionRow {
    /// Name.
    pub condition: String,
    /// Part of the drive that the condition changes; none for the nominal row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<Group>,
    /// The condition in a line.
    pub words: String,
    /// Classes for the summary of results.
    #[serde(default, skip_serializing_if = "Classes::is_empty")]
    pub classes: Classes,
    /// Time after the last change, s.
    pub over_s: f64,
}

/// Figures of a quantity, over valid samples from 5 s on; misleading samples count from the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Root mean square error: a share of the mass, or degrees; none where nothing is valid.
    pub error: Option<f64>,
    /// Mean reported standard deviation, in the same unit.
    pub sd: Option<f64>,
    /// Share of samples that are marked valid.
    pub valid: Option<f64>,
    /// Share of the valid samples that misleads.
    pub misleading: Option<f64>,
    /// Share of the valid samples beyond the protection level.
    pub overconfident: Option<f64>,
    /// Share of the valid samples beyond the alert limit, for any standard deviation.
    #[serde(default)]
    pub beyond: Option<f64>,
    /// Time from the end of the condition's events until the estimate stays valid and within the alert limit, s: the
    /// longest of all runs; none where one of them never comes there.
    pub recovery_s: Option<f64>,
}

/// A cell: an estimator under a condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatrixCell {
    /// Condition.
    pub condition: String,
    /// Estimator.
    pub estimator: String,
    /// Number of runs that finished.
    pub runs: usize,
    /// Number of runs that did not finish.
    pub broken: usize,
    /// Number of runs in which the condition changed the inputs of the estimators.
    pub changed: usize,
    /// Mass.
    pub mass: Figures,
    /// Slope.
    pub slope: Figures,
    /// Effective slope.
    pub effective_slope: Figures,
}

impl MatrixCell {
    /// Mass, slope and effective slope.
    pub fn quantities(&self) -> [&Figures; 3] {
        [&self.mass, &self.slope, &self.effective_slope]
    }

    /// Largest value of a figure over the three quantities; `None` if it could not be measured.
    pub fn largest(&self, of: impl Fn(&Figures) -> Option<f64>) -> Option<f64> {
        let all = self.quantities().into_iter().filter_map(of);
        all.reduce(f64::max)
    }

    /// Largest share of misleading samples among the valid samples of a quantity; `None` if no sample is valid.
    pub fn misled(&self) -> Option<f64> {
        self.largest(|f| f.misleading)
    }

    /// Least share of valid samples over the three quantities.
    pub fn least_valid(&self) -> Option<f64> {
        let all = self.quantities().into_iter().filter_map(|f| f.valid);
        all.reduce(f64::min)
    }

    /// Time until all quantities have recovered, s; `None` if one never recovers.
    pub fn recovery_s(&self) -> Option<f64> {
        let all: Option<Vec<f64>> = self.quantities().iter().map(|f| f.recovery_s).collect();
        all?.into_iter().reduce(f64::max)
    }

    /// Makes the cell of an estimator over these rows together; `runs` also has the runs of other rows.
    pub(crate) fn over(
        name: &str,
        rows: &[ConditionRow],
        estimator: &str,
        runs: &[StressRun],
    ) -> Self {
        let over_s: BTreeMap<&str, f64> = rows
            .iter()
            .map(|r| (r.condition.as_str(), r.over_s))
            .collect();
        let here = || runs.iter().filter(|r| over_s.contains_key(&*r.condition));
        let whole = here().filter(|r| r.error.is_none());
        let whole: Vec<(&StressRun, f64)> = whole.map(|r| (r, over_s[&*r.condition])).collect();
        let nominal = |r: &StressRun| {
            let same = |n: &&StressRun| {
                n.condition == NOMINAL && (&n.scenario, n.seed) == (&r.scenario, r.seed)
            };
            runs.iter().find(same).map(|n| n.given.clone())
        };
        let changed = whole
            .iter()
            .filter(|(r, _)| nominal(r).is_some_and(|n| n != r.given));
        let [mass, slope, effective_slope] =
            Quantity::ALL.map(|quantity| figures(estimator, &metrics(quantity), &whole));
        Self {
            condition: name.to_owned(),
            estimator: estimator.to_owned(),
            runs: whole.len(),
            broken: here().count() - whole.len(),
            changed: changed.count(),
            mass,
            slope,
            effective_slope,
        }
    }

    /// True if no more than this share of the valid samples of a quantity misleads.
    pub fn is_good(&self, most: f64) -> bool {
        self.broken == 0 && self.misled().unwrap_or(0.0) <= most
    }
}

/// The matrix, worst cells first.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    /// Cells.
    pub cells: Vec<MatrixCell>,
}

impl Matrix {
    /// Makes a cell of each row and estimator from the runs. The nominal cells come first; the others follow by their
    /// misleading share, then by their overconfident share, then by the valid share that the condition costs.
    pub fn of(rows: &[ConditionRow], estimators: &[String], runs: &[StressRun]) -> Self {
        let of = |row: &ConditionRow, estimator: &String| {
            MatrixCell::over(&row.condition, std::slice::from_ref(row), estimator, runs)
        };
        let mut cells: Vec<MatrixCell> = rows
            .iter()
            .flat_map(|row| estimators.iter().map(move |e| of(row, e)))
            .collect();
        let nominal: Vec<MatrixCell> = cells
            .iter()
            .filter(|c| c.condition == NOMINAL)
            .cloned()
            .collect();
        let lost = |c: &MatrixCell| {
            let nominal = nominal.iter().find(|n| n.estimator == c.estimator);
            let pairs = nominal.into_iter().flat_map(|n| {
                n.quantities()
                    .map(|f| f.valid)
                    .into_iter()
                    .zip(c.quantities().map(|f| f.valid))
            });
            let lost = pairs.map(|(n, c)| n.unwrap_or(0.0) - c.unwrap_or(0.0));
            lost.fold(0.0, f64::max)
        };
        let worse = |a: &MatrixCell, b: &MatrixCell| -> Ordering {
            let nominal = (b.condition == NOMINAL).cmp(&(a.condition == NOMINAL));
            let of = |f: fn(&Figures) -> Option<f64>| {
                let [a, b] = [a, b].map(|c| c.largest(f).unwrap_or(0.0));
                b.total_cmp(&a)
            };
            nominal
                .then(b.broken.cmp(&a.broken))
                .then(of(|f| f.misleading))
                .then(of(|f| f.overconfident))
                .then(lost(b).total_cmp(&lost(a)))
        };
        cells.sort_by(worse);
        Self { cells }
    }
}

/// Figures over runs, each with the time after its last change. Those over valid samples are weighted with the valid
/// share: over samples if the runs are equally long.
fn figures(estimator: &str, metrics: &[String; 7], runs: &[(&StressRun, f64)]) -> Figures {
    let [
        error,
        sd,
        valid,
        misleading,
        overconfident,
        beyond,
        recovered,
    ] = metrics
        .each_ref()
        .map(|metric| move |r: &StressRun| r.figure(estimator, metric));
    let over_valid = |of: &dyn Fn(&StressRun) -> Option<f64>| {
        let values = runs.iter().filter_map(|(r, _)| Some((valid(r)?, of(r)?)));
        let (weight, sum) =
            values.fold((0.0, 0.0), |(w, s), (valid, x)| (w + valid, s + valid * x));
        (weight > 0.0).then(|| sum / weight)
    };
    let shares: Vec<f64> = runs.iter().filter_map(|(r, _)| valid(r)).collect();
    let recovery = runs
        .iter()
        .map(|(r, over_s)| Some((recovered(r)? - over_s).max(0.0)));
    let longest = recovery.collect::<Option<Vec<f64>>>();
    Figures {
        error: over_valid(&|r| error(r).map(|x| x * x)).map(f64::sqrt),
        sd: over_valid(&sd),
        valid: (!shares.is_empty()).then(|| shares.iter().sum::<f64>() / shares.len() as f64),
        misleading: over_valid(&misleading),
        overconfident: over_valid(&overconfident),
        beyond: over_valid(&beyond),
        recovery_s: longest.and_then(|all| all.into_iter().reduce(f64::max)),
    }
}
