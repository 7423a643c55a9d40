//! Accelerometer: specific force at the mount, in mount axes (x forward, y left, z up), m/s².
//!
//! Over a physics step: f_M(t) = R_WM(mid-step)ᵀ Δv_W/Δt − R_WM(t)ᵀ g_W, g_W = (0, 0, −g), from the velocity of the
//! mount in the world; the second term is linear between the ends of the step, so that a turning body shows no steps of
//! gravity. A sample is the mean of f_M since the sample before, that is, Δv/T − g with v linear between steps, turned
//! piece by piece into the mount frame (velocity increments in body axes, as strapdown sensors give them: Savage 1998,
//! "Strapdown inertial navigation integration algorithm design, part 2", J. Guidance 21(2)). Positions are never
//! differentiated. At rest it reads (0, 0, +g).

use super::mounted_instrument::{MotionStep, MountQuantity, MountedInstrument};
use crate::plant::MountState;
use crate::sensors::InstrumentKind;
use crate::sensors::signal_path::SignalPath;
use monorig_estimators::api::signals::Measurand;
use nalgebra::{UnitQuaternion, Vector3};

/// The three-axis accelerometer, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: QUANTITY.name,
    unsuited: |_| None,
    build: |spec, on| {
        let path = SignalPath::inertial(QUANTITY.name, spec, on);
        MountedInstrument::boxed(QUANTITY, path, spec, on)
    },
};

const QUANTITY: MountQuantity<3> = MountQuantity {
    name: "accelerometer",
    group: Some(IMU),
    measurand: Measurand::SpecificForce,
    signal: |step| specific_force(step).map(Into::into),
};

/// Name in events of the accelerometer and the gyro together.
pub const IMU: &str = "imu";

/// Specific force at both ends of a step, in mount axes, m/s².
pub fn specific_force(step: &MotionStep<'_>) -> [Vector3<f64>; 2] {
    let MotionStep {
        before,
        now,
        dt_s,
        gravity_mps2,
    } = *step;
    let acceleration_w = (now.v_w - before.v_w) / dt_s;
    let acceleration_m =
        half_way(&before.q_wm, &now.q_wm).inverse_transform_vector(&acceleration_w);
    let up_w = Vector3::new(0.0, 0.0, gravity_mps2);
    let force_m = |state: &MountState| acceleration_m + state.q_wm.inverse_transform_vector(&up_w);
    [force_m(before), force_m(now)]
}

/// The rotation half-way between two: the normalised sum of the quaternions, on the shorter arc.
fn half_way(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let sum = if a.coords.dot(&b.coords) < 0.0 {
        a.into_inner() - b.into_inner()
    } else {
        a.into_inner() + b.into_inner()
    };
    UnitQuaternion::new_normalize(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.81;
    const DT: f64 = 0.002;

    fn forces(before: &MountState, now: &MountState) -> [Vector3<f64>; 2] {
        specific_force(&MotionStep {
            before,
            now,
            dt_s: DT,
            gravity_mps2: G,
        })
    }

    fn state(v: [f64; 3], q: UnitQuaternion<f64>) -> MountState {
        MountState {
            v_w: Vector3::from(v),
            q_wm: q,
            w_w: Vector3::zeros(),
        }
    }

    /// At rest on a grade θ (nose up = rotation by −θ about y, left): f = (g sin θ, 0, g cos θ).
    #[test]
    fn at_rest_on_a_grade_it_reads_gravity_along_the_rail() {
        let theta: f64 = 0.2;
        let q = UnitQuaternion::from_euler_angles(0.0, -theta, 0.0);
        let s = state([0.0; 3], q);
        let [f, end] = forces(&s, &s);
        assert_eq!(f, end);
        assert!(
            (f - Vector3::new(G * theta.sin(), 0.0, G * theta.cos())).norm() < 1e-12,
            "{f}"
        );
    }

    /// Free fall: velocity changes by g dt downwards, the specific force is zero.
    #[test]
    fn in_free_fall_it_reads_zero() {
        let q = UnitQuaternion::from_euler_angles(0.3, 0.2, 0.1);
        let [f, end] = forces(&state([1.0, 2.0, 0.0], q), &state([1.0, 2.0, -G * DT], q));
        assert!(f.norm() < 1e-9 && end.norm() < 1e-9);
    }

    /// On a level circle to the left: v²/R to the left, whatever the sign of the quaternion.
    #[test]
    fn on_a_circle_it_reads_the_centripetal_acceleration() {
        let (v, radius) = (2.0, 10.0);
        let at = |t: f64, sign: f64| {
            let psi = v / radius * t;
            let q = UnitQuaternion::from_euler_angles(0.0, 0.0, psi);
            state(
                [v * psi.cos(), v * psi.sin(), 0.0],
                UnitQuaternion::new_unchecked(q.into_inner() * sign),
            )
        };
        for sign in [1.0, -1.0] {
            let [f, end] = forces(&at(5.0, 1.0), &at(5.0 + DT, sign));
            // A chord of a circle: shorter than the arc by (ωdt)²/24, 6.7e-9 relative.
            assert!(
                (f - Vector3::new(0.0, v * v / radius, G)).norm() < 1e-8,
                "{f}"
            );
            assert!((f - end).norm() < 1e-12);
        }
    }
}
