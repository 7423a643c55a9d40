//! Force balance of one hypothesis of the load: [`SwingModel`] over blocks, each of which is one measurement
//! ([`BlockForce`]).

#![allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]

use nalgebra::SVector;

use super::block::Block;
use super::params::{SwingBalanceParams, SwingSupervision};
use crate::Real;
use crate::aiding::force_balance::{BlockForce, BlockNoise};
use crate::aiding::{Aid, GateRule, Innovation};
use crate::api::aid::AidStatus;
use crate::api::real::{GRAVITY, exp};
use crate::api::snapshot::state;
use crate::filters::ekf;
use crate::filters::gaussian::Gaussian;
use crate::filters::model::Process;
use crate::models::swing_balance::{
    ANGLE, CV, ETA, LENGTH, MASS, N, Nominal, R0, RATE, SwingInput, SwingModel,
};
use crate::rail::train_means::TrainMeans;
use crate::tuning::{BALANCE, MOTION, RAIL, STATISTICS};

/// A load that may hang on the train, and the state that follows from the blocks in this case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// State and covariance.
    pub belief: Gaussian<N>,
    /// Probability of this load among all.
    pub weight: Real,
    last_grade: Real,
    last_behind_m: Real,
}

impl Hypothesis {
    /// Load, kg, and its variance, kg².
    pub fn load(&self) -> [Real; 2] {
        [self.belief.x[MASS], self.belief.P[(MASS, MASS)]]
    }

    /// Reopens the values that depend on the place on the rail: the grade behind with the standard deviation
    /// `behind_sd_rad`, and the swing.
    pub fn lose_place(&mut self, behind_sd_rad: Real) {
        self.open_swing();
        let variance = behind_sd_rad * behind_sd_rad;
        self.belief.set_independent(ETA, 0.0, variance);
        (self.last_grade, self.last_behind_m) = (0.0, 0.0);
    }

    fn open_swing(&mut self) {
        let [angle, rate] = BALANCE.new_swing_sd;
        self.belief.set_independent(ANGLE, 0.0, angle * angle);
        self.belief.set_independent(RATE, 0.0, rate * rate);
    }

    /// Merges another hypothesis of the same load: both have one mean and one covariance.
    pub fn merge(&mut self, other: &Self) {
        let share = self.weight / (self.weight + other.weight);
        let (apart, rest) = (self.belief.x - other.belief.x, 1.0 - share);
        let spread = apart * (share * rest * apart.transpose());
        self.belief.P = self.belief.P * share + other.belief.P * rest + spread;
        self.belief.symmetrise();
        self.belief.x -= apart * rest;
        self.weight += other.weight;
    }
}

/// A block as a measurement of all hypotheses, with one noise for all, so that they can be compared.
pub struct BlockOfAll<'a> {
    aid: BlockForce<'a>,
    block: &'a Block,
    noise_kg: Real,
}

/// The force balance: model and noise, the same for every hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingBalance {
    model: SwingModel,
    params: SwingBalanceParams,
}

impl SwingBalance {
    /// Builds the balance from the train's nominal values.
    pub fn new(
        nominal: Nominal,
        params: &SwingBalanceParams,
        supervision: &SwingSupervision,
    ) -> Self {
        Self {
            model: SwingModel {
                nominal,
                swings: supervision.swing && nominal.chain_m > 0.0,
                depth_m: match supervision.depth {
                    true => nominal.hook_depth_m,
                    false => 0.0,
                },
                swing_damping: params.swing_damping,
                swing_walk: params.swing_walk,
                length_walk: params.length_walk,
            },
            params: *params,
        }
    }

    /// Hypothesis of a load with its standard deviation, both as shares of the largest load, before any block.
    pub fn start(&self, [load, sd]: [Real; 2], weight: Real) -> Hypothesis {
        let most = self.model.nominal.max_load_kg;
        Hypothesis {
            belief: prior(&self.model.nominal, &self.params, [load * most, sd * most]),
            weight,
            last_grade: 0.0,
            last_behind_m: 0.0,
        }
    }

    /// Hypothesis of another load on the train, with all other knowledge of this one: the swing is open, and the
    /// resistance in part.
    pub fn other(&self, of: &Hypothesis, [load, sd]: [Real; 2], weight: Real) -> Hypothesis {
        let mut other = Hypothesis { weight, ..*of };
        let most = self.model.nominal.max_load_kg;
        let (load_kg, sd_kg) = (load * most, sd * most);
        other.belief.set_independent(MASS, load_kg, sd_kg * sd_kg);
        other.open_swing();
        let first = resistance_sd_n(&self.model.nominal, &self.params);
        other.belief.P[(R0, R0)] += BALANCE.reopen * first * first;
        other
    }

    /// Carries a state over the length of a block, with the load on a grade of this cosine.
    pub fn carried(&self, x: SVector<Real, N>, block: &Block, cos: Real) -> SVector<Real, N> {
        let u = SwingInput {
            accelerations_mps2: block.accelerations().map(|a| a * cos),
            ..SwingInput::default()
        };
        self.model.f(&x, &u, block.length_s())
    }

    /// Innovation of an unused block at the state `x`, N, and the variance of its noise without the unread rail, N².
    pub fn outlook(&self, x: &SVector<Real, N>, block: &Block, means: &TrainMeans) -> [Real; 2] {
        let read = TrainMeans {
            ahead_kgm: 0.0,
            ..*means
        };
        let BlockOfAll { aid, .. } = self.measurement(x, block, &read);
        [aid.innovation(x), aid.R()]
    }

    /// The measurement by a block, with the noise at the state `x`.
    pub fn measurement<'a>(
        &'a self,
        x: &SVector<Real, N>,
        block: &'a Block,
        means: &'a TrainMeans,
    ) -> BlockOfAll<'a> {
        let (p, noise_kg) = (&self.params, self.model.nominal.tare_kg + x[MASS]);
        let noise = BlockNoise {
            model_sd_mps2: p.model_sd_mps2,
            swing_model_sd: p.swing_model_sd,
            mass_kg: noise_kg,
            traction_variance: Real::from(block.variance),
            part_noise_mps2: block.part_noise_mps2(),
        };
        let aid = BlockForce {
            model: &self.model,
            means,
            traction_n: Real::from(block.traction_n),
            speed_mps: Real::from(block.speed_mps),
            accelerations_mps2: block.accelerations(),
            substep_s: block.substep_s(),
            variance: 0.0,
        }
        .with_noise(&noise, x);
        BlockOfAll {
            aid,
            block,
            noise_kg,
        }
    }

    /// Corrects a hypothesis by a block; returns the status with the normalised innovation squared.
    pub fn correct(&self, to: &mut Hypothesis, z: &BlockOfAll<'_>) -> (AidStatus, Real) {
        let innovation = Innovation::of(&to.belief, &z.aid);
        let normalised = innovation.normalised();
        let gate = GateRule::Deweight(STATISTICS.noise_sd);
        let status = innovation.fuse(&mut to.belief, gate);
        let x = &mut to.belief.x;
        x[MASS] = x[MASS].clamp(0.0, self.model.nominal.max_load_kg);
        x[LENGTH] = x[LENGTH].clamp(-BALANCE.max_length, BALANCE.max_length);
        (status, normalised * normalised)
    }

    /// Carries a hypothesis over the length of a block.
    pub fn predict(&self, of: &mut Hypothesis, z: &BlockOfAll<'_>) {
        let (block, means) = (z.block, z.aid.means);
        let (T, x) = (block.length_s(), of.belief.x);
        let mut u = SwingInput {
            accelerations_mps2: block.accelerations().map(|a| a * means.load_cos),
            ..SwingInput::default()
        };
        let next = self.model.f(&x, &u, T);
        // The noise is that of the state at the end.
        self.add_noise(&mut u, &next, of, z);
        let (F, Q) = (self.model.F(&x, &u, T), self.model.Q(&u, T));
        ekf::predict(&mut of.belief, next, &F, &Q);
    }

    fn add_noise(
        &self,
        u: &mut SwingInput,
        x: &SVector<Real, N>,
        of: &mut Hypothesis,
        z: &BlockOfAll<'_>,
    ) {
        let (p, block, means) = (&self.params, z.block, z.aid.means);
        let mass = self.model.nominal.tare_kg + x[MASS];
        let grade = (means.tare_deep_kg + x[MASS] * means.load_deep) / mass;
        let v = Real::from(block.speed_mps).abs();
        let turn = if v > MOTION.moves_mps {
            ((grade - of.last_grade).abs() / (v * block.length_s())).min(RAIL.max_turn_radpm)
        } else {
            0.0
        };
        of.last_grade = grade;
        // Going back over rail that is no longer remembered: its grade is another.
        let behind_m = (means.behind_tare_kgm + x[MASS] * means.behind_load_m) / mass;
        let onto_m = (behind_m - of.last_behind_m).max(0.0);
        of.last_behind_m = behind_m;
        let same = exp(-onto_m / RAIL.eta_memory_m);
        u.length_m = self.model.length_m(x);
        u.noise_mass_kg = z.noise_kg;
        u.part_noise_mps2 = block.part_noise_mps2();
        u.force_sd_n = z.noise_kg
            * (p.force_sd_mps2
                + GRAVITY * turn * p.place_sd_m
                + p.bend_force_sd * means.bend_per_m);
        u.amplitude_rad2 = x[ANGLE] * x[ANGLE] + x[RATE] * x[RATE] * u.length_m / GRAVITY;
        u.new_grade_rad2 = p.eta_sd_rad * p.eta_sd_rad * (1.0 - same * same);
    }
}

/// Weight of the train, which turns shares of a parameter into forces, N: with a third of the largest load.
fn typical_n(nominal: &Nominal) -> Real {
    (nominal.tare_kg + nominal.max_load_kg / 3.0) * GRAVITY
}

/// Standard deviation of the constant part of the running resistance before any block, N.
fn resistance_sd_n(nominal: &Nominal, p: &SwingBalanceParams) -> Real {
    p.resistance_sd * nominal.mu * typical_n(nominal)
}

/// The belief before any block, for a load and its standard deviation, kg.
fn prior(nominal: &Nominal, p: &SwingBalanceParams, [load_kg, sd_kg]: [Real; 2]) -> Gaussian<N> {
    let (mu, weight) = (nominal.mu, typical_n(nominal));
    let mut x = SVector::zeros();
    x[MASS] = load_kg;
    x[R0] = (mu - nominal.mu_load) * weight;
    x[CV] = p.speed_resistance * mu * weight;
    let sd = SVector::from([
        sd_kg,
        resistance_sd_n(nominal, p),
        p.speed_resistance_sd * mu * weight,
        p.bend_resistance_sd,
        p.swing_sd,
        p.swing_rate_sd,
        p.force_sd_mps2 * weight / GRAVITY,
        p.eta_sd_rad,
        nominal.bias_sd_mps2,
        p.length_sd,
    ]);
    Gaussian::independent(x, sd)
}

state!(Hypothesis { belief, weight, last_grade, last_behind_m; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::aid::AidOutcome;
    use crate::api::mass_layout::MassLayout;
    use crate::fusion::swing_balance::block::{BlockBuilder, BlockInput};
    use crate::rail::rail_memory::RailMemory;
    use crate::testing::vehicles::vehicle;

    /// Balance of a train of 5 t with up to 22 t, on chains of this length or rigid.
    fn balance(chain_m: Real) -> SwingBalance {
        let mut layout = MassLayout::even(5_000.0, [0.0, 12.0], [0.0, 12.0]);
        layout.load.chain_m = chain_m;
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        SwingBalance::new(nominal, &Default::default(), &Default::default())
    }

    /// A hypothesis whose states are all correlated with one another.
    fn hypothesis(of: &SwingBalance) -> Hypothesis {
        let mut found = of.start([0.3, 0.1], 0.4);
        let sd = found.belief.P.diagonal().map(|p| p.sqrt());
        for i in 0..N {
            for j in (0..N).filter(|j| *j != i) {
                found.belief.P[(i, j)] = 0.3 * sd[i] * sd[j];
            }
        }
        found
    }

    #[test]
    fn a_start_is_a_share_of_the_largest_load_and_depends_on_nothing() {
        let start = balance(0.6).start([0.25, 0.05], 0.1);
        let [load, variance] = start.load();
        assert!((load - 0.25 * 22_000.0).abs() < 1e-9);
        assert!((variance.sqrt() - 0.05 * 22_000.0).abs() < 1e-9);
        let P = &start.belief.P;
        assert!((1..N).all(|i| P[(MASS, i)] == 0.0) && start.weight == 0.1);
    }

    /// All that a hypothesis of another load knows is what the first knows, but for the load and its swing, which are
    /// open, and the resistance, which is a tenth of its first variance less certain.
    #[test]
    fn another_load_opens_mass_and_swing() {
        let balance = balance(0.6);
        let mut of = hypothesis(&balance);
        of.belief.x[ANGLE] = 0.1;
        let other = balance.other(&of, [0.9, 0.01], 0.2);
        let (x, P) = (&other.belief.x, &other.belief.P);
        assert!((x[MASS] - 0.9 * 22_000.0).abs() < 1e-9 && x[ANGLE] == 0.0);
        for (i, sd) in [(MASS, 220.0 as Real), (ANGLE, 0.06), (RATE, 0.25)] {
            assert!((P[(i, i)].sqrt() / sd - 1.0).abs() < 1e-9);
            assert!((0..N).all(|j| j == i || P[(i, j)] == 0.0));
        }
        let first = balance.start([0.5, 0.1], 1.0).belief.P[(R0, R0)];
        let more = (P[(R0, R0)] - of.belief.P[(R0, R0)]) / first;
        assert!((more - 0.1).abs() < 1e-9, "{more}");
        assert!(x[R0] == of.belief.x[R0] && P[(R0, CV)] == of.belief.P[(R0, CV)]);
    }

    #[test]
    fn another_place_opens_the_grade_behind_and_the_swing_and_keeps_the_load() {
        let mut other = hypothesis(&balance(0.6));
        (other.belief.x[ETA], other.belief.x[RATE]) = (0.05, 0.2);
        let load = other.load();
        other.lose_place(0.3);
        assert_eq!(other.load(), load);
        for (i, sd) in [(ETA, 0.3 as Real), (ANGLE, 0.06), (RATE, 0.25)] {
            assert_eq!(other.belief.x[i], 0.0);
            assert!((other.belief.P[(i, i)].sqrt() / sd - 1.0).abs() < 1e-9);
        }
    }

    /// A merged hypothesis has the mean and the second moment of the mixture of both, by their weights.
    #[test]
    fn merging_keeps_mean_and_second_moment() {
        let balance = balance(0.6);
        let mut a = hypothesis(&balance);
        let mut b = balance.start([0.34, 0.05], 0.2);
        b.belief.x[R0] += 50.0;
        a.belief.symmetrise();
        let moment = |h: &Hypothesis| h.belief.P + h.belief.x * h.belief.x.transpose();
        let share = a.weight / (a.weight + b.weight);
        let mean = a.belief.x * share + b.belief.x * (1.0 - share);
        let second = moment(&a) * share + moment(&b) * (1.0 - share);
        a.merge(&b);
        assert!((a.belief.x - mean).norm() < 1e-9 * mean.norm());
        assert!((moment(&a) - second).norm() < 1e-9 * second.norm());
        assert!((a.weight - 0.6).abs() < 1e-12);
    }

    /// A block of half a second at a speed and an acceleration.
    fn block(speed_mps: Real, a: Real) -> Block {
        let (mut builder, rail) = (BlockBuilder::default(), RailMemory::new(12.0));
        let take = |k: u16| {
            let z = BlockInput {
                speed_mps: speed_mps + 0.01 * a * Real::from(k),
                acceleration_mps2: a,
                traction: Some([0.0, 100.0]),
                sound: true,
                ..BlockInput::default()
            };
            builder.take(&z, 10_000.0, &rail, 0.01)
        };
        (0..120).filter_map(take).nth(1).unwrap()
    }

    /// Means of rail that was read and is level.
    const LEVEL: TrainMeans = TrainMeans {
        tare_deep_kg: 0.0,
        tare_kg: 0.0,
        load_deep: 0.0,
        load: 0.0,
        load_cos: 1.0,
        load_curvature_per_m: 0.0,
        behind_tare_kgm: 0.0,
        behind_load_m: 0.0,
        ahead_kgm: 0.0,
        ahead_m: 0.0,
        ahead_rad_per_m: 0.02,
        bend_per_m: 0.0,
    };

    /// Corrects by a block whose traction is off what is expected by so many of its standard deviations; the variance
    /// of the innovation.
    fn correct(
        of: &SwingBalance,
        to: &mut Hypothesis,
        block: &Block,
        off_sd: Real,
    ) -> (AidStatus, Real, Real) {
        let x = to.belief.x;
        let BlockOfAll { aid, .. } = of.measurement(&x, block, &LEVEL);
        let h = aid.H(&x);
        let variance = (h.transpose() * to.belief.P * h).x + aid.R();
        let mut block = *block;
        block.traction_n += (off_sd * variance.sqrt() - aid.innovation(&x)) as f32;
        let z = of.measurement(&x, &block, &LEVEL);
        let (status, nis) = of.correct(to, &z);
        (status, nis, variance)
    }

    /// The normalised innovation squared is that of the noise as it is; beyond three standard deviations a block
    /// counts for less.
    #[test]
    fn a_block_far_off_counts_for_less() {
        let balance = balance(0.0);
        for (off_sd, outcome) in [
            (0.5, AidOutcome::Fused),
            (2.9, AidOutcome::Fused),
            (-6.0, AidOutcome::Deweighted),
        ] {
            let mut to = balance.start([0.3, 0.1], 1.0);
            let (status, nis, variance) = correct(&balance, &mut to, &block(1.0, 0.3), off_sd);
            assert_eq!(status.outcome, outcome);
            assert!((nis / (off_sd * off_sd) - 1.0).abs() < 1e-3, "{nis}");
            assert!((status.innovation_variance / variance - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_load_is_between_none_and_the_largest() {
        let balance = balance(0.0);
        for (off_sd, limit) in [(-3.0, 0.0), (3.0, 22_000.0)] {
            let mut to = balance.start([0.3, 0.1], 1.0);
            for _ in 0..20 {
                to.belief.P[(MASS, MASS)] = 1e8;
                correct(&balance, &mut to, &block(1.0, 0.8), off_sd);
            }
            assert_eq!(to.belief.x[MASS], limit);
        }
    }

    /// The force that no model has is 0.006 m/s² on the mass that the noise of all is proportional to, more where the
    /// grade changes with the way (by what the places of the masses are wrong by, 0.06 m) and in bends. The grade
    /// behind is another by the way of the masses onto rail that is not known, with a memory of 2 m; the swing is
    /// uncertain by its amplitude.
    #[test]
    fn the_noise_of_the_state_is_that_of_the_rail_and_of_the_swing() {
        let balance = balance(0.6);
        let mut of = hypothesis(&balance);
        of.belief.x[MASS] = 9_000.0;
        let mut x = of.belief.x;
        (x[ANGLE], x[RATE], x[LENGTH]) = (0.1, 0.3, 0.2);
        let none = TrainMeans {
            tare_deep_kg: 14_000.0 * 0.05,
            ..LEVEL
        };
        let noise = |of: &mut Hypothesis, load_kg: Real, speed: Real, means: &TrainMeans| {
            let mut u = SwingInput::default();
            let (block, mut heaviest) = (block(speed, 0.0), x);
            heaviest[MASS] = load_kg;
            let z = balance.measurement(&heaviest, &block, means);
            balance.add_noise(&mut u, &x, of, &z);
            u
        };
        noise(&mut of, 9_000.0, 1.0, &none);
        let length_s = block(1.0, 0.0).length_s();
        for (speed, change, bend, turn) in [
            (0.5, 0.0, 0.0, 0.0),
            (0.5, 0.01, 0.0, 0.01 / (0.5 * length_s)),
            (-0.5, -0.02, 0.1, 0.02 / (0.5 * length_s)),
            (0.5, 1.0, 0.0, 0.13),
            (0.04, 0.01, 0.2, 0.0),
        ] {
            for load_kg in [9_000.0, 15_000.0] {
                let mut of = of;
                let means = TrainMeans {
                    tare_deep_kg: 14_000.0 * (0.05 + change) - 9_000.0 * 0.02,
                    load_deep: 0.02,
                    bend_per_m: bend,
                    ..none
                };
                let u = noise(&mut of, load_kg, speed, &means);
                let sd = 0.006 + GRAVITY * turn * 0.06 + 0.15 * bend;
                let expected = (5_000.0 + load_kg) * sd;
                assert!(
                    (u.force_sd_n / expected - 1.0).abs() < 1e-6,
                    "{speed} {change}"
                );
                let again = noise(&mut of, load_kg, speed, &means).force_sd_n;
                let still = expected - GRAVITY * turn * 0.06 * u.noise_mass_kg;
                assert!((again / still - 1.0).abs() < 1e-6);
                let length_m = balance.model.length_m(&x);
                assert_eq!(u.length_m, length_m);
                let amplitude = 0.01 + 0.09 * length_m / GRAVITY;
                assert!((u.amplitude_rad2 / amplitude - 1.0).abs() < 1e-9);
            }
        }
        for (behind_m, onto_m) in [(0.5, 0.5), (0.5, 0.0), (0.2, 0.0), (1.2, 1.0)] {
            let means = TrainMeans {
                behind_tare_kgm: 5_000.0 * behind_m,
                behind_load_m: behind_m,
                ..none
            };
            let u = noise(&mut of, 9_000.0, -0.5, &means);
            let expected = 4e-4 * (1.0 - (-onto_m as Real).exp());
            assert!((u.new_grade_rad2 - expected).abs() < 1e-12, "{behind_m}");
        }
    }
}
