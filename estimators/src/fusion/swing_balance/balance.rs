//! The force balance as a Kalman filter on the load's mass, with the swing of the load as a state.
//!
//! χ = [m_L, r, c_v, q_c, φ, φ̇, d, η, b, ln L/L₀]: mass of the load, resistance constant, by speed and in bends, swing and its rate, unmodelled
//! force (first-order, 2 s), grade of the rail behind the one read (rad at 9 m), bias of the accelerometer, length of the pendulum.
//!
//! y = F − J a − (m₀ − m_g) a − m_g a_L − g Σ m S* − m₀ μ' g c s
//! ŷ = m_L (a_L + g S*_L + μ' g c s) + s (r c' + c_v |v| + q_c κ) + d + η g Σ m x/9 m − M b,  a_L = −g φ̄ cos θ (1 + h κ_L)
//!
//! with the load's acceleration a_L by the mean swing φ̄ ([`SwingBlock`]), m_g the gear that swings with the load, s the sign of the speed, c the
//! cosine of the grade (c' of its share), μ' the part of the resistance that grows with the load. b stays a constant of its own: taking the bias of the attitude
//! filter, which improves, off the regressor scatters the end mass by 0.4 %.

use nalgebra::{SMatrix, SVector};

use super::block::Block;
use super::params::{SwingBalanceParams, SwingSupervision};
use crate::Real;
use crate::api::mass_layout::MassLayout;
use crate::api::real::{GRAVITY, exp, sqrt};
use crate::api::signals::Vehicle;
use crate::api::snapshot::{Archive, State};
use crate::filters::gaussian::Gaussian;
use crate::models::swing::SwingBlock;
use crate::rail::train_means::TrainMeans;

/// Indices of the state.
pub const MASS: usize = 0;
/// Constant resistance.
pub const R0: usize = 1;
/// Resistance by speed.
pub const CV: usize = 2;
/// Resistance in bends.
pub const QC: usize = 3;
/// Swing angle.
pub const ANGLE: usize = 4;
/// Swing rate.
pub const RATE: usize = 5;
/// Unmodelled force.
pub const D: usize = 6;
/// Grade behind.
pub const ETA: usize = 7;
/// Bias.
pub const B: usize = 8;
/// Logarithm of the length.
pub const LENGTH: usize = 9;
/// Number of states.
pub const N: usize = 10;

/// Distance at which η is the grade that the rail behind differs by, m.
const ETA_M: Real = 9.0;
/// Mean way behind the rail remembered over which η becomes another, m.
const ETA_MEMORY_M: Real = 2.0;
/// Memory of the unmodelled force, s.
const FORCE_MEMORY_S: Real = 2.0;
/// Change of the length for its derivative.
const LENGTH_STEP: Real = 0.02;
/// Largest |ln L/L₀|.
const MAX_LENGTH: Real = 0.5;
/// Free swing that is left after a block.
const FREE_SWING: Real = 0.99;
/// Part of the running resistance per weight from which it weighs the load, and not the swing: a load swings with accelerations of some 0.05 g.
const MAX_SWING_MU: Real = 0.05;
/// Standard deviations beyond which a block is deweighted.
const HUBER_SD: Real = 3.0;
/// Noise that follows the residuals: growth and decay of the factor, s; largest square taken; factor from which it acts.
const INFLATE_S: Real = 4.0;
const MAX_SQUARE: Real = 25.0;
const MIN_INFLATION: Real = 1.2;
/// Standard deviation of the grade ahead of what was read, rad per m.
const AHEAD_SD_PER_M: Real = 0.032;
/// Random walk of the constant resistance per mass, m/s²/√s.
const RESISTANCE_WALK: Real = 1e-4;
/// The swing may be as large after a load has been taken, rad and rad/s.
const NEW_SWING_SD: [Real; 2] = [0.06, 0.25];

/// What is told of the train.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal {
    /// Tare, all of it and what swings, kg.
    pub tare_kg: Real,
    /// See above.
    pub gear_kg: Real,
    /// Rotating mass, kg.
    pub rotating_kg: Real,
    /// Largest load, kg.
    pub max_load_kg: Real,
    /// Load to start from, kg.
    pub load0_kg: Real,
    /// Nominal running resistance, and the part of it that grows with the load.
    pub mu: Real,
    /// See above.
    pub mu_load: Real,
    /// Share of the latter.
    pub load_share: Real,
    /// Standard deviation of the accelerometer's bias, with that of its mounting times g, m/s².
    pub bias_sd_mps2: Real,
    /// Chains, m; depth of their upper ends, m; give of the couplings, m/N.
    pub chain_m: Real,
    /// See above.
    pub hook_depth_m: Real,
    /// See above.
    pub give_mpn: Real,
}

impl Nominal {
    /// From the vehicle's nominal values.
    pub fn new(
        vehicle: &Vehicle,
        layout: &MassLayout,
        mass0_kg: Option<Real>,
        bias_sd_mps2: Real,
    ) -> Self {
        let [_, high] = vehicle.mass_range_kg;
        let max_load_kg = (high - vehicle.tare_kg).max(0.05 * vehicle.tare_kg);
        let least = MIN_START * max_load_kg;
        let load0_kg = mass0_kg.map_or(max_load_kg / 3.0, |mass| {
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
            bias_sd_mps2,
            load_share: layout.load_share_of_resistance,
            chain_m: layout.load.chain_m,
            hook_depth_m: layout.load.hook_depth_m,
            give_mpn: layout
                .load
                .longitudinal_stiffness_npm
                .map_or(0.0, |k| 1.0 / k),
        }
    }
}

/// Share of the largest load that the filter starts from at least: the swing weighs nothing without a load to swing.
const MIN_START: Real = 1.0 / 6.0;

/// What a block did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Update {
    /// Measurement less prediction, N.
    pub innovation_n: Real,
    /// Its variance, N².
    pub variance: Real,
    /// Innovation over its nominal standard deviation.
    pub normalised: Real,
    /// Whether it was deweighted.
    pub deweighted: bool,
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingBalance {
    nominal: Nominal,
    params: SwingBalanceParams,
    supervision: SwingSupervision,
    belief: Gaussian<N>,
    inflation: Real,
    /// See [`SwingBalance::set_noise_mass`]; 0 for none.
    noise_kg: Real,
    last_grade: Real,
    last_behind_m: Real,
}

impl SwingBalance {
    /// At its prior.
    pub fn new(
        nominal: Nominal,
        params: &SwingBalanceParams,
        supervision: &SwingSupervision,
    ) -> Self {
        let mass = nominal.tare_kg + nominal.load0_kg;
        let weight = mass * GRAVITY;
        let (mu, p) = (nominal.mu, params);
        let typical_kg = nominal.tare_kg + nominal.max_load_kg / 3.0;
        let x = SVector::from([
            nominal.load0_kg,
            (mu - nominal.mu_load) * typical_kg * GRAVITY,
            p.speed_resistance * mu * weight,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        ]);
        let sd = SVector::from([
            0.25 * nominal.max_load_kg,
            p.resistance_sd * mu * weight,
            p.speed_resistance_sd * mu * weight,
            p.bend_resistance_sd,
            p.swing_sd,
            p.swing_rate_sd,
            p.force_sd_mps2 * mass,
            p.eta_sd_rad,
            nominal.bias_sd_mps2,
            p.length_sd,
        ]);
        Self {
            nominal,
            params: *params,
            supervision: *supervision,
            belief: Gaussian::independent(x, sd),
            inflation: 1.0,
            noise_kg: 0.0,
            last_grade: 0.0,
            last_behind_m: 0.0,
        }
    }

    /// State and covariance.
    pub fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    /// Total mass, kg.
    pub fn mass_kg(&self) -> Real {
        self.nominal.tare_kg + self.belief.x[MASS]
    }

    /// Mass that the noise of the model is proportional to, kg: that of the filter, or for comparing filters one for all.
    fn noise_mass_kg(&self) -> Real {
        if self.noise_kg > 0.0 {
            self.noise_kg
        } else {
            self.mass_kg()
        }
    }

    /// Whether the mass is weighed by the swing, and so not linear: a load that swings, and a running resistance that does not weigh it first.
    pub fn is_nonlinear(&self) -> bool {
        self.swings() && self.nominal.mu_load < MAX_SWING_MU
    }

    /// Sets that mass; `None` for the filter's own.
    pub fn set_noise_mass(&mut self, mass_kg: Option<Real>) {
        self.noise_kg = mass_kg.unwrap_or(0.0);
    }

    /// Factor by which the residuals have raised the noise.
    pub fn inflation(&self) -> Real {
        self.inflation
    }

    fn swings(&self) -> bool {
        self.supervision.swing && self.nominal.chain_m > 0.0
    }

    /// Length of the pendulum, m, with ln L/L₀ changed by `more`.
    fn length_m(&self, more: Real) -> Real {
        let n = &self.nominal;
        let hanging = self.belief.x[MASS] + n.gear_kg;
        (n.chain_m + GRAVITY * hanging * n.give_mpn) * exp(self.belief.x[LENGTH] + more)
    }

    /// The pendulum over a block, and again a little longer.
    fn swing(&self, block: &Block, means: &TrainMeans) -> [SwingBlock; 2] {
        let a = block.accelerations().map(|a| a * means.load_cos);
        let h = block.substep_s();
        [0.0, LENGTH_STEP].map(|more| SwingBlock::new(self.length_m(more), &a, h))
    }

    /// Takes a block whose rail has been read: measurement update if it is of `use`, and time update over its length.
    pub fn step(&mut self, block: &Block, means: &TrainMeans, used: bool) -> Option<Update> {
        let [swing, longer] = self.swing(block, means);
        let update = used
            .then(|| self.update(block, means, [&swing, &longer]))
            .flatten();
        self.predict(block, means, [&swing, &longer]);
        update
    }

    /// d ln L / d m_L.
    fn length_by_mass(&self) -> Real {
        self.nominal.give_mpn * GRAVITY
            / (self.nominal.chain_m
                + GRAVITY * (self.belief.x[MASS] + self.nominal.gear_kg) * self.nominal.give_mpn)
                .max(0.05)
    }

    fn update(
        &mut self,
        block: &Block,
        means: &TrainMeans,
        [swing, longer]: [&SwingBlock; 2],
    ) -> Option<Update> {
        let (n, p, x) = (&self.nominal, &self.params, self.belief.x);
        let (a, v) = (block.mean_acceleration(), Real::from(block.speed_mps));
        let s = if v < 0.0 { -1.0 } else { 1.0 };
        let mass = n.tare_kg + x[MASS];
        let hanging = x[MASS] + n.gear_kg;
        let friction = n.mu_load * GRAVITY * means.load_cos * s;
        let mut h = SVector::<Real, N>::zeros();
        let a_load = if self.swings() {
            let free = [x[ANGLE], x[RATE]];
            let depth = if self.supervision.depth {
                n.hook_depth_m
            } else {
                0.0
            };
            let by_angle = -GRAVITY * means.load_cos * (1.0 + depth * means.load_curvature_per_m);
            let mean = swing.mean_angle(free);
            let by_length = (longer.mean_angle(free) - mean) / LENGTH_STEP;
            let [by_start, by_rate] = swing.mean;
            h[ANGLE] = hanging * by_angle * by_start;
            h[RATE] = hanging * by_angle * by_rate;
            h[LENGTH] = hanging * by_angle * by_length;
            by_angle * mean
        } else {
            a
        };
        let regressor = a_load + GRAVITY * means.load_deep + friction;
        let behind = GRAVITY / ETA_M * (means.behind_tare_kgm + x[MASS] * means.behind_load_m);
        h[MASS] = regressor
            + GRAVITY / ETA_M * means.behind_load_m * x[ETA]
            + h[LENGTH] * self.length_by_mass()
            - x[B];
        let normal = 1.0 - n.load_share * (1.0 - means.load_cos);
        h[R0] = s * normal;
        h[CV] = v; // s |v|
        h[QC] = s * means.bend_per_m;
        h[D] = 1.0;
        h[ETA] = behind;
        h[B] = -mass;
        let measured = Real::from(block.traction_n)
            - (n.rotating_kg + n.tare_kg - n.gear_kg) * a
            - n.gear_kg * a_load
            - GRAVITY * means.tare_deep_kg
            - n.tare_kg * friction;
        let predicted = x[MASS] * regressor
            + s * (normal * x[R0] + x[CV] * v.abs() + x[QC] * means.bend_per_m)
            + x[D]
            + x[ETA] * behind
            - mass * x[B];
        let e = measured - predicted;
        let of = |sd: Real| sd * sd;
        let noisy = self.noise_mass_kg();
        let mut R = Real::from(block.variance)
            + of(p.model_sd_mps2 * noisy)
            + of(AHEAD_SD_PER_M * noisy * GRAVITY * means.ahead_kgm / n.tare_kg)
            + of(p.swing_model_sd * (noisy - n.tare_kg + n.gear_kg) * (a.abs() + a_load.abs()));
        let mut S = h.dot(&(self.belief.P * h)) + R;
        let square = e * e / S;
        if self.supervision.residual_noise {
            let square = square.min(MAX_SQUARE);
            let time = if square > self.inflation {
                INFLATE_S
            } else {
                2.0 * INFLATE_S
            };
            self.inflation += (block.length_s() / time) * (square - self.inflation);
            if self.inflation > MIN_INFLATION {
                S += R * (self.inflation - 1.0);
                R *= self.inflation;
            }
        }
        let ratio = e * e / (HUBER_SD * HUBER_SD * S);
        let S_nominal = S;
        R += (ratio - 1.0).max(0.0) * S;
        self.belief.update_scalar(e, &h, R)?;
        let x = &mut self.belief.x;
        x[MASS] = x[MASS].clamp(0.0, self.nominal.max_load_kg);
        x[LENGTH] = x[LENGTH].clamp(-MAX_LENGTH, MAX_LENGTH);
        Some(Update {
            innovation_n: e,
            variance: S_nominal,
            normalised: if e < 0.0 { -sqrt(square) } else { sqrt(square) },
            deweighted: ratio > 1.0,
        })
    }

    fn predict(&mut self, block: &Block, means: &TrainMeans, [swing, longer]: [&SwingBlock; 2]) {
        let T = block.length_s();
        let mut F = SMatrix::<Real, N, N>::identity();
        let keep = exp(-T / FORCE_MEMORY_S);
        F[(D, D)] = keep;
        let by_mass = self.length_by_mass();
        let free = [self.belief.x[ANGLE], self.belief.x[RATE]];
        if self.swings() {
            let [[a, b], [c, d]] = swing.A;
            let ([phi, rate], [phi2, rate2]) = (swing.end(free), longer.end(free));
            let (dphi, drate) = ((phi2 - phi) / LENGTH_STEP, (rate2 - rate) / LENGTH_STEP);
            F[(ANGLE, ANGLE)] = a;
            F[(ANGLE, RATE)] = b;
            F[(RATE, ANGLE)] = c;
            F[(RATE, RATE)] = d;
            F[(ANGLE, LENGTH)] = dphi;
            F[(RATE, LENGTH)] = drate;
            F[(ANGLE, MASS)] = dphi * by_mass;
            F[(RATE, MASS)] = drate * by_mass;
            let [forced, forced_rate] = swing.forced;
            let x = &mut self.belief.x;
            x[ANGLE] = forced + FREE_SWING * (phi - forced);
            x[RATE] = forced_rate + FREE_SWING * (rate - forced_rate);
        }
        self.belief.x[D] *= keep;
        self.belief.P = F * self.belief.P * F.transpose();
        self.add_noise(block, means, T, keep);
        self.belief.symmetrise();
    }

    fn add_noise(&mut self, block: &Block, means: &TrainMeans, T: Real, keep: Real) {
        let (p, mass) = (&self.params, self.mass_kg());
        let noisy = self.noise_mass_kg();
        let x = &self.belief.x;
        let of = |sd: Real| sd * sd;
        let length = self.length_m(0.0).max(0.05);
        let amplitude = of(x[ANGLE]) + of(x[RATE]) * length / GRAVITY;
        let grade = (means.tare_deep_kg + x[MASS] * means.load_deep) / mass;
        let v = Real::from(block.speed_mps).abs();
        let turn = if v > 0.05 {
            ((grade - self.last_grade).abs() / (v * T)).min(0.2)
        } else {
            0.0
        };
        self.last_grade = grade;
        let force = noisy
            * (p.force_sd_mps2
                + GRAVITY * turn * p.place_sd_m
                + p.bend_force_sd * means.bend_per_m);
        // Going back over rail that is no longer remembered: its grade is another.
        let behind_m = (means.behind_tare_kgm + x[MASS] * means.behind_load_m) / mass;
        let onto_m = (behind_m - self.last_behind_m).max(0.0);
        self.last_behind_m = behind_m;
        let same = exp(-onto_m / ETA_MEMORY_M);
        let new_grade = of(p.eta_sd_rad) * (1.0 - same * same);
        let P = &mut self.belief.P;
        P[(ETA, ETA)] += new_grade;
        P[(ANGLE, ANGLE)] += of(p.swing_damping) * amplitude * T + 0.1 * of(p.swing_walk) * T;
        P[(RATE, RATE)] +=
            of(p.swing_damping) * amplitude * T * GRAVITY / length + of(p.swing_walk) * T;
        P[(D, D)] += of(force) * (1.0 - keep * keep);
        P[(R0, R0)] += of(RESISTANCE_WALK * noisy) * T;
        P[(LENGTH, LENGTH)] += of(p.length_walk) * T;
    }

    /// Sets the load to start from and its standard deviation, as shares of the largest load.
    pub fn start_from(&mut self, [load, sd]: [Real; 2]) {
        let most = self.nominal.max_load_kg;
        self.belief.P.row_mut(MASS).fill(0.0);
        self.belief.P.column_mut(MASS).fill(0.0);
        self.belief.x[MASS] = load * most;
        self.belief.P[(MASS, MASS)] = sd * sd * most * most;
    }

    /// Load and its variance, as shares of the largest load and its square.
    pub fn load_share(&self) -> [Real; 2] {
        let most = self.nominal.max_load_kg;
        [
            self.belief.x[MASS] / most,
            self.belief.P[(MASS, MASS)] / (most * most),
        ]
    }

    /// Widens the variance of the load to this share of the square of the largest load; correlations stay.
    pub fn widen(&mut self, variance: Real) {
        let [_, found] = self.load_share();
        let factor = sqrt(variance / found.max(Real::MIN_POSITIVE));
        if factor > 1.0 {
            for i in 0..N {
                self.belief.P[(MASS, i)] *= factor;
                self.belief.P[(i, MASS)] *= factor;
            }
        }
    }

    /// Another load: the mass as at the start, the swing open, resistance and bias a little.
    pub fn reset_load(&mut self) {
        let fresh = Self::new(self.nominal, &self.params, &self.supervision);
        let opened = [MASS, ANGLE, RATE];
        for i in opened {
            self.belief.P.row_mut(i).fill(0.0);
            self.belief.P.column_mut(i).fill(0.0);
            self.belief.x[i] = fresh.belief.x[i];
        }
        let [angle, rate] = NEW_SWING_SD;
        let (P, P0) = (&mut self.belief.P, &fresh.belief.P);
        P[(MASS, MASS)] = P0[(MASS, MASS)];
        P[(ANGLE, ANGLE)] = angle * angle;
        P[(RATE, RATE)] = rate * rate;
        P[(R0, R0)] += 0.01 * P0[(R0, R0)];
        P[(B, B)] += 0.01 * P0[(B, B)];
        self.inflation = 1.0;
        self.belief.symmetrise();
    }
}

impl State for SwingBalance {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            belief,
            inflation,
            noise_kg,
            last_grade,
            last_behind_m,
            nominal: _,
            params: _,
            supervision: _,
        } = self;
        belief.visit_lower(archive);
        inflation.visit(archive);
        noise_kg.visit(archive);
        last_grade.visit(archive);
        last_behind_m.visit(archive);
    }
}
