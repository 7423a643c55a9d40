//! The last snapshots of the estimator, in memory that a reset does not clear: after a brown-out it goes on from there.

use monorig_estimators::Estimator;
use monorig_estimators::api::snapshot::MAX_SNAPSHOT_BYTES as BYTES;

/// A snapshot. Its bytes have a check sum of their own.
struct Place {
    /// Number of the snapshot.
    number: u32,
    length: u32,
    bytes: [u8; BYTES],
}

const EMPTY: Place = Place {
    number: 0,
    length: 0,
    bytes: [0; BYTES],
};

/// Two places in turn, so that one is whole whenever the power goes. What is in them after it has come for the first
/// time, no one knows.
#[unsafe(link_section = ".uninit.kept")]
static mut KEPT: [Place; 2] = [EMPTY; 2];

/// The snapshots of this program.
pub struct Kept {
    places: &'static mut [Place; 2],
    number: u32,
}

impl Kept {
    /// Puts the estimator back into the state of the newest snapshot, if there is one. Called once.
    pub fn restore(estimator: &mut impl Estimator) -> Self {
        // its value is not that of the source: a reset keeps it
        let places = core::hint::black_box(&raw mut KEPT);
        // SAFETY: the one reference to it; any bytes are a value of it.
        let places = unsafe { &mut *places };
        let [a, b] = &*places;
        let [newer, older] = if a.number > b.number { [a, b] } else { [b, a] };
        let restored = [newer, older].into_iter().find(|place| {
            let snapshot = place.bytes.get(..place.length as usize);
            snapshot.is_some_and(|snapshot| estimator.restore(snapshot).is_ok())
        });
        let number = restored.map_or(0, |place| place.number);
        Self { places, number }
    }

    /// Takes a snapshot in the place of the older one.
    pub fn keep(&mut self, estimator: &impl Estimator) {
        self.number = self.number.wrapping_add(1);
        let [a, b] = self.places;
        let place = if self.number % 2 == 0 { a } else { b };
        place.length = 0;
        if let Ok(length) = estimator.snapshot(&mut place.bytes) {
            (place.number, place.length) = (self.number, length as u32);
        }
    }
}
