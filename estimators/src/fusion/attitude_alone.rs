//! Attitude alone: the grade under a vehicle from gyro, accelerometer and wheels, on a rail or a road.
//!
//! It estimates no mass, and the grade of the vehicle as a point: the effective grade of a train is not valid. A road
//! vehicle leans on its springs: the lean per acceleration (`pitch_lean_rad_per_mps2`) is taken off the attitude of the
//! body. Source: ours ([`crate::fusion::attitude`]).

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::{param_groups, params};
use crate::api::reading::Reading;
use crate::api::real::{lag, sqrt};
use crate::api::signals::{Estimate, Flags, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::plausibility::{Instruments, Plausibility};
use crate::detect::validity::{Integrity, Source, Validity};
use crate::fusion::attitude::AttitudeFilter;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::methods::published::no_mass;
use crate::models::attitude::{BIAS_X, GYRO_Y, PHI, SCALE, THETA};
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

params! {
    /// Lean of the body, and validity.
    LeanParams {
        pitch_lean_rad_per_mps2 ["rad/(m/s²)"] = 0.0, -0.1 => 0.1, "Pitch of the body against the road, nose up, per forward acceleration.";
        lean_sd ["-"] = 0.3, 0.0 => 2.0, "Standard deviation of the lean, as a share of the lean.";
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
        let grade = |angle: Real| Value::new(angle - lean, sd, awake);
        let estimate = Estimate {
            t,
            total_mass_kg: self.mass,
            grade_rad: grade(self.filter.grade_at_imu_rad()),
            // The effective grade of a long train is another; nothing here finds it.
            effective_grade_rad: Value {
                valid: awake && self.point,
                ..grade(found.pitch_rad)
            },
            speed_mps: Value::new(found.speed_mps, found.speed_sd_mps, awake),
            innovation,
            nis,
            flags: Flags {
                moving: reading
                    .speed_mps
                    .is_some_and(|v| v.abs() > self.standstill_mps),
                excited: false,
                saturated: false,
            },
            ..Estimate::default()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::GRAVITY;
    use crate::testing::vehicles::vehicle;

    const DT: Real = 0.01;
    const A: Real = 0.5;

    /// Estimate and internal values of a start at 0.5 m/s² after a second's rest, these seconds on, of a body that
    /// leans by `lean` rad for each m/s².
    fn start(lean: Real, seconds: Real) -> (Estimate, [Real; 14]) {
        let mut params = Params::default();
        params.lean.pitch_lean_rad_per_mps2 = lean;
        (params.integrity.lag_share, params.integrity.nis_monitor) = (0.0, false);
        let mut pipeline = new(&vehicle(), &params);
        let mut last = Estimate::default();
        for k in 0..100 + (seconds / DT + 0.5) as u32 {
            let jitter = 1e-5 * Real::from(k % 7);
            let a = if k < 100 { 0.0 } else { A };
            let v = A * DT * Real::from(k.saturating_sub(99));
            let mut reading = Reading {
                speed_mps: Some(v),
                new_speed_mps: Some(v),
                ..Reading::default()
            };
            reading.channels.specific_force_mps2 = Some([a + jitter, jitter, GRAVITY]);
            reading.channels.angular_rate_radps = Some([jitter, 0.0, 0.0]);
            reading.channels.new = [true; 2];
            reading.channels.new_wheel_speed_mps[..8].fill(Some(v));
            last = pipeline.advance(&reading, Time::from_s(DT * Real::from(k)), DT);
        }
        let mut internals = [0.0; 14];
        pipeline.internal_values(&mut internals);
        (last, internals)
    }

    /// The lean of the body follows the acceleration with a lag of 0.2 s. It is taken off every grade, and three tenths
    /// of it, to either side, are in their standard deviations by squares; attitude and speed are those of the body.
    #[test]
    fn the_lean_of_the_body_is_taken_off_the_grade() {
        for seconds in [0.3, 3.0] {
            let (upright, own) = start(0.0, seconds);
            for lean in [0.02, -0.01] {
                let (found, internals) = start(lean, seconds);
                let leans = lean * A * (1.0 - (-seconds / 0.2 as Real).exp());
                assert!(
                    (internals[5] / leans - 1.0).abs() < 0.1,
                    "{} {leans}",
                    internals[5]
                );
                let leans = internals[5];
                let lagged = |of: &[Real; 14]| Value {
                    value: of[10],
                    sd: of[11],
                    valid: true,
                };
                for (upright, found) in [
                    (upright.grade_rad, found.grade_rad),
                    (upright.effective_grade_rad, found.effective_grade_rad),
                    (lagged(&own), lagged(&internals)),
                ] {
                    assert!((upright.value - leans - found.value).abs() < 1e-12);
                    let more = found.sd * found.sd - upright.sd * upright.sd;
                    assert!((more / (0.3 * leans).powi(2) - 1.0).abs() < 1e-6, "{more}");
                }
                assert_eq!(found.speed_mps, upright.speed_mps);
                assert_eq!(internals[..5], own[..5]);
            }
        }
    }

    /// The effective grade of a long train is another; a point has one. It moves by its wheels.
    #[test]
    fn a_long_train_has_no_effective_grade_of_a_point() {
        let (found, _) = start(0.0, 2.0);
        assert!(found.grade_rad.valid && found.effective_grade_rad.valid && found.flags.moving);
        let long = Vehicle::new(crate::api::vehicle::VehicleData {
            tare_span_m: [0.0, 10.0],
            ..vehicle().data()
        });
        assert!(!new(&long.unwrap(), &Params::default()).point);
    }
}
