//! Metrics: the quality of a run in numbers.
//!
//! In the terms of navigation integrity: *accuracy* is the error of all samples of a window, `…_valid` that of the
//! samples that the estimator marks valid; *availability* the share of these; *integrity* the share of them that is
//! misleading; *continuity* how often validity is lost. Errors are estimate minus truth; the slope's truth is the
//! grade at the IMU, the effective slope's that of the whole vehicle. Of a recorded drive the truth is a reference,
//! which may be known for part of the time: errors and integrity count the samples that have one. A metric without a
//! sample to count is not a number, never zero. `docs/src/metrics.md` has the same table, and a test sees to it.

mod answers;
pub(crate) mod lagged;
mod marks;
mod of_estimator;
mod of_run;
mod pace;
mod percentile;
mod quantity;
pub mod series;
mod statistics;
mod table;
mod window;
mod windowed;

pub(crate) use marks::Marks;
pub(crate) use pace::Pace;
pub(crate) use quantity::Quantity;
pub(crate) use statistics::{Accumulator, Running};
pub use table::METRICS;
pub(crate) use window::{End, Window};
pub(crate) use windowed::{WantedMetric, WindowedMetrics};

use crate::metrics::series::{ErrorSample, ErrorSeries, Tracking};
use crate::metrics::window::Timed;
use monorig_sim::config::file::suggestion;
use monorig_sim::config::scenario::IntegrityLimits;

/// A metric: its name, its unit, its definition, and which value is best.
pub struct Metric {
    /// Name, as in `expect`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Description.
    pub doc: &'static str,
    /// The best value.
    pub best: Best,
    /// Subject.
    pub(crate) of: Of,
}

/// Subject of a metric, and the function that computes it.
pub(crate) enum Of {
    /// Accuracy or consistency: the error of a quantity.
    Error {
        /// The quantity.
        quantity: Quantity,
        /// True if only samples marked valid count.
        valid_only: bool,
        /// True if only samples that have a reference count; false for innovations, which need none.
        referenced: bool,
        /// Over the samples that count.
        start: fn() -> Running<ErrorSample>,
    },
    /// Availability, integrity or continuity: what the estimator's marks of a quantity are worth.
    Marks {
        /// The quantity.
        quantity: Quantity,
        /// Figure of the quality of marks.
        kind: Marks,
    },
    /// Another value of an estimator, from all samples.
    Estimator(fn() -> Running<ErrorSample>),
    /// Train and controller.
    Run(fn() -> Running<Tracking>),
}

/// The best value of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    /// The least: errors, times, energies.
    Least,
    /// 0, neither less nor more: a bias.
    Zero,
    /// 1, and never more: a share.
    One,
    /// 1, neither less nor more: a normalised square.
    OneOnAverage,
    /// 0.95, neither less nor more: the share of samples in a 95 % band.
    InBand,
}

impl Best {
    /// True if less is better. `None` where both less and more can be worse.
    pub fn less_is_better(self) -> Option<bool> {
        match self {
            Best::Least => Some(true),
            Best::One => Some(false),
            Best::Zero | Best::OneOnAverage | Best::InBand => None,
        }
    }

    /// The loss that an optimiser makes small: 0 at the best value.
    pub(crate) fn loss(self, x: f64) -> f64 {
        match self {
            Best::Least => x,
            Best::Zero => x.abs(),
            Best::One => 1.0 - x,
            Best::OneOnAverage => x.ln().abs(),
            Best::InBand => (x - 0.95).abs(),
        }
    }
}

/// End of the names of metrics over valid samples.
pub const VALID: &str = "_valid";

/// Metric with the mean reported standard deviation for this error, in its unit; `None` if the metric is not an error.
pub fn told_sd(metric: &str) -> Option<&'static str> {
    let is_error = ["_rmse", "_mae", "_error", "_bias", "_scatter"];
    let is_error = |m: &&Metric| {
        let named = is_error.iter().any(|part| m.name.contains(part));
        named && !m.name.contains("_over_bound")
    };
    let metric = find(metric).filter(is_error)?;
    Some(match (metric.error_of()?, metric.unit) {
        (Quantity::Mass, "kg") => "mass_sd_mean_kg",
        (Quantity::Mass, "1") => "mass_sd_rel_mean",
        (Quantity::Slope, "°") => "slope_sd_mean_deg",
        (Quantity::EffectiveSlope, "°") => "effective_slope_sd_mean_deg",
        _ => return None,
    })
}

impl Metric {
    /// True for a metric of an estimator, false for one of train and controller.
    pub(crate) fn is_of_estimator(&self) -> bool {
        !matches!(self.of, Of::Run(_))
    }

    /// Quantity of this error; `None` if the metric is not an error.
    pub(crate) fn error_of(&self) -> Option<Quantity> {
        match self.of {
            Of::Error { quantity, .. } => Some(quantity),
            _ => None,
        }
    }

    /// True if only samples with a reference count: an error, and not an innovation.
    pub(crate) fn needs_reference(&self) -> bool {
        matches!(
            self.of,
            Of::Error {
                referenced: true,
                ..
            }
        )
    }

    /// Quantity and kind of this quality of marks; `None` for any other metric.
    pub(crate) fn mark_of(&self) -> Option<(Quantity, Marks)> {
        match self.of {
            Of::Marks { quantity, kind } => Some((quantity, kind)),
            _ => None,
        }
    }

    /// True for a share of misleading samples.
    pub(crate) fn is_integrity(&self) -> bool {
        self.mark_of()
            .is_some_and(|(_, kind)| kind == Marks::Integrity)
    }

    /// True for a share: from 0 to 1.
    pub(crate) fn is_share(&self) -> bool {
        matches!(self.best, Best::One | Best::InBand)
            || matches!(
                self.of,
                Of::Marks {
                    kind: Marks::Integrity | Marks::Overconfidence | Marks::BeyondLimit,
                    ..
                }
            )
    }

    /// Upper bound that holds for every estimator: the range of the quantity. None where it has no end.
    pub(crate) fn range(&self) -> Option<f64> {
        match (self.error_of(), self.unit) {
            _ if self.is_share() => Some(1.0),
            // an estimator that says level is off by a right angle at most
            (Some(_), "°") => Some(90.0),
            // one that says nothing weighs anything is off by all of it
            (Some(Quantity::Mass), "1") if told_sd(self.name).is_some() => Some(1.0),
            (Some(Quantity::Mass), "kg") => Some(1e6),
            _ => None,
        }
    }

    /// True if only samples that the estimator marks valid count.
    pub(crate) fn is_of_valid(&self) -> bool {
        matches!(
            self.of,
            Of::Error {
                valid_only: true,
                ..
            }
        )
    }

    /// Begins to measure the metric for an estimator; the measurement itself chooses from the samples. None if it is of
    /// train and controller.
    pub(crate) fn of_estimator(&self, limits: &IntegrityLimits) -> Option<Running<ErrorSample>> {
        Some(match self.of {
            Of::Error {
                quantity,
                valid_only,
                referenced,
                start,
            } => Box::new(OfSome {
                quantity,
                valid_only,
                referenced,
                running: start(),
            }),
            Of::Estimator(start) => start(),
            Of::Marks { quantity, kind } => marks::start(kind, quantity, limits),
            Of::Run(_) => return None,
        })
    }

    /// Begins to measure the metric for train and controller; `None` for a metric of an estimator.
    pub(crate) fn of_run(&self) -> Option<Running<Tracking>> {
        match self.of {
            Of::Run(start) => Some(start()),
            _ => None,
        }
    }
}

/// Passes on only the samples that count: those with a reference of a quantity, and those in which it is marked valid.
struct OfSome {
    quantity: Quantity,
    valid_only: bool,
    referenced: bool,
    running: Running<ErrorSample>,
}

impl Accumulator<ErrorSample> for OfSome {
    fn add(&mut self, x: &ErrorSample) {
        self.add_all(std::slice::from_ref(x));
    }

    fn add_all(&mut self, xs: &[ErrorSample]) {
        let (quantity, valid_only, referenced) = (self.quantity, self.valid_only, self.referenced);
        let counts = |x: &ErrorSample| {
            (!valid_only || quantity.is_valid(x)) && (!referenced || quantity.has_reference(x))
        };
        // marks change rarely: what counts is handed on in a few pieces
        let pieces = xs.split(|x| !counts(x)).filter(|piece| !piece.is_empty());
        pieces.for_each(|piece| self.running.add_all(piece));
    }

    fn value(&self) -> f64 {
        self.running.value()
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

/// Name of the metric of this quality of the marks of a quantity.
pub(crate) fn mark(quantity: Quantity, kind: Marks) -> &'static str {
    let of = |m: &&Metric| m.mark_of() == Some((quantity, kind));
    METRICS.iter().find(of).map_or("", |m| m.name)
}

/// A metric of one estimator over the time from `after_s` to `until_s`; `None` for an unknown metric or estimator.
pub fn measure(
    series: &ErrorSeries,
    estimator: &str,
    metric: &str,
    after_s: f64,
    until_s: f64,
) -> Option<f64> {
    let samples = series.of(estimator)?;
    let running = find(metric)?.of_estimator(&series.limits)?;
    Some(over(samples, running, &Window::new(after_s, until_s)))
}

/// A metric of the train or the controller over the time from `after_s` to `until_s`; `None` for an unknown metric.
pub fn measure_run(series: &ErrorSeries, metric: &str, after_s: f64, until_s: f64) -> Option<f64> {
    let running = find(metric)?.of_run()?;
    let window = Window::new(after_s, until_s);
    Some(over(&series.tracking, running, &window))
}

/// Unit of a metric of either kind; `None` for an unknown metric.
pub fn unit(metric: &str) -> Option<&'static str> {
    find(metric).map(|m| m.unit)
}

/// Advice for a name that is not one of these metrics: the nearest of them, and their list.
pub fn advice(name: &str, known: &[&str]) -> String {
    suggestion(name, known.iter().copied(), "known metrics")
}

/// Name of the metric, with its unit if it has one.
pub fn with_unit(metric: &str) -> String {
    crate::text::with_unit(metric, unit(metric).unwrap_or("1"))
}

fn over<T: Timed>(samples: &[T], mut running: Running<T>, window: &Window) -> f64 {
    let inside = samples.iter().filter(|x| window.holds(x.t_s()));
    inside.for_each(|x| running.add(x));
    running.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition of a metric with `quantity` for mass, slope and effective slope: it is the same of all three.
    fn of_quantity(m: &Metric) -> String {
        ["effective slope", "slope", "mass"]
            .iter()
            .fold(m.doc.to_owned(), |doc, of| doc.replace(of, "quantity"))
    }

    /// Rows of the page: metrics of several quantities with the same definition share one.
    fn rows() -> Vec<String> {
        let mut rows: Vec<(Vec<&Metric>, String)> = Vec::new();
        // a metric of valid samples is another's name with `_valid` behind it, and has no row of its own
        for m in METRICS.iter().filter(|m| !m.is_of_valid()) {
            let template = of_quantity(m);
            match rows
                .iter_mut()
                .find(|(of, row)| *row == template && of[0].unit == m.unit)
            {
                Some((of, _)) => of.push(m),
                None => rows.push((vec![m], template)),
            }
        }
        let row = |(of, template): &(Vec<&Metric>, String)| {
            let names: Vec<String> = of.iter().map(|m| format!("`{}`", m.name)).collect();
            let doc = if of.len() == 1 { of[0].doc } else { template };
            // a bar within a cell of Markdown's tables is written \|
            let doc = doc.replace('|', "\\|");
            format!("| {} | {} | {doc} |", names.join(", "), of[0].unit)
        };
        rows.iter().map(row).collect()
    }

    /// The page has every metric, with its unit and its definition, and none besides.
    #[test]
    fn the_page_of_metrics_is_the_table() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/src/metrics.md");
        let page = std::fs::read_to_string(page).unwrap();
        let mut rows = rows();
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

    /// Every error is there twice: of all samples, and of those marked valid.
    #[test]
    fn every_error_has_its_twin_of_valid_samples() {
        for m in METRICS.iter().filter(|m| m.error_of().is_some()) {
            let base = m.name.strip_suffix(VALID);
            assert_eq!(base.is_some(), m.is_of_valid(), "{}", m.name);
            let twin = match base {
                Some(base) => find(base),
                None => find(&format!("{}{VALID}", m.name)),
            };
            let twin = twin.unwrap_or_else(|| panic!("{} has no twin", m.name));
            assert_eq!((twin.error_of(), twin.unit), (m.error_of(), m.unit));
        }
        for q in Quantity::ALL {
            assert!(
                [Marks::Availability, Marks::Integrity, Marks::Referenced]
                    .iter()
                    .all(|kind| mark(q, *kind).starts_with(q.name()))
            );
        }
    }

    /// Nothing is lost at the best value, and something on each side of it that can be worse.
    #[test]
    fn the_best_value_has_no_loss() {
        for (best, at, worse) in [
            (Best::Least, 0.0, vec![0.5]),
            (Best::Zero, 0.0, vec![-0.5, 0.5]),
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
