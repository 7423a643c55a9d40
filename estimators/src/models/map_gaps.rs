//! What a long train does not know of the rail because its instrument was silent while it ran on.

use crate::Real;
use crate::api::real::within;
use crate::api::signals::Vehicle;
use crate::api::snapshot::state;

/// By how much the grade may change per metre of rail that nothing has read, rad/m: transitions turn by one to two degrees a metre.
const RAD_PER_M: Real = 0.02;
/// After this way nothing more can get lost, m.
const MAX_M: Real = 50.0;

/// Ways run without an instrument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapGaps {
    length_m: Real,
    /// Way run since the instrument last spoke, m.
    silent_m: Real,
    /// The longest gap that is still under the train, m, and the way run since its end.
    gap_m: Real,
    since_m: Real,
}

impl MapGaps {
    /// For a train as long as the vehicle says, before its instrument has spoken.
    pub fn new(vehicle: &Vehicle) -> Self {
        let ([a, b], [c, d]) = (vehicle.tare_span_m, vehicle.load_span_m);
        Self {
            length_m: (b.max(d) - a.min(c)).max(0.1),
            silent_m: MAX_M,
            gap_m: 0.0,
            since_m: 0.0,
        }
    }

    /// The train has run `way_m` on, and the instrument has spoken, or not.
    pub fn step(&mut self, spoken: bool, way_m: Real) {
        if !spoken {
            self.silent_m = within(self.silent_m + way_m, 0.0, MAX_M);
            return;
        }
        // Before the first word there is no rail to have a gap.
        if self.silent_m > 0.0 && self.silent_m < MAX_M {
            (self.gap_m, self.since_m) = (self.gap_m.max(self.silent_m), 0.0);
        }
        self.silent_m = 0.0;
        self.since_m += way_m;
        if self.since_m > self.length_m {
            (self.gap_m, self.since_m) = (0.0, 0.0);
        }
    }

    /// Standard deviation of the grade at the silent instrument, rad.
    pub fn here_rad(&self) -> Real {
        RAD_PER_M * self.silent_m
    }

    /// Standard deviation of the mean grade under the train because of a gap, which is taken for even: it is off by a quarter of what the
    /// grade may have done over it, and counts by its share of the train, rad.
    pub fn under_rad(&self) -> Real {
        0.25 * RAD_PER_M * self.gap_m * (self.gap_m / self.length_m).min(1.0)
    }
}

state!(MapGaps { silent_m, gap_m, since_m; length_m });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::signals::VehicleData;
    use crate::testing::vehicles::vehicle;

    #[test]
    fn a_gap_is_doubted_until_the_train_has_run_over_it() {
        let mut silence = MapGaps::new(
            &Vehicle::new(VehicleData {
                tare_span_m: [0.0, 18.0],
                ..vehicle().data()
            })
            .unwrap(),
        );
        assert!(silence.here_rad() > 0.5);
        silence.step(true, 0.0);
        assert_eq!((silence.here_rad(), silence.under_rad()), (0.0, 0.0));
        (0..60).for_each(|_| silence.step(false, 0.1));
        assert!((silence.here_rad() - 0.12).abs() < 1e-9);
        (0..170).for_each(|_| silence.step(true, 0.1));
        assert!(silence.here_rad() == 0.0 && (silence.under_rad() - 0.01).abs() < 1e-9);
        (0..20).for_each(|_| silence.step(true, 0.1));
        assert_eq!(silence.under_rad(), 0.0);
    }
}
