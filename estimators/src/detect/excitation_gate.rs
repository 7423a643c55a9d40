//! Excitation gate: whether the regressor of a regression varies enough for its samples to inform.

use crate::Real;
use crate::api::real::lag;
use crate::api::snapshot::state;
use crate::filters::ewma_variance::EwmaVariance;
use crate::tuning::EXCITATION;

/// Excitation gate: open while the running standard deviation of the regressor is above a threshold.
///
/// Noise in a regressor that hardly varies makes its samples less informative than the recursion takes them for (errors
/// in variables). At steady speed a regression without this gate becomes certain of a mass that noise has made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcitationGate {
    on: bool,
    threshold: Real,
    memory_s: Real,
    regressor: EwmaVariance,
    excited: bool,
}

impl ExcitationGate {
    /// Opens above a standard deviation of `threshold`, in the unit of the regressor, of memory `memory_s`. If not
    /// `on`, it is open at every value.
    pub fn new(on: bool, threshold: Real, memory_s: Real) -> Self {
        Self {
            on,
            threshold,
            memory_s,
            regressor: EwmaVariance::default(),
            excited: false,
        }
    }

    /// Takes a value of the regressor, held for `period_s`.
    pub fn observe(&mut self, regressor: Real, period_s: Real) {
        let share = lag(period_s.min(EXCITATION.max_period_s), self.memory_s);
        self.regressor.add(regressor, share);
        self.excited = !self.on || self.regressor.sd() > self.threshold;
    }

    /// Closes it until the next value.
    pub fn close(&mut self) {
        self.excited = false;
    }

    /// Returns true if the gate is open.
    pub fn excited(&self) -> bool {
        self.excited
    }
}

state!(ExcitationGate { regressor, excited; on, threshold, memory_s });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_opens_on_variation_and_closes_after_its_memory() {
        let mut gate = ExcitationGate::new(true, 0.1, 5.0);
        let mut always = ExcitationGate::new(false, 0.1, 5.0);
        let steady = (0..100).map(|_| 1.0);
        let varied = (0..100).map(|k| if k % 20 < 10 { 0.5 } else { 1.5 });
        let late = (0..400).map(|_| 1.0);
        let open: std::vec::Vec<bool> = steady
            .chain(varied)
            .chain(late)
            .map(|x| {
                gate.observe(x, 0.1);
                always.observe(x, 0.1);
                assert!(always.excited());
                gate.excited()
            })
            .collect();
        assert!(!open[99] && open[120] && open[199] && !open[599]);
        gate.close();
        assert!(!gate.excited());
    }
}
