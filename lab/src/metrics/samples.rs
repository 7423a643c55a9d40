//! Samples that count: a stretch of time, and which samples of it.

use crate::metrics::Quantity;
use crate::metrics::series::ErrorSample;

/// Which samples count.
#[derive(Clone, Copy, Debug)]
pub enum Keep<'a> {
    /// All.
    All,
    /// Those in which the estimator marks this quantity valid.
    Valid(Quantity),
    /// Those in which it and another estimator, whose samples these are, both mark this quantity valid.
    Common(Quantity, &'a [ErrorSample]),
}

/// Samples of an estimator in the order of time, of which some count.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    all: &'a [ErrorSample],
    keep: Keep<'a>,
}

impl<'a> Samples<'a> {
    /// These samples.
    pub fn new(all: &'a [ErrorSample], keep: Keep<'a>) -> Self {
        Self { all, keep }
    }

    /// Those that count.
    pub fn iter(self) -> impl Iterator<Item = &'a ErrorSample> {
        let counts = move |(i, x): &(usize, &ErrorSample)| match self.keep {
            Keep::All => true,
            Keep::Valid(q) => q.is_valid(x),
            Keep::Common(q, other) => q.is_valid(x) && other.get(*i).is_some_and(|y| q.is_valid(y)),
        };
        self.all.iter().enumerate().filter(counts).map(|(_, x)| x)
    }

    /// Those from this instant on, s.
    pub fn from_s(self, t_s: f64) -> Self {
        let from = self.all.partition_point(|x| x.t_s < t_s);
        let keep = match self.keep {
            Keep::Common(q, other) => Keep::Common(q, other.get(from..).unwrap_or(&[])),
            keep => keep,
        };
        Self {
            all: self.all.get(from..).unwrap_or(&[]),
            keep,
        }
    }
}
