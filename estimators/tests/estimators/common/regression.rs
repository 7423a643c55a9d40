//! Regressions for the mass on the force balance, y = hᵀ χ by least squares that forget nothing: the tests show which
//! of them can find what.
//!
//! | id | y | h | χ | source |
//! |---|---|---|---|---|
//! | R-A | a | [F − J v̇, −g √(1 + μ²)] | [1/M, sin(θ + s atan μ)] | Liu et al. 2023, eq. 16–18 |
//! | R-C | Δ(F − J v̇) | Δa | M | Guo et al. 2024, eq. 2–4 |
//! | R-D | F | a + s μ g + (J/M₀) v̇ | M | patent CN 111507019 B, eq. 20 |
//! | R-G | F − J v̇ | a + s μ g | M | the force balance, μ known |
//! | R-H | F − J v̇ | [a, 1] | [M, M (s μ g − b)] | the force balance, μ free |
//!
//! a is the specific force of the accelerometer or, with `wheels`, the acceleration of the wheels; R-D then adds the
//! slope that the force balance has with the mass found so far. Cosines are taken for 1.

use monorig_estimators::api::estimator::Estimator;
use monorig_estimators::api::signals::{Command, Estimate, Measurements, Value};
use monorig_estimators::filters::forgetting::Forgetting;
use monorig_estimators::filters::gaussian::Gaussian;
use monorig_estimators::filters::low_pass::MatchedFilter;
use monorig_estimators::filters::rls::Rls;
use monorig_estimators::models::force_balance::ForceBalance;
use monorig_estimators::{Error, Real};
use nalgebra::vector;

use super::{vehicle, world::G};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Row {
    Coupled,
    Differenced,
    Straight,
    KnownResistance,
    FreeResistance,
}

/// The filtered signals of one instant.
#[derive(Clone, Copy)]
struct Signals {
    /// F, N.
    force: Real,
    speed: Real,
    /// v̇, m/s².
    rate: Real,
    /// Reading of the accelerometer, m/s².
    felt: Real,
}

pub struct Regression {
    row: Row,
    wheels: bool,
    mass0_kg: Real,
    filters: [MatchedFilter; 3],
    rls: Rls<2>,
    before: Option<Signals>,
    now: Option<Signals>,
    moving_s: Real,
    since_s: Real,
}

impl Regression {
    /// With the first mass, kg.
    pub fn new(row: Row, wheels: bool, mass0_kg: Real) -> Self {
        let mu = vehicle(2).running_resistance;
        let (free, free_sd) = match row {
            Row::Coupled => (mu, 0.3),
            Row::FreeResistance => (mu * G, 0.3 * G),
            _ => (0.0, 0.0),
        };
        let prior = Gaussian::independent(vector![1.0, free], vector![0.5, free_sd]);
        Self {
            row,
            wheels,
            mass0_kg,
            filters: [MatchedFilter::new(1.0); 3],
            rls: Rls::new(prior, Forgetting::None),
            before: None,
            now: None,
            moving_s: 0.0,
            since_s: 0.0,
        }
    }

    /// χ: mass or inverse mass over the first mass or its inverse, and the free term.
    pub fn found(&self) -> [Real; 2] {
        self.rls.belief.x.into()
    }

    /// Mass within the range of the vehicle, kg.
    fn mass_kg(&self) -> Real {
        let [first, _] = self.found();
        let [low, high] = vehicle(2).mass_range_kg;
        let kg = match self.row {
            Row::Coupled if first <= 0.0 => high,
            Row::Coupled => self.mass0_kg / first,
            _ => self.mass0_kg * first,
        };
        kg.clamp(low, high)
    }

    /// Sine of the slope that the force balance has with the mass found so far.
    fn sine(&self, now: &Signals) -> Real {
        let vehicle = vehicle(2);
        let mass = self.mass_kg();
        let driven = now.force - (mass + vehicle.rotating_mass_kg) * now.rate;
        driven / (mass * G) - now.speed.signum() * vehicle.running_resistance
    }

    fn learn(&mut self, now: Signals) {
        let vehicle = vehicle(2);
        let (mu, rotating) = (vehicle.running_resistance, vehicle.rotating_mass_kg);
        let direction = now.speed.signum();
        let net = |s: &Signals| (s.force - rotating * s.rate) / self.mass0_kg;
        let a = |s: &Signals| if self.wheels { s.rate } else { s.felt };
        let with_slope = if self.wheels {
            now.rate + G * self.sine(&now)
        } else {
            now.felt
        };
        let resultant = G * (1.0 + mu * mu).sqrt();
        let (y, h) = match self.row {
            Row::Coupled if self.wheels => (a(&now), vector![net(&now), -resultant]),
            Row::Coupled => (a(&now), vector![net(&now), -direction * resultant]),
            Row::Differenced => {
                let Some(before) = self.before.replace(now) else {
                    return;
                };
                let change = vector![a(&now) - a(&before), 0.0];
                (net(&now) - net(&before), change)
            }
            Row::Straight => {
                let h = with_slope + direction * mu * G + rotating / self.mass0_kg * now.rate;
                (now.force / self.mass0_kg, vector![h, 0.0])
            }
            Row::KnownResistance => (net(&now), vector![a(&now) + direction * mu * G, 0.0]),
            Row::FreeResistance => (net(&now), vector![a(&now), 1.0]),
        };
        self.rls.update(y, &h, 0.02 * 0.02, false).unwrap();
    }
}

impl Estimator for Regression {
    fn step(&mut self, z: &Measurements, _: &Command, dt: Real) -> Result<Estimate, Error> {
        let torque: Real = z.motor_torque_nm.iter().flatten().map(|s| s.value).sum();
        let wheels = || z.wheel_speed_mps.iter().flatten().map(|s| s.value);
        let speed = wheels().sum::<Real>() / wheels().count() as Real;
        let force = ForceBalance::new(&vehicle(2)).traction(torque, speed);
        let felt = z.specific_force_mps2.unwrap().value[0];
        for (filter, input) in self.filters.iter_mut().zip([force, speed, felt]) {
            filter.step(input, dt);
        }
        let [force, speed, felt] = self.filters.map(|filter| filter.value().unwrap());
        let now = Signals {
            force,
            speed,
            rate: self.filters[1].rate(),
            felt,
        };
        self.now = Some(now);
        self.moving_s = if speed.abs() > 0.05 {
            self.moving_s + dt
        } else {
            0.0
        };
        self.since_s += dt;
        let every_s = if self.row == Row::Differenced {
            0.5
        } else {
            0.1
        };
        if self.moving_s >= 1.5 && self.since_s >= every_s - 1e-9 {
            self.since_s = 0.0;
            self.learn(now);
        }
        let mut estimate = Estimate::at(z.t);
        estimate.total_mass_kg.value = self.mass_kg();
        estimate.grade_rad = Value {
            value: self.sine(&now).clamp(-1.0, 1.0).asin(),
            sd: 0.0,
            valid: true,
        };
        Ok(estimate)
    }

    fn reset(&mut self) {
        *self = Self::new(self.row, self.wheels, self.mass0_kg);
    }
}
