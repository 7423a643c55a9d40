//! Kinematics of the attitude filter: f(x, u), its Jacobian and the process noise.
//!
//! v̇ = f_x − b_x − g sin θ + l_x (q² + r²),  θ̇ = −(q cos φ − r sin φ),  φ̇ = p − tan θ (q sin φ + r cos φ)
//!
//! with the body rates p, q, r about x forward, y left, z up (Titterton & Weston 2004, 3.6, with pitch nose up), their biases
//! taken off. Without a gyro θ̇ = κ v with a curvature κ that is a first-order process in way. l_x is how far the IMU is ahead of the unit's middle: its centripetal share is 0.08° of slope in a bend of 6 m.

use nalgebra::{SMatrix, SVector};

use super::params::AttitudeParams;
use super::{BIAS_X, GYRO_X, GYRO_Y, GYRO_Z, KAPPA, Lever, N, PHI, THETA, V};
use crate::Real;
use crate::api::real::{GRAVITY, cos, exp, sin};
use crate::filters::gaussian::Gaussian;

/// Inputs of a step: what is `None` is out of use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Specific force in IMU axes, m/s².
    pub force: Option<[Real; 3]>,
    /// Body rates p, q, r with the gyro's biases taken off, rad/s.
    pub rate: Option<[Real; 3]>,
    /// Whether something is out of use because it is stuck.
    pub stuck: bool,
    /// Whether the accelerometer jumps: an outlier, or a rail joint.
    pub shock: bool,
}

/// Derivatives of the state, with what the Jacobian needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Acceleration along the body, m/s²; 0 without an accelerometer.
    pub v_dot: Real,
    /// Rates of pitch and roll, rad/s; 0 without a gyro.
    pub theta_dot: Real,
    /// See above.
    pub phi_dot: Real,
    speed_mps: Real,
    curvature_per_m: Real,
    sin_cos: [[Real; 2]; 2],
}

/// Process noise of speed without an accelerometer, m²/s³.
const BLIND_SPEED_WALK: Real = 0.25;
/// Random walk of roll without a gyro, rad²/s, and of pitch beyond the curvature's.
const BLIND_ROLL_WALK: Real = 1e-3;
const BLIND_PITCH_WALK: Real = 1e-8;
/// Way that the curvature's process goes on with while the vehicle stands, m per s.
const BLIND_CREEP_MPS: Real = 0.02;

/// f(x, u).
pub fn motion(x: &SVector<Real, N>, u: &Inputs, lever: Lever) -> Motion {
    let angles = [x[THETA], x[PHI]];
    let [[st, ct], [sp, cp]] = angles.map(|angle| [sin(angle), cos(angle)]);
    let [p, q, r] = u.rate.unwrap_or_default();
    Motion {
        v_dot: u.force.map_or(0.0, |[fx, _, _]| {
            fx - x[BIAS_X] - GRAVITY * st + lever.ahead_m * (q * q + r * r)
        }),
        theta_dot: match u.rate {
            Some(_) => r * sp - q * cp,
            None => x[KAPPA] * x[V],
        },
        speed_mps: x[V],
        curvature_per_m: x[KAPPA],
        phi_dot: p - st / ct * (q * sp + r * cp),
        sin_cos: [[st, ct], [sp, cp]],
    }
}

/// A row of F − 1: places in growing order, and what stands there; zeros behind.
type Row = [(usize, Real); 5];

/// ∂θ̇/∂x: places and values, zeros behind.
pub fn pitch_rate_row(motion: &Motion, u: &Inputs) -> [(usize, Real); 3] {
    let [_, [sp, cp]] = motion.sin_cos;
    match u.rate {
        Some([_, q, r]) => [(PHI, q * sp + r * cp), (GYRO_Y, cp), (GYRO_Z, -sp)],
        None => [
            (V, motion.curvature_per_m),
            (KAPPA, motion.speed_mps),
            (0, 0.0),
        ],
    }
}

/// Rows of F − 1 of the states that change, over `dt`: of v, θ, φ.
fn jacobian(motion: &Motion, u: &Inputs, dt: Real) -> [Row; 3] {
    let [[st, ct], [sp, cp]] = motion.sin_cos;
    let tan = st / ct;
    let (none, zero) = ([(0, 0.0); 5], (0, 0.0));
    let v = match u.force {
        Some(_) => [(THETA, -GRAVITY * ct), (BIAS_X, -1.0), zero, zero, zero],
        None => none,
    };
    let [theta, phi] = match u.rate {
        Some([_, q, r]) => {
            let (turn, nod) = (q * sp + r * cp, q * cp - r * sp);
            [
                [(PHI, turn), (GYRO_Y, cp), (GYRO_Z, -sp), zero, zero],
                [
                    (THETA, -turn / (ct * ct)),
                    (PHI, -tan * nod),
                    (GYRO_X, -1.0),
                    (GYRO_Y, tan * sp),
                    (GYRO_Z, tan * cp),
                ],
            ]
        }
        None => {
            let (curvature, speed) = (motion.curvature_per_m, motion.speed_mps);
            [[(V, curvature), (KAPPA, speed), zero, zero, zero], none]
        }
    };
    [v, theta, phi].map(|row| row.map(|(place, a)| (place, a * dt)))
}

/// P ← F P Fᵀ of a symmetric P, of which only what is below the diagonal is then right; `A` are the rows of F − 1 that are not zero.
fn spread(P: &mut SMatrix<Real, N, N>, A: &[Row; 3]) {
    // Rows of (F − 1) P.
    let mut AP = [[0.0; N]; 3];
    for (row, a) in AP.iter_mut().zip(A) {
        for (k, a) in a.iter().filter(|(_, a)| *a != 0.0) {
            for (sum, p) in row.iter_mut().zip(&P.data.0[*k]) {
                *sum += p * a;
            }
        }
    }
    // (F − 1) P (F − 1)ᵀ
    let mut APA = [[0.0; 3]; 3];
    for (j, a) in A.iter().enumerate() {
        for (k, a) in a.iter().filter(|(_, a)| *a != 0.0) {
            for i in j..3 {
                APA[i][j] += AP[i][*k] * a;
            }
        }
    }
    for j in 0..3 {
        let column = &mut P.data.0[j];
        for i in j..3 {
            column[i] = column[i] + AP[i][j] + AP[j][i] + APA[i][j];
        }
        for i in 3..N {
            column[i] += AP[j][i];
        }
    }
}

/// Time update over `dt`: x ← x + ẋ dt, P ← F P Fᵀ + Q, where only three rows of F are not those of 1. `seen` are the velocity
/// and angle random walks seen (m/s/√s, rad/√s): those of the model are not below them.
pub fn predict(
    belief: &mut Gaussian<N>,
    motion: &Motion,
    u: &Inputs,
    params: &AttitudeParams,
    seen: [Real; 2],
    dt: Real,
) {
    let [seen_walk, seen_turn] = seen;
    spread(&mut belief.P, &jacobian(motion, u, dt));
    let x = &mut belief.x;
    x[V] += motion.v_dot * dt;
    x[THETA] += motion.theta_dot * dt;
    x[PHI] += motion.phi_dot * dt;
    let speed = x[V].abs();
    let walk = |sd: Real| sd * sd;
    let [q_pitch, q_roll] = match u.rate {
        Some(_) => [walk(params.angle_random_walk.max(seen_turn)); 2],
        None => {
            let way = (BLIND_CREEP_MPS + speed) * dt / params.curvature_length_m;
            let keep = exp(-way);
            x[KAPPA] *= keep;
            belief.P.column_mut(KAPPA).scale_mut(keep);
            belief.P.row_mut(KAPPA).scale_mut(keep);
            belief.P[(KAPPA, KAPPA)] += walk(params.curvature_sd_per_m) * (1.0 - keep * keep);
            [BLIND_PITCH_WALK, BLIND_ROLL_WALK]
        }
    };
    let q_v = match u.force {
        Some(_) => {
            let nominal = walk(params.velocity_random_walk) + walk(params.speed_walk);
            nominal.max(walk(seen_walk))
        }
        None => BLIND_SPEED_WALK,
    };
    let (bias, gyro) = (walk(params.accel_bias_walk), walk(params.gyro_bias_walk));
    let Q = [
        q_v,
        q_pitch,
        q_roll + walk(params.roll_walk),
        bias,
        bias,
        bias,
        gyro,
        gyro,
        0.0,
        0.0,
        gyro,
    ];
    for (i, q) in Q.iter().enumerate() {
        if let Some(p) = belief.P.get_mut((i, i)) {
            *p += q * dt;
        }
    }
    belief.symmetrise();
}
