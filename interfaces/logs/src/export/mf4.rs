//! MDF 4, by `falcon_mdf`: a channel group a table with arrival as master, `stamp_ns` as whole numbers and channels
//! called `TABLE.COLUMN`. The library writes a file as a whole, so that all values are kept until then.

use super::columns::TableColumns;
use super::failed::failed;
use super::tables::Instants;
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
        Ok(Box::new(MdfFile {
            path: log.folder.join(format!("{}.mf4", log.name)),
            tables: TableColumns::of(log.tables),
        }))
    }

    fn only_file(&self, name: &str) -> Option<String> {
        Some(format!("{name}.mf4"))
    }
}

/// The values of all tables.
struct MdfFile {
    path: PathBuf,
    tables: Vec<TableColumns>,
}

impl RowWriter for MdfFile {
    fn row(&mut self, table: usize, at: Instants, values: &[f64]) -> Result<(), Error> {
        TableColumns::row(&mut self.tables, table, at, values);
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64, Error> {
        let path = self.path;
        let failed = failed(&path);
        // the same run gives the same bytes: its time begins at zero, not now
        let mut file = Mf4Writer::with_start_time_ns(0);
        for group in self.tables.into_iter().filter(|g| !g.columns.is_empty()) {
            let TableColumns {
                table,
                arrivals_ns,
                stamps_ns,
                columns,
            } = group;
            let arrivals_s: Vec<f64> = arrivals_ns.iter().map(|ns| *ns as f64 / 1e9).collect();
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
