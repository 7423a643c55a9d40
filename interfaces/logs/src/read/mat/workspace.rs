//! The variables of a MAT file that are wanted, by the struct that they are in.

use crate::read::{ReadOptions, full_name, time_column};
use arrow_array::ArrayRef;
use std::collections::BTreeMap;

/// Most memory for the variables of a file, bytes: a file of 1 MB can hold 1 GB of zeros.
const MAX_BYTES: usize = 2 << 30;

/// A vector or matrix of numbers, column by column.
pub(super) struct Variable {
    pub name: String,
    pub dims: Vec<usize>,
    pub values: ArrayRef,
}

/// The variables of a file.
pub(super) struct Workspace<'a> {
    pub options: &'a ReadOptions,
    /// By the name of the struct, as `log.imu`; empty at the top level.
    pub groups: BTreeMap<String, Vec<Variable>>,
    /// Variables that hold no numbers.
    pub unread: Vec<String>,
    left: usize,
}

impl<'a> Workspace<'a> {
    /// Nothing yet.
    pub fn new(options: &'a ReadOptions) -> Self {
        Self {
            options,
            groups: BTreeMap::new(),
            unread: Vec::new(),
            left: MAX_BYTES,
        }
    }

    /// Takes memory for so many bytes.
    pub fn take(&mut self, bytes: usize) -> Result<(), String> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or("its variables take more than 2 GB: fewer of them in a file")?;
        Ok(())
    }

    /// True if a variable may be the time, or is wanted.
    pub fn needs(&self, group: &str, name: &str) -> bool {
        self.time_among(group, &[name.to_owned()]).is_some() || self.options.wants(group, name)
    }

    /// A variable of numbers.
    pub fn put(&mut self, group: &str, name: &str, dims: Vec<usize>, values: ArrayRef) {
        let variable = Variable {
            name: name.to_owned(),
            dims,
            values,
        };
        let group = self.groups.entry(group.to_owned()).or_default();
        group.push(variable);
    }

    /// A variable that is not read, and why.
    pub fn leave(&mut self, group: &str, name: &str, why: &str) {
        let what = format!("variable {}: {why}", full_name(group, name));
        self.unread.push(what);
    }

    /// Name and values of the time of a struct: its own, else that of the struct around it.
    pub fn time_of(&self, group: &str) -> Option<(String, &Variable)> {
        let all = self.groups.get(group).map_or(&[][..], Vec::as_slice);
        let is_vector = |v: &&Variable| v.dims.iter().filter(|n| **n != 1).count() <= 1;
        let vectors: Vec<&Variable> = all.iter().filter(is_vector).collect();
        let names: Vec<String> = vectors.iter().map(|v| v.name.clone()).collect();
        match self.time_among(group, &names).and_then(|i| vectors.get(i)) {
            Some(time) => Some((full_name(group, &time.name), time)),
            None if group.is_empty() => None,
            None => self.time_of(group.rsplit_once('.').map_or("", |(around, _)| around)),
        }
    }

    /// True if a struct has a time.
    pub fn has_time(&self) -> bool {
        self.groups
            .keys()
            .any(|group| self.time_of(group).is_some())
    }

    /// The names of all variables of numbers.
    pub fn names(&self) -> Vec<String> {
        let groups = self.groups.iter();
        groups
            .flat_map(|(group, all)| all.iter().map(|v| full_name(group, &v.name)))
            .collect()
    }

    fn time_among(&self, group: &str, names: &[String]) -> Option<usize> {
        match &self.options.time {
            Some(time) => names
                .iter()
                .position(|n| n == time || full_name(group, n) == *time),
            None => time_column::called(names),
        }
    }
}
