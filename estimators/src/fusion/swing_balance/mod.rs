//! Mass by a force balance in which the load swings: blocks of half a second that wait until the rail under the train
//! has been read, a Kalman filter over them ([`filter`]), and a load-change detector that goes back to where the change
//! began.
//!
//! The load on chains is a pendulum driven by the measured acceleration: every start weighs it (its pull against the
//! train is m_L a_L, known in time but for m_L), so the mass is there after the first start and not only after a change
//! of grade. Source: ours.

pub mod block;
pub mod filter;
pub mod params;
pub mod scaled_cusum;
pub mod start_search;
pub mod torque_monitor;

use nalgebra::SVector;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::standing_load::KeptMass;
use crate::fusion::effective::GradeByForce;
use crate::models::swing_balance::{ANGLE, CV, ETA, MASS, N, Nominal, R0};
use crate::rail::mass_on_rail::MassOnRail;
use crate::rail::rail_memory::RailMemory;
use crate::rail::train_means::{TrainMeans, TrainOnRail};
use crate::tuning;
use block::{Block, BlockBuilder, BlockInput};
use filter::{BlockCorrection, SwingBalance};
use params::{SwingBalanceParams, SwingSupervision};
use scaled_cusum::ScaledCusum;
use start_search::StartSearch;

/// The filter at the last block at which no residual hinted at another load.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RollBack {
    filter: SwingBalance,
    /// The block that comes next.
    next: u64,
    /// True if the filter has gone back to it already, for another load.
    spent: bool,
}

/// State of the balance that is published: while the start is searched the filter goes over old blocks, and this stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BalanceState {
    /// State, in the order of [`crate::models::swing_balance`].
    pub x: SVector<Real, N>,
    /// Variance of the load, kg².
    pub mass_variance: Real,
    /// Variance of the grade behind the rail read, rad².
    pub eta_variance: Real,
}

#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
impl BalanceState {
    fn by(filter: &SwingBalance) -> Self {
        let belief = filter.belief();
        Self {
            x: belief.x,
            mass_variance: belief.P[(MASS, MASS)],
            eta_variance: belief.P[(ETA, ETA)],
        }
    }
}

/// The estimator of the mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingMass {
    supervision: SwingSupervision,
    train: TrainOnRail,
    tare_kg: Real,
    gain_sd: Real,
    front_m: Real,
    /// The filter; while the start is searched that of the pass.
    filter: SwingBalance,
    found: BalanceState,
    roll_back: RollBack,
    kept: KeptMass,
    search: StartSearch,
    /// Block that comes next in a pass of the start search, and the one that every pass begins with.
    trial_next: u64,
    search_from: u64,
    /// True if the start has been searched since it was new.
    searched: bool,
    residuals: ScaledCusum,
    /// Mean of the normalised residuals of late.
    lean: Real,
    /// Innovation of the newest block and its variance, and the block up to which a jump of it takes the mark.
    outlook: Option<[Real; 2]>,
    jumped: u64,
    builder: BlockBuilder,
    blocks: [Block; tuning::QUEUE.blocks],
    /// Blocks written and taken since the start.
    written: u64,
    taken: u64,
    settle_s: Real,
    changes: u32,
    used: u32,
    /// Block up to which what is published stays as it is, and what is: mass and its standard deviation, kg.
    catch_up: u64,
    published: [Real; 2],
    new_nis: Option<(Real, Real)>,
    status: AidStatus,
}

#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
impl SwingMass {
    /// Builds the mass estimator from the train's nominal values.
    pub fn new(
        nominal: Nominal,
        train: TrainOnRail,
        params: SwingBalanceParams,
        supervision: SwingSupervision,
        drives: usize,
    ) -> Self {
        let filter = SwingBalance::new(nominal, &params, &supervision);
        let [front_m, _] = train.span_m();
        let mut mass = Self {
            supervision,
            train,
            tare_kg: nominal.tare_kg,
            gain_sd: params.gain_sd(drives),
            front_m: -front_m,
            filter,
            found: BalanceState::by(&filter),
            roll_back: RollBack {
                filter,
                next: 0,
                spent: false,
            },
            kept: KeptMass::default(),
            search: StartSearch::default(),
            trial_next: 0,
            search_from: 0,
            searched: false,
            catch_up: 0,
            published: [0.0; 2],
            residuals: ScaledCusum::default(),
            lean: 0.0,
            outlook: None,
            jumped: 0,
            builder: BlockBuilder::default(),
            blocks: [Block::default(); tuning::QUEUE.blocks],
            written: 0,
            taken: 0,
            settle_s: 0.0,
            changes: 0,
            used: 0,
            new_nis: None,
            status: AidStatus::default(),
        };
        mass.publish();
        mass
    }

    /// One sample, with the total mass before it, kg; returns the grade by the force of a block when one is whole. At
    /// most one waiting block is worked off.
    pub fn step(
        &mut self,
        z: &BlockInput,
        mass_kg: Real,
        rail: &RailMemory,
        dt: Real,
    ) -> Option<GradeByForce> {
        self.new_nis = None;
        let mut grade = None;
        if let Some(block) = self.builder.take(z, mass_kg, rail, dt) {
            grade = Some(self.watch(&block, rail));
            if let Some(place) = self.blocks.get_mut(slot(self.written)) {
                *place = block;
            }
            self.written += 1;
            self.taken = self
                .taken
                .max(self.written.saturating_sub(tuning::QUEUE.blocks as u64 - 1));
        }
        if self.search.is_active() {
            let blocks = (dt / tuning::QUEUE.search_period_s) as u32;
            for _ in 0..blocks.clamp(1, tuning::QUEUE.max_search_blocks) {
                self.search_step(rail);
            }
        } else if self.taken < self.written {
            let block = self.block(self.taken);
            let full = self.written - self.taken >= tuning::QUEUE.blocks as u64 - 1;
            let waits = self.supervision.wait_for_rail
                && !full
                && z.speed_mps > tuning::MOTION.moves_mps
                && !rail.read_up_to(block.place, self.front_m);
            if !waits {
                self.taken += 1;
                self.take(&block, rail);
                self.found = BalanceState::by(&self.filter);
                self.begin_search();
                if !self.search.is_active() {
                    self.publish();
                }
            }
        }
        if z.brake > tuning::BLOCK.max_brake {
            self.status = AidStatus::not_fused(AidOutcome::Rejected(Rejection::NotRunning));
        }
        grade
    }

    /// Looks at a new block before its turn and returns the grade by its force.
    fn watch(&mut self, block: &Block, rail: &RailMemory) -> GradeByForce {
        let v = Real::from(block.speed_mps);
        let means = self.train.at(rail, block.place);
        let sound = block.outcome == AidOutcome::Fused
            && v.abs() > tuning::MOTION.moves_mps
            && !self.search.is_active();
        let now = sound.then(|| {
            let mut x = self.filter.belief().x;
            for number in self.taken..self.written {
                x = self.filter.carried(x, &self.block(number), means.load_cos);
            }
            self.filter.outlook(&x, block, &means)
        });
        self.look_for_jump(now.filter(|_| self.searched), block, &means);
        let carried = self.carried();
        let weight_n = carried.mass_kg * GRAVITY;
        let swing_rad = self.found.x[ANGLE] * carried.load_kg / carried.mass_kg;
        let of = |sd: Real| sd * sd;
        GradeByForce {
            way_m: v.abs() * block.length_s(),
            unread_variance: carried.unread_variance(&means),
            difference: now.filter(|_| self.has_weighed()).map(|[y, variance]| {
                let moved = of(block.mean_acceleration() / GRAVITY) + of(swing_rad);
                let sd =
                    of(tuning::EFFECTIVE.force_sd_rad) + of(tuning::EFFECTIVE.force_motion) * moved;
                [y / weight_n, variance / of(weight_n) + sd]
            }),
        }
    }

    /// Takes the innovation of a new block against that of the last: a force that jumps from one block to the next is
    /// that of another load, because the rail that has not been read cannot change so fast.
    fn look_for_jump(&mut self, now: Option<[Real; 2]>, block: &Block, means: &TrainMeans) {
        let v = Real::from(block.speed_mps);
        let last = core::mem::replace(&mut self.outlook, now);
        let (Some([y, variance]), Some([last, last_variance])) = (now, last) else {
            return;
        };
        let unread_kg = 2.0 * means.ahead_kgm / means.ahead_m.max(tuning::RAIL.min_ahead_m);
        // The rail ahead turns, and so does the gradient at the end of what was read, which it is taken to go on by.
        let turn_rad =
            tuning::RAIL.max_turn_radpm * v.abs() * block.length_s() * (1.0 + means.ahead_m);
        let behind_m = match means.behind_tare_kgm > 0.0 {
            true => v.abs() * block.length_s() / tuning::RAIL.eta_m,
            false => 0.0,
        };
        let behind_rad = sqrt(self.found.eta_variance) * behind_m;
        let bent = GRAVITY * (unread_kg * turn_rad + self.mass_kg() * behind_rad);
        if (y - last).abs() > tuning::QUEUE.jump_sd * sqrt(variance + last_variance) + bent {
            self.jumped = self.written + tuning::QUEUE.settling_blocks;
        }
    }

    /// Reason why a block is of no use; `None` if it is of use.
    fn refusal(&self, block: &Block, means: &TrainMeans) -> Option<AidOutcome> {
        let moving = Real::from(block.speed_mps).abs() > tuning::MOTION.moves_mps;
        // Going back over rail that is no longer remembered, or never was.
        let onto_unknown = block.speed_mps < 0.0
            && means.behind_tare_kgm > tuning::RAIL.max_behind_m * self.tare_kg;
        if !moving || self.settle_s > 0.0 {
            Some(AidOutcome::Rejected(Rejection::NotRunning))
        } else if block.outcome != AidOutcome::Fused {
            Some(block.outcome)
        } else if means.ahead_m > tuning::RAIL.max_ahead_m || onto_unknown {
            Some(AidOutcome::Rejected(Rejection::NotExcited))
        } else {
            None
        }
    }

    /// The means over the train at a block, and the reason why it is of no use, if there is one.
    fn look(&mut self, block: &Block, rail: &RailMemory) -> (Option<AidOutcome>, TrainMeans) {
        let means = self.train.at(rail, block.place);
        let moving = Real::from(block.speed_mps).abs() > tuning::MOTION.moves_mps;
        self.settle_s = match moving {
            true => (self.settle_s - block.length_s()).max(0.0),
            false => tuning::QUEUE.settle_s,
        };
        (self.refusal(block, &means), means)
    }

    fn take(&mut self, block: &Block, rail: &RailMemory) {
        let (refusal, means) = self.look(block, rail);
        let correction = self.filter.step(block, &means, refusal);
        let BlockCorrection {
            status,
            normalised,
            weighs,
        } = correction;
        self.status = status;
        if is_used(&status) {
            let share = block.length_s() / (tuning::QUEUE.lean_memory_s + block.length_s());
            self.lean += share * (normalised - self.lean);
        }
        if is_used(&status) && weighs {
            self.used = self.used.saturating_add(1);
            self.new_nis = Some((normalised * normalised, block.length_s()));
            if self.residuals.alarm(normalised, block.length_s())
                && self.supervision.load_change_detector
            {
                self.go_back();
                return;
            }
        }
        if is_used(&status) && self.used > tuning::QUEUE.settled_blocks {
            let found = BalanceState::by(&self.filter);
            let mass_kg = self.filter.mass_kg();
            if let Some([kept_kg, variance]) = self.kept.recall(mass_kg, found.mass_variance) {
                self.filter.recall(kept_kg, variance);
            }
        }
        if Real::from(block.speed_mps).abs() <= tuning::MOTION.moves_mps {
            self.residuals.clear();
        }
        let settled = self.used == 0 || self.used > tuning::QUEUE.settled_blocks;
        if self.residuals.at_rest() && settled {
            self.roll_back = RollBack {
                filter: self.filter,
                next: self.taken,
                spent: false,
            };
        }
    }

    /// Begins the start search when enough blocks have been used.
    fn begin_search(&mut self) {
        let new = self.new_nis.is_some();
        let due = self.used == tuning::QUEUE.first_look_blocks
            || self.used == tuning::QUEUE.settled_blocks;
        if !new || !due {
            return;
        }
        if !self.supervision.start_search || !self.filter.is_nonlinear() {
            self.searched = true;
            return;
        }
        let kept_from =
            (self.written + tuning::QUEUE.spare_blocks).saturating_sub(tuning::QUEUE.blocks as u64);
        // A second search that has lost the start would have less data than the first.
        if self.searched && kept_from > self.roll_back.next {
            return;
        }
        self.search_from = self.roll_back.next.max(kept_from);
        self.search.begin(self.filter.load_share());
        self.begin_pass();
    }

    fn begin_pass(&mut self) {
        self.filter = self.roll_back.filter;
        if self.roll_back.spent || self.search_from > self.roll_back.next {
            self.filter.reset_load();
        }
        self.filter.start_from(self.search.start());
        // one noise for all passes, so that they can be compared
        self.filter.set_noise_mass(match self.search.is_last() {
            true => None,
            false => Some(self.mass_kg()),
        });
        self.trial_next = self.search_from;
        self.settle_s = 0.0;
    }

    /// One block of a pass of the start search.
    fn search_step(&mut self, rail: &RailMemory) {
        if !self.search.is_active() {
            return;
        }
        if self.written.saturating_sub(self.trial_next) > tuning::QUEUE.blocks as u64 {
            // blocks came faster than they could be gone over: from the start
            self.search.stop();
            self.filter = self.roll_back.filter;
            self.filter.reset_load();
            (self.used, self.searched) = (0, false);
            return;
        }
        let block = self.block(self.trial_next);
        self.trial_next += 1;
        let (refusal, means) = self.look(&block, rail);
        let status = self.filter.step(&block, &means, refusal).status;
        if let Some(nis) = status.nis().filter(|_| is_used(&status)) {
            self.search.take(nis);
        }
        if self.trial_next < self.taken {
            return;
        }
        let [load, variance] = self.filter.load_share();
        match self.search.close(load, variance) {
            None => self.begin_pass(),
            Some(variance) => {
                self.filter.widen(variance);
                self.found = BalanceState::by(&self.filter);
                self.searched = true;
                self.residuals = ScaledCusum::default();
                self.publish();
            }
        }
    }

    fn block(&self, number: u64) -> Block {
        self.blocks.get(slot(number)).copied().unwrap_or_default()
    }

    fn publish(&mut self) {
        if self.taken >= self.catch_up && self.held_kg().is_none() {
            let variance = self.filter.belief().P[(MASS, MASS)];
            self.published = [self.filter.mass_kg(), self.sd_kg(variance)];
        }
    }

    /// Standard deviation of a mass of the filter's variance, kg², with that of the scale of the force, kg.
    fn sd_kg(&self, variance: Real) -> Real {
        let gain = self.gain_sd * self.filter.mass_kg();
        sqrt(variance + gain * gain)
    }

    /// Goes back to the last block at which no residual hinted at another load, opens the mass, and goes over the
    /// blocks since then again. It never goes back to the same block twice, because with a wrong model that would have
    /// no end.
    fn go_back(&mut self) {
        let kept = self.written.saturating_sub(self.roll_back.next) < tuning::QUEUE.blocks as u64;
        if !self.roll_back.spent && kept {
            self.filter = self.roll_back.filter;
            self.catch_up = self.catch_up.max(self.taken);
            self.taken = self.roll_back.next;
        } else {
            (self.roll_back.filter, self.roll_back.next) = (self.filter, self.taken);
        }
        self.roll_back.spent = true;
        self.kept.forget();
        self.filter.reset_load();
        self.residuals = ScaledCusum::paused();
        self.settle_s = 0.0;
        self.used = 0;
        self.searched = false;
        self.changes = self.changes.saturating_add(1);
    }

    /// Takes it that the train came unseen to where it is: the rail of the blocks kept is no longer known, the load may
    /// swing, and the grade behind the rail read has the standard deviation `behind_sd_rad`.
    pub fn lose_place(&mut self, behind_sd_rad: Real) {
        let outcome = AidOutcome::Stale;
        self.blocks
            .iter_mut()
            .for_each(|block| block.outcome = outcome);
        self.builder = BlockBuilder::default();
        self.taken = self.written;
        self.stop_search();
        self.filter.lose_place(behind_sd_rad);
        self.go_on_from_here();
    }

    /// Takes it that another load may hang on the train, which has stood: the mass keeps its value and is as uncertain
    /// as at the start.
    pub fn open_load(&mut self) {
        self.stop_search();
        let kept_kg = self.filter.mass_kg();
        let variance = BalanceState::by(&self.filter).mass_variance;
        self.filter.open_load();
        self.go_on_from_here();
        self.publish();
        self.kept.keep(kept_kg, variance);
        (self.used, self.searched) = (0, false);
    }

    /// Gives up a start search that goes on.
    fn stop_search(&mut self) {
        if self.search.is_active() {
            self.search.stop();
            self.filter = self.roll_back.filter;
            self.filter.reset_load();
            (self.used, self.searched) = (0, false);
        }
    }

    /// Takes the filter as it is for one that no residual speaks against.
    fn go_on_from_here(&mut self) {
        self.found = BalanceState::by(&self.filter);
        self.residuals.clear();
        self.roll_back = RollBack {
            filter: self.filter,
            next: self.taken,
            spent: false,
        };
    }

    /// State of the balance.
    pub fn found(&self) -> &BalanceState {
        &self.found
    }

    /// Mass from before a standstill, kg, until it has been weighed anew.
    fn held_kg(&self) -> Option<Real> {
        self.kept.mass().filter(|_| !self.searched)
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Real {
        self.held_kg().unwrap_or(self.tare_kg + self.found.x[MASS])
    }

    /// Masses that the effective grade is a mean over.
    pub fn carried(&self) -> MassOnRail {
        MassOnRail {
            mass_kg: self.mass_kg(),
            load_kg: self.mass_kg() - self.tare_kg,
            load_sd_kg: self.sd_kg(self.found.mass_variance),
            eta_rad: self.found.x[ETA],
            eta_variance: self.found.eta_variance,
        }
    }

    /// Total mass and its standard deviation with that of what no filter can see (scale of the torque), kg: as it was
    /// while the filter goes over blocks again.
    pub fn published(&self) -> [Real; 2] {
        self.published
    }

    /// The train on its rail.
    pub fn train(&self) -> &TrainOnRail {
        &self.train
    }

    /// Returns true if the mass has been measured for long enough.
    pub fn is_known(&self) -> bool {
        self.searched && self.lean.abs() < tuning::QUEUE.max_lean_sd && self.taken >= self.jumped
    }

    /// Returns true if a block has been used for the load that hangs on the train now.
    pub fn has_weighed(&self) -> bool {
        self.used > 0 && self.held_kg().is_none()
    }

    /// Mean of the normalised residuals of late.
    pub fn lean(&self) -> Real {
        self.lean
    }

    /// Normalised innovation squared of the block that the last step has used, and its length, s.
    pub fn new_nis(&self) -> Option<(Real, Real)> {
        self.new_nis
    }

    /// Loads found to be another.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// Status of the last block.
    pub fn status(&self) -> AidStatus {
        self.status
    }

    /// Running resistance at `speed_mps` on the level without bends, N.
    pub fn resistance_n(&self, nominal: &Nominal, speed_mps: Real) -> Real {
        let x = &self.found.x;
        nominal.mu_load * GRAVITY * self.mass_kg() + x[R0] + x[CV] * speed_mps.abs()
    }
}

/// Returns true if a block has corrected the filter.
fn is_used(status: &AidStatus) -> bool {
    matches!(status.outcome, AidOutcome::Fused | AidOutcome::Deweighted)
}

fn slot(block: u64) -> usize {
    (block % tuning::QUEUE.blocks as u64) as usize
}

state!(BalanceState { x, mass_variance, eta_variance; });
state!(RollBack { filter, next, spent; });

impl State for SwingMass {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            supervision: _,
            train: _,
            tare_kg: _,
            gain_sd: _,
            front_m: _,
            filter,
            found,
            roll_back,
            kept,
            search,
            trial_next,
            search_from,
            searched,
            residuals,
            lean,
            outlook,
            jumped,
            builder,
            blocks,
            written,
            taken,
            settle_s,
            changes,
            used,
            catch_up,
            published,
            new_nis,
            status,
        } = self;
        filter.visit(archive);
        found.visit(archive);
        roll_back.visit(archive);
        kept.visit(archive);
        search.visit(archive);
        trial_next.visit(archive);
        search_from.visit(archive);
        searched.visit(archive);
        residuals.visit(archive);
        lean.visit(archive);
        outlook.visit(archive);
        jumped.visit(archive);
        builder.visit(archive);
        blocks.visit(archive);
        written.visit(archive);
        taken.visit(archive);
        settle_s.visit(archive);
        changes.visit(archive);
        used.visit(archive);
        catch_up.visit(archive);
        published.visit(archive);
        new_nis.visit(archive);
        status.visit(archive);
        archive.require(*taken <= *written && *written < u64::MAX / 2);
    }
}

#[cfg(test)]
mod tests;
