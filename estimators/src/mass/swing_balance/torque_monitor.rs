//! Torque monitor: traction from the motor torques, each compared with the others and all with the command.

use crate::Real;
use crate::api::real::{sqrt, within};
use crate::api::signals::{MAX_DRIVES, Vehicle};
use crate::api::snapshot::state;
use crate::preprocess::front_end::Channels;

use super::params::SwingBalanceParams;

/// Speed of the rim over which the gear's efficiency changes sides, m/s.
const BLEND_MPS: Real = 0.0085;
/// Low-pass behind which torques are compared, s.
const LAG_S: Real = 0.3;
/// Standard deviations beyond which a drive differs from the others, and the mean from the command.
const GATE_SD: Real = 6.0;
/// Share of the torque that drives may share it unequally by, beyond noise and gain.
const UNEQUAL: Real = 0.02;

/// Torques of all drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueMonitor {
    on: bool,
    drives: usize,
    noise: [Real; 2],
    gain_sd: Real,
    /// N per N·m without losses, and the efficiency.
    per_nm: Real,
    efficiency: Real,
    smooth: [Real; MAX_DRIVES],
    commanded: Real,
    used: u32,
    doubt: bool,
}

impl TorqueMonitor {
    /// From the vehicle's nominal values and the sensor sheet.
    pub fn new(vehicle: &Vehicle, params: &SwingBalanceParams, on: bool) -> Self {
        Self {
            on,
            drives: vehicle.drives.min(MAX_DRIVES),
            noise: [params.torque_noise, params.torque_noise_nm],
            gain_sd: params.torque_gain_sd,
            per_nm: vehicle.gear_ratio / vehicle.wheel_radius_m,
            efficiency: vehicle.efficiency,
            smooth: [0.0; MAX_DRIVES],
            commanded: 0.0,
            used: 0,
            doubt: false,
        }
    }

    /// Traction at the rims, N, and its variance; `None` while fewer than half of the drives are known.
    pub fn traction(&mut self, z: &Channels, speed_mps: Real, dt: Real) -> Option<[Real; 2]> {
        let share = dt / (LAG_S + dt);
        let drives = self.drives.max(1) as Real;
        let commands = z.commanded_torque_nm.iter().take(self.drives);
        self.commanded += share * (commands.sum::<Real>() / drives - self.commanded);
        for (smooth, torque) in self.smooth.iter_mut().zip(&z.motor_torque_nm) {
            *smooth += share * (torque.unwrap_or(*smooth) - *smooth);
        }
        let median = self.median(z);
        let limit = self.limit(median);
        let (mut count, mut force, mut variance) = (0u32, 0.0, 0.0);
        let [relative, constant] = self.noise;
        for (torque, smooth) in z.motor_torque_nm.iter().zip(&self.smooth).take(self.drives) {
            let Some(torque) = torque else { continue };
            if self.on && self.drives > 2 && (smooth - median).abs() > limit {
                continue;
            }
            let gain = self.gain(*torque, speed_mps);
            count += 1;
            force += torque * gain;
            let noise = relative * torque;
            variance += (noise * noise + constant * constant) * gain * gain;
        }
        self.used = count;
        self.doubt = self.contradicts_command(median);
        if count == 0 || 2 * (count as usize) < self.drives {
            return None;
        }
        let all = self.drives as Real / Real::from(count as f32);
        Some([force * all, variance * all * all])
    }

    /// Whether the torques contradict the command.
    pub fn doubt(&self) -> bool {
        self.on && self.doubt
    }

    /// Drives whose torque is in use.
    pub fn used(&self) -> u32 {
        self.used
    }

    /// N at the rim per N·m at the motor: with the efficiency when driving, by it when braking.
    fn gain(&self, torque: Real, speed_mps: Real) -> Real {
        let sign = if torque < 0.0 { -1.0 } else { 1.0 };
        let driving = 0.5 * (1.0 + within(sign * speed_mps / BLEND_MPS, -1.0, 1.0));
        self.per_nm * (driving * self.efficiency + (1.0 - driving) / self.efficiency)
    }

    fn limit(&self, torque: Real) -> Real {
        let [relative, constant] = self.noise;
        let share = relative * relative + self.gain_sd * self.gain_sd + UNEQUAL * UNEQUAL;
        GATE_SD * sqrt(share * torque * torque + constant * constant)
    }

    fn median(&self, z: &Channels) -> Real {
        let mut known = [0.0; MAX_DRIVES];
        let mut count = 0;
        let drives = z.motor_torque_nm.iter().zip(&self.smooth).take(self.drives);
        for ((_, smooth), place) in drives.filter(|(t, _)| t.is_some()).zip(&mut known) {
            *place = *smooth;
            count += 1;
        }
        let Some(known) = known.get_mut(..count).filter(|k| !k.is_empty()) else {
            return 0.0;
        };
        known.sort_unstable_by(Real::total_cmp);
        let upper = known.get(count / 2).copied().unwrap_or(0.0);
        let lower = known.get((count - 1) / 2).copied().unwrap_or(0.0);
        0.5 * (lower + upper)
    }

    fn contradicts_command(&self, median: Real) -> bool {
        let command = self.commanded;
        // Without a command there is nothing to compare with.
        command != 0.0 && (median - command).abs() > self.limit(command)
    }
}

state!(TorqueMonitor { smooth, commanded, used, doubt; on, drives, noise, gain_sd, per_nm, efficiency });
