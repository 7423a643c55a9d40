//! Runs: simulated or played from a log, at a pace, under the name of their variant, one or many.

pub(crate) mod many;
pub(crate) mod pace;
pub(crate) mod play;
pub(crate) mod simulate;
pub(crate) mod standing_noise;
pub(crate) mod variant;
