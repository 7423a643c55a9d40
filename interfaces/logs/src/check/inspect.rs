//! The contents of a log: tables, columns, units, rates, jitter, gaps, ranges.

use crate::notation::NS;
use crate::read::{Part, ReadOptions};
use monorig_sim::error::Error;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Steps of time that are kept of a table, to find their median.
const KEPT_STEPS: usize = 100_000;
/// A step this many times the median is a gap.
const GAP: i64 = 5;

/// The contents of a file.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The name of its format.
    pub format: &'static str,
    /// Database of its messages, of a CAN log.
    #[serde(skip)]
    pub(super) dbc: Option<PathBuf>,
    /// Its tables with a row.
    pub tables: Vec<TableReport>,
    /// Its topics and columns that are not read, and how often they came.
    pub unread: BTreeMap<String, u64>,
}

/// The contents of a table.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TableReport {
    /// Name; empty in a file of one table.
    pub name: String,
    /// Rows.
    pub rows: u64,
    /// First stamp, ns.
    pub from_ns: i64,
    /// Last stamp, ns.
    pub to_ns: i64,
    /// Median step of time, ns.
    pub step_ns: i64,
    /// Standard deviation of the steps that are neither gaps nor backwards, ns.
    pub jitter_ns: f64,
    /// Steps of more than five times the median.
    pub gaps: u64,
    /// Rows whose time is before that of the row before.
    pub backwards: u64,
    /// Its columns.
    pub columns: Vec<ColumnReport>,
    #[serde(skip)]
    steps: Vec<i64>,
    #[serde(skip)]
    last_ns: Option<i64>,
}

/// The contents of a column.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ColumnReport {
    /// Name.
    pub name: String,
    /// Unit in the file; empty if there is none.
    pub unit: String,
    /// Values that are numbers.
    pub values: u64,
    /// Least value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean value.
    pub mean: f64,
}

impl TableReport {
    /// Rows per second, Hz, by the median step.
    pub fn rate_hz(&self) -> f64 {
        NS as f64 / self.step_ns as f64
    }

    fn push(&mut self, stamp_ns: i64, values: &[f64]) {
        if self.rows == 0 {
            self.from_ns = stamp_ns;
        }
        if let Some(last) = self.last_ns.replace(stamp_ns) {
            let step = stamp_ns.saturating_sub(last);
            self.backwards += u64::from(step < 0);
            if self.steps.len() < KEPT_STEPS {
                self.steps.push(step);
            } else if self.step_ns == 0 {
                self.settle();
            }
            self.gaps += u64::from(self.step_ns > 0 && step > GAP * self.step_ns);
        }
        self.rows += 1;
        self.to_ns = stamp_ns;
        for (column, &x) in self
            .columns
            .iter_mut()
            .zip(values)
            .filter(|(_, x)| !x.is_nan())
        {
            if column.values == 0 {
                (column.min, column.max) = (x, x);
            }
            column.values += 1;
            column.min = column.min.min(x);
            column.max = column.max.max(x);
            column.mean += (x - column.mean) / column.values as f64;
        }
    }

    /// The figures of the steps kept so far.
    fn settle(&mut self) {
        let mut sorted = self.steps.clone();
        sorted.sort_unstable();
        self.step_ns = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let (step_ns, steps) = (self.step_ns, &self.steps);
        self.gaps += steps.iter().filter(|s| **s > GAP * step_ns).count() as u64;
        let regular = |s: &&i64| (0..=GAP * step_ns).contains(*s);
        let kept = steps.iter().filter(regular).map(|s| *s as f64);
        let kept: Vec<f64> = kept.collect();
        let n = kept.len().max(1) as f64;
        let mean = kept.iter().sum::<f64>() / n;
        self.jitter_ns = (kept.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / n).sqrt();
    }
}

/// Reads a whole file, and reports its contents.
pub fn inspect(path: &Path, options: &ReadOptions) -> Result<Inspection, Error> {
    let file = Part::whole(path, options)?;
    let (mut tables, mut unread) = (Vec::<TableReport>::new(), BTreeMap::new());
    file.scan(&mut |chunk| {
        for (i, table) in chunk.tables.iter().enumerate() {
            if i >= tables.len() {
                tables.push(TableReport {
                    name: table.name.clone(),
                    ..TableReport::default()
                });
            }
            let known = tables.get_mut(i).map(|t| &mut t.columns);
            if let Some(known) = known.filter(|k| k.len() < table.columns.len()) {
                let more = table.columns.iter().skip(known.len());
                known.extend(more.map(|c| ColumnReport {
                    name: c.name.clone(),
                    unit: c.unit.clone(),
                    ..ColumnReport::default()
                }));
            }
        }
        for row in &chunk.rows {
            if let Some(table) = tables.get_mut(row.table as usize) {
                table.push(row.stamp_ns, chunk.values_of(row));
            }
        }
        unread.clone_from(&chunk.unread);
        true
    })?;
    for table in &mut tables {
        if table.step_ns == 0 {
            table.settle();
        }
    }
    tables.retain(|t| t.rows > 0);
    Ok(Inspection {
        format: file.format.name(),
        dbc: options.dbc.clone().filter(|_| file.format.is_can()),
        tables,
        unread,
    })
}
