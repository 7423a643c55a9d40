//! Box plots: median, quartiles, 5th and 95th percentile of several kinds of values side by side.

use crate::reports::plot::axis::{Axis, common_range, with_asides};
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
    /// Values of each kind; the axis follows those that are not aside, if there are any.
    pub groups: Vec<ValueGroup<f64>>,
    /// Values to compare with, such as published ones: name, number of the group, value.
    pub references: Vec<(String, usize, f64)>,
    /// Bounds: number of the group, value. One that is so far off that it would flatten the boxes is not drawn.
    pub bounds: Vec<(usize, f64)>,
}

/// Largest number of values of a group that is shown as dots.
const FEW: usize = 200;
/// Note on values beyond the axis.
const BEYOND: &str = " ▲▼ at the edge: values continue beyond the axis.";
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
        let ends = |v: &[f64]| {
            let low = if few(v) { 0.0 } else { 0.05 };
            (quantile(v, low), quantile(v, 1.0 - low))
        };
        let all_aside = self.groups.iter().all(|g| g.aside);
        let kinds = sorted.iter().zip(&self.groups);
        let kinds = kinds.filter(|(v, _)| !v.is_empty());
        let (main, asides): (Vec<_>, Vec<_>) = kinds.partition(|(_, g)| all_aside || !g.aside);
        let reach = main.iter().flat_map(|(v, _)| v.iter());
        let reach = reach.fold(0.0, |a: f64, x| a.max(x.abs()));
        let near = |b: &&(usize, f64)| b.1.abs() <= FARTHEST * reach;
        let bounds: Vec<(usize, f64)> = self.bounds.iter().filter(near).copied().collect();
        let references = self.references.iter().map(|r| r.2);
        let references = references.chain(bounds.iter().map(|b| b.1));
        let flat = |all: Vec<(f64, f64)>| all.into_iter().flat_map(|r| [r.0, r.1]);
        let usual = main.iter().map(|(v, _)| v);
        let usual = usual.map(|v| (quantile(v, 0.05), quantile(v, 0.95)));
        let shown = match common_range(&usual.collect::<Vec<_>>()) {
            Some((range, true)) => vec![range],
            _ => main.iter().map(|(v, _)| ends(v)).collect(),
        };
        let asides = asides.iter().map(|(v, _)| ends(v)).collect();
        let shown = with_asides(flat(shown), flat(asides));
        let y = self.y.fix(shown.into_iter().chain(references), 0.06);
        let is_out = |v: &[f64]| {
            let (low, high) = ends(v);
            y.as_ref().is_some_and(|y| low < y.low || high > y.high)
        };
        let cut = sorted.iter().any(|v| is_out(v));
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
                for (y, half, width) in [(q[0], 0.12, 3), (q[4], 0.12, 3), (q[2], 0.28, 7)] {
                    c.level(y, (at - half, at + half), ink, width);
                }
                let (low, high) = ends(values);
                c.beyond(&[(at, low), (at, high)], ink);
            }
            for (group, bound) in &bounds {
                let at = *group as f64;
                c.level(*bound, (at - 0.42, at + 0.42), Ink::Bad, 4);
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
        let beyond = if cut { BEYOND } else { "" };
        let note = format!("Thick line: median; box: quartiles; whiskers: 5 % and 95 %.{beyond}");
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
    fn values_that_are_not_judged_do_not_set_the_axis_and_are_marked() {
        let figure = |aside: bool| {
            let judged = ValueGroup::new("a", Ink::Series(0), vec![1.0, 2.0, 3.0]);
            let other = ValueGroup::new("b", Ink::Series(1), vec![9.0, 10.0, 11.0]).aside(aside);
            Boxes::new("t", Axis::linear("y"), [judged, other]).figure()
        };
        let (all, judged) = (figure(false), figure(true));
        assert!(!all.note.contains('▲') && judged.note.contains('▲'));
        let has = |figure: &Figure, label: &str| figure.svg.as_ref().unwrap().contains(label);
        assert!(has(&all, ">\n10\n<") && !has(&judged, ">\n10\n<"));
    }

    #[test]
    fn quantiles() {
        let v = [1.0, 2.0, 3.0, 4.0];
        assert_eq!([0.0, 0.5, 1.0].map(|p| quantile(&v, p)), [1.0, 2.5, 4.0]);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
