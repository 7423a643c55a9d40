//! What the two-stage pipelines share: signals → mass regression → slope filter with that mass → estimate.

use super::{
    copy_into,
    force_balance::ForceBalance,
    front_end::{FrontEnd, Reading},
    mass_regression::MassRegression,
    slope_filter::{Drive, SlopeFilter},
};
use crate::{
    Error, Real,
    real::sqrt,
    signals::{Command, Estimate, Flags, Measurements, Value},
};

/// Share of the clamp brake above which the force balance is not used: the brake force is not measured.
pub const BRAKE_RELEASED: Real = 0.01;

/// Mass first, then slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassThenSlope {
    /// Checks and merges samples.
    pub front_end: FrontEnd,
    /// Constants of the force balance.
    pub balance: ForceBalance,
    /// First stage.
    pub mass: MassRegression,
    /// Second stage.
    pub slope: SlopeFilter,
    /// Speed below which the train counts as standing, m/s.
    pub standstill_mps: Real,
}

impl MassThenSlope {
    /// Names of [`MassThenSlope::internal_values`].
    pub const INTERNALS: &'static [&'static str] = &[
        "lambda",
        "mass_residual_n",
        "running_resistance",
        "accel_bias_mps2",
        "load_changes",
        "windup_limit",
        "wheel_speed_sd_mps",
        "slope_filter_sd_rad",
    ];

    /// One step; on an error nothing is changed.
    pub fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        let mut next = *self;
        let reading = next.front_end.read(z, u, dt)?;
        let estimate = next.advance(&reading, z.t_s, dt);
        if !estimate.is_finite() {
            return Err(Error::Diverged);
        }
        *self = next;
        Ok(estimate)
    }

    fn advance(&mut self, reading: &Reading, t_s: Real, dt: Real) -> Estimate {
        let moving = reading
            .speed_mps
            .is_some_and(|v| v.abs() > self.standstill_mps);
        let running = moving && reading.brake <= BRAKE_RELEASED;
        self.mass.step(reading, &self.balance, running, dt);

        let mass_kg = self.mass.mass_kg();
        let drive = reading
            .motor_torque_nm
            .zip(reading.speed_mps)
            .filter(|_| running)
            .map(|(torque, speed)| Drive {
                traction_n: self.balance.traction(torque, speed),
                mass_kg: mass_kg.value,
                resistance: self.mass.running_resistance() * if speed < 0.0 { -1.0 } else { 1.0 },
            });
        self.slope.predict(drive, dt);
        if let Some(speed) = reading.new_speed_mps {
            self.slope.update(speed, running);
        }

        let belief = self.slope.belief();
        let parameters_sd = drive.map_or(0.0, |drive| {
            self.mass.slope_sd_rad(
                self.slope.steady_traction_n(&drive),
                if drive.resistance < 0.0 { -1.0 } else { 1.0 },
            )
        });
        let (innovation, nis) = self.slope.innovation();
        let saturated = self.mass.saturated() || self.slope.saturated();
        let grade_sd = sqrt(belief.P.m22 + parameters_sd * parameters_sd);
        Estimate {
            t_s,
            total_mass_kg: mass_kg,
            grade_rad: Value {
                value: belief.x.y,
                sd: grade_sd,
                valid: running && mass_kg.valid && grade_sd < 0.05,
            },
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
                saturated,
            },
        }
    }

    /// Internals for plots, in the order of [`MassThenSlope::INTERNALS`].
    pub fn internal_values(&self, values: &mut [Real]) {
        let now = [
            self.mass.lambda(),
            self.mass.residual_n(),
            self.mass.running_resistance(),
            self.mass.accel_bias_mps2(),
            self.mass.resets() as Real,
            if self.mass.limited() { 1.0 } else { 0.0 },
            self.slope.measurement_sd(),
            sqrt(self.slope.belief().P.m22),
        ];
        copy_into(values, &now);
    }
}
