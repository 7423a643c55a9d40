//! A part of the runs of a study or a test, for one of several machines.

use serde::{Deserialize, Serialize};

/// A part of a study's runs: those whose index leaves the remainder `part - 1` when divided by `of`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of the part, from 1.
    pub part: u64,
    /// Number of parts.
    pub of: u64,
}

impl Shard {
    /// All runs.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Index of this part's run number `n`, from 0.
    pub fn index(self, n: u64) -> u64 {
        n * self.of + (self.part - 1)
    }

    /// Number of runs in this part.
    pub fn runs(self, all: u64) -> u64 {
        (all + self.of - self.part) / self.of
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_runs() {
        for (all, of) in [(10, 3), (3, 5), (7, 1), (0, 2)] {
            let mut seen: Vec<u64> = Vec::new();
            for part in 1..=of {
                let shard = Shard { part, of };
                seen.extend((0..shard.runs(all)).map(|n| shard.index(n)));
            }
            seen.sort_unstable();
            assert_eq!(seen, (0..all).collect::<Vec<_>>());
        }
    }
}
