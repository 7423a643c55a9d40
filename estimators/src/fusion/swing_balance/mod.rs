//! Mass by a force balance in which the load swings: blocks of half a second that wait until the rail under the train
//! has been read, and a [bank](bank) of Kalman filters over them, one for each load that may hang on the train.
//!
//! The load on chains is a pendulum driven by the measured acceleration: every start weighs it (its pull against the
//! train is m_L a_L, known in time but for m_L), so the mass is there after the first start and not only after a change
//! of grade. Source: ours.

pub mod bank;
pub mod block;
pub mod filter;
pub mod params;
pub mod torque_monitor;

use nalgebra::SVector;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::fusion::effective::GradeByForce;
use crate::models::swing_balance::{ANGLE, CV, ETA, MASS, N, Nominal, R0};
use crate::rail::mass_on_rail::MassOnRail;
use crate::rail::rail_memory::RailMemory;
use crate::rail::train_means::{TrainMeans, TrainOnRail};
use crate::tuning::{BLOCK, EFFECTIVE, MOTION, QUEUE, RAIL, STATISTICS, TIMES};
use bank::LoadBank;
use block::{Block, BlockBuilder, BlockInput};
use filter::{Hypothesis, SwingBalance};
use params::{SwingBalanceParams, SwingSupervision};

/// State of the balance that is published: that of the heaviest hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BalanceState {
    /// State, in the order of [`crate::models::swing_balance`].
    pub x: SVector<Real, N>,
    /// Variance of the load, kg²: of all hypotheses.
    pub mass_variance: Real,
    /// Protection level of the total mass, kg.
    pub protection_kg: Real,
    /// Variance of the grade behind the rail read, rad².
    pub eta_variance: Real,
}

#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
impl BalanceState {
    fn by(bank: &LoadBank) -> Self {
        let Hypothesis { belief, .. } = bank.heaviest();
        Self {
            x: belief.x,
            mass_variance: 0.0,
            protection_kg: 0.0,
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
    protection_sd: Real,
    front_m: Real,
    bank: LoadBank,
    found: BalanceState,
    /// Innovation of the newest block and its variance, and the block up to which a jump of the innovation removes the
    /// mark.
    outlook: Option<[Real; 2]>,
    jumped: u64,
    builder: BlockBuilder,
    blocks: [Block; QUEUE.blocks],
    /// Numbers of blocks written and used since the start.
    written: u64,
    taken: u64,
    settle_s: Real,
    /// Number of blocks used since the load may have changed.
    used: u32,
    new_nis: Option<(Real, Real)>,
    status: AidStatus,
}

#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
impl SwingMass {
    /// Builds the mass estimator from the train's nominal values; `protection_sd` is the protection level of a normal
    /// error over its standard deviation.
    pub fn new(
        nominal: Nominal,
        train: TrainOnRail,
        params: SwingBalanceParams,
        supervision: SwingSupervision,
        drives: usize,
        protection_sd: Real,
    ) -> Self {
        let bank = LoadBank::new(SwingBalance::new(nominal, &params, &supervision));
        let [front_m, _] = train.span_m();
        let mut found = BalanceState::by(&bank);
        found.x[MASS] = nominal.load0_kg;
        let mut new = Self {
            supervision,
            train,
            tare_kg: nominal.tare_kg,
            gain_sd: params.gain_sd(drives),
            protection_sd,
            front_m: -front_m,
            bank,
            found,
            outlook: None,
            jumped: 0,
            builder: BlockBuilder::default(),
            blocks: [Block::default(); QUEUE.blocks],
            written: 0,
            taken: 0,
            settle_s: 0.0,
            used: 0,
            new_nis: None,
            status: AidStatus::default(),
        };
        new.spread();
        new
    }

    /// Finds variance and protection level of the load that is published, which change with the bank only.
    fn spread(&mut self) {
        let (load, gain_kg) = (self.found.x[MASS], self.gain_sd * self.mass_kg());
        self.found.mass_variance = self.bank.variance_about(load);
        self.found.protection_kg = self.bank.protection_kg(load, gain_kg, self.protection_sd);
    }

    /// Takes a sample, with the total mass before it, kg; returns the grade by the force of a complete block. At most
    /// one waiting block is worked off.
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
                .max(self.written.saturating_sub(QUEUE.blocks as u64 - 1));
        }
        if self.taken < self.written {
            let block = self.block(self.taken);
            let full = self.written - self.taken >= QUEUE.blocks as u64 - 1;
            let waits = self.supervision.wait_for_rail
                && !full
                && z.speed_mps > MOTION.moves_mps
                && !rail.read_up_to(block.place, self.front_m);
            if !waits {
                self.taken += 1;
                self.take(&block, rail);
            }
        }
        if z.brake > BLOCK.max_brake {
            self.status = AidStatus::not_fused(AidOutcome::Rejected(Rejection::NotRunning));
        }
        grade
    }

    /// Evaluates a new block before its turn and returns the grade by its force.
    fn watch(&mut self, block: &Block, rail: &RailMemory) -> GradeByForce {
        let v = Real::from(block.speed_mps);
        let means = self.train.at(rail, block.place);
        let sound = block.outcome == AidOutcome::Fused && v.abs() > MOTION.moves_mps;
        let now = sound.then(|| {
            let mut x = self.bank.heaviest().belief.x;
            for number in self.taken..self.written {
                x = self
                    .bank
                    .balance()
                    .carried(x, &self.block(number), means.load_cos);
            }
            self.bank.balance().outlook(&x, block, &means)
        });
        self.look_for_jump(now.filter(|_| self.has_weighed()), block, &means);
        let carried = self.carried();
        let weight_n = carried.mass_kg * GRAVITY;
        let swing_rad = self.found.x[ANGLE] * carried.load_kg / carried.mass_kg;
        let of = |sd: Real| sd * sd;
        GradeByForce {
            way_m: v.abs() * block.length_s(),
            unread_variance: carried.unread_variance(&means),
            difference: now.filter(|_| self.has_weighed()).map(|[y, variance]| {
                let moved = of(block.mean_acceleration() / GRAVITY) + of(swing_rad);
                let sd = of(EFFECTIVE.force_sd_rad) + of(EFFECTIVE.force_motion) * moved;
                [y / weight_n, variance / of(weight_n) + sd]
            }),
        }
    }

    /// Compares the innovation of a new block with the innovation of the last block: a force that jumps from one block
    /// to the next is that of another load, because the rail that has not been read cannot change so fast.
    fn look_for_jump(&mut self, now: Option<[Real; 2]>, block: &Block, means: &TrainMeans) {
        let v = Real::from(block.speed_mps);
        let last = core::mem::replace(&mut self.outlook, now);
        let (Some([y, variance]), Some([last, last_variance])) = (now, last) else {
            return;
        };
        let unread_kg = 2.0 * means.ahead_kgm / means.ahead_m.max(RAIL.edge_m);
        // The rail ahead turns, and so does the gradient at the end of what was read, which it is taken to go on by.
        let turn_rad = RAIL.max_turn_radpm * v.abs() * block.length_s() * (1.0 + means.ahead_m);
        let behind_m = match means.behind_tare_kgm > 0.0 {
            true => v.abs() * block.length_s() / RAIL.eta_m,
            false => 0.0,
        };
        let behind_rad = sqrt(self.found.eta_variance) * behind_m;
        let bent = GRAVITY * (unread_kg * turn_rad + self.mass_kg() * behind_rad);
        if (y - last).abs() > QUEUE.jump_sd * sqrt(variance + last_variance) + bent {
            self.jumped = self.written + u64::from(STATISTICS.in_a_row);
        }
    }

    /// Reason why a block cannot be used; `None` if it can.
    fn refusal(&self, block: &Block, means: &TrainMeans) -> Option<AidOutcome> {
        // Going back over rail that is no longer remembered, or never was.
        let onto_unknown =
            block.speed_mps < 0.0 && means.behind_tare_kgm > RAIL.edge_m * self.tare_kg;
        if self.settle_s > 0.0 {
            Some(AidOutcome::Rejected(Rejection::NotRunning))
        } else if block.outcome != AidOutcome::Fused {
            Some(block.outcome)
        } else if means.ahead_m > RAIL.edge_m || onto_unknown {
            Some(AidOutcome::Rejected(Rejection::NotExcited))
        } else {
            None
        }
    }

    /// Means over the train at a block, and the reason why the block cannot be used, if there is one.
    fn look(&mut self, block: &Block, rail: &RailMemory) -> (Option<AidOutcome>, TrainMeans) {
        let means = self.train.at(rail, block.place);
        let moving = Real::from(block.speed_mps).abs() > MOTION.moves_mps;
        self.settle_s = match moving {
            true => (self.settle_s - block.length_s()).max(0.0),
            false => TIMES.brief_s,
        };
        (self.refusal(block, &means), means)
    }

    fn take(&mut self, block: &Block, rail: &RailMemory) {
        let (refusal, means) = self.look(block, rail);
        let found = self.bank.take(block, &means, refusal.is_none());
        self.status = match (refusal, found) {
            (None, Some((status, nis))) => {
                self.used = self.used.saturating_add(1);
                self.new_nis = Some((nis, block.length_s()));
                status
            }
            (outcome, _) => AidStatus::not_fused(outcome.unwrap_or(AidOutcome::Stale)),
        };
        if self.used > 0 {
            self.found = BalanceState::by(&self.bank);
            self.spread();
        }
    }

    fn block(&self, number: u64) -> Block {
        self.blocks.get(slot(number)).copied().unwrap_or_default()
    }

    /// Standard deviation of a mass with the filter's variance, kg², including the scale of the force, kg.
    fn sd_kg(&self, variance: Real) -> Real {
        let gain = self.gain_sd * self.mass_kg();
        sqrt(variance + gain * gain)
    }

    /// Assumes that the train came unseen to its place: the rail of the blocks kept is no longer known, the load may
    /// swing, and the grade behind the rail read has the standard deviation `behind_sd_rad`.
    pub fn lose_place(&mut self, behind_sd_rad: Real) {
        for block in &mut self.blocks {
            block.outcome = AidOutcome::Stale;
        }
        self.builder = BlockBuilder::default();
        self.taken = self.written;
        self.bank.lose_place(behind_sd_rad);
        self.found.eta_variance = behind_sd_rad * behind_sd_rad;
        self.found.x[ETA] = 0.0;
    }

    /// Assumes that another load may hang on the train, which has stood: the mass keeps its value.
    pub fn open_load(&mut self) {
        self.bank.open();
        self.spread();
        self.used = 0;
    }

    /// State of the balance.
    pub fn found(&self) -> &BalanceState {
        &self.found
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Real {
        self.tare_kg + self.found.x[MASS]
    }

    /// Masses for the mean in the effective grade.
    pub fn carried(&self) -> MassOnRail {
        MassOnRail {
            mass_kg: self.mass_kg(),
            load_kg: self.mass_kg() - self.tare_kg,
            load_sd_kg: self.sd_kg(self.found.mass_variance),
            eta_rad: self.found.x[ETA],
            eta_variance: self.found.eta_variance,
        }
    }

    /// Total mass and its standard deviation, including errors that no filter can observe (scale of the torque), kg.
    pub fn published(&self) -> [Real; 2] {
        [self.mass_kg(), self.sd_kg(self.found.mass_variance)]
    }

    /// The train on its rail.
    pub fn train(&self) -> &TrainOnRail {
        &self.train
    }

    /// Returns true if the mass has been measured for long enough.
    pub fn is_known(&self) -> bool {
        self.used >= STATISTICS.confirming && self.taken >= self.jumped
    }

    /// Returns true if a block has been used for the load that hangs on the train now.
    pub fn has_weighed(&self) -> bool {
        self.used > 0
    }

    /// Hypotheses of the load.
    pub fn bank(&self) -> &LoadBank {
        &self.bank
    }

    /// Mean normalised innovation squared of the block that the last step has used, and its length, s.
    pub fn new_nis(&self) -> Option<(Real, Real)> {
        self.new_nis
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

fn slot(block: u64) -> usize {
    (block % QUEUE.blocks as u64) as usize
}

state!(BalanceState { x, mass_variance, protection_kg, eta_variance; });

state!(SwingMass { bank, found, outlook, jumped, builder, blocks, written, taken, settle_s, used, new_nis, status; supervision, train, tare_kg, gain_sd, protection_sd, front_m } where |this| this.taken <= this.written && this.written < u64::MAX / 2);

#[cfg(test)]
mod tests;
