//! Inclinometer: pitch of its mount against the apparent vertical, rad, + nose up.
//!
//! ψ = atan2(f_x, √(f_y² + f_z²)) of the specific force f in mount axes (x forward, y left, z up), the pitch equation
//! of a three-axis tilt sensor (Pedley, "Tilt sensing using a three-axis accelerometer", Freescale AN3461). A sample is
//! the mean of ψ since the sample before, as these instruments filter what they read.
//!
//! The model is that of an instrument built on accelerometers (MEMS, force balance, pendulum), as most are: gravity and
//! acceleration act on it alike. At rest on a grade θ it reads θ; under an acceleration a along the rail
//! atan2(a + g sin θ, g cos θ), about a/g too much; in a bend the lateral acceleration makes it read too little.
//! "Dynamic" inclinometers, which hold the angle through a manoeuvre with a gyro, are a filter behind two instruments;
//! here that filter is an estimator, fed by `gyro` and this. The lag of a damped instrument is `errors.bandwidth_hz`.

use super::accelerometer::specific_force;
use super::mounted_instrument::{MountQuantity, MountedInstrument};
use crate::sensors::InstrumentKind;
use crate::sensors::signal_path::SignalPath;
use crate::sensors::value_sampler::SamplingMode;
use monorig_estimators::api::signals::Measurand;
use nalgebra::Vector3;

/// The inclinometer, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |_| None,
    build: |spec, on| {
        let path = SignalPath::scalar(QUANTITY.name, SamplingMode::Integrating, spec, on);
        MountedInstrument::boxed(QUANTITY, path, spec, on)
    },
};

const QUANTITY: MountQuantity<1> = MountQuantity {
    name: "inclinometer",
    group: None,
    measurand: Measurand::Inclination,
    signal: |step| specific_force(step).map(|force| [pitch(&force)]),
};

/// Pitch of the mount against the apparent vertical, rad, from the specific force in mount axes.
pub fn pitch(force_m: &Vector3<f64>) -> f64 {
    libm::atan2(force_m.x, libm::hypot(force_m.y, force_m.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checked::{Finite, Positive};
    use crate::sensors::behaviour::{DT, G, look, moving, suite, train};
    use crate::sensors::spec::{Errors, InstrumentSpec, InstrumentSpecs, Sampling};
    use nalgebra::UnitQuaternion;

    /// Readings of one second of a body of pitch θ and roll φ, rad, under a constant acceleration (forward, left, up),
    /// m/s².
    fn readings(theta: f64, roll: f64, acceleration_m: [f64; 3], errors: Errors) -> Vec<f64> {
        let train = train(1);
        let spec = InstrumentSpec {
            mount: "imu_link".into(),
            sampling: Sampling::at(50.0),
            errors,
            ..InstrumentSpec::default()
        };
        let mut suite = suite(&InstrumentSpecs::from([(KIND.name, spec)]), &train, 1);
        let q = UnitQuaternion::from_euler_angles(roll, -theta, 0.0);
        let a_w = q.transform_vector(&Vector3::from(acceleration_m));
        let truth = |t: f64| {
            moving(&train, t, |m| {
                m.v_w = a_w * t;
                m.q_wm = q;
            })
        };
        let seen = look(&mut suite, truth, DT, 500);
        seen.iter()
            .filter_map(|z| z.inclination_rad.map(|s| s.value))
            .collect()
    }

    #[test]
    fn at_rest_it_reads_the_grade_whatever_the_roll() {
        for (theta, roll) in [(0.2, 0.0), (-0.35, 0.1), (0.0, -0.3), (0.5, 0.4)] {
            let seen = readings(theta, roll, [0.0; 3], Errors::default());
            assert_eq!(seen.len(), 50, "one second at 50 Hz");
            for x in seen {
                assert!((x - theta).abs() < 1e-12, "{x} not {theta}");
            }
        }
    }

    /// a along the rail on a grade θ: atan2(a + g sin θ, g cos θ), by a/g from θ to first order on the level.
    #[test]
    fn acceleration_along_the_rail_is_taken_for_grade() {
        for (theta, a) in [(0.0_f64, 0.3), (0.15, 0.5), (-0.2, -1.0)] {
            let expected = f64::atan2(a + G * theta.sin(), G * theta.cos());
            // Velocity differences over 2 ms lose 1e-13/2e-3 of 10 m/s.
            for x in readings(theta, 0.0, [a, 0.0, 0.0], Errors::default()) {
                assert!((x - expected).abs() < 1e-10, "{x} not {expected}");
            }
        }
        let [x, ..] = readings(0.0, 0.0, [0.3, 0.0, 0.0], Errors::default())[..] else {
            panic!("no sample");
        };
        assert!((x - 0.3 / G).abs() < 1e-5);
    }

    /// In a bend: tan ψ = g sin θ / √(g² cos² θ + a_y²), less than θ.
    #[test]
    fn lateral_acceleration_makes_it_read_less() {
        let (theta, a) = (0.2_f64, 3.0);
        let expected = f64::atan2(G * theta.sin(), f64::hypot(G * theta.cos(), a));
        for x in readings(theta, 0.0, [0.0, a, 0.0], Errors::default()) {
            assert!((x - expected).abs() < 1e-10, "{x} not {expected}");
        }
        assert!(expected < theta);
    }

    #[test]
    fn the_errors_of_the_sheet_act_on_the_angle() {
        let errors = Errors {
            bias: Finite::new(0.01),
            scale_error: Finite::new(0.02),
            quantisation: Some(Positive::new(1e-3)),
            range: Some([-0.5, 0.5].map(Finite::new)),
            ..Errors::default()
        };
        for x in readings(0.2, 0.0, [0.0; 3], errors) {
            assert!((x - 0.214).abs() < 1e-12, "{x}"); // 1.02 · 0.2 + 0.01
        }
        for x in readings(0.9, 0.0, [0.0; 3], errors) {
            assert_eq!(x, 0.5);
        }
    }
}
