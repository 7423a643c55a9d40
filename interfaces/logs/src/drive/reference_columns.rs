//! Columns of a reference, read as a whole.

use crate::map::{Condition, Formula, Map};
use crate::notation::Unit;
use crate::read::full_name;
use crate::read::merge::{By, Merged, MergedRow};
use crate::wrong;
use monorig_sim::error::Error;
use std::collections::BTreeSet;

/// Most samples of a reference.
const MAX_SAMPLES: usize = 8_000_000;

/// One to three formulas of the columns of a file.
pub(super) struct Columns<'a> {
    /// Its place in the map file, for errors.
    pub key: &'a str,
    /// The file, by its name in the map.
    pub file: Option<&'a str>,
    /// The formulas, each with its unit.
    pub formulas: Vec<(&'a Formula, Option<&'a Unit>)>,
    /// Rows count only where this is true.
    pub valid_if: Option<&'a Condition>,
}

impl Columns<'_> {
    /// The rows with a new value: time (ns of the replay) and the values of the formulas, SI; 0 in place of those that
    /// there are not.
    pub fn read(&self, map: &Map, origin_ns: i64) -> Result<Vec<(i64, [f64; 3])>, Error> {
        let expressions = self.formulas.iter().map(|(f, _)| &f.expression);
        let expressions = expressions.chain(self.valid_if.iter().map(|c| &c.0));
        let names: Vec<String> = expressions.flat_map(|e| e.columns.clone()).collect();
        let file = map.file_of(self.key, self.file)?;
        let mut wanted = vec![BTreeSet::new(); map.files.len()];
        if let Some(wanted) = wanted.get_mut(file) {
            wanted.extend(names.iter().cloned());
        }
        let sources = map.sources(&wanted);
        let Some(source) = sources.get(file) else {
            return Ok(Vec::new());
        };
        let mut merged = Merged::open(std::slice::from_ref(source), By::Stamp)?;
        let (mut row, mut all) = (MergedRow::default(), Vec::new());
        let (mut values, mut seen) = (vec![f64::NAN; names.len()], vec![false; names.len()]);
        while merged.next(&mut row)? {
            let Some(table) = row.table() else { continue };
            let mut new = false;
            for ((value, name), seen) in values.iter_mut().zip(&names).zip(&mut seen) {
                let called = |c: &str| c == name || full_name(&table.name, c) == *name;
                if let Some(column) = table.columns.iter().position(|c| called(&c.name)) {
                    *seen = true;
                    *value = row.values.get(column).copied().unwrap_or(f64::NAN);
                    new |= !value.is_nan();
                }
            }
            let of = |columns: &[String]| -> Vec<f64> {
                let place = |c: &String| names.iter().position(|n| n == c);
                let value = |c: &String| place(c).and_then(|i| values.get(i)).copied();
                columns
                    .iter()
                    .map(|c| value(c).unwrap_or(f64::NAN))
                    .collect()
            };
            if !new || self.valid_if.is_some_and(|c| !c.0.holds(&of(&c.0.columns))) {
                continue;
            }
            let mut sample = [0.0; 3];
            for (x, (formula, unit)) in sample.iter_mut().zip(&self.formulas) {
                let expression = &formula.expression;
                let value = expression.value(&of(&expression.columns));
                *x = unit.map_or(f64::NAN, |u| u.to_si(value));
            }
            if sample.iter().all(|x| x.is_finite()) {
                all.push((row.row.stamp_ns.saturating_sub(origin_ns), sample));
            }
            if all.len() > MAX_SAMPLES {
                return Err(wrong(
                    &source.path,
                    None,
                    format!("`{}` has more than {MAX_SAMPLES} samples", self.key),
                    "a reference at 100 Hz or less",
                ));
            }
        }
        if let Some(missing) = seen.iter().position(|s| !s).and_then(|i| names.get(i)) {
            return Err(map.error(
                self.key,
                format!(
                    "there is no column `{missing}` in {}",
                    source.path.display()
                ),
                "`monorig log info` shows the columns",
            ));
        }
        Ok(all)
    }
}
