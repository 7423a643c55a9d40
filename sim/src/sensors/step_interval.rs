//! The interval of time that instruments look at in one call.

/// Interval of time from one physics step to the next, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepInterval {
    /// Begin.
    pub from_ns: i64,
    /// End; not before the begin.
    pub to_ns: i64,
}

impl StepInterval {
    /// Length, s; at least 1 ns, so that an empty interval can be divided by.
    pub fn length_s(&self) -> f64 {
        (self.to_ns - self.from_ns).max(1) as f64 * 1e-9
    }
}
