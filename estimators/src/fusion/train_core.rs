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

/// Standard deviation of the speed up to which the way run is measured, m/s.
const SEEN_SPEED_SD_MPS: Real = 0.02;

/// The core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainCore {
    standstill_mps: Real,
    rail: RailMemory,
    /// True if this step has lost the place on the rail.
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
        let unseen_m = (speed_sd_mps - SEEN_SPEED_SD_MPS).max(0.0) * dt;
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

    /// Marks an estimate by the validity rule; `mass` is true if a mass is estimated.
    pub fn publish(&mut self, mut estimate: Estimate, mass: bool) -> Estimate {
        estimate.total_mass_kg.valid &= self.load.is_confirmed();
        self.validity.publish(estimate, mass)
    }

    /// True if from this step on another load may hang on the train: it has stood for long enough.
    pub fn may_have_another_load(&self) -> bool {
        self.load.begins()
    }

    /// True while there is an attitude of samples that still come, and rail that was read.
    pub fn is_placed(&self, input: &TrainInput) -> bool {
        input.is_awake() && self.rail.is_known()
    }

    /// True if the last step has lost the place on the rail: what was read before is forgotten.
    pub fn has_lost_place(&self) -> bool {
        self.lost
    }

    /// The rail that was read.
    pub fn rail(&self) -> &RailMemory {
        &self.rail
    }
}

/// The layout by the drawings, scaled to the tare; without drawings an even spread that does not swing.
pub fn layout(vehicle: &Vehicle) -> MassLayout {
    match vehicle.layout {
        Some(layout) => layout.scaled_to(vehicle.tare_kg),
        None => MassLayout::even(vehicle.tare_kg, vehicle.tare_span_m, vehicle.load_span_m),
    }
}

state!(TrainCore { validity, load, rail, lost; standstill_mps });
