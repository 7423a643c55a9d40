//! Two scores of every candidate, for which less is better, and the candidates that no other candidate beats in both
//! scores.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::scatter::Scatter;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};

/// A Pareto front.
#[derive(Clone, Debug)]
pub struct Pareto {
    /// Title.
    pub title: String,
    /// Axis of the first score.
    pub x: Axis,
    /// Axis of the second score.
    pub y: Axis,
    /// Scores of all candidates.
    pub candidates: Vec<(f64, f64)>,
    /// Candidates to mark, such as the published constants: name and scores.
    pub named: Vec<(String, (f64, f64))>,
}

/// Points that no other point beats or equals in both coordinates, from left to right; points that are not finite do
/// not count.
pub(crate) fn front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<_> = points
        .iter()
        .copied()
        .filter(|p| p.0.is_finite() && p.1.is_finite())
        .collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    sorted.retain(|p| {
        let keep = p.1 < best;
        best = best.min(p.1);
        keep
    });
    sorted
}

impl Pareto {
    /// Draw it.
    pub fn figure(self) -> Figure {
        let front = front(&self.candidates);
        // what the front reaches: everything above and to the right of its steps
        let mut steps: Vec<(f64, f64)> = Vec::new();
        for p in &front {
            if let Some(last) = steps.last().copied() {
                steps.push((p.0, last.1));
            }
            steps.push(*p);
        }
        let mut plot = Scatter::new(self.title, self.x, self.y);
        plot.groups = vec![
            ValueGroup::new("candidate", Ink::Series(5), self.candidates),
            ValueGroup::new("on the front", Ink::Series(0), front),
        ];
        for (i, (name, at)) in self.named.into_iter().enumerate() {
            plot.groups
                .push(ValueGroup::new(name, Ink::series(i + 1), vec![at]));
        }
        plot.lines = vec![ValueGroup::new("", Ink::Series(0), steps)];
        plot.figure()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = [
            (3.0, 1.0),
            (1.0, 3.0),
            (2.0, 2.0),
            (2.0, 2.5),
            (3.0, 3.0),
            (f64::NAN, 0.0),
            (1.0, 3.0),
        ];
        assert_eq!(front(&points), [(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]);
    }
}
