//! Adhesion along the rail: dry by default, less where it is wet, oily or dusty.

/// A stretch of rail with its own adhesion coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdhesionZone {
    /// Start, m.
    pub from_m: f64,
    /// End, m.
    pub to_m: f64,
    /// Coefficient.
    pub adhesion: f64,
}

/// Returns the coefficient at chainage `s`: the value of the last zone that covers it, else `dry`.
pub(crate) fn at(zones: &[AdhesionZone], s: f64, dry: f64) -> f64 {
    zones
        .iter()
        .rev()
        .find(|z| (z.from_m..=z.to_m).contains(&s))
        .map_or(dry, |z| z.adhesion)
}
