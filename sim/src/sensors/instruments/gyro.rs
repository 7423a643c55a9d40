//! Gyro: angular rate of the body at the mount, in mount axes (x forward, y left, z up), rad/s.
//!
//! ω_M = R_WMᵀ ω_W. A sample is the mean of ω_M since the sample before (a rate-integrating gyro), linear between
//! steps. A grade that grows shows as a negative rate about y.

use super::accelerometer::IMU;
use super::mounted_instrument::{MountQuantity, MountedInstrument};
use crate::plant::MountState;
use crate::sensors::InstrumentKind;
use crate::sensors::signal_path::SignalPath;
use monorig_estimators::api::signals::Measurand;

/// The three-axis gyro, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |_| None,
    build: |spec, on| {
        let path = SignalPath::inertial(QUANTITY.name, spec, on);
        MountedInstrument::boxed(QUANTITY, path, spec, on)
    },
};

const QUANTITY: MountQuantity<3> = MountQuantity {
    name: "gyro",
    group: Some(IMU),
    measurand: Measurand::AngularRate,
    signal: |step| [step.before, step.now].map(body_rate),
};

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
