//! A drive: starts, stops and, now and then, a way back.

use super::track::round;
use super::{Draws, DriveRanges};
use serde::Serialize;

/// Limits of a drive: its way and what the motors can do.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Available distance, m.
    pub(crate) way_m: f64,
    /// Speed that the motors hold on the steepest climb, m/s.
    pub(crate) speed_mps: f64,
}

/// The speed reference of a drive.
#[derive(Serialize)]
pub(crate) struct Drive {
    /// Its points by time.
    pub(crate) speed: Vec<Point>,
    /// End of the drive, s.
    #[serde(skip)]
    pub(crate) over_s: f64,
}

/// A point of the reference.
#[derive(Clone, Copy, Serialize)]
pub(crate) struct Point {
    pub(crate) at_s: f64,
    /// m/s.
    pub(crate) mps: f64,
}

/// Draws a drive over the whole distance.
pub(crate) fn draw(ranges: &DriveRanges, seed: u64, reach: Reach) -> Drive {
    let mut draws = Draws::new(seed, "drive");
    let stops = (draws.0.uniform() * f64::from(ranges.max_stops + 1)) as u32;
    let legs = f64::from(stops + 1);
    let comes_back = draws.chance(ranges.reversal_share.get());
    let back = draws.within([0.3, 0.8]);
    let mut drive = Drive {
        speed: vec![Point {
            at_s: 0.0,
            mps: 0.0,
        }],
        over_s: 0.0,
    };
    for _ in 0..=stops {
        drive.leg(ranges, &mut draws, reach, reach.way_m / legs, 1.0);
    }
    if comes_back {
        drive.leg(ranges, &mut draws, reach, back * reach.way_m / legs, -1.0);
    }
    drive
}

impl Drive {
    /// Adds the points for standstill, start, run and stop.
    fn leg(
        &mut self,
        ranges: &DriveRanges,
        draws: &mut Draws,
        reach: Reach,
        way_m: f64,
        sign: f64,
    ) {
        let stand = draws.within(ranges.stand_s);
        let a = draws.within(ranges.acceleration_mps2);
        let wanted = draws.within(ranges.speed_mps).min(reach.speed_mps);
        // a short leg ends before the wanted speed is reached
        let speed = wanted.min((way_m * a).sqrt());
        let ramp = speed / a;
        let run = (way_m - speed * ramp) / speed;
        let start = self.over_s + stand;
        let mut point = |t: f64, v: f64| {
            self.speed.push(Point {
                at_s: round(t, 2),
                mps: round(sign * v, 3),
            });
        };
        point(start, 0.0);
        point(start + ramp, speed);
        if run > 0.05 {
            point(start + ramp + run, speed);
        }
        point(start + 2.0 * ramp + run, 0.0);
        self.over_s = start + 2.0 * ramp + run;
    }
}
