//! Changes to a file as `--set path=value` makes them, with those to the files it names.

/// Paths and values, in the order in which they take effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sets {
    /// What stands before the paths where the user wrote them, such as `track.`.
    prefix: String,
    list: Vec<(String, String)>,
}

impl Sets {
    /// Changes to a file that the user names.
    pub fn new(list: &[(String, String)]) -> Self {
        Self {
            prefix: String::new(),
            list: list.to_vec(),
        }
    }

    /// The changes to the file itself, given the keys under which it names others.
    pub(crate) fn own(&self, files: &[&str]) -> Self {
        let mut own = self.clone();
        own.list.retain(|(path, _)| {
            let key = path.split_once('.').map(|(key, _)| key);
            key.is_none_or(|key| !files.contains(&key))
        });
        own
    }

    /// The changes to the file named under `key`: `track.joints.kink_deg` is `joints.kink_deg` of the track.
    pub(crate) fn of(&self, key: &str) -> Self {
        let prefix = format!("{key}.");
        let inside = self.list.iter().filter_map(|(path, value)| {
            Some((path.strip_prefix(&prefix)?.to_owned(), value.clone()))
        });
        Self {
            list: inside.collect(),
            prefix: format!("{}{prefix}", self.prefix),
        }
    }

    /// Path and value of each, as they are in the file they change.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &(String, String)> {
        self.list.iter()
    }

    /// As the user wrote it.
    pub(crate) fn written(&self, path: &str, value: &str) -> String {
        format!("--set {}{path}={value}", self.prefix)
    }

    /// All of them as the user wrote them; nothing if there are none.
    pub(crate) fn all_written(&self) -> Option<String> {
        let all: Vec<_> = self.list.iter().map(|(p, v)| self.written(p, v)).collect();
        (!all.is_empty()).then(|| all.join(" "))
    }
}
