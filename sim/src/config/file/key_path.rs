//! Paths of keys, as messages show them.

/// `parent.key`.
pub(super) fn join(parent: &str, key: &str) -> String {
    match parent {
        "" => key.to_owned(),
        _ => format!("{parent}.{key}"),
    }
}

/// `parent.key`, unless the path ends with the key already.
pub(super) fn with_key(parent: &str, key: &str) -> String {
    if parent == key || parent.ends_with(&format!(".{key}")) {
        parent.to_owned()
    } else {
        join(parent, key)
    }
}
