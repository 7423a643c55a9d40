//! Accelerometer: specific force at the mount, in mount axes (x forward, y left, z up), m/s².
//!
//! Over a physics step: f_M(t) = R_WM(mid-step)ᵀ Δv_W/Δt − R_WM(t)ᵀ g_W, g_W = (0, 0, −g), from the velocity of the mount in
//! the world; the second term is linear between the ends of the step, so that a turning body shows no steps of gravity.
//! A sample is the mean of f_M since the sample before, that is, Δv/T − g with v linear between steps, turned piece by
//! piece into the mount frame (velocity increments in body axes, as strapdown sensors give them: Savage 1998,
//! "Strapdown inertial navigation integration algorithm design, part 2", J. Guidance 21(2)). Positions are never
//! differentiated. At rest it reads (0, 0, +g).

use super::instrument::{Instrument, SamplingMode, StepInterval};
use super::misalignment;
use crate::config::sensor_sheet_file::InertialSensor;
use crate::error::Error;
use crate::plant::MountState;
use nalgebra::{UnitQuaternion, Vector3};

/// Name in events and errors.
pub const NAME: &str = "accelerometer";

/// A three-axis accelerometer.
#[derive(Clone, Debug)]
pub struct Accelerometer {
    /// Index in `Truth::mounts`.
    pub mount: usize,
    /// Sampling, errors, faults.
    pub instrument: Instrument<3>,
    gravity_mps2: f64,
}

impl Accelerometer {
    /// An accelerometer at a mount.
    pub fn new(sheet: &InertialSensor, mount: usize, gravity_mps2: f64, seed: u64) -> Self {
        let bias = sheet.axis_bias.map_or([0.0; 3], |b| b.map(|x| x.get()));
        let axes = [(".x", bias[0]), (".y", bias[1]), (".z", bias[2])];
        let mut instrument = Instrument::new(
            NAME,
            SamplingMode::Integrating,
            (&sheet.sampling, &sheet.errors),
            axes,
            seed,
        );
        instrument.misalign(misalignment::draw(sheet, seed, NAME));
        Self {
            mount,
            instrument,
            gravity_mps2,
        }
    }

    /// The mount moved from `before` to `now`; over an empty span both are the same.
    pub fn observe(
        &mut self,
        span: StepInterval,
        before: &MountState,
        now: &MountState,
    ) -> Result<(), Error> {
        // At least 1 ns: an empty span has no change of velocity to divide.
        let dt_s = (span.to_ns - span.from_ns).max(1) as f64 * 1e-9;
        let (start, end) = specific_force(before, now, dt_s, self.gravity_mps2);
        self.instrument.observe(span, start.into(), end.into())
    }
}

/// Specific force at both ends of a step of `dt_s`, in mount axes, m/s².
pub fn specific_force(
    before: &MountState,
    now: &MountState,
    dt_s: f64,
    gravity_mps2: f64,
) -> (Vector3<f64>, Vector3<f64>) {
    let acceleration_w = (now.v_w - before.v_w) / dt_s;
    let acceleration_m =
        half_way(&before.q_wm, &now.q_wm).inverse_transform_vector(&acceleration_w);
    let up_w = Vector3::new(0.0, 0.0, gravity_mps2);
    let felt = |state: &MountState| acceleration_m + state.q_wm.inverse_transform_vector(&up_w);
    (felt(before), felt(now))
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

    fn state(v: [f64; 3], q: UnitQuaternion<f64>) -> MountState {
        MountState {
            v_w: Vector3::from(v),
            q_wm: q,
            w_w: Vector3::zeros(),
        }
    }

    /// At rest on a grade θ (nose up = rotation by −θ about y, left): f = (g sin θ, 0, g cos θ).
    #[test]
    fn at_rest_on_a_grade_it_feels_gravity_along_the_rail() {
        let theta: f64 = 0.2;
        let q = UnitQuaternion::from_euler_angles(0.0, -theta, 0.0);
        let s = state([0.0; 3], q);
        let (f, end) = specific_force(&s, &s, 0.002, G);
        assert_eq!(f, end);
        assert!(
            (f - Vector3::new(G * theta.sin(), 0.0, G * theta.cos())).norm() < 1e-12,
            "{f}"
        );
    }

    /// Free fall: velocity changes by g dt downwards, nothing is felt.
    #[test]
    fn in_free_fall_it_feels_nothing() {
        let q = UnitQuaternion::from_euler_angles(0.3, 0.2, 0.1);
        let (f, end) = specific_force(
            &state([1.0, 2.0, 0.0], q),
            &state([1.0, 2.0, -G * 0.002], q),
            0.002,
            G,
        );
        assert!(f.norm() < 1e-9 && end.norm() < 1e-9);
    }

    /// On a level circle to the left: v²/R to the left, whatever the sign of the quaternion.
    #[test]
    fn on_a_circle_it_feels_the_centripetal_acceleration() {
        let (v, radius, dt) = (2.0, 10.0, 0.002);
        let at = |t: f64, sign: f64| {
            let psi = v / radius * t;
            let q = UnitQuaternion::from_euler_angles(0.0, 0.0, psi);
            state(
                [v * psi.cos(), v * psi.sin(), 0.0],
                UnitQuaternion::new_unchecked(q.into_inner() * sign),
            )
        };
        for sign in [1.0, -1.0] {
            let (f, end) = specific_force(&at(5.0, 1.0), &at(5.0 + dt, sign), dt, G);
            // A chord of a circle: shorter than the arc by (ωdt)²/24, 6.7e-9 relative.
            assert!(
                (f - Vector3::new(0.0, v * v / radius, G)).norm() < 1e-8,
                "{f}"
            );
            assert!((f - end).norm() < 1e-12);
        }
    }
}
