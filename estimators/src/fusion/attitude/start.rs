//! First belief of the attitude filter: pitch and roll by the accelerometer, whose bias is then wholly correlated with
//! them.

use nalgebra::SVector;

use super::params::AttitudeParams;
use crate::Real;
use crate::api::real::{GRAVITY, asin, cos, sqrt};
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{BIAS_X, BIAS_Y, N, PHI, THETA};
use crate::preprocess::front_end::Channels;

/// Uncertainty of v̇ at the first sample, m/s²: of a vehicle that stands, of one that runs on a rail, and on a road.
const FIRST_ACCELERATION_SD_MPS2: [Real; 3] = [0.02, 1.0, 2.5];
/// Standard deviations by which the wheels may be apart by noise alone.
const WHEELS_APART_SD: Real = 7.0;
/// Largest sines of the pitch and the roll at the start.
const MAX_SINES: [Real; 2] = [0.6, 0.3];

/// The belief by the first samples, `dt` seconds long, of a vehicle (on a `road`) that stands below `standing_mps`
/// and whose biases of accelerometer and gyro have the standard deviations `bias_sd` (m/s², rad/s). `None` until
/// there has been an accelerometer and a wheel.
#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
pub fn first_belief(
    z: &Channels,
    dt: Real,
    params: &AttitudeParams,
    bias_sd: [Real; 2],
    (standing_mps, road): (Real, bool),
) -> Option<Gaussian<N>> {
    let [fx, fy, _] = z.specific_force_mps2?;
    let wheels = z.new_wheel_speed_mps.iter().flatten();
    let none = (0.0, 0.0, [Real::MAX, Real::MIN]);
    let (count, sum, [low, high]) = wheels.fold(none, |(n, sum, [low, high]), v| {
        (n + 1.0, sum + v, [v.min(low), v.max(high)])
    });
    if count == 0.0 {
        return None;
    }
    let v: Real = sum / count;
    let [steepest, leaning] = MAX_SINES;
    let theta = asin((fx / GRAVITY).clamp(-steepest, steepest));
    let g_theta = GRAVITY * cos(theta);
    let phi = asin((fy / g_theta).clamp(-leaning, leaning));
    let [standing, on_rail, on_road] = FIRST_ACCELERATION_SD_MPS2;
    let v_dot = match (v.abs() < standing_mps, road) {
        (true, _) => standing,
        (false, false) => on_rail,
        (false, true) => on_road,
    };
    let [bias, gyro] = bias_sd;
    let noise = params.velocity_random_walk / sqrt(dt);
    let angle = sqrt(bias * bias + v_dot * v_dot + noise * noise) / g_theta;
    let scale = params.wheel_scale_sd / sqrt(count);
    let slip = (high - low - WHEELS_APART_SD * params.wheel_speed_sd_mps).max(0.0);
    let speed = 2.0 * params.wheel_speed_sd_mps + scale * v.abs() + slip;
    let x = SVector::from([v, theta, phi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sd = SVector::from([
        speed, angle, angle, bias, bias, bias, gyro, gyro, scale, 0.0, gyro,
    ]);
    let mut belief = Gaussian::independent(x, sd);
    for (angle, bias_at) in [(THETA, BIAS_X), (PHI, BIAS_Y)] {
        belief.P[(angle, bias_at)] = -bias * bias / g_theta;
        belief.P[(bias_at, angle)] = -bias * bias / g_theta;
    }
    Some(belief)
}
