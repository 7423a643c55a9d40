//! Posterior Cramér-Rao bound (Tichavský, Muravchik and Nehorai 1998) of slope, effective grade and mass for the
//! motion of a run and the noise of its sensor sheet: what no estimator can be better than, on average over runs.
//!
//! The recursion is linearised on the true motion, where all that is random is Gaussian: it is then the covariance of
//! the Kalman filter with the true model. In it are white noise, biases, scale errors and random walks of the sheet;
//! priors of mass, running resistance and the rail behind the train. Not in it are what makes a model wrong: rail
//! that was not read ahead of the middle of the unit, slip, sway of the load, vibration, hits, faults, misalignment,
//! delays. An estimator may be better than the bound in one run, whose biases happen to be small; the bound is for
//! the root mean square over runs.

mod attitude;
mod channels;
mod mass;
mod running;
mod sheet;

pub use channels::{BoundChannels, descriptions};
pub use running::BoundSample;
pub(crate) use running::RunningBound;
