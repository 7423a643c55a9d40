//! Signal front end: from the samples of one step to the signals that pipelines work with.

use crate::api::aid::Rejection;
use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};
use crate::api::snapshot::{Archive, State, visit_built};
use crate::preprocess::conditioning::{Conditioning, ConditioningParams, LearntNoise};
use crate::preprocess::input_check::InputCheck;
use crate::preprocess::sample_hold::{SampleHold, VectorHold};
use crate::preprocess::wheel_speed_vote::WheelSpeedVote;
use crate::{Error, Real, Time};

/// The signals of one step; `None` = not known now (stale, stuck, or never sampled).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Speed by the wheels, m/s, if at least one drive unit sent a new sample.
    pub new_speed_mps: Option<Real>,
    /// Speed by the fresh wheels, m/s ([`WheelSpeedVote`]).
    pub speed_mps: Option<Real>,
    /// Why there is none, or no new one, although wheels are sampled: most of them slip, all are stuck, or the sample was held out as an
    /// outlier (the speed is then the last one).
    pub wheel_speed_fault: Option<Rejection>,
    /// Sum of all motor torques, N·m.
    pub motor_torque_nm: Option<Real>,
    /// Torque of drive 0, N·m: on a road vehicle that of the front, steered axle.
    pub front_torque_nm: Option<Real>,
    /// Specific force along the train, m/s².
    pub specific_force_mps2: Option<Real>,
    /// Specific force to the left, m/s².
    pub lateral_force_mps2: Option<Real>,
    /// Specific force upwards, m/s²: g at rest on the level.
    pub vertical_force_mps2: Option<Real>,
    /// Rate of the pitch angle, rad/s, + when the grade grows.
    pub pitch_rate_radps: Option<Real>,
    /// Rate about the vertical axis, rad/s, + to the left.
    pub yaw_rate_radps: Option<Real>,
    /// Standard deviation of the gyro's biases that are left, rad/s; 0 without conditioning.
    pub gyro_bias_sd_radps: Real,
    /// Noise learnt from the samples.
    pub noise: LearntNoise,
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

/// Signal front end of one estimator: input check, one sample and hold per channel, wheel-speed vote, sum of torques; of a robust one
/// conditioning of the channels too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    drives: usize,
    standstill_mps: Real,
    conditioning: Option<Conditioning>,
    /// Instant of the last speed, and whether the vehicle stood by it.
    sampled: Option<Time>,
    standing: bool,
    vote: WheelSpeedVote,
    check: InputCheck,
    torque: [SampleHold; MAX_DRIVES],
    speed: [SampleHold; MAX_DRIVES],
    /// Specific force forward, to the left and upwards.
    force: VectorHold,
    /// Rates of roll, pitch and yaw.
    rate: VectorHold,
    steering: SampleHold,
}

impl FrontEnd {
    /// For a train of `vehicle.drives` drive units.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            drives: vehicle.drives.min(MAX_DRIVES),
            standstill_mps: vehicle.standstill_mps(None),
            conditioning: None,
            sampled: None,
            standing: false,
            vote: WheelSpeedVote::new(vehicle.standstill_mps(None)),
            check: InputCheck::default(),
            torque: Default::default(),
            speed: Default::default(),
            force: VectorHold::default(),
            rate: VectorHold::default(),
            steering: SampleHold::default(),
        }
    }

    /// The same with conditioning of the channels.
    pub fn conditioned(vehicle: &Vehicle, params: ConditioningParams) -> Self {
        Self {
            conditioning: Some(Conditioning::new(vehicle, params)),
            ..Self::new(vehicle)
        }
    }

    /// Checks one step's input and turns it into signals; on an error nothing is changed.
    pub fn read(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Reading, Error> {
        self.check(z, u, dt)?;
        Ok(self.take(z, u, dt))
    }

    /// Checks one step's input and notes its instant; on an error nothing is changed.
    pub fn check(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<(), Error> {
        self.check.accept(z, u, dt)
    }

    /// Turns one step's input, which must have been checked, into signals.
    pub fn take(&mut self, z: &Measurements, u: &Command, dt: Real) -> Reading {
        let now = z.t;
        let mut reading = Reading {
            brake: u.brake,
            ..Reading::default()
        };
        reading.channels.commanded_torque_nm = u.motor_torque_nm;
        reading.channels.new = self.take_imu(z);
        self.condition_imu(reading.channels.new, dt);
        self.steering.take(z.steering_angle_rad, now);
        let new_speed = self.take_drives(z, dt, &mut reading.channels);

        reading.motor_torque_nm = self.total_torque(&reading.channels.motor_torque_nm);
        [reading.front_torque_nm, ..] = reading.channels.motor_torque_nm;
        reading.steering_angle_rad = self.steering.fresh(now, dt);
        self.read_imu(now, dt, &mut reading);
        self.read_speed(new_speed, now, dt, &mut reading);
        reading
    }

    /// Takes the samples of the IMU; whether specific force and angular rate are new.
    fn take_imu(&mut self, z: &Measurements) -> [bool; 2] {
        // A grade that grows is a rate about the left axis that is negative, and a pitch rate that is positive.
        let rate = z.angular_rate_radps.map(
            |Sample {
                 t,
                 value: [x, y, z],
             }| Sample {
                t,
                value: [x, -y, z],
            },
        );
        let new_force = self.force.take(z.specific_force_mps2, z.t);
        [new_force, self.rate.take(rate, z.t)]
    }

    /// Takes the samples of the drive units, and reads their torques; whether a wheel speed is new.
    fn take_drives(&mut self, z: &Measurements, dt: Real, channels: &mut Channels) -> bool {
        let (now, drives) = (z.t, self.drives);
        let torques = self.torque.iter_mut().zip(&z.motor_torque_nm).take(drives);
        for ((held, sample), fresh) in torques.zip(&mut channels.motor_torque_nm) {
            held.take(*sample, now);
            *fresh = held.fresh(now, dt);
        }
        let mut new_speed = false;
        let wheels = self.speed.iter_mut().zip(&z.wheel_speed_mps).take(drives);
        for ((held, sample), new) in wheels.zip(&mut channels.new_wheel_speed_mps) {
            if held.take(*sample, now) {
                new_speed = true;
                *new = held.fresh(now, dt);
            }
        }
        new_speed
    }

    /// What the IMU reads, less the biases learnt.
    fn read_imu(&self, now: Time, dt: Real, reading: &mut Reading) {
        let (force, rate) = (self.force.fresh(now, dt), self.rate.fresh(now, dt));
        let vector = |[x, y, z]: [Option<Real>; 3]| Some([x?, y?, z?]);
        let channels = &mut reading.channels;
        channels.specific_force_mps2 = vector(force);
        channels.angular_rate_radps = vector(rate).map(|[p, theta_dot, r]| [p, -theta_dot, r]);
        [
            reading.specific_force_mps2,
            reading.lateral_force_mps2,
            reading.vertical_force_mps2,
        ] = force;
        let [_, pitch_rate, yaw_rate] = rate;
        let conditioning = self.conditioning.as_ref();
        let biases = conditioning.map(Conditioning::gyro_bias_radps);
        let [pitch_bias, yaw_bias] = biases.unwrap_or_default();
        reading.pitch_rate_radps = pitch_rate.map(|w| w - pitch_bias);
        reading.yaw_rate_radps = yaw_rate.map(|w| w - yaw_bias);
        reading.gyro_bias_sd_radps = conditioning.map_or(0.0, Conditioning::gyro_bias_sd_radps);
    }

    /// The speed by the fresh wheels, or why there is none; the noise learnt.
    fn read_speed(&mut self, new: bool, now: Time, dt: Real, reading: &mut Reading) {
        let wheels = self.speed.iter().take(self.drives);
        let mut fresh = wheels.filter_map(|held| held.fresh(now, dt)).peekable();
        let any = fresh.peek().is_some();
        let torque_nm = reading.motor_torque_nm.unwrap_or(0.0);
        let voted = self.vote.speed_mps(fresh, torque_nm);
        let (new_speed_mps, speed_mps, held_out) = self.condition_speed(voted, new, now);
        reading.new_speed_mps = new_speed_mps;
        reading.speed_mps = speed_mps;
        reading.wheel_speed_fault = match speed_mps {
            Some(_) => held_out.then_some(Rejection::Gate),
            None => self.wheel_speed_fault(any, now),
        };
        let conditioning = self.conditioning.as_ref();
        reading.noise = conditioning.map_or(LearntNoise::default(), Conditioning::learnt_noise);
    }

    /// Learns noise and gyro biases from new samples of the IMU.
    fn condition_imu(&mut self, [new_force, new_rate]: [bool; 2], dt: Real) {
        let Some(conditioning) = &mut self.conditioning else {
            return;
        };
        if let Some([force, ..]) = self.force.value().filter(|_| new_force) {
            let period_s = self.force.waited_s().max(dt);
            conditioning.force(force, period_s, self.standing);
        }
        let rates = self.rate.value().map(|[_, pitch, yaw]| [pitch, yaw]);
        let period_s = self.rate.gap_s().max(dt);
        conditioning.calibrate(self.standing, rates.filter(|_| new_rate), period_s, dt);
    }

    /// The speed that the wheels vote for, conditioned: a new one, the one to go on with, and whether a new one was held out.
    fn condition_speed(
        &mut self,
        voted: Option<Real>,
        new: bool,
        now: Time,
    ) -> (Option<Real>, Option<Real>, bool) {
        let fresh = voted.filter(|_| new);
        let Some(conditioning) = &mut self.conditioning else {
            return (fresh, voted, false);
        };
        let Some(speed) = fresh else {
            if voted.is_none() {
                self.standing = false;
            }
            let last = conditioning.last_speed();
            return (None, voted.map(|voted| last.unwrap_or(voted)), false);
        };
        let period_s = self
            .sampled
            .map_or(0.0, |before| now.since(before))
            .max(0.0);
        self.sampled = Some(now);
        match conditioning.speed(speed, period_s, self.standing) {
            Some(speed) => {
                self.standing = speed.abs() < self.standstill_mps;
                (Some(speed), Some(speed), false)
            }
            None => (None, conditioning.last_speed(), true),
        }
    }

    /// Why fresh or stuck wheels give no speed; `None` if all are stale.
    fn wheel_speed_fault(&self, any_fresh: bool, now: Time) -> Option<Rejection> {
        let mut wheels = self.speed.iter().take(self.drives);
        if any_fresh {
            Some(Rejection::Slip)
        } else if wheels.any(|held| held.is_stuck(now)) {
            Some(Rejection::Stuck)
        } else {
            None
        }
    }

    /// Sum of the torques, N·m; while at least half of the drive units are fresh they stand for the others too (equal shares).
    fn total_torque(&self, fresh_nm: &[Option<Real>]) -> Option<Real> {
        let fresh = || fresh_nm.iter().take(self.drives).flatten();
        let count = fresh().count();
        (count > 0 && 2 * count >= self.drives)
            .then(|| fresh().sum::<Real>() * self.drives as Real / count as Real)
    }
}

impl State for FrontEnd {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            drives: _,
            standstill_mps: _,
            vote: _,
            conditioning,
            sampled,
            standing,
            check,
            torque,
            speed,
            force,
            rate,
            steering,
        } = self;
        visit_built(conditioning, archive);
        sampled.visit(archive);
        standing.visit(archive);
        check.visit(archive);
        torque.visit(archive);
        speed.visit(archive);
        force.visit(archive);
        rate.visit(archive);
        steering.visit(archive);
    }
}

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

    /// Speeds of eight wheels over 10 s, then one second of `faulty` ones; what is known at the end.
    fn after(faulty: impl Fn(usize, Real) -> Option<Real>) -> Reading {
        let mut front = FrontEnd::new(&vehicle());
        let mut random = crate::testing::Random::new(91);
        let mut last = Reading::default();
        for k in 1..=1_100 {
            let t = Time::from_ns(10_000_000 * k);
            let mut z = Measurements::at(t);
            for (i, place) in z.wheel_speed_mps.iter_mut().enumerate() {
                let noisy = 1.0 + 0.005 * random.normal();
                let value = if k > 1_000 {
                    faulty(i, noisy)
                } else {
                    Some(noisy)
                };
                *place = value.map(|value| Sample { t, value });
            }
            last = front.read(&z, &Command::default(), 0.01).unwrap();
        }
        last
    }

    #[test]
    fn why_the_speed_is_not_known() {
        let fine = after(|_, noisy| Some(noisy));
        assert!(fine.speed_mps.is_some() && fine.wheel_speed_fault.is_none());
        let fault = |reading: Reading| (reading.speed_mps, reading.wheel_speed_fault);
        let slips = after(|i, noisy| Some(noisy + if i < 6 { 0.3 * (i + 1) as Real } else { 0.0 }));
        assert_eq!(fault(slips), (None, Some(Rejection::Slip)));
        let stuck = after(|_, _| Some(1.0));
        assert_eq!(fault(stuck), (None, Some(Rejection::Stuck)));
        let stale = after(|_, _| None);
        assert_eq!(fault(stale), (None, None));
    }
}
