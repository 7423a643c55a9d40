//! Columns of one table of a log as they stand in it, in SI units.

use super::{LogTable, ReadOptions, full_name, scan};
use crate::notation::UnitName;
use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use std::path::Path;
use std::sync::Arc;

/// A column that is wanted.
#[derive(Clone, Debug)]
pub struct WantedColumn {
    name: String,
    unit: Option<UnitName>,
}

impl WantedColumn {
    /// Reads `NAME` or `NAME=UNIT`; an unknown unit is an error that lists the known ones.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, unit) = match text.split_once('=') {
            Some((name, unit)) => (name, Some(UnitName::try_from(unit.to_owned())?)),
            None => (text, None),
        };
        let name = name.to_owned();
        Ok(Self { name, unit })
    }
}

/// A row of a table: its piece of the log, its time, s, and the value of each column.
pub type ColumnsRow = (u32, f64, Vec<f64>);

/// Name and SI unit of each column, and the rows.
pub type NamedColumns = (Vec<(String, String)>, Vec<ColumnsRow>);

/// Reads these columns of one table, or of a log with one table all that hold numbers. Returns name and SI unit of each
/// (empty where neither `wanted` nor the log has one), and the rows in which all have a value.
pub fn columns(
    path: &Path,
    options: &ReadOptions,
    wanted: &[WantedColumn],
) -> Result<NamedColumns, Error> {
    let (mut tables, mut all) = (Arc::default(), Vec::new());
    scan(path, options, &mut |chunk| {
        tables = Arc::clone(&chunk.tables);
        let rows = chunk.rows.iter();
        all.extend(rows.map(|row| (*row, chunk.values_of(row).to_vec())));
        true
    })?;
    let place = |table: &LogTable, name: &str| {
        let is = |c: &str| c == name || full_name(&table.name, c) == name;
        table.columns.iter().position(|c| is(&c.name))
    };
    let has_all = |t: &&LogTable| wanted.iter().all(|w| place(t, &w.name).is_some());
    let mut fitting = tables.iter().enumerate().filter(|(_, t)| has_all(t));
    let (Some((number, table)), None) = (fitting.next(), fitting.next()) else {
        let names = |t: &LogTable| -> Vec<String> {
            let names = t.columns.iter().map(|c| full_name(&t.name, &c.name));
            names.collect()
        };
        let here: Vec<String> = tables.iter().flat_map(names).collect();
        let names: Vec<&str> = wanted.iter().map(|w| w.name.as_str()).collect();
        let message = match names.is_empty() {
            true => "this log has several tables, or none".to_owned(),
            false => format!("no single table has the columns {}", names.join(", ")),
        };
        let help = format!("columns here: {}", here.join(", "));
        return Err(input_error(path, "", message, help));
    };
    all.retain(|(row, _)| row.table as usize == number);
    let chosen: Vec<(usize, Option<UnitName>)> = match wanted {
        [] => {
            let holds = |i: &usize| {
                all.iter()
                    .any(|(_, values)| values.get(*i).is_some_and(|x| x.is_finite()))
            };
            (0..table.columns.len())
                .filter(holds)
                .map(|i| (i, None))
                .collect()
        }
        wanted => {
            let found = wanted
                .iter()
                .map(|w| place(table, &w.name).map(|i| (i, w.unit.clone())));
            found.flatten().collect()
        }
    };
    let of_log = |i: usize| UnitName::try_from(table.columns.get(i)?.unit.clone()).ok();
    let chosen: Vec<_> = chosen
        .into_iter()
        .map(|(i, unit)| (i, unit.or_else(|| of_log(i))))
        .collect();
    let rows = all.iter().filter_map(|(row, values)| {
        let value = |(i, unit): &(usize, Option<UnitName>)| {
            let x = *values.get(*i)?;
            let x = unit.as_ref().map_or(x, |u| u.unit().to_si(x));
            x.is_finite().then_some(x)
        };
        let values = chosen.iter().map(value).collect::<Option<Vec<f64>>>()?;
        Some((row.piece, 1e-9 * row.stamp_ns as f64, values))
    });
    let rows = rows.collect();
    let heads = chosen.iter().filter_map(|(i, unit)| {
        let si = unit.as_ref().map_or("", |u| u.unit().quantity.si_name());
        Some((table.columns.get(*i)?.name.clone(), si.to_owned()))
    });
    Ok((heads.collect(), rows))
}
