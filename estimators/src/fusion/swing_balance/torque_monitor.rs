//! Torque monitor: traction from the motor torques, each compared with the others and all with the command.

use crate::Real;
use crate::api::reading::Channels;
use crate::api::real::{sqrt, stored, within};
use crate::api::signals::{MAX_DRIVES, Vehicle};
use crate::api::snapshot::state;
use crate::preprocess::sorted::Sorted;
use crate::tuning::{STATISTICS, TIMES, TORQUE};

use super::params::SwingBalanceParams;

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
    /// Torques after a low-pass, N·m: torques and the mean command. Single precision: they are only compared.
    smooth: [f32; MAX_DRIVES],
    commanded: f32,
    /// Recent change of the command that has not passed the low-pass yet, N·m.
    changing: f32,
    /// Mean difference between the ages of torques and specific force by their stamps, s.
    age_s: Real,
    doubt: bool,
}

impl TorqueMonitor {
    /// Builds the torque monitor from the vehicle's nominal values and the sensor sheet.
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
            changing: 0.0,
            age_s: 0.0,
            doubt: false,
        }
    }

    /// Traction at the rims, N, and its variance; `None` while fewer than half of the drives are known.
    pub fn traction(&mut self, z: &Channels, speed_mps: Real, dt: Real) -> Option<[Real; 2]> {
        let share = dt / (TIMES.brief_s + dt);
        let drives = self.drives.max(1) as Real;
        let commands = z.commanded_torque_nm.get(..self.drives).unwrap_or_default();
        let torques = z.motor_torque_nm.get(..self.drives).unwrap_or_default();
        let commanded = Real::from(self.commanded);
        let change = commands.iter().sum::<Real>() / drives - commanded;
        self.changing = stored(change.abs().max((1.0 - share) * Real::from(self.changing)));
        self.commanded = stored(commanded + share * change);
        for (smooth, torque) in self.smooth.iter_mut().zip(torques) {
            let last = Real::from(*smooth);
            *smooth = stored(last + share * (torque.unwrap_or(last) - last));
        }
        let median = self.median(torques);
        let [torque_s, force_s, _] = z.age_s;
        self.age_s += dt / (TIMES.memory_s + dt) * (torque_s - force_s - self.age_s);
        let limit = self.limit(median);
        let (mut count, mut force, mut variance) = (0u32, 0.0, 0.0);
        let [relative, constant] = self.noise;
        let [forward, backward] = [speed_mps, -speed_mps].map(|speed| self.gain(speed));
        for (torque, smooth) in torques.iter().zip(&self.smooth) {
            let Some(torque) = torque else { continue };
            if self.on && self.drives > 2 && (Real::from(*smooth) - median).abs() > limit {
                continue;
            }
            let gain = if *torque < 0.0 { backward } else { forward };
            count += 1;
            force += torque * gain;
            let noise = relative * torque;
            variance += (noise * noise + constant * constant) * gain * gain;
        }
        self.doubt = self.contradicts_command(median);
        if count == 0 || 2 * (count as usize) < self.drives {
            return None;
        }
        let all = self.drives as Real / Real::from(count as f32);
        Some([force * all, variance * all * all])
    }

    /// Possible delay of the torques relative to the specific force by their stamps, s.
    pub fn lag_s(&self) -> Real {
        // Clocks that are further apart are set differently.
        let same_clock = |age_s: &Real| self.on && *age_s <= TIMES.mean_s;
        Some(self.age_s.abs()).filter(same_clock).unwrap_or(0.0)
    }

    /// Returns true if the torques contradict the command.
    pub fn doubt(&self) -> bool {
        self.on && self.doubt
    }

    /// N at the rim per N·m at the motor, by the speed in the sense of the torque: with the efficiency when driving, by
    /// it when braking.
    fn gain(&self, speed_mps: Real) -> Real {
        let driving = 0.5 * (1.0 + within(speed_mps / TORQUE.blend_mps, -1.0, 1.0));
        self.per_nm * (driving * self.efficiency + (1.0 - driving) / self.efficiency)
    }

    fn limit(&self, torque: Real) -> Real {
        let [relative, constant] = self.noise;
        let share = relative * relative + self.gain_sd * self.gain_sd;
        STATISTICS.fault_sd * sqrt(share * torque * torque + constant * constant)
    }

    fn median(&self, torques: &[Option<Real>]) -> Real {
        let known = self.smooth.iter().zip(torques);
        let known = known.filter_map(|(smooth, torque)| torque.map(|_| Real::from(*smooth)));
        let middle = Sorted::of(known).middle();
        middle.map_or(0.0, |[lower, upper]| 0.5 * (lower + upper))
    }

    fn contradicts_command(&self, median: Real) -> bool {
        let command = Real::from(self.commanded);
        let limit = self.limit(command) + TORQUE.delay * Real::from(self.changing);
        // Without a command there is nothing to compare with.
        command != 0.0 && (median - command).abs() > limit
    }
}

state!(TorqueMonitor { smooth, commanded, changing, age_s, doubt; on, drives, noise, gain_sd, per_nm, efficiency });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::vehicles::vehicle;

    const DT: Real = 0.005;
    const HALF_PERIOD_S: Real = 0.6;

    /// Share of the time in which the torques are doubted: the command changes between two values every 0.6 s, and
    /// motors follow it with a lag of `lag_s` (first order), `gain` times as strong.
    fn doubted(lag_s: Real, gain: Real) -> Real {
        let mut monitor = TorqueMonitor::new(&vehicle(), &SwingBalanceParams::default(), true);
        let (mut torque, mut doubted, steps) = (30.0, 0, 4_000);
        for k in 0..steps {
            let high = ((k as Real * DT / HALF_PERIOD_S) as u32).is_multiple_of(2);
            let command = if high { 60.0 } else { 20.0 };
            torque += DT / (lag_s + DT) * (gain * command - torque);
            let z = Channels {
                motor_torque_nm: [Some(torque); MAX_DRIVES],
                commanded_torque_nm: [command; MAX_DRIVES],
                ..Channels::default()
            };
            let _ = monitor.traction(&z, 1.0, DT);
            doubted += u32::from(monitor.doubt());
        }
        Real::from(doubted as f32) / Real::from(steps as f32)
    }

    #[test]
    fn motors_that_lag_behind_a_fast_command_do_not_contradict_it() {
        for lag_s in [0.01, 0.03, 0.07] {
            assert!(doubted(lag_s, 1.0) == 0.0, "{lag_s} s");
        }
    }

    #[test]
    fn torques_that_are_not_the_command_s_contradict_it() {
        for gain in [0.0, 1.8] {
            assert!(doubted(0.05, gain) > 0.3, "{gain}: {}", doubted(0.05, gain));
        }
    }

    /// A command that stays is compared as closely as ever.
    #[test]
    fn a_steady_command_leaves_no_allowance() {
        let mut monitor = TorqueMonitor::new(&vehicle(), &SwingBalanceParams::default(), true);
        let limit = monitor.limit(40.0);
        for (torque, expected) in [(40.0 + 1.1 * limit, true), (40.0 + 0.9 * limit, false)] {
            let z = Channels {
                motor_torque_nm: [Some(torque); MAX_DRIVES],
                commanded_torque_nm: [40.0; MAX_DRIVES],
                ..Channels::default()
            };
            for _ in 0..2_000 {
                let _ = monitor.traction(&z, 1.0, DT);
            }
            assert_eq!(monitor.doubt(), expected);
        }
    }

    /// Traction, N, and its variance of these torques of the first drives, at this speed.
    fn traction(monitor: &mut TorqueMonitor, torques: &[Real], speed: Real) -> Option<[Real; 2]> {
        let mut z = Channels::default();
        for (place, torque) in z.motor_torque_nm.iter_mut().zip(torques) {
            *place = Some(*torque);
        }
        monitor.traction(&z, speed, DT)
    }

    fn new(on: bool) -> TorqueMonitor {
        TorqueMonitor::new(&vehicle(), &SwingBalanceParams::default(), on)
    }

    /// The power at the rims is that of the motors times the efficiency where they drive, and over it where they brake,
    /// to both sides; at standstill it is half-way between. Each torque has its own noise.
    #[test]
    fn the_traction_is_that_of_the_power_of_the_motors() {
        let (nm, of) = (50.0, vehicle());
        let ratio = of.gear_ratio / of.wheel_radius_m;
        let params = SwingBalanceParams::default();
        let noise = sqrt((params.torque_noise * nm).powi(2) + params.torque_noise_nm.powi(2));
        for (torque, speed, gain) in [
            (nm, 1.0, of.efficiency),
            (-nm, -1.0, of.efficiency),
            (nm, -1.0, 1.0 / of.efficiency),
            (-nm, 1.0, 1.0 / of.efficiency),
            (nm, 0.0, 0.5 * (of.efficiency + 1.0 / of.efficiency)),
            (
                nm,
                0.5 * TORQUE.blend_mps,
                0.75 * of.efficiency + 0.25 / of.efficiency,
            ),
        ] {
            let [force, variance] = traction(&mut new(true), &[torque; 8], speed).unwrap();
            let expected = 8.0 * torque * ratio * gain;
            assert!((force / expected - 1.0).abs() < 1e-9, "{torque} {speed}");
            let sd = (8.0 as Real).sqrt() * noise * ratio * gain;
            assert!(
                (variance.sqrt() / sd - 1.0).abs() < 1e-9,
                "{torque} {speed}"
            );
        }
    }

    /// Half of the drives stand for all of them, with twice the noise of their sum; fewer tell nothing.
    #[test]
    fn half_of_the_drives_stand_for_all() {
        let known = |count: usize| traction(&mut new(true), &[50.0; 8][..count], 1.0);
        let [all, variance] = known(8).unwrap();
        let [half, twice] = known(4).unwrap();
        assert!((half / all - 1.0).abs() < 1e-9 && (twice / variance - 2.0).abs() < 1e-9);
        assert_eq!((known(3), known(0)), (None, None));
    }

    /// A sensor that reads twice what seven others read is left out once it has shown; one that is not monitored, or
    /// one of two that disagree, is not. One that differs by its noise stays in.
    #[test]
    fn a_torque_that_the_others_contradict_is_left_out() {
        let force = |on: bool, first: Real, others: Real| {
            let mut monitor = new(on);
            let mut torques = [others; 8];
            torques[0] = first;
            let step = |_| traction(&mut monitor, &torques, 1.0).unwrap()[0];
            (0..1_000).map(step).last().unwrap()
        };
        let right = force(true, 50.0, 50.0);
        assert!((force(true, 100.0, 50.0) / right - 1.0).abs() < 1e-9);
        assert!((force(true, -20.0, 50.0) / right - 1.0).abs() < 1e-9);
        assert!((force(false, 100.0, 50.0) / right - 9.0 / 8.0).abs() < 1e-9);
        // six standard deviations: 1 % noise, 0.5 % scale, 0.2 N·m
        let share: Real = 0.01 * 0.01 + 0.005 * 0.005;
        let limit = 6.0 * (share * 50.0 * 50.0 + 0.2 * 0.2).sqrt();
        assert!((force(true, 50.0 + 0.99 * limit, 50.0) - right) > 0.0);
        assert!((force(true, 50.0 + 1.01 * limit, 50.0) / right - 1.0).abs() < 1e-9);
        let two = Vehicle::new(crate::api::signals::VehicleData {
            drives: 2,
            ..vehicle().data()
        });
        let mut pair = TorqueMonitor::new(&two.unwrap(), &SwingBalanceParams::default(), true);
        let step = |_| traction(&mut pair, &[100.0, 50.0], 1.0).unwrap()[0];
        let both = (0..1_000).map(step).last().unwrap();
        assert!((both / right - 150.0 / 400.0).abs() < 1e-9);
    }

    /// Time that the torques may be late when their stamps differ from those of the force by `age_s`.
    fn late_s(age_s: Real, on: bool) -> Real {
        let mut monitor = new(on);
        for _ in 0..12_000 {
            let z = Channels {
                age_s: [0.1 + age_s, 0.1, 0.0],
                ..Channels::default()
            };
            let _ = monitor.traction(&z, 1.0, DT);
        }
        monitor.lag_s()
    }

    #[test]
    fn torques_that_are_late_are_told_by_their_stamps() {
        assert_eq!((late_s(0.0, true), late_s(0.4, false)), (0.0, 0.0));
        for age_s in [0.4, -0.09] {
            let found = late_s(age_s, true);
            assert!((found / age_s.abs() - 1.0).abs() < 0.01, "{found}");
        }
        // clocks that are set differently tell nothing
        assert_eq!(late_s(1.5, true), 0.0);
    }

    /// Torques and command are compared behind a low-pass of 0.3 s: of a step they have, after n samples, all but
    /// (0.3/(0.3 + dt))ⁿ of it, and just as much of the command's step is still to come. Ages have one of 5 s. A torque
    /// that is missing stays where it was.
    #[test]
    fn all_is_behind_the_same_low_pass() {
        for dt in [0.005, 0.02] {
            let mut monitor = new(true);
            let mut z = Channels {
                commanded_torque_nm: [30.0; MAX_DRIVES],
                age_s: [0.3, 0.1, 7.0],
                ..Channels::default()
            };
            z.motor_torque_nm[1] = Some(-40.0);
            for n in 1..=200 {
                let _ = monitor.traction(&z, 1.0, dt);
                let left = (0.3 / (0.3 + dt)).powi(n);
                let near = |found: f32, expected: Real| {
                    assert!(
                        (Real::from(found) - expected).abs() < 1e-3,
                        "{n}: {found} {expected}"
                    );
                };
                near(monitor.commanded, 30.0 * (1.0 - left));
                near(monitor.smooth[1], -40.0 * (1.0 - left));
                near(monitor.changing, 30.0 * left * (0.3 + dt) / 0.3);
                assert_eq!(monitor.smooth[0], 0.0);
                let age_s = 0.2 * (1.0 - (5.0 / (5.0 + dt)).powi(n));
                assert!((monitor.age_s - age_s).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn unmonitored_torques_are_never_doubted() {
        let mut monitor = new(false);
        let z = Channels {
            motor_torque_nm: [Some(10.0); MAX_DRIVES],
            commanded_torque_nm: [60.0; MAX_DRIVES],
            ..Channels::default()
        };
        (0..1_000).for_each(|_| {
            let _ = monitor.traction(&z, 1.0, DT);
        });
        assert!(!monitor.doubt());
    }
}
