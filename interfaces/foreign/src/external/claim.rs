//! Ends of connections in use: an estimator at an address or on a bus makes one run at a time.

use monorig_sim::closed_loop::registry::Refusal;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

static IN_USE: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// End of a connection, in use until this value is dropped.
pub(super) struct Claim(String);

impl Claim {
    /// Claims the end of this name, if it is not in use.
    pub fn of(name: String) -> Result<Self, Refusal> {
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        if !in_use.insert(name.clone()) {
            let help = "give each estimator of a scenario its own address or bus, and make one run at a time (`--jobs 1`)";
            let message = format!("the estimator at {name} can make one run at a time");
            return Err(Refusal::new(message, help));
        }
        Ok(Self(name))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.0
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.remove(&self.0);
    }
}
