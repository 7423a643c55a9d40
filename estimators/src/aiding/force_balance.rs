//! Force balance of a block of half a second, as a measurement of the load, its swing and the resistance.
//!
//! z = F − (J + m₀ − m_g) a − g Σ m S* − m₀ μ' g c s
//! h = (m_L + m_g) a_L + m_L (g S*_L + μ' g c s) + s (r c' + c_v |v| + q_c κ) + d + η g Σ m x/9 m − M b
//!
//! with the load's acceleration a_L = −g φ̄ c (1 + h κ_L) by the mean swing φ̄ ([`SwingBlock`]), M = m₀ + m_L, m_g the
//! gear that swings with the load, s the sign of the speed, c the cosine of the grade under the load (c' of its share
//! of the resistance), μ' the part of the resistance that grows with the load, S* the mean grade of masses below the
//! rail ([`TrainMeans`]), Σ m x of the masses behind the rail read.

use nalgebra::SVector;

use crate::Real;
use crate::aiding::Aid;
use crate::api::real::{GRAVITY, sqrt};
use crate::models::swing::{SUBSTEPS, SwingBlock};
use crate::models::swing_balance::{
    ANGLE, B, CV, D, ETA, LENGTH, MASS, N, QC, R0, RATE, SwingModel,
};
use crate::rail::train_means::TrainMeans;
use crate::tuning::RAIL;

/// The measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockForce<'a> {
    /// The model of the state.
    pub model: &'a SwingModel,
    /// Means over the train.
    pub means: &'a TrainMeans,
    /// Mean traction at the rims, N.
    pub traction_n: Real,
    /// Mean speed, m/s.
    pub speed_mps: Real,
    /// Acceleration in parts, m/s².
    pub accelerations_mps2: [Real; SUBSTEPS],
    /// Length of a part, s.
    pub substep_s: Real,
    /// Variance of the noise, N².
    pub variance: Real,
}

/// Standard deviations of the noise of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockNoise {
    /// Standard deviation of the balance per mass, m/s².
    pub model_sd_mps2: Real,
    /// Standard deviation for the load, as a share of the load times the accelerations.
    pub swing_model_sd: Real,
    /// Mass to which the noise is proportional, kg.
    pub mass_kg: Real,
    /// Variance of the traction, N².
    pub traction_variance: Real,
    /// Standard deviation of the noise of the acceleration of a part, m/s².
    pub part_noise_mps2: Real,
}

impl BlockForce<'_> {
    fn sign(&self) -> Real {
        if self.speed_mps < 0.0 { -1.0 } else { 1.0 }
    }

    fn acceleration_mps2(&self) -> Real {
        self.accelerations_mps2.iter().sum::<Real>() / SUBSTEPS as Real
    }

    /// μ' g c s, m/s².
    fn friction_mps2(&self) -> Real {
        self.model.nominal.mu_load * GRAVITY * self.means.load_cos * self.sign()
    }

    /// c' of the resistance that does not grow with the load.
    fn normal(&self) -> Real {
        1.0 - self.model.nominal.load_share * (1.0 - self.means.load_cos)
    }

    /// g Σ m x/9 m of a load of `load_kg`, N per rad.
    fn behind(&self, load_kg: Real) -> Real {
        let means = self.means;
        GRAVITY / RAIL.eta_m * (means.behind_tare_kgm + load_kg * means.behind_load_m)
    }

    /// ∂a_L/∂φ̄, m/s² per rad.
    fn by_angle(&self) -> Real {
        let means = self.means;
        -GRAVITY * means.load_cos * (1.0 + self.model.depth_m * means.load_curvature_per_m)
    }

    fn pendulum(
        &self,
        x: &SVector<Real, N>,
        of: fn(Real, &[Real; SUBSTEPS], Real) -> SwingBlock,
    ) -> SwingBlock {
        let a = self.accelerations_mps2.map(|a| a * self.means.load_cos);
        of(self.model.length_m(x), &a, self.substep_s)
    }

    /// Acceleration of the load, m/s².
    fn load_acceleration(&self, x: &SVector<Real, N>) -> Real {
        if !self.model.swings {
            return self.acceleration_mps2();
        }
        let swing = self.pendulum(x, SwingBlock::new);
        self.by_angle() * swing.mean_angle([x[ANGLE], x[RATE]])
    }

    /// Standard deviation of the load's mean acceleration due to the noise of the parts' acceleration, m/s²: of the
    /// angle that a random walk of the rate leads to, ∫∫, in the mean over a block T √(T³/20).
    fn shaken_mps2(&self, part_noise_mps2: Real, x: &SVector<Real, N>) -> Real {
        if !self.model.swings || part_noise_mps2 <= 0.0 {
            return 0.0;
        }
        let T = self.substep_s * SUBSTEPS as Real;
        let walk = part_noise_mps2 * sqrt(self.substep_s) / self.model.length_m(x);
        self.by_angle() * walk * sqrt(T * T * T / 20.0)
    }

    /// Sets the variance of the noise at a state.
    pub fn with_noise(mut self, noise: &BlockNoise, x: &SVector<Real, N>) -> Self {
        let n = &self.model.nominal;
        let of = |sd: Real| sd * sd;
        let hanging_kg = noise.mass_kg - n.tare_kg + n.gear_kg;
        let moved = self.acceleration_mps2().abs() + self.load_acceleration(x).abs();
        let ahead_rad = self.means.ahead_rad_per_m * self.means.ahead_kgm / n.tare_kg;
        self.variance = noise.traction_variance
            + of(noise.model_sd_mps2 * noise.mass_kg)
            + of(ahead_rad * noise.mass_kg * GRAVITY)
            + of(noise.swing_model_sd * hanging_kg * moved)
            + of(hanging_kg * self.shaken_mps2(noise.part_noise_mps2, x));
        self
    }
}

impl Aid<N> for BlockForce<'_> {
    fn innovation(&self, x: &SVector<Real, N>) -> Real {
        let n = &self.model.nominal;
        let rigid_kg = n.rotating_kg + n.tare_kg - n.gear_kg;
        let z = self.traction_n
            - rigid_kg * self.acceleration_mps2()
            - GRAVITY * self.means.tare_deep_kg
            - n.tare_kg * self.friction_mps2();
        z - self.h(x)
    }

    fn h(&self, x: &SVector<Real, N>) -> Real {
        let (n, means) = (&self.model.nominal, self.means);
        let resistance =
            self.normal() * x[R0] + x[CV] * self.speed_mps.abs() + x[QC] * means.bend_per_m;
        (x[MASS] + n.gear_kg) * self.load_acceleration(x)
            + x[MASS] * (GRAVITY * means.load_deep + self.friction_mps2())
            + self.sign() * resistance
            + x[D]
            + x[ETA] * self.behind(x[MASS])
            - (n.tare_kg + x[MASS]) * x[B]
    }

    #[allow(
        clippy::indexing_slicing,
        reason = "indices of states are constants below N"
    )]
    fn H(&self, x: &SVector<Real, N>) -> SVector<Real, N> {
        let (n, means) = (&self.model.nominal, self.means);
        let mut h = SVector::<Real, N>::zeros();
        if self.model.swings {
            let swing = self.pendulum(x, SwingBlock::new);
            let by_length = self.pendulum(x, SwingBlock::by_log_length);
            let by_mean = (x[MASS] + n.gear_kg) * self.by_angle();
            let [by_start, by_rate] = swing.mean;
            h[ANGLE] = by_mean * by_start;
            h[RATE] = by_mean * by_rate;
            h[LENGTH] = by_mean * by_length.mean_angle([x[ANGLE], x[RATE]]);
        }
        h[MASS] = self.load_acceleration(x)
            + GRAVITY * means.load_deep
            + self.friction_mps2()
            + GRAVITY / RAIL.eta_m * means.behind_load_m * x[ETA]
            + h[LENGTH] * self.model.log_length_by_mass(x)
            - x[B];
        h[R0] = self.sign() * self.normal();
        h[CV] = self.speed_mps; // s |v|
        h[QC] = self.sign() * means.bend_per_m;
        h[D] = 1.0;
        h[ETA] = self.behind(x[MASS]);
        h[B] = -(n.tare_kg + x[MASS]);
        h
    }

    fn R(&self) -> Real {
        self.variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::mass_layout::MassLayout;
    use crate::models::swing_balance::Nominal;
    use crate::testing::vehicles::vehicle;

    /// Each source of noise adds its variance: torques, the model per mass, the grade ahead of what was read (0.032 rad
    /// for each metre of the tare in the mean), the swing as a share of the load and the gear times the accelerations,
    /// and the accelerometer's noise of the parts through the pendulum, which a rigid load does not have.
    #[test]
    fn the_noise_of_a_block_is_the_sum_of_its_sources() {
        let mut layout = MassLayout::even(5_000.0, [0.0; 2], [0.0; 2]);
        (layout.load.chain_m, layout.load.swinging_tare_kg) = (0.6, 500.0);
        let nominal = Nominal::new(&vehicle(), &layout, None, 0.01);
        let (mut x, swing_rad) = (SVector::<Real, N>::zeros(), 0.1);
        (x[MASS], x[ANGLE]) = (9_000.0, swing_rad);
        let means = TrainMeans {
            load_cos: 1.0,
            ahead_kgm: 2_500.0,
            ahead_rad_per_m: 0.032,
            ..TrainMeans::default()
        };
        let none = BlockNoise {
            model_sd_mps2: 0.0,
            swing_model_sd: 0.0,
            mass_kg: 14_000.0,
            traction_variance: 0.0,
            part_noise_mps2: 0.0,
        };
        for swings in [true, false] {
            let model = SwingModel {
                nominal,
                swings,
                depth_m: 0.0,
                swing_damping: 0.0,
                swing_walk: 0.0,
                length_walk: 0.0,
            };
            let sd_n = |noise: BlockNoise, means: &TrainMeans, a: Real| {
                let force = BlockForce {
                    model: &model,
                    means,
                    traction_n: 0.0,
                    speed_mps: 1.0,
                    accelerations_mps2: [a; SUBSTEPS],
                    substep_s: 1e-3,
                    variance: 0.0,
                };
                force.with_noise(&noise, &x).R().sqrt()
            };
            let ahead_n = 0.032 * 0.5 * 14_000.0 * GRAVITY;
            assert!((sd_n(none, &means, 0.0) / ahead_n - 1.0).abs() < 1e-9);
            let read = TrainMeans {
                ahead_kgm: 0.0,
                ..means
            };
            assert_eq!(sd_n(none, &read, 0.0), 0.0);
            // a block that is short against the swing: the load is where it was, and falls by g φ
            let by_load = if swings { GRAVITY * swing_rad } else { 0.2 };
            for (noise, expected) in [
                (
                    BlockNoise {
                        traction_variance: 400.0,
                        ..none
                    },
                    20.0,
                ),
                (
                    BlockNoise {
                        model_sd_mps2: 0.002,
                        ..none
                    },
                    28.0,
                ),
                (
                    BlockNoise {
                        swing_model_sd: 0.01,
                        ..none
                    },
                    0.01 * 9_500.0 * (0.2 + by_load),
                ),
            ] {
                let found = sd_n(noise, &read, 0.2);
                assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
                let both = sd_n(noise, &means, 0.2);
                assert!((both / ahead_n.hypot(found) - 1.0).abs() < 1e-9);
            }
            // a random walk of the rate n √τ/L makes an angle of √(T³/20) of it in the mean, which pulls by g
            let noise = BlockNoise {
                part_noise_mps2: 3.0,
                ..none
            };
            let walk = 3.0 * (1e-3 as Real).sqrt() / 0.6;
            let shaken =
                9_500.0 * GRAVITY * walk * (5e-3 as Real).powi(3).sqrt() / (20.0 as Real).sqrt();
            let expected = if swings { shaken } else { 0.0 };
            assert!((sd_n(noise, &read, 0.2) - expected).abs() <= 1e-6 * expected);
        }
    }
}
