//! `joint_ekf`: mass and slope from one extended Kalman filter, with which Liu et al. 2023
//! ([`liu_2023`](crate::methods::liu_2023)) compare theirs. The paper does not print it: here eq. 23–29 with w = 10⁴/M,
//! about 1, for a third state that does not change.
//!
//! Poor by construction: from traction and speed alone a heavier train and a steeper slope look alike.

use nalgebra::{Matrix1, Matrix3, SMatrix, Vector1, Vector3, matrix, vector};

use crate::Real;
use crate::api::estimator::Internal;
use crate::api::estimator::copy_into;
use crate::api::params::params;
use crate::api::real::{sqrt, within};
use crate::api::snapshot::state;
use crate::api::vehicle::Vehicle;
use crate::filters::ekf::Ekf;
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Model, Process};
use crate::methods::liu_2023::Slope;
use crate::methods::method::{Answer, Found, Method, Signals};
use crate::models::force_balance::ForceBalance;

params! {
    /// The mass of `joint_ekf` at the start.
    FirstMass {
        mass0_kg ["kg"] = none, 1.0 => 1e6, "Total mass at the start; not set: the middle of the vehicle's mass range.";
        mass_sd ["-"] = 0.4, 0.001 => 2.0, "Standard deviation of this mass, as a share of the mass.";
    }
}

methods! {
    /// Mass and slope from one extended Kalman filter.
    joint_ekf: JointEkfPublished = Joint,
        { mass: FirstMass, slope: Slope },
        |vehicle, p| joint(vehicle, &p.mass, &p.slope);
}

/// M w, kg.
pub(crate) const SCALE: Real = 1e4;

/// Inputs of a step of [`JointModel`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NetForce {
    /// Traction at the rims less drag, N.
    pub traction_n: Real,
    /// Running resistance with the sign of the speed: sgn(v) μ.
    pub resistance: Real,
}

/// The force balance with the mass in the state: [v, θ, w], measurement wheel speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointModel {
    /// Constants of the balance.
    pub balance: ForceBalance,
    /// Process noise of v (m²/s³) and θ (rad²/s).
    pub q: [Real; 2],
}

impl Process<3> for JointModel {
    type Input = NetForce;

    fn f(&self, x: &Vector3<Real>, u: &NetForce, dt: Real) -> Vector3<Real> {
        self.f_and_F(x, u, dt).0
    }

    fn F(&self, x: &Vector3<Real>, u: &NetForce, dt: Real) -> Matrix3<Real> {
        self.f_and_F(x, u, dt).1
    }

    fn f_and_F(&self, x: &Vector3<Real>, u: &NetForce, dt: Real) -> (Vector3<Real>, Matrix3<Real>) {
        let (mass, J) = (SCALE / x.z, self.balance.rotating_mass_kg); // M of eq. 23 is a state
        let [v_dot, by_theta] = self
            .balance
            .acceleration(u.traction_n, mass, x.y, u.resistance);
        // v̇ (1 + J w/S) = F w/S − g (sin θ + …)  ⇒  ∂v̇/∂w = (F − J v̇)/S / (1 + J w/S)
        let by_w = (u.traction_n - J * v_dot) / (SCALE + J * x.z);
        (
            vector![x.x + dt * v_dot, x.y, x.z],
            matrix![1.0, dt * by_theta, dt * by_w; 0.0, 1.0, 0.0; 0.0, 0.0, 1.0],
        )
    }

    fn Q(&self, _: &NetForce, dt: Real) -> Matrix3<Real> {
        let [q_v, q_theta] = self.q;
        Matrix3::from_diagonal(&vector![q_v * dt, q_theta * dt, 0.0])
    }
}

impl Model<3, 1> for JointModel {
    fn h(&self, x: &Vector3<Real>) -> Vector1<Real> {
        vector![x.x]
    }

    fn H(&self, _: &Vector3<Real>) -> SMatrix<Real, 1, 3> {
        matrix![1.0, 0.0, 0.0]
    }
}

/// Factor by which the filter's mass may lie beyond the range of the mass: further out its model has no sense.
const MAX_RATIO: Real = 100.0;

/// One extended Kalman filter for both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    ekf: Ekf<JointModel, 3>,
    R: Matrix1<Real>,
    mu: Real,
    range_kg: [Real; 2],
    started: bool,
    last: Option<Correction<1, 3>>,
}

impl Joint {
    fn filter(&mut self, z: &Signals) -> Option<()> {
        let Some(traction_n) = z.traction_n else {
            self.started = false;
            return None;
        };
        let push = NetForce {
            traction_n,
            resistance: z.direction * self.mu,
        };
        self.ekf.predict(&push, z.dt); // eq. 27, 28
        let speed = z.new_speed_mps?;
        if !self.started {
            (self.ekf.belief.x.x, self.started) = (speed, true);
        }
        self.last = Some(self.ekf.update(vector![speed], &self.R)?); // eq. 29
        let [low, high] = self.range_kg;
        let w = &mut self.ekf.belief.x.z;
        *w = within(*w, SCALE / (MAX_RATIO * high), MAX_RATIO * SCALE / low);
        Some(())
    }
}

impl Method for Joint {
    const INTERNALS: &'static [Internal] = &[
        Internal::new("inverse_mass", "-"),
        Internal::new("inverse_mass_sd", "-"),
    ];

    fn step(&mut self, z: &Signals) {
        let _ = self.filter(z);
    }

    fn answer(&self) -> Answer {
        let Gaussian { x, P } = self.ekf.belief;
        let [low, high] = self.range_kg;
        let w = within(x.z, SCALE / high, SCALE / low);
        let found = |value, sd, started| Found { value, sd, started };
        let started = self.last.is_some();
        Answer {
            mass_kg: Some(found(
                SCALE / w,
                SCALE / (w * w) * sqrt(P.m33),
                started && w == x.z,
            )),
            grade_rad: found(x.y, sqrt(P.m22), started),
            speed_mps: Some(found(x.x, sqrt(P.m11), started)),
            innovation: self.last.map_or((0.0, 0.0), |c| (c.y.x, c.nis)),
        }
    }

    fn internal_values(&self, values: &mut [Real]) {
        let Gaussian { x, P } = self.ekf.belief;
        copy_into(values, &[x.z, sqrt(P.m33)]);
    }
}

state!(Joint { ekf, started, last; R, mu, range_kg });

fn joint(vehicle: &Vehicle, p: &FirstMass, slope: &Slope) -> ([Real; 2], Joint) {
    let w0 = SCALE / vehicle.first_mass_kg(p.mass0_kg);
    let Gaussian { x, P } = slope.start();
    let model = JointModel {
        balance: ForceBalance::new(vehicle),
        q: [slope.q_v, slope.q_theta],
    };
    let sd = vector![sqrt(P.m11), sqrt(P.m22), w0 * p.mass_sd];
    let belief = Gaussian::independent(vector![x.x, x.y, w0], sd);
    let method = Joint {
        ekf: Ekf::new(model, belief),
        R: Matrix1::new(P.m11),
        mu: vehicle.running_resistance,
        range_kg: vehicle.mass_range_kg,
        started: false,
        last: None,
    };
    ([1.0, 1.0], method)
}
