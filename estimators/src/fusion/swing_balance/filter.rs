//! Kalman filter of the force balance: [`SwingModel`] over blocks, each of which is one measurement ([`BlockForce`]).

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
use crate::api::aid::{AidOutcome, AidStatus};
use crate::api::real::{GRAVITY, exp};
use crate::api::snapshot::{Archive, State};
use crate::filters::ekf;
use crate::filters::gaussian::Gaussian;
use crate::filters::model::Process;
use crate::models::swing_balance::{
    ANGLE, ETA, LENGTH, MASS, N, Nominal, R0, RATE, SwingInput, SwingModel,
};
use crate::rail::train_means::TrainMeans;
use crate::tuning;

/// Correction by a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockCorrection {
    /// Status of the measurement.
    pub status: AidStatus,
    /// Innovation over its nominal standard deviation.
    pub normalised: Real,
    /// True if the block has corrected the load too.
    pub weighs: bool,
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingBalance {
    model: SwingModel,
    params: SwingBalanceParams,
    residual_noise: bool,
    belief: Gaussian<N>,
    inflation: Real,
    /// Mean square of the load's regressor without the resistance, m²/s⁴.
    excitation: Real,
    /// See [`SwingBalance::set_noise_mass`]; 0 for none.
    noise_kg: Real,
    last_grade: Real,
    last_behind_m: Real,
}

impl SwingBalance {
    /// Starts at the prior.
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
            residual_noise: supervision.residual_noise,
            belief: prior(&nominal, params),
            inflation: 1.0,
            excitation: 0.0,
            noise_kg: 0.0,
            last_grade: 0.0,
            last_behind_m: 0.0,
        }
    }

    /// State and covariance.
    pub fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Real {
        self.model.nominal.tare_kg + self.belief.x[MASS]
    }

    /// Mass that the noise of the model is proportional to, kg: that of the filter, or for comparing filters one for
    /// all.
    fn noise_mass_kg(&self) -> Real {
        if self.noise_kg > 0.0 {
            self.noise_kg
        } else {
            self.mass_kg()
        }
    }

    /// Returns true if the swing weighs the mass, so that the problem is not linear: the load swings, and the running
    /// resistance does not weigh it first.
    pub fn is_nonlinear(&self) -> bool {
        self.model.swings && self.model.nominal.mu_load < tuning::BALANCE.max_swing_mu
    }

    /// Sets the mass that the noise is proportional to, kg; `None` for the filter's own.
    pub fn set_noise_mass(&mut self, mass_kg: Option<Real>) {
        self.noise_kg = mass_kg.unwrap_or(0.0);
    }

    /// Carries a state over the length of a block, with the load on a grade of this cosine.
    pub fn carried(&self, x: SVector<Real, N>, block: &Block, cos: Real) -> SVector<Real, N> {
        let u = SwingInput {
            accelerations_mps2: block.accelerations().map(|a| a * cos),
            ..SwingInput::default()
        };
        self.model.f(&x, &u, block.length_s())
    }

    /// Innovation of a block that has not been taken, at the state `x`, N, and the variance of its noise without that
    /// of the rail that was not read, N².
    pub fn outlook(&self, x: &SVector<Real, N>, block: &Block, means: &TrainMeans) -> [Real; 2] {
        let read = TrainMeans {
            ahead_kgm: 0.0,
            ..*means
        };
        let aid = self.aid(&self.model, block, &read);
        [aid.innovation(x), aid.R()]
    }

    /// The measurement by a block.
    fn aid<'a>(
        &self,
        model: &'a SwingModel,
        block: &Block,
        means: &'a TrainMeans,
    ) -> BlockForce<'a> {
        let p = &self.params;
        let noise = BlockNoise {
            model_sd_mps2: p.model_sd_mps2,
            swing_model_sd: p.swing_model_sd,
            mass_kg: self.noise_mass_kg(),
            traction_variance: Real::from(block.variance),
            part_noise_mps2: block.part_noise_mps2(),
        };
        BlockForce {
            model,
            means,
            traction_n: Real::from(block.traction_n),
            speed_mps: Real::from(block.speed_mps),
            accelerations_mps2: block.accelerations(),
            substep_s: block.substep_s(),
            variance: 0.0,
        }
        .with_noise(&noise, &self.belief.x)
    }

    /// Takes a block whose rail has been read: corrects by it if it is of use (`refusal` is `None`), and carries the
    /// state over its length.
    pub fn step(
        &mut self,
        block: &Block,
        means: &TrainMeans,
        refusal: Option<AidOutcome>,
    ) -> BlockCorrection {
        let correction = match refusal {
            None => self.correct(block, means),
            Some(outcome) => BlockCorrection {
                status: AidStatus::not_fused(outcome),
                normalised: 0.0,
                weighs: false,
            },
        };
        self.predict(block, means);
        correction
    }

    fn correct(&mut self, block: &Block, means: &TrainMeans) -> BlockCorrection {
        let model = self.model;
        let aid = self.aid(&model, block, means);
        let of = |sd: Real| sd * sd;
        let share = (block.length_s() / tuning::BALANCE.excitation_s).min(1.0);
        let moved = of(aid.load_regressor(&self.belief.x));
        self.excitation += share * (moved - self.excitation);
        let mut innovation = Innovation::of(&self.belief, &aid);
        let normalised = innovation.normalised();
        if self.residual_noise {
            let most = of(normalised).min(tuning::STATISTICS.max_nis);
            let time = match most > self.inflation {
                true => tuning::BALANCE.inflate_s,
                false => 2.0 * tuning::BALANCE.inflate_s,
            };
            self.inflation += (block.length_s() / time) * (most - self.inflation);
            if self.inflation > tuning::BALANCE.min_inflation {
                innovation.R *= self.inflation;
            }
        }
        // The noise of the regressor would pass for information about a load that nothing moves: the load is then a
        // parameter that the filter considers and does not estimate (Schmidt 1966), whose mean and variance stay.
        let excited = self.excitation > of(tuning::BALANCE.min_excitation * block.noise_mps2());
        let (load, load_variance) = (self.belief.x[MASS], self.belief.P[(MASS, MASS)]);
        let gate = GateRule::Deweight(tuning::STATISTICS.noise_sd);
        let status = innovation.fuse(&mut self.belief, gate);
        if !excited {
            self.belief.x[MASS] = load;
            self.belief.P[(MASS, MASS)] = load_variance;
        }
        let x = &mut self.belief.x;
        x[MASS] = x[MASS].clamp(0.0, self.model.nominal.max_load_kg);
        x[LENGTH] = x[LENGTH].clamp(-tuning::BALANCE.max_length, tuning::BALANCE.max_length);
        BlockCorrection {
            status,
            normalised,
            weighs: excited,
        }
    }

    fn predict(&mut self, block: &Block, means: &TrainMeans) {
        let (T, x) = (block.length_s(), self.belief.x);
        let mut u = SwingInput {
            accelerations_mps2: block.accelerations().map(|a| a * means.load_cos),
            ..SwingInput::default()
        };
        let next = self.model.f(&x, &u, T);
        // The noise is that of the state at the end.
        self.add_noise(&mut u, &next, block, means);
        let (F, Q) = (self.model.F(&x, &u, T), self.model.Q(&u, T));
        ekf::predict(&mut self.belief, next, &F, &Q);
    }

    fn add_noise(
        &mut self,
        u: &mut SwingInput,
        x: &SVector<Real, N>,
        block: &Block,
        means: &TrainMeans,
    ) {
        let (p, mass) = (&self.params, self.mass_kg());
        let noisy = self.noise_mass_kg();
        let grade = (means.tare_deep_kg + x[MASS] * means.load_deep) / mass;
        let v = Real::from(block.speed_mps).abs();
        let turn = if v > tuning::MOTION.moves_mps {
            ((grade - self.last_grade).abs() / (v * block.length_s()))
                .min(tuning::RAIL.max_turn_radpm)
        } else {
            0.0
        };
        self.last_grade = grade;
        // Going back over rail that is no longer remembered: its grade is another.
        let behind_m = (means.behind_tare_kgm + x[MASS] * means.behind_load_m) / mass;
        let onto_m = (behind_m - self.last_behind_m).max(0.0);
        self.last_behind_m = behind_m;
        let same = exp(-onto_m / tuning::RAIL.eta_memory_m);
        u.length_m = self.model.length_m(x);
        u.noise_mass_kg = noisy;
        u.part_noise_mps2 = block.part_noise_mps2();
        u.force_sd_n = noisy
            * (p.force_sd_mps2
                + GRAVITY * turn * p.place_sd_m
                + p.bend_force_sd * means.bend_per_m);
        u.amplitude_rad2 = x[ANGLE] * x[ANGLE] + x[RATE] * x[RATE] * u.length_m / GRAVITY;
        u.new_grade_rad2 = p.eta_sd_rad * p.eta_sd_rad * (1.0 - same * same);
    }

    /// Sets the load to start from and its standard deviation, as shares of the largest load.
    pub fn start_from(&mut self, [load, sd]: [Real; 2]) {
        let most = self.model.nominal.max_load_kg;
        let (load_kg, sd_kg) = (load * most, sd * most);
        self.belief.set_independent(MASS, load_kg, sd_kg * sd_kg);
    }

    /// Load and its variance, as shares of the largest load and its square.
    pub fn load_share(&self) -> [Real; 2] {
        let most = self.model.nominal.max_load_kg;
        [
            self.belief.x[MASS] / most,
            self.belief.P[(MASS, MASS)] / (most * most),
        ]
    }

    /// Widens the variance of the load to this share of the square of the largest load. The other states go with the
    /// load as the blocks have tied them to it: what is known of them for a given load stays.
    pub fn widen(&mut self, variance: Real) {
        let most = self.model.nominal.max_load_kg;
        let found = self.belief.P[(MASS, MASS)];
        let added = variance * most * most - found;
        if added > 0.0 && found > 0.0 {
            let by_load = self.belief.P.column(MASS) / found;
            self.belief.P += by_load * (added * by_load.transpose());
        }
    }

    /// Opens what another place on the rail makes another: the grade behind with the standard deviation
    /// `behind_sd_rad`, and the swing.
    pub fn lose_place(&mut self, behind_sd_rad: Real) {
        let [angle, rate] = tuning::BALANCE.new_swing_sd;
        for (i, sd) in [(ETA, behind_sd_rad), (ANGLE, angle), (RATE, rate)] {
            self.belief.set_independent(i, 0.0, sd * sd);
        }
        (self.last_grade, self.last_behind_m) = (0.0, 0.0);
    }

    /// Takes another load for possible: the mass as at the start, the swing open, the resistance a little.
    pub fn reset_load(&mut self) {
        self.belief.x[MASS] = self.model.nominal.load0_kg;
        self.open_load();
    }

    /// Takes a total mass, kg, of this variance, kg², for measured.
    pub fn recall(&mut self, mass_kg: Real, variance: Real) {
        let off = mass_kg - self.mass_kg();
        let mut h = SVector::<Real, N>::zeros();
        h.iter_mut().skip(MASS).take(1).for_each(|h| *h = 1.0);
        // Without a correction, for numbers that allow none, the mass stays as weighed.
        let _ = self.belief.correct_scalar(off, &h, variance);
    }

    /// Takes another load for possible, as above; the mass keeps its value.
    pub fn open_load(&mut self) {
        let fresh = prior(&self.model.nominal, &self.params);
        let [angle, rate] = tuning::BALANCE.new_swing_sd;
        let opened = [
            (MASS, self.belief.x[MASS], fresh.P[(MASS, MASS)]),
            (ANGLE, 0.0, angle * angle),
            (RATE, 0.0, rate * rate),
        ];
        for (i, mean, variance) in opened {
            self.belief.set_independent(i, mean, variance);
        }
        self.belief.P[(R0, R0)] += tuning::BALANCE.reopen * fresh.P[(R0, R0)];
        self.inflation = 1.0;
    }
}

/// The belief before any block.
fn prior(nominal: &Nominal, p: &SwingBalanceParams) -> Gaussian<N> {
    let mass = nominal.tare_kg + nominal.load0_kg;
    let weight = mass * GRAVITY;
    let mu = nominal.mu;
    let typical_kg = nominal.tare_kg + nominal.max_load_kg / 3.0;
    let x = SVector::from([
        nominal.load0_kg,
        (mu - nominal.mu_load) * typical_kg * GRAVITY,
        p.speed_resistance * mu * weight,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    ]);
    let sd = SVector::from([
        0.25 * nominal.max_load_kg,
        p.resistance_sd * mu * weight,
        p.speed_resistance_sd * mu * weight,
        p.bend_resistance_sd,
        p.swing_sd,
        p.swing_rate_sd,
        p.force_sd_mps2 * mass,
        p.eta_sd_rad,
        nominal.bias_sd_mps2,
        p.length_sd,
    ]);
    Gaussian::independent(x, sd)
}

impl State for SwingBalance {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            belief,
            inflation,
            excitation,
            noise_kg,
            last_grade,
            last_behind_m,
            model: _,
            params: _,
            residual_noise: _,
        } = self;
        belief.visit_lower(archive);
        inflation.visit(archive);
        excitation.visit(archive);
        noise_kg.visit(archive);
        last_grade.visit(archive);
        last_behind_m.visit(archive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::mass_layout::MassLayout;
    use crate::fusion::swing_balance::block::{BlockBuilder, BlockInput};
    use crate::rail::rail_memory::RailMemory;
    use crate::testing::vehicles::vehicle;

    /// A filter of a train of 5 t with up to 22 t on chains, whose load is correlated with all else.
    fn filter() -> SwingBalance {
        let mut layout = MassLayout::even(5_000.0, [0.0, 12.0], [0.0, 12.0]);
        layout.load.chain_m = 0.6;
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        let mut filter = SwingBalance::new(nominal, &Default::default(), &Default::default());
        for i in 0..N {
            for j in 0..N {
                let P = &filter.belief.P;
                let sds = P[(i, i)].sqrt() * P[(j, j)].sqrt();
                filter.belief.P[(i, j)] = if i == j { sds } else { 0.3 * sds };
            }
        }
        filter
    }

    fn correlation(filter: &SwingBalance, i: usize) -> Real {
        let P = &filter.belief.P;
        P[(MASS, i)] / (P[(MASS, MASS)] * P[(i, i)]).sqrt()
    }

    #[test]
    fn a_start_is_a_share_of_the_largest_load_and_depends_on_nothing() {
        let mut filter = filter();
        filter.start_from([0.25, 0.05]);
        let [load, variance] = filter.load_share();
        assert!((load - 0.25).abs() < 1e-12 && (variance - 0.0025).abs() < 1e-12);
        assert!((filter.mass_kg() - (5_000.0 + 0.25 * 22_000.0)).abs() < 1e-6);
        assert!((1..N).all(|i| correlation(&filter, i) == 0.0));
    }

    /// Widened, the load has that variance; for a given load the others have the mean and the covariance they had. One
    /// that is wider already stays.
    #[test]
    fn widening_sets_the_variance_and_keeps_what_is_known_for_a_given_load() {
        let given_load = |filter: &SwingBalance| {
            let P = &filter.belief.P;
            let by_load = P.column(MASS) / P[(MASS, MASS)];
            (by_load, P - by_load * P.row(MASS))
        };
        let of = filter();
        let [load, variance] = of.load_share();
        for (factor, expected) in [(4.0, 4.0), (1.5, 1.5), (0.5, 1.0)] {
            let mut wider = of;
            wider.widen(factor * variance);
            let [same, found] = wider.load_share();
            assert!(
                (found / (expected * variance) - 1.0).abs() < 1e-9,
                "{factor}"
            );
            assert_eq!(same, load);
            let ((slopes, rest), (slopes_of, rest_of)) = (given_load(&wider), given_load(&of));
            assert!((slopes - slopes_of).norm() < 1e-12 * slopes_of.norm());
            for i in (0..N).filter(|i| *i != MASS) {
                let off = rest.column(i) - rest_of.column(i);
                let sds = rest_of.diagonal().map(|p| p.max(0.0).sqrt()) * rest_of[(i, i)].sqrt();
                assert!(
                    off.iter()
                        .zip(&sds)
                        .all(|(off, sd)| off.abs() < 1e-9 * sd + 1e-12)
                );
            }
        }
    }

    /// A mass that is recalled is a second measurement of it: precisions add up, and each mean has its share.
    #[test]
    fn a_mass_recalled_is_weighed_against_the_one_found() {
        let mut filter = filter();
        let (found, before) = (filter.mass_kg(), filter.belief.P[(MASS, MASS)]);
        let (recalled, variance) = (found + 900.0, 0.5 * before);
        filter.recall(recalled, variance);
        let expected = (found / before + recalled / variance) / (1.0 / before + 1.0 / variance);
        assert!((filter.mass_kg() / expected - 1.0).abs() < 1e-9);
        let after = filter.belief.P[(MASS, MASS)];
        assert!((after * (1.0 / before + 1.0 / variance) - 1.0).abs() < 1e-9);
    }

    /// Another load is as uncertain as the first, its swing is open, and the resistance is a hundredth of its first
    /// variance less certain. Opened, the mass keeps its value; reset, it is that of the start.
    #[test]
    fn another_load_opens_mass_and_swing() {
        let first = prior(&filter().model.nominal, &Default::default());
        for reset in [false, true] {
            let mut other = filter();
            other.start_from([0.9, 0.01]);
            other.belief.x[ANGLE] = 0.1;
            other.inflation = 3.0;
            let (kept, resistance) = (other.mass_kg(), other.belief.P[(R0, R0)]);
            if reset {
                other.reset_load();
            } else {
                other.open_load();
            }
            let expected = if reset { 5_000.0 + first.x[MASS] } else { kept };
            assert_eq!(other.mass_kg(), expected);
            let P = &other.belief.P;
            assert_eq!(P[(MASS, MASS)], first.P[(MASS, MASS)]);
            assert_eq!(other.belief.x[ANGLE], 0.0);
            for (i, sd) in [(ANGLE, 0.06 as Real), (RATE, 0.25)] {
                assert!((P[(i, i)].sqrt() / sd - 1.0).abs() < 1e-9);
                assert!((0..N).all(|j| j == i || P[(i, j)] == 0.0));
            }
            let more = (P[(R0, R0)] - resistance) / first.P[(R0, R0)];
            assert!((more - 0.01).abs() < 1e-9, "{more}");
            assert_eq!(other.inflation, 1.0);
        }
    }

    #[test]
    fn another_place_opens_the_grade_behind_and_the_swing_and_keeps_the_load() {
        let mut other = filter();
        (other.belief.x[ETA], other.belief.x[RATE]) = (0.05, 0.2);
        let load = other.load_share();
        other.lose_place(0.3);
        assert_eq!(other.load_share(), load);
        for (i, sd) in [(ETA, 0.3 as Real), (ANGLE, 0.06), (RATE, 0.25)] {
            assert_eq!(other.belief.x[i], 0.0);
            assert!((other.belief.P[(i, i)].sqrt() / sd - 1.0).abs() < 1e-9);
        }
    }

    /// The problem is not linear where a load swings on chains and the running resistance does not weigh it first.
    #[test]
    fn a_load_that_swings_and_rolls_lightly_is_not_linear() {
        let mut filter = filter();
        assert!(filter.is_nonlinear());
        filter.model.nominal.mu_load = 0.06;
        assert!(!filter.is_nonlinear());
        filter.model.nominal.mu_load = 0.0;
        filter.model.swings = false;
        assert!(!filter.is_nonlinear());
    }

    /// A block of half a second at a speed and an acceleration, whose speeds have a noise, m/s.
    fn block(speed_mps: Real, a: Real, noise_mps: Real) -> Block {
        let (mut builder, rail) = (BlockBuilder::default(), RailMemory::new(12.0));
        let take = |k: u16| {
            let z = BlockInput {
                speed_mps: speed_mps + 0.01 * a * Real::from(k),
                acceleration_mps2: a,
                speed_noise_mps: noise_mps,
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

    /// A filter of a load that does not swing, with the noise of the residuals or without.
    fn rigid(residual_noise: bool) -> SwingBalance {
        let layout = MassLayout::even(5_000.0, [0.0, 12.0], [0.0, 12.0]);
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        let supervision = SwingSupervision {
            residual_noise,
            ..Default::default()
        };
        SwingBalance::new(nominal, &Default::default(), &supervision)
    }

    /// Corrects by a block whose traction is off what is expected by so many of its standard deviations; the parts of
    /// the variance of the innovation that are of the state and of the noise.
    fn correct(
        filter: &mut SwingBalance,
        block: &Block,
        off_sd: Real,
    ) -> (BlockCorrection, [Real; 2]) {
        let (model, x) = (filter.model, filter.belief.x);
        let aid = filter.aid(&model, block, &LEVEL);
        let h = aid.H(&x);
        let of_state = (h.transpose() * filter.belief.P * h).x;
        let of_noise = aid.R();
        let mut block = *block;
        let off = off_sd * (of_state + of_noise).sqrt() - aid.innovation(&x);
        block.traction_n += off as f32;
        (filter.correct(&block, &LEVEL), [of_state, of_noise])
    }

    /// The factor on the noise goes to the square of the residuals with a memory of 4 s where they grow, of 8 s where
    /// they fall, and to 25 at most. It acts from 1.2 on, on the noise and not on the state; switched off it is 1.
    #[test]
    fn the_factor_on_the_noise_follows_the_residuals() {
        let (now, share) = (block(1.0, 0.3, 0.0), block(1.0, 0.3, 0.0).length_s());
        for on in [true, false] {
            let first = rigid(on);
            let mut expected: Real = 1.0;
            let mut filter = first;
            for (off_sd, blocks) in [(3.0, 20), (-0.5, 40), (1.05, 60), (-9.0, 60)] {
                for _ in 0..blocks {
                    filter.belief = first.belief;
                    let (found, [of_state, of_noise]) = correct(&mut filter, &now, off_sd);
                    let most = (off_sd * off_sd as Real).min(25.0);
                    let memory_s = if most > expected { 4.0 } else { 8.0 };
                    if on {
                        expected += share / memory_s * (most - expected);
                    }
                    assert!((filter.inflation / expected - 1.0).abs() < 1e-3);
                    assert!((found.normalised / off_sd - 1.0).abs() < 1e-3, "{found:?}");
                    let factor = if expected > 1.2 { expected } else { 1.0 };
                    let variance = of_state + factor * of_noise;
                    let found = found.status.innovation_variance;
                    assert!((found / variance - 1.0).abs() < 1e-3, "{found} {variance}");
                }
            }
        }
    }

    /// A block weighs the load where the root of the mean square of what moves it, over 10 s, is five times the noise
    /// of it. One that does not leaves load and variance as they are, and corrects the rest.
    #[test]
    fn a_load_that_nothing_moves_is_not_weighed() {
        let noise = block(1.0, 0.0, 0.0036).noise_mps2();
        for (by, weighs) in [(0.97, false), (1.03, true), (-1.03, true)] {
            let now = block(1.0, by * 5.0 * noise, 0.0036);
            let mut filter = rigid(true);
            filter.excitation = now.mean_acceleration().powi(2);
            let before = filter.belief;
            let (found, _) = correct(&mut filter, &now, 2.0);
            assert_eq!(found.weighs, weighs, "{by}");
            let after = filter.belief;
            assert_eq!(after.x[MASS] != before.x[MASS], weighs);
            assert_eq!(after.P[(MASS, MASS)] < before.P[(MASS, MASS)], weighs);
            assert!(after.x[R0] > before.x[R0] && after.P[(R0, R0)] < before.P[(R0, R0)]);
        }
        let (mut filter, now) = (rigid(true), block(1.0, 0.3, 0.0));
        for k in 1..=60 {
            correct(&mut filter, &now, 0.0);
            let share = 1.0 - (1.0 - now.length_s() / 10.0).powi(k);
            assert!((filter.excitation / (0.09 * share) - 1.0).abs() < 1e-2);
        }
    }

    #[test]
    fn a_load_is_between_none_and_the_largest() {
        for (off_sd, limit) in [(-3.0, 0.0), (3.0, rigid(false).model.nominal.max_load_kg)] {
            let mut filter = rigid(false);
            for _ in 0..20 {
                filter.belief.P[(MASS, MASS)] = 1e8;
                correct(&mut filter, &block(1.0, 0.8, 0.0), off_sd);
            }
            assert_eq!(filter.belief.x[MASS], limit);
        }
    }

    /// The force that no model has is 0.006 m/s² on the mass, more where the grade changes with the way (by what the
    /// places of the masses are wrong by, 0.06 m) and in bends. The grade behind is another by the way of the masses
    /// onto rail that is not known, with a memory of 2 m; the swing is uncertain by its amplitude.
    #[test]
    fn the_noise_of_the_state_is_that_of_the_rail_and_of_the_swing() {
        let mut of = filter();
        of.belief.x[MASS] = 9_000.0;
        let mut x = of.belief.x;
        (x[ANGLE], x[RATE], x[LENGTH]) = (0.1, 0.3, 0.2);
        let none = TrainMeans {
            tare_deep_kg: 14_000.0 * 0.05,
            ..LEVEL
        };
        let noise = |filter: &mut SwingBalance, speed: Real, means: &TrainMeans| {
            let mut u = SwingInput::default();
            filter.add_noise(&mut u, &x, &block(speed, 0.0, 0.0), means);
            u
        };
        noise(&mut of, 1.0, &none);
        let length_s = block(1.0, 0.0, 0.0).length_s();
        for (speed, change, bend, turn) in [
            (0.5, 0.0, 0.0, 0.0),
            (0.5, 0.01, 0.0, 0.01 / (0.5 * length_s)),
            (-0.5, -0.02, 0.1, 0.02 / (0.5 * length_s)),
            (0.5, 1.0, 0.0, 0.13),
            (0.04, 0.01, 0.2, 0.0),
        ] {
            for mass_kg in [None, Some(20_000.0)] {
                let mut filter = of;
                filter.set_noise_mass(mass_kg);
                let means = TrainMeans {
                    tare_deep_kg: 14_000.0 * (0.05 + change) - 9_000.0 * 0.02,
                    load_deep: 0.02,
                    bend_per_m: bend,
                    ..none
                };
                let u = noise(&mut filter, speed, &means);
                let sd = 0.006 + GRAVITY * turn * 0.06 + 0.15 * bend;
                let expected = mass_kg.unwrap_or(14_000.0) * sd;
                assert!(
                    (u.force_sd_n / expected - 1.0).abs() < 1e-6,
                    "{speed} {change}"
                );
                let again = noise(&mut filter, speed, &means).force_sd_n;
                assert!(
                    (again / (expected - GRAVITY * turn * 0.06 * u.noise_mass_kg) - 1.0).abs()
                        < 1e-6
                );
                let length_m = filter.model.length_m(&x);
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
            let u = noise(&mut of, -0.5, &means);
            let expected = 4e-4 * (1.0 - (-onto_m as Real).exp());
            assert!((u.new_grade_rad2 - expected).abs() < 1e-12, "{behind_m}");
        }
    }
}
