//! Places of estimators in a palette of colours: one for each name, the same in reports and in the viewer.

use monorig_estimators::registry::{Kind, NAMES, PRINTED_NAMES, kind};

/// Number of places for monorig's names, and number of places after these for other names.
const OTHERS: (usize, usize) = (6, 18);

/// The place of an estimator: those made for use come first, then the others in the order of the registry. A name that
/// the registry does not have gets a place by its letters.
pub fn place(name: &str) -> usize {
    let mut known: Vec<&str> = NAMES.iter().chain(PRINTED_NAMES).copied().collect();
    known.sort_by_key(|name| match kind(name) {
        Some(Kind::Ours) => 0,
        Some(Kind::Supervised) => 1,
        _ => 2,
    });
    let letters = || {
        name.bytes()
            .fold(0, |sum, byte| 31 * (sum % 997) + usize::from(byte))
    };
    let place = known.iter().position(|known| *known == name);
    place.unwrap_or_else(|| OTHERS.0 + letters() % OTHERS.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_of_the_registry_has_a_place_of_its_own() {
        let names = NAMES.iter().chain(PRINTED_NAMES);
        let places: std::collections::BTreeSet<usize> = names.clone().map(|n| place(n)).collect();
        assert_eq!(places.len(), names.count());
        assert!(place("rail_fusion") < place("ffrls") && place("mine") >= OTHERS.0);
    }
}
