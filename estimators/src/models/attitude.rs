//! Motion of a body with an IMU, by its gyro and accelerometer.
//!
//! x = [v, θ, φ, b_x, b_y, b_z, g_x, g_y, e_w, κ, g_z]: speed along the body, m/s; pitch (nose up) and roll (left side
//! up), rad; biases of the accelerometer, m/s²; biases of the gyro about x, y and z, rad/s; scale error of the wheels;
//! vertical curvature of the way, 1/m.
//!
//! v̇ = f_x − b_x − g sin θ + l_x (q² + r²),  θ̇ = −(q cos φ − r sin φ),  φ̇ = p − tan θ (q sin φ + r cos φ)
//!
//! with the body rates p, q, r about x forward, y left, z up (Titterton & Weston 2004, 3.6, with pitch nose up), of
//! which the biases are taken off, and l_x how far the IMU is ahead of the unit's middle: its centripetal share is
//! 0.08° of slope in a bend of 6 m. Without a gyro θ̇ = κ v, κ a first-order process in way. e_w is a first-order
//! process in time: as a constant it would take noise for information in a day at one speed, and the speed with it. All
//! other states are random walks or constants.

#![allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::{GRAVITY, exp, sin_cos};
use crate::filters::gaussian::Gaussian;
use crate::filters::model::Process;

/// Index of the speed.
pub const V: usize = 0;
/// Index of the pitch.
pub const THETA: usize = 1;
/// Index of the roll.
pub const PHI: usize = 2;
/// Index of the accelerometer's bias along x.
pub const BIAS_X: usize = 3;
/// Index of the accelerometer's bias along y.
pub const BIAS_Y: usize = 4;
/// Index of the accelerometer's bias along z.
pub const BIAS_Z: usize = 5;
/// Index of the gyro's bias about x.
pub const GYRO_X: usize = 6;
/// Index of the gyro's bias about y.
pub const GYRO_Y: usize = 7;
/// Index of the scale error of the wheels.
pub const SCALE: usize = 8;
/// Index of the vertical curvature, in use without a gyro.
pub const KAPPA: usize = 9;
/// Index of the gyro's bias about z.
pub const GYRO_Z: usize = 10;
/// Number of states.
pub const N: usize = 11;

/// Place of the IMU relative to the middle of its unit, on the rail's line (on a road: the axle whose wheels are
/// measured).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lever {
    /// Distance ahead of it, m.
    pub ahead_m: Real,
    /// Distance below it, m.
    pub below_m: Real,
}

/// Process noise of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeNoise {
    /// Random walk of the speed's integral by the accelerometer, m/s/√s.
    pub velocity_walk: Real,
    /// Random walk of the speed that the accelerometer does not measure, m/s/√s.
    pub speed_walk: Real,
    /// Random walk of pitch and roll by the gyro, rad/√s.
    pub angle_walk: Real,
    /// Random walk of the roll that the gyro does not measure, rad/√s.
    pub roll_walk: Real,
    /// Random walk of the accelerometer's biases, m/s²/√s.
    pub accel_bias_walk: Real,
    /// Random walk of the gyro's biases, rad/s/√s.
    pub gyro_bias_walk: Real,
    /// Standard deviation of the curvature without a gyro, 1/m.
    pub curvature_sd_per_m: Real,
    /// Correlation distance of the curvature, m.
    pub curvature_length_m: Real,
    /// Standard deviation of the scale of the wheels.
    pub scale_sd: Real,
}

/// The model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeModel {
    /// Place of the IMU.
    pub lever: Lever,
    /// Process noise.
    pub noise: AttitudeNoise,
}

/// Input of a step; an instrument that is `None` is out of use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AttitudeInput {
    /// Specific force in IMU axes, m/s².
    pub force_mps2: Option<[Real; 3]>,
    /// Angular rate p, q, r as the gyro reads it, rad/s.
    pub rate_radps: Option<[Real; 3]>,
    /// Velocity and angle random walks seen, m/s/√s and rad/√s: those of the model are not below them.
    pub seen_walk: [Real; 2],
    /// Speed for the distance in the curvature's process, m/s.
    pub speed_mps: Real,
}

/// Rates of the state, with the sines and cosines that their derivatives need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeRates {
    /// Acceleration along the body, m/s²; 0 without an accelerometer.
    pub v_dot: Real,
    /// Rate of the pitch, rad/s.
    pub theta_dot: Real,
    /// Rate of the roll, rad/s; 0 without a gyro.
    pub phi_dot: Real,
    /// Body rates without the gyro's biases, rad/s; `None` without a gyro.
    pub body_radps: Option<[Real; 3]>,
    x: SVector<Real, N>,
    sin_cos: [[Real; 2]; 2],
}

/// Sines and cosines of pitch and roll, computed again only if an angle has changed.
///
/// It holds nothing that does not follow from the angles: any two are equal, and no snapshot needs it.
#[derive(Clone, Copy, Debug)]
pub struct Angles {
    angles: [Real; 2],
    sin_cos: [[Real; 2]; 2],
}

impl Default for Angles {
    fn default() -> Self {
        Self {
            angles: [0.0; 2],
            sin_cos: [[0.0, 1.0]; 2],
        }
    }
}

impl Angles {
    /// Sine and cosine of the pitch and of the roll of a state.
    #[inline]
    pub fn of(&mut self, x: &SVector<Real, N>) -> [[Real; 2]; 2] {
        let angles = [x[THETA], x[PHI]];
        if angles.map(Real::to_bits) != self.angles.map(Real::to_bits) {
            (self.angles, self.sin_cos) = (angles, angles.map(sin_cos));
        }
        self.sin_cos
    }

    /// Sine and cosine of the last pitch and roll.
    pub fn last(&self) -> [[Real; 2]; 2] {
        self.sin_cos
    }
}

impl PartialEq for Angles {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// A row of F − 1: places and what stands there. The places are always the same, so that the compiler knows them; what
/// an instrument out of use would give is 0.
type Row = [(usize, Real); 5];
/// Places of the rows of v, θ and φ.
const V_BY: [usize; 5] = [THETA, BIAS_X, GYRO_Y, GYRO_Z, KAPPA];
const THETA_BY: [usize; 5] = [V, PHI, GYRO_Y, GYRO_Z, KAPPA];
const PHI_BY: [usize; 5] = [THETA, PHI, GYRO_X, GYRO_Y, GYRO_Z];

/// Makes a row from its places and values.
#[inline]
fn row(places: [usize; 5], values: [Real; 5]) -> Row {
    let ([a, b, c, d, e], [u, v, w, x, y]) = (places, values);
    [(a, u), (b, v), (c, w), (d, x), (e, y)]
}

/// Rate of the pitch as a linear function of the state about that of a step's start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearPitchRate {
    /// Rate there, rad/s.
    pub theta_dot: Real,
    /// Derivatives by the states [`THETA_BY`], and the states there.
    by: [Real; 5],
    from: [Real; 5],
}

impl LinearPitchRate {
    /// The rate at `x`, rad/s.
    pub fn at(&self, x: &SVector<Real, N>) -> Real {
        let terms = THETA_BY.iter().zip(&self.by).zip(&self.from);
        let change = terms.map(|((place, by), from)| by * (x[*place] - from));
        self.theta_dot + change.sum::<Real>()
    }

    /// Its derivatives: index of a state and derivative by it.
    #[inline]
    pub fn by_state(&self) -> [(usize, Real); 5] {
        row(THETA_BY, self.by)
    }
}

/// Process noise of the speed without an accelerometer, m²/s³.
const BLIND_SPEED_WALK: Real = 0.25;
/// Random walk of the roll without a gyro, rad²/s, and of the pitch beyond the curvature's.
const BLIND_ROLL_WALK: Real = 1e-3;
const BLIND_PITCH_WALK: Real = 1e-8;
/// Rate of distance in the curvature's process while the vehicle stands, m per s.
const BLIND_CREEP_MPS: Real = 0.02;
/// Correlation time of the scale error of the wheels (creep, temperature, load), s.
const SCALE_MEMORY_S: Real = 300.0;

impl AttitudeModel {
    /// Rates of the state `x` under an input.
    pub fn rates(&self, x: &SVector<Real, N>, u: &AttitudeInput) -> AttitudeRates {
        self.rates_at(x, Angles::default().of(x), u)
    }

    /// [`AttitudeModel::rates`] with the sines and cosines of pitch and roll known.
    fn rates_at(
        &self,
        x: &SVector<Real, N>,
        sin_cos: [[Real; 2]; 2],
        u: &AttitudeInput,
    ) -> AttitudeRates {
        let [[st, ct], [sp, cp]] = sin_cos;
        let body_radps = u
            .rate_radps
            .map(|[p, q, r]| [p - x[GYRO_X], q - x[GYRO_Y], r - x[GYRO_Z]]);
        let [p, q, r] = body_radps.unwrap_or_default();
        AttitudeRates {
            v_dot: u.force_mps2.map_or(0.0, |[fx, _, _]| {
                fx - x[BIAS_X] - GRAVITY * st + self.lever.ahead_m * (q * q + r * r)
            }),
            theta_dot: match body_radps {
                Some(_) => r * sp - q * cp,
                None => x[KAPPA] * x[V],
            },
            phi_dot: p - st / ct * (q * sp + r * cp),
            body_radps,
            x: *x,
            sin_cos,
        }
    }

    /// The first three rows of F − 1, those of v, θ and φ, over `dt`.
    fn rows(&self, rates: &AttitudeRates, u: &AttitudeInput, dt: Real) -> [Row; 3] {
        let [[st, ct], [sp, cp]] = rates.sin_cos;
        let tan = st / ct;
        let [_, q, r] = rates.body_radps.unwrap_or_default();
        let centripetal = -2.0 * self.lever.ahead_m;
        let v = match u.force_mps2 {
            Some(_) => [-GRAVITY * ct, -1.0, centripetal * q, centripetal * r, 0.0],
            None => [0.0; 5],
        };
        let (turn, nod) = (q * sp + r * cp, q * cp - r * sp);
        let phi = match rates.body_radps {
            Some(_) => [-turn / (ct * ct), -tan * nod, -1.0, tan * sp, tan * cp],
            None => [0.0; 5],
        };
        [
            row(V_BY, v.map(|a| a * dt)),
            row(THETA_BY, rates.pitch_rate().by.map(|a| a * dt)),
            row(PHI_BY, phi.map(|a| a * dt)),
        ]
    }

    /// Share of the curvature that remains after `dt`.
    fn curvature_left(&self, u: &AttitudeInput, dt: Real) -> Real {
        match u.rate_radps {
            Some(_) => 1.0,
            None => {
                let way_m = (BLIND_CREEP_MPS + u.speed_mps.abs()) * dt;
                exp(-way_m / self.noise.curvature_length_m)
            }
        }
    }

    fn next(&self, rates: &AttitudeRates, left: Real, dt: Real) -> SVector<Real, N> {
        let mut x = rates.x;
        x[V] += rates.v_dot * dt;
        x[THETA] += rates.theta_dot * dt;
        x[PHI] += rates.phi_dot * dt;
        x[KAPPA] *= left;
        x[SCALE] *= scale_left(dt);
        x
    }

    /// The diagonal of Q; its other elements are zero.
    fn variances(&self, u: &AttitudeInput, left: Real, dt: Real) -> SVector<Real, N> {
        let (n, [seen_velocity, seen_angle]) = (&self.noise, u.seen_walk);
        let walk = |sd: Real| sd * sd;
        let q_v = match u.force_mps2 {
            Some(_) => (walk(n.velocity_walk) + walk(n.speed_walk)).max(walk(seen_velocity)),
            None => BLIND_SPEED_WALK,
        };
        let [q_pitch, q_roll] = match u.rate_radps {
            Some(_) => [walk(n.angle_walk.max(seen_angle)); 2],
            None => [BLIND_PITCH_WALK, BLIND_ROLL_WALK],
        };
        let (bias, gyro) = (walk(n.accel_bias_walk), walk(n.gyro_bias_walk));
        let mut Q = SVector::<Real, N>::zeros();
        Q[V] = q_v * dt;
        Q[THETA] = q_pitch * dt;
        Q[PHI] = (q_roll + walk(n.roll_walk)) * dt;
        for place in [BIAS_X, BIAS_Y, BIAS_Z] {
            Q[place] = bias * dt;
        }
        for place in [GYRO_X, GYRO_Y, GYRO_Z] {
            Q[place] = gyro * dt;
        }
        Q[KAPPA] = walk(n.curvature_sd_per_m) * (1.0 - left * left);
        let scale = scale_left(dt);
        Q[SCALE] = walk(n.scale_sd) * (1.0 - scale * scale);
        Q
    }

    /// Time update over `dt`: that of an extended Kalman filter, with F P Fᵀ by the rows of F that are not those of 1.
    /// Takes the sines and cosines of pitch and roll, and returns the rates.
    pub fn predict(
        &self,
        belief: &mut Gaussian<N>,
        sin_cos: [[Real; 2]; 2],
        u: &AttitudeInput,
        dt: Real,
    ) -> AttitudeRates {
        let rates = self.rates_at(&belief.x, sin_cos, u);
        let left = self.curvature_left(u, dt);
        belief.carry_sparse(&self.rows(&rates, u, dt));
        if left < 1.0 {
            belief.scale_sd(KAPPA, left);
        }
        belief.scale_sd(SCALE, scale_left(dt));
        belief.x = self.next(&rates, left, dt);
        let Q = self.variances(u, left, dt);
        for (i, q) in Q.iter().enumerate() {
            belief.P[(i, i)] += q;
        }
        belief.symmetrise();
        rates
    }
}

/// Share of the scale error of the wheels that remains after `dt`.
fn scale_left(dt: Real) -> Real {
    1.0 / (1.0 + dt / SCALE_MEMORY_S)
}

impl AttitudeRates {
    /// The rate of the pitch as a linear function of the state about this one.
    pub fn pitch_rate(&self) -> LinearPitchRate {
        let (x, [_, [sp, cp]]) = (&self.x, self.sin_cos);
        LinearPitchRate {
            theta_dot: self.theta_dot,
            by: match self.body_radps {
                Some([_, q, r]) => [0.0, q * sp + r * cp, cp, -sp, 0.0],
                None => [x[KAPPA], 0.0, 0.0, 0.0, x[V]],
            },
            from: THETA_BY.map(|place| x[place]),
        }
    }
}

impl Process<N> for AttitudeModel {
    type Input = AttitudeInput;

    fn f(&self, x: &SVector<Real, N>, u: &AttitudeInput, dt: Real) -> SVector<Real, N> {
        self.next(&self.rates(x, u), self.curvature_left(u, dt), dt)
    }

    fn F(&self, x: &SVector<Real, N>, u: &AttitudeInput, dt: Real) -> SMatrix<Real, N, N> {
        let mut F = SMatrix::identity();
        for (i, row) in self.rows(&self.rates(x, u), u, dt).iter().enumerate() {
            for (place, a) in row {
                F[(i, *place)] += a;
            }
        }
        F[(KAPPA, KAPPA)] = self.curvature_left(u, dt);
        F[(SCALE, SCALE)] = scale_left(dt);
        F
    }

    fn Q(&self, u: &AttitudeInput, dt: Real) -> SMatrix<Real, N, N> {
        SMatrix::from_diagonal(&self.variances(u, self.curvature_left(u, dt), dt))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::{cos, sin};
    use crate::filters::ekf;
    use crate::testing::Random;
    use nalgebra::SMatrix;

    /// Whatever was asked before, sines and cosines are those of the angles, to the last bit.
    #[test]
    fn sines_and_cosines_are_those_of_the_angles() {
        let mut angles = Angles::default();
        let (mut random, mut x) = (Random::new(20), SVector::<Real, N>::zeros());
        for k in 0..1000 {
            match k % 4 {
                0 => x[THETA] = 0.3 * random.normal(),
                1 => x[PHI] = 1e-7 * random.normal(),
                2 => x[THETA] = -x[THETA] * 0.0,
                _ => {}
            }
            let expected = [x[THETA], x[PHI]].map(|angle| [sin(angle), cos(angle)]);
            let bits = |both: [[Real; 2]; 2]| both.map(|pair| pair.map(Real::to_bits));
            assert_eq!(bits(angles.of(&x)), bits(expected), "{x}");
        }
    }

    /// The sparse time update against F P Fᵀ + Q of full matrices.
    #[test]
    fn the_sparse_time_update_is_that_of_full_matrices() {
        let mut random = Random::new(19);
        let model = AttitudeModel {
            lever: Lever {
                ahead_m: 0.3,
                below_m: 0.5,
            },
            noise: AttitudeNoise {
                velocity_walk: 7e-4,
                speed_walk: 2e-3,
                angle_walk: 4e-5,
                roll_walk: 2e-4,
                accel_bias_walk: 1.5e-4,
                gyro_bias_walk: 1e-5,
                curvature_sd_per_m: 0.03,
                curvature_length_m: 5.0,
                scale_sd: 0.002,
            },
        };
        for k in 0..200 {
            let mut draw = |size: Real| [0; 3].map(|_| size * random.normal());
            let u = AttitudeInput {
                force_mps2: Some(draw(3.0)).filter(|_| k % 3 > 0),
                rate_radps: Some(draw(0.3)).filter(|_| k % 2 > 0),
                seen_walk: [1e-3, 1e-4],
                speed_mps: 1.0,
            };
            let x = SVector::<Real, N>::from_fn(|_, _| 0.2 * random.normal());
            let root = SMatrix::<Real, N, N>::from_fn(|_, _| random.normal());
            let mut full = Gaussian {
                x,
                P: root * root.transpose(),
            };
            full.symmetrise();
            let mut sparse = full;
            model.predict(&mut sparse, Angles::default().of(&x), &u, 0.1);
            let (F, Q) = (model.F(&x, &u, 0.1), model.Q(&u, 0.1));
            ekf::predict(&mut full, model.f(&x, &u, 0.1), &F, &Q);
            assert_eq!(sparse.x, full.x);
            assert!((sparse.P - full.P).amax() < 1e-12 * full.P.amax());
        }
    }
}
