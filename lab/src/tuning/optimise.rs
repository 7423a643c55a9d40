//! Optimisers over the unit cube, all behind one function.
//!
//! An optimiser is seeded and asks one question at a time. So the same seed asks the same questions, whatever the
//! number of threads. CMA-ES and NSGA-II come from the crate `heuropt`; the grid and the random points are ours.

use crate::tuning::study::Optimiser;
use heuropt::prelude::*;
use std::sync::Mutex;

/// Loss of a failed trial, and of a question after the end of the budget. No other loss is larger.
pub(crate) const WORST: f64 = 3.0;
/// First step of CMA-ES, as a share of each range.
const STEP: f64 = 0.25;

/// Task of a search.
#[derive(Clone, Debug)]
pub struct Search<'a> {
    /// Optimiser.
    pub optimiser: Optimiser,
    /// Start of CMA-ES, in the unit cube.
    pub start: &'a [f64],
    /// Different values along each axis; none = any number.
    pub counts: &'a [Option<usize>],
    /// Numbers in each answer.
    pub objectives: usize,
    /// Questions to ask. A few more may come, whose answers do not matter.
    pub budget: usize,
    /// Seed.
    pub seed: u64,
}

/// Asks until the budget is spent. `answer` is given a point of the unit cube (or, seldom, one outside of it that
/// counts as on its surface) and returns its loss.
pub fn minimise(search: &Search<'_>, answer: &mut (dyn FnMut(&[f64]) -> Vec<f64> + Send)) {
    let (n, budget, seed) = (search.start.len(), search.budget, search.seed);
    let question = LibraryProblem {
        answer: Mutex::new(answer),
        objectives: search.objectives,
    };
    let cube = || RealBounds::new(vec![(0.0, 1.0); n]);
    match search.optimiser {
        Optimiser::Random => {
            for k in 0..budget {
                question.ask(&random_point(seed, k, n));
            }
        }
        Optimiser::Grid => {
            for point in grid(search.counts, budget) {
                question.ask(&point);
            }
        }
        Optimiser::CmaEs => {
            // population after Hansen 2016 (The CMA evolution strategy: a tutorial), eq. 48
            let population_size = 4 + (3.0 * (n as f64).ln()) as usize;
            let config = CmaEsConfig {
                population_size,
                generations: budget.div_ceil(population_size),
                initial_sigma: STEP,
                eigen_decomposition_period: 1,
                initial_mean: Some(search.start.to_vec()),
                seed,
            };
            CmaEs::new(config, cube()).run(&question);
        }
        Optimiser::Nsga2 => {
            let population_size = (budget / 10).clamp(8, 64);
            let bounds = vec![(0.0, 1.0); n];
            let variation = CompositeVariation {
                crossover: SimulatedBinaryCrossover::new(bounds.clone(), 15.0, 0.9),
                mutation: PolynomialMutation::new(bounds, 20.0, 1.0 / n as f64),
            };
            let config = Nsga2Config {
                population_size,
                generations: budget.div_ceil(population_size),
                seed,
            };
            Nsga2::new(config, cube(), variation).run(&question);
        }
    }
}

/// Computes the losses of a point.
type LossFunction<'a> = dyn FnMut(&[f64]) -> Vec<f64> + Send + 'a;

/// The task in the form of the library. It is built without its threads, so it asks one point at a time and in order.
struct LibraryProblem<'a> {
    answer: Mutex<&'a mut LossFunction<'a>>,
    objectives: usize,
}

impl LibraryProblem<'_> {
    fn ask(&self, point: &[f64]) -> Vec<f64> {
        match self.answer.lock() {
            Ok(mut answer) => answer(point),
            Err(_) => vec![WORST; self.objectives],
        }
    }
}

impl Problem for LibraryProblem<'_> {
    type Decision = Vec<f64>;

    fn objectives(&self) -> ObjectiveSpace {
        let name = |i: usize| Objective::minimize(format!("loss {i}"));
        ObjectiveSpace::new((0..self.objectives).map(name).collect())
    }

    fn evaluate(&self, point: &Vec<f64>) -> Evaluation {
        Evaluation::new(self.ask(point))
    }
}

/// Point `k` of a stream: evenly distributed, and the same whenever it is asked for (SplitMix64, Steele et al. 2014).
pub fn random_point(seed: u64, k: usize, n: usize) -> Vec<f64> {
    let number = |i: usize| {
        let counter = (k * n + i + 1) as u64;
        let mut z = seed
            .wrapping_mul(0xD1B5_4A32_D192_ED03)
            .wrapping_add(counter.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..n).map(number).collect()
}

/// A grid with a limited number of points, including the ends; an axis with few values has at most one point for each
/// value.
fn grid(counts: &[Option<usize>], budget: usize) -> Vec<Vec<f64>> {
    let points = |most: usize| -> Vec<usize> {
        let of = |c: &Option<usize>| c.map_or(most, |c| c.min(most)).max(1);
        counts.iter().map(of).collect()
    };
    let size = |most: usize| {
        let lengths = points(most).into_iter();
        lengths.fold(1_usize, usize::saturating_mul)
    };
    let values = counts.iter().map(|c| c.unwrap_or(usize::MAX));
    let largest = values.max().unwrap_or(1);
    let mut most = 1;
    while most < largest && size(most + 1) <= budget {
        most += 1;
    }
    let lengths = points(most);
    (0..size(most))
        .map(|k| {
            let mut rest = k;
            let place = |length: &usize| {
                let i = rest % length;
                rest /= length;
                match length {
                    1 => 0.5,
                    _ => i as f64 / (length - 1) as f64,
                }
            };
            lengths.iter().map(place).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Optimiser; 3] = [Optimiser::CmaEs, Optimiser::Grid, Optimiser::Random];

    const PLANTED: [f64; 3] = [0.31, 0.72, 0.55];

    /// A curved valley with its minimum, 0, at a planted point; about 1 where the search starts.
    fn valley(x: &[f64]) -> f64 {
        let d: Vec<f64> = x
            .iter()
            .zip(PLANTED)
            .map(|(x, p)| x.clamp(0.0, 1.0) - p)
            .collect();
        (8.0 * d[0].powi(2) + 20.0 * (d[1] - d[0] * d[0]).powi(2) + 4.0 * d[2].powi(2)).min(3.0)
    }

    fn search(optimiser: Optimiser, budget: usize, seed: u64) -> Vec<(Vec<f64>, f64)> {
        let mut asked = Vec::new();
        let search = Search {
            optimiser,
            start: &[0.5, 0.5, 0.8],
            counts: &[None; 3],
            objectives: 1,
            budget,
            seed,
        };
        minimise(&search, &mut |x| {
            let y = if asked.len() < budget {
                valley(x)
            } else {
                WORST
            };
            asked.push((x.to_vec(), y));
            vec![y]
        });
        asked
    }

    fn best(asked: &[(Vec<f64>, f64)], budget: usize) -> f64 {
        asked.iter().take(budget).map(|a| a.1).fold(WORST, f64::min)
    }

    /// Every optimiser finds the planted minimum as closely as its kind can, from every seed.
    #[test]
    fn finds_a_planted_optimum() {
        for (optimiser, budget, within) in [
            (Optimiser::CmaEs, 300, 1e-3),
            (Optimiser::Grid, 1000, 0.1),
            (Optimiser::Random, 1000, 0.15),
        ] {
            for seed in 1..=5 {
                let found = best(&search(optimiser, budget, seed), budget);
                assert!(found < within, "{optimiser:?} seed {seed}: {found}");
            }
        }
    }

    /// With as many questions, a search leaves random points far behind.
    #[test]
    fn a_search_beats_chance() {
        let median = |optimiser| {
            let mut found: Vec<f64> = (1..=9)
                .map(|seed| best(&search(optimiser, 150, seed), 150))
                .collect();
            found.sort_by(f64::total_cmp);
            found[4]
        };
        let chance = median(Optimiser::Random);
        let found = median(Optimiser::CmaEs);
        assert!(found < 0.25 * chance, "{found} against {chance}");
    }

    #[test]
    fn the_same_seed_asks_the_same_questions() {
        for optimiser in ALL {
            let (a, b) = (search(optimiser, 60, 7), search(optimiser, 60, 7));
            assert_eq!(a, b, "{optimiser:?}");
            assert!(
                a.len() >= 60 || optimiser == Optimiser::Grid,
                "{optimiser:?}: {}",
                a.len()
            );
        }
        assert_ne!(
            search(Optimiser::CmaEs, 60, 7),
            search(Optimiser::CmaEs, 60, 8)
        );
    }

    /// Losses that are all the worst possible stop no optimiser: the search goes on to its end.
    #[test]
    fn a_search_without_a_single_good_trial_ends() {
        for optimiser in ALL {
            let mut asked = 0;
            let search = Search {
                optimiser,
                start: &[0.5, 0.5],
                counts: &[None; 2],
                objectives: 1,
                budget: 60,
                seed: 1,
            };
            minimise(&search, &mut |x| {
                assert!(x.iter().all(|x| x.is_finite()), "{optimiser:?}");
                asked += 1;
                vec![WORST]
            });
            assert!(asked >= 49, "{optimiser:?}: {asked}");
        }
    }

    /// Two metrics that pull apart: the front between them is found, not one of its ends.
    #[test]
    fn nsga2_finds_a_front() {
        let mut asked: Vec<Vec<f64>> = Vec::new();
        let search = Search {
            optimiser: Optimiser::Nsga2,
            start: &[0.5; 2],
            counts: &[None; 2],
            objectives: 2,
            budget: 400,
            seed: 3,
        };
        minimise(&search, &mut |x| {
            let off = (x[1] - 0.4).powi(2);
            let y = vec![x[0].powi(2) + off, (1.0 - x[0]).powi(2) + off];
            asked.push(y.clone());
            y
        });
        // On the front √f₁ + √f₂ = 1.
        let near = |y: &&Vec<f64>| y[0].sqrt() + y[1].sqrt() < 1.03;
        let front: Vec<&Vec<f64>> = asked.iter().filter(near).collect();
        for third in 0..3 {
            let (low, high) = (f64::from(third) / 3.0, f64::from(third + 1) / 3.0);
            let there = |y: &&&Vec<f64>| (low..high).contains(&y[0].sqrt());
            assert!(front.iter().filter(there).count() >= 5, "third {third}");
        }
    }

    #[test]
    fn a_grid_has_its_ends_and_no_value_twice() {
        let points = grid(&[None, Some(2)], 12);
        assert_eq!(points.len(), 12);
        for end in [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]] {
            assert!(points.iter().any(|p| p == &end), "{end:?}");
        }
        assert_eq!(grid(&[Some(2), Some(3)], 1000).len(), 6);
    }
}
