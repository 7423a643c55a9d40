//! Rail fusion: slope, effective grade and mass of a train on a rail from gyro, accelerometer, wheels and motor
//! torques.
//!
//! A cascade without feedback:
//!
//! 1. [attitude filter](crate::fusion::attitude): pitch, roll, speed and biases from IMU and wheels, at every sample
//! 2. [rail memory](crate::rail::rail_memory): what was read of the rail, by place
//! 3. [force balance](crate::fusion::swing_balance) with a swinging load: mass and running resistance, twice a second
//! 4. effective grade: mean over the masses, and by the force where the rail was not read
//!
//! The first uses no force, so no fault of a torque, of the load or of the running resistance can reach the slope; the
//! third takes the first's speed and grade as known. Source: ours. Equations, observability, constants and what fails:
//! `docs/src/methods/rail_fusion.md`.

mod effective;

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::mass_layout::MassLayout;
use crate::api::params::param_groups;
use crate::api::real::{GRAVITY, PI, sin, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::plausibility::Instruments;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::fusion::attitude::{Attitude, AttitudeFilter};
use crate::fusion::swing_balance::SwingMass;
use crate::fusion::swing_balance::block::BlockInput;
use crate::fusion::swing_balance::params::{SwingBalanceParams, SwingSupervision};
use crate::fusion::swing_balance::torque_monitor::TorqueMonitor;
use crate::models::force_balance::ForceBalance;
use crate::models::swing_balance::{ANGLE, D, ETA, LENGTH, Nominal, R0};
use crate::preprocess::front_end::Reading;
use crate::rail::rail_memory::RailMemory;
use crate::rail::train_means::TrainOnRail;
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};
use effective::EffectiveGrade;

param_groups! {
    /// Parameters of the rail fusion.
    Params { attitude: AttitudeParams, balance: SwingBalanceParams, attitude_supervision: AttitudeSupervision, balance_supervision: SwingSupervision, integrity: Integrity }
}

/// Speed below which no horizontal curvature is read, m/s.
const MIN_BEND_SPEED_MPS: Real = 0.1;
/// Standard deviation of sin θ + b/g up to which the rail is read.
const MAX_SUM_SD: Real = 0.003;
/// Lag of the brake, s.
const BRAKE_LAG_S: Real = 0.3;

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RailFusion {
    validity: Validity,
    nominal: Nominal,
    standstill_mps: Real,
    force_fusion: bool,
    air: ForceBalance,
    attitude: AttitudeFilter,
    rail: RailMemory,
    torques: TorqueMonitor,
    mass: SwingMass,
    effective: EffectiveGrade,
    brake: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> RailFusion {
    let layout = layout(vehicle);
    let train = TrainOnRail::new(&layout, params.balance_supervision.depth);
    let [bias_sd, _] = params.attitude.bias_sd(vehicle);
    let mount_sd = GRAVITY * params.attitude.mount_sd_deg * PI / 180.0;
    let bias_sd = sqrt(bias_sd * bias_sd + mount_sd * mount_sd);
    let nominal = Nominal::new(vehicle, &layout, params.balance.mass0_kg, bias_sd);
    let [front, rear] = train.span_m();
    let uses = Instruments {
        accelerometer: true,
        // On a rail the filter's own monitor contradicts a wrong gyro: the regression of the plausibility check takes
        // the pitch rate for that of the grade, which it is not in the bends of a roadway.
        gyro: vehicle.road.is_some(),
    };
    RailFusion {
        validity: Validity::new(vehicle, params.integrity, uses),
        nominal,
        standstill_mps: vehicle.standstill_mps(None),
        force_fusion: params.balance_supervision.force_fusion,
        air: ForceBalance::new(vehicle),
        attitude: AttitudeFilter::new(
            vehicle,
            params.attitude,
            params.attitude_supervision,
            &params.integrity,
        ),
        rail: RailMemory::new(rear - front),
        torques: TorqueMonitor::new(
            vehicle,
            &params.balance,
            params.balance_supervision.torque_monitor,
        ),
        mass: SwingMass::new(
            nominal,
            train,
            params.balance,
            params.balance_supervision,
            vehicle.drives,
        ),
        effective: EffectiveGrade::default(),
        brake: 0.0,
    }
}

/// The layout by the drawings, scaled to the tare; without drawings an even spread that does not swing.
fn layout(vehicle: &Vehicle) -> MassLayout {
    match vehicle.layout {
        Some(layout) => layout.scaled_to(vehicle.tare_kg),
        None => MassLayout::even(vehicle.tare_kg, vehicle.tare_span_m, vehicle.load_span_m),
    }
}

impl RailFusion {
    fn fuse(&mut self, reading: &Reading, attitude: &Attitude, dt: Real) {
        let v = attitude.speed_mps;
        let bend = if v.abs() > MIN_BEND_SPEED_MPS {
            (attitude.yaw_rate_radps / v).abs()
        } else {
            0.0
        };
        let u = sin(attitude.pitch_rad) + attitude.bias_mps2 / GRAVITY;
        let readable = attitude.sum_sd < MAX_SUM_SD && attitude.speed_sd_mps < MAX_SPEED_SD_MPS;
        self.rail.step(v * dt, readable.then_some([u, bend]));
        self.brake += dt / (BRAKE_LAG_S + dt) * (reading.brake - self.brake);
        let drag = self.air.drag(v);
        let traction = self
            .torques
            .traction(&reading.channels, v, dt)
            .map(|[force, variance]| [force - drag, variance]);
        let [used, rejected] = attitude.wheels;
        let standing = reading
            .speed_mps
            .is_some_and(|v| v.abs() < self.standstill_mps);
        let input = BlockInput {
            speed_mps: v,
            speed_noise_mps: attitude.speed_noise_mps,
            sum_sd: attitude.sum_sd,
            mass_kg: self.mass.mass_kg(),
            acceleration_mps2: attitude.acceleration_mps2,
            traction,
            bend_per_m: bend,
            brake: self.brake,
            sound: attitude.imu && !standing && (used > 0 || reading.new_speed_mps.is_none()),
            slip: rejected > 0,
            doubt: self.torques.doubt(),
        };
        let block = self.mass.step(&input, &self.rail, dt);
        if let Some(block) = block.filter(|_| self.force_fusion) {
            self.effective
                .correct(&block, &self.mass, &self.nominal, &self.rail);
        }
        self.effective.step(
            attitude,
            self.attitude.mount_sd_rad(),
            &self.mass,
            &self.rail,
            dt,
        );
    }

    fn estimate(&mut self, t: Time, started: bool, moving: bool) -> Estimate {
        let found = self.attitude.found();
        let (innovation, nis) = self.attitude.innovation();
        let [mass, mass_sd] = self.mass.published();
        let estimate = Estimate {
            t,
            total_mass_kg: Value {
                value: mass,
                sd: mass_sd,
                valid: started && self.mass.is_known(),
            },
            grade_rad: Value {
                value: self.attitude.grade_at_imu_rad(),
                sd: self.attitude.grade_at_imu_sd_rad(),
                valid: started,
            },
            effective_grade_rad: self.effective.value(started),
            speed_mps: Value {
                value: found.speed_mps,
                sd: found.speed_sd_mps,
                valid: started,
            },
            innovation,
            nis,
            flags: Flags {
                moving,
                excited: self.mass.is_known(),
                saturated: false,
            },
        };
        self.validity.publish(estimate, true)
    }

    /// Gives the validity rule its signals.
    fn supervise(&mut self, reading: &Reading, dt: Real) {
        // The check takes the pitch rate for that of the grade.
        let found = self.attitude.found();
        let pitch_rate_radps = reading.pitch_rate_radps.map(|_| found.pitch_rate_radps);
        let seen = Reading {
            pitch_rate_radps,
            ..*reading
        };
        self.validity.observe(&seen, dt);
        if let Some(nis) = self.attitude.new_nis() {
            self.validity.innovation(Source::WheelSpeed, nis, dt);
        }
        if let Some((nis, period_s)) = self.mass.new_nis() {
            self.validity
                .innovation(Source::ForceBalance, nis, period_s);
        }
    }
}

/// Standard deviation of the speed up to which the rail is read, m/s.
const MAX_SPEED_SD_MPS: Real = 0.1;

impl Pipeline for RailFusion {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("pitch_rad", "rad"),
        Internal::new("roll_rad", "rad"),
        Internal::new("accel_bias_mps2", "m/s²"),
        Internal::new("accel_bias_sd_mps2", "m/s²"),
        Internal::new("curvature_per_m", "1/m"),
        Internal::new("resistance_n", "N"),
        Internal::new("resistance_constant_n", "N"),
        Internal::new("swing_rad", "rad"),
        Internal::new("unmodelled_force_n", "N"),
        Internal::new("grade_behind_rad", "rad"),
        Internal::new("pendulum_length_ln", "-"),
        Internal::new("load_filter_sd_kg", "kg"),
        Internal::new("gyro_monitor", "-"),
        Internal::new("load_changes", "-"),
        Internal::new("read_sd", "-"),
        Internal::new("wheel_scale_sd", "-"),
        Internal::new("imu_arm_m", "m"),
        Internal::new("lagged_grade_rad", "rad"),
        Internal::new("lagged_grade_sd_rad", "rad"),
        Internal::new("heading_rad", "rad"),
        Internal::new("heading_sd_rad", "rad"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let attitude = self.attitude.step(&reading.channels, dt);
        if let Some(attitude) = attitude {
            self.fuse(reading, &attitude, dt);
        }
        self.supervise(reading, dt);
        let moving = reading
            .speed_mps
            .is_some_and(|v| v.abs() > self.standstill_mps);
        self.estimate(t, attitude.is_some(), moving)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let found = self.attitude.found();
        let mass = self.mass.found();
        let x = &mass.x;
        let [bias_sd, read_sd, scale_sd, arm_m] = self.attitude.reading();
        let lagged = self.attitude.lagged_grade();
        let [heading, heading_sd] = self.attitude.heading();
        copy_into(
            values,
            &[
                found.pitch_rad,
                found.roll_rad,
                found.bias_mps2,
                bias_sd,
                found.curvature_per_m,
                self.mass.resistance_n(&self.nominal, found.speed_mps),
                x[R0],
                x[ANGLE],
                x[D],
                x[ETA],
                x[LENGTH],
                sqrt(mass.mass_variance),
                self.attitude.monitor(),
                self.mass.changes() as Real,
                read_sd,
                scale_sd,
                arm_m,
                lagged.grade_rad,
                lagged.sd_rad,
                heading,
                heading_sd,
            ],
        );
    }

    const AID_SOURCES: &'static [&'static str] = &[
        "wheel_speed",
        "lateral_force",
        "vertical_force",
        "force_balance",
    ];

    fn aid_status(&self, status: &mut [AidStatus]) {
        let [wheels, lateral, vertical] = self.attitude.aid_status();
        copy_into(status, &[wheels, lateral, vertical, self.mass.status()]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(RailFusion { validity, attitude, rail, torques, mass, effective, brake; nominal, standstill_mps, force_fusion, air });
