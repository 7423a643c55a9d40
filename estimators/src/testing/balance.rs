//! Samples of a force balance that holds exactly, on a train whose tare and load rest on different grades.

use crate::Real;
use crate::models::sample::ResampledSample;
use crate::supervised::sample::BalanceSample;
use crate::testing::Random;

const GRAVITY: Real = 9.81;

/// True values of the train.
#[derive(Clone, Copy)]
pub struct Truth {
    pub mass_kg: Real,
    pub tare_kg: Real,
    pub rotating_mass_kg: Real,
    pub mu: Real,
    /// Running-resistance coefficient that a curve adds, times its radius, m.
    pub curve_m: Real,
    pub accel_bias: Real,
}

/// An instant of a run.
#[derive(Clone, Copy)]
pub struct Instant {
    pub speed_mps: Real,
    pub acceleration_mps2: Real,
    /// Mean of sin θ under the tare and under the load.
    pub sine: [Real; 2],
    pub curvature_per_m: Real,
}

impl Instant {
    /// Starts, stops, reversals, ramps and curves, none like the one before.
    pub fn draw(random: &mut Random) -> Self {
        Self {
            speed_mps: if random.uniform() < 0.5 { 1.0 } else { -1.0 },
            acceleration_mps2: 0.4 * random.normal(),
            sine: [0.15, 0.15].map(|sd| (sd * random.normal()).clamp(-0.4, 0.4)),
            curvature_per_m: 0.2 * random.uniform(),
        }
    }
}

impl Truth {
    /// Sum of what holds the masses back, each on its own grade, in N; the rail is read with the bias of the
    /// accelerometer, of which the sample says nothing.
    pub fn sample(&self, at: &Instant) -> BalanceSample {
        let (a, [tare, load]) = (at.acceleration_mps2, at.sine);
        let load_kg = self.mass_kg - self.tare_kg;
        let sine = (self.tare_kg * tare + load_kg * load) / self.mass_kg;
        let mu = self.mu + self.curve_m * at.curvature_per_m;
        let force_n = (self.mass_kg + self.rotating_mass_kg) * a
            + GRAVITY * (self.tare_kg * tare + load_kg * load)
            + at.speed_mps.signum() * mu * self.mass_kg * GRAVITY * (1.0 - sine * sine).sqrt();
        BalanceSample {
            sample: ResampledSample {
                force_n,
                speed_mps: at.speed_mps,
                acceleration_mps2: a,
                period_s: 0.5,
                ..ResampledSample::default()
            },
            u_mps2: at.sine.map(|sine| GRAVITY * sine + self.accel_bias),
            curvature_per_m: at.curvature_per_m,
            ..BalanceSample::default()
        }
    }
}

/// The grade angle, rad, on which a traction keeps the speed: sin θ + s μ cos θ = F/(M g), by bisection.
pub fn steady_grade(traction_n: Real, mass_kg: Real, resistance: Real) -> Real {
    let lack =
        |theta: Real| theta.sin() + resistance * theta.cos() - traction_n / (mass_kg * GRAVITY);
    let (mut low, mut high) = (-1.2, 1.2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if lack(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}
