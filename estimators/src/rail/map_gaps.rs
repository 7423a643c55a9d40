//! Gaps in the grade map: rail run over while the accelerometer gave nothing.

use crate::Real;
use crate::api::real::within;
use crate::api::signals::Vehicle;
use crate::api::snapshot::state;

/// Largest change of the grade per metre of rail that nothing has read, rad/m: transitions turn by one to two degrees a
/// metre.
const RAD_PER_M: Real = 0.02;
/// Longest gap that counts, m.
const MAX_M: Real = 50.0;

/// Gaps in the grade map under a train, and the standard deviations of the grade that they cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapGaps {
    length_m: Real,
    /// Way run since the last reading, m.
    unread_m: Real,
    /// The longest gap that is still under the train, m, and the way run since its end.
    gap_m: Real,
    since_m: Real,
}

impl MapGaps {
    /// Builds the gaps for a train of the vehicle's length, before the first reading.
    pub fn new(vehicle: &Vehicle) -> Self {
        let ([a, b], [c, d]) = (vehicle.tare_span_m, vehicle.load_span_m);
        Self {
            length_m: (b.max(d) - a.min(c)).max(0.1),
            unread_m: MAX_M,
            gap_m: 0.0,
            since_m: 0.0,
        }
    }

    /// The train has run `way_m` on, and the accelerometer has been `read`, or not.
    pub fn step(&mut self, read: bool, way_m: Real) {
        if !read {
            self.unread_m = within(self.unread_m + way_m, 0.0, MAX_M);
            return;
        }
        // Before the first reading there is no map to have a gap.
        if self.unread_m > 0.0 && self.unread_m < MAX_M {
            (self.gap_m, self.since_m) = (self.gap_m.max(self.unread_m), 0.0);
        }
        self.unread_m = 0.0;
        self.since_m += way_m;
        if self.since_m > self.length_m {
            (self.gap_m, self.since_m) = (0.0, 0.0);
        }
    }

    /// Standard deviation of the grade at the IMU while it is not read, rad.
    pub fn here_rad(&self) -> Real {
        RAD_PER_M * self.unread_m
    }

    /// Standard deviation of the mean grade under the train because of a gap, which is taken for even: it is off by a
    /// quarter of what the grade may have done over it, and counts by its share of the train, rad.
    pub fn under_rad(&self) -> Real {
        0.25 * RAD_PER_M * self.gap_m * (self.gap_m / self.length_m).min(1.0)
    }
}

state!(MapGaps { unread_m, gap_m, since_m; length_m });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::signals::VehicleData;
    use crate::testing::vehicles::vehicle;

    #[test]
    fn a_gap_counts_until_the_train_has_run_over_it() {
        let mut gaps = MapGaps::new(
            &Vehicle::new(VehicleData {
                tare_span_m: [0.0, 18.0],
                ..vehicle().data()
            })
            .unwrap(),
        );
        assert!(gaps.here_rad() > 0.5);
        gaps.step(true, 0.0);
        assert_eq!((gaps.here_rad(), gaps.under_rad()), (0.0, 0.0));
        (0..60).for_each(|_| gaps.step(false, 0.1));
        assert!((gaps.here_rad() - 0.12).abs() < 1e-9);
        (0..170).for_each(|_| gaps.step(true, 0.1));
        assert!(gaps.here_rad() == 0.0 && (gaps.under_rad() - 0.01).abs() < 1e-9);
        (0..20).for_each(|_| gaps.step(true, 0.1));
        assert_eq!(gaps.under_rad(), 0.0);
    }
}
