//! Signal front end: from the samples of one step to the signals that pipelines work with.

use crate::api::aid::Rejection;
use crate::api::reading::{Channels, LearntNoise, Reading};
use crate::api::signals::{Command, MAX_DRIVES, Measurements, Sample, Vehicle};
use crate::api::snapshot::{Archive, State, visit_built};
use crate::preprocess::conditioning::{Conditioning, ConditioningParams};
use crate::preprocess::input_check::InputCheck;
use crate::preprocess::sample_hold::SampleHold;
use crate::preprocess::wheel_speed_vote::WheelSpeedVote;
use crate::{Error, Real, Time};

/// Signal front end of one estimator: input check, one sample and hold per channel, wheel-speed vote, sum of torques;
/// of a robust one conditioning of the channels too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontEnd {
    drives: usize,
    standstill_mps: Real,
    vote: WheelSpeedVote,
    conditioning: Option<Conditioning>,
    /// Instant of the last speed, and true if the vehicle stood by this speed.
    sampled: Option<Time>,
    standing: bool,
    check: InputCheck,
    /// Instant of the last step.
    now: Option<Time>,
    torque: [SampleHold<1>; MAX_DRIVES],
    speed: [SampleHold<1>; MAX_DRIVES],
    /// Specific force forward, to the left and upwards.
    force: SampleHold<3>,
    /// Rates of roll, pitch and yaw.
    rate: SampleHold<3>,
    steering: SampleHold<1>,
    /// Age of the newest torque, specific force and wheel speed when they came, by their stamps, s.
    age_s: [Real; 3],
}

impl FrontEnd {
    /// Builds the front end for a train of `vehicle.drives` drive units.
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            drives: vehicle.drives.min(MAX_DRIVES),
            standstill_mps: vehicle.standstill_mps(None),
            vote: WheelSpeedVote::new(vehicle.standstill_mps(None)),
            conditioning: None,
            sampled: None,
            standing: false,
            check: InputCheck::default(),
            now: None,
            torque: Default::default(),
            speed: Default::default(),
            force: SampleHold::default(),
            rate: SampleHold::default(),
            steering: SampleHold::default(),
            age_s: [0.0; 3],
        }
    }

    /// The same with conditioning of the channels.
    pub fn conditioned(vehicle: &Vehicle, params: ConditioningParams) -> Self {
        let mut front_end = Self::new(vehicle);
        front_end.conditioning = Some(Conditioning::new(vehicle, params));
        front_end
    }

    /// Checks one step's input and turns it into signals; on an error nothing is changed.
    #[inline]
    pub fn read(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Reading, Error> {
        self.check.accept(z, u, dt)?;
        let now = z.t;
        let since_s = self.now.replace(now).map_or(0.0, |last| now.since(last));
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
        let new_force = self.force.take(z.specific_force_mps2, now);
        let new_rate = self.rate.take(rate, now);
        self.steering.take(one(z.steering_angle_rad), now);
        self.condition_imu(new_force, dt);
        let drives = self.drives;
        take_each(&mut self.torque, &z.motor_torque_nm, drives, now);
        let new_speed = take_each(&mut self.speed, &z.wheel_speed_mps, drives, now);
        let newest = |samples: &[Option<Sample<Real>>]| samples.iter().flatten().map(|s| s.t).max();
        let stamps = [
            newest(&z.motor_torque_nm),
            z.specific_force_mps2.map(|s| s.t),
            newest(&z.wheel_speed_mps),
        ];
        for (age_s, stamp) in self.age_s.iter_mut().zip(stamps) {
            *age_s = stamp.map_or(*age_s, |stamp| now.since(stamp));
        }

        let torques = self.torque.each_ref().map(|held| held.fresh(now, dt)[0]);
        let speeds = self.speed.each_ref().map(|held| held.fresh(now, dt)[0]);
        let motor_torque_nm = self.total_torque(&torques);
        let sense = motor_torque_nm.unwrap_or(0.0);
        let voted = self.vote.speed_mps(speeds.iter().flatten().copied(), sense);
        let is_new = new_speed.contains(&true);
        let (new_speed_mps, speed_mps, held_out) = self.condition_speed(voted, is_new, now);
        let wheel_speed_fault = match speed_mps {
            Some(_) => held_out.then_some(Rejection::Gate),
            None if speeds.iter().any(Option::is_some) => Some(Rejection::Slip),
            None if self.speed.iter().any(|held| held.is_stuck(now)) => Some(Rejection::Stuck),
            None => None,
        };

        let (force, rate) = (self.force.fresh(now, dt), self.rate.fresh(now, dt));
        let vector = |[x, y, z]: [Option<Real>; 3]| Some([x?, y?, z?]);
        let mut new_wheel_speed_mps = speeds;
        for (speed, new) in new_wheel_speed_mps.iter_mut().zip(new_speed) {
            *speed = speed.filter(|_| new);
        }
        let conditioning = self.conditioning.as_ref();
        Ok(Reading {
            motor_torque_nm,
            front_torque_nm: torques[0],
            speed_mps,
            new_speed_mps,
            wheel_speed_fault,
            specific_force_mps2: force[0],
            lateral_force_mps2: force[1],
            vertical_force_mps2: force[2],
            pitch_rate_radps: rate[1],
            yaw_rate_radps: rate[2],
            steering_angle_rad: self.steering.fresh(now, dt)[0],
            brake: u.brake,
            noise: conditioning.map_or(LearntNoise::default(), Conditioning::learnt_noise),
            channels: Channels {
                specific_force_mps2: vector(force),
                angular_rate_radps: vector(rate).map(|[p, theta_dot, r]| [p, -theta_dot, r]),
                new: [new_force, new_rate],
                new_wheel_speed_mps,
                wheels_stuck: wheel_speed_fault == Some(Rejection::Stuck),
                motor_torque_nm: torques,
                commanded_torque_nm: u.motor_torque_nm,
                age_s: self.age_s,
                since_s,
            },
        })
    }

    /// Learns the noise from a new sample of the accelerometer.
    #[inline]
    fn condition_imu(&mut self, new_force: bool, dt: Real) {
        let Some(conditioning) = &mut self.conditioning else {
            return;
        };
        if let Some([force, ..]) = self.force.value().filter(|_| new_force) {
            let period_s = self.force.waited_s().max(dt);
            conditioning.force(force, period_s, self.standing);
        }
    }

    /// Conditioned speed by the vote of the wheels: a new one, the one to go on with, and whether a new one was held
    /// out.
    #[inline]
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

    /// Sum of the torques, N·m; while at least half of the drive units are fresh, they represent the others too (equal
    /// shares).
    fn total_torque(&self, torques: &[Option<Real>]) -> Option<Real> {
        let sum = torques.iter().flatten().sum::<Real>();
        let count = torques.iter().flatten().count();
        (count > 0 && 2 * count >= self.drives).then(|| sum * self.drives as Real / count as Real)
    }
}

/// Holds the new samples of the first `drives` units; returns the units with an accepted sample.
#[inline]
fn take_each(
    held: &mut [SampleHold<1>; MAX_DRIVES],
    samples: &[Option<Sample<Real>>; MAX_DRIVES],
    drives: usize,
    now: Time,
) -> [bool; MAX_DRIVES] {
    let mut taken = [false; MAX_DRIVES];
    let units = taken.iter_mut().zip(held).zip(samples);
    for ((taken, held), sample) in units.take(drives) {
        *taken = held.take(one(*sample), now);
    }
    taken
}

fn one(sample: Option<Sample<Real>>) -> Option<Sample<[Real; 1]>> {
    sample.map(|Sample { t, value }| Sample { t, value: [value] })
}

impl State for FrontEnd {
    fn visit(&mut self, archive: &mut Archive) {
        visit_built(&mut self.conditioning, archive);
        self.sampled.visit(archive);
        self.standing.visit(archive);
        self.now.visit(archive);
        self.check.visit(archive);
        self.torque.visit(archive);
        self.speed.visit(archive);
        self.force.visit(archive);
        self.rate.visit(archive);
        self.steering.visit(archive);
        self.age_s.visit(archive);
    }
}

/// Share of the clamp brake above which the force balance is not used: the brake force is not measured.
pub const BRAKE_RELEASED: Real = 0.001;

/// Two flags: the train moves; the train moves under the force balance alone (brake released).
pub fn motion(reading: &Reading, standstill_mps: Real) -> (bool, bool) {
    let moving = reading.speed_mps.is_some_and(|v| v.abs() > standstill_mps);
    (moving, moving && reading.brake <= BRAKE_RELEASED)
}

#[cfg(test)]
#[path = "front_end_tests.rs"]
mod tests;
