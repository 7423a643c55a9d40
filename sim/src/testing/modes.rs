//! Natural modes of the train: the multibody model linearised numerically around a state in which nothing changes but
//! the way.
//!
//! One step of the model maps its state x (places, turns and velocities of the bodies, rates of the wheels, deflections
//! of all bristles) to x⁺. Its Jacobian A = ∂x⁺/∂x is taken by central differences; an eigenvalue λ of A is a mode
//! e^{st} with s = ln λ / dt, period 2π/|Im s| and damping ratio −Re s/|s|. Torque and brake are held; a controller
//! would change the modes.

use crate::plant::train::body_state::{BodyState, Wrench};
use crate::plant::train::dynamics::Dynamics;
use crate::rail::Rail;
use monorig_estimators::api::signals::Command;
use nalgebra::linalg::{Schur, balancing::balance_parlett_reinsch};
use nalgebra::{Complex, DMatrix, DVector, UnitQuaternion, Vector3};

/// Perturbations of places (m) and turns (rad), of velocities (m/s, rad/s), and of bristles (m): small against the
/// static deflections of wheels (0.1 mm) and bristles (1 µm).
const PLACE: f64 = 1e-7;
const VELOCITY: f64 = 1e-6;
const BRISTLE: f64 = 1e-9;
/// Modes faster than this are springs and wheels, not looked for, s.
const MIN_PERIOD_S: f64 = 0.25;
/// Modes slower than this are drift along the rail, s.
const MAX_PERIOD_S: f64 = 60.0;
/// Modes that are damped more than this do not swing.
const MAX_DAMPING: f64 = 0.7;

/// Relative tolerance of the Schur form, and its steps at most: an error of 1e-12 in λ is one of 1e-9 rad/s.
const SCHUR_TOLERANCE: f64 = 1e-12;
const SCHUR_STEPS: usize = 100_000;

/// A mode that swings.
#[derive(Clone, Debug)]
pub struct Mode {
    /// Period, s.
    pub period_s: f64,
    /// Share of the critical damping; below 0 the mode grows.
    pub damping_ratio: f64,
    /// Amplitudes of the centres of mass in the world, m, in the order of `Train::bodies`, at the phase in which the
    /// largest of them and of the turns is 1.
    pub shape: Vec<Vector3<f64>>,
    /// Amplitudes of the turns of the bodies in the world, rad.
    pub turns: Vec<Vector3<f64>>,
}

/// The modes of a train in a steady state (at rest, or at constant speed on a straight rail) under a command, the
/// slowest first.
pub fn natural_modes(
    dynamics: &Dynamics,
    rail: &Rail,
    bodies: &[BodyState],
    command: &Command,
    dt: f64,
) -> Vec<Mode> {
    let model = Linearisation {
        dynamics,
        rail,
        bodies,
        command,
        dt,
    };
    let a = model.jacobian();
    let mut balanced = a.clone();
    balance_parlett_reinsch(&mut balanced);
    // Rigid motion makes λ = 1 a defective eigenvalue, on which a tolerance of rounding alone would never be met.
    let Some(schur) = Schur::try_new(balanced, SCHUR_TOLERANCE, SCHUR_STEPS) else {
        return Vec::new();
    };
    let mut modes: Vec<Mode> = schur
        .complex_eigenvalues()
        .iter()
        .filter(|z| z.im > 0.0)
        .filter_map(|z| model.mode(&a, *z))
        .collect();
    modes.sort_by(|a, b| b.period_s.total_cmp(&a.period_s));
    modes
}

struct Linearisation<'a> {
    dynamics: &'a Dynamics,
    rail: &'a Rail,
    bodies: &'a [BodyState],
    command: &'a Command,
    dt: f64,
}

impl Linearisation<'_> {
    fn jacobian(&self) -> DMatrix<f64> {
        let n = 12 * self.bodies.len() + self.dynamics.internals().len();
        let mut a = DMatrix::zeros(n, n);
        for i in 0..n {
            let size = self.size(i);
            let column = (self.step(i, size) - self.step(i, -size)) / (2.0 * size);
            a.set_column(i, &column);
        }
        a
    }

    /// Perturbation of state `i`.
    fn size(&self, i: usize) -> f64 {
        let n = self.bodies.len();
        match i {
            _ if i < 6 * n => PLACE,
            _ if i < 12 * n => VELOCITY,
            _ if i < 12 * n + 2 * self.dynamics.drives.len() => VELOCITY,
            _ => BRISTLE,
        }
    }

    /// State after a step, relative to the unperturbed state before it, with state `i` perturbed by `by`: places,
    /// turns, velocities, angular velocities of all bodies, then the internal states.
    fn step(&self, i: usize, by: f64) -> DVector<f64> {
        let n = self.bodies.len();
        let mut moved = DVector::zeros(12 * n + self.dynamics.internals().len());
        moved[i] = by;
        let take = |x: &DVector<f64>, group: usize, body: usize| {
            x.fixed_rows::<3>(3 * (group * n + body)).into_owned()
        };
        let train = &self.dynamics.train.bodies;
        let each = self.bodies.iter().zip(train).enumerate();
        let states: Vec<BodyState> = each
            .map(|(k, (s, b))| {
                let q = UnitQuaternion::from_scaled_axis(take(&moved, 1, k)) * s.q;
                let r = q.to_rotation_matrix().into_inner();
                let c = s.c + take(&moved, 0, k);
                BodyState {
                    p: c - r * b.com,
                    q,
                    r,
                    c,
                    v: s.v + take(&moved, 2, k),
                    w: s.w + take(&moved, 3, k),
                    ..*s
                }
            })
            .collect();
        let mut dynamics = self.dynamics.clone();
        let first = dynamics.internals();
        let internals: Vec<f64> = first
            .iter()
            .zip(moved.iter().skip(12 * n))
            .map(|(a, b)| a + b)
            .collect();
        let mut wrenches = vec![Wrench::ZERO; n];
        dynamics.set_internals(&internals);
        dynamics.forces(self.rail, &states, self.command, self.dt, &mut wrenches);

        let mut after = moved;
        for (k, (s, wrench)) in states.iter().zip(&wrenches).enumerate() {
            let inertia = s.r * train[k].inertia * s.r.transpose();
            let turning = inertia
                .try_inverse()
                .map_or(Vector3::zeros(), |j| j * wrench.torque);
            let v = s.v + wrench.force * (self.dt / train[k].mass_kg);
            let w = s.w + turning * self.dt;
            for j in 0..3 {
                after[3 * k + j] += self.dt * v[j];
                after[3 * (n + k) + j] += self.dt * w[j];
                after[3 * (2 * n + k) + j] = v[j];
                after[3 * (3 * n + k) + j] = w[j];
            }
        }
        for (k, x) in dynamics.internals().iter().enumerate() {
            after[12 * n + k] = *x;
        }
        after
    }

    /// The mode of an eigenvalue, if it is one that swings; its vector by inverse iteration.
    fn mode(&self, a: &DMatrix<f64>, z: Complex<f64>) -> Option<Mode> {
        let s = z.ln() / self.dt;
        let (period_s, damping_ratio) = (2.0 * std::f64::consts::PI / s.im.abs(), -s.re / s.norm());
        if !(MIN_PERIOD_S..MAX_PERIOD_S).contains(&period_s) || damping_ratio > MAX_DAMPING {
            return None;
        }
        let n = self.bodies.len();
        let near = z * Complex::new(1.0 + 1e-9, 1e-9);
        let shifted =
            a.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(a.nrows(), a.nrows()) * near;
        let lu = shifted.lu();
        let mut x = DVector::from_element(a.nrows(), Complex::new(1.0, 0.0));
        for _ in 0..4 {
            x = lu.solve(&x)?;
            x /= Complex::new(x.norm(), 0.0);
        }
        let largest = x
            .rows(0, 6 * n)
            .iter()
            .fold(Complex::new(0.0, 0.0), |m, y| {
                if y.norm() > m.norm() { *y } else { m }
            });
        let at = |k: usize| (x[k] / largest).re;
        let three = |k: usize| Vector3::new(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        Some(Mode {
            period_s,
            damping_ratio,
            shape: (0..n).map(three).collect(),
            turns: (n..2 * n).map(three).collect(),
        })
    }
}
