//! Names of estimators in a scenario: they become part of the paths of channels.

/// Accepts a name that can be part of a channel's path: letters, digits, `_` and `-`, at least one.
pub fn valid_name(name: &str) -> bool {
    !name.is_empty()
        && name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
}

/// Returns the name with `_` in place of every character that is not allowed.
pub(super) fn near_name(name: &str) -> String {
    let valid = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let near: String = name
        .chars()
        .map(|c| if valid(c) { c } else { '_' })
        .collect();
    match near.as_str() {
        "" => "my_estimator".into(),
        _ => near,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_part_of_a_path() {
        for good in ["dffrls_aekf", "tuned-2", "A", "7"] {
            assert!(valid_name(good), "{good}");
        }
        for bad in ["", "a/b", "a b", "é", "a.b", "[0]"] {
            assert!(!valid_name(bad), "{bad}");
            assert!(valid_name(&near_name(bad)), "{bad}");
        }
    }
}
