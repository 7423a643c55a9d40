//! Random numbers for the tests of this crate (PCG-XSH-RR, O'Neill 2014; normal numbers by Box & Muller 1958).

pub mod balance;
mod jacobians;
mod registry_tests;
pub mod steps;
pub mod vehicles;

use std::vec::Vec;

use crate::Real;

pub struct Random {
    state: u64,
    spare: Option<Real>,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self {
            state: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xDA3E_39CB_94B9_5BDB,
            spare: None,
        };
        for _ in 0..4 {
            random.uniform();
        }
        random
    }

    /// Uniform in 0…1, never 0.
    pub fn uniform(&mut self) -> Real {
        let mut next = || {
            let old = self.state;
            self.state = old
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((((old >> 18) ^ old) >> 27) as u32).rotate_right((old >> 59) as u32) as u64
        };
        let bits = (next() << 21) ^ next();
        ((bits & ((1 << 53) - 1)) as Real + 0.5) / (1u64 << 53) as Real
    }

    /// Normal with mean 0 and standard deviation 1.
    pub fn normal(&mut self) -> Real {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let angle = 2.0 * std::f64::consts::PI * self.uniform();
        self.spare = Some(radius * angle.sin());
        radius * angle.cos()
    }
}

/// Two-sided 95 % band of a χ² variable (Wilson & Hilferty 1931), divided by its degrees of freedom.
pub fn chi_square_band(degrees: usize) -> (Real, Real) {
    let a = 2.0 / (9.0 * degrees as Real);
    let at = |z: Real| (1.0 - a + z * a.sqrt()).powi(3);
    (at(-1.96), at(1.96))
}

/// Root mean square.
pub fn rms(values: &[Real]) -> Real {
    (values.iter().map(|v| v * v).sum::<Real>() / values.len() as Real).sqrt()
}

#[test]
fn normal_numbers_have_mean_zero_and_variance_one() {
    let mut random = Random::new(3);
    let draws: Vec<Real> = (0..200_000).map(|_| random.normal()).collect();
    let mean = draws.iter().sum::<Real>() / draws.len() as Real;
    assert!(mean.abs() < 0.01, "{mean}");
    assert!((rms(&draws) - 1.0).abs() < 0.01);
}
