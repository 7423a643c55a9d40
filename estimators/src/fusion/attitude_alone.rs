//! Attitude alone: the grade under a vehicle from gyro, accelerometer and wheels, on a rail or a road.
//!
//! It estimates no mass, and the grade of the vehicle as a point: the effective grade of a train is not valid. A road
//! vehicle leans on its springs: the lean per acceleration (`pitch_lean_rad_per_mps2`) is taken off the attitude of the
//! body. Source: ours ([`crate::fusion::attitude`]).

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::real::{lag, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::plausibility::{Instruments, Plausibility};
use crate::detect::validity::{Integrity, Source, Validity};
use crate::fusion::attitude::AttitudeFilter;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::methods::published::no_mass;
use crate::models::attitude::{BIAS_X, GYRO_Y, PHI, SCALE, THETA};
use crate::preprocess::front_end::Reading;
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Lean of the body, and validity.
    LeanParams {
        pitch_lean_rad_per_mps2 ["rad/(m/s²)"] = 0.0, -0.1 => 0.1, "Pitch of the body against the road, nose up, per forward acceleration.";
        lean_sd ["-"] = 0.3, 0.0 => 2.0, "Standard deviation of the lean, as a share of it.";
        lean_lag_s ["s"] = 0.2, 0.001 => 5.0, "Lag of the body behind the acceleration.";
    }
}

param_groups! {
    /// Parameters of the attitude estimator.
    Params { attitude: AttitudeParams, lean: LeanParams, attitude_supervision: AttitudeSupervision, integrity: Integrity }
}

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudePipeline {
    lean: LeanParams,
    mass: Value,
    standstill_mps: Real,
    point: bool,
    plausibility: Plausibility,
    validity: Validity,
    filter: AttitudeFilter,
    acceleration_mps2: Real,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> AttitudePipeline {
    AttitudePipeline {
        lean: params.lean,
        mass: no_mass(vehicle),
        standstill_mps: vehicle.standstill_mps(None),
        point: vehicle.is_point(),
        plausibility: Plausibility::new(
            params.integrity.plausibility,
            Instruments {
                accelerometer: true,
                // As in rail_fusion.
                gyro: vehicle.road.is_some(),
                spare_gyro: vehicle.road.is_none(),
            },
            vehicle.standstill_mps(None),
        ),
        validity: Validity::new(params.integrity),
        filter: AttitudeFilter::new(
            vehicle,
            params.attitude,
            params.attitude_supervision,
            &params.integrity,
        ),
        acceleration_mps2: 0.0,
    }
}

impl Pipeline for AttitudePipeline {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("pitch_rad", "rad"),
        Internal::new("roll_rad", "rad"),
        Internal::new("accel_bias_mps2", "m/s²"),
        Internal::new("gyro_bias_radps", "rad/s"),
        Internal::new("wheel_scale", "-"),
        Internal::new("lean_rad", "rad"),
        Internal::new("accel_bias_sd_mps2", "m/s²"),
        Internal::new("read_sd", "-"),
        Internal::new("wheel_scale_sd", "-"),
        Internal::new("imu_arm_m", "m"),
        Internal::new("lagged_grade_rad", "rad"),
        Internal::new("lagged_grade_sd_rad", "rad"),
        Internal::new("heading_rad", "rad"),
        Internal::new("heading_sd_rad", "rad"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let pitch_rate = reading.pitch_rate_radps.filter(|_| self.filter.uses_gyro());
        let plausible = self.plausibility.step(reading, pitch_rate, dt);
        self.validity.observe(plausible, dt);
        if !self.plausibility.gyro_is_sound() {
            self.filter.leave_gyro_out();
        }
        let found = self.filter.step(&reading.channels, dt);
        if let Some(nis) = self.filter.new_nis() {
            self.validity.innovation(Source::WheelSpeed, nis, dt);
        }
        let awake = found.is_some() && self.filter.is_awake();
        let found = found.unwrap_or_default();
        self.acceleration_mps2 +=
            lag(dt, self.lean.lean_lag_s) * (found.acceleration_mps2 - self.acceleration_mps2);
        let lean = self.lean_rad();
        let lean_sd = self.lean.lean_sd * lean;
        let sd = self.filter.grade_at_imu_sd_rad();
        let sd = sqrt(sd * sd + lean_sd * lean_sd);
        let (innovation, nis) = self.filter.innovation();
        let grade = |angle: Real| Value {
            value: angle - lean,
            sd,
            valid: awake,
        };
        let estimate = Estimate {
            t,
            total_mass_kg: self.mass,
            grade_rad: grade(self.filter.grade_at_imu_rad()),
            // The effective grade of a long train is another; nothing here finds it.
            effective_grade_rad: Value {
                valid: awake && self.point,
                ..grade(found.pitch_rad)
            },
            speed_mps: Value {
                value: found.speed_mps,
                sd: found.speed_sd_mps,
                valid: awake,
            },
            innovation,
            nis,
            flags: Flags {
                moving: reading
                    .speed_mps
                    .is_some_and(|v| v.abs() > self.standstill_mps),
                excited: false,
                saturated: false,
            },
        };
        self.validity.publish(estimate, false)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let x = &self.filter.belief().x;
        let [bias_sd, read_sd, scale_sd, arm_m] = self.filter.reading();
        let lagged = self.filter.lagged_grade();
        let lean = self.lean_rad();
        let lean_sd = self.lean.lean_sd * lean;
        let [heading, heading_sd] = self.filter.heading();
        copy_into(
            values,
            &[
                x[THETA],
                x[PHI],
                x[BIAS_X],
                x[GYRO_Y],
                x[SCALE],
                lean,
                bias_sd,
                read_sd,
                scale_sd,
                arm_m,
                lagged.grade_rad - lean,
                sqrt(lagged.sd_rad * lagged.sd_rad + lean_sd * lean_sd),
                heading,
                heading_sd,
            ],
        );
    }

    const AID_SOURCES: &'static [&'static str] = AttitudeFilter::AID_SOURCES;

    fn aid_status(&self, status: &mut [AidStatus]) {
        copy_into(status, &self.filter.aid_status());
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

impl AttitudePipeline {
    fn lean_rad(&self) -> Real {
        self.lean.pitch_lean_rad_per_mps2 * self.acceleration_mps2
    }
}

state!(AttitudePipeline { plausibility, validity, filter, acceleration_mps2; lean, mass, standstill_mps, point });
