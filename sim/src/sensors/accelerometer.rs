//! Accelerometer: specific force at the mount, in mount axes (x forward, y left, z up), m/s².
//!
//! Over a physics step: f_M(t) = R_WM(mid-step)ᵀ Δv_W/Δt − R_WM(t)ᵀ g_W, g_W = (0, 0, −g), from the velocity of the mount in
//! the world; the second term is linear between the ends of the step, so that a turning body shows no steps of gravity.
//! A sample is the mean of f_M since the sample before, that is, Δv/T − g with v linear between steps, turned piece by
//! piece into the mount frame (velocity increments in body axes, as strapdown sensors give them: Savage 1998,
//! "Strapdown inertial navigation integration algorithm design, part 2", J. Guidance 21(2)). Positions are never
//! differentiated. At rest it reads (0, 0, +g).

use super::fault::FaultWindow;
use super::signal_path::{SignalPath, StepInterval};
use super::{Instrument, InstrumentKind, SensorChannel, mount};
use crate::error::Error;
use crate::plant::{MountState, Truth};
use monorig_estimators::api::signals::Measurements;
use nalgebra::{UnitQuaternion, Vector3};

/// The accelerometer, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: "accelerometer",
    unsuited: |_| None,
    build: |spec, on| {
        Ok(Box::new(Accelerometer {
            mount: mount::find(on.train, KIND.name, &spec.mounting.link)?,
            path: SignalPath::inertial(KIND.name, spec, on.seed),
            gravity_mps2: on.gravity_mps2,
            before: None,
        }))
    },
};

/// Name in events of the accelerometer and the gyro together.
pub const IMU: &str = "imu";

/// A three-axis accelerometer at a mount.
#[derive(Clone, Debug)]
struct Accelerometer {
    mount: usize,
    path: SignalPath<3>,
    gravity_mps2: f64,
    before: Option<MountState>,
}

impl Instrument for Accelerometer {
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
        let (start, end) = specific_force(&before, &now, step.length_s(), self.gravity_mps2);
        self.path.observe(step, start.into(), end.into())?;
        z.specific_force_mps2 = self.path.deliver(step.to_ns);
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        z.specific_force_mps2 = self.path.ideal();
    }

    fn add_fault(&mut self, _unit: Option<usize>, fault: FaultWindow) {
        self.path.add_fault(fault);
    }

    fn channels(&self) -> Vec<SensorChannel> {
        let axes = ["x", "y", "z"].into_iter().enumerate();
        axes.map(|(i, axis)| {
            SensorChannel::new(
                format_args!("imu/specific_force_{axis}"),
                "m/s²",
                move |z| z.specific_force_mps2.map(|s| s.value[i]),
            )
        })
        .collect()
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
    let force_m = |state: &MountState| acceleration_m + state.q_wm.inverse_transform_vector(&up_w);
    (force_m(before), force_m(now))
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
    fn at_rest_on_a_grade_it_reads_gravity_along_the_rail() {
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

    /// Free fall: velocity changes by g dt downwards, the specific force is zero.
    #[test]
    fn in_free_fall_it_reads_zero() {
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
    fn on_a_circle_it_reads_the_centripetal_acceleration() {
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
