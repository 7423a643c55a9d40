//! What the two-stage pipelines share: signals → mass regression → slope filter with that mass → estimate.

use crate::api::estimator::Internal;
use crate::api::real::sqrt;
use crate::api::signals::{Estimate, Flags, Value};
use crate::api::snapshot::{Archive, State, state};
use crate::grade::force_balance_ekf::{Drive, ForceBalanceEkf, MAX_GRADE_RAD};
use crate::models::distributed_train::steeper;
use crate::models::force_balance::ForceBalance;
use crate::pipelines::runner::{Pipeline, copy_into};
use crate::preprocess::sample_hold::Reading;
use crate::{Real, Time};

/// Share of the clamp brake above which the force balance is not used: the brake force is not measured.
pub const BRAKE_RELEASED: Real = 0.001;

/// Whether the train moves, and whether it does so under the force balance alone (brake released).
pub fn motion(reading: &Reading, standstill_mps: Real) -> (bool, bool) {
    let moving = reading.speed_mps.is_some_and(|v| v.abs() > standstill_mps);
    (moving, moving && reading.brake <= BRAKE_RELEASED)
}

/// A first stage: something that learns the mass while the train runs.
pub trait MassEstimator: Copy {
    /// Names of [`MassEstimator::internals`].
    const INTERNALS: &'static [Internal; 6];

    /// One step. `running` tells that the force balance holds now: moving, brake released.
    fn step(&mut self, reading: &Reading, balance: &ForceBalance, running: bool, dt: Real);

    /// Total mass, kg.
    fn mass_kg(&self) -> Value;

    /// Running-resistance coefficient to go with that mass.
    fn running_resistance(&self) -> Real;

    /// Standard deviation, rad, that the uncertainty of mass and resistance gives to a slope computed from the force balance
    /// with the traction (N) and the direction of travel, ±1.
    fn slope_sd_rad(&self, traction_n: Real, direction: Real) -> Real;

    /// What a bend takes from the traction, N: 0 for a stage that knows no bends.
    fn bend_n(&self) -> Real {
        0.0
    }

    /// By how much sin θ at the IMU is above that of the effective grade, and the standard deviation of that: 0 for a stage that takes the
    /// train for a point.
    ///
    /// `theta` is that effective grade, rad.
    fn imu_grade_offset(&self, _theta: Real) -> (Real, Real) {
        (0.0, 0.0)
    }

    /// An effective grade, rad, that is vouched for, `dt` seconds after the last step.
    fn valid_effective_grade(&mut self, _theta: Real, _dt: Real) {}

    /// The grade angle, rad, that the second stage has found with this mass; most first stages need none.
    fn stage_two_grade(&mut self, _theta: Real) {}

    /// Whether it is excited and learns.
    fn excited(&self) -> bool;

    /// Whether a limit acts.
    fn saturated(&self) -> bool;

    /// Its own quantities, for plots.
    fn internals(&self) -> [Real; 6];
}

/// Mass first, then slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoStage<M> {
    /// Constants of the force balance.
    pub balance: ForceBalance,
    /// First stage.
    pub mass: M,
    /// Second stage.
    pub slope: ForceBalanceEkf,
    /// Speed below which the train counts as standing, m/s.
    pub standstill_mps: Real,
}

impl<M: MassEstimator + State> Pipeline for TwoStage<M> {
    const INTERNALS: &'static [Internal] = {
        let [a, b, c, d, e, f] = *M::INTERNALS;
        &[
            a,
            b,
            c,
            d,
            e,
            f,
            Internal::new("wheel_speed_sd_mps", "m/s"),
            Internal::new("slope_filter_sd_rad", "rad"),
            Internal::new("fading", "-"),
        ]
    };

    fn advance(&mut self, reading: &Reading, t_s: Time, dt: Real) -> Estimate {
        let (moving, running) = motion(reading, self.standstill_mps);
        self.mass.step(reading, &self.balance, running, dt);

        let mass_kg = self.mass.mass_kg();
        let direction = if reading.speed_mps.is_some_and(|v| v < 0.0) {
            -1.0
        } else {
            1.0
        };
        let torque_and_speed = reading
            .motor_torque_nm
            .zip(reading.speed_mps)
            .filter(|_| running);
        let drive = torque_and_speed.map(|(torque, speed)| Drive {
            traction_n: self.balance.net_traction(torque, speed) - self.mass.bend_n(),
            mass_kg: mass_kg.value,
            resistance: self.mass.running_resistance() * direction,
        });
        self.slope.predict(drive, dt);
        if moving && drive.is_none() {
            self.slope.drift(dt);
        }
        if let Some(speed) = reading.new_speed_mps {
            self.slope.update(speed, running);
        }

        let belief = self.slope.belief();
        self.mass.stage_two_grade(belief.x.y);
        let parameters_sd = drive.map_or(0.0, |drive| {
            self.mass
                .slope_sd_rad(self.slope.steady_traction_n(&drive), direction)
        });
        let (innovation, nis) = self.slope.innovation();
        let effective_sd = sqrt(belief.P.m22 + parameters_sd * parameters_sd);
        let effective_grade_rad = Value {
            value: belief.x.y,
            sd: effective_sd,
            valid: running
                && mass_kg.valid
                && effective_sd < 0.05
                && self.slope.wheel_speed_consistent()
                && self.slope.grade_observable(),
        };
        if effective_grade_rad.valid {
            self.mass.valid_effective_grade(belief.x.y, dt);
        }
        let (lead, lead_sd) = self.mass.imu_grade_offset(belief.x.y);
        let grade_sd = sqrt(effective_sd * effective_sd + lead_sd * lead_sd);
        Estimate {
            t_s,
            total_mass_kg: mass_kg,
            grade_rad: Value {
                value: steeper(belief.x.y, lead).clamp(-MAX_GRADE_RAD, MAX_GRADE_RAD),
                sd: grade_sd,
                valid: effective_grade_rad.valid && grade_sd < 0.05,
            },
            effective_grade_rad,
            speed_mps: Value {
                value: belief.x.x,
                sd: sqrt(belief.P.m11),
                valid: reading.speed_mps.is_some(),
            },
            innovation,
            nis,
            flags: Flags {
                moving,
                excited: self.mass.excited(),
                saturated: self.mass.saturated() || self.slope.saturated(),
            },
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let [a, b, c, d, e, f] = self.mass.internals();
        let slope = &self.slope;
        let now = [
            a,
            b,
            c,
            d,
            e,
            f,
            slope.measurement_sd(),
            sqrt(slope.belief().P.m22),
            slope.fading(),
        ];
        copy_into(values, &now);
    }

    fn visit(&mut self, archive: &mut Archive) {
        State::visit(self, archive);
    }
}

state!(@[M: State] TwoStage<M> { mass, slope; balance, standstill_mps });
