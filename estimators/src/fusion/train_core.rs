//! Core of every estimator of a train: the rail that was read, the load that may have changed, and the validity rule.
//!
//! What it takes comes from the [source](crate::fusion::train_source), which the mass does not change on a rail.

use crate::Real;
use crate::api::mass_layout::MassLayout;
use crate::api::signals::{Estimate, Vehicle};
use crate::api::snapshot::state;
use crate::detect::standing_load::StandingLoad;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::fusion::train_source::{TrainInput, TrainSample};
use crate::rail::rail_memory::RailMemory;
use crate::tuning::SOURCE;

/// The core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainCore {
    standstill_mps: Real,
    rail: RailMemory,
    /// True if the place on the rail was lost in this step.
    lost: bool,
    load: StandingLoad,
    validity: Validity,
}

impl TrainCore {
    /// Builds the core for a vehicle whose train reaches over `span_m`.
    pub fn new(vehicle: &Vehicle, span_m: [Real; 2], integrity: Integrity) -> Self {
        let [front, rear] = span_m;
        Self {
            standstill_mps: vehicle.standstill_mps(None),
            rail: RailMemory::new(rear - front),
            lost: false,
            load: StandingLoad::new(integrity.standing_load_s),
            validity: Validity::new(integrity),
        }
    }

    /// Takes a sample of `dt` seconds, in which the speed had the standard deviation `speed_sd_mps`: reads the rail.
    pub fn take(&mut self, sample: &TrainSample, speed_sd_mps: Real, dt: Real) {
        let v = sample.block.speed_mps;
        let unseen_m = (speed_sd_mps - SOURCE.seen_speed_sd_mps).max(0.0) * dt;
        self.lost = self.rail.doubt(unseen_m);
        if sample.starts && (self.rail.is_known() || v.abs() > self.standstill_mps) {
            self.rail.forget();
            self.lost = true;
        }
        self.rail.step(v * dt, sample.rail);
        self.load.observe(sample.standing, dt);
    }

    /// Gives the validity rule the signals of a step: what the source has found, and the normalised innovation squared
    /// of a block of the force balance with its length, s.
    pub fn supervise(&mut self, input: &TrainInput, block: Option<(Real, Real)>) {
        self.validity.observe(input.plausible, input.dt);
        if let Some(nis) = input.new_nis {
            self.validity.innovation(Source::WheelSpeed, nis, input.dt);
        }
        if let Some((nis, period_s)) = block {
            self.validity
                .innovation(Source::ForceBalance, nis, period_s);
            self.load.sample();
        }
    }

    /// Marks an estimate by the validity rule.
    pub fn publish(&mut self, mut estimate: Estimate) -> Estimate {
        estimate.total_mass_kg.valid &= self.load.is_confirmed();
        self.validity.publish(estimate, true)
    }

    /// True if from this step on another load may hang on the train: it has stood for long enough.
    pub fn may_have_another_load(&self) -> bool {
        self.load.begins()
    }

    /// True while the attitude has current samples and rail has been read.
    pub fn is_placed(&self, input: &TrainInput) -> bool {
        input.is_awake() && self.rail.is_known()
    }

    /// True if the place on the rail was lost in the last step: what was read before is forgotten.
    pub fn has_lost_place(&self) -> bool {
        self.lost
    }

    /// The read rail.
    pub fn rail(&self) -> &RailMemory {
        &self.rail
    }
}

/// The layout by the drawings, scaled to the tare; without drawings a uniform distribution without a swinging part.
pub fn layout(vehicle: &Vehicle) -> MassLayout {
    match vehicle.layout {
        Some(layout) => layout.scaled_to(vehicle.tare_kg),
        None => MassLayout::even(vehicle.tare_kg, vehicle.tare_span_m, vehicle.load_span_m),
    }
}

state!(TrainCore { validity, load, rail, lost; standstill_mps });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::signals::Value;
    use crate::fusion::swing_balance::block::BlockInput;
    use crate::testing::vehicles::vehicle;

    const DT: Real = 0.01;

    fn core() -> TrainCore {
        TrainCore::new(&vehicle(), [0.0, 12.0], Integrity::default())
    }

    fn sample(speed_mps: Real, rail: bool, starts: bool) -> TrainSample {
        TrainSample {
            block: BlockInput {
                speed_mps,
                ..Default::default()
            },
            unit: Default::default(),
            rail: rail.then_some([0.0, 0.0]),
            standing: speed_mps == 0.0,
            starts,
        }
    }

    /// Output of a source that has found nothing.
    fn input() -> TrainInput {
        TrainInput {
            t: crate::Time::from_s(DT),
            dt: DT,
            sample: None,
            grade_rad: Value::default(),
            speed_mps: Value::default(),
            innovation: (0.0, 0.0),
            new_nis: None,
            lagged: Default::default(),
            plausible: true,
            moving: true,
        }
    }

    /// A speed that is known to 0.12 m/s runs 0.1 m of way unseen in each second: after five of them the place on the
    /// rail is lost, in one step. One that is known to 0.02 m/s is measured.
    #[test]
    fn a_place_is_lost_by_a_way_that_is_not_seen() {
        for (sd_mps, lost_s) in [(0.12, Some(5.0)), (0.07, Some(10.0)), (0.0199, None)] {
            let mut core = core();
            core.take(&sample(0.0, true, false), 0.0, DT);
            let lost: std::vec::Vec<i32> = (1..2_000)
                .filter(|_| {
                    core.take(&sample(0.0, false, false), sd_mps, DT);
                    core.has_lost_place()
                })
                .collect();
            let found_s = lost.first().map(|k| DT * Real::from(*k));
            assert_eq!(found_s.is_some(), lost_s.is_some());
            let off_s = found_s.unwrap_or(0.0) - lost_s.unwrap_or(0.0);
            assert!(off_s.abs() < 0.03, "{found_s:?}");
            assert_eq!(core.rail().is_known(), lost_s.is_none());
        }
    }

    /// A start of the attitude loses the place where there was one, and where the train moves; a train that stands at
    /// its first start is where it is.
    #[test]
    fn a_start_on_the_way_loses_the_place() {
        let still = vehicle().standstill_mps(None);
        for (known, speed, lost) in [
            (false, 0.0, false),
            (false, 0.99 * still, false),
            (false, -0.99 * still, false),
            (false, 1.01 * still, true),
            (false, -1.01 * still, true),
            (true, 0.0, true),
        ] {
            let mut core = core();
            if known {
                core.take(&sample(0.5, true, false), 0.0, DT);
            }
            core.take(&sample(speed, false, true), 0.0, DT);
            assert_eq!(core.has_lost_place(), lost, "{known} {speed}");
            core.take(&sample(speed, true, false), 0.0, DT);
            assert!(!core.has_lost_place() && core.rail().is_known());
        }
    }

    /// A mass is valid again six blocks after a stand of five seconds; in the step in which the stand becomes so long
    /// another load may hang on the train.
    #[test]
    fn after_a_stand_six_blocks_make_a_mass_valid() {
        let mut core = core();
        let block = |core: &mut TrainCore| core.supervise(&input(), Some((1.0, 0.5)));
        let known = Estimate {
            total_mass_kg: Value {
                value: 1e4,
                sd: 1.0,
                valid: true,
            },
            ..Estimate::default()
        };
        let valid = |core: &TrainCore| { *core }.publish(known).total_mass_kg.valid;
        block(&mut core);
        assert!(valid(&core));
        let begun: std::vec::Vec<i32> = (1..=700)
            .filter(|_| {
                core.take(&sample(0.0, true, false), 0.0, DT);
                core.may_have_another_load()
            })
            .collect();
        assert!(begun.len() == 1 && (begun[0] - 500).abs() < 3, "{begun:?}");
        core.take(&sample(0.5, true, false), 0.0, DT);
        for k in 0..12 {
            assert_eq!(valid(&core), k >= 6);
            block(&mut core);
        }
    }

    /// The train has a place while its attitude is awake and there is rail that was read.
    #[test]
    fn a_train_has_its_place_on_rail_that_it_has_read() {
        for (awake, read) in [(true, true), (true, false), (false, true)] {
            let mut core = core();
            core.take(&sample(0.5, read, false), 0.0, DT);
            let mut input = input();
            input.grade_rad.valid = awake;
            assert_eq!(core.is_placed(&input), awake && read);
        }
    }
}
