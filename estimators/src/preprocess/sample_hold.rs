//! From samples to signals: checks every number, holds each channel while it is fresh, merges the drive units.

use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};
use crate::api::snapshot::state;
use crate::preprocess::stuck_detector::StuckDetector;
use crate::{Error, Real, Time};

/// What the pipelines work with. `None` = not known now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Speed by the wheels, m/s, if at least one drive unit sent a new sample.
    pub new_speed_mps: Option<Real>,
    /// Speed by the fresh wheels, m/s: their median, or, where half of them run away, that of the others; `None` where even that cannot be
    /// vouched for.
    pub speed_mps: Option<Real>,
    /// Sum of all motor torques, N·m.
    pub motor_torque_nm: Option<Real>,
    /// Torque of drive 0, N·m: on a road vehicle that of the front, steered axle.
    pub front_torque_nm: Option<Real>,
    /// Specific force along the train, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Specific force to the left, m/s².
    pub lateral_force_mps2: Option<Real>,
    /// Rate of the pitch angle, rad/s, + when the grade grows.
    pub pitch_rate_radps: Option<Real>,
    /// Rate about the vertical axis, rad/s, + to the left.
    pub yaw_rate_radps: Option<Real>,
    /// Steering angle of a road vehicle's front wheels, rad, + to the left.
    pub steering_angle_rad: Option<Real>,
    /// Share of the clamp brake commanded, 0…1.
    pub brake: Real,
}

/// Longest pause between two steps, s. A stamp further ahead is a fault of the clock; taken, it would make every later step late.
const MAX_PAUSE_S: Time = 60.0;

/// Latest instant, s: three hundred years, which leaves room for clocks that count from 1970.
const MAX_TIME_S: Time = 1e10;

/// MapGaps after which an older stamp means that the sensor's clock was wrong before, or has been set back, s.
const CLOCK_SET_BACK_S: Time = 1.0;

/// A channel's last sample. It is fresh for three sample periods, counted by the estimator's own clock, unless the sensor hangs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct HeldSample {
    stamp_s: Time,
    arrived_s: Time,
    period_s: Real,
    value: Option<Real>,
    repeats: StuckDetector,
}

impl HeldSample {
    /// Takes a new sample; a sample not younger than the last one is skipped, unless nothing younger has come for so long that its clock
    /// must have been set back. Tells whether it was taken.
    fn take(&mut self, sample: Option<Sample<Real>>, now_s: Time) -> bool {
        let Some(sample) = sample else { return false };
        if let Some(before) = self.value {
            let silence = now_s - self.arrived_s;
            let gap = silence as Real;
            let set_back = sample.t_s < self.stamp_s && silence > CLOCK_SET_BACK_S;
            if !(sample.t_s > self.stamp_s || set_back) {
                return false;
            }
            self.repeats.take(sample.value, before, now_s);
            // A gap after lost samples must not pass for a long sample period.
            self.period_s = if self.period_s > 0.0 {
                gap.min(1.1 * self.period_s)
            } else {
                gap
            };
        }
        (self.stamp_s, self.arrived_s, self.value) = (sample.t_s, now_s, Some(sample.value));
        true
    }

    fn fresh(&self, now_s: Time, dt_s: Real) -> Option<Real> {
        self.value
            .filter(|_| !self.repeats.frozen(now_s))
            .filter(|_| (now_s - self.arrived_s) as Real <= 3.0 * self.period_s.max(dt_s) + 1e-9)
    }
}

/// Holds the channels of one estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleHold {
    drives: usize,
    /// How far the speeds of wheels that roll may be apart, m/s.
    rolling_mps: Real,
    last_s: Option<Time>,
    torque: [HeldSample; MAX_DRIVES],
    speed: [HeldSample; MAX_DRIVES],
    forward: HeldSample,
    left: HeldSample,
    pitch_rate: HeldSample,
    yaw_rate: HeldSample,
    steering: HeldSample,
}

impl SampleHold {
    /// For a train of `vehicle.drives` drive units.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            drives: vehicle.drives.min(MAX_DRIVES),
            rolling_mps: vehicle.standstill_mps(None),
            last_s: None,
            torque: Default::default(),
            speed: Default::default(),
            forward: HeldSample::default(),
            left: HeldSample::default(),
            pitch_rate: HeldSample::default(),
            yaw_rate: HeldSample::default(),
            steering: HeldSample::default(),
        }
    }

    /// Checks one step's input and turns it into signals. On an error nothing is changed.
    pub fn read(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Reading, Error> {
        self.check(z, u, dt)?;
        let now = z.t_s;
        self.last_s = Some(now);
        self.forward.take(
            z.specific_force_mps2.map(|s| Sample {
                t_s: s.t_s,
                value: first(s.value),
            }),
            now,
        );
        self.left.take(
            z.specific_force_mps2.map(|s| Sample {
                t_s: s.t_s,
                value: second(s.value),
            }),
            now,
        );
        self.pitch_rate.take(
            z.angular_rate_radps.map(|s| Sample {
                t_s: s.t_s,
                value: -second(s.value),
            }),
            now,
        );
        self.yaw_rate.take(
            z.angular_rate_radps.map(|s| Sample {
                t_s: s.t_s,
                value: third(s.value),
            }),
            now,
        );
        self.steering.take(z.steering_angle_rad, now);
        for (held, sample) in self.torque.iter_mut().zip(z.motor_torque_nm) {
            held.take(sample, now);
        }
        let mut new_speed = false;
        for (held, sample) in self
            .speed
            .iter_mut()
            .zip(z.wheel_speed_mps)
            .take(self.drives)
        {
            new_speed |= held.take(sample, now);
        }

        let motor_torque_nm = self.total_torque(now, dt);
        let fresh = self.speed.iter().take(self.drives);
        let speed_mps = train_speed(
            fresh.filter_map(|held| held.fresh(now, dt)),
            motor_torque_nm.unwrap_or(0.0),
            self.rolling_mps,
        );
        Ok(Reading {
            new_speed_mps: speed_mps.filter(|_| new_speed),
            speed_mps,
            motor_torque_nm,
            front_torque_nm: self.torque.first().and_then(|held| held.fresh(now, dt)),
            specific_force_mps2: self.forward.fresh(now, dt),
            lateral_force_mps2: self.left.fresh(now, dt),
            pitch_rate_radps: self.pitch_rate.fresh(now, dt),
            yaw_rate_radps: self.yaw_rate.fresh(now, dt),
            steering_angle_rad: self.steering.fresh(now, dt),
            brake: u.brake,
        })
    }

    /// Sum of the torques; if up to half of the drive units are silent, the others stand for them (equal shares).
    fn total_torque(&self, now: Time, dt: Real) -> Option<Real> {
        let fresh = || {
            self.torque
                .iter()
                .take(self.drives)
                .filter_map(|held| held.fresh(now, dt))
        };
        let count = fresh().count();
        (count > 0 && 2 * count >= self.drives)
            .then(|| fresh().sum::<Real>() * self.drives as Real / count as Real)
    }

    fn check(&self, z: &Measurements, u: &Command, dt: Real) -> Result<(), Error> {
        if !(dt > 0.0 && dt <= 1.0) {
            return Err(Error::TimeStep(dt));
        }
        if !z.t_s.is_finite() {
            return Err(Error::NotFinite("time"));
        }
        if let Some(last_s) = self.last_s
            && z.t_s <= last_s
        {
            return Err(Error::OutOfOrder { t_s: z.t_s, last_s });
        }
        if let Some(last_s) = self.last_s
            && z.t_s - last_s > MAX_PAUSE_S
        {
            return Err(Error::TooFarAhead { t_s: z.t_s, last_s });
        }
        if z.t_s.abs() > MAX_TIME_S {
            return Err(Error::OutOfRange("time"));
        }
        for s in z.specific_force_mps2.iter() {
            check_sample("specific force", s.t_s, &s.value, 1e3)?;
        }
        for s in z.angular_rate_radps.iter() {
            check_sample("angular rate", s.t_s, &s.value, 1e3)?;
        }
        for s in z.motor_torque_nm.iter().flatten() {
            check_sample("motor torque", s.t_s, &[s.value], 1e5)?;
        }
        for s in z.wheel_speed_mps.iter().flatten() {
            check_sample("wheel speed", s.t_s, &[s.value], 1e2)?;
        }
        for s in z.steering_angle_rad.iter() {
            check_sample("steering angle", s.t_s, &[s.value], 1e1)?;
        }
        check_sample("brake command", 0.0, &[u.brake], 1e2)
    }
}

fn check_sample(signal: &'static str, t_s: Time, values: &[Real], most: Real) -> Result<(), Error> {
    if !t_s.is_finite() || values.iter().any(|v| !v.is_finite()) {
        return Err(Error::NotFinite(signal));
    }
    if values.iter().any(|v| v.abs() > most) {
        Err(Error::OutOfRange(signal))
    } else {
        Ok(())
    }
}

fn first([x, _, _]: [Real; 3]) -> Real {
    x
}

fn second([_, y, _]: [Real; 3]) -> Real {
    y
}

fn third([_, _, z]: [Real; 3]) -> Real {
    z
}

/// How far the speeds of wheels that roll may be apart beside their noise, as a share of the speed: worn wheels, errors of scale.
const ROLLING_SHARE: Real = 0.03;

/// Speed of the train from at most [`MAX_DRIVES`] wheel speeds: the median, which one slipping wheel does not move. Wheels run away in the
/// direction of their torque: where the two middle ones are apart, the one that has run away less counts. Two wheels or more that have run
/// away even less say that this one slips too: then nobody knows.
fn train_speed(
    values: impl Iterator<Item = Real>,
    torque_nm: Real,
    rolling_mps: Real,
) -> Option<Real> {
    let mut room = [0.0; MAX_DRIVES];
    let mut count = 0;
    for (place, value) in room.iter_mut().zip(values) {
        *place = value;
        count += 1;
    }
    let sorted = room.get_mut(..count)?;
    sorted.sort_unstable_by(Real::total_cmp);
    if torque_nm < 0.0 {
        sorted.reverse();
    }
    let less = *sorted.get(count.checked_sub(1)? / 2)?;
    let more = *sorted.get(count / 2)?;
    let apart = |a: Real, b: Real| (a - b).abs() > rolling_mps + ROLLING_SHARE * less.abs();
    let middle = if apart(less, more) {
        less
    } else {
        0.5 * (less + more)
    };
    let against = sorted.get(1).filter(|_| count > 3);
    match against {
        Some(against) if apart(*against, middle) => None,
        _ => Some(middle),
    }
}

state!(HeldSample { stamp_s, arrived_s, period_s, value, repeats; });
state!(SampleHold { last_s, torque, speed, forward, left, pitch_rate, yaw_rate, steering; drives, rolling_mps });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;

    fn with_speed(t_s: Real, speeds: &[Real]) -> Measurements {
        let mut z = Measurements {
            t_s,
            ..Default::default()
        };
        for (place, value) in z.wheel_speed_mps.iter_mut().zip(speeds) {
            *place = Some(Sample { t_s, value: *value });
        }
        z
    }

    #[test]
    fn a_wheel_that_slips_or_errs_is_outvoted() {
        let speed = |values: &[Real], torque| train_speed(values.iter().copied(), torque, 0.05);
        assert_eq!(speed(&[1.0, 9.0, 1.01], 50.0), Some(1.01));
        assert_eq!(speed(&[1.0, 1.02], 50.0), Some(1.01));
        assert_eq!(speed(&[], 50.0), None);
        assert_eq!(speed(&[0.0, 1.0, 1.0, 1.0, 1.0, 1.0], 50.0), Some(1.0));
    }

    #[test]
    fn wheels_run_away_in_the_direction_of_their_torque() {
        let speed = |values: &[Real], torque| train_speed(values.iter().copied(), torque, 0.05);
        let half = [1.4, 1.0, 1.4, 1.0, 1.5, 1.0, 1.4, 1.0];
        assert_eq!(speed(&half, 50.0), Some(1.0));
        assert_eq!(speed(&half.map(|v| -v), -50.0), Some(-1.0));
        // Braked by their motors, wheels turn too slowly.
        assert_eq!(speed(&half.map(|v| 2.0 - v), -50.0), Some(1.0));
        // Six of eight: nobody knows.
        let most = [1.4, 1.0, 1.4, 1.0, 1.5, 1.4, 1.4, 1.4];
        assert_eq!(speed(&most, 50.0), None);
    }

    #[test]
    fn a_silent_channel_is_held_for_three_periods_only() {
        let mut front = SampleHold::new(&vehicle());
        let u = Command::default();
        for k in 1..=10 {
            front
                .read(&with_speed(k as Real * 0.05, &[1.0]), &u, 0.05)
                .unwrap();
        }
        let silent = |t_s| Measurements {
            t_s,
            ..Default::default()
        };
        let reading = front.read(&silent(0.6), &u, 0.05).unwrap();
        assert_eq!(
            (reading.speed_mps, reading.new_speed_mps),
            (Some(1.0), None)
        );
        assert_eq!(front.read(&silent(0.66), &u, 0.05).unwrap().speed_mps, None);
    }

    #[test]
    fn missing_torques_are_made_up_from_the_others_down_to_half() {
        let u = Command::default();
        let read = |count: usize| {
            let mut z = Measurements {
                t_s: 1.0,
                ..Default::default()
            };
            for place in z.motor_torque_nm.iter_mut().take(count) {
                *place = Some(Sample {
                    t_s: 1.0,
                    value: 100.0,
                });
            }
            SampleHold::new(&vehicle())
                .read(&z, &u, 0.01)
                .unwrap()
                .motor_torque_nm
        };
        assert_eq!(vehicle().drives, 8);
        assert_eq!(
            (read(8), read(4), read(3)),
            (Some(800.0), Some(800.0), None)
        );
    }

    #[test]
    fn bad_input_is_named_and_changes_nothing() {
        let mut front = SampleHold::new(&vehicle());
        let u = Command::default();
        front.read(&with_speed(1.0, &[1.0]), &u, 0.01).unwrap();
        let before = front;
        let good = with_speed(2.0, &[1.0]);
        for dt in [0.0, -0.1, 2.0, Real::NAN, Real::INFINITY] {
            assert!(matches!(front.read(&good, &u, dt), Err(Error::TimeStep(_))));
        }
        for t in [1.0, 0.5, -1e9] {
            let z = Measurements { t_s: t, ..good };
            assert!(matches!(
                front.read(&z, &u, 0.01),
                Err(Error::OutOfOrder { .. })
            ));
        }
        assert_eq!(
            front.read(&with_speed(2.0, &[Real::NAN]), &u, 0.01),
            Err(Error::NotFinite("wheel speed"))
        );
        assert_eq!(
            front.read(&with_speed(2.0, &[1e9]), &u, 0.01),
            Err(Error::OutOfRange("wheel speed"))
        );
        let z = Measurements {
            specific_force_mps2: Some(Sample {
                t_s: 2.0,
                value: [0.0, Real::INFINITY, 0.0],
            }),
            ..good
        };
        assert_eq!(
            front.read(&z, &u, 0.01),
            Err(Error::NotFinite("specific force"))
        );
        let brake = Command {
            brake: Real::NAN,
            ..u
        };
        assert_eq!(
            front.read(&good, &brake, 0.01),
            Err(Error::NotFinite("brake command"))
        );
        assert_eq!(front, before);
    }

    #[test]
    fn a_grade_that_grows_is_a_positive_pitch_rate() {
        let z = Measurements {
            t_s: 1.0,
            angular_rate_radps: Some(Sample {
                t_s: 1.0,
                value: [0.0, -0.1, 0.0],
            }),
            ..Default::default()
        };
        let reading = SampleHold::new(&vehicle())
            .read(&z, &Command::default(), 0.01)
            .unwrap();
        assert_eq!(reading.pitch_rate_radps, Some(0.1));
    }
}
