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

use crate::api::aid::AidStatus;
use crate::api::estimator::Internal;
use crate::api::params::param_groups;
use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, PI, sqrt};
use crate::api::signals::{Estimate, Flags, Protection, Value, Vehicle};
use crate::api::snapshot::{Archive, State, state};
use crate::detect::validity::Integrity;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::fusion::attitude::survey::LaggedGrade;
use crate::fusion::effective::EffectiveGrade;
use crate::fusion::swing_balance::SwingMass;
use crate::fusion::swing_balance::params::{SwingBalanceParams, SwingSupervision};
use crate::fusion::train_core::{TrainCore, layout};
use crate::fusion::train_source::{CoreSignals, TrainInput, TrainSample, TrainSource};
use crate::models::swing_balance::{ANGLE, D, ETA, LENGTH, Nominal, R0};
use crate::rail::train_means::TrainOnRail;
use crate::runner::{Pipeline, copy_into};
use crate::{Real, Time};

param_groups! {
    /// Parameters of the rail fusion.
    Params { attitude: AttitudeParams, balance: SwingBalanceParams, attitude_supervision: AttitudeSupervision, balance_supervision: SwingSupervision, integrity: Integrity }
}

/// Limits of its source: a load that swings is weighed on rail read well.
const SIGNALS: CoreSignals = CoreSignals {
    max_sum_sd: 0.003,
    gyro_check: true,
};

/// The pipeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RailFusion {
    source: TrainSource,
    core: TrainCore,
    nominal: Nominal,
    force_fusion: bool,
    mass: SwingMass,
    effective: EffectiveGrade,
    /// Grade with a fixed lag in distance, of the last step.
    lagged: LaggedGrade,
}

/// Builds the estimator from the vehicle's nominal values and the parameters.
pub fn new(vehicle: &Vehicle, params: &Params) -> RailFusion {
    let layout = layout(vehicle);
    let train = TrainOnRail::new(&layout, params.balance_supervision.depth);
    let [bias_sd, _] = params.attitude.bias_sd(vehicle);
    let mount_sd = GRAVITY * params.attitude.mount_sd_deg * PI / 180.0;
    let bias_sd = sqrt(bias_sd * bias_sd + mount_sd * mount_sd);
    let nominal = Nominal::new(vehicle, &layout, params.balance.mass0_kg, bias_sd);
    RailFusion {
        source: TrainSource::new(
            vehicle,
            params.attitude,
            params.attitude_supervision,
            &params.integrity,
            (&params.balance, params.balance_supervision.torque_monitor),
            SIGNALS,
        ),
        core: TrainCore::new(vehicle, train.span_m(), params.integrity),
        nominal,
        force_fusion: params.balance_supervision.force_fusion,
        mass: SwingMass::new(
            nominal,
            train,
            params.balance,
            params.balance_supervision,
            vehicle.drives,
            params.integrity.protection_sd,
        ),
        effective: EffectiveGrade::default(),
        lagged: LaggedGrade::default(),
    }
}

impl RailFusion {
    fn fuse(&mut self, sample: &TrainSample, dt: Real) {
        let mass_kg = self.mass.mass_kg();
        let rail = self.core.rail();
        if self.core.has_lost_place() {
            self.mass.lose_place(rail.behind_sd_rad());
            self.effective = EffectiveGrade::default();
            return;
        }
        if self.core.may_have_another_load() {
            self.mass.open_load();
        }
        let by_force = self.mass.step(&sample.block, mass_kg, rail, dt);
        if let Some(by_force) = by_force.filter(|_| self.force_fusion) {
            self.effective.correct(&by_force);
        }
        self.effective.step(
            &sample.unit,
            self.mass.train(),
            &self.mass.carried(),
            rail,
            dt,
        );
    }

    fn estimate(&mut self, input: &TrainInput) -> Estimate {
        let [mass, mass_sd] = self.mass.published();
        let total_mass_kg = Value::new(mass, mass_sd, input.is_awake() && self.mass.is_known());
        let estimate = Estimate {
            total_mass_kg,
            effective_grade_rad: self.effective.value(self.core.is_placed(input)),
            protection: Protection {
                total_mass_kg: self.mass.found().protection_kg,
                ..Protection::default()
            },
            flags: Flags {
                moving: input.moving,
                excited: self.mass.is_known(),
                saturated: false,
            },
            ..input.estimate()
        };
        self.core.publish(estimate)
    }
}

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
        Internal::new("separation_sd_rad", "rad"),
        Internal::new("load_hypotheses", "-"),
        Internal::new("load_weight", "-"),
        Internal::new("torque_lag_s", "s"),
        Internal::new("read_sd", "-"),
        Internal::new("wheel_scale_sd", "-"),
        Internal::new("imu_arm_m", "m"),
        Internal::new("lagged_grade_rad", "rad"),
        Internal::new("lagged_grade_sd_rad", "rad"),
        Internal::new("heading_rad", "rad"),
        Internal::new("heading_sd_rad", "rad"),
    ];

    fn advance(&mut self, reading: &Reading, t: Time, dt: Real) -> Estimate {
        let input = self.source.step(reading, self.mass.mass_kg(), t, dt);
        if let Some(sample) = &input.sample {
            self.core.take(sample, input.speed_mps.sd, input.dt);
            self.fuse(sample, input.dt);
        }
        self.core.supervise(&input, self.mass.new_nis());
        self.lagged = input.lagged;
        self.estimate(&input)
    }

    fn internal_values(&self, values: &mut [Real]) {
        let attitude = self.source.attitude();
        let found = attitude.found();
        let mass = self.mass.found();
        let x = &mass.x;
        let [bias_sd, read_sd, scale_sd, arm_m] = attitude.reading();
        let [heading, heading_sd] = attitude.heading();
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
                attitude.separation_sd_rad(),
                self.mass.bank().hypotheses().len() as Real,
                self.mass.bank().heaviest().weight,
                self.source.torque_lag_s(),
                read_sd,
                scale_sd,
                arm_m,
                self.lagged.grade_rad,
                self.lagged.sd_rad,
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
        let [wheels, lateral, vertical] = self.source.attitude().aid_status();
        copy_into(status, &[wheels, lateral, vertical, self.mass.status()]);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(RailFusion { source, core, mass, effective, lagged; nominal, force_fusion });
