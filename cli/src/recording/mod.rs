//! Runs that are recorded: simulated or played from a log, at a pace, under the name of their variant.

pub(crate) mod pace;
pub(crate) mod play;
pub(crate) mod simulate;
pub(crate) mod standing_noise;
pub(crate) mod variant;
