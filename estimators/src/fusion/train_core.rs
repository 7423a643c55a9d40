//! Core of every estimator of a train: attitude and speed, the rail that was read, and the traction of the motors.
//!
//! It finds what an estimator of the mass takes as known: the grade under each mass of the train, speed, acceleration
//! and traction, all by instruments that have been checked. It uses no force for the grade, so no fault of a torque, of
//! the load or of the running resistance can reach the slope.

use crate::api::mass_layout::MassLayout;
use crate::api::real::{GRAVITY, exp, sin, sqrt};
use crate::api::signals::{Estimate, Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::plausibility::Instruments;
use crate::detect::standing_load::StandingLoad;
use crate::detect::validity::{Integrity, Source, Validity};
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::fusion::attitude::{Attitude, AttitudeFilter};
use crate::fusion::swing_balance::block::BlockInput;
use crate::fusion::swing_balance::params::SwingBalanceParams;
use crate::fusion::swing_balance::torque_monitor::TorqueMonitor;
use crate::models::force_balance::ForceBalance;
use crate::models::single_track::Bends;
use crate::preprocess::front_end::Reading;
use crate::rail::rail_memory::RailMemory;
use crate::{Real, Time};

/// Speed below which no horizontal curvature is read, m/s.
const MIN_BEND_SPEED_MPS: Real = 0.1;
/// Standard deviation of sin θ + b/g of a calm instrument.
const CALM_SUM_SD: Real = 0.003;
/// Way over which what was read worse than usual goes out of the means under a train, m.
const READ_M: Real = 20.0;
/// Standard deviation of sin θ + b/g up to which the rail is read: what is read badly is told with its doubt.
const READ_SUM_SD: Real = 0.02;
/// Standard deviation of the speed up to which the rail is read, m/s.
const MAX_SPEED_SD_MPS: Real = 0.1;
/// Standard deviation of the speed up to which the way run is measured, m/s.
const SEEN_SPEED_SD_MPS: Real = 0.02;
/// Lag of the brake, s.
const BRAKE_LAG_S: Real = 0.3;

/// Limits and filters of the core's signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoreSignals {
    /// Standard deviation of sin θ + b/g up to which a block of the force balance is of use.
    pub max_sum_sd: Real,
    /// Corner of the low-pass of the signals of a bend of a road, Hz.
    pub bend_hz: Real,
    /// True if on a road the gyro must be plausible.
    pub gyro_check: bool,
}

/// The core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainCore {
    standstill_mps: Real,
    air: ForceBalance,
    max_sum_sd: Real,
    /// Bends of a road.
    bends: Bends,
    attitude: AttitudeFilter,
    rail: RailMemory,
    torques: TorqueMonitor,
    brake: Real,
    /// Standard deviation of what was read under the train, beyond that of a calm instrument.
    read_sd: Real,
    started: bool,
    /// True if this step has lost the place on the rail.
    lost: bool,
    load: StandingLoad,
    validity: Validity,
}

impl TrainCore {
    /// Builds the core for a vehicle whose train reaches over `span_m`. `torque` is the noise of the torques, and true
    /// if they are monitored; how the signals are read.
    pub fn new(
        vehicle: &Vehicle,
        span_m: [Real; 2],
        attitude: AttitudeParams,
        supervision: AttitudeSupervision,
        integrity: Integrity,
        (torque, monitored): (&SwingBalanceParams, bool),
        signals: CoreSignals,
    ) -> Self {
        let [front, rear] = span_m;
        let uses = Instruments {
            accelerometer: true,
            // On a rail the filter's own monitor contradicts a wrong gyro: the regression of the plausibility check
            // takes the pitch rate for that of the grade, which it is not in the bends of a roadway.
            gyro: signals.gyro_check && vehicle.road.is_some(),
        };
        Self {
            standstill_mps: vehicle.standstill_mps(None),
            air: ForceBalance::new(vehicle),
            max_sum_sd: signals.max_sum_sd,
            bends: Bends::new(vehicle, signals.bend_hz),
            attitude: AttitudeFilter::new(vehicle, attitude, supervision, &integrity),
            rail: RailMemory::new(rear - front),
            torques: TorqueMonitor::new(vehicle, torque, monitored),
            brake: 0.0,
            read_sd: 0.0,
            started: false,
            lost: false,
            load: StandingLoad::new(integrity.standing_load_s),
            validity: Validity::new(vehicle, integrity, uses),
        }
    }

    /// One step with the total mass found so far, kg; `None` until there has been an accelerometer and a wheel.
    pub fn step(
        &mut self,
        reading: &Reading,
        mass_kg: Real,
        dt: Real,
    ) -> Option<(Attitude, BlockInput)> {
        self.bends.step(reading, &self.air, mass_kg, dt);
        let mut channels = reading.channels;
        if let Some([along, ..]) = &mut channels.specific_force_mps2 {
            *along += self.bends.now().drift_mps2;
        }
        let attitude = self.attitude.step(&channels, dt);
        self.started = attitude.is_some();
        let attitude = attitude?;
        let v = attitude.speed_mps;
        let unseen_m = (attitude.speed_sd_mps - SEEN_SPEED_SD_MPS).max(0.0) * dt;
        self.lost = self.rail.doubt(unseen_m);
        if self.attitude.has_just_started()
            && (self.rail.is_known() || v.abs() > self.standstill_mps)
        {
            self.rail.forget();
            self.lost = true;
        }
        let bend = if v.abs() > MIN_BEND_SPEED_MPS {
            (attitude.yaw_rate_radps / v).abs()
        } else {
            0.0
        };
        let u = sin(attitude.pitch_rad) + attitude.bias_mps2 / GRAVITY;
        let readable = attitude.sum_sd < READ_SUM_SD && attitude.speed_sd_mps < MAX_SPEED_SD_MPS;
        self.rail.step(v * dt, readable.then_some([u, bend]));
        if readable {
            let kept = self.read_sd * exp(-v.abs() * dt / READ_M);
            self.read_sd = unusual_sd(attitude.sum_sd).max(kept);
        }
        self.brake += dt / (BRAKE_LAG_S + dt) * (reading.brake - self.brake);
        let drag = self.air.drag(v);
        let traction = self
            .torques
            .traction(&reading.channels, v, dt)
            .map(|[force, variance]| [force - drag, variance]);
        let [used, slipping] = attitude.wheels;
        let standing = reading
            .speed_mps
            .is_some_and(|v| v.abs() < self.standstill_mps);
        self.load.observe(standing, dt);
        let input = BlockInput {
            speed_mps: v,
            speed_noise_mps: attitude.speed_noise_mps,
            sum_sd: attitude.sum_sd,
            mass_kg,
            acceleration_mps2: attitude.acceleration_mps2,
            traction,
            traction_lag_s: self.torques.lag_s(),
            seen_walk: self.attitude.seen_walk(),
            bend_per_m: bend,
            brake: self.brake,
            sound: attitude.imu
                && attitude.sum_sd < self.max_sum_sd
                && !standing
                && (used > 0 || reading.new_speed_mps.is_none()),
            slip: slipping > 0,
            doubt: self.torques.doubt(),
        };
        Some((attitude, input))
    }

    /// Gives the validity rule the signals of a step: what the instruments read, and the normalised innovation squared
    /// of a block of the force balance with its length, s.
    pub fn supervise(&mut self, reading: &Reading, block: Option<(Real, Real)>, dt: Real) {
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
        if let Some((nis, period_s)) = block {
            self.validity
                .innovation(Source::ForceBalance, nis, period_s);
            self.load.sample();
        }
    }

    /// Estimates of the core alone: grade at the IMU and speed.
    pub fn estimate(&self, t: Time) -> Estimate {
        let found = self.attitude.found();
        let (innovation, nis) = self.attitude.innovation();
        Estimate {
            t,
            grade_rad: Value {
                value: self.attitude.grade_at_imu_rad(),
                sd: self.attitude.grade_at_imu_sd_rad(),
                valid: self.is_awake(),
            },
            speed_mps: Value {
                value: found.speed_mps,
                sd: found.speed_sd_mps,
                valid: self.is_awake(),
            },
            innovation,
            nis,
            ..Estimate::default()
        }
    }

    /// Marks an estimate by the validity rule; `mass` is true if a mass is estimated.
    pub fn publish(&mut self, mut estimate: Estimate, mass: bool) -> Estimate {
        estimate.total_mass_kg.valid &= self.load.is_confirmed();
        self.validity.publish(estimate, mass)
    }

    /// True if from this step on another load may hang on the train: it has stood for long enough.
    pub fn may_have_another_load(&self) -> bool {
        self.load.begins()
    }

    /// True while there is an attitude and a speed of samples that still come.
    pub fn is_awake(&self) -> bool {
        self.started && self.attitude.is_awake()
    }

    /// True if there is also rail that was read.
    pub fn is_placed(&self) -> bool {
        self.is_awake() && self.rail.is_known()
    }

    /// True if the last step has lost the place on the rail: what was read before is forgotten.
    pub fn has_lost_place(&self) -> bool {
        self.lost
    }

    /// True if the vehicle moves by its wheels.
    pub fn is_moving(&self, reading: &Reading) -> bool {
        reading
            .speed_mps
            .is_some_and(|v| v.abs() > self.standstill_mps)
    }

    /// Time that the torques may be late, s.
    pub fn torque_lag_s(&self) -> Real {
        self.torques.lag_s()
    }

    /// The attitude filter.
    pub fn attitude(&self) -> &AttitudeFilter {
        &self.attitude
    }

    /// The bend of a road, now and behind a low-pass; none on a rail.
    pub fn bends(&self) -> &Bends {
        &self.bends
    }

    /// The rail that was read.
    pub fn rail(&self) -> &RailMemory {
        &self.rail
    }

    /// Standard deviation of the sine of the grade read under the train, beyond that of a calm instrument.
    pub fn read_sd(&self) -> Real {
        self.read_sd
    }

    /// Standard deviation that the mount and the reading of the rail add to that of the pitch, rad.
    pub fn constant_sd_rad(&self) -> Real {
        let mount = self.attitude.mount_sd_rad();
        sqrt(mount * mount + self.read_sd * self.read_sd)
    }
}

/// The part of a standard deviation of sin θ + b/g that a calm instrument does not have.
fn unusual_sd(sum_sd: Real) -> Real {
    sqrt((sum_sd * sum_sd - CALM_SUM_SD * CALM_SUM_SD).max(0.0))
}

/// The layout by the drawings, scaled to the tare; without drawings an even spread that does not swing.
pub fn layout(vehicle: &Vehicle) -> MassLayout {
    match vehicle.layout {
        Some(layout) => layout.scaled_to(vehicle.tare_kg),
        None => MassLayout::even(vehicle.tare_kg, vehicle.tare_span_m, vehicle.load_span_m),
    }
}

state!(TrainCore { validity, load, bends, attitude, rail, torques, brake, read_sd, started, lost; standstill_mps, air, max_sum_sd });
