//! Box plots: median, quartiles, 5th and 95th percentile of several kinds of values side by side.

use crate::reports::plot::axis::{Axis, common_range};
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, LegendEntry, Look, ValueGroup};

/// Box plots.
#[derive(Clone, Debug)]
pub struct Boxes {
    /// Title.
    pub title: String,
    /// Axis of the values.
    pub y: Axis,
    /// Values of each kind.
    pub groups: Vec<ValueGroup<f64>>,
    /// Values to compare with, such as published ones: name, number of the group, value.
    pub references: Vec<(String, usize, f64)>,
    /// Bounds: number of the group, value. One that is so far off that it would flatten the boxes is not drawn.
    pub bounds: Vec<(usize, f64)>,
}

/// Largest number of values of a group that is shown as dots.
const FEW: usize = 200;
/// Largest bound that is drawn, as a multiple of the largest value.
const FARTHEST: f64 = 3.0;

impl Boxes {
    /// Makes boxes without references and bounds.
    pub(crate) fn new(
        title: impl Into<String>,
        y: Axis,
        groups: impl IntoIterator<Item = ValueGroup<f64>>,
    ) -> Self {
        Self {
            title: title.into(),
            y,
            groups: groups.into_iter().collect(),
            references: Vec::new(),
            bounds: Vec::new(),
        }
    }

    /// Draw them.
    pub fn figure(self) -> Figure {
        let sorted: Vec<Vec<f64>> = self
            .groups
            .iter()
            .map(|g| {
                let mut values: Vec<f64> =
                    g.values.iter().copied().filter(|x| x.is_finite()).collect();
                values.sort_unstable_by(f64::total_cmp);
                values
            })
            .collect();
        let few = |v: &[f64]| v.len() <= FEW;
        let shown = sorted.iter().flat_map(|v| {
            let (low, high) = if few(v) { (0.0, 1.0) } else { (0.05, 0.95) };
            [quantile(v, low), quantile(v, high)]
        });
        let reach = sorted
            .iter()
            .flatten()
            .fold(0.0, |a: f64, x| a.max(x.abs()));
        let near = |b: &&(usize, f64)| b.1.abs() <= FARTHEST * reach;
        let bounds: Vec<(usize, f64)> = self.bounds.iter().filter(near).copied().collect();
        let references = self.references.iter().map(|r| r.2);
        let references = references.chain(bounds.iter().map(|b| b.1));
        let each = sorted.iter().filter(|v| !v.is_empty());
        let each = each.map(|v| (quantile(v, 0.05), quantile(v, 0.95)));
        let common = common_range(&each.collect::<Vec<_>>()).filter(|c| c.1 && !self.y.is_log());
        let y = match common {
            Some(((low, high), _)) => {
                let (low, high) = references.fold((low, high), |(a, b), x| (a.min(x), b.max(x)));
                let room = 0.06 * (high - low);
                self.y
                    .clone()
                    .between(low - room, high + room)
                    .fix([low, high].into_iter(), 0.0)
            }
            None => self.y.fix(shown.chain(references), 0.06),
        };
        // names would overlap here: they stand in the legend
        let numbers = (1..=self.groups.len()).map(|i| i.to_string()).collect();
        let x = Axis::names("", numbers).fix([0.0].into_iter(), 0.0);
        let svg = canvas::draw(x, y, |c| {
            c.level(0.0, canvas::across(), Ink::Muted, 2);
            for (i, (group, values)) in self.groups.iter().zip(&sorted).enumerate() {
                let (at, ink) = (i as f64, group.ink);
                let q = [0.05, 0.25, 0.5, 0.75, 0.95].map(|p| quantile(values, p));
                if few(values) {
                    let n = values.len() as f64;
                    let place = |k: usize| at + 0.18 * ((k as f64 * 0.618).fract() - 0.5);
                    let dots: Vec<_> = (0..values.len()).map(|k| (place(k), values[k])).collect();
                    c.dots(&dots, ink, if n > 60.0 { 4 } else { 6 }, 0.45);
                }
                c.rectangle((at - 0.28, q[1]), (at + 0.28, q[3]), ink, 0.3);
                for (a, b) in [(q[0], q[1]), (q[3], q[4])] {
                    c.line(&[(at, a), (at, b)], ink, 3, 1.0);
                }
                for (y, half) in [(q[0], 0.12), (q[4], 0.12)] {
                    c.line(&[(at - half, y), (at + half, y)], ink, 3, 1.0);
                }
                c.line(&[(at - 0.28, q[2]), (at + 0.28, q[2])], ink, 7, 1.0);
            }
            for (group, bound) in &bounds {
                let at = *group as f64;
                c.line(
                    &[(at - 0.42, *bound), (at + 0.42, *bound)],
                    Ink::Bad,
                    4,
                    1.0,
                );
            }
            for (_, group, value) in &self.references {
                c.cross((*group as f64, *value), Ink::Text);
            }
        });
        let groups = self.groups.iter().enumerate();
        let groups = groups
            .map(|(i, g)| LegendEntry::new(format!("{} {}", i + 1, g.name), Look::Area(g.ink)));
        let bound = (!bounds.is_empty()).then(|| LegendEntry::new("bound", Look::Line(Ink::Bad)));
        let mut named: Vec<&str> = self.references.iter().map(|r| r.0.as_str()).collect();
        named.dedup();
        let references = named.into_iter();
        let references = references.map(|n| LegendEntry::new(n, Look::Cross(Ink::Text)));
        let keys = groups.chain(bound).chain(references);
        let note = match common {
            Some(_) => {
                "Thick line: median; box: quartiles; whiskers: 5 % and 95 %. They are cut at the end of the axis."
            }
            None => "Thick line: median; box: quartiles; whiskers: 5 % and 95 %.",
        };
        Figure::new(self.title, note, svg, keys)
    }
}

/// Quantile of sorted values, linear between neighbours (Hyndman and Fan 1996, definition 7).
pub(crate) fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let at = p * last as f64;
    let (i, share) = (at.floor() as usize, at.fract());
    let next = sorted[(i + 1).min(last)];
    sorted[i] + share * (next - sorted[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_is_drawn_where_it_does_not_flatten_the_values() {
        let with = |bounds: Vec<(usize, f64)>| Boxes {
            title: "t".into(),
            y: Axis::linear("y"),
            groups: vec![ValueGroup::new("a", Ink::Series(0), vec![1.0, 2.0, 3.0])],
            references: Vec::new(),
            bounds,
        };
        let lines = |bounds| {
            let figure = with(bounds).figure();
            (
                figure.svg.unwrap().matches("var(--bad)").count(),
                figure.legend.len(),
            )
        };
        assert_eq!(lines(vec![]), (0, 1));
        assert_eq!(lines(vec![(0, 4.0)]), (1, 2));
        assert_eq!(lines(vec![(0, 40.0)]), (0, 1));
    }

    #[test]
    fn quantiles() {
        let v = [1.0, 2.0, 3.0, 4.0];
        assert_eq!([0.0, 0.5, 1.0].map(|p| quantile(&v, p)), [1.0, 2.5, 4.0]);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
