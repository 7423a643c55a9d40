//! Signal front end: from the samples of one step to the signals that pipelines work with.

use crate::api::aid::Rejection;
use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};
use crate::api::snapshot::state;
use crate::preprocess::input_check::InputCheck;
use crate::preprocess::sample_hold::SampleHold;
use crate::preprocess::wheel_speed_vote::WheelSpeedVote;
use crate::{Error, Real, Time};

/// The signals of one step; `None` = not known now (stale, stuck, or never sampled).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Speed by the wheels, m/s, if at least one drive unit sent a new sample.
    pub new_speed_mps: Option<Real>,
    /// Speed by the fresh wheels, m/s ([`WheelSpeedVote`]).
    pub speed_mps: Option<Real>,
    /// Why that is not known although wheels are sampled: most of them slip, or all are stuck.
    pub wheel_speed_fault: Option<Rejection>,
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
    /// All axes of the IMU, and each drive unit by itself.
    pub channels: Channels,
}

/// What the merged signals of a [`Reading`] are made of, for estimators that gate each channel themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Channels {
    /// Specific force in IMU axes, m/s².
    pub specific_force_mps2: Option<[Real; 3]>,
    /// Angular rate in IMU axes, rad/s.
    pub angular_rate_radps: Option<[Real; 3]>,
    /// Whether the specific force, and the angular rate, is a new sample.
    pub new: [bool; 2],
    /// Wheel speed of each drive unit with a new sample, m/s.
    pub new_wheel_speed_mps: [Option<Real>; MAX_DRIVES],
    /// Motor torque of each drive unit, N·m.
    pub motor_torque_nm: [Option<Real>; MAX_DRIVES],
    /// Motor torque commanded of each drive unit, N·m.
    pub commanded_torque_nm: [Real; MAX_DRIVES],
}

/// Signal front end of one estimator: input check, one sample and hold per channel, wheel-speed vote, sum of torques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    drives: usize,
    vote: WheelSpeedVote,
    check: InputCheck,
    torque: [SampleHold; MAX_DRIVES],
    speed: [SampleHold; MAX_DRIVES],
    forward: SampleHold,
    left: SampleHold,
    up: SampleHold,
    roll_rate: SampleHold,
    pitch_rate: SampleHold,
    yaw_rate: SampleHold,
    steering: SampleHold,
}

impl FrontEnd {
    /// For a train of `vehicle.drives` drive units.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            drives: vehicle.drives.min(MAX_DRIVES),
            vote: WheelSpeedVote::new(vehicle.standstill_mps(None)),
            check: InputCheck::default(),
            torque: Default::default(),
            speed: Default::default(),
            forward: SampleHold::default(),
            left: SampleHold::default(),
            up: SampleHold::default(),
            roll_rate: SampleHold::default(),
            pitch_rate: SampleHold::default(),
            yaw_rate: SampleHold::default(),
            steering: SampleHold::default(),
        }
    }

    /// Checks one step's input and turns it into signals; on an error nothing is changed.
    pub fn read(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Reading, Error> {
        self.check.accept(z, u, dt)?;
        let now = z.t;
        let axis = |sample: Option<Sample<[Real; 3]>>, of: fn([Real; 3]) -> Real| {
            sample.map(|s| Sample {
                t: s.t,
                value: of(s.value),
            })
        };
        let (force, rate) = (z.specific_force_mps2, z.angular_rate_radps);
        let new_force = self.forward.take(axis(force, |[x, _, _]| x), now);
        self.left.take(axis(force, |[_, y, _]| y), now);
        self.up.take(axis(force, |[_, _, z]| z), now);
        let new_rate = self.pitch_rate.take(axis(rate, |[_, y, _]| -y), now);
        self.roll_rate.take(axis(rate, |[x, _, _]| x), now);
        self.yaw_rate.take(axis(rate, |[_, _, z]| z), now);
        self.steering.take(z.steering_angle_rad, now);
        for (held, sample) in self.torque.iter_mut().zip(z.motor_torque_nm) {
            held.take(sample, now);
        }
        let (mut new_speed, mut new_wheel_speed_mps) = (false, [None; MAX_DRIVES]);
        let wheels = self.speed.iter_mut().zip(z.wheel_speed_mps);
        for ((held, sample), new) in wheels.take(self.drives).zip(&mut new_wheel_speed_mps) {
            if held.take(sample, now) {
                new_speed = true;
                *new = held.fresh(now, dt);
            }
        }

        let motor_torque_nm = self.total_torque(now, dt);
        let vector = |axes: [&SampleHold; 3]| {
            let [x, y, z] = axes.map(|held| held.fresh(now, dt));
            Some([x?, y?, z?])
        };
        let wheels = self.speed.iter().take(self.drives);
        let speed_mps = self.vote.speed_mps(
            wheels.filter_map(|held| held.fresh(now, dt)),
            motor_torque_nm.unwrap_or(0.0),
        );
        Ok(Reading {
            new_speed_mps: speed_mps.filter(|_| new_speed),
            speed_mps,
            wheel_speed_fault: match speed_mps {
                Some(_) => None,
                None => self.wheel_speed_fault(now, dt),
            },
            motor_torque_nm,
            front_torque_nm: self.torque.first().and_then(|held| held.fresh(now, dt)),
            specific_force_mps2: self.forward.fresh(now, dt),
            lateral_force_mps2: self.left.fresh(now, dt),
            pitch_rate_radps: self.pitch_rate.fresh(now, dt),
            yaw_rate_radps: self.yaw_rate.fresh(now, dt),
            steering_angle_rad: self.steering.fresh(now, dt),
            brake: u.brake,
            channels: Channels {
                specific_force_mps2: vector([&self.forward, &self.left, &self.up]),
                angular_rate_radps: vector([&self.roll_rate, &self.pitch_rate, &self.yaw_rate])
                    .map(|[p, theta_dot, r]| [p, -theta_dot, r]),
                new: [new_force, new_rate],
                new_wheel_speed_mps,
                motor_torque_nm: self.torque.map(|held| held.fresh(now, dt)),
                commanded_torque_nm: u.motor_torque_nm,
            },
        })
    }

    /// Why fresh or stuck wheels give no speed; `None` if all are stale.
    fn wheel_speed_fault(&self, now: Time, dt: Real) -> Option<Rejection> {
        let wheels = || self.speed.iter().take(self.drives);
        if wheels().any(|held| held.fresh(now, dt).is_some()) {
            Some(Rejection::Slip)
        } else if wheels().any(|held| held.is_stuck(now)) {
            Some(Rejection::Stuck)
        } else {
            None
        }
    }

    /// Sum of the torques, N·m; while at least half of the drive units are fresh they stand for the others too (equal shares).
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
}

state!(FrontEnd { check, torque, speed, forward, left, up, roll_rate, pitch_rate, yaw_rate, steering; drives, vote });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;

    #[test]
    fn a_channel_without_samples_is_held_for_three_periods_only() {
        let mut front = FrontEnd::new(&vehicle());
        let u = Command::default();
        for k in 1..=10 {
            let t = Time::from_s(0.05 * f64::from(k));
            let mut z = Measurements::at(t);
            z.wheel_speed_mps[0] = Some(Sample { t, value: 1.0 });
            front.read(&z, &u, 0.05).unwrap();
        }
        let nothing = |t_s| Measurements::at(Time::from_s(t_s));
        let reading = front.read(&nothing(0.6), &u, 0.05).unwrap();
        assert_eq!(
            (reading.speed_mps, reading.new_speed_mps),
            (Some(1.0), None)
        );
        let reading = front.read(&nothing(0.66), &u, 0.05).unwrap();
        assert_eq!(reading.speed_mps, None);
    }

    #[test]
    fn missing_torques_are_made_up_from_the_others_down_to_half() {
        let u = Command::default();
        let read = |count: usize| {
            let mut z = Measurements {
                t: Time::from_s(1.0),
                ..Default::default()
            };
            for place in z.motor_torque_nm.iter_mut().take(count) {
                *place = Some(Sample {
                    t: Time::from_s(1.0),
                    value: 100.0,
                });
            }
            FrontEnd::new(&vehicle())
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
    fn a_grade_that_grows_is_a_positive_pitch_rate() {
        let z = Measurements {
            t: Time::from_s(1.0),
            angular_rate_radps: Some(Sample {
                t: Time::from_s(1.0),
                value: [0.0, -0.1, 0.0],
            }),
            ..Default::default()
        };
        let reading = FrontEnd::new(&vehicle())
            .read(&z, &Command::default(), 0.01)
            .unwrap();
        assert_eq!(reading.pitch_rate_radps, Some(0.1));
    }
}
