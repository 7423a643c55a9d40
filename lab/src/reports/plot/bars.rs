//! Histograms: how often values fall into classes, several kinds of values as outlines over each other.

use crate::reports::plot::axis::{Axis, common_range, without_outliers};
use crate::reports::plot::canvas;
use crate::reports::plot::{Figure, LegendEntry, Look, ValueGroup};

/// A histogram.
#[derive(Clone, Debug)]
pub struct Histogram {
    /// Title.
    pub title: String,
    /// The counted quantity with its unit.
    pub x: String,
    /// Values of each kind.
    pub groups: Vec<ValueGroup<f64>>,
}

const CLASSES: usize = 60;

impl Histogram {
    /// Draw it: the share of values per class. A few values may lie outside.
    pub fn figure(self) -> Figure {
        let each = self.groups.iter();
        let each = each.filter_map(|g| without_outliers(g.values.iter().copied(), 0.002, 0.1));
        let common = common_range(&each.collect::<Vec<_>>());
        let range = common.map(|c| c.0);
        let counted: Vec<_> = self
            .groups
            .iter()
            .filter_map(|g| Some((g.ink, outline(&g.values, range?))))
            .collect();
        let heights = counted.iter().flat_map(|g| g.1.iter().map(|p| p.1));
        let top = heights.fold(0.0, f64::max);
        let x = range.and_then(|(a, b)| {
            let axis = Axis::linear(&self.x).between(a, b);
            axis.fix([a, b].into_iter(), 0.0)
        });
        let y = Axis::linear("share of values, %").between(0.0, top * 1.06);
        let y = y.fix([0.0, top].into_iter().filter(|_| top > 0.0), 0.0);
        let svg = canvas::draw(x, y, |c| {
            for (ink, outline) in &counted {
                let area: Vec<_> = outline.iter().map(|p| (p.0, 0.0, p.1)).collect();
                c.steps(&area, *ink, 0.18);
                c.line(outline, *ink, 3, 1.0);
            }
        });
        Figure {
            svg,
            legend: LegendEntry::of_groups(&self.groups, Look::Line),
            title: self.title,
            note: match common {
                Some((_, true)) => "Values beyond the axis are counted and not drawn.".into(),
                _ => String::new(),
            },
        }
    }
}

/// The upper border of the bars, in percent.
fn outline(values: &[f64], (low, high): (f64, f64)) -> Vec<(f64, f64)> {
    let mut counts = [0u32; CLASSES];
    let mut n = 0u32;
    for x in values.iter().filter(|x| x.is_finite()) {
        n += 1;
        if (low..=high).contains(x) {
            let i = ((x - low) / (high - low) * CLASSES as f64) as usize;
            counts[i.min(CLASSES - 1)] += 1;
        }
    }
    let width = (high - low) / CLASSES as f64;
    let bars = counts.iter().enumerate();
    bars.flat_map(|(i, &count)| {
        let share = 100.0 * f64::from(count) / f64::from(n.max(1));
        let from = low + i as f64 * width;
        [(from, share), (from + width, share)]
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_everything() {
        let values: Vec<f64> = (0..1000).map(|i| (i % 50) as f64).collect();
        let outline = outline(&values, (-1.0, 51.0));
        let sum: f64 = outline.iter().step_by(2).map(|p| p.1).sum();
        assert!((sum - 100.0).abs() < 1e-9, "{sum}");
    }
}
