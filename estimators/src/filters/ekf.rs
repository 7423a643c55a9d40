//! Extended Kalman filter (Jazwinski 1970; linearised at the latest estimate).
//!
//! - predict: x⁻ = f(x), P⁻ = F P Fᵀ + Q, with F = ∂f/∂x at x
//! - update: y = z − h(x⁻), then [`Gaussian::correct`] with H = ∂h/∂x at x⁻
//!
//! [`Ekf`] does this for any [`Model`]; [`predict`] and [`update`] are its two halves for who has the numbers.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::snapshot::{Archive, State};
use crate::filters::gaussian::{Correction, Gaussian};
use crate::filters::model::{Filter, Model};

/// The extended Kalman filter of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ekf<T, const N: usize> {
    /// The model.
    pub model: T,
    /// State and covariance.
    pub belief: Gaussian<N>,
}

impl<T, const N: usize> Ekf<T, N> {
    /// Starts from a `belief` about the state.
    pub fn new(model: T, belief: Gaussian<N>) -> Self {
        Self { model, belief }
    }

    /// Carries the belief over `dt` seconds; returns its Jacobian F.
    #[inline]
    pub fn predict<const M: usize>(&mut self, u: &T::Input, dt: Real) -> SMatrix<Real, N, N>
    where
        T: Model<N, M>,
    {
        let (model, x) = (&self.model, self.belief.x);
        let ((x_next, F), Q) = (model.f_and_F(&x, u, dt), model.Q(u, dt));
        predict(&mut self.belief, x_next, &F, &Q);
        F
    }

    /// Corrects the belief by a measurement `z` with noise `R`. `None`, and nothing changed, if the innovation
    /// covariance is not positive definite.
    #[inline]
    pub fn update<const M: usize>(
        &mut self,
        z: SVector<Real, M>,
        R: &SMatrix<Real, M, M>,
    ) -> Option<Correction<M, N>>
    where
        T: Model<N, M>,
    {
        let x = self.belief.x;
        let (h, H) = (self.model.h(&x), self.model.H(&x));
        update(&mut self.belief, z, h, &H, R)
    }
}

/// Expected innovation of the next measurement, before the step to it: for strong tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Preview<const M: usize> {
    /// Innovation z − h(f(x)).
    pub y: SVector<Real, M>,
    /// H F P Fᵀ Hᵀ: its covariance by what is known now.
    pub carried: SMatrix<Real, M, M>,
    /// H Q Hᵀ: its covariance by the process noise of the step.
    pub process: SMatrix<Real, M, M>,
}

impl<T, const N: usize> Ekf<T, N> {
    /// Returns the innovation that the measurement `z` would have after a step of `dt` seconds. Nothing is changed.
    #[inline]
    pub(crate) fn preview<const M: usize>(
        &self,
        z: SVector<Real, M>,
        u: &T::Input,
        dt: Real,
    ) -> Preview<M>
    where
        T: Model<N, M>,
    {
        let (model, x) = (&self.model, self.belief.x);
        let ((x_next, F), Q) = (model.f_and_F(&x, u, dt), model.Q(u, dt));
        let H = model.H(&x_next);
        let carried_P = F * self.belief.P * F.transpose();
        Preview {
            y: z - model.h(&x_next),
            carried: H * carried_P * H.transpose(),
            process: H * Q * H.transpose(),
        }
    }
}

impl<T: Model<N, M>, const N: usize, const M: usize> Filter<N, M> for Ekf<T, N> {
    type Model = T;

    fn model(&self) -> &T {
        &self.model
    }

    fn belief(&self) -> &Gaussian<N> {
        &self.belief
    }

    fn belief_mut(&mut self) -> &mut Gaussian<N> {
        &mut self.belief
    }

    fn predict(&mut self, u: &T::Input, dt: Real) -> Option<()> {
        Ekf::predict(self, u, dt);
        Some(())
    }

    fn update(&mut self, z: SVector<Real, M>, R: &SMatrix<Real, M, M>) -> Option<Correction<M, N>> {
        Ekf::update(self, z, R)
    }
}

/// A snapshot holds the belief only; the model is built again.
impl<T, const N: usize> State for Ekf<T, N> {
    fn visit(&mut self, archive: &mut Archive) {
        self.belief.visit(archive);
    }
}

/// Carries a belief over one time step: `x_next` = f(x), `F` its Jacobian at x, `Q` the process noise of the step.
#[inline]
pub fn predict<const N: usize>(
    belief: &mut Gaussian<N>,
    x_next: SVector<Real, N>,
    F: &SMatrix<Real, N, N>,
    Q: &SMatrix<Real, N, N>,
) {
    belief.x = x_next;
    belief.P = F * belief.P * F.transpose() + Q;
    belief.symmetrise();
}

/// Corrects a belief by a measurement `z` predicted as `z_predicted` = h(x), with Jacobian `H` at x and noise `R`.
/// `None`, and nothing changed, if the innovation covariance is not positive definite.
#[inline]
pub fn update<const M: usize, const N: usize>(
    belief: &mut Gaussian<N>,
    z: SVector<Real, M>,
    z_predicted: SVector<Real, M>,
    H: &SMatrix<Real, M, N>,
    R: &SMatrix<Real, M, M>,
) -> Option<Correction<M, N>> {
    belief.correct(z - z_predicted, H, R)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, chi_square_band};
    use nalgebra::{Matrix1, Matrix2, matrix, vector};

    #[test]
    fn linear_case_equals_a_kalman_recursion_written_out_by_hand() {
        // Oracle: constant-velocity filter, scalar by scalar (Bar-Shalom, Li & Kirubarajan 2001).
        let (dt, q, r) = (0.1, 0.3, 0.5);
        let F = matrix![1.0, dt; 0.0, 1.0];
        let Q = matrix![q * dt * dt * dt / 3.0, q * dt * dt / 2.0; q * dt * dt / 2.0, q * dt];
        let H = matrix![1.0, 0.0];
        let mut random = Random::new(4);
        let mut belief = Gaussian::<2>::independent(vector![0.0, 0.0], vector![2.0, 1.0]);
        let (mut p, mut v, mut pp, mut pv, mut vv) = (0.0, 0.0, 4.0, 0.0, 1.0);
        for k in 0..500 {
            let z = 0.2 * k as Real * dt + random.normal();
            let x_next = F * belief.x;
            predict(&mut belief, x_next, &F, &Q);
            let z_predicted = H * belief.x;
            update(&mut belief, vector![z], z_predicted, &H, &Matrix1::new(r)).unwrap();

            p += dt * v;
            pp += 2.0 * dt * pv + dt * dt * vv + Q.m11;
            pv += dt * vv + Q.m12;
            vv += Q.m22;
            let s = pp + r;
            let (kp, kv, y) = (pp / s, pv / s, z - p);
            p += kp * y;
            v += kv * y;
            vv -= kv * pv;
            pv -= kp * pv;
            pp -= kp * pp;
            assert!((belief.x.x - p).abs() < 1e-9 && (belief.x.y - v).abs() < 1e-9);
            assert!((belief.P - Matrix2::new(pp, pv, pv, vv)).norm() < 1e-9);
        }
    }

    #[test]
    fn error_of_an_in_model_filter_is_chi_square() {
        // A pendulum seen through sin: 200 runs, the normalised estimation error squared at the end of each.
        let (dt, q, r): (Real, Real, Real) = (0.02, 1e-3, 1e-3);
        let mut nees = 0.0;
        let runs = 200;
        for run in 0..runs {
            let mut random = Random::new(1000 + run as u64);
            let f =
                |x: &nalgebra::Vector2<Real>| vector![x.x + dt * x.y, x.y - dt * 4.0 * x.x.sin()];
            let mut belief = Gaussian::<2>::independent(vector![0.3, 0.0], vector![0.05, 0.05]);
            let mut truth = belief.x + vector![0.05 * random.normal(), 0.05 * random.normal()];
            for _ in 0..150 {
                truth = f(&truth) + vector![0.0, (q * dt).sqrt() * random.normal()];
                let z = truth.x.sin() + r.sqrt() * random.normal();
                let F = matrix![1.0, dt; -dt * 4.0 * belief.x.x.cos(), 1.0];
                let x_next = f(&belief.x);
                predict(&mut belief, x_next, &F, &matrix![0.0, 0.0; 0.0, q * dt]);
                let (h, H) = (vector![belief.x.x.sin()], matrix![belief.x.x.cos(), 0.0]);
                update(&mut belief, vector![z], h, &H, &Matrix1::new(r)).unwrap();
            }
            let error = belief.x - truth;
            nees += error.dot(&belief.P.cholesky().unwrap().solve(&error)) / 2.0 / runs as Real;
        }
        let (low, high) = chi_square_band(2 * runs);
        assert!((low..high).contains(&nees), "{nees} not in {low}…{high}");
    }
}
