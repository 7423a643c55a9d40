//! The lag of a channel against the wheels: the shift at which it goes with the acceleration that they show best.

use crate::identify::Tracks;
use monorig_estimators::api::signals::Vehicle;

/// Step of the shifts, ns.
const STEP_NS: i64 = 20_000_000;
const STEP_S: f64 = 0.02;
/// Shifts to both sides.
const SHIFTS: usize = 50;
/// Steps to both sides over which the speed is regressed, and the channel averaged with the same weights.
const HALF: usize = 12;
/// Steps to both sides over which the mean is taken off: what is slower is the slope.
const SLOW: usize = 100;
/// Least time of a correlation, s.
const MIN_S: f64 = 20.0;
/// Least standard deviation of the acceleration without what is slow, m/s²: that of a train at a steady speed. Where it
/// is noise the correlation is too small for a verdict.
const MIN_SD_MPS2: f64 = 0.01;

/// Sums of a correlation at each shift.
#[derive(Clone, Debug)]
pub(super) struct Shifted {
    step_s: f64,
    /// Number, sums and sums of squares and products of both.
    sums: Vec<[f64; 6]>,
}

/// A detected lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lag {
    /// Time by which the channel is later than the wheels, s.
    pub lag_s: f64,
    /// Time that both cover, s.
    pub covered_s: f64,
    /// Correlation at this lag, and without a lag.
    pub correlation: f64,
    pub at_none: f64,
}

impl Lag {
    /// Unexplained variance without the lag, over the unexplained variance with it.
    pub fn unexplained_ratio(&self) -> f64 {
        (1.0 - self.at_none * self.at_none) / (1.0 - self.correlation * self.correlation)
    }
}

impl Shifted {
    /// Of values that are so far apart, s.
    pub fn new(step_s: f64) -> Self {
        let sums = vec![[0.0; 6]; 2 * SHIFTS + 1];
        Self { step_s, sums }
    }

    /// Takes a stretch of both signals.
    pub fn add(&mut self, wheels: &[f64], channel: &[f64]) {
        for (shift, sums) in self.sums.iter_mut().enumerate() {
            let (skip_w, skip_c) = (SHIFTS.saturating_sub(shift), shift.saturating_sub(SHIFTS));
            let pairs = wheels.iter().skip(skip_w).zip(channel.iter().skip(skip_c));
            for (x, y) in pairs.filter(|(x, y)| x.is_finite() && y.is_finite()) {
                let terms = [1.0, *x, *y, x * x, y * y, x * y];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum += term;
                }
            }
        }
    }

    fn correlation(&self, shift: usize) -> f64 {
        let Some([n, x, y, xx, yy, xy]) = self.sums.get(shift) else {
            return f64::NAN;
        };
        (xy - x * y / n) / ((xx - x * x / n) * (yy - y * y / n)).sqrt()
    }

    /// The lag of the channel; `None` if the log does not show it.
    pub fn lag(&self) -> Option<Lag> {
        let [n, x, _, xx, ..] = self.sums.get(SHIFTS).copied()?;
        if n * self.step_s < MIN_S || ((xx - x * x / n) / n).sqrt() < MIN_SD_MPS2 {
            return None;
        }
        let all: Vec<f64> = (0..=2 * SHIFTS).map(|i| self.correlation(i)).collect();
        let best = (0..all.len()).max_by(|a, b| all[*a].total_cmp(&all[*b]))?;
        let peak = *all.get(best)?;
        // the top of the parabola through the highest three
        let beside = |i: Option<usize>| i.and_then(|i| all.get(i)).copied();
        let off = match (beside(best.checked_sub(1)), beside(best.checked_add(1))) {
            (Some(a), Some(b)) if a + b < 2.0 * peak => 0.5 * (a - b) / (a + b - 2.0 * peak),
            _ => 0.0,
        };
        Some(Lag {
            lag_s: (best as f64 + off - SHIFTS as f64) * self.step_s,
            covered_s: n * self.step_s,
            correlation: peak,
            at_none: self.correlation(SHIFTS),
        })
    }
}

/// Lags of the channels that show the acceleration.
#[derive(Clone, Debug)]
pub(super) struct Lags {
    force: Shifted,
    traction: Shifted,
}

impl Default for Lags {
    fn default() -> Self {
        let [force, traction] = [STEP_S; 2].map(Shifted::new);
        Self { force, traction }
    }
}

impl Lags {
    /// Takes a stretch of a log.
    pub fn add(&mut self, tracks: &mut Tracks, vehicle: &Vehicle) {
        let (Some(&from), Some(&to)) = (tracks.times_ns.first(), tracks.times_ns.last()) else {
            return;
        };
        let times = (0..).map(|k| from + k * STEP_NS).take_while(|t| *t <= to);
        let (mut speeds, mut forces, mut tractions) = (Vec::new(), Vec::new(), Vec::new());
        for t in times {
            let speed = tracks.speed_at(t);
            speeds.push(speed);
            forces.push(tracks.force[0].at(t));
            tractions.push(tracks.force_at(t, speed, vehicle));
        }
        let wheels = fast(&regressed(&speeds));
        self.force.add(&wheels, &fast(&averaged(&forces)));
        self.traction.add(&wheels, &fast(&averaged(&tractions)));
    }

    /// Lag of the specific force; `None` if the log does not show it.
    pub fn force(&self) -> Option<Lag> {
        self.force.lag()
    }

    /// Lag of the traction.
    pub fn traction(&self) -> Option<Lag> {
        self.traction.lag()
    }
}

/// Acceleration at each step: the regression of the speed over the steps around it.
fn regressed(speeds: &[f64]) -> Vec<f64> {
    let h = HALF as f64;
    let squares = STEP_S * h * (h + 1.0) * (2.0 * h + 1.0) / 3.0;
    let of = |w: &[f64]| {
        w.iter()
            .zip(0..)
            .map(|(v, i)| v * (f64::from(i) - h))
            .sum::<f64>()
            / squares
    };
    around(speeds, of)
}

/// Mean with the weights that the regression gives the acceleration: a parabola.
fn averaged(values: &[f64]) -> Vec<f64> {
    let h = HALF as f64;
    let weight = |i: i32| 1.0 - ((f64::from(i) - h) / (h + 0.5)).powi(2);
    let all: f64 = (0..=2 * HALF as i32).map(weight).sum();
    let of = |w: &[f64]| w.iter().zip(0..).map(|(x, i)| x * weight(i)).sum::<f64>() / all;
    around(values, of)
}

fn around(values: &[f64], of: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let edge = vec![f64::NAN; HALF];
    let inner = values.windows(2 * HALF + 1).map(of).collect();
    [edge.clone(), inner, edge].concat()
}

/// The rest without the mean over the time around, where nearly all of it is known.
fn fast(values: &[f64]) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0], vec![0usize]);
    let (mut sum, mut count) = (0.0, 0);
    for x in values {
        if x.is_finite() {
            sum += x;
            count += 1;
        }
        sums.push(sum);
        counts.push(count);
    }
    let each = values.iter().enumerate().map(|(i, x)| {
        let (from, to) = (i.saturating_sub(SLOW), (i + SLOW + 1).min(values.len()));
        let of = |all: &[f64]| Some(all.get(to)? - all.get(from)?);
        let n = counts
            .get(to)
            .zip(counts.get(from))
            .map_or(0, |(b, a)| b - a);
        match n * 10 >= (2 * SLOW + 1) * 8 {
            true => x - of(&sums).unwrap_or(f64::NAN) / n as f64,
            false => f64::NAN,
        }
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shift that was planted is found within a twentieth of a step, whatever its sign; noise alone has no peak.
    #[test]
    fn a_planted_lag_is_found() {
        let a = |t: f64| (1.3 * t).sin() + 0.5 * (3.1 * t).cos();
        for planted in [-0.2, 0.0, 0.07, 0.4] {
            let at = |k: i32| f64::from(k) * STEP_S;
            let wheels: Vec<f64> = (0..5000).map(|k| a(at(k))).collect();
            let channel: Vec<f64> = (0..5000).map(|k| 3.0 * a(at(k) - planted)).collect();
            let mut shifted = Shifted::new(STEP_S);
            shifted.add(&fast(&wheels), &fast(&channel));
            let lag = shifted.lag().unwrap();
            assert!((lag.lag_s - planted).abs() < 1e-3, "{lag:?} {planted}");
            assert!(lag.correlation > 0.99);
        }
    }

    /// The regression of a parabola's speed and the mean of its acceleration are one.
    #[test]
    fn both_sides_have_the_same_weights() {
        let t = |k: i32| f64::from(k) * STEP_S;
        let speeds: Vec<f64> = (0..100).map(|k| t(k).powi(3)).collect();
        let forces: Vec<f64> = (0..100).map(|k| 3.0 * t(k).powi(2)).collect();
        let (a, f) = (regressed(&speeds), averaged(&forces));
        assert!(
            a.iter()
                .zip(&f)
                .skip(HALF)
                .take(70)
                .all(|(a, f)| (a - f).abs() < 1e-3)
        );
    }
}
