//! Kinematic consistency of accelerometer, wheel speed and pitch gyro.
//!
//! An accelerometer reads f = v̇ + g sin θ + bias. Behind one band-pass (low-pass of 0.3 s, high-pass of 4 s, which takes the bias out) that is
//!
//! f = a v̇ + b g Θ,  v̇ by the wheels, Θ the integral of the pitch rate
//!
//! with gains a = b = 1 where units, signs and axes are right. Recursive least squares for the two gains, with samples that count only
//! while one of the regressors moves. What a fault makes of them:
//!
//! | fault | a | b |
//! |---|---|---|
//! | wheel speed in km/h | 0.28 | 1 |
//! | wheel speed of the wrong sign | −1 | 1 |
//! | accelerometer in g | 0.10 | 0.10 |
//! | accelerometer of the wrong sign | −1 | −1 |
//! | forward axis swapped with the left one | 0 | 0 |
//! | gyro in °/s | 1 | 0.017 |
//! | gyro of the wrong sign, or pitch taken from another axis | 1 | −1, undefined |
//!
//! At steady speed on an even grade there is nothing to see, and nothing that a wrong unit would do to slope or mass either; the gains
//! found last stand until there is.

use nalgebra::{Matrix2, Vector2, vector};

use crate::Real;
use crate::api::real::{GRAVITY, lag, sqrt};
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;

/// Time constants of the band-pass, s.
const LOW_PASS_S: Real = 0.3;
const HIGH_PASS_S: Real = 4.0;
/// After a gap in its signals the low-pass settles first, s; the high-pass begins where it has come to.
const SETTLE_S: Real = 1.0;

/// Rate of the regression, 1/s.
const RATE_HZ: Real = 5.0;

/// Noise of a sample, m/s²: vibration behind the low-pass, the road under the wheels, a nod of the body by one degree.
const NOISE_MPS2: Real = 0.1;
/// Share of the regressors that is noise of them: a large start or a slip counts for no more than several small ones.
const RELATIVE_NOISE: Real = 0.3;
/// Without a gyro: what slopes may do at a speed, m/s² for each m/s.
const SLOPE_NOISE_PER_S: Real = 1.0;

/// Standard deviation of a gain before any sample, and the largest error of a gain that is right.
const GAIN_SD: Real = 0.5;
const TOLERANCE: Real = 0.4;
/// Standard deviations of a gain that an error must exceed beyond that.
const SIGNIFICANT: Real = 3.0;
/// Forgetting, per sample, of the gain that the sample tells about.
const FORGETTING: Real = 0.97;

/// Low-pass of one signal followed by a high-pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct BandPass {
    low: Option<Real>,
    slow: Real,
}

impl BandPass {
    fn step(&mut self, input: Real, [low, high]: [Real; 2], settled: bool) -> Real {
        let before = self.low.unwrap_or(input);
        let now = before + low * (input - before);
        self.low = Some(now);
        self.slow = if settled {
            self.slow + high * (now - self.slow)
        } else {
            now
        };
        now - self.slow
    }
}

state!(BandPass { low, slow; });

/// Regression of the specific force on the acceleration of the wheels and the integral of the pitch rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KinematicConsistency {
    force: BandPass,
    /// The speed itself goes through the low-pass; its rate is the acceleration behind the same.
    speed: Option<Real>,
    acceleration_slow: Real,
    pitch: Real,
    slope: BandPass,
    gains: Gaussian<2>,
    /// Whether each gain has been found wrong, and not right since.
    wrong: [bool; 2],
    since_s: Real,
    /// Time since the signals came or came back, s.
    heard_s: Real,
}

impl Default for KinematicConsistency {
    fn default() -> Self {
        Self {
            force: BandPass::default(),
            speed: None,
            acceleration_slow: 0.0,
            pitch: 0.0,
            slope: BandPass::default(),
            gains: Gaussian::independent(vector![1.0, 1.0], vector![GAIN_SD, GAIN_SD]),
            wrong: [false; 2],
            since_s: 0.0,
            heard_s: 0.0,
        }
    }
}

impl KinematicConsistency {
    /// One step of `dt` seconds: specific force forward, m/s², wheel speed, m/s, pitch rate, rad/s (`None` without a gyro).
    pub fn observe(
        &mut self,
        force_mps2: Real,
        speed_mps: Real,
        pitch_rate_radps: Option<Real>,
        dt: Real,
    ) {
        let shares = [lag(dt, LOW_PASS_S), lag(dt, HIGH_PASS_S)];
        let [low, high] = shares;
        let settled = self.heard_s >= SETTLE_S;
        self.heard_s = (self.heard_s + dt).min(SETTLE_S);
        let f = self.force.step(force_mps2, shares, settled);
        let before = self.speed.unwrap_or(speed_mps);
        let moved = low * (speed_mps - before);
        self.speed = Some(before + moved);
        let rate = moved / dt;
        self.acceleration_slow = if settled {
            self.acceleration_slow + high * (rate - self.acceleration_slow)
        } else {
            rate
        };
        let a = rate - self.acceleration_slow;
        // Leaking like the high-pass, or a bias would grow without end.
        self.pitch +=
            dt * pitch_rate_radps.unwrap_or(0.0) - lag(dt, 4.0 * HIGH_PASS_S) * self.pitch;
        let slope = GRAVITY * self.slope.step(self.pitch, shares, settled);
        self.since_s += dt;
        if !settled || self.since_s * RATE_HZ < 1.0 {
            return;
        }
        self.since_s = 0.0;
        let unseen = if pitch_rate_radps.is_some() {
            0.0
        } else {
            SLOPE_NOISE_PER_S * speed_mps
        };
        self.regress(f, vector![a, slope], unseen);
    }

    /// Wheel speed or accelerometer is missing: what the filters hold belongs to an earlier time, and a step across the gap is no acceleration.
    pub fn interrupt(&mut self) {
        (self.force, self.slope) = (BandPass::default(), BandPass::default());
        (self.speed, self.acceleration_slow, self.heard_s) = (None, 0.0, 0.0);
    }

    fn regress(&mut self, f: Real, h: Vector2<Real>, unseen: Real) {
        let size = h.dot(&h);
        let r = NOISE_MPS2 * NOISE_MPS2 + RELATIVE_NOISE * RELATIVE_NOISE * size + unseen * unseen;
        if size < r {
            return;
        }
        // Forgets along the regressor alone (Kulhavý 1987 in its simplest form): what is not excited is kept.
        let along =
            Matrix2::identity() + (h * h.transpose() / size) * (1.0 / sqrt(FORGETTING) - 1.0);
        let mut gains = self.gains;
        gains.P = along * gains.P * along;
        gains.symmetrise();
        gains.limit_variance(&Vector2::repeat(GAIN_SD * GAIN_SD));
        if gains.correct_scalar(f - h.dot(&gains.x), &h, r).is_some() && gains.is_finite() {
            self.gains = gains;
            let variances = self.gains.P.diagonal();
            let found = self.gains.x.iter().zip(variances.iter());
            for (wrong, (gain, variance)) in self.wrong.iter_mut().zip(found) {
                let (error, sd) = ((gain - 1.0).abs(), sqrt(*variance));
                if error > TOLERANCE + SIGNIFICANT * sd {
                    *wrong = true;
                } else if error + sd < TOLERANCE {
                    *wrong = false;
                }
            }
        }
    }

    /// Whether wheels and accelerometer agree on accelerations: the gain has not been found wrong, or has been found right since.
    pub fn acceleration_consistent(&self) -> bool {
        let [wrong, _] = self.wrong;
        !wrong
    }

    /// Whether gyro and accelerometer agree on changes of slope.
    pub fn slope_consistent(&self) -> bool {
        let [_, wrong] = self.wrong;
        !wrong
    }

    /// Gains of the accelerometer on wheels and gyro: 1 and 1.
    pub fn gains(&self) -> [Real; 2] {
        [self.gains.x.x, self.gains.x.y]
    }
}

state!(KinematicConsistency { force, speed, acceleration_slow, pitch, slope, gains, wrong, since_s, heard_s; });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Starts and stops on a wavy track for a minute, then what is found; `fault` sees force, speed and pitch rate.
    fn drive(fault: impl Fn(&mut [Real; 3]), gyro: bool) -> (bool, bool) {
        let mut consistency = KinematicConsistency::default();
        let mut random = Random::new(101);
        let (dt, mut v, mut s): (Real, Real, Real) = (0.01, 0.0, 0.0);
        for k in 0..6_000 {
            let t = dt * k as Real;
            let wanted = if t % 20.0 < 12.0 { 1.0 } else { 0.0 };
            let a = (wanted - v).clamp(-0.3, 0.3);
            (v, s) = (v + a * dt, s + v * dt);
            let theta = 0.1 * (s / 4.0).sin();
            let rate = 0.1 / 4.0 * (s / 4.0).cos() * v;
            let mut z = [
                a + 9.81 * theta.sin() + 0.1 + 0.05 * random.normal(),
                v + 0.005 * random.normal(),
                rate + 0.01,
            ];
            fault(&mut z);
            let [f, v, w] = z;
            consistency.observe(f, v, gyro.then_some(w), dt);
        }
        (
            consistency.acceleration_consistent(),
            consistency.slope_consistent(),
        )
    }

    #[test]
    fn right_units_are_consistent_with_and_without_a_gyro() {
        assert_eq!(drive(|_| (), true), (true, true));
        assert_eq!(drive(|_| (), false), (true, true));
    }

    /// The wheels are not heard while the vehicle gathers speed: the step across the gap is no acceleration that the accelerometer lacks.
    #[test]
    fn a_gap_in_the_wheel_speed_is_no_acceleration() {
        let mut consistency = KinematicConsistency::default();
        for k in 0..2_000 {
            let v = (0.3 * (0.01 * k as Real - 2.0)).clamp(0.0, 1.0);
            let f = if v > 0.0 && v < 1.0 { 0.3 } else { 0.0 };
            if (300..400).contains(&k) {
                consistency.interrupt();
            } else {
                consistency.observe(f, v, Some(0.0), 0.01);
            }
            assert!(consistency.acceleration_consistent(), "{k}");
        }
        let [gain, _] = consistency.gains();
        assert!((gain - 1.0).abs() < 0.1, "{gain}");
    }

    #[test]
    fn each_wrong_unit_sign_and_axis_shows_in_its_gain() {
        let found = |fault: fn(&mut [Real; 3])| drive(fault, true);
        assert!(!found(|z| z[1] *= 3.6).0, "km/h");
        assert!(!found(|z| z[1] *= -1.0).0, "wheels backwards");
        assert_eq!(found(|z| z[0] /= 9.81), (false, false), "in g");
        assert_eq!(found(|z| z[0] *= -1.0), (false, false), "sign");
        assert_eq!(found(|z| z[0] = 0.0), (false, false), "swapped axes");
        assert!(!found(|z| z[2] *= 57.3).1, "°/s");
        assert!(!found(|z| z[2] *= -1.0).1, "gyro sign");
    }
}
