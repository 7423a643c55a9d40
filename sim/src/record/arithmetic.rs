//! Probe of a machine's arithmetic: whether two machines round the elementary functions alike.
//!
//! One program file need not compute the same bits everywhere: the C library that it is linked to at run time chooses
//! among versions of sine, exponential or power by what the processor can do. The physics uses versions of its own;
//! metrics and statistics may not.

use crate::config::input_files::hex;
use sha2::{Digest, Sha256};
use std::hint::black_box;

/// A function of two numbers that are above zero.
type Function = fn(f64, f64) -> f64;

const FUNCTIONS: [Function; 14] = [
    |x, _| x.sin(),
    |x, _| x.cos(),
    |x, _| x.tan(),
    |x, _| x.exp(),
    |x, _| x.ln(),
    |x, _| x.cbrt(),
    |x, _| x.tanh(),
    |x, y| x.powf(y),
    |x, y| x.atan2(y),
    |x, y| x.hypot(y),
    |x, y| x.mul_add(y, -y),
    |x, y| (x / y).sqrt(),
    |x, y| libm::pow(x, y),
    |x, y| libm::atan2(x, y),
];
const ARGUMENTS: u32 = 257;

/// Sixteen digits that depend on every bit of some thousands of values.
pub fn probe() -> String {
    let mut hash = Sha256::new();
    for function in FUNCTIONS {
        for i in 1..=ARGUMENTS {
            let (x, y) = (f64::from(i) * 0.037, f64::from(ARGUMENTS + 1 - i) * 0.011);
            let value = function(black_box(x), black_box(y));
            hash.update(value.to_bits().to_le_bytes());
        }
    }
    hex(&hash.finalize()).chars().take(16).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_machine_answers_alike() {
        assert_eq!(probe(), probe());
        assert_eq!(probe().len(), 16);
    }
}
