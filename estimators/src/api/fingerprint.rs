//! Fingerprints of parameters and vehicles: a snapshot keeps those of its origin.

use crate::Real;
use crate::api::params::{Parameters, Setting};

/// 64-bit FNV-1a (Fowler, Noll & Vo).
pub(crate) struct Fingerprint(u64);

impl Fingerprint {
    /// Builds the fingerprint of no data.
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Adds numbers, to the last bit.
    pub fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a Real>) {
        for number in numbers {
            self.add(&number.to_le_bytes());
        }
    }

    /// Adds names and values of all parameters.
    pub fn parameters<P: Parameters>(&mut self, params: &P) {
        for key in P::GROUPS.iter().copied().flatten() {
            self.add(key.name.as_bytes());
            match params.get(key.name) {
                None => self.add(&[0]),
                Some(Setting::Number(number)) => self.numbers(&[number]),
                Some(Setting::Flag(flag)) => self.add(&[1 + u8::from(flag)]),
                Some(Setting::Choice(word)) => self.add(word.as_bytes()),
            }
        }
    }

    /// The number.
    pub fn finish(self) -> u64 {
        self.0
    }
}
