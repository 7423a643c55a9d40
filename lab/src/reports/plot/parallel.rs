//! Parallel coordinates: every candidate a line across one upright axis a parameter; its colour is its score.

use crate::reports::plot::axis::Axis;
use crate::reports::plot::canvas;
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, LegendEntry, Look};
use crate::text::number;

/// Parallel coordinates; lower scores are better.
#[derive(Clone, Debug)]
pub struct Parallel {
    /// Title.
    pub title: String,
    /// Name of the score with unit.
    pub score: String,
    /// Parameters: name, lowest and highest value, whether on a logarithmic scale.
    pub parameters: Vec<(String, f64, f64, bool)>,
    /// Candidates: a value a parameter, and the score; not finite = failed, left out.
    pub candidates: Vec<(Vec<f64>, f64)>,
    /// Number of candidates that are drawn: the best ones.
    pub most: usize,
}

impl Parallel {
    /// Draws the candidates, with the best on top.
    pub fn figure(self) -> Figure {
        let mut good: Vec<_> = self.candidates.iter().filter(|c| c.1.is_finite()).collect();
        good.sort_by(|a, b| a.1.total_cmp(&b.1));
        good.truncate(self.most);
        let (Some(best), Some(worst)) = (good.first(), good.last()) else {
            return Figure::empty(self.title);
        };
        let n = self.parameters.len() as f64;
        let names = self.parameters.iter().map(|p| p.0.clone()).collect();
        let x = Axis::names("", names).fix([0.0].into_iter(), 0.0);
        let y = Axis::linear("share of the range");
        let y = y.between(-0.1, 1.1).fix([0.0].into_iter(), 0.0);
        let svg = canvas::draw(x, y.filter(|_| n > 0.0), |c| {
            for i in 0..self.parameters.len() {
                c.vertical(i as f64, Ink::Muted, 3);
            }
            for (rank, (values, score)) in good.iter().enumerate().rev() {
                let points: Vec<_> = self
                    .parameters
                    .iter()
                    .zip(values)
                    .enumerate()
                    .map(|(i, (p, v))| (i as f64, share(*v, p.1, p.2, p.3)))
                    .collect();
                let ink = Ink::value(*score, best.1, worst.1);
                match rank {
                    0 => c.line(&points, Ink::Series(1), 7, 1.0),
                    _ => c.line(&points, ink, 2, 0.6),
                }
            }
            for (i, (_, low, high, _)) in self.parameters.iter().enumerate() {
                c.text((i as f64, -0.05), &number(*low), Ink::Text);
                c.text((i as f64, 1.05), &number(*high), Ink::Text);
            }
        });
        let keys = [
            LegendEntry::new(&self.score, Look::Scale(best.1, worst.1)),
            LegendEntry::new("best", Look::Line(Ink::Series(1))),
        ];
        let note = match self.candidates.len() {
            all if all > good.len() => format!("The {} best of {all}.", good.len()),
            _ => String::new(),
        };
        Figure::new(self.title, note, svg, keys)
    }
}

fn share(x: f64, low: f64, high: f64, log: bool) -> f64 {
    let scale = |x: f64| if log { x.log10() } else { x };
    (scale(x) - scale(low)) / (scale(high) - scale(low))
}
