//! Mass from *changes* of traction and acceleration (Guo et al. 2024, eq. 2–7):
//!
//! Δ(F − J v̇) = M Δ(v̇ + b), by recursive least squares with constant forgetting
//!
//! F is the traction less air drag and b, on a road, what a bend takes ([`Bends`]).
//!
//! Differences rid the equation of the running resistance and of a steady slope. They also keep only the noisiest part
//! of the signals, and a slope that changes between two samples is taken for acceleration; hence the differences over a
//! quarter of a second instead of one sample (which drives the estimate to 0), the rotating masses taken off, and two
//! gates: the change of force must be considerable, and by the accelerometer the slope (of a long train the effective
//! one) must not have changed. At steady speed the mass is held. It starts from its prior and needs real starts and
//! stops; on a crane that rolls along quietly its standard deviation stays large.

use nalgebra::vector;

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::params::params;
use crate::api::real::{sqrt, within};
use crate::api::signals::{Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::control::{self, Control};
use crate::filters::forgetting::Forgetting;
use crate::filters::gaussian::Gaussian;
use crate::filters::rls::{Outcome, Rls};
use crate::models::force_balance::ForceBalance;
use crate::models::single_track::{Bend, Bends};
use crate::preprocess::front_end::Reading;
use crate::preprocess::resampler::Resampler;
use crate::rail::distributed_train::{AlignedSample, DistributedTrain, GradeOffset};
use crate::supervised::supervision::mapped;

params! {
    /// Parameters of the differenced mass regression.
    DifferencedParams {
        omega ["-"] = 0.999, 0.5 => 1.0, "Constant forgetting factor ω, per difference used.";
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of that mass, as a share of it.";
        cutoff_hz ["Hz"] = 2.0, 0.05 => 20.0, "Corner of the matched low-pass both sides go through.";
        difference_hz ["Hz"] = 4.0, 0.1 => 100.0, "Rate of the samples whose differences are taken.";
        excitation_gate [flag] = true, "Use only differences whose change of force is considerable.";
        force_gate_mps2 ["m/s²"] = 0.05, 0.0 => 10.0, "Smallest change of force divided by mass that counts.";
        slope_gate_mps2 ["m/s²"] = 0.05, 0.0 => 10.0, "Largest change of f − v̇ (g times the change of slope) that passes.";
        difference_sd_mps2 ["m/s²"] = 0.03, 1e-4 => 10.0, "Expected residual of the differenced force balance divided by the mass.";
        standstill_mps ["m/s"] = none, 0.0 => 2.0, "Speed below which the train counts as standing: no learning; not set: 0.05 on a rail, 0.3 on a road.";
        settle_s ["s"] = 0.5, 0.0 => 10.0, "Time after standing or braking before learning resumes (the filters forget).";
    }
}

/// Recursive least squares for the mass on differences of force and acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferencedMass {
    params: DifferencedParams,
    signals: Resampler,
    bends: Bends,
    train: DistributedTrain,
    last: Option<(AlignedSample, Bend)>,
    /// M/M₀.
    rls: Rls<1>,
    mass0_kg: Real,
    range_kg: [Real; 2],
    excited: bool,
    saturated: bool,
    outcome: Outcome,
    /// Status of the last difference.
    status: AidStatus,
}

impl DifferencedMass {
    /// Builds the mass estimator from the vehicle and the parameters; `grade_map`: the train is not a point.
    pub fn new(vehicle: &Vehicle, params: DifferencedParams, grade_map: bool) -> Self {
        let prior = Gaussian::independent(vector![1.0], vector![params.mass_sd]);
        Self {
            params,
            signals: Resampler::new(params.cutoff_hz, params.difference_hz, params.settle_s),
            bends: Bends::new(vehicle, params.cutoff_hz),
            train: DistributedTrain::new(&mapped(vehicle, grade_map), params.standstill_mps),
            last: None,
            rls: Rls::new(prior, Forgetting::Constant(params.omega)),
            mass0_kg: vehicle.first_mass_kg(params.mass0_kg),
            range_kg: vehicle.mass_range_kg,
            excited: false,
            saturated: false,
            outcome: Outcome::default(),
            status: AidStatus::default(),
        }
    }

    /// One step. The NIS of the difference that was used in it, if any.
    pub fn step(
        &mut self,
        reading: &Reading,
        balance: &ForceBalance,
        running: bool,
        dt: Real,
    ) -> Option<Real> {
        let mut nis = None;
        if let Control::Out(outcome) = control::force_balance(reading, running, true) {
            self.status = control::without(outcome);
        }
        let mass_kg = self.found_kg();
        self.bends.step(reading, balance, mass_kg, dt);
        let sample = self.signals.step(reading, balance, running, dt);
        let next = self.train.step(&self.signals, sample, reading, running, dt);
        if let Some(next) = next {
            let now = (next, self.bends.filtered());
            if let Some(before) = self.last.replace(now) {
                self.difference(&before, &now, balance);
                nis = self.status.nis();
            }
        }
        if !self.signals.settled() {
            self.excited = false;
            // Samples of the last run that still wait have differences to each other.
            if !self.train.is_waiting() {
                self.last = None;
            }
        }
        nis
    }

    fn difference(
        &mut self,
        (before, bend_before): &(AlignedSample, Bend),
        (now, bend): &(AlignedSample, Bend),
        balance: &ForceBalance,
    ) {
        let slope = |ready: &AlignedSample| {
            Some(ready.felt?.whole(self.train.tare_kg(), self.found_kg()).0)
        };
        let slopes = slope(now).zip(slope(before));
        let (before, now) = (before.sample, now.sample);
        let faster = now.acceleration_mps2 - before.acceleration_mps2;
        let h = faster + bend.taken_mps2 - bend_before.taken_mps2;
        let force = now.force_n - before.force_n + bend.gained_n - bend_before.gained_n;
        let y = (force - balance.rotating_mass_kg * faster) / self.mass0_kg;
        let drift = bend.drift_mps2 - bend_before.drift_mps2;
        let steady_slope = slopes.is_some_and(|(u, u_before)| {
            (u + drift - u_before).abs() < self.params.slope_gate_mps2
        });
        let moved = !self.params.excitation_gate
            || force.abs() > self.params.force_gate_mps2 * self.mass0_kg;
        self.excited = steady_slope && moved;
        if !self.excited {
            self.status = control::without(AidOutcome::Rejected(Rejection::NotExcited));
            return;
        }
        let r = self.params.difference_sd_mps2 * self.params.difference_sd_mps2;
        let outcome = self.rls.update(y, &vector![h], r, false);
        self.status = control::regressed(outcome.as_ref(), true);
        let Some(outcome) = outcome else {
            return;
        };
        self.outcome = outcome;
        self.rls.clamp_usable();
        let [low, high] = self.range_kg.map(|kg| kg / self.mass0_kg);
        self.saturated = !(low..=high).contains(&self.rls.belief.x.x);
    }

    /// Mass within its range, kg. It limits what is published, not the recursion ([`Rls::clamp_usable`]).
    fn found_kg(&self) -> Real {
        let [low, high] = self.range_kg;
        within(self.rls.belief.x.x * self.mass0_kg, low, high)
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Value {
        let value = self.found_kg();
        let sd = sqrt(self.rls.widened().x) * self.mass0_kg;
        Value {
            value,
            sd,
            valid: !self.saturated,
        }
    }

    /// Offsets of other grades from the effective one. The shares of tare and load in it depend on the mass, so its
    /// standard deviation contains that of the mass.
    pub fn ahead(&self) -> GradeOffset {
        let ([low, high], Value { value, sd, .. }) = (self.range_kg, self.mass_kg());
        let at = |kg: Real| self.train.ahead(within(kg, low, high));
        let now = at(value);
        let by_mass = 0.5 * (at(value + sd).unit - at(value - sd).unit);
        GradeOffset {
            sd: sqrt(now.sd * now.sd + by_mass * by_mass),
            ..now
        }
    }

    /// The bend now.
    pub fn bend(&self) -> Bend {
        self.bends.now()
    }

    /// Returns true if the last difference was used.
    pub fn excited(&self) -> bool {
        self.excited
    }

    /// Returns true if the mass is held at an end of its range.
    pub fn saturated(&self) -> bool {
        self.saturated
    }

    /// Status of the last difference.
    pub fn status(&self) -> AidStatus {
        self.status
    }

    /// Residual of the last difference used, N.
    pub fn residual_n(&self) -> Real {
        self.outcome.residual * self.mass0_kg
    }
}
state!(DifferencedMass { signals, bends, train, last, rls, excited, saturated, outcome, status; params, mass0_kg, range_kg });

#[cfg(test)]
#[path = "differenced_rls_tests.rs"]
mod tests;
