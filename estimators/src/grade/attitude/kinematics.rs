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

/// Rows of F − 1 of the states that change, over `dt`: of v, θ, φ.
fn jacobian(motion: &Motion, u: &Inputs) -> SMatrix<Real, 3, N> {
    let [[st, ct], [sp, cp]] = motion.sin_cos;
    let tan = st / ct;
    let mut A = SMatrix::<Real, 3, N>::zeros();
    if u.force.is_some() {
        A[(V, THETA)] = -GRAVITY * ct;
        A[(V, BIAS_X)] = -1.0;
    }
    if let Some([_, q, r]) = u.rate {
        let (turn, nod) = (q * sp + r * cp, q * cp - r * sp);
        A[(THETA, PHI)] = turn;
        A[(THETA, GYRO_Y)] = cp;
        A[(THETA, GYRO_Z)] = -sp;
        A[(PHI, THETA)] = -turn / (ct * ct);
        A[(PHI, PHI)] = -tan * nod;
        A[(PHI, GYRO_X)] = -1.0;
        A[(PHI, GYRO_Y)] = tan * sp;
        A[(PHI, GYRO_Z)] = tan * cp;
    } else {
        A[(THETA, KAPPA)] = motion.speed_mps;
        A[(THETA, V)] = motion.curvature_per_m;
    }
    A
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
    let A = jacobian(motion, u) * dt;
    let AP = A * belief.P;
    let APA = AP * A.transpose();
    let x = &mut belief.x;
    x[V] += motion.v_dot * dt;
    x[THETA] += motion.theta_dot * dt;
    x[PHI] += motion.phi_dot * dt;
    let speed = x[V].abs();
    let mut top = belief.P.fixed_view_mut::<3, N>(0, 0);
    top += AP;
    let mut left = belief.P.fixed_view_mut::<N, 3>(0, 0);
    left += AP.transpose();
    let mut corner = belief.P.fixed_view_mut::<3, 3>(0, 0);
    corner += APA;
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
