//! The instrument of a replay: it delivers the samples of the step that is played.

use super::ghost;
use super::playback::{Shared, lock};
use crate::drive::Target;
use monorig_estimators::api::signals::{Measurements, Sample};
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::sensors::fault::FaultWindow;
use monorig_sim::sensors::signal_path::StepInterval;
use monorig_sim::sensors::{Instrument, SensorChannel};

/// The instrument of a replay: the samples of the step.
pub(super) struct RecordedInstrument {
    pub shared: Shared,
    pub targets: Vec<Target>,
    pub drives: usize,
    pub ghost: bool,
}

impl Instrument for RecordedInstrument {
    fn name(&self) -> &str {
        "log"
    }

    fn rate_hz(&self) -> f64 {
        0.0
    }

    fn mount(&self) -> Option<usize> {
        None
    }

    fn measure(&mut self, _: StepInterval, _: &Truth, z: &mut Measurements) -> Result<(), Error> {
        // of all that there is of a replay nothing else measures
        *z = lock(&self.shared).step().z;
        Ok(())
    }

    fn add_fault(&mut self, _: Option<usize>, _: FaultWindow) {}

    fn channels(&self) -> Vec<SensorChannel> {
        let mut all = Vec::new();
        let axes = [("x", 0), ("y", 1), ("z", 2)];
        let has = |wanted: fn(&Target) -> bool| self.targets.iter().any(wanted);
        if has(|t| *t == Target::SpecificForce) {
            all.extend(axes.map(|(axis, i)| {
                let path = format!("imu/specific_force_{axis}");
                SensorChannel::new(path, "m/s²", move |z| {
                    z.specific_force_mps2.and_then(|s| s.value.get(i).copied())
                })
            }));
        }
        if has(|t| *t == Target::AngularRate) {
            all.extend(axes.map(|(axis, i)| {
                let path = format!("imu/angular_rate_{axis}");
                SensorChannel::new(path, "rad/s", move |z| {
                    z.angular_rate_radps.and_then(|s| s.value.get(i).copied())
                })
            }));
        }
        let torque = has(|t| matches!(t, Target::Torque(_) | Target::Force | Target::Power));
        for drive in 0..self.drives {
            let number = drive + 1;
            if torque {
                all.push(SensorChannel::new(
                    format!("drive_{number}/motor_torque"),
                    "N·m",
                    move |z| sample(&z.motor_torque_nm, drive),
                ));
            }
            if self.targets.contains(&Target::Wheel(drive)) {
                all.push(SensorChannel::new(
                    format!("drive_{number}/wheel_speed"),
                    "m/s",
                    move |z| sample(&z.wheel_speed_mps, drive),
                ));
            }
            if self.targets.contains(&Target::Clamp(drive)) {
                all.push(SensorChannel::new(
                    format!("drive_{number}/clamp_pressure"),
                    "MPa",
                    move |z| sample(&z.clamp_pressure_mpa, drive),
                ));
            }
        }
        if has(|t| *t == Target::Steering) {
            all.push(SensorChannel::new("steering_angle", "rad", |z| {
                z.steering_angle_rad.map(|s| s.value)
            }));
        }
        if has(|t| *t == Target::Inclination) {
            all.push(SensorChannel::new("inclinometer", "rad", |z| {
                z.inclination_rad.map(|s| s.value)
            }));
        }
        for i in 0..4 {
            if self.targets.contains(&Target::Auxiliary(i)) {
                all.push(SensorChannel::new(
                    format!("auxiliary_{}", i + 1),
                    "1",
                    move |z| sample(&z.auxiliary, i),
                ));
            }
        }
        if self.ghost {
            let shared = self.shared.clone();
            all.extend(ghost::channels(move |of| {
                lock(&shared).ghost.as_ref().and_then(of)
            }));
        }
        all
    }
}

fn sample(slots: &[Option<Sample<f64>>], i: usize) -> Option<f64> {
    slots.get(i).copied().flatten().map(|s| s.value)
}
