//! The course of a search: the score of every trial, and the best so far.

use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::text::number;

/// A history; lower is better.
#[derive(Clone, Debug)]
pub struct History {
    /// Title.
    pub title: String,
    /// Title of the vertical axis with unit, such as `slope RMSE, °`, and its scale.
    pub y: Axis,
    /// Score of each trial in order; not finite = failed.
    pub scores: Vec<f64>,
    /// Scores to compare with, such as the score of the published constants: name, score.
    pub references: Vec<(String, f64)>,
}

impl History {
    /// Draw it.
    pub fn figure(self) -> Figure {
        let trial = |i: usize| (i + 1) as f64;
        let mut best = f64::INFINITY;
        let mut steps = Vec::new();
        for (i, &score) in self.scores.iter().enumerate() {
            if score.is_finite() && score < best {
                if best.is_finite() {
                    steps.push((trial(i), best));
                }
                best = score;
                steps.push((trial(i), best));
            }
        }
        if best.is_finite() {
            steps.push((self.scores.len() as f64, best));
        }
        let trials = self.scores.iter().enumerate();
        let trials: Vec<_> = trials.map(|(i, &s)| (trial(i), s)).collect();
        let failed = self.scores.iter().filter(|s| !s.is_finite()).count();
        let mut chart = LineChart::new(self.title, Axis::linear("trial"), self.y);
        if chart.y.range.is_none() {
            // the worst trials are of no interest: from the best to the 90 % quantile
            let mut good: Vec<f64> = self
                .scores
                .iter()
                .copied()
                .filter(|s| s.is_finite())
                .collect();
            good.sort_unstable_by(f64::total_cmp);
            let references = self
                .references
                .iter()
                .map(|r| r.1)
                .filter(|r| r.is_finite());
            if let (Some(&low), Some(&high)) = (good.first(), good.get(good.len() * 9 / 10)) {
                let low = references.clone().fold(low, f64::min);
                let high = references.fold(high, f64::max);
                if high > low {
                    let room = 0.06 * (high - low);
                    chart.y.range = Some(((low - room).max(low * 0.9), high + room));
                }
            }
        }
        if failed > 0 {
            chart.note = format!("{failed} of {} trials failed.", self.scores.len());
        }
        chart.add(Line::new("trial", Ink::Series(5), trials).dotted());
        chart.add(Line::new("best so far", Ink::Series(0), steps));
        let inks = [Ink::Muted, Ink::Series(4), Ink::Series(3)];
        for (i, (name, score)) in self.references.into_iter().enumerate() {
            let level = vec![(1.0, score), (self.scores.len() as f64, score)];
            let name = format!("{name} {}", number(score));
            chart.add(Line::new(name, inks[i % inks.len()], level));
        }
        chart.figure()
    }
}
