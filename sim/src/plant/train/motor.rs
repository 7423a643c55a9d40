//! Traction motor and clamp: commands become torque and force with the lag and limits of the machine.

use crate::fading::faded;
use crate::train::Drive;

/// First-order lag, of second order in the step and stable for any step; its mean is such that no impulse is lost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lag {
    /// Output, in the unit of the input.
    pub value: f64,
}

impl Lag {
    /// Advance by `dt` towards `target` with time constant `tau` (both s); the mean over the step.
    pub fn step(&mut self, target: f64, tau: f64, dt: f64) -> f64 {
        let off = self.value - target;
        let share = tau / (tau * (tau + dt) + 0.5 * dt * dt);
        self.value = faded(target + off * share * tau);
        target + off * share * (tau + 0.5 * dt)
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

/// Wheel rate around standstill over which the gear's losses change from those of braking to those of driving, rad/s.
const BLENDED_RADPS: f64 = 0.05;

/// Torque at the two wheels together for a motor torque, N·m: the gear's losses lessen a driving torque and add to a
/// braking one. Around standstill the two are blended over 0.05 rad/s of wheel rate.
pub fn wheel_torque(d: &Drive, motor: f64, omega: f64) -> f64 {
    let driving = 0.5 * (1.0 + (motor.signum() * omega / BLENDED_RADPS).clamp(-1.0, 1.0));
    let driving = if omega == 0.0 { 1.0 } else { driving };
    motor * d.gear_ratio * (driving * d.efficiency_drive + (1.0 - driving) / d.efficiency_brake)
}

/// Largest loss of the torque of [`wheel_torque`] for each rad/s, at rates near those at which it has one, N·m·s.
pub(super) fn wheel_damping(d: &Drive, motor: f64, omega: f64) -> f64 {
    if omega.abs() >= 3.0 * BLENDED_RADPS {
        return 0.0;
    }
    let lost = 1.0 / d.efficiency_brake - d.efficiency_drive;
    motor.abs() * d.gear_ratio * lost * 0.5 / BLENDED_RADPS
}

/// Traction motor: torque with rate limit, lag and envelope.
#[derive(Clone, Copy, Debug, Default)]
pub struct TractionMotor {
    asked: f64,
    lag: Lag,
}

impl TractionMotor {
    /// Advance by `dt` (s) towards `command` (N·m) at wheel rate `omega` (rad/s); mean torque at the motor shaft, N·m.
    pub fn step(&mut self, d: &Drive, command: f64, omega: f64, dt: f64) -> f64 {
        let most = d.rate_nmps * dt;
        let moved = (command - self.asked).clamp(-most, most);
        // The ramp ends within the step, or at its end.
        let ramp = if most > 0.0 { moved.abs() / most } else { 0.0 };
        let limited = |asked: f64| envelope(d, asked, omega * d.gear_ratio);
        let mean = limited(self.asked + moved * (1.0 - 0.5 * ramp));
        self.asked = limited(self.asked + moved);
        self.lag.step(mean, d.lag_s, dt)
    }

    /// Torque now, N·m.
    pub fn torque(&self) -> f64 {
        self.lag.value
    }
}
