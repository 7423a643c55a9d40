//! Load bank: a Gaussian sum over the load (Sorenson & Alspach 1971), with a hazard of another load (Blom & Bar-Shalom
//! 1988; Adams & MacKay 2007).
//!
//! Each hypothesis is the [force balance](super::filter) begun at one load. A block
//!
//! 1. gives a share of the weight to fresh hypotheses, which know all but the load and its swing by the heaviest one:
//!    the hazard of another load since the last share, or a tenth after a stand in which one can be hung on unseen
//! 2. corrects each, and weighs each by Student's t of its normalised innovation; the determinant is left out, which
//!    favours the lightest load, since the noise of the swing grows with the load
//! 3. merges those of the same load and forgets the lightest
//!
//! The load is that of the heaviest hypothesis; its variance is that of the sum about it.

use crate::Real;
use crate::api::aid::AidStatus;
use crate::api::real::{exp, ln, sqrt};
use crate::api::snapshot::state;
use crate::tuning::{BANK, STATISTICS};

use super::block::Block;
use super::filter::{Hypothesis, SwingBalance};
use crate::rail::train_means::TrainMeans;

/// The bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadBank {
    balance: SwingBalance,
    all: [Hypothesis; BANK.most],
    count: usize,
    /// Time, s, and number of used blocks since the last share for another load.
    due_s: Real,
    since: u32,
}

impl LoadBank {
    /// Starts with the loads that a train may have, each with the weight of its width.
    pub fn new(balance: SwingBalance) -> Self {
        let all = core::array::from_fn(|i| {
            let load = BANK.loads.get(i).copied().unwrap_or([0.0, 1.0]);
            balance.start(load, share(load))
        });
        Self {
            balance,
            all,
            count: BANK.loads.len(),
            due_s: 0.0,
            since: 0,
        }
    }

    /// Hypotheses in use.
    pub fn hypotheses(&self) -> &[Hypothesis] {
        self.all.get(..self.count).unwrap_or_default()
    }

    /// The heaviest hypothesis.
    pub fn heaviest(&self) -> &Hypothesis {
        let [first, ..] = &self.all;
        self.hypotheses().iter().fold(
            first,
            |best, h| if h.weight > best.weight { h } else { best },
        )
    }

    /// Force balance of all hypotheses.
    pub fn balance(&self) -> &SwingBalance {
        &self.balance
    }

    /// Variance of the sum about a load, kg².
    pub fn variance_about(&self, load_kg: Real) -> Real {
        let about = |h: &Hypothesis| {
            let [load, variance] = h.load();
            h.weight * (variance + (load - load_kg) * (load - load_kg))
        };
        self.hypotheses().iter().map(about).sum()
    }

    /// Protection level about a load, kg: the largest over the hypotheses of the distance to its load and of k of its
    /// standard deviations, with k² = `sd`² + 2 ln w: the risk of a hypothesis of the weight w is w exp(-k²/2), and the
    /// same for all. `gain_kg` is the standard deviation of the scale of the force, in kg.
    pub fn protection_kg(&self, load_kg: Real, gain_kg: Real, sd: Real) -> Real {
        let level = |h: &Hypothesis| {
            let ([load, variance], k) = (h.load(), sd * sd + 2.0 * ln(h.weight));
            let own = sqrt(k.max(0.0) * (variance + gain_kg * gain_kg));
            if k > 0.0 {
                (load - load_kg).abs() + own
            } else {
                0.0
            }
        };
        self.hypotheses().iter().map(level).fold(0.0, Real::max)
    }

    /// Takes a block: corrects by it if it is of use, and carries the state over its length. Returns the status of the
    /// heaviest and the mean normalised innovation squared.
    pub fn take(
        &mut self,
        block: &Block,
        means: &TrainMeans,
        of_use: bool,
    ) -> Option<(AidStatus, Real)> {
        self.due_s += block.length_s();
        let found = of_use.then(|| {
            self.since += 1;
            if self.since >= BANK.share_blocks {
                self.share_out(1.0 - exp(-BANK.hazard_hz * self.due_s));
            }
            self.weigh(block, means)
        });
        let balance = self.balance;
        let z = balance.measurement(&self.heaviest().belief.x, block, means);
        for h in self.all.iter_mut().take(self.count) {
            balance.predict(h, &z);
        }
        found
    }

    /// Assumes that another load may have been hung on.
    pub fn open(&mut self) {
        self.share_out(BANK.stand_share);
    }

    /// Reopens the values that depend on the place on the rail.
    pub fn lose_place(&mut self, behind_sd_rad: Real) {
        self.all
            .iter_mut()
            .for_each(|h| h.lose_place(behind_sd_rad));
    }

    fn share_out(&mut self, of_all: Real) {
        let heaviest = *self.heaviest();
        (self.due_s, self.since) = (0.0, 0);
        self.keep(BANK.most - BANK.loads.len());
        for h in self.all.iter_mut().take(self.count) {
            h.weight *= 1.0 - of_all;
        }
        for (place, load) in self.all.iter_mut().skip(self.count).zip(BANK.loads) {
            *place = self.balance.other(&heaviest, load, of_all * share(load));
        }
        self.count += BANK.loads.len();
    }

    fn weigh(&mut self, block: &Block, means: &TrainMeans) -> (AidStatus, Real) {
        let balance = self.balance;
        let z = balance.measurement(&self.heaviest().belief.x, block, means);
        let (mut squares, mut least) = ([0.0; BANK.most], Real::MAX);
        let (mut mean, mut most, mut status) = (0.0, 0.0, AidStatus::default());
        for (h, square) in self.all.iter_mut().zip(&mut squares).take(self.count) {
            let (now, nis) = balance.correct(h, &z);
            (*square, least) = (nis, least.min(nis));
            mean += h.weight * nis.min(STATISTICS.max_nis);
            if h.weight > most {
                (most, status) = (h.weight, now);
            }
        }
        let mut sum = 0.0;
        for (h, square) in self.all.iter_mut().zip(squares).take(self.count) {
            let ratio = (BANK.freedom + least) / (BANK.freedom + square);
            h.weight *= ratio * ratio;
            sum += h.weight;
        }
        for h in self.all.iter_mut().take(self.count) {
            h.weight /= sum.max(Real::MIN_POSITIVE);
        }
        self.merge();
        self.keep(BANK.loads.len());
        (status, mean)
    }

    /// Merges hypotheses of the same load.
    fn merge(&mut self) {
        let mut i = 0;
        while i < self.count {
            let mut j = i + 1;
            while j < self.count {
                if let Ok([h, other]) = self.all.get_disjoint_mut([i, j])
                    && are_same(h, other)
                {
                    h.merge(other);
                    self.forget(j);
                } else {
                    j += 1;
                }
            }
            i += 1;
        }
    }

    /// Forgets the hypotheses with the least weight until the allowed number is left.
    fn keep(&mut self, most: usize) {
        loop {
            let of = self.hypotheses().iter().enumerate();
            let Some((lightest, weight)) = of
                .map(|(i, h)| (i, h.weight))
                .min_by(|(_, a), (_, b)| a.total_cmp(b))
            else {
                return;
            };
            if self.count <= most && weight >= BANK.least_weight {
                return;
            }
            self.forget(lightest);
        }
    }

    fn forget(&mut self, place: usize) {
        self.count -= 1;
        self.all.swap(place, self.count);
    }
}

/// Share of the weight for a new load: its width among all.
fn share([_, width]: [Real; 2]) -> Real {
    width / BANK.loads.iter().map(|[_, w]| w).sum::<Real>()
}

/// True if the Bhattacharyya distance of two loads is small.
fn are_same(a: &Hypothesis, b: &Hypothesis) -> bool {
    let ([load, own], [other, others]) = (a.load(), b.load());
    let (apart, mean) = (load - other, 0.5 * (own + others));
    let distance = 0.125 * apart * apart / mean + 0.5 * ln(mean / sqrt(own * others));
    distance < BANK.same
}

state!(LoadBank { all, count, due_s, since; balance } where |this| this.count > 0 && this.count <= BANK.most);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::mass_layout::MassLayout;
    use crate::models::swing_balance::Nominal;
    use crate::testing::vehicles::vehicle;

    /// Bank of a train of 5 t with up to 22 t.
    fn bank() -> LoadBank {
        let layout = MassLayout::even(5_000.0, [0.0, 12.0], [0.0, 12.0]);
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        let (params, supervision) = (Default::default(), Default::default());
        LoadBank::new(SwingBalance::new(nominal, &params, &supervision))
    }

    fn weight(bank: &LoadBank) -> Real {
        bank.hypotheses().iter().map(|h| h.weight).sum()
    }

    /// At the start every load is held possible by its width: the mean is near the middle of the range, and the
    /// variance about it nearly that of an even spread, a twelfth of the square of the range.
    #[test]
    fn at_the_start_every_load_is_possible() {
        let bank = bank();
        assert!((weight(&bank) - 1.0).abs() < 1e-12 && bank.hypotheses().len() == 8);
        let mean = bank.hypotheses().iter().map(|h| h.weight * h.load()[0]);
        let mean: Real = mean.sum();
        assert!((mean / 22_000.0 - 0.5).abs() < 0.05, "{mean}");
        let even = 22_000.0 / (12.0 as Real).sqrt();
        let sd = bank.variance_about(mean).sqrt();
        assert!((sd / even - 1.0).abs() < 0.1, "{sd}");
        let off = 3_000.0;
        let about = bank.variance_about(mean + off) - bank.variance_about(mean);
        assert!((about / (off * off) - 1.0).abs() < 1e-9);
    }

    /// After a stand a tenth of the weight is that of other loads; the heaviest is the one of before.
    #[test]
    fn a_stand_gives_a_tenth_of_the_weight_away() {
        let mut bank = bank();
        bank.count = 1;
        let balance = bank.balance;
        bank.all[0] = balance.start([0.4, 0.01], 1.0);
        let before = *bank.heaviest();
        bank.open();
        assert!((weight(&bank) - 1.0).abs() < 1e-12 && bank.hypotheses().len() == 9);
        assert_eq!(bank.heaviest().belief, before.belief);
        assert!((bank.heaviest().weight - 0.9).abs() < 1e-12);
    }

    /// The level covers each hypothesis by as many standard deviations as leave the same risk: with the weight w the
    /// risk w exp(-k²/2) is that of the whole at `sd`. A hypothesis whose weight alone is less than this risk is not
    /// covered.
    #[test]
    fn the_level_covers_every_load_that_is_not_refuted() {
        let balance = bank().balance;
        let of = |weight: Real, sd: Real| {
            let mut bank = bank();
            bank.count = 2;
            bank.all[0] = balance.start([0.4, 0.01], 1.0 - weight);
            bank.all[1] = balance.start([0.6, 0.02], weight);
            bank.protection_kg(bank.heaviest().load()[0], 300.0, sd)
        };
        let own = (220.0 * 220.0 + 300.0 * 300.0 as Real).sqrt();
        assert!((of(1e-9, 4.0) / (4.0 * own) - 1.0).abs() < 1e-6);
        for (weight, sd) in [(0.01, 4.0), (0.4, 3.0), (0.2, 6.0)] {
            let k = (sd * sd + 2.0 * (weight as Real).ln()).sqrt();
            let risk = weight * (-0.5 * k * k).exp();
            assert!((risk / (-0.5 * sd * sd).exp() - 1.0).abs() < 1e-9);
            let other = (440.0 * 440.0 + 300.0 * 300.0 as Real).sqrt();
            let expected = 0.2 * 22_000.0 + k * other;
            assert!((of(weight, sd) / expected - 1.0).abs() < 1e-6, "{weight}");
        }
    }

    /// The bank is full with eight hypotheses and eight fresh ones; the lightest go first.
    #[test]
    fn the_lightest_are_forgotten() {
        let mut bank = bank();
        for _ in 0..5 {
            bank.open();
        }
        assert_eq!(bank.hypotheses().len(), BANK.most);
        let mut weights: std::vec::Vec<Real> = bank.hypotheses().iter().map(|h| h.weight).collect();
        weights.sort_by(|a, b| b.total_cmp(a));
        bank.keep(BANK.loads.len());
        let left: std::vec::Vec<Real> = bank.hypotheses().iter().map(|h| h.weight).collect();
        assert_eq!(left.len(), BANK.loads.len());
        assert!(left.iter().all(|w| *w >= weights[BANK.loads.len() - 1]));
    }

    /// Two loads are the same where their Bhattacharyya distance is below 0.1: of one standard deviation at 0.89 of
    /// it apart.
    #[test]
    fn loads_that_are_the_same_are_merged() {
        let balance = bank().balance;
        for (apart, count) in [(0.88, 1), (0.91, 2)] {
            let mut bank = bank();
            bank.count = 2;
            bank.all[0] = balance.start([0.4, 0.01], 0.7);
            bank.all[1] = balance.start([0.4 + 0.01 * apart, 0.01], 0.3);
            bank.merge();
            assert_eq!(bank.hypotheses().len(), count, "{apart}");
        }
    }
}
