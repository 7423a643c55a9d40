//! Sample and hold of the same channel of all drive units.

use crate::Real;
use crate::Time;
use crate::api::signals::{MAX_DRIVES, Sample};
use crate::api::snapshot::{Archive, State};
use crate::instruments::arrivals::Arrivals;
use crate::instruments::stuck_detector::StuckDetector;
use crate::preprocess::input_check::Stamps;

/// Drive units, one bit each.
pub type UnitMask = u32;

/// Sample and hold of one channel of each drive unit, as [`SampleHold`](crate::preprocess::sample_hold::SampleHold)
/// holds one of them.
///
/// On one bus the samples of all units come together and have one stamp, and noise makes each another than the one
/// before. As long as they do that, arrivals and changes are counted once for all.
#[derive(Clone, Copy, Debug)]
pub struct DriveHold {
    count: usize,
    /// State that every sample changes.
    all: All,
    units: [Unit; MAX_DRIVES],
}

/// State that all units have in common, and their values.
#[derive(Clone, Copy, Debug)]
struct All {
    /// Arrivals of all units while they have been the same for all.
    together: Option<Arrivals>,
    /// Changes of all values that the stuck detectors have not counted yet, and the instant of the last one.
    changes: u32,
    changed: Time,
    /// True if a unit has repeated its last value.
    repeats: bool,
    values: [Real; MAX_DRIVES],
}

/// One unit. Its arrivals are out of date while those of all are kept together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Unit {
    arrivals: Arrivals,
    late: u32,
    known: bool,
    stuck: StuckDetector<1>,
}

impl DriveHold {
    /// Builds the hold of the first `count` units.
    pub fn new(count: usize) -> Self {
        Self {
            count: count.min(MAX_DRIVES),
            all: All {
                together: None,
                changes: 0,
                changed: Time::default(),
                repeats: false,
                values: [0.0; MAX_DRIVES],
            },
            units: Default::default(),
        }
    }

    /// Takes new samples, which have come with these stamps; of which units one was taken.
    #[inline]
    pub fn take(
        &mut self,
        samples: &[Option<Sample<Real>>; MAX_DRIVES],
        stamps: Stamps,
        now: Time,
    ) -> UnitMask {
        if stamps == Stamps::Missing {
            return 0;
        }
        if let Stamps::Same(t) = stamps
            && let Some(arrivals) = &mut self.all.together
            && arrivals.take(t, now, false)
        {
            self.take_together(samples, now)
        } else {
            self.take_apart(samples, now)
        }
    }

    /// One sample of each unit, whose arrival has been noted.
    #[inline]
    fn take_together(
        &mut self,
        samples: &[Option<Sample<Real>>; MAX_DRIVES],
        now: Time,
    ) -> UnitMask {
        let units = self.all.values.iter().take(self.count);
        // Both are finite: those of the same bits are those that are equal, zeros aside.
        let repeats = |(value, sample): (&Real, &Option<Sample<Real>>)| {
            let same = sample.is_some_and(|new| new.value.to_bits() == value.to_bits());
            same & (*value != 0.0)
        };
        let repeated = units.zip(samples).map(repeats);
        if repeated.fold(self.all.repeats, |any, repeats| any | repeats) {
            self.tell_changes();
            let units = self.units.iter_mut().zip(&self.all.values);
            for ((unit, old), sample) in units.zip(samples).take(self.count) {
                let new = sample.map_or(*old, |new| new.value);
                unit.stuck.take([new], [*old], now);
            }
            self.all.repeats = self.units.iter().any(|unit| unit.stuck.repeats());
        } else {
            self.all.changes = self.all.changes.saturating_add(1);
            self.all.changed = now;
        }
        let units = self.all.values.iter_mut().take(self.count);
        for (value, sample) in units.zip(samples) {
            *value = sample.map_or(*value, |new| new.value);
        }
        self.mask_of_all()
    }

    /// The same where units differ.
    #[inline(never)]
    fn take_apart(&mut self, samples: &[Option<Sample<Real>>; MAX_DRIVES], now: Time) -> UnitMask {
        self.tell_changes();
        self.tell_arrivals();
        let mut taken = 0;
        let units = self.units.iter_mut().zip(&mut self.all.values);
        for (i, ((unit, value), sample)) in units.zip(samples).take(self.count).enumerate() {
            let Some(sample) = sample else { continue };
            if !unit.arrivals.take(sample.t, now, !unit.known) {
                unit.late = unit.late.saturating_add(1);
                continue;
            }
            if unit.known {
                unit.stuck.take([sample.value], [*value], now);
            }
            (*value, unit.known) = (sample.value, true);
            taken |= 1 << i;
        }
        self.join();
        taken
    }

    /// Brings the stuck detectors up to date.
    fn tell_changes(&mut self) {
        if self.all.changes > 0 {
            for unit in self.units.iter_mut().take(self.count) {
                unit.stuck.take_changes(self.all.changes, self.all.changed);
            }
            self.all.changes = 0;
        }
    }

    /// Brings the arrivals of the units up to date, which from now on may differ.
    fn tell_arrivals(&mut self) {
        if let Some(arrivals) = self.all.together.take() {
            for unit in self.units.iter_mut().take(self.count) {
                unit.arrivals = arrivals;
            }
        }
    }

    /// Keeps the arrivals together if they are the same for all units.
    fn join(&mut self) {
        self.all.repeats = self.units.iter().any(|unit| unit.stuck.repeats());
        let units = self.units.get(..self.count);
        let Some((first, others)) = units.and_then(<[_]>::split_first) else {
            return;
        };
        let same = |unit: &Unit| unit.known && unit.arrivals == first.arrivals;
        self.all.together = (first.known && others.iter().all(same)).then_some(first.arrivals);
    }

    fn mask_of_all(&self) -> UnitMask {
        (1 << self.count) - 1
    }

    /// The units whose value is neither stale nor stuck. `dt_s` is the estimator's step, the shortest period it can
    /// see.
    #[inline]
    pub fn fresh(&self, now: Time, dt_s: Real) -> UnitMask {
        let arrived = match &self.all.together {
            Some(arrivals) if arrivals.fresh(now, dt_s) => self.mask_of_all(),
            Some(_) => 0,
            None => {
                let units = self.units.iter().take(self.count);
                mask(units.map(|unit| unit.known && unit.arrivals.fresh(now, dt_s)))
            }
        };
        arrived & !self.stuck(now)
    }

    /// The units whose sensor is stuck.
    #[inline]
    pub fn stuck(&self, now: Time) -> UnitMask {
        if !self.all.repeats {
            return 0;
        }
        let units = self.units.iter().take(self.count);
        mask(units.map(|unit| unit.stuck.is_stuck(now)))
    }

    /// The values held of the chosen units, in order.
    #[inline]
    pub fn values(&self, chosen: UnitMask) -> impl Iterator<Item = Real> + Clone {
        let units = self.all.values.iter().take(self.count).enumerate();
        units.filter_map(move |(i, value)| (chosen & (1 << i) != 0).then_some(*value))
    }

    /// The values of all units, if all are chosen.
    #[inline]
    pub fn whole(&self, chosen: UnitMask) -> Option<&[Real]> {
        let values = self.all.values.get(..self.count);
        values.filter(|_| chosen == self.mask_of_all())
    }

    /// Writes the values of the chosen units to their places.
    #[inline]
    pub fn write(&self, chosen: UnitMask, places: &mut [Option<Real>; MAX_DRIVES]) {
        if let Some(values) = self.whole(chosen) {
            for (place, value) in places.iter_mut().zip(values) {
                *place = Some(*value);
            }
            return;
        }
        let units = places.iter_mut().zip(&self.all.values).take(self.count);
        for (i, (place, value)) in units.enumerate() {
            *place = (chosen & (1 << i) != 0).then_some(*value);
        }
    }

    /// Returns a copy in which the units have all changes and arrivals.
    fn told(&self) -> Self {
        let mut told = *self;
        told.tell_changes();
        told.tell_arrivals();
        told
    }
}

fn mask(units: impl Iterator<Item = bool>) -> UnitMask {
    let bits = units.enumerate().map(|(i, is)| UnitMask::from(is) << i);
    bits.fold(0, |all, bit| all | bit)
}

/// The same channels hold the same, whether it is kept for all or for each.
impl PartialEq for DriveHold {
    fn eq(&self, other: &Self) -> bool {
        let (this, other) = (self.told(), other.told());
        this.count == other.count
            && this.units == other.units
            && this.all.values == other.all.values
    }
}

impl State for DriveHold {
    fn visit(&mut self, archive: &mut Archive) {
        self.tell_changes();
        self.tell_arrivals();
        for (unit, value) in self.units.iter_mut().zip(&mut self.all.values) {
            let mut held = unit.known.then_some(*value);
            unit.arrivals.visit(archive);
            unit.late.visit(archive);
            held.visit(archive);
            unit.stuck.visit(archive);
            (*value, unit.known) = (held.unwrap_or(0.0), held.is_some());
        }
        self.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preprocess::sample_hold::SampleHold;
    use crate::testing::Random;

    const COUNT: usize = 5;

    /// Samples that come together, apart, late, with a stamp of their own, not at all, or repeat a value: 3 s of each,
    /// by turns.
    fn samples(k: i64, random: &mut Random) -> [Option<Sample<Real>>; MAX_DRIVES] {
        let now = 10_000_000 * k;
        core::array::from_fn(|i| {
            let lone = i == 2;
            // Once apart, arrivals hardly come together again: first what leaves them together.
            let kind = match k / 300 {
                ..3 => 0,
                early @ ..20 => [0, 3, 4, 6][early as usize % 4],
                late => late % 7,
            };
            let (lost, late_ns, repeats) = match kind {
                1 => (random.uniform() < 0.2, 0, false),
                2 => (false, if lone { 30_000_000 } else { 0 }, false),
                3 => (true, 0, false),
                4 => (false, 0, lone),
                5 => (k % 2 == 0, (40_000_000.0 * random.uniform()) as i64, false),
                6 => (k % 3 > 0, 0, k % 300 > 200),
                _ => (k % 2 == 0, 5_000_000, false),
            };
            let value = if repeats { 0.7 } else { random.normal() };
            let t = Time::from_ns(now - late_ns);
            (!lost).then_some(Sample { t, value })
        })
    }

    fn stamps(samples: &[Option<Sample<Real>>]) -> Stamps {
        let mut known = samples.iter().flatten();
        match samples.iter().all(Option::is_some) {
            true if samples
                .windows(2)
                .all(|s| s[0].map(|s| s.t) == s[1].map(|s| s.t)) =>
            {
                Stamps::Same(samples[0].map_or(Time::default(), |s| s.t))
            }
            false if known.next().is_none() => Stamps::Missing,
            _ => Stamps::Differ,
        }
    }

    /// Units are held as channels by themselves would be, also after a snapshot at any time.
    #[test]
    fn units_are_held_like_channels() {
        let mut random = Random::new(101);
        let mut units = DriveHold::new(COUNT);
        let mut channels = [SampleHold::default(); COUNT];
        let (mut together, mut stuck, mut stale) = (0, 0, 0);
        for k in 1..=10_000 {
            let now = Time::from_ns(10_000_000 * k);
            let new = samples(k, &mut random);
            let stamps = stamps(&new[..COUNT]);
            let taken = units.take(&new, stamps, now);
            let each = channels.iter_mut().zip(&new);
            assert_eq!(taken, mask(each.map(|(held, new)| held.take(*new, now))));
            together += i32::from(units.all.together.is_some() && taken > 0);

            let fresh = channels.each_ref().map(|held| held.fresh(now, 0.01));
            let chosen = units.fresh(now, 0.01);
            let mut written = [None; MAX_DRIVES];
            units.write(chosen, &mut written);
            assert_eq!(written[..COUNT], fresh);
            assert!(written[COUNT..].iter().all(Option::is_none));
            assert!(units.values(chosen).eq(fresh.into_iter().flatten()));
            assert_eq!(
                units.whole(chosen).is_some(),
                fresh.iter().all(Option::is_some)
            );
            assert_eq!(
                units.stuck(now),
                mask(channels.iter().map(|held| held.is_stuck(now)))
            );
            stuck += i32::from(units.stuck(now) == 1 << 2);
            stale += i32::from(chosen == 0);

            if k % 37 == 0 {
                let (mut bytes, mut other) = ([0; 4096], DriveHold::new(COUNT));
                units.visit(&mut Archive::writer(&mut bytes));
                other.visit(&mut Archive::reader(&bytes));
                assert_eq!(units, other);
                assert_eq!(units.all.together, other.all.together);
                units = other;
            }
        }
        assert!(
            together > 2_000 && stuck > 100 && stale > 500,
            "{together} {stuck} {stale}"
        );
    }
}
