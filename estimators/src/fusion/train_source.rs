//! Source of the inputs for an estimator of the mass of a train: attitude and speed, traction, and whether the
//! instruments are plausible.
//!
//! It uses no force for the grade, so no fault of a torque, of the load or of the running resistance can reach the
//! slope.

use crate::api::reading::Reading;
use crate::api::real::{GRAVITY, exp, sqrt};
use crate::api::signals::{Estimate, Value, Vehicle};
use crate::api::snapshot::state;
use crate::detect::plausibility::{Instruments, Plausibility};
use crate::detect::validity::Integrity;
use crate::fusion::attitude::params::{AttitudeParams, AttitudeSupervision};
use crate::fusion::attitude::survey::LaggedGrade;
use crate::fusion::attitude::{Attitude, AttitudeFilter};
use crate::fusion::effective::UnitGrade;
use crate::fusion::swing_balance::block::BlockInput;
use crate::fusion::swing_balance::params::SwingBalanceParams;
use crate::fusion::swing_balance::torque_monitor::TorqueMonitor;
use crate::models::force_balance::ForceBalance;
use crate::models::single_track::Bends;
use crate::tuning::{MEMORY, MOTION, SOURCE, TIMES};
use crate::{Real, Time};

/// Limits and filters of the signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoreSignals {
    /// Standard deviation of sin θ + b/g up to which a block of the force balance is used.
    pub max_sum_sd: Real,
    /// True if on a road the gyro must be plausible.
    pub gyro_check: bool,
}

/// Output of the source in one step.
#[derive(Clone, Copy, Debug)]
pub struct TrainInput {
    /// Instant of the step.
    pub t: Time,
    /// Length of the step, s.
    pub dt: Real,
    /// Signals for the mass; `None` until an accelerometer and a wheel have given samples.
    pub sample: Option<TrainSample>,
    /// Grade at the IMU, rad, valid while attitude and speed have current samples.
    pub grade_rad: Value,
    /// Speed, m/s, valid under the same condition.
    pub speed_mps: Value,
    /// Innovation of the wheels, m/s, and its square normalised.
    pub innovation: (Real, Real),
    /// The same square, if this step has fused wheels.
    pub new_nis: Option<Real>,
    /// Grade with a fixed lag in distance.
    pub lagged: LaggedGrade,
    /// True if the instruments are plausible.
    pub plausible: bool,
    /// True if the vehicle moves by its wheels.
    pub moving: bool,
}

/// Signals of one step for the mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainSample {
    /// Signals of the force balance.
    pub block: BlockInput,
    /// Motion and grade of the unit that carries the IMU.
    pub unit: UnitGrade,
    /// Sum sin θ + b/g and horizontal curvature without its sign, 1/m, where the rail can be read.
    pub rail: Option<[Real; 2]>,
    /// True if the vehicle stands by its wheels.
    pub standing: bool,
    /// True if the attitude has just started, or wheels have come back after a long loss.
    pub starts: bool,
}

impl TrainInput {
    /// True while attitude and speed have current samples.
    pub fn is_awake(&self) -> bool {
        self.grade_rad.valid
    }

    /// Estimate with only the grade at the IMU and the speed.
    pub fn estimate(&self) -> Estimate {
        let (innovation, nis) = self.innovation;
        Estimate {
            t: self.t,
            grade_rad: self.grade_rad,
            speed_mps: self.speed_mps,
            innovation,
            nis,
            ..Estimate::default()
        }
    }
}

/// The source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainSource {
    standstill_mps: Real,
    air: ForceBalance,
    max_sum_sd: Real,
    /// Bends of a road.
    bends: Bends,
    attitude: AttitudeFilter,
    torques: TorqueMonitor,
    brake: Real,
    /// Additional standard deviation of the rail read under the train, beyond a calm instrument.
    read_sd: Real,
    /// Standard deviation of the pitch by contradicting instruments where that rail was read, rad.
    read_apart_rad: Real,
    plausibility: Plausibility,
}

impl TrainSource {
    /// Builds the source for a vehicle. `torque` is the noise of the torques, and true if they are monitored; how the
    /// signals are read.
    pub fn new(
        vehicle: &Vehicle,
        attitude: AttitudeParams,
        supervision: AttitudeSupervision,
        integrity: &Integrity,
        (torque, monitored): (&SwingBalanceParams, bool),
        signals: CoreSignals,
    ) -> Self {
        let uses = Instruments {
            accelerometer: true,
            gyro: signals.gyro_check && vehicle.road.is_some(),
            // On a rail the slope can be found without a gyro.
            spare_gyro: vehicle.road.is_none(),
        };
        Self {
            standstill_mps: vehicle.standstill_mps(None),
            air: ForceBalance::new(vehicle),
            max_sum_sd: signals.max_sum_sd,
            bends: Bends::new(vehicle),
            attitude: AttitudeFilter::new(vehicle, attitude, supervision, integrity),
            torques: TorqueMonitor::new(vehicle, torque, monitored),
            brake: 0.0,
            read_sd: 0.0,
            read_apart_rad: 0.0,
            plausibility: Plausibility::new(integrity.plausibility, uses),
        }
    }

    /// Makes one step at the instant `t` after `dt` seconds; the present total mass, kg, is used only in bends of a
    /// road.
    pub fn step(&mut self, reading: &Reading, mass_kg: Real, t: Time, dt: Real) -> TrainInput {
        self.bends.step(reading, &self.air, mass_kg);
        if !self.plausibility.gyro_is_sound() {
            self.attitude.leave_gyro_out();
        }
        let attitude = if self.bends.on_road() {
            let mut channels = reading.channels;
            if let Some([along, ..]) = &mut channels.specific_force_mps2 {
                *along += self.bends.now().drift_mps2;
            }
            self.attitude.step(&channels, dt)
        } else {
            self.attitude.step(&reading.channels, dt)
        };
        let sample = attitude.map(|attitude| self.sample(reading, &attitude, dt));
        let found = self.attitude.found();
        let awake = sample.is_some() && self.attitude.is_awake();
        // The check takes the pitch rate for that of the grade.
        let pitch_rate = reading
            .pitch_rate_radps
            .filter(|_| self.attitude.uses_gyro())
            .map(|_| found.pitch_rate_radps);
        let by_wheels = reading.speed_mps.map(Real::abs);
        TrainInput {
            t,
            dt,
            sample,
            grade_rad: Value::new(
                self.attitude.grade_at_imu_rad(),
                self.attitude.grade_at_imu_sd_rad(),
                awake,
            ),
            speed_mps: Value::new(found.speed_mps, found.speed_sd_mps, awake),
            innovation: self.attitude.innovation(),
            new_nis: self.attitude.new_nis(),
            lagged: self.attitude.lagged_grade(),
            plausible: self.plausibility.step(reading, pitch_rate, dt),
            moving: by_wheels.is_some_and(|v| v > self.standstill_mps),
        }
    }

    /// Makes the signals for the mass, with this attitude.
    fn sample(&mut self, reading: &Reading, attitude: &Attitude, dt: Real) -> TrainSample {
        let v = attitude.speed_mps;
        let bend = if v.abs() > MOTION.moves_mps {
            (attitude.yaw_rate_radps / v).abs()
        } else {
            0.0
        };
        let u = self.attitude.pitch_sine() + attitude.bias_mps2 / GRAVITY;
        let apart = self.attitude.apart_rad();
        let readable = attitude.sum_sd < SOURCE.read_sum_sd;
        if readable {
            let way_m = v.abs() * dt;
            let kept = self.read_sd * exp(-way_m / SOURCE.read_m);
            let (own, calm) = (attitude.sum_sd, SOURCE.calm_sum_sd);
            self.read_sd = sqrt((own * own - calm * calm).max(0.0)).max(kept);
            let apart = self.attitude.separation_sd_rad();
            self.read_apart_rad = remembered(self.read_apart_rad, apart, way_m);
        }
        self.brake += dt / (TIMES.brief_s + dt) * (reading.brake - self.brake);
        let drag = self.air.drag(v);
        let traction = self
            .torques
            .traction(&reading.channels, v, dt)
            .map(|[force, variance]| [force - drag, variance]);
        let [used, slipping] = attitude.wheels;
        let standing = reading
            .speed_mps
            .is_some_and(|v| v.abs() < self.standstill_mps);
        TrainSample {
            block: BlockInput {
                speed_mps: v,
                speed_noise_mps: attitude.speed_noise_mps,
                acceleration_mps2: attitude.acceleration_mps2,
                traction,
                traction_lag_s: self.torques.lag_s(),
                seen_walk: self.attitude.seen_walk(),
                bend_per_m: bend,
                brake: self.brake,
                sound: attitude.imu
                    && attitude.sum_sd < self.max_sum_sd
                    && apart < self.max_sum_sd.min(SOURCE.read_sum_sd)
                    && !standing
                    && (used > 0 || reading.new_speed_mps.is_none()),
                slip: slipping > 0,
                doubt: self.torques.doubt(),
            },
            unit: UnitGrade {
                speed_mps: v,
                bias_mps2: attitude.bias_mps2,
                pitch_sd_rad: {
                    let moved = attitude.moved_on_rad;
                    sqrt(attitude.pitch_sd_rad * attitude.pitch_sd_rad + moved * moved)
                },
                constant_sd_rad: {
                    let mount = self.mount_sd_under_train_rad();
                    sqrt(mount * mount + self.read_sd * self.read_sd)
                },
            },
            rail: readable.then_some([u, bend]),
            standing,
            starts: self.attitude.has_just_started(),
        }
    }

    /// Possible delay of the torques, s.
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

    /// Additional standard deviation of the sine of the grade read under the train, beyond a calm instrument.
    pub fn read_sd(&self) -> Real {
        self.read_sd
    }

    /// Standard deviation of errors that the filter cannot observe of the grade under the train, rad: that of the
    /// IMU's mounting, and what contradicting instruments left open where the rail was read.
    pub fn mount_sd_under_train_rad(&self) -> Real {
        let now = self.attitude.separation_sd_rad();
        self.attitude.mount_sd_rad() + (self.read_apart_rad - now).max(0.0)
    }
}

/// Doubt of the rail under the train after `way_m` that was read with the doubt `now`: a moment of noise is not read,
/// and what was read leaves the train as it runs on.
fn remembered(before: Real, now: Real, way_m: Real) -> Real {
    let over_m = match now > before {
        true => MEMORY.end_m,
        false => SOURCE.read_m,
    };
    before + (1.0 - exp(-way_m / over_m)) * (now - before)
}

state!(TrainSource { plausibility, bends, attitude, torques, brake, read_sd, read_apart_rad; standstill_mps, air, max_sum_sd });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::PI;
    use crate::testing::vehicles::{car, vehicle};

    const DT: Real = 0.01;

    fn source(of: &Vehicle) -> TrainSource {
        let signals = CoreSignals {
            max_sum_sd: 0.004,
            gyro_check: true,
        };
        let (attitude, supervision) = Default::default();
        let torque = (&SwingBalanceParams::default(), true);
        TrainSource::new(
            of,
            attitude,
            supervision,
            &Integrity::default(),
            torque,
            signals,
        )
    }

    /// The grade under the train keeps what contradicting instruments left open of the slope for 20 m, as the train
    /// stands on rail that they have read; it takes a metre of reading to get it.
    #[test]
    fn what_contradicting_instruments_have_read_is_remembered_over_the_way() {
        let mut source = source(&vehicle());
        source.read_apart_rad = 0.02;
        let mut step = |_| source.sample(&reading(), &running(), DT);
        let told = (0..1_000).map(&mut step).last().unwrap();
        let mount = 0.2 * PI / 180.0 + 0.02 * (-0.5 as Real).exp();
        assert!((source.mount_sd_under_train_rad() / mount - 1.0).abs() < 1e-9);
        assert!((told.unit.constant_sd_rad / mount - 1.0).abs() < 1e-9);
        let read = (0..100).fold(0.0, |before, _| remembered(before, 0.02, 0.02));
        assert!((read / 0.02 - 1.0 + (-2.0 as Real).exp()).abs() < 1e-9);
    }

    /// An attitude of a train that runs at 1 m/s with all its instruments.
    fn running() -> Attitude {
        Attitude {
            speed_mps: 1.0,
            sum_sd: 0.001,
            imu: true,
            wheels: [8, 0],
            ..Attitude::default()
        }
    }

    fn reading() -> Reading {
        Reading {
            speed_mps: Some(1.0),
            new_speed_mps: Some(1.0),
            ..Reading::default()
        }
    }

    /// The rail is read as sin θ + b/g and the size of its bend, which is that of the heading over the way, where it is
    /// known well enough; at a crawl there is no bend.
    #[test]
    fn the_rail_is_read_where_it_is_known() {
        let at = |attitude: &Attitude| source(&vehicle()).sample(&reading(), attitude, DT);
        for (v, yaw_rate, bend) in [
            (2.0, 0.2, 0.1),
            (-2.0, 0.2, 0.1),
            (2.0, -0.2, 0.1),
            (0.061, 0.0122, 0.2),
            (0.059, 0.2, 0.0),
            (-0.059, 0.2, 0.0),
        ] {
            let sample = at(&Attitude {
                speed_mps: v,
                yaw_rate_radps: yaw_rate,
                bias_mps2: 0.0981,
                ..running()
            });
            let [u, read] = sample.rail.unwrap();
            assert!(
                (u - 0.01).abs() < 1e-9 && (read - bend).abs() < 1e-12,
                "{v}"
            );
            assert_eq!(read, sample.block.bend_per_m);
        }
        for (sum_sd, readable) in [(0.0199, true), (0.0201, false)] {
            let sample = at(&Attitude {
                sum_sd,
                ..running()
            });
            assert_eq!(sample.rail.is_some(), readable);
        }
    }

    /// Rail read with 0.005 counts with the 0.004 that a calm instrument (0.003) does not have, by squares, and goes
    /// out of the means over 20 m, whichever way the train goes. It adds to the mount's by squares. What is too bad to
    /// be read changes nothing.
    #[test]
    fn what_was_read_badly_is_remembered_over_the_way() {
        let mut source = source(&vehicle());
        let mut read = |sum_sd: Real, v: Real, seconds: Real| {
            let attitude = Attitude {
                sum_sd,
                speed_mps: v,
                ..running()
            };
            let steps = (seconds / DT + 0.5) as usize;
            let step = |_| source.sample(&reading(), &attitude, DT);
            let last = (0..steps).map(step).last().unwrap();
            let mount = 0.2 * PI / 180.0;
            let expected = (mount * mount + source.read_sd() * source.read_sd()).sqrt();
            assert!((last.unit.constant_sd_rad / expected - 1.0).abs() < 1e-12);
            source.read_sd()
        };
        assert_eq!(read(0.003, 1.0, 1.0), 0.0);
        assert!((read(0.005, 1.0, 1.0) / 0.004 - 1.0).abs() < 1e-9);
        assert!((read(0.03, 1.0, 1.0) / 0.004 - 1.0).abs() < 1e-9);
        let left = (-1.0 as Real).exp();
        assert!((read(0.003, -2.0, 10.0) / (0.004 * left) - 1.0).abs() < 1e-9);
        assert!((read(0.001, 1.0, 20.0) / (0.004 * left * left) - 1.0).abs() < 1e-9);
    }

    /// A block is sound while IMU and wheels are in use, the grade is known and the train runs; between the samples of
    /// its wheels, too. One that slips, and torques that are doubted, are said.
    #[test]
    fn a_block_is_sound_with_all_it_is_made_of() {
        let block = |attitude: &Attitude, reading: &Reading| {
            let sample = source(&vehicle()).sample(reading, attitude, DT);
            [sample.block.sound, sample.block.slip, sample.standing]
        };
        let full = running();
        let no_wheel = Attitude {
            wheels: [0, 0],
            ..full
        };
        let slips = Attitude {
            wheels: [7, 1],
            ..full
        };
        let blind = Attitude { imu: false, ..full };
        let rough = |sum_sd| Attitude { sum_sd, ..full };
        let between = Reading {
            new_speed_mps: None,
            ..reading()
        };
        let at = |v| Reading {
            speed_mps: v,
            ..reading()
        };
        let still = vehicle().standstill_mps(None);
        for (attitude, reading, expected) in [
            (full, reading(), [true, false, false]),
            (slips, reading(), [true, true, false]),
            (no_wheel, reading(), [false, false, false]),
            (no_wheel, between, [true, false, false]),
            (blind, reading(), [false, false, false]),
            (rough(0.0039), reading(), [true, false, false]),
            (rough(0.0041), reading(), [false, false, false]),
            (full, at(Some(0.99 * still)), [false, false, true]),
            (full, at(Some(-0.99 * still)), [false, false, true]),
            (full, at(Some(-1.01 * still)), [true, false, false]),
            (full, at(None), [true, false, false]),
        ] {
            assert_eq!(
                block(&attitude, &reading),
                expected,
                "{attitude:?} {reading:?}"
            );
        }
    }

    /// The brake lags by 0.3 s; the drag of the air is taken off the traction, and the pitch is as uncertain as it was
    /// and by what it has moved on since.
    #[test]
    fn brake_drag_and_pitch_are_those_of_now() {
        let mut source = source(&car());
        let mut reading = Reading {
            brake: 0.8,
            ..reading()
        };
        reading.channels.motor_torque_nm[..2].fill(Some(100.0));
        let attitude = |v: Real| Attitude {
            speed_mps: v,
            pitch_sd_rad: 0.003,
            moved_on_rad: -0.004,
            ..running()
        };
        let mut tractions = [0.0; 2];
        for k in 1..=100 {
            let speed = if k % 2 == 0 { 20.0 } else { 10.0 };
            let sample = source.sample(&reading, &attitude(speed), DT);
            let left = (0.3 / (0.3 + DT)).powi(k);
            assert!((sample.block.brake - 0.8 * (1.0 - left)).abs() < 1e-9);
            assert!((sample.unit.pitch_sd_rad - 0.005).abs() < 1e-12);
            tractions[(k % 2) as usize] = sample.block.traction.unwrap()[0];
        }
        let road = car().road.unwrap();
        let by_square = 0.5 * road.air_density_kgpm3 * road.drag_area_m2;
        let [fast, slow] = tractions;
        assert!(((slow - fast) / (by_square * 300.0) - 1.0).abs() < 1e-9);
        let rims = 200.0 * 7.235 / 0.335 * 0.95;
        assert!((slow / (rims - by_square * 100.0) - 1.0).abs() < 1e-9);
    }

    /// It moves while its wheels turn faster than at standstill, to either side, and is awake while there is an
    /// attitude.
    #[test]
    fn it_moves_by_its_wheels() {
        let still = vehicle().standstill_mps(None);
        for (v, moving) in [
            (Some(1.01 * still), true),
            (Some(-1.01 * still), true),
            (Some(0.99 * still), false),
            (None, false),
        ] {
            let mut source = source(&vehicle());
            let mut reading = Reading {
                speed_mps: v,
                ..reading()
            };
            let input = source.step(&reading, 0.0, Time::from_s(DT), DT);
            assert_eq!((input.moving, input.is_awake()), (moving, false));
            assert!(input.sample.is_none() && !input.speed_mps.valid);
            reading.channels.specific_force_mps2 = Some([0.0, 0.0, GRAVITY]);
            reading.channels.new_wheel_speed_mps[0] = Some(v.unwrap_or(0.0));
            let input = source.step(&reading, 0.0, Time::from_s(2.0 * DT), DT);
            assert!(input.is_awake() && input.speed_mps.valid && input.sample.is_some());
            assert_eq!(input.estimate().speed_mps, input.speed_mps);
            assert_eq!(input.estimate().grade_rad, input.grade_rad);
            // half a second without any sample, and what it gives is nobody's
            for k in 3..70 {
                let input = source.step(
                    &Reading::default(),
                    0.0,
                    Time::from_s(DT * Real::from(k)),
                    DT,
                );
                assert!(input.sample.is_some() && !input.moving);
                assert_eq!(input.is_awake(), k <= 51, "{k}");
                assert_eq!(input.speed_mps.valid, input.is_awake());
            }
        }
    }
}
