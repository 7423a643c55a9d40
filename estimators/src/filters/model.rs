//! The model of a Kalman filter, with its Jacobians, named as in every textbook.
//!
//! A filter of this crate is written once, over this trait: [`Ekf`](crate::filters::ekf::Ekf),
//! [`Ukf`](crate::filters::ukf::Ukf), and over any of them [`Adaptive`](crate::filters::sage_husa::Adaptive). A model
//! is constants and equations; what changes from step to step is its input.
//!
//! Every process, model and aid is in the list of `testing/jacobians.rs`, which compares `F` and `H` with finite
//! differences and looks through the sources for one that is missing.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::filters::gaussian::{Correction, Gaussian};

/// The motion of a state of `N` numbers with additive noise:
///
/// x' = f(x, u) + w, w ~ N(0, Q)
pub trait Process<const N: usize> {
    /// Inputs of a step: forces, rates, known parameters.
    type Input;

    /// State after `dt` seconds.
    fn f(&self, x: &SVector<Real, N>, u: &Self::Input, dt: Real) -> SVector<Real, N>;

    /// Its Jacobian ∂f/∂x.
    fn F(&self, x: &SVector<Real, N>, u: &Self::Input, dt: Real) -> SMatrix<Real, N, N>;

    /// State and Jacobian at once, for a model in which they share work.
    fn f_and_F(
        &self,
        x: &SVector<Real, N>,
        u: &Self::Input,
        dt: Real,
    ) -> (SVector<Real, N>, SMatrix<Real, N, N>) {
        (self.f(x, u, dt), self.F(x, u, dt))
    }

    /// Covariance of the process noise of such a step.
    fn Q(&self, u: &Self::Input, dt: Real) -> SMatrix<Real, N, N>;
}

/// A process that is observed by one measurement of `M` numbers:
///
/// z = h(x) + v, v ~ N(0, R)
///
/// R is not part of it: it belongs to the instrument, and a filter may adapt it. A process with several measurements,
/// each with control and gate of its own, has an [`Aid`](crate::aiding::Aid) for each.
pub trait Model<const N: usize, const M: usize>: Process<N> {
    /// Measurement without noise.
    fn h(&self, x: &SVector<Real, N>) -> SVector<Real, M>;

    /// Its Jacobian ∂h/∂x.
    fn H(&self, x: &SVector<Real, N>) -> SMatrix<Real, M, N>;
}

/// A filter of a model's state: what the extended and the unscented Kalman filter have in common.
pub trait Filter<const N: usize, const M: usize> {
    /// Type of the model.
    type Model: Model<N, M>;

    /// The model.
    fn model(&self) -> &Self::Model;

    /// Mean and covariance of the state.
    fn belief(&self) -> &Gaussian<N>;

    /// Mutable mean and covariance, to start or to limit them.
    fn belief_mut(&mut self) -> &mut Gaussian<N>;

    /// Carries the belief over `dt` seconds. `None`, and nothing changed, if the covariance is not positive definite.
    fn predict(&mut self, u: &<Self::Model as Process<N>>::Input, dt: Real) -> Option<()>;

    /// Corrects the belief by a measurement `z` with noise `R`. `None`, and nothing changed, if the innovation
    /// covariance is not positive definite.
    fn update(&mut self, z: SVector<Real, M>, R: &SMatrix<Real, M, M>) -> Option<Correction<M, N>>;
}
