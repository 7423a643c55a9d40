//! Share of a step for a first-order lag, 1 − exp(−dt/τ), computed again only if step or time constant has changed.

use crate::Real;
use crate::api::real::lag;

/// The last two results of a function, by their arguments: steps of one length, computed as differences of times,
/// alternate between two neighbouring numbers.
///
/// It holds nothing that does not follow from the arguments: any two are equal, and no snapshot needs it.
#[derive(Clone, Copy, Debug, Default)]
pub struct LastTwo<K, V> {
    newer: (K, V),
    older: (K, V),
}

impl<K: Copy + PartialEq, V: Copy> LastTwo<K, V> {
    /// Returns `function(argument)`, computed or held; `argument` must not be that of [`Default`].
    #[inline]
    pub fn of(&mut self, argument: K, function: impl FnOnce(K) -> V) -> V {
        for (known, value) in [&self.newer, &self.older] {
            if *known == argument {
                return *value;
            }
        }
        let value = function(argument);
        self.older = self.newer;
        self.newer = (argument, value);
        value
    }
}

impl<K, V> PartialEq for LastTwo<K, V> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Shares of the last two steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LagShare(LastTwo<[Real; 2], Real>);

impl LagShare {
    /// Share of a step of `dt_s` > 0 for a lag of time constant `tau_s` > 0.
    #[inline]
    pub fn of(&mut self, dt_s: Real, tau_s: Real) -> Real {
        self.0.of([dt_s, tau_s], |[dt_s, tau_s]| lag(dt_s, tau_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_was_asked_before_the_share_is_that_of_its_arguments() {
        let mut share = LagShare::default();
        let steps = [0.01, 0.01, 0.010_000_1, 0.01, 0.02, 0.010_000_1, 0.01];
        for dt_s in steps {
            for tau_s in [1.0, 1.0, 2.0] {
                assert_eq!(share.of(dt_s, tau_s), lag(dt_s, tau_s));
            }
        }
    }

    #[test]
    fn two_arguments_by_turns_are_computed_once_each() {
        let mut shares = LastTwo::<u32, u32>::default();
        let mut computed = 0;
        for k in 0..10 {
            let value = shares.of(1 + k % 2, |argument| {
                computed += 1;
                10 * argument
            });
            assert_eq!(value, 10 + 10 * (k % 2));
        }
        assert_eq!(computed, 2);
    }
}
