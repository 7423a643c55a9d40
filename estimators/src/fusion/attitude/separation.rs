//! Solution separation: how far the filter's pitch is from pitches that one instrument has no part in.
//!
//! Gyro, accelerometer and wheels have one parity relation, f = v̇ + g sin θ. When they contradict each other two
//! pitches are left. Without the gyro it is the pitch by accelerometer and wheels over the last second; without
//! accelerometer and wheels it is the pitch that the gyro has carried on from a time when all agreed. Beside them, the
//! pitch without the vertical force has the bias along the body that the sheet allows; and while the accelerometer is
//! out of use because |f| is not g, the gyro of the same box may have its scale. The reported deviation covers
//! all of them, whichever is right: three times √P + δ reach as far as the largest separation and √P more, σ² = P +
//! (σ_mount + δ)². As that of the mount it is added at the end only: a fault that may be is not the noise of a
//! sample. Source: ours, after solution separation in satellite navigation (Brown & McBurney 1988, Brenner 1996); the
//! pitches are those of running sums instead of filters of their own.

use crate::Real;
use crate::api::real::{GRAVITY, sin_cos, sqrt};
use crate::api::snapshot::{Blank, state};
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::tuning::{SEPARATION, SOURCE, STATISTICS, TIMES};

/// Signals of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compared {
    /// Pitch and roll of the filter, rad.
    pub angles: [Real; 2],
    /// Standard deviations of that pitch, rad, and of the gyro's bias about y, rad/s.
    pub sd: [Real; 2],
    /// Body rates without the gyro's biases, rad/s; `None` without a gyro.
    pub body_radps: Option<[Real; 3]>,
    /// Acceleration by accelerometer and pitch, m/s²; `None` without an accelerometer.
    pub acceleration_mps2: Option<Real>,
    /// New speed by the wheels, m/s.
    pub wheels_mps: Option<Real>,
    /// Speed of the filter, m/s.
    pub speed_mps: Real,
    /// Random walk of a pitch by the gyro, including the coupling of turns, rad/√s.
    pub angle_walk: Real,
    /// Standard deviation of the curvature of the rail, 1/m: an unseen pitch changes by as much for each m.
    pub curvature_sd_per_m: Real,
    /// Bias of the accelerometer along the body as found, and its reported standard deviation before any sample, as
    /// pitches, rad.
    pub bias_rad: [Real; 2],
    /// Scale error of the accelerometer by the length of its vector while it is out of use for it; else 0.
    pub scale: Real,
}

/// Pitch and roll by the gyro alone, started from the filter at an earlier time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Carried {
    angles: [Real; 2],
    /// Standard deviation of the gyro's bias at the start, rad/s, and variance of the pitch without this bias, rad².
    bias_sd: Real,
    variance: Real,
    age_s: Real,
    /// Least and largest pitch of the filter since then, rad.
    range: [Real; 2],
    /// True if filter, wheels and accelerometer have not always agreed with it.
    apart: bool,
}

impl Carried {
    fn begin(z: &Compared) -> Self {
        let ([theta, _], [sd, bias_sd]) = (z.angles, z.sd);
        Self {
            angles: z.angles,
            bias_sd,
            variance: sd * sd,
            age_s: 0.0,
            range: [theta; 2],
            apart: false,
        }
    }

    fn step(&mut self, z: &Compared, calm: bool, dt: Real) {
        let [theta, phi] = self.angles;
        let noise = match z.body_radps {
            Some([p, q, r]) => {
                let ([st, ct], [sp, cp]) = (sin_cos(theta), sin_cos(phi));
                let turned = [r * sp - q * cp, p - st / ct * (q * sp + r * cp)];
                let next = [theta + turned[0] * dt, phi + turned[1] * dt];
                self.angles = next.map(|angle| angle.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD));
                z.angle_walk
            }
            None => z.curvature_sd_per_m * z.speed_mps,
        };
        self.variance += noise * noise * dt;
        self.age_s += dt;
        let ([low, high], [pitch, _]) = (self.range, z.angles);
        self.range = [low.min(pitch), high.max(pitch)];
        let limit = STATISTICS.noise_sd * self.sd() + SEPARATION.nominal_rad;
        self.apart |= !calm || self.from(z).abs() > limit;
    }

    /// Separation from the filter, rad.
    fn from(&self, z: &Compared) -> Real {
        let ([theta, _], [pitch, _]) = (self.angles, z.angles);
        theta - pitch
    }

    fn sd(&self) -> Real {
        let turned = self.bias_sd * self.age_s;
        sqrt(self.variance + turned * turned)
    }
}

/// Separation of the filter from both pitches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Separation {
    /// Speed by the wheels and acceleration by the accelerometer behind the same low-pass, m/s and m/s².
    low: Option<[Real; 2]>,
    /// Time since the last wheel, and time for which accelerometer and wheels have given samples, s.
    waited_s: Real,
    heard_s: Real,
    /// Separation from the pitch without the gyro, rad; the last value while an instrument is missing.
    without_gyro: Real,
    /// Pitches by the gyro alone: one that is kept while it is apart, and one that is begun anew in turn.
    carried: Option<[Carried; 2]>,
    /// Separation from the pitch of a gyro with the scale of the accelerometer, rad; 0 while the accelerometer is in
    /// use.
    by_scale: Real,
    /// Pitch of the filter in the last step, rad.
    last_rad: Real,
    /// Results of the last step: a third of the largest separation, and the largest for a force balance, rad.
    open_rad: Real,
    apart_rad: Real,
}

impl Separation {
    /// Takes the signals of a step; returns the separation from the pitch without the gyro beyond what is usual, rad.
    pub fn step(&mut self, z: &Compared, dt: Real) -> Real {
        self.take_force(z, dt);
        let [own, _] = z.sd;
        let limit = STATISTICS.noise_sd * own + SEPARATION.nominal_rad;
        let excess = self.without_gyro.abs() - limit;
        let calm = excess < 0.0;
        // A gyro drifts. What is suddenly further apart is an accelerometer or wheels.
        let opens = !calm && self.is_heard() && excess < SOURCE.read_sum_sd;
        if self.carried.is_none() && calm && self.is_heard() {
            self.carried = Some([Carried::begin(z); 2]);
        }
        let mut carried = self.carried;
        if let Some(pair) = &mut carried {
            pair.iter_mut().for_each(|one| one.step(z, calm, dt));
            self.renew(pair, z);
        }
        self.carried = carried;
        let [pitch, _] = z.angles;
        self.by_scale = match z.scale == 0.0 {
            true => 0.0,
            false => self.by_scale + z.scale * (pitch - self.last_rad),
        };
        self.last_rad = pitch;
        let [bias, bias_sd] = z.bias_rad;
        // The largest, and the largest beyond what the other pitch itself leaves open.
        let now = self.without_gyro.abs().max(self.by_scale.abs()) - 2.0 * own;
        let known = carried.iter().flatten().filter(|one| is_known(one));
        let (largest, apart) = known.fold((now, now), |(largest, apart), one| {
            let from = one.from(z).abs();
            let beyond = from - 2.0 * one.sd().max(own);
            (largest.max(from - 2.0 * own), apart.max(beyond))
        });
        self.apart_rad = apart;
        self.open_rad = largest.max(bias.abs() - 2.0 * bias_sd).max(0.0) / 3.0;
        if opens { excess } else { 0.0 }
    }

    /// Compares the acceleration by accelerometer and pitch with that of the wheels: its mean is too small by g times
    /// what the pitch is too large.
    fn take_force(&mut self, z: &Compared, dt: Real) {
        self.waited_s += dt;
        self.heard_s += dt;
        let Some(acceleration) = z.acceleration_mps2.filter(|_| self.waited_s < TIMES.lost_s)
        else {
            (self.low, self.heard_s) = (None, 0.0);
            self.waited_s = z.wheels_mps.map_or(self.waited_s, |_| 0.0);
            return;
        };
        if let Some([_, mean]) = &mut self.low {
            *mean += dt / (TIMES.mean_s + dt) * (acceleration - *mean);
        }
        let Some(wheels) = z.wheels_mps else {
            return;
        };
        let [speed, mean] = self
            .low
            .unwrap_or([wheels - TIMES.mean_s * acceleration, acceleration]);
        let gained = (wheels - speed) / TIMES.mean_s;
        let share = self.waited_s / (TIMES.mean_s + self.waited_s);
        self.low = Some([speed + share * (wheels - speed), mean]);
        self.waited_s = 0.0;
        if self.is_heard() {
            self.without_gyro = (mean - gained) / GRAVITY;
        }
    }

    /// True after accelerometer and wheels have given samples for twice the memory.
    fn is_heard(&self) -> bool {
        self.heard_s > 2.0 * TIMES.mean_s
    }

    /// Restarts the young pitch after it has become old or uncertain. The kept one gives way to it if all have agreed
    /// with the young one all its life; after a contradiction they must have done so while the pitch changed.
    fn renew(&self, [kept, young]: &mut [Carried; 2], z: &Compared) {
        let [own, _] = z.sd;
        let says = |one: &Carried| one.sd() < 2.0 * own + SEPARATION.nominal_rad;
        let old = young.age_s > TIMES.young_s;
        if !old && says(young) {
            return;
        }
        let [low, high] = young.range;
        let due = match kept.apart {
            true => old && high - low > SEPARATION.excited_rad,
            false => kept.age_s > 2.0 * TIMES.young_s || !says(kept),
        };
        let agreed = !young.apart && self.heard_s >= young.age_s;
        if !is_known(kept) || agreed && due {
            *kept = *young;
        }
        *young = Carried::begin(z);
    }

    /// Largest separation from a pitch beyond two standard deviations of the worse of both, rad; negative while all
    /// agree. A bias beyond the sheet is not in it: it is in the sum with the grade, which a force balance uses.
    pub fn apart_rad(&self) -> Real {
        self.apart_rad
    }

    /// Standard deviation by which the pitch covers both, rad: a third of what the largest separation has beyond two of
    /// the filter's own.
    pub fn open_rad(&self) -> Real {
        self.open_rad
    }
}

/// Returns true while a pitch is known well enough.
fn is_known(one: &Carried) -> bool {
    one.sd() < SOURCE.read_sum_sd
}

impl Blank for Carried {
    fn blank() -> Self {
        Self::default()
    }
}

state!(Carried { angles, bias_sd, variance, age_s, range, apart; });
state!(Separation { low, waited_s, heard_s, without_gyro, carried, by_scale, last_rad, open_rad, apart_rad; });

#[cfg(test)]
mod tests {
    use super::*;

    const DT: Real = 0.01;
    const OWN: Real = 0.001;

    /// Deviation that a separation adds, rad.
    fn open(separation: Real) -> Real {
        (separation - 2.0 * OWN) / 3.0
    }

    /// A run at 1 m/s for so many seconds: the filter's pitch begins at `from` and turns at the `rate` of the gyro,
    /// with this acceleration by accelerometer and pitch.
    fn run(
        separation: &mut Separation,
        [from, rate]: [Real; 2],
        acceleration: Real,
        seconds: Real,
    ) -> Real {
        let mut pitch = from;
        for _ in 0..(seconds / DT) as usize {
            pitch += rate * DT;
            let z = Compared {
                angles: [pitch, 0.0],
                sd: [OWN, 1e-6],
                body_radps: Some([0.0, -rate, 0.0]),
                acceleration_mps2: Some(acceleration),
                wheels_mps: Some(1.0),
                speed_mps: 1.0,
                angle_walk: 1e-5,
                ..Compared::default()
            };
            separation.step(&z, DT);
        }
        separation.open_rad()
    }

    #[test]
    fn instruments_that_agree_add_nothing() {
        let sd = run(&mut Separation::default(), [0.0; 2], 0.0, 100.0);
        assert!(sd < 0.01 * OWN, "{sd}");
    }

    /// A pitch that is off by 0.02 rad is off by that from accelerometer and wheels, to either side.
    #[test]
    fn a_pitch_that_accelerometer_and_wheels_contradict_is_doubted_by_as_much() {
        for off in [0.02, -0.02] {
            let sd = run(&mut Separation::default(), [off, 0.0], -GRAVITY * off, 10.0);
            assert!((sd / open(0.02) - 1.0).abs() < 1e-3, "{sd}");
        }
    }

    /// A filter that has followed accelerometer and wheels by 0.05 rad, which the gyro has not seen, is doubted until
    /// the pitch has changed by more while all agreed.
    #[test]
    fn what_the_gyro_has_not_seen_is_doubted_until_all_agree_on_a_change() {
        let mut separation = Separation::default();
        run(&mut separation, [0.0; 2], 0.0, 30.0);
        let sd = run(&mut separation, [0.05, 0.0], 0.0, 100.0);
        assert!((sd / open(0.05) - 1.0).abs() < 0.02, "{sd}");
        let sd = run(&mut separation, [0.05, 0.004], 0.0, 100.0);
        assert!(sd < 0.01 * OWN, "{sd}");
    }

    /// A bias along the body that the sheet does not allow may be that of the vertical force: the pitch is doubted by
    /// what is beyond two standard deviations of the sheet, to either side.
    #[test]
    fn a_bias_beyond_the_sheet_is_doubt_of_the_pitch() {
        for (bias, expected) in [(0.0019, 0.0), (0.032, 0.01), (-0.062, 0.02)] {
            let mut separation = Separation::default();
            let z = Compared {
                sd: [OWN, 1e-6],
                bias_rad: [bias, 0.001],
                ..Compared::default()
            };
            separation.step(&z, DT);
            assert!((separation.open_rad() - expected).abs() < 1e-9, "{bias}");
        }
    }

    /// The variance of a carried pitch grows by the random walk of the gyro and by the square of bias times time.
    #[test]
    fn a_carried_pitch_is_known_as_well_as_the_gyro_turns_it() {
        let (walk, bias_sd, seconds): (Real, Real, Real) = (2e-4, 3e-5, 20.0);
        let z = Compared {
            sd: [OWN, bias_sd],
            body_radps: Some([0.0; 3]),
            angle_walk: walk,
            ..Compared::default()
        };
        let mut carried = Carried::begin(&z);
        for _ in 0..(seconds / DT) as usize {
            carried.step(&z, true, DT);
        }
        let turned = bias_sd * seconds;
        let expected = (OWN * OWN + walk * walk * seconds + turned * turned).sqrt();
        assert!((carried.sd() / expected - 1.0).abs() < 1e-9);
    }

    /// While the accelerometer reads 11 % less than g, a turn of 0.1 rad may be one of 0.089 rad; a turn before counts
    /// for nothing, and the doubt ends with the error of |f|.
    #[test]
    fn the_gyro_may_have_the_scale_of_the_accelerometer() {
        let mut separation = Separation::default();
        let mut at = |pitch: Real, scale: Real| {
            let z = Compared {
                angles: [pitch, 0.0],
                sd: [OWN, 1e-6],
                scale,
                ..Compared::default()
            };
            separation.step(&z, DT);
            separation.open_rad()
        };
        assert_eq!(at(0.3, 0.0), 0.0);
        for k in 0..10 {
            at(0.31 + 0.01 * Real::from(k), -0.11);
        }
        assert!((at(0.4, -0.11) / open(0.011) - 1.0).abs() < 1e-9);
        assert_eq!(at(0.4, 0.0), 0.0);
    }

    /// The pitch is opened by what accelerometer and wheels are apart beyond the usual, after they have been heard for
    /// 2 s, and not where that is more than 0.02 rad.
    #[test]
    fn a_pitch_is_opened_by_a_drift_and_not_by_a_jump() {
        let usual = 3.0 * OWN + SEPARATION.nominal_rad;
        let opens = |beyond: Real, seconds: Real| {
            let mut separation = Separation::default();
            let z = Compared {
                sd: [OWN, 1e-6],
                acceleration_mps2: Some(-GRAVITY * (usual + beyond)),
                wheels_mps: Some(1.0),
                ..Compared::default()
            };
            let steps = (seconds / DT) as usize;
            (0..steps).map(|_| separation.step(&z, DT)).last().unwrap()
        };
        assert_eq!(
            (opens(0.01, 1.9), opens(-0.001, 20.0), opens(0.021, 20.0)),
            (0.0, 0.0, 0.0)
        );
        for beyond in [0.001, 0.01, 0.019] {
            assert!((opens(beyond, 20.0) - beyond).abs() < 1e-5, "{beyond}");
        }
    }

    /// A gyro that has carried a pitch on from a time when it was known to 0.005 rad does not contradict one that is
    /// known better now and 0.009 rad off: the grade is doubted, but blocks are of use. Known to 0.001 rad, it does.
    #[test]
    fn a_carried_pitch_contradicts_beyond_its_own_deviation() {
        for (began_sd, apart) in [(0.005, -0.001), (OWN, 0.007)] {
            let mut separation = Separation::default();
            let mut at = |pitch: Real, sd: Real, seconds: Real| {
                let z = Compared {
                    angles: [pitch, 0.0],
                    sd: [sd, 0.0],
                    body_radps: Some([0.0; 3]),
                    acceleration_mps2: Some(0.0),
                    wheels_mps: Some(1.0),
                    ..Compared::default()
                };
                (0..(seconds / DT) as usize).for_each(|_| {
                    separation.step(&z, DT);
                });
                [separation.apart_rad(), separation.open_rad()]
            };
            at(0.0, began_sd, 5.0);
            let [found, sd] = at(0.009, OWN, 1.0);
            assert!((found - apart).abs() < 1e-5, "{began_sd}: {found}");
            assert!((sd / open(0.009) - 1.0).abs() < 1e-3, "{began_sd}: {sd}");
        }
    }

    /// Without an accelerometer what it said last stands.
    #[test]
    fn what_an_instrument_said_last_stands_while_it_is_missing() {
        let mut separation = Separation::default();
        run(&mut separation, [0.02, 0.0], -GRAVITY * 0.02, 10.0);
        for _ in 0..1000 {
            let z = Compared {
                angles: [0.02, 0.0],
                sd: [OWN, 1e-6],
                body_radps: Some([0.0; 3]),
                wheels_mps: Some(1.0),
                ..Compared::default()
            };
            separation.step(&z, DT);
        }
        assert!((separation.open_rad() / open(0.02) - 1.0).abs() < 1e-3);
    }
}
