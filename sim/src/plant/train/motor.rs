//! Traction motor and clamp: commands become torque and force with the lag and limits of the machine.

use crate::fading::faded;
use crate::train::Drive;

/// First-order lag, exact at rest and stable for any step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lag {
    /// Output, in the unit of the input.
    pub value: f64,
}

impl Lag {
    /// Advance by `dt` towards `target` with time constant `tau` (both s).
    pub fn step(&mut self, target: f64, tau: f64, dt: f64) -> f64 {
        self.value = faded(self.value + (target - self.value) * dt / (tau + dt));
        self.value
    }
}

/// Driving torque falls to nothing over this share of the largest speed beyond it.
const CUT_OFF_SHARE: f64 = 0.02;

/// Torque the motor may give at rate `omega_m` (rad/s): constant torque, then constant power, nothing that drives
/// beyond the cut-off speed; N·m at the motor shaft.
pub fn envelope(d: &Drive, asked: f64, omega_m: f64) -> f64 {
    let by_power = d.power_w / omega_m.abs().max(1e-9);
    let mut limit = d.torque_max_nm.min(by_power);
    if asked * omega_m > 0.0 {
        let over = omega_m.abs() / d.speed_max_radps - 1.0;
        limit *= 1.0 - (over / CUT_OFF_SHARE).clamp(0.0, 1.0);
    }
    asked.clamp(-limit, limit)
}

/// Torque at the two wheels together for a motor torque, N·m: the gear's losses lessen a driving torque and add to a
/// braking one. Around standstill the two are blended over 0.05 rad/s of wheel rate.
pub fn wheel_torque(d: &Drive, motor: f64, omega: f64) -> f64 {
    let driving = 0.5 * (1.0 + (motor.signum() * omega / 0.05).clamp(-1.0, 1.0));
    let driving = if omega == 0.0 { 1.0 } else { driving };
    motor * d.gear_ratio * (driving * d.efficiency_drive + (1.0 - driving) / d.efficiency_brake)
}

/// Traction motor: torque with rate limit, lag and envelope.
#[derive(Clone, Copy, Debug, Default)]
pub struct TractionMotor {
    asked: f64,
    lag: Lag,
}

impl TractionMotor {
    /// Advance by `dt` (s) towards `command` (N·m) at wheel rate `omega` (rad/s); torque at the motor shaft, N·m.
    pub fn step(&mut self, d: &Drive, command: f64, omega: f64, dt: f64) -> f64 {
        let step = d.rate_nmps * dt;
        self.asked += (command - self.asked).clamp(-step, step);
        self.asked = envelope(d, self.asked, omega * d.gear_ratio);
        self.lag.step(self.asked, d.lag_s, dt)
    }

    /// Torque now, N·m.
    pub fn torque(&self) -> f64 {
        self.lag.value
    }
}
