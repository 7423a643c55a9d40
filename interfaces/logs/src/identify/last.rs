//! The last values of channels that do not come in every step, while they are not too old.

use super::tracks::{longest_gap_ns, rim_force};
use monorig_estimators::api::signals::{MAX_DRIVES, Measurements, Sample, Vehicle};

/// The last sample of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct LastSample {
    t_ns: i64,
    value: f64,
    /// Usual interval, ns; 0 before the second sample.
    interval_ns: i64,
    is_there: bool,
}

impl LastSample {
    fn see(&mut self, t_ns: i64, value: f64) {
        if self.is_there {
            let step = t_ns.saturating_sub(self.t_ns).max(0);
            self.interval_ns = match self.interval_ns {
                0 => step,
                // a gap makes the usual interval little longer
                usual => usual + (step.min(2 * usual) - usual) / 16,
            };
        }
        (self.t_ns, self.value, self.is_there) = (t_ns, value, true);
    }

    /// The value; none where it is older than a gap that is bridged.
    fn at(&self, now_ns: i64) -> Option<f64> {
        let age_ns = now_ns.saturating_sub(self.t_ns);
        (self.is_there && age_ns <= longest_gap_ns(self.interval_ns)).then_some(self.value)
    }
}

/// Last values of channels that do not come in every step. One that is too old counts no more: what `valid_if` rejects
/// leaves nothing behind.
#[derive(Default)]
pub(crate) struct LastValues {
    wheels: [LastSample; MAX_DRIVES],
    torques: [LastSample; MAX_DRIVES],
    now_ns: i64,
    /// Of the motors at the rims as the nominal vehicle has it, N; not a number without a torque.
    pub force_n: f64,
}

impl LastValues {
    /// Takes what is new.
    pub fn see(&mut self, z: &Measurements, v: &Vehicle) {
        self.now_ns = z.t.ns();
        let take = |last: &mut [LastSample], new: &[Option<Sample<f64>>]| {
            for (last, new) in last.iter_mut().zip(new) {
                if let Some(sample) = new {
                    last.see(sample.t.ns(), sample.value);
                }
            }
        };
        take(&mut self.wheels, &z.wheel_speed_mps);
        take(&mut self.torques, &z.motor_torque_nm);
        let speed = self.speed();
        let force = |torque: Option<f64>| rim_force(torque.unwrap_or(f64::NAN), speed, v);
        self.force_n = match self.torques.iter().any(|t| t.is_there) {
            true => self.known(&self.torques).map(force).sum(),
            false => f64::NAN,
        };
    }

    /// The values of the channels that there are; none of one that is too old.
    fn known<'a>(&'a self, all: &'a [LastSample]) -> impl Iterator<Item = Option<f64>> + 'a {
        let there = all.iter().filter(|last| last.is_there);
        there.map(|last| last.at(self.now_ns))
    }

    /// Each wheel; none that is not known.
    pub fn wheels(&self) -> impl Iterator<Item = Option<f64>> + '_ {
        self.wheels.iter().map(|last| last.at(self.now_ns))
    }

    /// Mean of the wheels that are known, m/s; not a number of none.
    pub fn speed(&self) -> f64 {
        let known = self.known(&self.wheels).flatten();
        let (n, sum) = known.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
        sum / n
    }
}
