//! Motion of the states of the force balance of a train with a swinging load, over blocks of half a second.
//!
//! χ = [m_L, r, c_v, q_c, φ, φ̇, d, η, b, ln L/L₀]: mass of the load, kg; constant part of the resistance, N; its part
//! by speed, N per m/s, and in bends, N·m; angle of the swing, rad, and its rate, rad/s; unmodelled force, N; grade of
//! the rail behind the one read, rad at 9 m; bias of the accelerometer, m/s²; logarithm of the pendulum's length over
//! that of the drawings.
//!
//! - (φ, φ̇) moves as a pendulum of the length L = (L₀ + g (m_L + m_g)/k) e^λ ([`SwingBlock`]); of its free part 1 % is
//!   lost in a block
//! - d is a first-order process with a memory of 2 s
//! - all else stays, or is a random walk
//!
//! b is a constant of its own: taking the bias of the attitude filter, which improves, off the regressor scatters the
//! end mass by 0.4 %.

#![allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::mass_layout::MassLayout;
use crate::api::real::{GRAVITY, exp};
use crate::api::signals::Vehicle;
use crate::filters::model::Process;
use crate::models::swing::{MIN_LENGTH_M, SUBSTEPS, SwingBlock};

/// Index of the load's mass.
pub const MASS: usize = 0;
/// Index of the constant resistance.
pub const R0: usize = 1;
/// Index of the resistance by speed.
pub const CV: usize = 2;
/// Index of the resistance in bends.
pub const QC: usize = 3;
/// Index of the swing angle.
pub const ANGLE: usize = 4;
/// Index of the swing rate.
pub const RATE: usize = 5;
/// Index of the unmodelled force.
pub const D: usize = 6;
/// Index of the grade behind.
pub const ETA: usize = 7;
/// Index of the bias.
pub const B: usize = 8;
/// Index of the logarithm of the length.
pub const LENGTH: usize = 9;
/// Number of states.
pub const N: usize = 10;

/// Memory of the unmodelled force, s.
const FORCE_MEMORY_S: Real = 2.0;
/// Share of a free swing that remains after a block.
const FREE_SWING: Real = 0.99;
/// Random walk of the constant resistance per mass, m/s²/√s.
const RESISTANCE_WALK: Real = 1e-4;
/// Least initial load, as a share of the largest load: the swing weighs nothing without a load to swing.
const MIN_START: Real = 1.0 / 6.0;

/// Nominal values of the train, from its drawings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal {
    /// Tare, kg.
    pub tare_kg: Real,
    /// Part of the tare that swings with the load, kg.
    pub gear_kg: Real,
    /// Rotating mass, kg.
    pub rotating_kg: Real,
    /// Largest load, kg.
    pub max_load_kg: Real,
    /// Load to start from, kg.
    pub load0_kg: Real,
    /// Running resistance per weight.
    pub mu: Real,
    /// Part of the running resistance that grows with the load.
    pub mu_load: Real,
    /// Share of the running resistance that grows with the load.
    pub load_share: Real,
    /// Standard deviation of the accelerometer's bias, including its mounting times g, m/s².
    pub bias_sd_mps2: Real,
    /// Length of the chains, m.
    pub chain_m: Real,
    /// Depth of their upper ends below the rail, m.
    pub hook_depth_m: Real,
    /// Compliance of the couplings along the train, m/N.
    pub give_mpn: Real,
}

impl Nominal {
    /// Takes the nominal values of the model from the vehicle's nominal values.
    pub fn new(
        vehicle: &Vehicle,
        layout: &MassLayout,
        mass0_kg: Option<Real>,
        bias_sd_mps2: Real,
    ) -> Self {
        let [_, high] = vehicle.mass_range_kg;
        let max_load_kg = (high - vehicle.tare_kg).max(0.05 * vehicle.tare_kg);
        let least = MIN_START * max_load_kg;
        let load0_kg = mass0_kg
            .or(vehicle.mass_guess_kg)
            .map_or(max_load_kg / 3.0, |mass| {
                (mass - vehicle.tare_kg).clamp(least, max_load_kg)
            });
        Self {
            tare_kg: vehicle.tare_kg,
            gear_kg: layout.load.swinging_tare_kg,
            rotating_kg: vehicle.rotating_mass_kg,
            max_load_kg,
            load0_kg,
            mu: vehicle.running_resistance,
            mu_load: vehicle.running_resistance * layout.load_share_of_resistance,
            load_share: layout.load_share_of_resistance,
            bias_sd_mps2,
            chain_m: layout.load.chain_m,
            hook_depth_m: layout.load.hook_depth_m,
            give_mpn: layout
                .load
                .longitudinal_stiffness_npm
                .map_or(0.0, |k| 1.0 / k),
        }
    }
}

/// The model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingModel {
    /// Nominal values of the train.
    pub nominal: Nominal,
    /// True if the load swings; else it is rigid.
    pub swings: bool,
    /// Effective depth of the upper ends of the chains, m.
    pub depth_m: Real,
    /// Uncertainty of the swing, as a share of its amplitude per √s.
    pub swing_damping: Real,
    /// Random walk of the swing rate, rad/s/√s.
    pub swing_walk: Real,
    /// Random walk of the logarithm of the length, 1/√s.
    pub length_walk: Real,
}

/// Input of a step of a block's length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SwingInput {
    /// Acceleration of the train times the cosine of the grade under the load, in parts of the block, m/s².
    pub accelerations_mps2: [Real; SUBSTEPS],
    /// Standard deviation of the unmodelled force, N.
    pub force_sd_n: Real,
    /// Mass to which the noise of the resistance is proportional, kg.
    pub noise_mass_kg: Real,
    /// Amplitude of the swing squared, φ² + φ̇² L/g, rad².
    pub amplitude_rad2: Real,
    /// Standard deviation of the noise of the acceleration of a part, m/s².
    pub part_noise_mps2: Real,
    /// Length of the pendulum, m.
    pub length_m: Real,
    /// Process noise of the grade behind, rad².
    pub new_grade_rad2: Real,
}

impl SwingModel {
    /// Length of the pendulum of a state, m.
    pub fn length_m(&self, x: &SVector<Real, N>) -> Real {
        self.stretched_m(x) * exp(x[LENGTH])
    }

    /// L₀ + g (m_L + m_g)/k, m.
    fn stretched_m(&self, x: &SVector<Real, N>) -> Real {
        let n = &self.nominal;
        n.chain_m + GRAVITY * (x[MASS] + n.gear_kg) * n.give_mpn
    }

    /// ∂ ln L/∂m_L, 1/kg.
    pub fn log_length_by_mass(&self, x: &SVector<Real, N>) -> Real {
        self.nominal.give_mpn * GRAVITY / self.stretched_m(x).max(MIN_LENGTH_M)
    }
}

impl Process<N> for SwingModel {
    type Input = SwingInput;

    fn f(&self, x: &SVector<Real, N>, u: &SwingInput, dt: Real) -> SVector<Real, N> {
        let mut next = *x;
        if self.swings {
            let a = &u.accelerations_mps2;
            let swing = SwingBlock::new(self.length_m(x), a, dt / SUBSTEPS as Real);
            let [phi, rate] = swing.end([x[ANGLE], x[RATE]]);
            let [forced, forced_rate] = swing.forced;
            next[ANGLE] = forced + FREE_SWING * (phi - forced);
            next[RATE] = forced_rate + FREE_SWING * (rate - forced_rate);
        }
        next[D] *= exp(-dt / FORCE_MEMORY_S);
        next
    }

    fn F(&self, x: &SVector<Real, N>, u: &SwingInput, dt: Real) -> SMatrix<Real, N, N> {
        let mut F = SMatrix::identity();
        F[(D, D)] = exp(-dt / FORCE_MEMORY_S);
        if self.swings {
            let (a, h) = (&u.accelerations_mps2, dt / SUBSTEPS as Real);
            let length = self.length_m(x);
            let swing = SwingBlock::new(length, a, h);
            let by_length = SwingBlock::by_log_length(length, a, h);
            let by_mass = self.log_length_by_mass(x);
            let rows = [ANGLE, RATE].into_iter().zip(swing.A);
            let ends = by_length.end([x[ANGLE], x[RATE]]);
            let ends = ends.into_iter().zip(by_length.forced);
            for ((i, [by_angle, by_rate]), (end, forced)) in rows.zip(ends) {
                F[(i, ANGLE)] = FREE_SWING * by_angle;
                F[(i, RATE)] = FREE_SWING * by_rate;
                F[(i, LENGTH)] = forced + FREE_SWING * (end - forced);
                F[(i, MASS)] = F[(i, LENGTH)] * by_mass;
            }
        }
        F
    }

    fn Q(&self, u: &SwingInput, dt: Real) -> SMatrix<Real, N, N> {
        let of = |sd: Real| sd * sd;
        let length = u.length_m.max(MIN_LENGTH_M);
        let damped = of(self.swing_damping) * u.amplitude_rad2 * dt;
        let keep = exp(-dt / FORCE_MEMORY_S);
        let part_s = dt / SUBSTEPS as Real;
        let walk = of(self.swing_walk) + of(u.part_noise_mps2 / length) * part_s;
        let mut Q = SMatrix::zeros();
        Q[(ANGLE, ANGLE)] = damped + 0.1 * walk * dt;
        Q[(RATE, RATE)] = damped * GRAVITY / length + walk * dt;
        Q[(D, D)] = of(u.force_sd_n) * (1.0 - keep * keep);
        Q[(R0, R0)] = of(RESISTANCE_WALK * u.noise_mass_kg) * dt;
        Q[(ETA, ETA)] = u.new_grade_rad2;
        Q[(LENGTH, LENGTH)] = of(self.length_walk) * dt;
        Q
    }
}
