//! First belief of the attitude filter: pitch and roll by the accelerometer, whose bias is then wholly correlated with
//! them.
//!
//! A |f| of g + e that no acceleration explains is a bias: of e upwards, or of √(2 g e) along a level body. What
//! its sheet, its noise and the acceleration do not explain of e is in the standard deviations.

use nalgebra::SVector;

use super::params::AttitudeParams;
use crate::Real;
use crate::api::reading::Channels;
use crate::api::real::{GRAVITY, asin, cos, sqrt};
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{BIAS_X, BIAS_Y, N, PHI, THETA};
use crate::tuning::{ATTITUDE, STATISTICS};

/// The belief by the first samples, `dt` seconds long, of a vehicle (on a `road`) that stands below `standing_mps`
/// and whose biases of accelerometer and gyro have the standard deviations `bias_sd` (m/s², rad/s); the mean length of
/// the specific force is off by `norm_error_mps2`. `None` until there has been an accelerometer and a wheel.
#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
pub fn first_belief(
    z: &Channels,
    dt: Real,
    params: &AttitudeParams,
    bias_sd: [Real; 2],
    norm_error_mps2: Real,
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
    let [steepest, leaning] = ATTITUDE.max_sines;
    let theta = asin((fx / GRAVITY).clamp(-steepest, steepest));
    let g_theta = GRAVITY * cos(theta);
    let phi = asin((fy / g_theta).clamp(-leaning, leaning));
    let [standing, on_rail, on_road] = ATTITUDE.first_acceleration_sd_mps2;
    let v_dot = match (v.abs() < standing_mps, road) {
        (true, _) => standing,
        (false, false) => on_rail,
        (false, true) => on_road,
    };
    let [bias, gyro] = bias_sd;
    let noise = params.velocity_random_walk / sqrt(dt);
    // a car may start with all its acceleration while its wheels still read 0
    let most_v_dot = if road { on_road } else { v_dot };
    let by_sheet = STATISTICS.noise_sd * (bias + noise);
    let explained = by_sheet + most_v_dot * most_v_dot / (2.0 * GRAVITY);
    let unexplained = (norm_error_mps2.abs() - explained).max(0.0);
    let (bias, bias_z) = (
        sqrt(bias * bias + 2.0 * GRAVITY * unexplained),
        bias + unexplained,
    );
    let angle = sqrt(bias * bias + v_dot * v_dot + noise * noise) / g_theta;
    let scale = params.wheel_scale_sd / sqrt(count);
    let slip = (high - low - STATISTICS.fault_sd * params.wheel_speed_sd_mps).max(0.0);
    let speed = 2.0 * params.wheel_speed_sd_mps + scale * v.abs() + slip;
    let x = SVector::from([v, theta, phi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sd = SVector::from([
        speed, angle, angle, bias, bias, bias_z, gyro, gyro, scale, 0.0, gyro,
    ]);
    let mut belief = Gaussian::independent(x, sd);
    for (angle, bias_at) in [(THETA, BIAS_X), (PHI, BIAS_Y)] {
        belief.P[(angle, bias_at)] = -bias * bias / g_theta;
        belief.P[(bias_at, angle)] = -bias * bias / g_theta;
    }
    Some(belief)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::attitude::{BIAS_Z, GYRO_Y, SCALE, V};

    const BIAS_SD: [Real; 2] = [0.05, 0.002];
    const STANDING_MPS: Real = 0.02;

    /// The belief by a first step of 10 ms on this pitch and roll, rad, with these wheel speeds, m/s.
    fn belief([pitch, roll]: [Real; 2], wheels_mps: &[Real], road: bool) -> Gaussian<N> {
        let mut z = Channels {
            specific_force_mps2: Some([
                GRAVITY * pitch.sin(),
                GRAVITY * roll.sin() * pitch.cos(),
                GRAVITY * roll.cos() * pitch.cos(),
            ]),
            ..Channels::default()
        };
        for (place, v) in z.new_wheel_speed_mps.iter_mut().zip(wheels_mps) {
            *place = Some(*v);
        }
        let params = AttitudeParams::default();
        let size = z
            .specific_force_mps2
            .map(|f| sqrt(f.iter().map(|f| f * f).sum()));
        let off = size.unwrap() - GRAVITY;
        first_belief(&z, 0.01, &params, BIAS_SD, off, (STANDING_MPS, road)).unwrap()
    }

    /// A bias along the body that makes |f| longer than the sheet allows is within two standard deviations, and the
    /// pitch with it. What the sheet, or an acceleration, allows changes nothing.
    #[test]
    fn a_bias_that_the_length_shows_is_in_the_standard_deviations() {
        let of = |bias: Real, speed: Real| {
            let params = AttitudeParams::default();
            let mut z = Channels {
                specific_force_mps2: Some([bias, 0.0, GRAVITY]),
                ..Channels::default()
            };
            z.new_wheel_speed_mps[0] = Some(speed);
            let off = sqrt(bias * bias + GRAVITY * GRAVITY) - GRAVITY;
            first_belief(&z, 0.01, &params, BIAS_SD, off, (STANDING_MPS, false)).unwrap()
        };
        let sd = |belief: &Gaussian<N>, place: usize| belief.P[(place, place)].sqrt();
        for (bias, speed) in [(2.3, 0.0), (2.7, 0.0), (-2.7, 0.5)] {
            let found = of(bias, speed);
            assert!(
                (0.5..1.0).contains(&(sd(&found, BIAS_X) / bias.abs())),
                "{bias}"
            );
            assert!(found.x[THETA].abs() < 2.0 * sd(&found, THETA));
        }
        let [sheet, _] = BIAS_SD;
        for (bias, speed) in [(0.0, 0.0), (0.3, 0.0), (1.0, 0.5)] {
            let found = of(bias, speed);
            for place in [BIAS_X, BIAS_Y, BIAS_Z] {
                assert!((sd(&found, place) - sheet).abs() < 1e-6, "{bias} {speed}");
            }
        }
    }

    #[test]
    fn pitch_and_roll_are_those_that_the_specific_force_shows() {
        for angles in [[0.0, 0.0], [0.3, -0.1], [-0.2, 0.2]] {
            let x = belief(angles, &[0.0], false).x;
            assert!((x[THETA] - angles[0]).abs() < 1e-9 && (x[PHI] - angles[1]).abs() < 1e-9);
        }
        // nothing is steeper than 0.6, nor leans by more than 0.3
        for sign in [1.0, -1.0] {
            let x = belief([sign * 1.2, 0.0], &[0.0], false).x;
            assert!((x[THETA].sin() - sign * 0.6).abs() < 1e-9);
            let x = belief([0.0, sign * 1.2], &[0.0], false).x;
            assert!((x[PHI].sin() - sign * 0.3).abs() < 1e-9);
        }
    }

    /// The reading v̇ + g sin θ + b is known but for its noise and v̇: pitch and bias are uncertain, and wholly
    /// correlated. A vehicle that stands has a v̇ of 0.02 m/s², one that runs of 1 m/s², on a road of 2.5 m/s².
    #[test]
    fn what_the_accelerometer_reads_is_known_to_its_noise_and_the_acceleration() {
        let params = AttitudeParams::default();
        let noise = params.velocity_random_walk * params.velocity_random_walk / 0.01;
        for (speed, road, v_dot) in [
            (0.0, false, 0.02),
            (0.019, true, 0.02),
            (-0.5, false, 1.0),
            (0.5, true, 2.5),
        ] {
            for pitch in [0.0, 0.4] {
                let Gaussian { P, .. } = belief([pitch, 0.1], &[speed], road);
                for (angle, bias) in [(THETA, BIAS_X), (PHI, BIAS_Y)] {
                    let by_angle = GRAVITY * pitch.cos();
                    let read = by_angle * by_angle * P[(angle, angle)]
                        + 2.0 * by_angle * P[(angle, bias)]
                        + P[(bias, bias)];
                    let expected = v_dot * v_dot + noise;
                    assert!((read / expected - 1.0).abs() < 1e-6, "{speed}: {read}");
                    assert_eq!(P[(angle, bias)], P[(bias, angle)]);
                }
                let [bias, gyro] = BIAS_SD;
                assert!((P[(BIAS_X, BIAS_X)] - bias * bias).abs() < 1e-12);
                assert!((P[(GYRO_Y, GYRO_Y)] - gyro * gyro).abs() < 1e-12);
            }
        }
    }

    /// The speed is the mean of the wheels. Its standard deviation is that of two samples and of the scale, which n
    /// wheels have 1/√n of; wheels further apart than six standard deviations slip by what is beyond.
    #[test]
    fn the_speed_is_as_uncertain_as_its_wheels() {
        let params = AttitudeParams::default();
        let (noise, scale) = (params.wheel_speed_sd_mps, params.wheel_scale_sd);
        for (wheels, expected) in [
            (&[2.0][..], 2.0 * noise + 2.0 * scale),
            (&[-2.0; 4], 2.0 * noise + 2.0 * scale / 2.0),
            (
                &[2.0, 2.0 + 5.9 * noise, 2.0, 2.0],
                2.0 * noise + 2.0 * scale / 2.0,
            ),
            (
                &[1.8, 2.2, 2.0, 2.0],
                2.0 * noise + scale + 0.4 - 6.0 * noise,
            ),
        ] {
            let Gaussian { x, P } = belief([0.0; 2], wheels, false);
            let mean = wheels.iter().sum::<Real>() / wheels.len() as Real;
            assert!((x[V] - mean).abs() < 1e-12);
            let sd = P[(V, V)].sqrt();
            assert!((sd / expected - 1.0).abs() < 0.01, "{wheels:?}: {sd}");
            let of_scale = P[(SCALE, SCALE)].sqrt();
            assert!((of_scale * (wheels.len() as Real).sqrt() / scale - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn without_a_wheel_or_an_accelerometer_there_is_none() {
        let params = AttitudeParams::default();
        let begin =
            |z: &Channels| first_belief(z, 0.01, &params, BIAS_SD, 0.0, (0.02, false)).is_some();
        let mut z = Channels::default();
        z.new_wheel_speed_mps[1] = Some(0.0);
        assert!(!begin(&z));
        z.specific_force_mps2 = Some([0.0, 0.0, GRAVITY]);
        assert!(begin(&z));
        z.new_wheel_speed_mps[1] = None;
        assert!(!begin(&z));
    }
}
