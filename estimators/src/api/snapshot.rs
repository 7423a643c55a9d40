//! State to bytes and back, to survive a power cycle.
//!
//! The [`State`] of a part of an estimator is all that it keeps from step to step. The data it was built with are no
//! state, and never come from a snapshot. The macro `state!` lists both, field by field, so that none can be forgotten.
//! The bytes are little-endian numbers in that order, between a header and a check sum.

use core::fmt;

use nalgebra::SMatrix;

use crate::Real;

/// Largest size of a snapshot of an estimator of this crate, bytes.
pub const MAX_SNAPSHOT_BYTES: usize = 18432;

/// "mono", and the format's version with the size of the scalar.
const FORMAT: [u8; 6] = [b'm', b'o', b'n', b'o', 2, size_of::<Real>() as u8];

/// CRC-32 of ISO 3309: finds every error within 32 bits.
const CHECK: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Reason why a snapshot cannot be made, or is refused. A refused snapshot leaves the estimator as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The buffer is too small: this number of bytes is needed ([`MAX_SNAPSHOT_BYTES`] always suffices for estimators
    /// of this crate).
    Room(usize),
    /// Fewer or more bytes than a snapshot of this estimator has.
    Torn,
    /// The check sum is wrong.
    Corrupt,
    /// Not a snapshot, or a snapshot in another format or scalar.
    Format,
    /// A snapshot of another estimator.
    OtherEstimator,
    /// A snapshot of an estimator built for another vehicle, with other parameters, or by another version.
    OtherSettings,
    /// A number that no estimator can hold: not finite, or a covariance that is none.
    Nonsense,
    /// This estimator cannot make snapshots.
    NotKept,
}

impl fmt::Display for SnapshotError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Room(bytes) => write!(out, "a snapshot takes {bytes} bytes"),
            Self::Torn => write!(out, "the snapshot has the wrong length"),
            Self::Corrupt => write!(out, "the check sum of the snapshot is wrong"),
            Self::Format => write!(
                out,
                "this is not a snapshot, or it has another format or scalar"
            ),
            Self::OtherEstimator => write!(out, "the snapshot is of another estimator"),
            Self::OtherSettings => write!(
                out,
                "the snapshot is of another vehicle, other parameters or another version"
            ),
            Self::Nonsense => write!(out, "the snapshot has a number that no estimator can have"),
            Self::NotKept => write!(out, "this estimator cannot make snapshots"),
        }
    }
}

impl core::error::Error for SnapshotError {}

enum Bytes<'a> {
    Out(&'a mut [u8]),
    In(&'a [u8]),
}

/// Bytes being written, or read. After a fault it goes on to count, and changes nothing.
pub struct Archive<'a> {
    bytes: Bytes<'a>,
    at: usize,
    fault: Option<SnapshotError>,
}

impl<'a> Archive<'a> {
    /// Makes an archive to write to.
    pub(crate) fn writer(bytes: &'a mut [u8]) -> Self {
        Self {
            bytes: Bytes::Out(bytes),
            at: 0,
            fault: None,
        }
    }

    /// Makes an archive to read from.
    pub(crate) fn reader(bytes: &'a [u8]) -> Self {
        Self {
            bytes: Bytes::In(bytes),
            at: 0,
            fault: None,
        }
    }

    /// Returns the number of bytes read or written, or the first refusal.
    pub(crate) fn finish(self) -> Result<usize, SnapshotError> {
        match (self.fault, self.bytes) {
            (Some(SnapshotError::Room(_)), _) => Err(SnapshotError::Room(self.at)),
            (Some(fault), _) => Err(fault),
            (None, Bytes::In(bytes)) if self.at < bytes.len() => Err(SnapshotError::Torn),
            (None, _) => Ok(self.at),
        }
    }

    /// Refuses the snapshot; only the first refusal is kept.
    pub fn refuse(&mut self, fault: SnapshotError) {
        self.fault.get_or_insert(fault);
    }

    /// Refuses the snapshot as impossible unless `good`.
    pub(crate) fn require(&mut self, good: bool) {
        if !good {
            self.refuse(SnapshotError::Nonsense);
        }
    }

    /// Writes `now` and returns it, or returns the value that is read instead.
    pub(crate) fn raw<const W: usize>(&mut self, now: [u8; W]) -> [u8; W] {
        let places = self.at..self.at.saturating_add(W);
        self.at = places.end;
        match &mut self.bytes {
            Bytes::Out(bytes) => match bytes.get_mut(places) {
                Some(place) => place.copy_from_slice(&now),
                None => self.refuse(SnapshotError::Room(0)),
            },
            Bytes::In(bytes) => match bytes.get(places).and_then(|b| b.first_chunk()) {
                Some(read) if self.fault.is_none() => return *read,
                Some(_) => {}
                None => self.refuse(SnapshotError::Torn),
            },
        }
        now
    }
}

/// State that changes from step to step.
pub trait State {
    /// Passes each number to `archive`, which writes or replaces it.
    fn visit(&mut self, archive: &mut Archive);
}

macro_rules! numbers {
    ($($number:ty),*) => {
        $(impl State for $number {
            fn visit(&mut self, archive: &mut Archive) {
                *self = <$number>::from_le_bytes(archive.raw(self.to_le_bytes()));
            }
        })*
    };
}
numbers!(u8, i16, u32, u64, i64);

macro_rules! finite_numbers {
    ($($number:ty),*) => {
        $(impl State for $number {
            fn visit(&mut self, archive: &mut Archive) {
                let next = <$number>::from_le_bytes(archive.raw(self.to_le_bytes()));
                archive.require(next.is_finite());
                *self = next;
            }
        })*
    };
}
finite_numbers!(f32, f64);

impl State for bool {
    fn visit(&mut self, archive: &mut Archive) {
        let [next] = archive.raw([u8::from(*self)]);
        archive.require(next < 2);
        *self = next == 1;
    }
}

impl State for usize {
    fn visit(&mut self, archive: &mut Archive) {
        let mut next = *self as u64;
        next.visit(archive);
        *self = next as usize;
    }
}

impl<T: State, const N: usize> State for [T; N] {
    fn visit(&mut self, archive: &mut Archive) {
        self.iter_mut().for_each(|part| part.visit(archive));
    }
}

impl<A: State, B: State> State for (A, B) {
    fn visit(&mut self, archive: &mut Archive) {
        self.0.visit(archive);
        self.1.visit(archive);
    }
}

/// A value to read into if there was none.
pub(crate) trait Blank {
    /// It does not matter what: all of it is overwritten.
    fn blank() -> Self;
}

impl Blank for f32 {
    fn blank() -> Self {
        0.0
    }
}

impl Blank for f64 {
    fn blank() -> Self {
        0.0
    }
}

impl Blank for i64 {
    fn blank() -> Self {
        0
    }
}

impl<T: Blank, const N: usize> Blank for [T; N] {
    fn blank() -> Self {
        core::array::from_fn(|_| T::blank())
    }
}

impl<A: Blank, B: Blank> Blank for (A, B) {
    fn blank() -> Self {
        (A::blank(), B::blank())
    }
}

impl<const R: usize, const C: usize> Blank for SMatrix<Real, R, C> {
    fn blank() -> Self {
        Self::zeros()
    }
}

impl<T: State + Blank> State for Option<T> {
    fn visit(&mut self, archive: &mut Archive) {
        let mut some = self.is_some();
        some.visit(archive);
        match (some, self) {
            (true, this) => this.get_or_insert_with(T::blank).visit(archive),
            (false, this) => *this = None,
        }
    }
}

impl<const R: usize, const C: usize> State for SMatrix<Real, R, C> {
    fn visit(&mut self, archive: &mut Archive) {
        self.iter_mut().for_each(|number| number.visit(archive));
    }
}

/// A symmetric matrix: its lower triangle.
pub(crate) fn visit_symmetric<const N: usize>(
    matrix: &mut SMatrix<Real, N, N>,
    archive: &mut Archive,
) {
    for j in 0..N {
        for i in j..N {
            if let Some(number) = matrix.get_mut((i, j)) {
                number.visit(archive);
            }
        }
    }
    matrix.fill_upper_triangle_with_lower_triangle();
}

/// A part that exists or not, as the estimator was built.
pub(crate) fn visit_built<T: State>(part: &mut Option<T>, archive: &mut Archive) {
    if let Some(part) = part {
        part.visit(archive);
    }
}

/// `state!(Type { fields of the state; fields it was built with })`, all fields of it. With `where |this| condition`
/// the state must meet the condition.
macro_rules! state {
    ($(@[$($generics:tt)*])? $type:ty { $($state:ident),*; $($built:ident),* } $(where |$this:ident| $good:expr)?) => {
        impl$(<$($generics)*>)? $crate::api::snapshot::State for $type {
            fn visit(&mut self, archive: &mut $crate::api::snapshot::Archive) {
                let Self { $($state,)* $($built: _,)* } = self;
                $($crate::api::snapshot::State::visit($state, archive);)*
                $(let $this = &*self; archive.require($good);)?
            }
        }
    };
}
pub(crate) use state;

/// Origin of a snapshot, as fingerprints: the estimator, and the vehicle and parameters it was built with.
pub(crate) struct Origin {
    pub estimator: u64,
    pub settings: u64,
}

/// Writes a snapshot: format, origin, state, check sum. Returns the number of bytes it took.
pub(crate) fn write(
    bytes: &mut [u8],
    origin: &Origin,
    state: &mut impl State,
) -> Result<usize, SnapshotError> {
    let mut archive = Archive::writer(bytes);
    archive.raw(FORMAT);
    archive.raw(origin.estimator.to_le_bytes());
    archive.raw(origin.settings.to_le_bytes());
    state.visit(&mut archive);
    let used = match archive.finish() {
        Ok(used) => used,
        Err(SnapshotError::Room(used)) => return Err(SnapshotError::Room(used + 4)),
        Err(fault) => return Err(fault),
    };
    let room = SnapshotError::Room(used + 4);
    let (body, rest) = bytes.split_at_mut_checked(used).ok_or(room)?;
    let sum = rest.first_chunk_mut().ok_or(room)?;
    *sum = CHECK.checksum(body).to_le_bytes();
    Ok(used + 4)
}

/// Reads a snapshot into `state`, which is incomplete after an error.
pub(crate) fn read(
    snapshot: &[u8],
    origin: &Origin,
    state: &mut impl State,
) -> Result<(), SnapshotError> {
    let (body, sum) = snapshot.split_last_chunk().ok_or(SnapshotError::Torn)?;
    if CHECK.checksum(body).to_le_bytes() != *sum {
        return Err(SnapshotError::Corrupt);
    }
    let mut archive = Archive::reader(body);
    if archive.raw([0; 6]) != FORMAT {
        return Err(SnapshotError::Format);
    }
    if u64::from_le_bytes(archive.raw([0; 8])) != origin.estimator {
        return Err(SnapshotError::OtherEstimator);
    }
    if u64::from_le_bytes(archive.raw([0; 8])) != origin.settings {
        return Err(SnapshotError::OtherSettings);
    }
    state.visit(&mut archive);
    archive.finish().map(|_| ())
}
