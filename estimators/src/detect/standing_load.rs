//! Doubt of the load after a standstill.

use crate::Real;
use crate::api::real::sqrt;
use crate::api::snapshot::state;
use crate::tuning::{STANDING_LOAD, STATISTICS};

/// Doubt of the load after a standstill: loads are hung on and set down while the train stands, and nothing there
/// shows it. After a standstill of a given length a method that can do so opens its mass, and the mass is not valid
/// until the force balance has taken so many samples that another load would have been detected
/// ([`LoadChangeDetector`](crate::detect::load_change::LoadChangeDetector)).
/// Samples of before the last such standstill do not count. A mass that no sample has weighed since is left as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandingLoad {
    after_s: Real,
    standing_s: Real,
    /// True if another load may hang on the train.
    doubted: bool,
    /// Number of samples since then that count.
    samples: u32,
    /// True in the step in which the standstill has become long enough.
    begins: bool,
}

impl StandingLoad {
    /// Doubts the load from a standstill of `after_s` seconds on.
    pub fn new(after_s: Real) -> Self {
        Self {
            after_s,
            standing_s: 0.0,
            doubted: false,
            samples: 0,
            begins: false,
        }
    }

    /// One step of `dt` seconds at standstill, or in motion.
    pub fn observe(&mut self, standing: bool, dt: Real) {
        self.standing_s = if standing { self.standing_s + dt } else { 0.0 };
        self.begins = self.samples > 0 && self.standing_s >= self.after_s;
        if self.begins {
            (self.doubted, self.samples) = (true, 0);
        }
    }

    /// Returns true in the first step in which another load may hang on the train.
    pub fn begins(&self) -> bool {
        self.begins
    }

    /// Notes that the force balance has used a sample.
    pub fn sample(&mut self) {
        self.samples = (self.samples + 1).min(STATISTICS.confirming);
    }

    /// Returns true if an unseen other load is impossible.
    pub fn is_confirmed(&self) -> bool {
        !self.doubted || self.samples >= STATISTICS.confirming
    }
}

state!(StandingLoad { standing_s, doubted, samples, begins; after_s } where |this| this.standing_s >= 0.0);

/// Mass before a standstill, which is valid after it if a new weighing gives the same mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KeptMass {
    kept: Option<[Real; 2]>,
}

impl KeptMass {
    /// Keeps the mass from before a standstill and its variance; a mass kept from an earlier standstill has priority.
    pub fn keep(&mut self, mass: Real, variance: Real) {
        self.kept.get_or_insert([mass, variance]);
    }

    /// Forgets it: the load is another.
    pub fn forget(&mut self) {
        self.kept = None;
    }

    /// Compares the kept mass with the new mass and its variance. Once these tell that it is the same, returns the mass
    /// kept and its variance, a measurement of the mass; it is returned once.
    pub fn recall(&mut self, mass: Real, variance: Real) -> Option<[Real; 2]> {
        let kept = self.kept?;
        let [old, old_variance] = kept;
        let (off, sd) = ((mass - old).abs(), sqrt(variance + old_variance));
        if off > STATISTICS.fault_sd * sd {
            self.kept = None;
        }
        let same =
            off < STATISTICS.same_sd * sd && off + 2.0 * sd < STANDING_LOAD.same_share * mass;
        same.then(|| self.kept.take()).flatten()
    }
}

state!(KeptMass { kept; });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_no_reason_to_doubt_and_a_stay_is_until_six_samples_of_a_drive() {
        let mut load = StandingLoad::new(10.0);
        (0..6).for_each(|_| load.sample());
        (0..99).for_each(|_| load.observe(true, 0.1));
        assert!(load.is_confirmed());
        load.observe(false, 0.1);
        let begins = |_: &i32| {
            load.observe(true, 0.1);
            load.begins()
        };
        assert_eq!((0..200).filter(begins).count(), 1);
        assert!(!load.is_confirmed());
        load.observe(false, 0.1);
        (0..5).for_each(|_| load.sample());
        assert!(!load.is_confirmed());
        load.sample();
        assert!(load.is_confirmed());
    }

    #[test]
    fn a_load_that_nothing_has_weighed_is_in_no_new_doubt() {
        let mut load = StandingLoad::new(10.0);
        (0..200).for_each(|_| load.observe(true, 0.1));
        assert!(load.is_confirmed());
    }

    #[test]
    fn samples_of_before_a_second_stay_do_not_count() {
        let mut load = StandingLoad::new(10.0);
        for samples in [6, 5, 5] {
            (0..samples).for_each(|_| load.sample());
            (0..101).for_each(|_| load.observe(true, 0.1));
            load.observe(false, 0.1);
            assert!(!load.is_confirmed());
        }
        (0..5).for_each(|_| load.sample());
        assert!(!load.is_confirmed());
        load.sample();
        assert!(load.is_confirmed());
    }

    #[test]
    fn a_mass_is_the_same_once_a_good_weighing_comes_out_at_it() {
        let mut kept = KeptMass::default();
        assert_eq!(kept.recall(10.0, 0.01), None);
        kept.keep(10.0, 0.01);
        assert_eq!(kept.recall(10.1, 1.0), None, "too coarse a weighing");
        assert_eq!(kept.recall(10.1, 0.01), Some([10.0, 0.01]));
        assert_eq!(kept.recall(10.1, 0.01), None);
    }

    #[test]
    fn a_mass_that_a_weighing_contradicts_is_gone() {
        let mut kept = KeptMass::default();
        kept.keep(10.0, 0.0001);
        kept.keep(20.0, 0.0001);
        assert_eq!(kept.recall(20.0, 0.0001), None);
        assert_eq!(kept.recall(10.0, 0.0001), None);
    }
}
