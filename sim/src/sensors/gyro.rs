//! Gyro: angular rate of the body at the mount, in mount axes (x forward, y left, z up), rad/s.
//!
//! ω_M = R_WMᵀ ω_W. A sample is the mean of ω_M since the sample before (a rate-integrating gyro), linear between steps.
//! A grade that grows shows as a negative rate about y.

use super::accelerometer::IMU;
use super::fault::FaultWindow;
use super::signal_path::{SignalPath, StepInterval};
use super::{Instrument, InstrumentKind, SensorChannel, mount};
use crate::error::Error;
use crate::plant::{MountState, Truth};
use monorig_estimators::api::signals::Measurements;

/// The gyro, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: "gyro",
    unsuited: |_| None,
    build: |spec, on| {
        Ok(Box::new(Gyro {
            mount: mount::find(on.train, KIND.name, &spec.mounting.link)?,
            path: SignalPath::inertial(KIND.name, spec, on.seed),
            before: None,
        }))
    },
};

/// A three-axis gyro at a mount.
#[derive(Clone, Debug)]
struct Gyro {
    mount: usize,
    path: SignalPath<3>,
    before: Option<MountState>,
}

impl Instrument for Gyro {
    fn name(&self) -> &str {
        KIND.name
    }

    fn group(&self) -> Option<&str> {
        Some(IMU)
    }

    fn rate_hz(&self) -> f64 {
        self.path.rate_hz()
    }

    fn mount(&self) -> Option<usize> {
        Some(self.mount)
    }

    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error> {
        let now = truth.mounts[self.mount];
        let before = self.before.replace(now).unwrap_or(now);
        self.path
            .observe(step, body_rate(&before), body_rate(&now))?;
        z.angular_rate_radps = self.path.deliver(step.to_ns);
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        z.angular_rate_radps = self.path.ideal();
    }

    fn add_fault(&mut self, _unit: Option<usize>, fault: FaultWindow) {
        self.path.add_fault(fault);
    }

    fn channels(&self) -> Vec<SensorChannel> {
        let axes = ["x", "y", "z"].into_iter().enumerate();
        axes.map(|(i, axis)| {
            SensorChannel::new(format_args!("imu/angular_rate_{axis}"), "rad/s", move |z| {
                z.angular_rate_radps.map(|s| s.value[i])
            })
        })
        .collect()
    }
}

/// Angular rate in mount axes, rad/s.
pub fn body_rate(state: &MountState) -> [f64; 3] {
    state.q_wm.inverse_transform_vector(&state.w_w).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};

    /// Heading north (+y), grade growing: the body turns about world +x, which is its own −y.
    #[test]
    fn a_growing_grade_is_a_negative_rate_about_left() {
        let q = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let state = MountState {
            v_w: Vector3::zeros(),
            q_wm: q,
            w_w: Vector3::new(0.1, 0.0, 0.0),
        };
        let rate = Vector3::from(body_rate(&state));
        assert!(
            (rate - Vector3::new(0.0, -0.1, 0.0)).norm() < 1e-15,
            "{rate}"
        );
    }
}
