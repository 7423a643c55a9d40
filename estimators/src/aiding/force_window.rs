//! Means of the specific force across the body, and of its prediction by the state, over windows of 50 ms.
//!
//! The noise of a window is that of the sheet or that seen, whichever is larger: an accelerometer that is shaken reads
//! less than its sheet promises. It is learnt from the means of windows and not from samples, so that bounce, whose
//! mean is small, counts for little.

use nalgebra::{SVector, Vector3};

use crate::Real;
use crate::aiding::lateral::Lateral;
use crate::aiding::vertical::Vertical;
use crate::api::real::{GRAVITY, sqrt};
use crate::api::snapshot::state;
use crate::instruments::noise_learning::NoiseLearning;
use crate::models::attitude::{GYRO_X, GYRO_Y, GYRO_Z, Lever, N, V};
use crate::tuning::FORCE_WINDOW;

/// Noise of the specific force across the body, from the sensor sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceNoise {
    /// Velocity random walk, m/s/√s.
    pub random_walk: Real,
    /// Standard deviation of the model of f_y, m/s².
    pub lateral_sd_mps2: Real,
    /// Factor on the variance of f_z: bounce.
    pub vertical_factor: Real,
    /// True if the noise is at least the noise in the samples.
    pub learns: bool,
}

/// The window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceWindow {
    noise: ForceNoise,
    seen: [NoiseLearning; 4],
    sums: [Real; 4],
    length_s: Real,
    rates: Option<[Vector3<Real>; 2]>,
}

impl ForceWindow {
    /// Starts without samples.
    pub fn new(noise: ForceNoise) -> Self {
        Self {
            noise,
            seen: [NoiseLearning::of_acceleration(); 4],
            sums: [0.0; 4],
            length_s: 0.0,
            rates: None,
        }
    }

    /// Velocity random walk learnt along the body, m/s/√s; 0 if it is not learnt, or if the gyro is missing.
    pub fn seen_walk(&self) -> Real {
        let [forward, ..] = &self.seen;
        self.walk(forward)
    }

    /// Angle random walk learnt about y, rad/√s; 0 if it is not learnt.
    pub fn seen_turn_walk(&self) -> Real {
        let [.., turn] = &self.seen;
        if self.noise.learns {
            turn.sd().map_or(0.0, |sd| sd * sqrt(FORCE_WINDOW.window_s))
        } else {
            0.0
        }
    }

    fn walk(&self, seen: &NoiseLearning) -> Real {
        if !self.noise.learns || self.rates.is_none() {
            return 0.0;
        }
        seen.sd().map_or(FORCE_WINDOW.unseen_walk, |sd| {
            sd * sqrt(FORCE_WINDOW.window_s)
        })
    }

    /// Variance of the mean of a window of `T` seconds: `factor` times that of the sheet, or that `seen`.
    fn variance(&self, seen: &NoiseLearning, factor: Real, T: Real) -> Real {
        let (sheet, seen) = (self.noise.random_walk, self.walk(seen));
        (factor * sheet * sheet).max(seen * seen) / T
    }

    /// Takes one sample and the state with the sines and cosines of its pitch and roll; returns the measurements across
    /// and up at the end of a window.
    pub fn step(
        &mut self,
        (x, sin_cos): (&SVector<Real, N>, [[Real; 2]; 2]),
        force: [Real; 3],
        rate: [Real; 3],
        lever: Lever,
        dt: Real,
    ) -> Option<(Lateral, Vertical)> {
        let [[_, cos_theta], [sin_phi, cos_phi]] = sin_cos;
        let raw = Vector3::from(rate);
        let rate = raw - Vector3::new(x[GYRO_X], x[GYRO_Y], x[GYRO_Z]);
        let [mut now, first] = self.rates.unwrap_or([rate; 2]);
        now += (rate - now) * (dt / (FORCE_WINDOW.window_s + dt));
        self.rates = Some([now, first]);
        let [fx, fy, fz] = force;
        let g_phi = GRAVITY * cos_theta;
        let [x_sum, y, z, turn_sum] = &mut self.sums;
        let q = rate.y;
        *x_sum += fx * dt;
        *turn_sum += q * dt;
        *y += (fy - x[V] * rate.z - g_phi * sin_phi) * dt;
        *z += (fz + x[V] * q - g_phi * cos_phi - lever.below_m * q * q) * dt;
        self.length_s += dt;
        if self.length_s < FORCE_WINDOW.window_s - 1e-6 {
            return None;
        }
        let (T, turn) = (self.length_s, now - first);
        let [forward, y, z, nod] = self.sums.map(|sum| sum / T);
        (self.sums, self.length_s, self.rates) = ([0.0; 4], 0.0, Some([now, now]));
        let turned = (lever.ahead_m * turn.z + lever.below_m * turn.x) / T;
        let nodded = -lever.ahead_m * turn.y / T;
        let (across, up) = (y - turned, z - nodded);
        for (seen, mean) in self.seen.iter_mut().zip([forward, across, up, nod]) {
            seen.observe(mean, T);
        }
        let [_, seen_across, seen_up, _] = &self.seen;
        let side = self.noise.lateral_sd_mps2;
        Some((
            Lateral {
                residual_mps2: across,
                yaw_rate_radps: raw.z,
                turned_mps2: turned,
                variance: self.variance(seen_across, 1.0, T) + side * side,
            },
            Vertical {
                residual_mps2: up,
                pitch_rate_radps: raw.y,
                nodded_mps2: nodded,
                below_m: lever.below_m,
                variance: self.variance(seen_up, self.noise.vertical_factor, T),
            },
        ))
    }
}

state!(ForceWindow { seen, sums, length_s, rates; noise });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aiding::Aid;
    use crate::models::attitude::{PHI, THETA};
    use crate::testing::Random;

    const DT: Real = 0.01;
    const LEVER: Lever = Lever {
        ahead_m: 0.4,
        below_m: 0.6,
    };

    fn window(learns: bool) -> ForceWindow {
        ForceWindow::new(ForceNoise {
            random_walk: 0.02,
            lateral_sd_mps2: 0.05,
            vertical_factor: 5.0,
            learns,
        })
    }

    /// A state of 2 m/s, of a pitch and a roll, with biases of the gyro.
    fn state() -> (SVector<Real, N>, [[Real; 2]; 2]) {
        let mut x = SVector::<Real, N>::zeros();
        (x[V], x[THETA], x[PHI]) = (2.0, 0.3, -0.2);
        (x[GYRO_X], x[GYRO_Y], x[GYRO_Z]) = (0.01, -0.02, 0.03);
        (x, [0.3, -0.2].map(|angle: Real| [angle.sin(), angle.cos()]))
    }

    /// The measurements by five samples, read by an IMU that turns at these rates beside its biases; `off` is what f_y
    /// and f_z read beyond mechanics.
    fn of_samples(
        window: &mut ForceWindow,
        rates: impl Fn(usize) -> [Real; 3],
        off: impl Fn(usize) -> [Real; 2],
    ) -> (Lateral, Vertical) {
        let (x, sin_cos) = state();
        let [[_, cos_theta], [sin_phi, cos_phi]] = sin_cos;
        for k in 0..5 {
            let ([p, q, r], [across, up]) = (rates(k), off(k));
            let force = [
                0.0,
                2.0 * r + 9.81 * sin_phi * cos_theta + across,
                -2.0 * q + 9.81 * cos_phi * cos_theta + 0.6 * q * q + up,
            ];
            let raw = [p + 0.01, q - 0.02, r + 0.03];
            let found = window.step((&x, sin_cos), force, raw, LEVER, DT);
            assert_eq!(found.is_some(), k == 4);
            if let Some(found) = found {
                return found;
            }
        }
        panic!("no window");
    }

    /// The mean over the window is of all that mechanics do not explain: centripetal force of the speed, gravity on the
    /// pitch and the roll, and force on the IMU below the middle that nods. The rates are those that the gyro reads.
    /// The innovation is then the mean less the measurement that the state predicts.
    #[test]
    fn the_mean_over_a_window_is_what_mechanics_do_not_explain() {
        let mut window = window(false);
        for rate in [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.2, 0.3, -0.4]] {
            let off = |k: usize| [0.1 * k as Real, -0.3 * k as Real];
            // a window in which the rates come up, and one in which they stay
            let mut last = None;
            for _ in 0..40 {
                last = Some(of_samples(&mut window, |_| rate, off));
            }
            let (across, up) = last.unwrap();
            // the predictions take g = 9.81 as the estimators do
            assert!((across.residual_mps2 - 0.2).abs() < 1e-3, "{across:?}");
            assert!((up.residual_mps2 + 0.6).abs() < 1e-3, "{up:?}");
            assert!((across.yaw_rate_radps - rate[2] - 0.03).abs() < 1e-12);
            assert!((up.pitch_rate_radps - rate[1] + 0.02).abs() < 1e-12);
            assert!(across.turned_mps2.abs() < 1e-9 && up.nodded_mps2.abs() < 1e-9);
            assert_eq!(up.below_m, 0.6);
            let (x, [[_, cos_theta], [sin_phi, cos_phi]]) = state();
            let [_, q, r] = rate;
            let lateral = 2.0 * r + 9.81 * sin_phi * cos_theta + 0.2;
            let vertical = -2.0 * q + 9.81 * cos_phi * cos_theta + 0.6 * q * q - 0.6;
            for (innovation, expected) in [
                (across.innovation(&x), lateral - across.h(&x)),
                (up.innovation(&x), vertical - up.h(&x)),
            ] {
                assert!(
                    (innovation - expected).abs() < 1e-6,
                    "{innovation} {expected}"
                );
            }
        }
    }

    /// A body that turns faster and faster is accelerated at its lever: l_x ṙ + l_z ṗ across, −l_x q̇ upwards.
    #[test]
    fn a_turn_that_grows_is_a_force_at_the_lever() {
        for (axis, across, up) in [(0, 0.6, 0.0), (1, 0.0, -0.4), (2, 0.4, 0.0)] {
            let mut window = window(false);
            let growth = 0.5;
            let mut last = None;
            for n in 0..40 {
                let rates = |k: usize| {
                    let mut rates = [0.0; 3];
                    rates[axis] = growth * DT * (5 * n + k) as Real;
                    rates
                };
                last = Some(of_samples(&mut window, rates, |_| {
                    [growth * across, growth * up]
                }));
            }
            let (lateral, vertical) = last.unwrap();
            assert!(
                (lateral.turned_mps2 - growth * across).abs() < 1e-6,
                "{axis}"
            );
            assert!((vertical.nodded_mps2 - growth * up).abs() < 1e-6, "{axis}");
            assert!(lateral.residual_mps2.abs() < 1e-3 && vertical.residual_mps2.abs() < 1e-3);
        }
    }

    /// Of the sheet a window of 0.05 s has the variance w²/0.05, across with the model's, and five times it
    /// upwards. Where the noise is learnt, one of a shaken robot is assumed until it has been seen.
    #[test]
    fn the_variance_is_that_of_the_sheet_or_that_of_a_shaken_robot() {
        let variances = |learns| {
            let mut window = window(learns);
            assert_eq!((window.seen_walk(), window.seen_turn_walk()), (0.0, 0.0));
            let (across, up) = of_samples(&mut window, |_| [0.0; 3], |_| [0.0; 2]);
            assert_eq!(window.seen_walk(), if learns { 0.1 } else { 0.0 });
            assert_eq!(window.seen_turn_walk(), 0.0);
            [across.variance, up.variance]
        };
        let side = 0.05 * 0.05;
        let sheet = [4e-4 / 0.05 + side, 5.0 * 4e-4 / 0.05];
        let shaken = [0.01 / 0.05 + side, 0.01 / 0.05];
        for (found, expected) in [(variances(false), sheet), (variances(true), shaken)] {
            for (found, expected) in found.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
            }
        }
    }

    /// White noise of the samples is learnt as a random walk of its integral, σ √dt, along the body, across, upwards
    /// and about y, each its own, and goes into the variances of the means.
    #[test]
    fn noise_that_is_seen_is_learnt_axis_by_axis() {
        let mut random = Random::new(7);
        let mut window = window(true);
        let (x, sin_cos) = (SVector::<Real, N>::zeros(), [[0.0, 1.0]; 2]);
        let mut last = None;
        for _ in 0..20_000 {
            let mut noisy = |sd: Real| sd * random.normal();
            let force = [noisy(2.0), noisy(3.0), 9.81 + noisy(4.0)];
            let rate = [0.0, noisy(0.5), 0.0];
            let lever = Lever {
                ahead_m: 0.0,
                below_m: 0.0,
            };
            last = window.step((&x, sin_cos), force, rate, lever, DT).or(last);
        }
        let (across, up) = last.unwrap();
        let side = 0.05 * 0.05;
        for (found, expected) in [
            (window.seen_walk(), 0.2),
            (window.seen_turn_walk(), 0.05),
            (((across.variance - side) * 0.05).sqrt(), 0.3),
            ((up.variance * 0.05).sqrt(), 0.4),
        ] {
            assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
        }
    }
}
