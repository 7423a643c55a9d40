//! Tests of the abilities and limits of the named estimators, on a simulated crane of one degree of freedom. This file
//! holds the common parts of the tests.

mod bend;
mod faults;
mod long;
mod mass;
mod slope;
mod slope_sd;
mod supervise;
mod units;

use crate::api::estimator::{Estimator, Internal};
use crate::api::params::Setting;
use crate::api::signals::{Command, Estimate, Measurements, Vehicle};
use crate::registry::*;
use crate::testing::Random;
use crate::testing::vehicles::*;
use crate::{Error, Real};
use std::vec::Vec;

/// Errors of the recommended mass regression at the end of a run, over seeds: (bias, root mean square, mean of
/// (error/sd)²).
pub fn mass_statistics(name: &str, worlds: impl Fn(u64) -> World) -> (Real, Real, Real) {
    let count = 40;
    let (mut bias, mut square, mut normalised) = (0.0, 0.0, 0.0);
    for seed in 1..=count {
        let mut estimator = build(name, &vehicle(), [("mass0_kg", 12_000.0.into())]).unwrap();
        let rows = worlds(seed).run(&mut estimator);
        let last = rows.last().unwrap();
        let error = last.estimate.total_mass_kg.value / last.mass - 1.0;
        bias += error / count as Real;
        square += error * error / count as Real;
        normalised += (error * last.mass / last.estimate.total_mass_kg.sd).powi(2) / count as Real;
    }
    (bias, square.sqrt(), normalised)
}

/// Root-mean-square grade error, deg, over ten seeds.
pub fn grade_rms(name: &str, settings: &[(&str, Setting)], worlds: impl Fn(u64) -> World) -> Real {
    let errors: Vec<Real> = (1..=10)
        .map(|seed| {
            let mut estimator = build(name, &vehicle(), settings.iter().copied()).unwrap();
            grade_error_deg(&worlds(seed).run(&mut estimator), 5.0)
        })
        .collect();
    let rms = crate::testing::rms(&errors);
    std::println!("{name} {settings:?}: {rms:.4}°");
    rms
}

/// Hides samples from an estimator, or changes the command it sees.
pub struct Tampered<E, F> {
    pub estimator: E,
    pub tamper: F,
}

impl<E: Estimator, F: Fn(&mut Measurements, &mut Command)> Estimator for Tampered<E, F> {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let (mut z, mut u) = (*z, *u);
        (self.tamper)(&mut z, &mut u);
        self.estimator.step(&z, &u, dt)
    }

    fn reset(&mut self) {
        self.estimator.reset();
    }

    fn internals(&self) -> &[Internal] {
        self.estimator.internals()
    }

    fn internal_values(&self, values: &mut [Real]) {
        self.estimator.internal_values(values);
    }
}

pub fn tampered(name: &str, tamper: impl Fn(&mut Measurements, &mut Command)) -> Vec<Row> {
    let estimator = build(name, &vehicle(), [("mass0_kg", 12_000.0.into())]).unwrap();
    world(1).run(&mut Tampered { estimator, tamper })
}
