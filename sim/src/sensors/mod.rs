//! The instruments: ideal physics at the mount point, then a composed error model, then faults.

use crate::error::Error;
use crate::plant::Truth;
use monorig_estimators::signals::Measurements;

/// All instruments of a train.
pub trait Sensors {
    /// Look at the truth after a step of the plant; put what is new into `z` (cleared by the caller).
    fn measure(&mut self, truth: &Truth, z: &mut Measurements) -> Result<(), Error>;
}
