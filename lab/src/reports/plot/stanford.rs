//! Stanford diagram: error against protection level, with the alert limit (Tossaint et al. 2007).

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, LegendEntry, Look};
use std::collections::BTreeSet;

/// Valid samples of one quantity of one estimator.
#[derive(Clone, Debug)]
pub(crate) struct Stanford {
    pub(crate) title: String,
    /// Unit of errors, such as `°`.
    pub(crate) unit: String,
    /// Protection level over reported standard deviation.
    pub(crate) k: f64,
    /// Alert limit.
    pub(crate) alert: f64,
    /// Colour of the points.
    pub(crate) ink: Ink,
    /// Absolute error and protection level of every valid sample.
    pub(crate) samples: Vec<(f64, f64)>,
}

/// Shares of the valid samples by region.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Regions {
    /// |error| ≤ protection level ≤ alert limit: as it should be.
    pub(crate) nominal: f64,
    /// |error| ≤ protection level, which is beyond the alert limit: too uncertain to use, and reported so.
    pub(crate) uncertain: f64,
    /// Protection level < |error| ≤ alert limit: more sure than right, and harmless.
    pub(crate) overconfident: f64,
    /// |error| beyond both: misleading.
    pub(crate) misleading: f64,
}

impl Regions {
    /// Counts samples (absolute error, protection level). All shares are NaN without a sample.
    pub(crate) fn of(samples: &[(f64, f64)], alert: f64) -> Self {
        let n = samples.len() as f64;
        let share = |holds: &dyn Fn(f64, f64) -> bool| {
            samples.iter().filter(|(e, p)| holds(*e, *p)).count() as f64 / n
        };
        Self {
            nominal: share(&|e, p| e <= p && p <= alert),
            uncertain: share(&|e, p| e <= p && p > alert),
            overconfident: share(&|e, p| e > p && e <= alert),
            misleading: share(&|e, p| e > p && e > alert),
        }
    }
}

/// Both axes reach over so many alert limits at least, and at most.
const REACH: (f64, f64) = (1.5, 20.0);

impl Stanford {
    /// Draw it.
    pub(crate) fn figure(self) -> Figure {
        let finite: Vec<(f64, f64)> = self
            .samples
            .iter()
            .copied()
            .filter(|(e, p)| e.is_finite() && p.is_finite())
            .collect();
        if finite.is_empty() {
            return Figure::empty(self.title);
        }
        let largest = finite.iter().fold(0.0, |m: f64, (e, p)| m.max(*e).max(*p));
        let end = (1.05 * largest).clamp(REACH.0 * self.alert, REACH.1 * self.alert);
        let axis = |title: String| Axis::linear(title).between(0.0, end);
        let x = axis(format!("|error|, {}", self.unit)).fix([0.0, end].into_iter(), 0.0);
        let y = axis(format!("protection level {} σ, {}", self.k, self.unit))
            .fix([0.0, end].into_iter(), 0.0);
        let a = self.alert;
        let inside = finite.iter().map(|(e, p)| (e.min(end), p.min(end)));
        let inside = one_a_cell(inside, end);
        let radius = if inside.len() > 200 { 4 } else { 7 };
        let svg = canvas::draw(x, y, |c| {
            // below the diagonal and beyond the alert limit
            c.band(&[(a, 0.0, a), (end, 0.0, end)], Ink::Bad, 0.14);
            c.dots(&inside, self.ink, radius, 0.6);
            c.line(&[(0.0, 0.0), (end, end)], Ink::Text, 3, 0.8);
            c.line(&[(a, 0.0), (a, a)], Ink::Bad, 4, 1.0);
            c.line(&[(0.0, a), (a, a)], Ink::Muted, 3, 1.0);
            c.line(&[(a, a), (a, end)], Ink::Muted, 3, 0.4);
        });
        let r = Regions::of(&finite, a);
        let percent = |x: f64| match 100.0 * x {
            p if p > 0.0 && p < 0.1 => "< 0.1 %".to_owned(),
            p => format!("{p:.1} %"),
        };
        Figure {
            svg,
            legend: vec![
                LegendEntry::new("valid samples", Look::Dot(self.ink)),
                LegendEntry::new("|error| = protection level", Look::Line(Ink::Text)),
                LegendEntry::new(
                    format!("alert limit {a:.3} {}", self.unit),
                    Look::Line(Ink::Bad),
                ),
                LegendEntry::new("misleading", Look::Area(Ink::Bad)),
            ],
            title: self.title,
            note: format!(
                "Of the valid samples {} are right and sure enough to use; {} are within their {} σ, which is wider than the alert limit; {} \
                 are less than the alert limit off and more sure than right; {} mislead.",
                percent(r.nominal),
                percent(r.uncertain),
                self.k,
                percent(r.overconfident),
                percent(r.misleading)
            ),
        }
    }
}

/// Cells along each axis of which one sample is drawn: a dot is as large.
const CELLS: f64 = 200.0;

/// The first sample of every cell: many samples are close to each other.
fn one_a_cell(samples: impl Iterator<Item = (f64, f64)>, end: f64) -> Vec<(f64, f64)> {
    let mut taken = BTreeSet::new();
    let cell = |x: f64| (CELLS * x / end) as u32;
    let mut kept: Vec<(f64, f64)> = samples.collect();
    kept.retain(|(e, p)| taken.insert((cell(*e), cell(*p))));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_in_one_region() {
        let samples = [(0.5, 0.8), (0.5, 2.0), (0.9, 0.1), (2.0, 1.5), (2.0, 0.1)];
        let r = Regions::of(&samples, 1.0);
        assert_eq!(
            r,
            Regions {
                nominal: 0.2,
                uncertain: 0.2,
                overconfident: 0.2,
                misleading: 0.4,
            }
        );
        assert!(Regions::of(&[], 1.0).nominal.is_nan());
    }
}
