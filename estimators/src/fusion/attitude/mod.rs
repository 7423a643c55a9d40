//! Attitude and speed of the body that carries the IMU, from gyro, accelerometer and wheels: an extended Kalman filter with biases.
//!
//! x = [v, θ, φ, b_x, b_y, b_z, g_x, g_y, e_w, κ, g_z]: speed along the body, pitch (nose up), roll (left side up), accelerometer biases, gyro
//! biases of roll, pitch and yaw rate (which a standstill tells), mean scale error of the wheels, and for times without a gyro the curvature of the way. The gyro is the input of the attitude, the accelerometer that of the
//! speed ([`kinematics`]); wheels ([`wheel_aiding`]), f_y and f_z ([`gravity_aiding`]) are the measurements.
//!
//! It uses no force: no fault of torque, load or running resistance can reach the slope. What makes the accelerometer's bias observable is
//! |f| = g: on a slope f_z = g cos θ + b_z tells θ without the integral of the gyro, once b_z is known from the level, and with θ
//! f_x = v̇ + g sin θ + b_x tells b_x. Source: ours; the filter is that of Schmidt 1970 (extended), the gates those of common practice
//! (Bar-Shalom, Li & Kirubarajan 2001, 5.4).

#![allow(
    clippy::indexing_slicing,
    reason = "indices of states are constants below their number"
)]

pub mod arm_error;
pub mod gravity_aiding;
pub mod heading;
pub mod imu_health;
pub mod kinematics;
pub mod params;
pub mod rail_curvature;
pub mod survey;
pub mod wheel_aiding;

use nalgebra::{SVector, Vector3};

use crate::Real;
use crate::api::aid::{AidOutcome, AidStatus, Rejection};
use crate::api::real::{GRAVITY, PI, asin, cos, sin, sqrt};
use crate::api::signals::Vehicle;
use crate::api::snapshot::{Archive, State, state};
use crate::detect::validity::Integrity;
use crate::filters::gaussian::Gaussian;
use crate::models::force_balance::MAX_GRADE_RAD;
use crate::preprocess::front_end::Channels;
use arm_error::ArmError;
use gravity_aiding::GravityAiding;
use heading::{Heading, Turn};
use imu_health::ImuHealth;
use kinematics::Inputs;
use params::{AttitudeParams, AttitudeSupervision};
use rail_curvature::RailCurvature;
use wheel_aiding::{WheelAiding, WheelOutcome};

/// Indices of the state.
pub const V: usize = 0;
/// Pitch.
pub const THETA: usize = 1;
/// Roll.
pub const PHI: usize = 2;
/// Accelerometer biases from here on, x, y, z.
pub const BIAS_X: usize = 3;
/// See above.
pub const BIAS_Y: usize = 4;
/// See above.
pub const BIAS_Z: usize = 5;
/// Gyro bias of the roll rate.
pub const GYRO_X: usize = 6;
/// Gyro bias of the pitch rate about y.
pub const GYRO_Y: usize = 7;
/// Scale error of the wheels.
pub const SCALE: usize = 8;
/// Vertical curvature of the rail or road, in use without a gyro.
pub const KAPPA: usize = 9;
/// Gyro bias of the yaw rate.
pub const GYRO_Z: usize = 10;
/// Number of states.
pub const N: usize = 11;

/// Standard deviation of the pitch up to which the arm's error is measured, rad.
const MAX_ARM_SD_RAD: Real = 0.003;
/// Standard deviation of the curvature when the gyro is lost, 1/m.
const LOST_CURVATURE_SD_PER_M: Real = 0.005;
/// Largest standard deviation of the biases, m/s² and rad/s, of an instrument that counts as calibrated. What a sheet says beyond it may as well be
/// the pitch of the mount or an error of scale, for neither of which |f| = g tells anything: f_z is not used then.
const CALIBRATED_SD: Real = 0.03;
/// Standard deviation of the scale of another, and change of the pitch over which it counts as one error, rad.
const UNCALIBRATED_SCALE_SD: Real = 0.0075;
const RAMP_RAD: Real = 0.2;
/// How far axes of such an IMU are askew against each other, rad, and time over which a bend turns to one side, s.
const ASKEW_RAD: Real = 0.025;
const BEND_S: Real = 3.0;
/// Largest speed, m/s, and angle, rad, that the state may have.
const MAX_SPEED_MPS: Real = 100.0;
const MAX_ANGLE_RAD: Real = MAX_GRADE_RAD;
/// Largest standard deviations of the state.
const MAX_SD: [Real; N] = [10.0, 0.6, 0.6, 2.0, 2.0, 2.0, 0.1, 0.1, 0.3, 0.3, 0.1];
/// Noise of the gyro with the vibration of a standing vehicle, rad/√s, and time of standing before it tells its bias, s.
const STANDING_NOISE: Real = 3e-4;
const QUIET_S: Real = 0.3;
/// Uncertainty of v̇ at the first sample, m/s²: of a vehicle that stands, and of one that runs.
const FIRST_ACCELERATION_SD_MPS2: [Real; 2] = [0.02, 0.5];

/// Where the IMU is against the middle of its unit, on the rail's line (on a road: the axle whose wheels are measured).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lever {
    /// How far ahead, m.
    pub ahead_m: Real,
    /// How far below, m.
    pub below_m: Real,
}

/// What the filter has found for one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attitude {
    /// Speed of the unit's middle along the rail, m/s, and its standard deviation.
    pub speed_mps: Real,
    /// See above.
    pub speed_sd_mps: Real,
    /// Standard deviation of the speed but for the scale of the wheels, which differences do not see, m/s.
    pub speed_noise_mps: Real,
    /// Acceleration along the body, m/s²; 0 without an accelerometer.
    pub acceleration_mps2: Real,
    /// Pitch of the body, rad, and its standard deviation.
    pub pitch_rad: Real,
    /// See above.
    pub pitch_sd_rad: Real,
    /// Roll of the body, rad.
    pub roll_rad: Real,
    /// Bias of the accelerometer along the body, m/s².
    pub bias_mps2: Real,
    /// Standard deviation of what the rail memory keeps, sin θ + b/g.
    pub sum_sd: Real,
    /// Rate of the pitch angle, rad/s; not that about the body's y axis, which in a bend turns the heading too.
    pub pitch_rate_radps: Real,
    /// Rate of the heading, rad/s.
    pub yaw_rate_radps: Real,
    /// Vertical curvature of the rail under the unit, 1/m.
    pub curvature_per_m: Real,
    /// Whether accelerometer and gyro are in use now.
    pub imu: bool,
    /// Wheels in use now, and wheels that the gate has rejected.
    pub wheels: [usize; 2],
}

/// The filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeFilter {
    params: AttitudeParams,
    bias_sd: [Real; 2],
    supervision: AttitudeSupervision,
    accel_scale_sd: Real,
    lever: Lever,
    standstill_mps: Real,
    started: bool,
    quiet_s: Real,
    belief: Gaussian<N>,
    health: ImuHealth,
    wheels: WheelAiding,
    gravity: GravityAiding,
    curvature: RailCurvature,
    arm: ArmError,
    heading: Heading,
    found: Attitude,
    innovation: Real,
    nis: Real,
    new_nis: Option<Real>,
    status: [AidStatus; 3],
}

impl AttitudeFilter {
    /// Names of the sources of measurements, in the order of [`AttitudeFilter::aid_status`].
    pub const AID_SOURCES: &'static [&'static str] =
        &["wheel_speed", "lateral_force", "vertical_force"];

    /// From the vehicle's nominal values and the sensor sheet.
    pub fn new(
        vehicle: &Vehicle,
        params: AttitudeParams,
        supervision: AttitudeSupervision,
        integrity: &Integrity,
    ) -> Self {
        let drives = vehicle.drives;
        let bias_sd = params.bias_sd(vehicle);
        let calibrated = bias_sd.iter().all(|sd| *sd <= CALIBRATED_SD);
        let supervision = AttitudeSupervision {
            vertical_force: supervision.vertical_force && calibrated,
            ..supervision
        };
        Self {
            params,
            bias_sd,
            supervision,
            accel_scale_sd: if calibrated {
                0.0
            } else {
                UNCALIBRATED_SCALE_SD
            },
            lever: Lever {
                ahead_m: vehicle.imu_arm_m,
                below_m: vehicle.layout.map_or(0.0, |layout| layout.imu_depth_m),
            },
            standstill_mps: vehicle.standstill_mps(None),
            started: false,
            quiet_s: 0.0,
            belief: Gaussian::independent(SVector::zeros(), SVector::zeros()),
            health: ImuHealth::new(supervision.accelerometer_gate, supervision.spike_gate),
            wheels: WheelAiding::new(drives, &params, &supervision, integrity),
            gravity: GravityAiding::new(&params, supervision.noise_learning),
            curvature: RailCurvature::default(),
            arm: ArmError::new(vehicle.imu_arm_m),
            heading: Heading::default(),
            found: Attitude::default(),
            innovation: 0.0,
            nis: 0.0,
            new_nis: None,
            status: [AidStatus::default(); 3],
        }
    }

    /// One step; `None` until there has been an accelerometer and a wheel.
    pub fn step(&mut self, z: &Channels, dt: Real) -> Option<Attitude> {
        if !self.started {
            self.start(z, dt)?;
        }
        let x = self.belief.x;
        let inputs = self.health.step(
            z,
            [x[GYRO_X], x[GYRO_Y], x[GYRO_Z]],
            x[V],
            self.supervision.gyro,
            dt,
        );
        self.carry_curvature(inputs.rate.is_some());
        let motion = kinematics::motion(&self.belief.x, &inputs, self.lever);
        let seen = [self.gravity.seen_walk(), self.seen_turn_walk()];
        kinematics::predict(&mut self.belief, &motion, &inputs, &self.params, seen, dt);
        let [_, _, yaw_rate] = inputs.rate.unwrap_or_default();
        self.doubt_calibration(motion.theta_dot * dt, yaw_rate, dt);
        let lever_mps = self.lever.below_m * motion.theta_dot;
        if inputs.shock {
            self.wheels.shock();
        }
        let outcome = self.aid_by_wheels(z, lever_mps, dt);
        self.new_nis = outcome
            .status
            .filter(|_| outcome.used > 0 && outcome.rejected == 0)
            .map(|_| self.nis);
        self.aid_by_gravity(&inputs, dt);
        self.aid_by_standstill(&inputs, outcome.used > 0, dt);
        self.limit(z, dt)?;
        let x = self.belief.x;
        let speed = x[V] - lever_mps;
        match inputs.rate {
            Some(_) => self.curvature.step(speed, motion.theta_dot, dt),
            None => self.curvature.set(x[KAPPA]),
        }
        let known = self.belief.P[(THETA, THETA)] < MAX_ARM_SD_RAD * MAX_ARM_SD_RAD;
        self.arm.step(
            speed * dt,
            known.then_some(x[THETA]),
            self.curvature.per_m(),
        );
        let [_, q, r] = inputs.rate.unwrap_or_default();
        let yaw_rate_radps = (q * sin(x[PHI]) + r * cos(x[PHI])) / cos(x[THETA]);
        self.heading.step(
            &Turn {
                rate_radps: inputs.rate.map(|_| yaw_rate_radps),
                bias_sd_radps: self.yaw_bias_sd_radps(),
                walk: self.params.angle_random_walk,
                speed_mps: speed,
            },
            dt,
        );
        self.found = Attitude {
            speed_mps: speed,
            speed_sd_mps: sqrt(self.belief.P[(V, V)]),
            speed_noise_mps: self.speed_noise(),
            acceleration_mps2: motion.v_dot,
            pitch_rad: x[THETA],
            pitch_sd_rad: sqrt(self.belief.P[(THETA, THETA)]).max(self.least_sd_rad()),
            roll_rad: x[PHI],
            bias_mps2: x[BIAS_X],
            sum_sd: self.sum_sd(),
            pitch_rate_radps: motion.theta_dot,
            yaw_rate_radps,
            curvature_per_m: self.curvature.per_m(),
            imu: inputs.force.is_some() && (inputs.rate.is_some() || !self.supervision.gyro),
            wheels: [outcome.used, outcome.rejected],
        };
        Some(self.found)
    }

    /// The first belief: θ and φ by the accelerometer, whose bias is then wholly correlated with them.
    fn start(&mut self, z: &Channels, dt: Real) -> Option<()> {
        let [fx, fy, _] = z.specific_force_mps2?;
        let (count, sum) = z
            .new_wheel_speed_mps
            .iter()
            .flatten()
            .fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
        if count == 0.0 {
            return None;
        }
        let v: Real = sum / count;
        let p = &self.params;
        let theta = asin((fx / GRAVITY).clamp(-0.6, 0.6));
        let g_theta = GRAVITY * cos(theta);
        let phi = asin((fy / g_theta).clamp(-0.3, 0.3));
        let [standing, running] = FIRST_ACCELERATION_SD_MPS2;
        let v_dot = if v.abs() < 0.4 * self.standstill_mps {
            standing
        } else {
            running
        };
        let [bias, gyro] = self.bias_sd;
        let noise = p.velocity_random_walk / sqrt(dt);
        let angle = sqrt(bias * bias + v_dot * v_dot + noise * noise) / g_theta;
        let scale = p.wheel_scale_sd / sqrt(count);
        let speed = 2.0 * p.wheel_speed_sd_mps + scale * v.abs();
        let x = SVector::from([v, theta, phi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let sd = SVector::from([
            speed, angle, angle, bias, bias, bias, gyro, gyro, scale, 0.0, gyro,
        ]);
        self.belief = Gaussian::independent(x, sd);
        for (angle, bias_at) in [(THETA, BIAS_X), (PHI, BIAS_Y)] {
            self.belief.P[(angle, bias_at)] = -bias * bias / g_theta;
            self.belief.P[(bias_at, angle)] = -bias * bias / g_theta;
        }
        self.started = true;
        Some(())
    }

    /// Angle random walk seen, rad/√s, of a gyro that is not calibrated; of another a body that rocks would pass for noise.
    fn seen_turn_walk(&self) -> Real {
        if self.accel_scale_sd > 0.0 {
            self.gravity.seen_turn_walk()
        } else {
            0.0
        }
    }

    /// What the model of an uncalibrated IMU leaves out. Its scale changes its bias with the grade: else the change of cos θ on a slope would pass
    /// for a measurement of the bias. Its axes are askew: in a bend a share of the yaw rate is read as rates of pitch and roll.
    fn doubt_calibration(&mut self, turn_rad: Real, yaw_rate_radps: Real, dt: Real) {
        if self.accel_scale_sd <= 0.0 {
            return;
        }
        let scale = self.accel_scale_sd * GRAVITY;
        let P = &mut self.belief.P;
        P[(BIAS_X, BIAS_X)] += scale * scale * RAMP_RAD * turn_rad.abs();
        let askew = ASKEW_RAD * yaw_rate_radps;
        for angle in [THETA, PHI] {
            P[(angle, angle)] += askew * askew * BEND_S * dt;
        }
    }

    /// With a gyro the curvature is not a state; when the gyro is lost it starts from the last one.
    fn carry_curvature(&mut self, gyro: bool) {
        let known = self.belief.P[(KAPPA, KAPPA)] > 0.0;
        if gyro == known {
            for i in 0..N {
                self.belief.P[(i, KAPPA)] = 0.0;
                self.belief.P[(KAPPA, i)] = 0.0;
            }
            self.belief.x[KAPPA] = if gyro { 0.0 } else { self.curvature.per_m() };
            self.belief.P[(KAPPA, KAPPA)] = if gyro {
                0.0
            } else {
                LOST_CURVATURE_SD_PER_M * LOST_CURVATURE_SD_PER_M
            };
        }
    }

    fn aid_by_wheels(&mut self, z: &Channels, lever_mps: Real, dt: Real) -> WheelOutcome {
        let outcome = self
            .wheels
            .step(&mut self.belief, &z.new_wheel_speed_mps, lever_mps, dt);
        if let Some(status) = outcome.status {
            self.status[0] = status;
            if outcome.used > 0 {
                self.innovation = status.innovation;
                self.nis = status.innovation * status.innovation
                    / status.innovation_variance.max(Real::MIN_POSITIVE);
            }
        }
        outcome
    }

    /// What stands does not turn: the gyro reads its biases (zero-rate update).
    fn aid_by_standstill(&mut self, inputs: &Inputs, wheels: bool, dt: Real) {
        let stands = self.belief.x[V].abs() < 0.4 * self.standstill_mps;
        self.quiet_s = match (stands, wheels) {
            (true, true) => self.quiet_s + dt,
            (true, false) => self.quiet_s,
            (false, _) => 0.0,
        };
        let Some(rate) = inputs.rate.filter(|_| self.quiet_s > QUIET_S) else {
            return;
        };
        let R = STANDING_NOISE * STANDING_NOISE / dt;
        for (bias, rate) in [GYRO_X, GYRO_Y, GYRO_Z].into_iter().zip(rate) {
            let mut h = SVector::<Real, N>::zeros();
            h[bias] = 1.0;
            // a rate that is not to be taken leaves the belief as it is
            let _ = self.belief.update_scalar(rate, &h, R);
        }
    }

    fn aid_by_gravity(&mut self, inputs: &Inputs, dt: Real) {
        let (Some(force), Some(rate)) = (inputs.force, inputs.rate) else {
            let outcome = match inputs.stuck {
                true => AidOutcome::Rejected(Rejection::Stuck),
                false => AidOutcome::Stale,
            };
            for status in self.status.iter_mut().skip(1) {
                *status = AidStatus {
                    outcome,
                    ..AidStatus::default()
                };
            }
            return;
        };
        let new = self.gravity.step(
            &mut self.belief,
            Vector3::from(force),
            Vector3::from(rate),
            self.lever,
            self.supervision.vertical_force,
            dt,
        );
        if let Some(new) = new {
            [self.status[1], self.status[2]] = new;
        }
    }

    /// Keeps the state within what a vehicle can do; without a finite state or a covariance it starts anew.
    fn limit(&mut self, z: &Channels, dt: Real) -> Option<()> {
        let x = &mut self.belief.x;
        x[V] = x[V].clamp(-MAX_SPEED_MPS, MAX_SPEED_MPS);
        x[THETA] = x[THETA].clamp(-MAX_ANGLE_RAD, MAX_ANGLE_RAD);
        x[PHI] = x[PHI].clamp(-MAX_ANGLE_RAD, MAX_ANGLE_RAD);
        x[KAPPA] = x[KAPPA].clamp(-0.13, 0.13);
        self.belief
            .limit_variance(&SVector::from(MAX_SD.map(|sd| sd * sd)));
        let positive = self.belief.P.diagonal().iter().all(|p| *p >= 0.0);
        if positive && self.belief.is_finite() {
            return Some(());
        }
        self.started = false;
        self.start(z, dt)
    }

    /// What the last step has found.
    pub fn found(&self) -> &Attitude {
        &self.found
    }

    /// Whether it has started.
    pub fn started(&self) -> bool {
        self.started
    }

    /// Least standard deviation of the pitch that is told, rad: of an IMU that is not calibrated that of its bias, whatever the covariance makes of bends and
    /// grades, where askew axes read one turn as another.
    fn least_sd_rad(&self) -> Real {
        let [bias_sd, _] = self.bias_sd;
        if self.accel_scale_sd > 0.0 {
            bias_sd / GRAVITY
        } else {
            0.0
        }
    }

    fn speed_noise(&self) -> Real {
        let P = &self.belief.P;
        let scale = P[(SCALE, SCALE)].max(Real::MIN_POSITIVE);
        sqrt((P[(V, V)] - P[(V, SCALE)] * P[(V, SCALE)] / scale).max(0.0))
    }

    fn sum_sd(&self) -> Real {
        let (P, c) = (&self.belief.P, cos(self.belief.x[THETA]));
        let by_bias = 1.0 / GRAVITY;
        sqrt(
            P[(THETA, THETA)] * c * c
                + 2.0 * P[(THETA, BIAS_X)] * c * by_bias
                + P[(BIAS_X, BIAS_X)] * by_bias * by_bias,
        )
    }

    /// Test of the gyro monitor: square of the mean innovation of the wheels over its variance.
    pub fn monitor(&self) -> Real {
        self.wheels.test()
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
        self.new_nis
    }

    /// What became of the last wheel speed, f_y and f_z.
    pub fn aid_status(&self) -> [AidStatus; 3] {
        self.status
    }

    /// Grade at the IMU, rad: that under the unit's middle and the curvature over the arm.
    pub fn grade_at_imu_rad(&self) -> Real {
        let grade = self.found.pitch_rad + self.lever.ahead_m * self.found.curvature_per_m;
        grade.clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD)
    }

    /// Standard deviation of the IMU's mounting, rad: common to all grades.
    pub fn mount_sd_rad(&self) -> Real {
        self.params.mount_sd_deg * PI / 180.0
    }

    /// Its standard deviation, rad.
    pub fn grade_at_imu_sd_rad(&self) -> Real {
        let arm = self.arm.sd_rad(self.found.curvature_per_m);
        let pitch = self.found.pitch_sd_rad;
        let mount = self.mount_sd_rad();
        sqrt(pitch * pitch + arm * arm + mount * mount + MODEL_SD_RAD * MODEL_SD_RAD)
    }
}

/// Uncertainty of the pitch of the body against the rail, rad: its running wheels are springs.
const MODEL_SD_RAD: Real = 0.0003;

state!(Attitude { speed_mps, speed_sd_mps, speed_noise_mps, acceleration_mps2, pitch_rad, pitch_sd_rad, roll_rad, bias_mps2, sum_sd, pitch_rate_radps, yaw_rate_radps, curvature_per_m, imu, wheels; });
impl State for AttitudeFilter {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            params: _,
            bias_sd: _,
            supervision: _,
            accel_scale_sd: _,
            lever: _,
            standstill_mps: _,
            started,
            quiet_s,
            belief,
            health,
            wheels,
            gravity,
            curvature,
            arm,
            heading,
            found,
            innovation,
            nis,
            new_nis,
            status,
        } = self;
        started.visit(archive);
        quiet_s.visit(archive);
        belief.visit_lower(archive);
        health.visit(archive);
        wheels.visit(archive);
        gravity.visit(archive);
        curvature.visit(archive);
        arm.visit(archive);
        heading.visit(archive);
        found.visit(archive);
        innovation.visit(archive);
        nis.visit(archive);
        new_nis.visit(archive);
        status.visit(archive);
    }
}
