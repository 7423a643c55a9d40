//! The trait of every estimator.

use crate::Real;
use crate::api::{
    aid::AidStatus,
    error::Error,
    signals::{Command, Estimate, Measurements},
    snapshot::SnapshotError,
};

/// An internal quantity of an estimator, for plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Internal {
    /// Name of its channel.
    pub name: &'static str,
    /// Unit, `-` for none.
    pub unit: &'static str,
}

impl Internal {
    /// Builds the quantity from its name and unit.
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit }
    }
}

/// An estimator of mass and slope. Only `step` and `reset` must be there; all else has a default of nothing.
///
/// Object safe, and free for others: those of this crate are plain data without a heap, one of another crate may be
/// anything.
///
/// ```
/// use monorig_estimators::{Command, Error, Estimate, Estimator, Measurements, Real, Value};
///
/// /// Takes the mean of the wheels for the speed and estimates nothing else.
/// struct MeanSpeed;
///
/// impl Estimator for MeanSpeed {
///     fn step(&mut self, z: &Measurements, _: &Command, _: Real) -> Result<Estimate, Error> {
///         let fresh = || z.wheel_speed_mps.iter().flatten();
///         let count = fresh().count();
///         let mean = fresh().map(|sample| sample.value).sum::<Real>() / count.max(1) as Real;
///         let speed_mps = Value { value: mean, sd: 0.01, valid: count > 0 };
///         Ok(Estimate { speed_mps, ..Estimate::at(z.t) })
///     }
///
///     fn reset(&mut self) {}
/// }
///
/// let mut estimator: Box<dyn Estimator> = Box::new(MeanSpeed);
/// let estimate = estimator.step(&Measurements::default(), &Command::default(), 0.005)?;
/// assert!(!estimate.speed_mps.valid && estimator.internals().is_empty());
/// # Ok::<(), Error>(())
/// ```
pub trait Estimator {
    /// Makes one step of `dt` seconds with the samples that came since the last step. On an error the estimator is as
    /// it was, but after [`Error::Diverged`] as it was built; [`Error::Own`] tells a reason of one's own,
    /// [`Error::Broken`] ends the run.
    ///
    /// Filters integrate over `dt`; the stamps in `z` show which samples are fresh. The two clocks are checked against
    /// each other: `dt` may not be more than twice the time since the last step (which leaves room for jitter). Less is
    /// a pause.
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error>;

    /// Resets the estimator to its first state.
    fn reset(&mut self);

    /// Internal quantities of the estimator, for plots.
    fn internals(&self) -> &[Internal] {
        &[]
    }

    /// Writes the internal quantities, in the same order, into `values`; as many as fit.
    fn internal_values(&self, _values: &mut [Real]) {}

    /// Sources of measurements that the estimator uses, such as `wheel_speed`.
    fn aid_sources(&self) -> &[&'static str] {
        &[]
    }

    /// Writes the status of the last measurement of each source, in the same order, into `status`; as many as fit.
    fn aid_status(&self, _status: &mut [AidStatus]) {}

    /// Writes the estimator's state into `bytes` and returns the number of written bytes. Take a snapshot between
    /// steps, as often as the memory it goes to bears.
    fn snapshot(&self, _bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        Err(SnapshotError::NotKept)
    }

    /// Restores the state of the snapshot, to the last bit. Refused, and unchanged, unless the snapshot is whole and of
    /// the same estimator, built with the same vehicle and parameters. The clock must go on from where it was.
    fn restore(&mut self, _snapshot: &[u8]) -> Result<(), SnapshotError> {
        Err(SnapshotError::NotKept)
    }
}

/// Copies as much of `from` as fits.
pub(crate) fn copy_into<T: Copy>(values: &mut [T], from: &[T]) {
    for (place, value) in values.iter_mut().zip(from) {
        *place = *value;
    }
}
