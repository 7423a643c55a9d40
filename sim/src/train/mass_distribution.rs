//! Mass distribution: spans of the rail over which tare and load of the train rest.

use super::Train;

/// A span as [from, to] in metres behind a place (negative = ahead of it).
pub type MassSpan = [f64; 2];

impl Train {
    /// Spans over which tare and load rest on the rail, behind a place `at_m` from the train's front (≤ 0 like all
    /// `start_s`). Each is the even spread that has the mean and the variance of the masses.
    pub(crate) fn spans_behind(&self, at_m: f64) -> (MassSpan, MassSpan) {
        let load = |i: usize| {
            if Some(i) == self.load {
                self.payload.map_or(self.bodies[i].mass_kg, |p| p.mass_kg)
            } else {
                0.0
            }
        };
        // An empty hook has a place too.
        let hook = |i: usize| if Some(i) == self.load { 1.0 } else { 0.0 };
        let tare = self.resting(|i| (self.bodies[i].mass_kg - load(i)).max(0.0));
        (
            even_spread(&self.places(at_m, &tare)),
            even_spread(&self.places(at_m, &self.resting(hook))),
        )
    }

    /// Masses of all bodies, with the mass of each suspended body distributed over the bodies that carry it, down to
    /// the rail.
    pub(crate) fn resting(&self, mass: impl Fn(usize) -> f64) -> Vec<f64> {
        let n = self.bodies.len();
        let mut mass: Vec<f64> = (0..n).map(mass).collect();
        for _ in 0..n {
            for i in 0..n {
                let above = self.supports(i);
                if mass[i] == 0.0 || !self.bodies[i].stations.is_empty() || above.is_empty() {
                    continue;
                }
                let share = mass[i] / above.len() as f64;
                mass[i] = 0.0;
                for a in above {
                    mass[a] += share;
                }
            }
        }
        mass
    }

    /// (metres behind `at_m`, kg) of each station.
    fn places(&self, at_m: f64, mass: &[f64]) -> Vec<(f64, f64)> {
        let of_body = |(b, m): (&super::Body, &f64)| {
            let share = m / b.stations.len().max(1) as f64;
            b.stations
                .iter()
                .map(|st| (at_m - b.start_s - st.x_m, share))
                .collect::<Vec<_>>()
        };
        self.bodies.iter().zip(mass).flat_map(of_body).collect()
    }
}

/// Uniform distribution with the mean and the variance of some masses: mean ± √3 standard deviations; a point at 0
/// without masses.
fn even_spread(masses: &[(f64, f64)]) -> MassSpan {
    let whole: f64 = masses.iter().map(|(_, m)| m).sum();
    if whole <= 0.0 {
        return [0.0; 2];
    }
    let mean = masses.iter().map(|(x, m)| x * m).sum::<f64>() / whole;
    let variance = masses
        .iter()
        .map(|(x, m)| (x - mean) * (x - mean) * m)
        .sum::<f64>()
        / whole;
    let half = libm::sqrt(3.0 * variance.max(0.0));
    [mean - half, mean + half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::train;

    #[test]
    fn an_even_rod_is_its_own_even_spread() {
        let rod: Vec<(f64, f64)> = (0..2000)
            .map(|k| (2.0 + 0.005 * (k as f64 + 0.5), 3.0))
            .collect();
        let [from, to] = even_spread(&rod);
        assert!(
            (from - 2.0).abs() < 1e-3 && (to - 12.0).abs() < 1e-3,
            "{from} {to}"
        );
        assert_eq!(even_spread(&[]), [0.0; 2]);
    }

    #[test]
    fn the_tare_covers_the_train_and_the_load_rests_under_the_beam() {
        let t = train("dx80_176y");
        let ([from, to], [load_from, load_to]) = t.spans_behind(0.0);
        // 18.1 m from front to rear, symmetric about its middle but for where couplings lie.
        assert!((0.5 * (from + to) - 9.05).abs() < 0.1, "{from} {to}");
        assert!(from > -0.5 && to < 18.6 && to - from > 12.0, "{from} {to}");
        assert!((0.5 * (load_from + load_to) - 9.05).abs() < 0.1);
        assert!(load_to - load_from < 4.7 + 0.5, "{load_from} {load_to}");
        let ([moved, _], _) = t.spans_behind(-3.0);
        assert!((moved - from + 3.0).abs() < 1e-12);
        // Neither depends on the load.
        let empty = t.with_load_mass(0.0).unwrap();
        let ([a, b], [c, d]) = empty.spans_behind(0.0);
        let apart = [a - from, b - to, c - load_from, d - load_to].map(f64::abs);
        assert!(apart.iter().all(|x| *x < 1e-9), "{apart:?}");
    }
}
