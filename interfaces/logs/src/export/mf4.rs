//! MDF 4, by `falcon_mdf`: a channel group a table with arrival as master, `stamp_ns` as whole numbers and channels
//! called `TABLE.COLUMN`. The library writes a file as a whole, so that all values are kept until then.

use super::failed::failed;
use super::tables::{Instants, Table};
use super::writer::{LogWriter, NewLog, RowWriter};
use falcon_mdf::{Mf4Writer, SignalValues};
use monorig_sim::error::Error;
use std::path::PathBuf;

/// The writer of MDF 4.
pub(super) struct MdfWriter;

impl LogWriter for MdfWriter {
    fn name(&self) -> &'static str {
        "mf4"
    }

    fn files(&self) -> &'static str {
        "One MDF 4 file"
    }

    fn create(&self, log: NewLog<'_>) -> Result<Box<dyn RowWriter>, Error> {
        let group = |table: &Table| Group {
            table: table.clone(),
            arrivals_s: Vec::new(),
            stamps_ns: Vec::new(),
            columns: vec![Vec::new(); table.columns.len()],
        };
        Ok(Box::new(MdfFile {
            path: log.folder.join(format!("{}.mf4", log.name)),
            tables: log.tables.iter().map(group).collect(),
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.mf4"))
    }

    fn column(&self, table: &Table, column: usize) -> String {
        let name = table.columns.get(column).map_or("", String::as_str);
        format!("{}.{name}", table.name)
    }
}

/// The values of all tables.
struct MdfFile {
    path: PathBuf,
    tables: Vec<Group>,
}

/// The values of a table.
struct Group {
    table: Table,
    arrivals_s: Vec<f64>,
    stamps_ns: Vec<i64>,
    columns: Vec<Vec<f64>>,
}

impl RowWriter for MdfFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        if let Some(group) = self.tables.get_mut(table).filter(|g| !g.columns.is_empty()) {
            group.arrivals_s.push(at.arrival_ns as f64 / 1e9);
            group.stamps_ns.push(at.stamp_ns);
            for (column, x) in group.columns.iter_mut().zip(values) {
                column.push(*x);
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        let path = self.path;
        let failed = failed(&path);
        // the same run gives the same bytes: its time begins at zero, not now
        let mut file = Mf4Writer::with_start_time_ns(0);
        for group in self.tables.into_iter().filter(|g| !g.columns.is_empty()) {
            let Group {
                table,
                arrivals_s,
                stamps_ns,
                columns,
            } = group;
            let into = file.add_group(&arrivals_s).map_err(|e| failed(&e))?;
            let stamps = SignalValues::I64(stamps_ns);
            into.add_channel_typed("stamp_ns", "ns", stamps)
                .map_err(|e| failed(&e))?;
            let each = table.columns.iter().zip(&table.units).zip(columns);
            for ((name, unit), values) in each {
                let name = format!("{}.{name}", table.name);
                into.add_channel_typed(&name, unit, SignalValues::F64(values))
                    .map_err(|e| failed(&e))?;
            }
        }
        file.write_to_file(&path).map_err(|e| failed(&e))?;
        Ok(0)
    }
}
