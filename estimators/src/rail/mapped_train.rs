//! The train on the rail memory, for pipelines whose signals are late by their filters.
//!
//! On an 18 m train that runs onto a ramp, the accelerometer at the front reads the whole ramp while most of the mass still stands
//! on the level. The force balance then holds with the mean over the mass in place of the grade at the instrument:
//!
//! M g sin θ → Σ mᵢ g sin θ(s − dᵢ),  s chainage of the instrument, dᵢ how far behind it mass mᵢ rests
//!
//! What the accelerometer has read the wheels will carry over the same rail a little later: u(s) = (f − v̇)/g = sin θ(s) + b/g is kept by
//! place ([`RailMemory`]) and averaged over where the masses rest ([`TrainOnRail`]). The accelerometer's bias b stays what it was, as it is
//! the same at every place. Rail that the instrument has not seen (ahead of it; behind it at the start of a run) is taken to go on as what it
//! has seen ends, and its standard deviation grows with the distance. Samples of the regression need no answer at once: they wait until it
//! has been seen.
//!
//! The instrument pitches with the unit that carries it, and that unit is suspended at two stations: it reads the grade under the unit's
//! middle, not under itself.
//!
//! Source: ours. Liu et al. 2023 treat the train as a point; with both spans 0 so does this.

use crate::Real;
use crate::api::mass_layout::MassLayout;
use crate::api::real::{GRAVITY, within};
use crate::api::signals::Vehicle;
use crate::api::snapshot::state;
use crate::rail::rail_memory::{Place, RailMemory};
use crate::rail::train_means::TrainOnRail;

/// Longest way that a filter's delay can make, m.
const MAX_DELAY_M: Real = 2.0;
/// By how much u may change per metre of unseen rail although the end of the seen rail is straight, m/s² per m (1 mrad/m: the
/// undulation of a roadway).
const UNSEEN_MPS2_PER_M: Real = 0.01;

/// Reading at a place: g sin θ + b, m/s², and the horizontal curvature, 1/m.
pub type AtPlace = [Real; 2];

/// The train's place on the remembered rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedTrain {
    rail: RailMemory,
    train: TrainOnRail,
    /// How far the unit is ahead of where the delayed signals have it, m.
    late_m: Real,
    here: Option<AtPlace>,
    tare_kg: Real,
    span_m: [Real; 2],
    arm_m: Real,
}

/// Mean over the places of masses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// g sin θ + b, m/s², and curvature, 1/m.
    pub value: AtPlace,
    /// Standard deviation of the first for rail not seen, m/s².
    pub doubt_mps2: Real,
    /// How far the train reaches beyond the rail seen, m.
    pub unseen_m: Real,
}

/// Means over where tare and load rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadedGrade {
    /// Mean over the tare.
    pub tare: Mean,
    /// Mean over the load.
    pub load: Mean,
}

impl LoadedGrade {
    /// Mean of u over a whole train of `mass_kg` with a tare of `tare_kg`, m/s², and its doubt.
    pub fn whole(&self, tare_kg: Real, mass_kg: Real) -> (Real, Real) {
        let tare_share = (tare_kg / mass_kg.max(tare_kg)).min(1.0);
        let mix = |tare: Real, load: Real| load + tare_share * (tare - load);
        let ([tare, _], [load, _]) = (self.tare.value, self.load.value);
        (
            mix(tare, load),
            mix(self.tare.doubt_mps2, self.load.doubt_mps2),
        )
    }
}

impl LoadedGrade {
    /// Means of a point that reads `here`.
    pub fn point(here: AtPlace) -> Self {
        let here = Mean {
            value: here,
            ..Mean::default()
        };
        Self {
            tare: here,
            load: here,
        }
    }

    /// Mean curvature under the train, 1/m.
    pub fn curvature_per_m(&self) -> Real {
        let [_, curvature] = self.tare.value;
        curvature
    }
}

impl MappedTrain {
    /// From the vehicle's nominal values.
    pub fn new(vehicle: &Vehicle) -> Self {
        let layout = match vehicle.layout {
            Some(layout) => layout.scaled_to(vehicle.tare_kg),
            None => MassLayout::even(vehicle.tare_kg, vehicle.tare_span_m, vehicle.load_span_m),
        };
        let train = TrainOnRail::new(&layout, false);
        let span_m @ [near, far] = train.span_m();
        Self {
            rail: RailMemory::new(far - near),
            train,
            late_m: 0.0,
            here: None,
            tare_kg: vehicle.tare_kg,
            span_m,
            arm_m: vehicle.imu_arm_m,
        }
    }

    /// The train moves at `speed_mps`; `delayed_mps` is that speed behind the filters that what is read, `now`, has passed too.
    pub fn step(&mut self, now: Option<AtPlace>, delayed_mps: Real, speed_mps: Real, dt: Real) {
        // What was lost while a signal was missing must not stay between the two.
        self.late_m = within(
            self.late_m + (speed_mps - delayed_mps) * dt,
            -MAX_DELAY_M,
            MAX_DELAY_M,
        );
        self.here = now;
        let read = now.map(|[force, curvature]| [force / GRAVITY, curvature]);
        self.rail.step(delayed_mps * dt, read);
    }

    /// Place of the unit with the instrument, late by the delay of the filters.
    pub fn place(&self) -> Place {
        self.rail.here()
    }

    /// True if the rail under the front of the train at `place` has been read.
    pub fn seen(&self, place: Place) -> bool {
        let [near, _] = self.span_m;
        near >= 0.0 || self.rail.read_up_to(place, -near)
    }

    /// Means over the masses with the instrument's unit at `place`; `None` without an accelerometer.
    pub fn felt(&self, place: Place) -> Option<LoadedGrade> {
        self.here?;
        let means = self.train.at(&self.rail, place);
        let per_m = UNSEEN_MPS2_PER_M + GRAVITY * self.rail.end_gradient().abs();
        let [_, far] = self.span_m;
        let behind_m = self.rail.at(place, -far, 0.0).behind_m;
        let of = |u: Real, beyond_m: Real| Mean {
            value: [GRAVITY * u, means.bend_per_m],
            doubt_mps2: beyond_m * per_m,
            unseen_m: behind_m.max(means.ahead_m),
        };
        let tare_kg = self.tare_kg.max(1.0);
        let beyond_kgm = means.behind_tare_kgm + means.ahead_kgm;
        Some(LoadedGrade {
            tare: of(means.tare_kg / tare_kg, beyond_kgm / tare_kg),
            load: of(means.load, means.behind_load_m),
        })
    }

    /// Means over the masses now, with the delay of the filters made up, and g sin θ + b at the instrument and under the middle of its unit,
    /// m/s².
    pub fn felt_now(&self) -> Option<(LoadedGrade, [Real; 2])> {
        let place = self.rail.ahead(self.rail.here(), self.late_m);
        let gradient = self.rail.end_gradient();
        let read =
            [self.arm_m, 0.0].map(|ahead_m| GRAVITY * self.rail.at(place, ahead_m, gradient).u);
        Some((self.felt(place)?, read))
    }

    /// Mass of the empty train, kg.
    pub fn tare_kg(&self) -> Real {
        self.tare_kg
    }
}

state!(Mean { value, doubt_mps2, unseen_m; } where |this| this.doubt_mps2 >= 0.0);
state!(LoadedGrade { tare, load; });
state!(MappedTrain { rail, late_m, here; train, tare_kg, span_m, arm_m });

#[cfg(test)]
#[path = "mapped_train_tests.rs"]
mod tests;
