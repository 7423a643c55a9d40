//! Kinematic consistency of accelerometer, wheel speed and pitch gyro.
//!
//! An accelerometer reads f = v̇ + g sin θ + bias. Behind one band-pass (low-pass of 0.3 s, high-passes of 4 and 16 s,
//! which take the biases out) that is
//!
//! f = a v̇ + b g Θ,  v̇ by the wheels, Θ the integral of the pitch rate
//!
//! with gains a = b = 1 where units, signs and axes are right. Recursive least squares for the two gains, with samples
//! that count only while one of the regressors moves. What a fault makes of them:
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
//! A gain b of 0 means that the forward axis, or the gyro's axis, is a wrong one. The left axis decides: its reading
//! less the centripetal acceleration is regressed on v̇ + g Θ, and the gain must be 0.
//!
//! A gyro that reads no pitch rate at all excites nothing in this regression. So it is turned round, too:
//!
//! g Θ = c f − d v̇
//!
//! A gyro of a wrong sign, axis or unit makes both gains wrong; wheels make d wrong and the accelerometer c.
//!
//! Beside it a step of the wheel speed is compared with the specific force over the same 0.6 s: at steady speed the
//! unit of the wheels shows in nothing else. What is beyond 0.8 m/s and half the speed before is no scale error; the
//! gain of the wheels then starts anew from 0, and must be found right again.
//!
//! At steady speed on an even grade there is nothing else to see, and nothing that a wrong unit would do to slope or
//! mass either; the gains found last stand until there is.

use nalgebra::{Matrix2, Vector2, vector};

use crate::Real;
use crate::api::real::{GRAVITY, lag, sqrt};
use crate::api::snapshot::state;
use crate::filters::gaussian::Gaussian;
use crate::filters::lag_share::LastTwo;
use crate::tuning::{CONSISTENCY, RAIL, STATISTICS, TIMES};

/// Shares of a step in the filters.
#[derive(Clone, Copy, Debug, Default)]
struct Shares {
    low: Real,
    high: Real,
    leak: Real,
    cross: Real,
    step: Real,
    before: Real,
}

impl Shares {
    fn of(dt_s: Real) -> Self {
        Self {
            low: lag(dt_s, TIMES.brief_s),
            high: lag(dt_s, CONSISTENCY.high_pass_s),
            leak: lag(dt_s, CONSISTENCY.leak_s),
            cross: lag(dt_s, CONSISTENCY.cross_high_pass_s),
            step: lag(dt_s, 2.0 * TIMES.brief_s),
            before: lag(dt_s, TIMES.pause_s),
        }
    }
}

/// The two high-passes, which remove a bias and the integral of a bias. All signals go through the same, or they would
/// differ by what the filters do on a long ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HighPass {
    slow: Real,
    leaked: Real,
}

impl HighPass {
    fn step(&mut self, input: Real, shares: &Shares, settled: bool) -> Real {
        if !settled {
            (self.slow, self.leaked) = (input, 0.0);
        }
        self.slow += shares.high * (input - self.slow);
        let fast = input - self.slow;
        self.leaked += shares.leak * (fast - self.leaked);
        fast - self.leaked
    }
}

state!(HighPass { slow, leaked; });

/// Regression of the specific force on the acceleration of the wheels and the integral of the pitch rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KinematicConsistency {
    /// Specific force forward, speed, and specific force to the left behind the low-pass; the rate of the speed is the
    /// acceleration behind the same.
    low: Option<[Real; 3]>,
    force: HighPass,
    acceleration: HighPass,
    across: HighPass,
    /// Slow parts of the left axis, and of the acceleration forward, behind the filters above.
    cross_slow: [Real; 2],
    /// Pitch rate behind the low-pass, rad/s, and its integral, which leaks like the first high-pass: the same as the
    /// integral behind it.
    pitch_rate: Real,
    pitch: Real,
    pitch_leaked: Real,
    gains: Gaussian<2>,
    /// True for each gain that was found wrong and has not become right again.
    wrong: [bool; 2],
    /// Gain of the left axis on the acceleration forward, its variance, and true if this gain was detected.
    cross: [Real; 2],
    swapped: bool,
    /// True if a step of their speed has found the wheels wrong.
    stepped: bool,
    /// Gains c and d of the gyro's rotation.
    turn: Gaussian<2>,
    /// Slope by accelerometer and wheels of the last sample, m/s², and time left in which the gyro is not compared, s.
    seen: Real,
    jumped_s: Real,
    /// Mean square of the specific force beside the low-pass, m²/s⁴: a body that shakes.
    shake: Real,
    since_s: Real,
    /// Change of the wheel speed that the accelerometer does not show, m/s.
    step_mps: Real,
    /// Wheel speed some time ago, m/s.
    before_mps: Real,
    /// Time since the signals came or came back, s.
    heard_s: Real,
    shares: LastTwo<Real, Shares>,
}

impl Default for KinematicConsistency {
    fn default() -> Self {
        Self {
            low: None,
            force: HighPass::default(),
            acceleration: HighPass::default(),
            across: HighPass::default(),
            cross_slow: [0.0; 2],
            pitch_rate: 0.0,
            pitch: 0.0,
            pitch_leaked: 0.0,
            gains: right_gains(),
            wrong: [false; 2],
            cross: [0.0, CONSISTENCY.gain_sd * CONSISTENCY.gain_sd],
            swapped: false,
            stepped: false,
            seen: 0.0,
            jumped_s: 0.0,
            shake: 0.0,
            turn: right_gains(),
            since_s: 0.0,
            step_mps: 0.0,
            before_mps: 0.0,
            heard_s: 0.0,
            shares: LastTwo::default(),
        }
    }
}

impl KinematicConsistency {
    /// One step of `dt` seconds: specific force forward, and to the left less the centripetal acceleration, m/s², wheel
    /// speed, m/s, pitch rate, rad/s (`None` without a gyro).
    pub fn observe(
        &mut self,
        [force_mps2, across_mps2]: [Real; 2],
        speed_mps: Real,
        pitch_rate_radps: Option<Real>,
        dt: Real,
    ) {
        let shares = self.shares.of(dt, Shares::of);
        let settled = self.heard_s >= TIMES.mean_s;
        self.heard_s = (self.heard_s + dt).min(TIMES.mean_s);
        let rate = pitch_rate_radps.unwrap_or(0.0);
        let first = [force_mps2, speed_mps, across_mps2];
        let [force, speed, across] = self.low.unwrap_or(first);
        let moved = shares.low * (speed_mps - speed);
        let beside = force_mps2 - force;
        let force = force + shares.low * beside;
        self.shake += shares.before * (beside * beside - self.shake);
        let across = across + shares.low * (across_mps2 - across);
        self.low = Some([force, speed + moved, across]);
        self.pitch_rate += shares.low * (rate - self.pitch_rate);
        if !settled {
            (self.pitch, self.pitch_leaked) = (0.0, 0.0);
            self.before_mps = speed_mps;
        }
        let f = self.force.step(force, &shares, settled);
        let a = self.acceleration.step(moved / dt, &shares, settled);
        let y = self.across.step(across, &shares, settled);
        self.pitch += dt * self.pitch_rate - shares.high * self.pitch;
        self.pitch_leaked += shares.leak * (self.pitch - self.pitch_leaked);
        let slope = GRAVITY * (self.pitch - self.pitch_leaked);
        let mut cross = [y, a + slope];
        for (signal, slow) in cross.iter_mut().zip(&mut self.cross_slow) {
            *slow += shares.cross * (*signal - *slow);
            *signal -= *slow;
        }
        self.step_mps += dt * (a - f + slope) - shares.step * self.step_mps;
        self.before_mps += shares.before * (speed_mps - self.before_mps);
        let most = CONSISTENCY.step_mps + CONSISTENCY.step_share * self.before_mps.abs();
        if self.step_mps.abs() > most && self.pitch_rate.abs() < CONSISTENCY.max_pitch_radps {
            self.disown_wheels();
        }
        self.since_s += dt;
        if !settled || self.since_s * CONSISTENCY.rate_hz < 1.0 {
            return;
        }
        self.since_s = 0.0;
        let unseen = if pitch_rate_radps.is_some() {
            0.0
        } else {
            CONSISTENCY.slope_noise_per_s * speed_mps
        };
        self.regress(f, vector![a, slope], unseen);
        self.regress_across(cross, unseen);
        if pitch_rate_radps.is_some() {
            self.regress_turn(slope, vector![f, -a], speed_mps);
        }
    }

    /// Wheel speed or accelerometer is missing: what the filters hold belongs to an earlier time, and a step across the
    /// gap is no acceleration.
    pub fn interrupt(&mut self) {
        (self.low, self.heard_s) = (None, 0.0);
        self.step_mps = 0.0;
    }

    /// The wheels are wrong until their gain has been found right again.
    fn disown_wheels(&mut self) {
        let [wheels, _] = &mut self.wrong;
        (*wheels, self.stepped) = (true, true);
        self.step_mps = 0.0;
        self.gains
            .set_independent(0, 0.0, CONSISTENCY.gain_sd * CONSISTENCY.gain_sd);
    }

    /// The gyro is left out: a step of the wheels that rests on it is none.
    pub fn leave_gyro_out(&mut self) {
        if self.stepped {
            let [wheels, _] = &mut self.wrong;
            (*wheels, self.stepped) = (false, false);
            self.gains
                .set_independent(0, 1.0, CONSISTENCY.gain_sd * CONSISTENCY.gain_sd);
        }
    }

    /// Begins anew, for a gyro whose rates cannot be compared with anything: what is known of the left axis stays.
    pub fn without_gyro(&self) -> Self {
        Self {
            cross: self.cross,
            swapped: self.swapped,
            ..Self::default()
        }
    }

    /// The accelerometer is wrong: the gyro is not compared with it until what it has read has died out.
    pub fn doubt_slope(&mut self) {
        (self.turn, self.jumped_s) = (right_gains(), CONSISTENCY.leak_s);
    }

    fn regress_turn(&mut self, turned: Real, h: Vector2<Real>, speed_mps: Real) {
        let (seen, size) = (h.sum(), h.dot(&h));
        let most = RAIL.max_turn_radpm * GRAVITY * speed_mps.abs() / CONSISTENCY.rate_hz
            + CONSISTENCY.noise_mps2;
        let jumps = (seen - self.seen).abs() > most;
        self.jumped_s = (self.jumped_s - 1.0 / CONSISTENCY.rate_hz).max(0.0);
        self.seen = seen;
        if jumps {
            self.doubt_slope();
        } else if self.jumped_s == 0.0
            && size > CONSISTENCY.noise_mps2 * CONSISTENCY.noise_mps2 + self.shake
        {
            let r = CONSISTENCY.noise_mps2 * CONSISTENCY.noise_mps2
                + CONSISTENCY.turn_noise * CONSISTENCY.turn_noise * size;
            learn(&mut self.turn, turned, &h, r);
        }
    }

    fn regress_across(&mut self, [y, h]: [Real; 2], unseen: Real) {
        let sizes = CONSISTENCY.relative_noise * CONSISTENCY.relative_noise * (h * h + y * y);
        let r = CONSISTENCY.noise_mps2 * CONSISTENCY.noise_mps2 + sizes + unseen * unseen;
        if h * h < r {
            return;
        }
        let [gain, variance] = self.cross;
        let variance = (variance / CONSISTENCY.cross_forgetting)
            .min(CONSISTENCY.gain_sd * CONSISTENCY.gain_sd);
        let k = variance * h / (h * h * variance + r);
        let (gain, variance) = (gain + k * (y - h * gain), variance * (1.0 - k * h));
        if !(gain.is_finite() && variance > 0.0) {
            return;
        }
        self.cross = [gain, variance];
        if gain.abs() > CONSISTENCY.tolerance + STATISTICS.same_sd * sqrt(variance) {
            self.swapped = true;
        } else if gain.abs() + sqrt(variance) < CONSISTENCY.tolerance {
            self.swapped = false;
        }
    }

    fn regress(&mut self, f: Real, h: Vector2<Real>, unseen: Real) {
        let size = h.dot(&h);
        let r = CONSISTENCY.noise_mps2 * CONSISTENCY.noise_mps2
            + CONSISTENCY.relative_noise * CONSISTENCY.relative_noise * size
            + unseen * unseen;
        if size < r {
            return;
        }
        if learn(&mut self.gains, f, &h, r) {
            let variances = self.gains.P.diagonal();
            let found = self.gains.x.iter().zip(variances.iter());
            for (wrong, (gain, variance)) in self.wrong.iter_mut().zip(found) {
                let (error, sd) = ((gain - 1.0).abs(), sqrt(*variance));
                if error > CONSISTENCY.tolerance + STATISTICS.noise_sd * sd {
                    *wrong = true;
                } else if error + sd < CONSISTENCY.tolerance {
                    *wrong = false;
                }
            }
            let [wheels, _] = self.wrong;
            self.stepped &= wheels;
        }
    }

    /// Returns true if wheels and accelerometer agree on accelerations: the gain has not been found wrong, or has been
    /// found right since.
    pub fn acceleration_consistent(&self) -> bool {
        let [wrong, _] = self.wrong;
        !wrong
    }

    /// Returns true if the acceleration along the rail appears on the left axis.
    pub fn axes_swapped(&self) -> bool {
        self.swapped
    }

    /// Returns true if the gyro disagrees with the slope by accelerometer and wheels, and neither of these is wrong.
    pub fn turns_otherwise(&self) -> bool {
        let error = self.turn.x.map(|gain| (gain - 1.0).abs());
        let sd = self.turn.P.diagonal().map(sqrt);
        let [wheels, _] = self.wrong;
        let others = wheels && !self.stepped;
        error.x > CONSISTENCY.tolerance + STATISTICS.noise_sd * sd.x
            && error.y > CONSISTENCY.tolerance + sd.y
            && !others
    }

    /// Returns true if gyro and accelerometer agree on changes of slope.
    pub fn slope_consistent(&self) -> bool {
        let [_, wrong] = self.wrong;
        !wrong
    }
}

/// Gains of correct instruments, before any sample.
fn right_gains() -> Gaussian<2> {
    Gaussian::independent(
        vector![1.0, 1.0],
        vector![CONSISTENCY.gain_sd, CONSISTENCY.gain_sd],
    )
}

/// Corrects gains by the sample y = h·gains of the variance `r`; returns false if the numbers do not allow it.
fn learn(gains: &mut Gaussian<2>, y: Real, h: &Vector2<Real>, r: Real) -> bool {
    // Forgets along the regressor alone (Kulhavý 1987 in its simplest form): what is not excited is kept.
    let along = Matrix2::identity()
        + (h * h.transpose() / h.dot(h)) * (1.0 / sqrt(CONSISTENCY.forgetting) - 1.0);
    let mut next = *gains;
    next.P = along * next.P * along;
    next.symmetrise();
    next.limit_variance(&Vector2::repeat(CONSISTENCY.gain_sd * CONSISTENCY.gain_sd));
    let learnt = next.correct_scalar(y - h.dot(&next.x), h, r).is_some() && next.is_finite();
    if learnt {
        *gains = next;
    }
    learnt
}

state!(KinematicConsistency { low, force, acceleration, across, cross_slow, pitch_rate, pitch, pitch_leaked, gains, wrong, cross, swapped, stepped, turn, seen, jumped_s, shake, since_s, step_mps, before_mps, heard_s; shares });

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
            consistency.observe([f, 0.0], v, gyro.then_some(w), dt);
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

    /// Wheel speeds are missing while the vehicle gathers speed: the step across the gap is no acceleration that the
    /// accelerometer lacks.
    #[test]
    fn a_gap_in_the_wheel_speed_is_no_acceleration() {
        let mut consistency = KinematicConsistency::default();
        for k in 0..2_000 {
            let v = (0.3 * (0.01 * k as Real - 2.0)).clamp(0.0, 1.0);
            let f = if v > 0.0 && v < 1.0 { 0.3 } else { 0.0 };
            if (300..400).contains(&k) {
                consistency.interrupt();
            } else {
                consistency.observe([f, 0.0], v, Some(0.0), 0.01);
            }
            assert!(consistency.acceleration_consistent(), "{k}");
        }
        let gain = consistency.gains.x.x;
        assert!((gain - 1.0).abs() < 0.1, "{gain}");
    }

    /// At 0.9 m/s on the level nothing moves but the wheel speed, from one sample to the next; the fault is found in a
    /// second and stands.
    #[test]
    fn a_wrong_unit_of_the_wheels_shows_at_steady_speed() {
        for (factor, right) in [(3.6, false), (-1.0, false), (1.1, true), (0.8, true)] {
            let mut consistency = KinematicConsistency::default();
            for k in 0..3_000 {
                let v = if k < 1_000 { 0.9 } else { 0.9 * factor };
                consistency.observe([0.0; 2], v, Some(0.0), 0.01);
            }
            assert_eq!(consistency.acceleration_consistent(), right, "{factor}");
        }
    }

    #[test]
    fn swapped_axes_of_an_accelerometer_are_found_on_a_hill_at_steady_speed() {
        for (axes, swapped) in [([1.0, 0.0], false), ([0.0, 1.0], true), ([0.0, -1.0], true)] {
            let mut consistency = KinematicConsistency::default();
            for k in 0..3_000 {
                let t = 0.01 * k as Real;
                let (theta, rate) = (0.1 * (0.5 * t).sin(), 0.05 * (0.5 * t).cos());
                let f = axes.map(|share| share * 9.81 * theta);
                consistency.observe(f, 0.9, Some(rate), 0.01);
            }
            assert_eq!(consistency.axes_swapped(), swapped, "{axes:?}");
            assert_eq!(consistency.slope_consistent(), !swapped, "{axes:?}");
        }
    }

    /// A ramp of half a minute is longer than the high-passes: all signals go through the same ones.
    #[test]
    fn a_long_ramp_leaves_the_gains_as_they_are() {
        let mut consistency = KinematicConsistency::default();
        for k in 0..8_000 {
            let t = 0.01 * k as Real;
            let rate = if (10.0..40.0).contains(&t) { 0.01 } else { 0.0 };
            let theta = 0.01 * (t - 10.0).clamp(0.0, 30.0);
            consistency.observe([9.81 * theta, 0.0], 0.9, Some(rate), 0.01);
        }
        let gain = consistency.gains.x.y;
        assert!((gain - 1.0).abs() < 0.05, "{gain}");
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

    /// A minute on a wavy track with starts and stops, with noise: what `z` makes of force forward and to the left,
    /// speed and pitch rate is observed `rate_hz` times a second.
    fn wavy(
        rate_hz: usize,
        gyro: bool,
        z: impl Fn([Real; 4]) -> [Real; 4],
    ) -> KinematicConsistency {
        let mut consistency = KinematicConsistency::default();
        let mut random = Random::new(101);
        let (dt, mut v, mut s): (Real, Real, Real) = (1.0 / rate_hz as Real, 0.0, 0.0);
        for k in 0..60 * rate_hz {
            let t = dt * k as Real;
            let wanted = [0.0, 1.0, 0.0, -1.0][(t / 5.0) as usize % 4];
            let a = ((wanted - v) / 0.2).clamp(-0.4, 0.4);
            (v, s) = (v + a * dt, s + v * dt);
            let (theta, rate) = (0.1 * (s / 3.0).sin(), 0.1 / 3.0 * (s / 3.0).cos() * v);
            let mut noisy = |x: Real, sd: Real| x + sd * random.normal();
            let [f, y, v, w] = z([
                noisy(a + GRAVITY * theta.sin(), 0.05),
                noisy(0.0, 0.05),
                noisy(v, 0.005),
                rate,
            ]);
            consistency.observe([f, y], v, gyro.then_some(w), dt);
        }
        consistency
    }

    /// The vehicle may look the other way, and left may be right: what is found of the gains is the same.
    #[test]
    fn the_gains_do_not_depend_on_where_forward_and_left_are() {
        let mix = |[f, y, v, w]: [Real; 4]| [f, y + 0.5 * f, 1.2 * v, w];
        for gyro in [true, false] {
            let seen = wavy(100, gyro, mix);
            let turned = wavy(100, gyro, |z| mix(z).map(|signal| -signal));
            assert_eq!((seen.gains, seen.wrong), (turned.gains, turned.wrong));
            assert_eq!((seen.cross, seen.swapped), (turned.cross, turned.swapped));
            let mirrored = wavy(100, gyro, |z| {
                let [f, y, v, w] = mix(z);
                [f, -y, v, w]
            });
            let [gain, variance] = mirrored.cross;
            assert_eq!(
                (seen.gains, seen.cross),
                (mirrored.gains, [-gain, variance])
            );
            assert_eq!(seen.swapped, mirrored.swapped);
        }
    }

    /// Least squares on exact proportions find them: wheels that count 1.25 times what they should have the gain
    /// 1/1.25, a gyro that reads 1.25 times the rate too, and an accelerometer turned by an angle has its sine on the
    /// left axis.
    #[test]
    fn the_gains_are_those_of_the_instruments() {
        for factor in [0.8, 1.25] {
            let wheels = wavy(100, true, |[f, y, v, w]| [f, y, factor * v, w])
                .gains
                .x;
            assert!((wheels.x * factor - 1.0).abs() < 0.05, "{wheels}");
            assert!((wheels.y - 1.0).abs() < 0.05, "{wheels}");
            let gyro = wavy(100, true, |[f, y, v, w]| [f, y, v, factor * w])
                .gains
                .x;
            assert!((gyro.y * factor - 1.0).abs() < 0.05, "{gyro}");
            assert!((gyro.x - 1.0).abs() < 0.05, "{gyro}");
        }
        for sine in [0.3, -0.6] {
            let [gain, _] = wavy(100, true, |[f, y, v, w]| [f, y + sine * f, v, w]).cross;
            assert!((gain - sine).abs() < 0.05, "{gain}");
        }
    }

    /// An instrument that sends more often tells no more: the noise of a sample is that of a fifth of a second.
    #[test]
    fn more_samples_are_no_more_information() {
        let [slow, fast] = [100, 400].map(|rate_hz| wavy(rate_hz, true, |z| z));
        for (slow, fast) in slow.gains.P.diagonal().iter().zip(&fast.gains.P.diagonal()) {
            assert!((slow / fast - 1.0).abs() < 0.15, "{slow} {fast}");
        }
        let ([_, slow], [_, fast]) = (slow.cross, fast.cross);
        assert!((slow / fast - 1.0).abs() < 0.15, "{slow} {fast}");
        // without a gyro the slopes are noise, which grows with the speed
        let [with, without] = [true, false].map(|gyro| wavy(100, gyro, |z| z).gains.P.m11);
        assert!(without > 2.0 * with, "{without} {with}");
    }

    /// Of a step of the wheel speed a half is left behind the filters: one by more than 0.8 m/s and half the speed
    /// before is none of a wheel that is right, to either side. While a gyro reads more than any track has, it is in
    /// doubt itself.
    #[test]
    fn a_step_of_the_wheels_is_wrong_from_a_size_on() {
        for before in [0.0, 1.0, -1.0, 3.0] as [Real; 4] {
            let least = 0.8 + 0.5 * before.abs();
            for (share, right) in [(0.8, true), (1.3, false)] {
                for sign in [1.0, -1.0] {
                    for rate in [0.0, 0.5] {
                        let mut consistency = KinematicConsistency::default();
                        let mut theta = 0.0;
                        for k in 0..1_060 {
                            let step = if k < 1_000 { 0.0 } else { sign * share * least };
                            let w = if k < 900 { 0.0 } else { rate };
                            theta += 0.01 * w;
                            let f = [GRAVITY * theta, 0.0];
                            consistency.observe(f, before + step, Some(w), 0.01);
                        }
                        let found = consistency.acceleration_consistent();
                        let expected = right || rate > 0.0;
                        assert_eq!(found, expected, "{before} {share} {sign} {rate}");
                    }
                }
            }
        }
    }

    /// On hills at steady speed for ten minutes, and then an instrument is exchanged: left for forward, or a gyro of
    /// the other sign. What was right for so long does not hide it: it is found in a minute, and put right again in
    /// another.
    #[test]
    fn a_fault_after_a_long_time_is_found_as_soon_as_one_at_the_start() {
        for (axes, sign) in [([0.0, 1.0], 1.0), ([1.0, 0.0], -1.0)] {
            let mut consistency = KinematicConsistency::default();
            for k in 0..72_000 {
                let t = 0.01 * Real::from(k as f32);
                let wrong = (600.0..660.0).contains(&t);
                let (axes, sign) = if wrong {
                    (axes, sign)
                } else {
                    ([1.0, 0.0], 1.0)
                };
                let (theta, rate) = (0.1 * (0.5 * t).sin(), 0.05 * (0.5 * t).cos());
                let f = axes.map(|share| share * GRAVITY * theta);
                consistency.observe(f, 0.9, Some(sign * rate), 0.01);
                if [59_999, 65_999, 71_999].contains(&k) {
                    let swapped = axes == [0.0, 1.0];
                    assert_eq!(consistency.axes_swapped(), swapped, "{t}");
                    assert_eq!(consistency.slope_consistent(), !wrong, "{t}");
                }
            }
        }
    }
}
