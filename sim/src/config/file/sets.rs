//! Changes of `--set path=value` to a file and to the files that it names.

/// Paths and values, in the order in which they take effect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sets {
    /// Place of the changes in messages; none: the command line, with `--set`.
    written_in: Option<String>,
    /// Beginning of the paths as the user wrote them, such as `track.`.
    prefix: String,
    list: Vec<(String, String)>,
}

impl Sets {
    /// Changes to a file, as `--set` makes them.
    pub fn new(list: &[(String, String)]) -> Self {
        Self {
            written_in: None,
            prefix: String::new(),
            list: list.to_vec(),
        }
    }

    /// Gives the changes another place in messages, such as `` `vary` of study.yaml ``.
    pub fn written_in(mut self, place: &str) -> Self {
        self.written_in = Some(place.into());
        self
    }

    /// Changes to the file itself, given the keys under which it names other files.
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
            written_in: self.written_in.clone(),
            list: inside.collect(),
            prefix: format!("{}{prefix}", self.prefix),
        }
    }

    /// Path and value of each change, in the terms of the changed file.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &(String, String)> {
        self.list.iter()
    }

    /// Returns the change as the user wrote it.
    pub(crate) fn written(&self, path: &str, value: &str) -> String {
        let prefix = &self.prefix;
        match &self.written_in {
            None => format!("--set {prefix}{path}={value}"),
            Some(place) => format!("{prefix}{path} = {value} by {place}"),
        }
    }

    /// All changes as the user wrote them; `None` without changes.
    pub(crate) fn all_written(&self) -> Option<String> {
        let all: Vec<_> = self.list.iter().map(|(p, v)| self.written(p, v)).collect();
        let between = match self.written_in {
            None => " ",
            Some(_) => ", ",
        };
        (!all.is_empty()).then(|| all.join(between))
    }
}
