//! Signal front end: from the samples of one step to the signals that pipelines work with.

use crate::api::aid::Rejection;
use crate::api::reading::{LearntNoise, Reading};
use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};
use crate::api::snapshot::{Archive, State, visit_built};
use crate::preprocess::conditioning::{Conditioning, ConditioningParams};
use crate::preprocess::drive_hold::{DriveHold, UnitMask};
use crate::preprocess::input_check::{InputCheck, Stamps, newest};
use crate::preprocess::sample_hold::{SampleHold, VectorHold};
use crate::preprocess::wheel_speed_vote::WheelSpeedVote;
use crate::{Error, Real, Time};

/// Signal front end of one estimator: input check, one sample and hold per channel, wheel-speed vote, sum of torques;
/// of a robust one conditioning of the channels too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    drives: usize,
    standstill_mps: Real,
    vote: WheelSpeedVote,
    own: Own,
    torque: DriveHold,
    speed: DriveHold,
    output: Output,
}

/// State that every step changes: all but the channels of the drive units.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Own {
    conditioning: Option<Conditioning>,
    /// Instant of the last speed, and whether the vehicle stood by it.
    sampled: Option<Time>,
    standing: bool,
    check: InputCheck,
    /// Instant of the last step.
    now: Option<Time>,
    /// Specific force forward, to the left and upwards.
    force: VectorHold,
    /// Rates of roll, pitch and yaw.
    rate: VectorHold,
    steering: SampleHold,
}

/// The signals of the last step, of which only what has changed is written anew.
#[derive(Clone, Copy, Debug, Default)]
struct Output {
    reading: Reading,
    /// Speed that the wheels vote for.
    voted_mps: Option<Real>,
    /// Drive units whose torque, and whose wheel speed, they are made of; `None` if all is to be written anew.
    fresh: Option<[UnitMask; 2]>,
    /// True if a wheel speed was new.
    new_speed: bool,
}

/// Equal in all it holds. One that the next step writes anew (`fresh` is `None`: at the start and after a snapshot)
/// follows from the channels, which are compared by themselves.
impl PartialEq for Output {
    fn eq(&self, other: &Self) -> bool {
        let Self {
            reading,
            voted_mps,
            fresh,
            new_speed,
        } = other;
        let anew = self.fresh.is_none() || fresh.is_none();
        anew || (self.reading == *reading
            && self.voted_mps == *voted_mps
            && self.fresh == *fresh
            && self.new_speed == *new_speed)
    }
}

impl FrontEnd {
    /// Builds the front end for a train of `vehicle.drives` drive units.
    pub fn new(vehicle: &Vehicle) -> Self {
        let drives = vehicle.drives.min(MAX_DRIVES);
        Self {
            drives,
            standstill_mps: vehicle.standstill_mps(None),
            vote: WheelSpeedVote::new(vehicle.standstill_mps(None)),
            own: Own {
                conditioning: None,
                sampled: None,
                standing: false,
                check: InputCheck::default(),
                force: VectorHold::default(),
                rate: VectorHold::default(),
                steering: SampleHold::default(),
                now: None,
            },
            torque: DriveHold::new(drives),
            speed: DriveHold::new(drives),
            output: Output::default(),
        }
    }

    /// The same with conditioning of the channels.
    pub fn conditioned(vehicle: &Vehicle, params: ConditioningParams) -> Self {
        let mut front_end = Self::new(vehicle);
        front_end.own.conditioning = Some(Conditioning::new(vehicle, params));
        front_end
    }

    /// Checks one step's input and turns it into signals; on an error nothing is changed.
    #[inline]
    pub fn read(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<&Reading, Error> {
        let came = self.own.check.accept(z, u, dt, self.drives)?;
        let now = z.t;
        let before_s = self
            .own
            .now
            .replace(now)
            .map_or(0.0, |last| now.since(last));
        self.output.reading.channels.since_s = before_s;
        let new = self.take_imu(z);
        let [new_force, _] = new;
        self.condition_imu(new_force, dt);
        self.own.steering.take(z.steering_angle_rad, now);
        let new_speed = self.take_drives(z, dt, came);
        self.read_imu(now, dt);
        self.read_speed(new_speed, now);

        let reading = &mut self.output.reading;
        reading.brake = u.brake;
        reading.channels.commanded_torque_nm = u.motor_torque_nm;
        reading.channels.new = new;
        reading.steering_angle_rad = self.own.steering.fresh(now, dt);
        Ok(&self.output.reading)
    }

    /// Takes the samples of the IMU; whether specific force and angular rate are new.
    #[inline]
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
        let new_force = self.own.force.take(z.specific_force_mps2, z.t);
        if let Some(sample) = z.specific_force_mps2 {
            let [_, force, _] = &mut self.output.reading.channels.age_s;
            *force = z.t.since(sample.t);
        }
        [new_force, self.own.rate.take(rate, z.t)]
    }

    /// Takes the samples of the drive units, and reads them; whether a wheel speed is new.
    #[inline]
    fn take_drives(
        &mut self,
        z: &Measurements,
        dt: Real,
        [torques, speeds]: [[Stamps; 2]; 2],
    ) -> bool {
        let now = z.t;
        if let Some(stamp) = newest(&z.motor_torque_nm, torques) {
            let [torque, ..] = &mut self.output.reading.channels.age_s;
            *torque = now.since(stamp);
        }
        if let Some(stamp) = newest(&z.wheel_speed_mps, speeds) {
            let [.., wheels] = &mut self.output.reading.channels.age_s;
            *wheels = now.since(stamp);
        }
        let ([torques, _], [speeds, _]) = (torques, speeds);
        let new_torque = self.torque.take(&z.motor_torque_nm, torques, now);
        let new_speed = self.speed.take(&z.wheel_speed_mps, speeds, now);
        let fresh = [self.torque.fresh(now, dt), self.speed.fresh(now, dt)];
        let same = self.output.fresh == Some(fresh);
        if !same || (new_torque | new_speed) != 0 {
            self.read_drives(fresh);
        }
        let [_, fresh_speed] = fresh;
        let new = &mut self.output.reading.channels.new_wheel_speed_mps;
        if new_speed != 0 {
            self.speed.write(new_speed & fresh_speed, new);
        } else if !same || self.output.new_speed {
            *new = [None; MAX_DRIVES];
        }
        self.output.new_speed = new_speed != 0;
        self.output.new_speed
    }

    /// Reads the drive units: torque of each, sum of the torques, speed by the wheels.
    fn read_drives(&mut self, fresh: [UnitMask; 2]) {
        let [torque, speed] = fresh;
        let torque_nm = self.total_torque(torque);
        let sense = torque_nm.unwrap_or(0.0);
        self.output.fresh = Some(fresh);
        self.output.voted_mps = match self.speed.whole(speed) {
            Some(wheels) => self.vote.speed_mps(wheels.iter().copied(), sense),
            None => self.vote.speed_mps(self.speed.values(speed), sense),
        };
        let reading = &mut self.output.reading;
        let each = &mut reading.channels.motor_torque_nm;
        self.torque.write(torque, each);
        [reading.front_torque_nm, ..] = *each;
        reading.motor_torque_nm = torque_nm;
    }

    /// Reads the IMU.
    #[inline]
    fn read_imu(&mut self, now: Time, dt: Real) {
        let reading = &mut self.output.reading;
        let (force, rate) = (self.own.force.fresh(now, dt), self.own.rate.fresh(now, dt));
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
        (reading.pitch_rate_radps, reading.yaw_rate_radps) = (pitch_rate, yaw_rate);
    }

    /// The speed by the fresh wheels, or why there is none; the noise learnt.
    #[inline]
    fn read_speed(&mut self, new: bool, now: Time) {
        let voted = self.output.voted_mps;
        let (new_speed_mps, speed_mps, held_out) = self.condition_speed(voted, new, now);
        let wheel_speed_fault = match speed_mps {
            Some(_) => held_out.then_some(Rejection::Gate),
            None => self.wheel_speed_fault(now),
        };
        let reading = &mut self.output.reading;
        reading.new_speed_mps = new_speed_mps;
        reading.speed_mps = speed_mps;
        reading.wheel_speed_fault = wheel_speed_fault;
        reading.channels.wheels_stuck = wheel_speed_fault == Some(Rejection::Stuck);
        let conditioning = self.own.conditioning.as_ref();
        reading.noise = conditioning.map_or(LearntNoise::default(), Conditioning::learnt_noise);
    }

    /// Learns the noise from a new sample of the accelerometer.
    #[inline]
    fn condition_imu(&mut self, new_force: bool, dt: Real) {
        let Some(conditioning) = &mut self.own.conditioning else {
            return;
        };
        if let Some([force, ..]) = self.own.force.value().filter(|_| new_force) {
            let period_s = self.own.force.waited_s().max(dt);
            conditioning.force(force, period_s, self.own.standing);
        }
    }

    /// The speed that the wheels vote for, conditioned: a new one, the one to go on with, and whether a new one was
    /// held out.
    #[inline]
    fn condition_speed(
        &mut self,
        voted: Option<Real>,
        new: bool,
        now: Time,
    ) -> (Option<Real>, Option<Real>, bool) {
        let fresh = voted.filter(|_| new);
        let Some(conditioning) = &mut self.own.conditioning else {
            return (fresh, voted, false);
        };
        let Some(speed) = fresh else {
            if voted.is_none() {
                self.own.standing = false;
            }
            let last = conditioning.last_speed();
            return (None, voted.map(|voted| last.unwrap_or(voted)), false);
        };
        let period_s = self
            .own
            .sampled
            .map_or(0.0, |before| now.since(before))
            .max(0.0);
        self.own.sampled = Some(now);
        match conditioning.speed(speed, period_s, self.own.standing) {
            Some(speed) => {
                self.own.standing = speed.abs() < self.standstill_mps;
                (Some(speed), Some(speed), false)
            }
            None => (None, conditioning.last_speed(), true),
        }
    }

    /// Why fresh or stuck wheels give no speed; `None` if all are stale.
    fn wheel_speed_fault(&self, now: Time) -> Option<Rejection> {
        if self.output.fresh.is_some_and(|[_, speed]| speed != 0) {
            Some(Rejection::Slip)
        } else if self.speed.stuck(now) != 0 {
            Some(Rejection::Stuck)
        } else {
            None
        }
    }

    /// Sum of the torques, N·m; while at least half of the drive units are fresh they stand for the others too (equal
    /// shares).
    fn total_torque(&self, fresh: UnitMask) -> Option<Real> {
        let sum = match self.torque.whole(fresh) {
            Some(torques) => torques.iter().sum::<Real>(),
            None => self.torque.values(fresh).sum(),
        };
        let count = fresh.count_ones() as usize;
        (count > 0 && 2 * count >= self.drives).then(|| sum * self.drives as Real / count as Real)
    }
}

impl State for FrontEnd {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            drives: _,
            standstill_mps: _,
            vote: _,
            own,
            torque,
            speed,
            output,
        } = self;
        visit_built(&mut own.conditioning, archive);
        own.sampled.visit(archive);
        own.standing.visit(archive);
        own.now.visit(archive);
        own.check.visit(archive);
        torque.visit(archive);
        speed.visit(archive);
        own.force.visit(archive);
        own.rate.visit(archive);
        own.steering.visit(archive);
        *output = Output::default();
    }
}

/// Share of the clamp brake above which the force balance is not used: the brake force is not measured.
pub const BRAKE_RELEASED: Real = 0.001;

/// True if the train moves, and if it does so under the force balance alone (brake released).
pub fn motion(reading: &Reading, standstill_mps: Real) -> (bool, bool) {
    let moving = reading.speed_mps.is_some_and(|v| v.abs() > standstill_mps);
    (moving, moving && reading.brake <= BRAKE_RELEASED)
}

#[cfg(test)]
#[path = "front_end_tests.rs"]
mod tests;
