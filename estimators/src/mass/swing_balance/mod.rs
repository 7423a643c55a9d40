//! Mass by a force balance in which the load swings: blocks of half a second that wait until the rail under the train has been read, a
//! Kalman filter over them ([`balance`]), and a load-change detector that goes back to where the change began.
//!
//! The load on chains is a pendulum driven by the measured acceleration: every start weighs it (its pull against the train is m_L a_L, known in
//! time but for m_L), so the mass is there after the first start and not only after a change of grade. Source: ours.

#![allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below their number"
)]

pub mod balance;
pub mod block;
pub mod params;
pub mod torque_monitor;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::snapshot::{Archive, State, state};
use crate::models::rail_memory::RailMemory;
use crate::models::train_means::{TrainMeans, TrainOnRail};
use balance::{MASS, Nominal, R0, SwingBalance, Update};
use block::{Block, BlockBuilder, BlockInput};
use params::{SwingBalanceParams, SwingSupervision};

/// Blocks kept: those that wait for rail, and those that a change of load goes back over.
const BLOCKS: usize = 28;
/// Speed from which a block is of use, m/s; time after standing, s.
const MIN_SPEED_MPS: Real = 0.06;
const SETTLE_S: Real = 0.3;
/// Speed from which a block waits for rail, m/s: a train that stands or goes back will not read any.
const MIN_WAIT_MPS: Real = 0.05;
/// Way ahead of the rail read up to which a block is of use, m.
const MAX_AHEAD_M: Real = 0.8;
/// Mean distance of the tare behind the rail remembered up to which a block is of use when going back, m.
const MAX_BEHIND_M: Real = 0.3;
/// Blocks after which a start is looked at for the first and for the last time; share of the load by which it may have been wrong, with a share of
/// the tare; how often it is gone back to.
const FIRST_LOOK_BLOCKS: u32 = 10;
const SETTLED_BLOCKS: u32 = 20;
const MAX_START_ERROR: Real = 0.1;
const START_FLOOR: Real = 0.05;
const MAX_ROUNDS: u32 = 4;
/// Load-change detector: allowance and threshold of the CUSUM, memory of the square of the residuals by which they are scaled, s; largest
/// residual and square taken; pause after an alarm, s.
const ALLOWANCE: Real = 1.2;
const THRESHOLD: Real = 20.0;
const SCALE_S: Real = 20.0;
const MAX_RESIDUAL: Real = 5.0;
const MAX_SQUARE: Real = 9.0;
const PAUSE_S: Real = 15.0;

/// CUSUM of residuals scaled by their own slow spread.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LoadWatch {
    up: Real,
    down: Real,
    square: Real,
    pause_s: Real,
}

impl LoadWatch {
    fn new() -> Self {
        Self {
            up: 0.0,
            down: 0.0,
            square: 1.0,
            pause_s: 0.0,
        }
    }

    /// Takes a normalised residual of a block of `length_s`; returns whether the load is another.
    fn take(&mut self, residual: Real, length_s: Real) -> bool {
        let scaled = residual / crate::api::real::sqrt(self.square.max(1.0));
        self.square += length_s / SCALE_S * ((residual * residual).min(MAX_SQUARE) - self.square);
        let scaled = scaled.clamp(-MAX_RESIDUAL, MAX_RESIDUAL);
        self.up = (self.up + scaled - ALLOWANCE).max(0.0);
        self.down = (self.down - scaled - ALLOWANCE).max(0.0);
        self.pause_s = (self.pause_s - length_s).max(0.0);
        self.up.max(self.down) > THRESHOLD && self.pause_s <= 0.0
    }

    fn at_rest(&self) -> bool {
        self.up == 0.0 && self.down == 0.0
    }

    fn clear(&mut self) {
        (self.up, self.down) = (0.0, 0.0);
    }
}

/// Where the filter was when nothing hinted at another load.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Calm {
    filter: SwingBalance,
    /// The block that comes next.
    next: u64,
    /// Whether it has been gone back to already, for another load.
    spent: bool,
    /// Load that the filter started from there, kg, and how often it has started.
    start_kg: Real,
    rounds: u32,
}

/// The estimator of the mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingMass {
    supervision: SwingSupervision,
    train: TrainOnRail,
    tare_kg: Real,
    gain_sd: Real,
    front_m: Real,
    filter: SwingBalance,
    calm: Calm,
    watch: LoadWatch,
    builder: BlockBuilder,
    blocks: [Block; BLOCKS],
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

impl SwingMass {
    /// From the train's nominal values.
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
            calm: Calm {
                filter,
                next: 0,
                spent: false,
                start_kg: nominal.load0_kg,
                rounds: 0,
            },
            catch_up: 0,
            published: [0.0; 2],
            watch: LoadWatch::new(),
            builder: BlockBuilder::default(),
            blocks: [Block::default(); BLOCKS],
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

    /// One sample; returns a block when one is whole. At most one waiting block is worked off.
    pub fn step(&mut self, z: &BlockInput, rail: &RailMemory, dt: Real) -> Option<Block> {
        self.new_nis = None;
        let new = self.builder.take(z, rail, dt);
        if let Some(block) = new {
            if let Some(place) = self.blocks.get_mut(slot(self.written)) {
                *place = block;
            }
            self.written += 1;
            self.taken = self
                .taken
                .max(self.written.saturating_sub(BLOCKS as u64 - 1));
        }
        if self.taken < self.written {
            let block = self
                .blocks
                .get(slot(self.taken))
                .copied()
                .unwrap_or_default();
            let full = self.written - self.taken >= BLOCKS as u64 - 1;
            let waits = self.supervision.wait_for_rail
                && !full
                && z.speed_mps > MIN_WAIT_MPS
                && !rail.read_up_to(block.place, self.front_m);
            if !waits {
                self.taken += 1;
                self.take(&block, rail);
                self.relinearise();
                self.publish();
            }
        }
        new
    }

    /// Why a block is of no use; `None` if it is.
    fn refusal(&self, block: &Block, means: &TrainMeans) -> Option<AidOutcome> {
        let moving = Real::from(block.speed_mps).abs() > MIN_SPEED_MPS;
        // Going back over rail that is no longer remembered, or never was.
        let onto_unknown =
            block.speed_mps < 0.0 && means.behind_tare_kgm > MAX_BEHIND_M * self.tare_kg;
        if !moving || self.settle_s > 0.0 {
            Some(AidOutcome::Rejected(Rejection::NotRunning))
        } else if block.outcome != AidOutcome::Fused {
            Some(block.outcome)
        } else if means.ahead_m > MAX_AHEAD_M || onto_unknown {
            Some(AidOutcome::Rejected(Rejection::NotExcited))
        } else {
            None
        }
    }

    fn take(&mut self, block: &Block, rail: &RailMemory) {
        let means = self.train.at(rail, block.place);
        let moving = Real::from(block.speed_mps).abs() > MIN_SPEED_MPS;
        self.settle_s = match moving {
            true => (self.settle_s - block.length_s()).max(0.0),
            false => SETTLE_S,
        };
        let refusal = self.refusal(block, &means);
        let update = self.filter.step(block, &means, refusal.is_none());
        self.status = status(refusal, update);
        if let Some(update) = update {
            self.used = self.used.saturating_add(1);
            self.new_nis = Some((update.normalised * update.normalised, block.length_s()));
            if self.watch.take(update.normalised, block.length_s())
                && self.supervision.load_change_detector
            {
                self.go_back();
                return;
            }
        }
        if !moving {
            self.watch.clear();
        }
        let settled = self.used == 0 || self.used > SETTLED_BLOCKS;
        if self.watch.at_rest() && settled {
            self.calm = Calm {
                filter: self.filter,
                next: self.taken,
                spent: false,
                start_kg: self.filter.belief().x[MASS],
                rounds: 0,
            };
        }
    }

    /// The swing weighs what hangs on the chains, so the balance is not linear in the mass: a filter that started far from it goes over its first
    /// blocks again, from where it has come to.
    fn relinearise(&mut self) {
        let due = self.used == FIRST_LOOK_BLOCKS || self.used == SETTLED_BLOCKS;
        let kept = self.written.saturating_sub(self.calm.next) < BLOCKS as u64;
        let load_kg = self.filter.belief().x[MASS];
        let moved = (load_kg - self.calm.start_kg).abs();
        let far = moved > MAX_START_ERROR * (load_kg + START_FLOOR * self.tare_kg);
        if !due || !kept || !far || self.calm.rounds >= MAX_ROUNDS || !self.supervision.relinearise
        {
            return;
        }
        self.filter = self.calm.filter;
        if self.calm.spent {
            self.filter.reset_load();
        }
        self.filter.start_from(load_kg);
        self.calm.start_kg = load_kg;
        self.calm.rounds += 1;
        self.catch_up = self.catch_up.max(self.taken);
        self.taken = self.calm.next;
        self.watch = LoadWatch::new();
        self.settle_s = 0.0;
        self.used = 0;
    }

    fn publish(&mut self) {
        if self.taken >= self.catch_up {
            let gain = self.gain_sd * self.filter.mass_kg();
            let variance = self.filter.belief().P[(MASS, MASS)];
            let sd = crate::api::real::sqrt(variance + gain * gain);
            self.published = [self.filter.mass_kg(), sd];
        }
    }

    /// Another load: back to where nothing hinted at it, with the mass open, and again over the blocks since then. Never twice to the same
    /// place: a model that is wrong would go round for ever.
    fn go_back(&mut self) {
        let kept = self.written.saturating_sub(self.calm.next) < BLOCKS as u64;
        if !self.calm.spent && kept {
            self.filter = self.calm.filter;
            self.catch_up = self.catch_up.max(self.taken);
            self.taken = self.calm.next;
        } else {
            (self.calm.filter, self.calm.next) = (self.filter, self.taken);
        }
        self.calm.spent = true;
        self.filter.reset_load();
        self.calm.start_kg = self.filter.belief().x[MASS];
        self.calm.rounds = 0;
        self.watch = LoadWatch {
            pause_s: PAUSE_S,
            ..LoadWatch::new()
        };
        self.settle_s = 0.0;
        self.used = 0;
        self.changes = self.changes.saturating_add(1);
    }

    /// The filter.
    pub fn filter(&self) -> &SwingBalance {
        &self.filter
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Real {
        self.filter.mass_kg()
    }

    /// Total mass and its standard deviation with that of what no filter can see (scale of the torque), kg: as it was while the filter goes over
    /// blocks again.
    pub fn published(&self) -> [Real; 2] {
        self.published
    }

    /// Tare, kg.
    pub fn tare_kg(&self) -> Real {
        self.tare_kg
    }

    /// How the train rests on the rail.
    pub fn train(&self) -> &TrainOnRail {
        &self.train
    }

    /// Whether the mass has been measured for long enough.
    pub fn is_known(&self) -> bool {
        self.used >= FIRST_LOOK_BLOCKS || self.taken < self.catch_up
    }

    /// Normalised innovation squared of the block that the last step has used, and its length, s.
    pub fn new_nis(&self) -> Option<(Real, Real)> {
        self.new_nis
    }

    /// Loads found to be another.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// Blocks used since the start or the last load.
    pub fn used(&self) -> u32 {
        self.used
    }

    /// What became of the last block.
    pub fn status(&self) -> AidStatus {
        self.status
    }

    /// Running resistance at `speed_mps` on the level without bends, N.
    pub fn resistance_n(&self, nominal: &Nominal, speed_mps: Real) -> Real {
        let x = &self.filter.belief().x;
        nominal.mu_load * crate::api::real::GRAVITY * self.mass_kg()
            + x[R0]
            + x[balance::CV] * speed_mps.abs()
    }
}

fn status(refusal: Option<AidOutcome>, update: Option<Update>) -> AidStatus {
    match (refusal, update) {
        (Some(outcome), _) => AidStatus {
            outcome,
            ..AidStatus::default()
        },
        (None, None) => AidStatus {
            outcome: AidOutcome::Rejected(Rejection::Numeric),
            ..AidStatus::default()
        },
        (None, Some(update)) => AidStatus {
            innovation: update.innovation_n,
            innovation_variance: update.variance,
            test_ratio: update.innovation_n * update.innovation_n
                / (9.0 * update.variance).max(Real::MIN_POSITIVE),
            outcome: match update.deweighted {
                true => AidOutcome::Deweighted,
                false => AidOutcome::Fused,
            },
        },
    }
}

fn slot(block: u64) -> usize {
    (block % BLOCKS as u64) as usize
}

state!(LoadWatch { up, down, square, pause_s; });
state!(Calm { filter, next, spent, start_kg, rounds; });

impl State for SwingMass {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            supervision: _,
            train: _,
            tare_kg: _,
            gain_sd: _,
            front_m: _,
            filter,
            calm,
            watch,
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
        calm.visit(archive);
        watch.visit(archive);
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
