//! Attitude and speed of the body that carries the IMU, from gyro, accelerometer and wheels: an extended Kalman filter
//! with biases.
//!
//! The gyro is the input of the attitude, the accelerometer that of the speed ([`AttitudeModel`]); wheels, f_y, f_z and
//! a standstill are the measurements ([`crate::aiding`]).
//!
//! It uses no force: no fault of torque, load or running resistance can reach the slope. The length of the specific
//! force, |f| = g, makes the accelerometer's bias observable: on a slope f_z = g cos θ + b_z measures θ without the
//! integral of the gyro, once b_z is known from the level, and with θ f_x = v̇ + g sin θ + b_x measures b_x. Source:
//! ours; the filter is that of Schmidt 1970 (extended), the gates those of common practice (Bar-Shalom, Li &
//! Kirubarajan 2001, 5.4).

pub mod arm_error;
pub mod calibration;
pub mod heading;
pub mod imu_health;
pub mod params;
pub mod rail_curvature;
pub mod separation;
pub mod standing_bias;
pub mod start;
pub mod survey;
mod wheels_ahead;

use nalgebra::SVector;

use crate::Real;
use crate::aiding::force_window::{ForceNoise, ForceWindow};
use crate::aiding::standstill::Standstill;
use crate::aiding::vertical::Vertical;
use crate::aiding::wheels::{Ballot, WheelGate};
use crate::aiding::{GateRule, fuse};
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::reading::Channels;
use crate::api::real::{GRAVITY, sqrt, within};
use crate::api::signals::Vehicle;
use crate::api::snapshot::state;
use crate::detect::control::Control;
use crate::detect::validity::Integrity;
use crate::filters::gaussian::Gaussian;
use crate::models::attitude::{
    Angles, AttitudeInput, AttitudeModel, AttitudeRates, BIAS_X, GYRO_Y, GYRO_Z, KAPPA, Lever, N,
    PHI, SCALE, THETA, V,
};
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::tuning::{ATTITUDE, RAIL, SOURCE, STANDSTILL, STATISTICS, TIMES};
use arm_error::ArmError;
use calibration::Calibration;
use heading::{Heading, HeadingInput};
use imu_health::{ImuHealth, SoundImu};
use params::{AttitudeParams, AttitudeSupervision};
use rail_curvature::RailCurvature;
use separation::{Compared, Separation};
use standing_bias::StandingBias;
use start::first_belief;
use wheels_ahead::WheelsAhead;

/// Attitude and speed of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attitude {
    /// Speed of the unit's middle along the rail, m/s.
    pub speed_mps: Real,
    /// Standard deviation of the speed, m/s.
    pub speed_sd_mps: Real,
    /// Standard deviation of the speed without the scale of the wheels, which differences do not show, m/s.
    pub speed_noise_mps: Real,
    /// Acceleration along the body, m/s²; 0 without an accelerometer.
    pub acceleration_mps2: Real,
    /// Pitch of the body, rad.
    pub pitch_rad: Real,
    /// Standard deviation of the pitch, rad.
    pub pitch_sd_rad: Real,
    /// Roll of the body, rad.
    pub roll_rad: Real,
    /// Bias of the accelerometer along the body, m/s².
    pub bias_mps2: Real,
    /// Standard deviation of the sum sin θ + b/g, which the rail memory keeps.
    pub sum_sd: Real,
    /// Rate of the pitch angle, rad/s; not the rate about the body's y axis, which in a bend includes the heading.
    pub pitch_rate_radps: Real,
    /// Rate of the heading, rad/s.
    pub yaw_rate_radps: Real,
    /// Vertical curvature of the rail under the unit, 1/m.
    pub curvature_per_m: Real,
    /// True if accelerometer and gyro are in use now.
    pub imu: bool,
    /// Wheels in use now, and wheels that slip.
    pub wheels: [usize; 2],
    /// Change of the grade since the newest sample of the accelerometer, by its stamp, rad.
    pub moved_on_rad: Real,
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeFilter {
    params: AttitudeParams,
    bias_sd: [Real; 2],
    supervision: AttitudeSupervision,
    calibration: Calibration,
    model: AttitudeModel,
    standing_mps: Real,
    road: bool,
    turn_walk: Real,
    started: bool,
    /// True unless the gyro has been found wrong.
    gyro_sound: bool,
    /// True if this step has started the filter, or has ended a long loss of all wheels.
    starts: bool,
    quiet_s: Real,
    standing_bias: StandingBias,
    coast_s: Real,
    /// Time without a sample of accelerometer and wheels, and without one of the gyro, s.
    silent_s: Real,
    gyro_out_s: Real,
    /// Remaining time in which wheels may contradict a start in motion, and time for which all wheels have contradicted
    /// it alike, s.
    young_s: Real,
    contradicted_s: Real,
    ahead: WheelsAhead,
    belief: Gaussian<N>,
    angles: Angles,
    health: ImuHealth,
    wheels: WheelGate,
    separation: Separation,
    window: ForceWindow,
    curvature: RailCurvature,
    arm: ArmError,
    heading: Heading,
    found: Attitude,
    innovation: Real,
    nis: Real,
    is_new: bool,
    status: [AidStatus; 3],
}

#[allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below N"
)]
impl AttitudeFilter {
    /// Names of the sources of measurements, in the order of [`AttitudeFilter::aid_status`].
    pub const AID_SOURCES: &'static [&'static str] =
        &["wheel_speed", "lateral_force", "vertical_force"];

    /// Builds the attitude filter from the vehicle's nominal values and the sensor sheet.
    pub fn new(
        vehicle: &Vehicle,
        params: AttitudeParams,
        supervision: AttitudeSupervision,
        integrity: &Integrity,
    ) -> Self {
        let bias_sd = params.bias_sd(vehicle);
        let wheel_sd = params.wheel_speed_sd_mps;
        let gated = supervision.slip_gate;
        Self {
            params,
            bias_sd,
            supervision,
            calibration: Calibration::new(bias_sd),
            model: AttitudeModel {
                lever: Lever {
                    ahead_m: vehicle.imu_arm_m,
                    below_m: vehicle.layout.map_or(0.0, |layout| layout.imu_depth_m),
                },
                noise: params.noise(vehicle.drives),
            },
            standing_mps: STANDSTILL.speed_share * vehicle.standstill_mps(None),
            road: vehicle.road.is_some(),
            turn_walk: params.turn_walk(vehicle),
            started: false,
            gyro_sound: true,
            starts: false,
            quiet_s: 0.0,
            standing_bias: StandingBias::default(),
            coast_s: 0.0,
            silent_s: 0.0,
            gyro_out_s: TIMES.memory_s,
            young_s: 0.0,
            contradicted_s: 0.0,
            ahead: WheelsAhead::default(),
            belief: Gaussian::independent(SVector::zeros(), SVector::zeros()),
            angles: Angles::default(),
            health: ImuHealth::new(supervision.accelerometer_gate, supervision.spike_gate),
            wheels: WheelGate::new(vehicle.drives, wheel_sd, integrity.gate_sd, gated),
            separation: Separation::default(),
            window: ForceWindow::new(ForceNoise {
                random_walk: params.velocity_random_walk,
                lateral_sd_mps2: params.lateral_sd(vehicle),
                vertical_factor: params.force_noise_factor,
                learns: supervision.noise_learning,
            }),
            curvature: RailCurvature::default(),
            arm: ArmError::new(vehicle.imu_arm_m),
            heading: Heading::default(),
            found: Attitude::default(),
            innovation: 0.0,
            nis: 0.0,
            is_new: false,
            status: [AidStatus::default(); 3],
        }
    }

    /// Makes one step; `None` until an accelerometer and a wheel have given samples.
    pub fn step(&mut self, z: &Channels, dt: Real) -> Option<Attitude> {
        self.listen(z, dt);
        self.starts = false;
        let (yaw_bias, v) = (self.belief.x[GYRO_Z], self.belief.x[V]);
        let gyro = self.supervision.gyro && self.gyro_sound;
        let imu = self.health.step(z, yaw_bias, v, gyro, dt);
        if !self.started {
            imu.force_mps2?;
            self.start(z, dt)?;
        }
        let rates = self.predict(&imu, dt);
        self.ahead.step(z, dt);
        let given_up = self.coast_s > ATTITUDE.coast_s;
        let ballot = self.aid_by_wheels(z, &rates, dt);
        self.aid_by_force(&imu, dt);
        self.aid_by_standstill(&imu, ballot.used > 0, dt);
        self.limit(z, dt)?;
        self.separate(&rates, &imu, &ballot, dt);
        self.find((z, &imu), &rates, &ballot, dt);
        // A speed that had been given up led to an unknown place.
        self.starts |= given_up && ballot.used > 0;
        Some(self.found)
    }

    /// Compares the belief after a step with single instruments. On a rail the pitch is opened for accelerometer and
    /// wheels that contradict the gyro, unless a wheel slips.
    fn separate(&mut self, rates: &AttitudeRates, imu: &SoundImu, wheels: &Ballot, dt: Real) {
        if self.starts {
            self.separation = Separation::default();
        }
        let (x, sd) = (&self.belief.x, |i: usize| sqrt(self.belief.P[(i, i)]));
        let walk = self.model.noise.angle_walk;
        let [_, _, yaw_rate] = rates.body_radps.unwrap_or_default();
        let compared = Compared {
            angles: [x[THETA], x[PHI]],
            sd: [sd(THETA), sd(GYRO_Y)],
            body_radps: rates.body_radps,
            acceleration_mps2: imu.force_mps2.map(|_| rates.v_dot),
            scale: imu.scale,
            wheels_mps: (wheels.used + wheels.rejected > 0).then_some(wheels.speed_mps),
            speed_mps: x[V],
            angle_walk: sqrt(walk * walk + self.turn_walk * yaw_rate * yaw_rate),
            curvature_sd_per_m: self.model.noise.curvature_sd_per_m,
            bias_rad: [x[BIAS_X], self.bias_sd[0]].map(|bias| bias / GRAVITY),
        };
        let excess = self.separation.step(&compared, dt);
        if !self.road && wheels.used > 0 && wheels.rejected == 0 {
            self.belief.P[(THETA, THETA)] += excess * excess * dt / TIMES.brief_s;
        }
    }

    /// Counts the time without samples; the filter starts again after a pause.
    fn listen(&mut self, z: &Channels, dt: Real) {
        let wheels = z.new_wheel_speed_mps.iter().any(Option::is_some);
        if z.specific_force_mps2.is_none() && !wheels {
            self.silent_s += dt;
        } else {
            self.started &= self.silent_s.max(z.since_s) < TIMES.pause_s;
            self.silent_s = 0.0;
        }
        self.gyro_out_s = match z.angular_rate_radps {
            Some(_) => 0.0,
            None => self.gyro_out_s + dt,
        };
    }

    /// Returns true while samples come: without any the last output is nobody's.
    pub fn is_awake(&self) -> bool {
        self.started && self.silent_s < TIMES.lost_s
    }

    /// Returns true if the last step has started the filter, or wheels have come back after a long loss.
    pub fn has_just_started(&self) -> bool {
        self.starts
    }

    /// Starts the filter with the first samples of an accelerometer that is in use.
    fn start(&mut self, z: &Channels, dt: Real) -> Option<()> {
        self.belief = first_belief(
            z,
            dt,
            &self.params,
            self.bias_sd,
            self.health.norm_error_mps2(),
            (self.standing_mps, self.road),
        )?;
        (self.started, self.starts) = (true, true);
        let moves = self.belief.x[V].abs() > self.standing_mps;
        self.young_s = if moves { TIMES.young_s } else { 0.0 };
        Some(())
    }

    /// Carries the belief over the step.
    fn predict(&mut self, imu: &SoundImu, dt: Real) -> AttitudeRates {
        self.carry_curvature(imu.rate_radps.is_some());
        // Of a calibrated gyro a body that rocks would pass for noise.
        let seen_turn_walk = self.calibration.doubted() * self.window.seen_turn_walk();
        let input = AttitudeInput {
            force_mps2: imu.force_mps2,
            rate_radps: imu.rate_radps,
            seen_walk: [self.window.seen_walk(), seen_turn_walk],
            speed_mps: self.belief.x[V],
        };
        let sin_cos = self.angles.of(&self.belief.x);
        let rates = self.model.predict(&mut self.belief, sin_cos, &input, dt);
        let [_, _, yaw_rate] = rates.body_radps.unwrap_or_default();
        self.belief.P[(THETA, THETA)] += self.turn_walk * yaw_rate * yaw_rate * dt;
        self.calibration
            .doubt(&mut self.belief, rates.theta_dot * dt, yaw_rate, dt);
        rates
    }

    /// Handles the curvature: with a gyro it is not a state; after the loss of the gyro it starts from its last value.
    fn carry_curvature(&mut self, gyro: bool) {
        let known = self.belief.P[(KAPPA, KAPPA)] > 0.0;
        if gyro == known {
            let (curvature, sd) = match gyro {
                true => (0.0, 0.0),
                false => (self.curvature.per_m(), ATTITUDE.lost_curvature_sd_per_m),
            };
            self.belief.set_independent(KAPPA, curvature, sd * sd);
        }
    }

    fn aid_by_wheels(&mut self, z: &Channels, rates: &AttitudeRates, dt: Real) -> Ballot {
        self.is_new = false;
        let lever = (self.model.lever.below_m, rates.pitch_rate());
        let (wheels, ballot) = self.wheels.control(
            &self.belief,
            (&z.new_wheel_speed_mps, &z.motor_torque_nm),
            lever,
            self.ahead.gained(self.found.acceleration_mps2),
            dt,
        );
        if ballot.used > 0 {
            self.coast_s = 0.0;
        } else {
            self.coast(dt);
        }
        self.young_s = (self.young_s - dt).max(0.0);
        self.contradicted_s = match ballot.contradicts && self.young_s > 0.0 {
            true => self.contradicted_s + dt,
            false if ballot.used > 0 => 0.0,
            false => self.contradicted_s,
        };
        let gate = match self.wheels.is_gated() {
            true => GateRule::Reject(ballot.limit_mps, Rejection::Slip),
            false => GateRule::Open,
        };
        let wheels = match wheels {
            Control::Held if z.wheels_stuck => Control::Out(AidOutcome::Rejected(Rejection::Stuck)),
            Control::Held if self.coast_s > TIMES.lost_s => Control::Out(AidOutcome::Stale),
            wheels => wheels,
        };
        let [status, ..] = &mut self.status;
        if let Some(new) = fuse(&mut self.belief, wheels, gate) {
            *status = new;
            if ballot.used > 0 {
                self.innovation = new.innovation;
                self.nis = new.nis().unwrap_or(0.0);
                self.is_new = ballot.rejected == 0;
            }
        }
        ballot
    }

    /// Handles the loss of wheels: the accelerometer then gives the speed; after a long time wheels with consistent
    /// speeds are used again.
    fn coast(&mut self, dt: Real) {
        self.coast_s += dt;
        if self.coast_s > ATTITUDE.coast_s {
            self.belief.P[(V, V)] += ATTITUDE.reopen * dt;
        }
    }

    fn aid_by_force(&mut self, imu: &SoundImu, dt: Real) {
        let (Some(force), Some(rate)) = (imu.force_mps2, imu.rate_radps) else {
            let outcome = match imu.stuck {
                true => AidOutcome::Rejected(Rejection::Stuck),
                false => AidOutcome::Stale,
            };
            let [_, lateral, vertical] = &mut self.status;
            (*lateral, *vertical) = (AidStatus::not_fused(outcome), AidStatus::not_fused(outcome));
            return;
        };
        let lever = self.model.lever;
        let sin_cos = self.angles.of(&self.belief.x);
        let x = &self.belief.x;
        let Some((across, up)) = self.window.step((x, sin_cos), force, rate, lever, dt) else {
            return;
        };
        // |f| = g does not separate the bias of an uncalibrated instrument from the pitch of its mount or its scale.
        let variance = self.calibration.trusted(up.variance);
        let up = match variance.filter(|_| self.supervision.vertical_force) {
            Some(variance) => Control::New(Vertical { variance, ..up }),
            None => Control::Out(AidOutcome::Stale),
        };
        let gate = GateRule::Deweight(STATISTICS.noise_sd);
        let [_, lateral, vertical] = &mut self.status;
        *lateral = fuse(&mut self.belief, Control::New(across), gate).unwrap_or(*lateral);
        *vertical = fuse(&mut self.belief, up, gate).unwrap_or(*vertical);
    }

    fn aid_by_standstill(&mut self, imu: &SoundImu, wheels: bool, dt: Real) {
        let stands = self.belief.x[V].abs() < self.standing_mps;
        self.quiet_s = match (stands, wheels) {
            (true, true) => self.quiet_s + dt,
            (true, false) => self.quiet_s,
            (false, _) => 0.0,
        };
        let Some(rate) = imu.rate_radps.filter(|_| self.quiet_s > TIMES.brief_s) else {
            self.standing_bias = StandingBias::default();
            return;
        };
        self.standing_bias.step(&mut self.belief, rate, dt);
        for axis in Standstill::by_axis(rate, dt) {
            // A rate that the numbers do not allow leaves the belief as it is.
            let _ = fuse(&mut self.belief, Control::New(axis), GateRule::Open);
        }
    }

    /// Limits the state to values that are possible for a vehicle. Without a finite state or a covariance, or when all
    /// wheels contradict a start in motion, it starts anew.
    fn limit(&mut self, z: &Channels, dt: Real) -> Option<()> {
        let x = &mut self.belief.x;
        let limits = [
            (V, ATTITUDE.max_speed_mps),
            (THETA, MAX_GRADE_RAD),
            (PHI, MAX_GRADE_RAD),
            (KAPPA, RAIL.max_turn_radpm),
        ];
        for (place, most) in limits {
            x[place] = x[place].clamp(-most, most);
        }
        self.belief
            .limit_variance(&SVector::from(ATTITUDE.max_sd.map(|sd| sd * sd)));
        let positive = self.belief.P.diagonal().iter().all(|p| *p >= 0.0);
        let contradicted = self.contradicted_s > TIMES.mean_s;
        if positive && self.belief.is_finite() && !contradicted {
            return Some(());
        }
        (self.started, self.contradicted_s) = (false, 0.0);
        self.start(z, dt)
    }

    /// Makes the output of the step, and stores the grade of the rail.
    fn find(
        &mut self,
        (z, imu): (&Channels, &SoundImu),
        rates: &AttitudeRates,
        ballot: &Ballot,
        dt: Real,
    ) {
        let (x, P) = (self.belief.x, &self.belief.P);
        let speed = x[V] - self.model.lever.below_m * rates.theta_dot;
        match rates.body_radps {
            Some(_) => self.curvature.step(speed, rates.theta_dot, dt),
            None => self.curvature.set(x[KAPPA]),
        }
        let known = P[(THETA, THETA)] < SOURCE.calm_sum_sd * SOURCE.calm_sum_sd;
        self.arm.step(
            speed * dt,
            known.then_some(x[THETA]),
            self.curvature.per_m(),
        );
        let [[_, cos_theta], [sin_phi, cos_phi]] = self.angles.of(&x);
        let [_, q, r] = rates.body_radps.unwrap_or_default();
        let yaw_rate_radps = (q * sin_phi + r * cos_phi) / cos_theta;
        let least_sd = self.calibration.least_pitch_sd_rad();
        let [_, force_age_s, _] = z.age_s;
        self.found = Attitude {
            speed_mps: speed,
            speed_sd_mps: sqrt(P[(V, V)]),
            speed_noise_mps: self.speed_noise(),
            acceleration_mps2: rates.v_dot,
            pitch_rad: x[THETA],
            pitch_sd_rad: sqrt(P[(THETA, THETA)]).max(least_sd),
            roll_rad: x[PHI],
            bias_mps2: x[BIAS_X],
            sum_sd: self.sum_sd(cos_theta),
            pitch_rate_radps: rates.theta_dot,
            yaw_rate_radps,
            curvature_per_m: self.curvature.per_m(),
            imu: imu.force_mps2.is_some() && (imu.rate_radps.is_some() || !self.has_gyro()),
            wheels: [ballot.used, ballot.slipping],
            moved_on_rad: rates.theta_dot * within(force_age_s, 0.0, TIMES.mean_s),
        };
        self.heading.step(
            &HeadingInput {
                rate_radps: rates.body_radps.map(|_| yaw_rate_radps),
                bias_sd_radps: self.yaw_bias_sd_radps(),
                walk: self.params.angle_random_walk,
                speed_mps: speed,
            },
            dt,
        );
    }

    /// Returns true if there is a gyro that may be used.
    fn has_gyro(&self) -> bool {
        self.supervision.gyro && self.gyro_sound && self.gyro_out_s < TIMES.memory_s
    }

    /// Returns true unless the gyro has been excluded.
    pub fn uses_gyro(&self) -> bool {
        self.gyro_sound
    }

    /// Excludes the gyro from now on. What it has taught is wrong, so the filter starts anew.
    pub fn leave_gyro_out(&mut self) {
        self.started &= !self.gyro_sound;
        self.gyro_sound = false;
    }

    /// Standard deviation of the speed without the scale of the wheels, m/s.
    fn speed_noise(&self) -> Real {
        let P = &self.belief.P;
        let scale = P[(SCALE, SCALE)].max(Real::MIN_POSITIVE);
        sqrt((P[(V, V)] - P[(V, SCALE)] * P[(V, SCALE)] / scale).max(0.0))
    }

    /// Standard deviation of sin θ + b/g.
    fn sum_sd(&self, cos_theta: Real) -> Real {
        let (P, c) = (&self.belief.P, cos_theta);
        let by_bias = 1.0 / GRAVITY;
        sqrt(
            P[(THETA, THETA)] * c * c
                + 2.0 * P[(THETA, BIAS_X)] * c * by_bias
                + P[(BIAS_X, BIAS_X)] * by_bias * by_bias,
        )
    }

    /// Sine of the pitch of the last step.
    pub fn pitch_sine(&self) -> Real {
        let [[sine, _], _] = self.angles.last();
        sine
    }

    /// Attitude and speed of the last step.
    pub fn found(&self) -> &Attitude {
        &self.found
    }

    /// Velocity random walk of the accelerometer along the body, learnt, m/s/√s; 0 if it is not learnt.
    pub fn seen_walk(&self) -> Real {
        self.window.seen_walk()
    }

    /// State and covariance.
    pub fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    /// Innovation of the mean of the wheels, m/s, and its square normalised.
    pub fn innovation(&self) -> (Real, Real) {
        (self.innovation, self.nis)
    }

    /// Normalised innovation squared of the wheels, if this step has fused any.
    pub fn new_nis(&self) -> Option<Real> {
        self.is_new.then_some(self.nis)
    }

    /// Status of the last wheel speed, f_y and f_z.
    pub fn aid_status(&self) -> [AidStatus; 3] {
        self.status
    }
}

state!(Attitude { speed_mps, speed_sd_mps, speed_noise_mps, acceleration_mps2, pitch_rad, pitch_sd_rad, roll_rad, bias_mps2, sum_sd, pitch_rate_radps, yaw_rate_radps, curvature_per_m, imu, wheels, moved_on_rad; });
state!(AttitudeFilter { started, gyro_sound, starts, quiet_s, standing_bias, coast_s, silent_s, gyro_out_s, young_s, contradicted_s, ahead, belief, health, wheels, separation, window, curvature, arm, heading, found, innovation, nis, is_new, status; params, bias_sd, supervision, calibration, model, standing_mps, road, turn_walk, angles });

#[cfg(test)]
mod tests;
