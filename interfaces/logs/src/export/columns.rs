//! The values of a table, kept until the end for formats that are written as a whole.

use super::tables::{Instants, Table};

/// A table of a run, column by column.
pub(super) struct TableColumns {
    pub table: Table,
    pub arrivals_ns: Vec<i64>,
    pub stamps_ns: Vec<i64>,
    pub columns: Vec<Vec<f64>>,
}

impl TableColumns {
    /// Those of all tables, without a row.
    pub fn of(tables: &[Table]) -> Vec<Self> {
        let columns = |table: &Table| Self {
            table: table.clone(),
            arrivals_ns: Vec::new(),
            stamps_ns: Vec::new(),
            columns: vec![Vec::new(); table.columns.len()],
        };
        tables.iter().map(columns).collect()
    }

    /// A row of the table with this index, if it has columns.
    pub fn row(all: &mut [Self], table: usize, at: Instants, values: &[f64]) {
        if let Some(table) = all.get_mut(table).filter(|t| !t.columns.is_empty()) {
            table.arrivals_ns.push(at.arrival_ns);
            table.stamps_ns.push(at.stamp_ns);
            for (column, x) in table.columns.iter_mut().zip(values) {
                column.push(*x);
            }
        }
    }
}
