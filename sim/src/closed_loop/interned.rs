//! Names that are known only when a part is loaded; each name is kept once, as long as the program runs.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// The name, kept as long as the program: for the channels of an estimator whose names stand in no source. However
/// often it is asked for, it is kept once.
pub fn interned(name: &str) -> &'static str {
    static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = Box::leak(name.into());
    names.insert(kept);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same memory every time, so that building a part again takes none.
    #[test]
    fn a_name_is_kept_once() {
        let first = interned("sway of the hook");
        for _ in 0..10_000 {
            let again = interned(&["sway", "of", "the", "hook"].join(" "));
            assert!(std::ptr::eq(first, again));
        }
        assert_ne!(interned("other"), first);
    }
}
