//! A score over two parameters, as colour.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, LegendEntry, Look};

/// A map. Cells are centred on the values of both parameters, which grow.
#[derive(Clone, Debug)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Name of the score with unit.
    pub score: String,
    /// Axis of the first parameter.
    pub x: Axis,
    /// Axis of the second parameter.
    pub y: Axis,
    /// Values of the first parameter.
    pub xs: Vec<f64>,
    /// Values of the second.
    pub ys: Vec<f64>,
    /// Scores, `scores[i][j]` at `xs[i]`, `ys[j]`; not finite = failed, left blank.
    pub scores: Vec<Vec<f64>>,
    /// Points to mark: name and place. The first is the winner.
    pub marks: Vec<(String, (f64, f64))>,
}

impl HeatMap {
    /// Draw it. The scale ends at the 90 % quantile, so that the valley around the best shows.
    pub fn figure(self) -> Figure {
        let mut all: Vec<f64> = self.scores.iter().flatten().copied().collect();
        all.retain(|s| s.is_finite());
        all.sort_unstable_by(f64::total_cmp);
        let (Some(&best), Some(&high)) = (all.first(), all.get(all.len() * 9 / 10)) else {
            return Figure::empty(self.title);
        };
        let (x_edges, y_edges) = (edges(&self.xs, &self.x), edges(&self.ys, &self.y));
        let ends = |axis: &Axis, edges: &[f64]| match (edges.first(), edges.last()) {
            (Some(&a), Some(&b)) if axis.range.is_none() => axis.clone().between(a, b),
            _ => axis.clone(),
        };
        let x = ends(&self.x, &x_edges).fix(x_edges.iter().copied(), 0.0);
        let y = ends(&self.y, &y_edges).fix(y_edges.iter().copied(), 0.0);
        let svg = canvas::draw(x, y, |c| {
            for (xs, column) in x_edges.windows(2).zip(&self.scores) {
                for (ys, score) in y_edges.windows(2).zip(column) {
                    if score.is_finite() {
                        let ink = Ink::value(*score, best, high);
                        c.rectangle((xs[0], ys[0]), (xs[1], ys[1]), ink, 1.0);
                    }
                }
            }
            for (i, (_, at)) in self.marks.iter().enumerate() {
                c.cross(*at, Ink::series(i + 1));
            }
        });
        let marks = self.marks.iter().enumerate();
        let marks = marks.map(|(i, m)| LegendEntry::new(&m.0, Look::Cross(Ink::series(i + 1))));
        let scale = LegendEntry::new(&self.score, Look::Scale(best, high));
        let keys = std::iter::once(scale).chain(marks);
        Figure::new(self.title, "", svg, keys)
    }
}

/// Borders of cells around values: half way between neighbours, on the axis' scale.
fn edges(values: &[f64], axis: &Axis) -> Vec<f64> {
    let half_way = |a: f64, b: f64| {
        if axis.is_log() {
            (a * b).sqrt()
        } else {
            0.5 * (a + b)
        }
    };
    let beyond = |edge: f64, value: f64| {
        if axis.is_log() {
            value * value / edge
        } else {
            2.0 * value - edge
        }
    };
    let inner: Vec<f64> = values.windows(2).map(|w| half_way(w[0], w[1])).collect();
    match (values, inner.first(), inner.last()) {
        ([first, .., last], Some(&a), Some(&b)) => std::iter::once(beyond(a, *first))
            .chain(inner.iter().copied())
            .chain(std::iter::once(beyond(b, *last)))
            .collect(),
        ([one], ..) if axis.is_log() => vec![one / 2.0, one * 2.0],
        ([one], ..) => vec![one - 0.5, one + 0.5],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_meet_half_way() {
        let (linear, log) = (Axis::linear(""), Axis::log(""));
        assert_eq!(edges(&[1.0, 2.0, 4.0], &linear), [0.5, 1.5, 3.0, 5.0]);
        assert_eq!(edges(&[1.0, 4.0], &log), [0.5, 2.0, 8.0]);
        assert!(edges(&[], &log).is_empty());
    }
}
