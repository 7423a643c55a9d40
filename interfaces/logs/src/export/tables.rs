//! A step of a run as rows of tables.

use super::KeptStep;
use crate::map::quantity;
use monorig_estimators::api::signals::{Measurand, Sample, Shape};
use monorig_sim::error::Error;

/// The times at which a row was taken and recorded, ns of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Instants {
    pub(super) stamp_ns: i64,
    pub(super) arrival_ns: i64,
}

/// A table of the export.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// Its name, that of the map file's channel.
    pub name: &'static str,
    /// Columns.
    pub columns: Vec<String>,
    /// Unit of each.
    pub units: Vec<&'static str>,
    /// True if the run has a row of it.
    pub is_used: bool,
}

/// All tables, by their index.
pub(super) struct Tables {
    all: Vec<Table>,
    drives: usize,
}

/// Index of the table of commands: behind those of the measured quantities, which stand in the order of their own
/// table.
pub(super) const COMMAND: usize = Measurand::ALL.len();
/// Name of the table of commands.
pub(super) const COMMANDS: &str = "command";
/// Index of the table of the truth.
pub(super) const TRUTH: usize = COMMAND + 1;

/// Takes rows.
type Sink<'a> = dyn FnMut(usize, Instants, &[f64]) -> Result<(), Error> + 'a;

impl Tables {
    /// Those of a vehicle with so many drive units.
    pub fn new(drives: usize) -> Self {
        let of_drives = || -> Vec<String> { (1..=drives).map(|i| format!("drive_{i}")).collect() };
        let table = |name, columns: Vec<String>, unit| Table {
            name,
            units: vec![unit; columns.len()],
            columns,
            is_used: false,
        };
        let measured = |measurand: &Measurand| {
            let shape = measurand.shape();
            let columns = match shape {
                Shape::Vector => ["x", "y", "z"].map(str::to_owned).to_vec(),
                Shape::Scalar => vec!["value".to_owned()],
                Shape::PerDrive => of_drives(),
                Shape::Auxiliary => (1..=shape.slots())
                    .map(|i| format!("reading_{i}"))
                    .collect(),
            };
            let unit = quantity(*measurand).si_name();
            table(measurand.name(), columns, unit)
        };
        let mut command = table(COMMANDS, of_drives(), "Nm");
        for (column, unit) in [("clamp_pressure", "MPa"), ("brake", "1")] {
            command.columns.push(column.into());
            command.units.push(unit);
        }
        let truth = ["slope", "effective_slope"].map(str::to_owned).to_vec();
        let mut all: Vec<Table> = Measurand::ALL.iter().map(measured).collect();
        all.extend([command, table("truth", truth, "rad")]);
        Self { all, drives }
    }

    /// All tables with a row; the others without columns, so that an index means the same everywhere.
    pub fn used(&self) -> Vec<Table> {
        let used = |t: &Table| match t.is_used {
            true => t.clone(),
            false => Table {
                columns: Vec::new(),
                ..t.clone()
            },
        };
        self.all.iter().map(used).collect()
    }

    /// Marks the tables of which a step has a row.
    pub fn find_used(&mut self, step: &KeptStep) {
        let mut seen = [false; TRUTH + 1];
        let _ = self.rows(step, &mut |table, _, values| {
            if let Some(seen) = seen.get_mut(table) {
                *seen |= values.iter().any(|x| !x.is_nan());
            }
            Ok(())
        });
        for (table, seen) in self.all.iter_mut().zip(seen) {
            table.is_used |= seen;
        }
    }

    /// The rows of a step.
    pub fn rows(&self, step: &KeptStep, sink: &mut Sink<'_>) -> Result<(), Error> {
        let arrival_ns = step.arrival_ns;
        let z = &step.z;
        for (table, measurand) in Measurand::ALL.iter().enumerate() {
            if measurand.shape() == Shape::Vector {
                if let Some(sample) = measurand.slot(0).get(z) {
                    let stamp_ns = sample.t.ns();
                    let at = Instants {
                        stamp_ns,
                        arrival_ns,
                    };
                    sink(table, at, &sample.value)?;
                }
                continue;
            }
            let is_per_drive = measurand.shape() == Shape::PerDrive;
            let most = if is_per_drive {
                self.drives
            } else {
                usize::MAX
            };
            let samples: Vec<_> = measurand
                .slots()
                .take(most)
                .map(|slot| slot.get(z))
                .collect();
            by_stamp(&samples, &mut |stamp_ns, values| {
                let at = Instants {
                    stamp_ns,
                    arrival_ns,
                };
                sink(table, at, values)
            })?;
        }
        let now = Instants {
            stamp_ns: arrival_ns,
            arrival_ns,
        };
        if let Some(command) = &step.command {
            let mut values = command.motor_torque_nm[..self.drives].to_vec();
            values.extend([command.clamp_pressure_mpa, command.brake]);
            sink(COMMAND, now, &values)?;
        }
        sink(TRUTH, now, &[step.slope_rad, step.effective_slope_rad])
    }
}

/// Takes the time of a row, ns, and its values.
type Rows<'a> = dyn FnMut(i64, &[f64]) -> Result<(), Error> + 'a;

/// A row for each stamp of these samples, with those that were taken then.
fn by_stamp(slots: &[Option<Sample<[f64; 3]>>], sink: &mut Rows<'_>) -> Result<(), Error> {
    let mut stamps: Vec<i64> = slots.iter().flatten().map(|s| s.t.ns()).collect();
    stamps.sort_unstable();
    stamps.dedup();
    for stamp in stamps {
        let value = |slot: &Option<Sample<[f64; 3]>>| {
            slot.filter(|s| s.t.ns() == stamp)
                .map_or(f64::NAN, |s| s.value[0])
        };
        let values: Vec<f64> = slots.iter().map(value).collect();
        sink(stamp, &values)?;
    }
    Ok(())
}
