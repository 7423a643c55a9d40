//! Numbers that say how good a run was.
//!
//! Errors are estimate minus truth; the slope's truth is the grade at the IMU. Only samples that the estimator marks valid
//! count, and `*_valid_share` says how many those were: a metric without a single valid sample is not a number, never zero.
//! `docs/src/metrics.md` has the same table, and a test sees to it.

mod of_estimator;
mod of_run;
pub mod series;
mod statistics;

use crate::metrics::of_estimator::{DEGREE, convergence, degrees, end, mass, settled, slope};
use crate::metrics::of_run::{energy, energy_per_metre, jerk};
use crate::metrics::series::{ErrorSample, ErrorSeries, Tracking};
use crate::metrics::statistics::{max, mean, percentile, rms, share, share_in_band};

/// A metric: its name, its unit, its definition, and which value is best.
pub struct Metric {
    /// Name, as in `expect`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// Which value is best.
    pub best: Best,
    value: MetricFunction,
}

/// How a metric is computed: from the samples of an estimator, or from those of train and controller.
enum MetricFunction {
    OfEstimator(fn(&[ErrorSample]) -> f64),
    OfRun(fn(&[Tracking]) -> f64),
}

/// Which value of a metric is best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    /// The least: errors, times, energies.
    Least,
    /// 1, and never more: a share.
    One,
    /// 1, neither less nor more: a normalised square.
    OneOnAverage,
    /// 0.95, neither less nor more: the share of samples in a 95 % band.
    InBand,
}

impl Best {
    /// Whether less is better; none where both less and more can be worse.
    pub fn less_is_better(self) -> Option<bool> {
        match self {
            Best::Least => Some(true),
            Best::One => Some(false),
            Best::OneOnAverage | Best::InBand => None,
        }
    }

    /// What an optimiser makes small: 0 at the best value.
    pub fn loss(self, x: f64) -> f64 {
        match self {
            Best::Least => x,
            Best::One => 1.0 - x,
            Best::OneOnAverage => x.ln().abs(),
            Best::InBand => (x - 0.95).abs(),
        }
    }
}

/// All metrics: those of an estimator, then those of train and controller.
pub const METRICS: &[Metric] = &[
    of_estimator(
        "mass_rmse_kg",
        "kg",
        Best::Least,
        "root mean square error of the total mass",
        |s| rms(mass(s).map(|x| x.mass_kg)),
    ),
    of_estimator(
        "mass_mae_kg",
        "kg",
        Best::Least,
        "mean absolute error of the total mass",
        |s| mean(mass(s).map(|x| x.mass_kg.abs())),
    ),
    of_estimator(
        "mass_error_max_kg",
        "kg",
        Best::Least,
        "largest error of the total mass",
        |s| max(mass(s).map(|x| x.mass_kg)),
    ),
    of_estimator(
        "mass_error_rel_max",
        "1",
        Best::Least,
        "largest error of the total mass over the total mass",
        |s| max(mass(s).map(|x| x.mass_rel)),
    ),
    of_estimator(
        "mass_error_rel_p95",
        "1",
        Best::Least,
        "95th percentile of the absolute error of the total mass over the total mass",
        |s| percentile(mass(s).map(|x| x.mass_rel.abs()), 0.95),
    ),
    of_estimator(
        "mass_error_converged_max_kg",
        "kg",
        Best::Least,
        "largest error of the total mass after convergence: from where it has first stayed within 2 % for 1 s",
        |s| max(mass(settled(s)).map(|x| x.mass_kg)),
    ),
    of_estimator(
        "mass_error_converged_rel_max",
        "1",
        Best::Least,
        "largest error of the total mass after convergence, over the total mass",
        |s| max(mass(settled(s)).map(|x| x.mass_rel)),
    ),
    of_estimator(
        "mass_error_rel_end",
        "1",
        Best::Least,
        "error of the total mass over the total mass, mean of the last second, absolute",
        end,
    ),
    of_estimator(
        "mass_convergence_s",
        "s",
        Best::Least,
        "time from which the mass error stays within 2 % to the end",
        convergence,
    ),
    of_estimator(
        "mass_nees_mean",
        "1",
        Best::OneOnAverage,
        "mean of (error / standard deviation)² of the mass; 1 when consistent",
        |s| mean(mass(s).map(|x| x.mass_nees)),
    ),
    of_estimator(
        "mass_nees_in_band",
        "1",
        Best::InBand,
        "share of samples with a NEES of the mass within the 95 % band of χ²₁ (below 3.84); 0.95 when consistent, more when cautious",
        |s| share_in_band(mass(s).map(|x| x.mass_nees)),
    ),
    of_estimator(
        "mass_valid_share",
        "1",
        Best::One,
        "share of samples whose mass the estimator marks valid",
        |s| share(s.iter().map(|x| x.mass_valid)),
    ),
    of_estimator(
        "slope_rmse_deg",
        "°",
        Best::Least,
        "root mean square error of the slope against the grade at the IMU",
        |s| rms(degrees(s)),
    ),
    of_estimator(
        "slope_mae_deg",
        "°",
        Best::Least,
        "mean absolute error of the slope",
        |s| mean(degrees(s).map(f64::abs)),
    ),
    of_estimator(
        "slope_error_max_deg",
        "°",
        Best::Least,
        "largest error of the slope",
        |s| max(degrees(s)),
    ),
    of_estimator(
        "slope_error_p95_deg",
        "°",
        Best::Least,
        "95th percentile of the absolute error of the slope",
        |s| percentile(degrees(s).map(f64::abs), 0.95),
    ),
    of_estimator(
        "slope_rmse_percent",
        "%",
        Best::Least,
        "root mean square error of the slope as roads state it, 100 tan θ",
        |s| rms(slope(s).map(|x| x.slope_percent)),
    ),
    of_estimator(
        "slope_error_max_percent",
        "%",
        Best::Least,
        "largest error of the slope as roads state it",
        |s| max(slope(s).map(|x| x.slope_percent)),
    ),
    of_estimator(
        "slope_effective_rmse_deg",
        "°",
        Best::Least,
        "root mean square error of the slope against the effective grade of the whole vehicle",
        |s| rms(slope(s).map(|x| x.slope_effective / DEGREE)),
    ),
    of_estimator(
        "slope_nees_mean",
        "1",
        Best::OneOnAverage,
        "mean of (error / standard deviation)² of the slope; 1 when consistent",
        |s| mean(slope(s).map(|x| x.slope_nees)),
    ),
    of_estimator(
        "slope_nees_in_band",
        "1",
        Best::InBand,
        "share of samples with a NEES of the slope within the 95 % band of χ²₁",
        |s| share_in_band(slope(s).map(|x| x.slope_nees)),
    ),
    of_estimator(
        "slope_valid_share",
        "1",
        Best::One,
        "share of samples whose slope the estimator marks valid",
        |s| share(s.iter().map(|x| x.slope_valid)),
    ),
    of_estimator(
        "running_resistance_rmse",
        "1",
        Best::Least,
        "root mean square error of the running-resistance coefficient, of estimators that identify it (internal `running_resistance`), also where they do not mark it valid",
        |s| rms(s.iter().map(|x| x.running_resistance)),
    ),
    of_estimator(
        "nis_mean",
        "1",
        Best::OneOnAverage,
        "mean normalised innovation squared; 1 when consistent",
        |s| mean(slope(s).map(|x| x.nis)),
    ),
    of_estimator(
        "nis_in_band",
        "1",
        Best::InBand,
        "share of samples with a NIS within the 95 % band of χ²₁; 0.95 when consistent",
        |s| share_in_band(slope(s).map(|x| x.nis)),
    ),
    of_run(
        "speed_rmse_mps",
        "m/s",
        Best::Least,
        "root mean square of speed minus reference",
        |s| rms(s.iter().map(|x| x.speed)),
    ),
    of_run(
        "accel_rms_mps2",
        "m/s²",
        Best::Least,
        "root mean square acceleration along the track: comfort",
        |s| rms(s.iter().map(|x| x.accel)),
    ),
    of_run(
        "jerk_rms_mps3",
        "m/s³",
        Best::Least,
        "root mean square change of the acceleration, both taken over steps of 0.1 s: comfort",
        jerk,
    ),
    of_run(
        "traction_energy_j",
        "J",
        Best::Least,
        "work that the wheels do on the vehicle while they drive it, ∫ max(F v, 0) dt; what braking gives back is not taken off",
        energy,
    ),
    of_run(
        "traction_energy_jpm",
        "J/m",
        Best::Least,
        "traction energy over the way gone, ∫ |v| dt",
        energy_per_metre,
    ),
    of_run(
        "off_rail_max_m",
        "m",
        Best::Least,
        "largest distance of a wheel from its place on the rail; of a car from the middle of its lane",
        |s| max(s.iter().map(|x| x.off_rail)),
    ),
];

const fn of_estimator(
    name: &'static str,
    unit: &'static str,
    best: Best,
    doc: &'static str,
    value: fn(&[ErrorSample]) -> f64,
) -> Metric {
    Metric {
        name,
        unit,
        doc,
        best,
        value: MetricFunction::OfEstimator(value),
    }
}

const fn of_run(
    name: &'static str,
    unit: &'static str,
    best: Best,
    doc: &'static str,
    value: fn(&[Tracking]) -> f64,
) -> Metric {
    Metric {
        name,
        unit,
        doc,
        best,
        value: MetricFunction::OfRun(value),
    }
}

impl Metric {
    /// Whether it is one of an estimator, not of train and controller.
    pub fn is_of_estimator(&self) -> bool {
        matches!(self.value, MetricFunction::OfEstimator(_))
    }
}

/// The metrics of an estimator.
pub fn estimator_metrics() -> impl Iterator<Item = &'static Metric> + Clone {
    METRICS.iter().filter(|m| m.is_of_estimator())
}

/// The metrics of train and controller.
pub fn run_metrics() -> impl Iterator<Item = &'static Metric> + Clone {
    METRICS.iter().filter(|m| !m.is_of_estimator())
}

/// The metric of this name, of either kind.
pub fn find(name: &str) -> Option<&'static Metric> {
    METRICS.iter().find(|m| m.name == name)
}

/// A metric of one estimator over the time from `after_s` to `until_s`; none if there is no such metric or estimator.
pub fn measure(
    series: &ErrorSeries,
    estimator: &str,
    metric: &str,
    after_s: f64,
    until_s: f64,
) -> Option<f64> {
    let (_, samples) = series
        .estimators
        .iter()
        .find(|(name, _)| name == estimator)?;
    let MetricFunction::OfEstimator(value) = find(metric)?.value else {
        return None;
    };
    let window = between(samples, |x: &ErrorSample| x.t_s, after_s, until_s);
    Some(value(window))
}

/// A metric of the train or the controller over the time from `after_s` to `until_s`; none if there is no such metric.
pub fn measure_run(series: &ErrorSeries, metric: &str, after_s: f64, until_s: f64) -> Option<f64> {
    let MetricFunction::OfRun(value) = find(metric)?.value else {
        return None;
    };
    let window = between(&series.tracking, |x: &Tracking| x.t_s, after_s, until_s);
    Some(value(window))
}

/// The unit of a metric of either kind; none if there is no such metric.
pub fn unit(metric: &str) -> Option<&'static str> {
    find(metric).map(|m| m.unit)
}

fn between<T>(samples: &[T], t_s: fn(&T) -> f64, after_s: f64, until_s: f64) -> &[T] {
    let from = samples.partition_point(|x| t_s(x) < after_s);
    let to = samples.partition_point(|x| t_s(x) <= until_s);
    samples.get(from..to).unwrap_or(&[])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page has a row for every metric, with its unit and its definition, and none besides.
    #[test]
    fn the_page_of_metrics_is_the_table() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/metrics.md");
        let page = std::fs::read_to_string(page).unwrap();
        let mut rows: Vec<String> = METRICS
            .iter()
            // a bar within a cell of Markdown's tables is written \|
            .map(|m| {
                format!(
                    "| `{}` | {} | {} |",
                    m.name,
                    m.unit,
                    m.doc.replace('|', "\\|")
                )
            })
            .collect();
        let mut there: Vec<&str> = page.lines().filter(|l| l.starts_with("| `")).collect();
        rows.sort();
        there.sort_unstable();
        assert_eq!(there, rows);
    }

    #[test]
    fn a_name_is_given_once() {
        for (i, m) in METRICS.iter().enumerate() {
            assert!(
                METRICS[..i].iter().all(|other| other.name != m.name),
                "{}",
                m.name
            );
        }
    }

    /// Nothing is lost at the best value, and something on each side of it that can be worse.
    #[test]
    fn the_best_value_has_no_loss() {
        for (best, at, worse) in [
            (Best::Least, 0.0, vec![0.5]),
            (Best::One, 1.0, vec![0.5]),
            (Best::OneOnAverage, 1.0, vec![0.5, 2.0]),
            (Best::InBand, 0.95, vec![0.5, 1.0]),
        ] {
            assert_eq!(best.loss(at), 0.0, "{best:?}");
            assert!(worse.into_iter().all(|x| best.loss(x) > 0.0), "{best:?}");
        }
        assert_eq!(Best::OneOnAverage.loss(4.0), Best::OneOnAverage.loss(0.25));
    }
}
