//! A step of a run as rows of tables.

use super::{Instants, KeptStep};
use monorig_estimators::api::signals::{MAX_AUXILIARY, Sample};
use monorig_sim::error::Error;

/// A table of the export.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// Its name, that of the map file's channel.
    pub name: &'static str,
    /// Columns.
    pub columns: Vec<String>,
    /// Unit of each.
    pub units: Vec<&'static str>,
    /// Step of each in CAN signals, in its unit.
    pub steps: Vec<f64>,
    /// True if all columns are of one sample; else each column is a channel of its own, and a row has those that were
    /// taken at its time.
    #[cfg_attr(not(feature = "can"), allow(dead_code))]
    pub is_vector: bool,
    /// True if the run has a row of it.
    pub is_used: bool,
}

/// All tables, by their index.
pub(super) struct Tables {
    all: Vec<Table>,
    drives: usize,
}

pub(super) const FORCE: usize = 0;
pub(super) const RATE: usize = 1;
pub(super) const TORQUE: usize = 2;
pub(super) const WHEEL: usize = 3;
pub(super) const CLAMP: usize = 4;
pub(super) const STEERING: usize = 5;
pub(super) const INCLINATION: usize = 6;
pub(super) const AUXILIARY: usize = 7;
pub(super) const COMMAND: usize = 8;
pub(super) const TRUTH: usize = 9;

/// Takes rows.
type Sink<'a> = dyn FnMut(usize, Instants, &[f64]) -> Result<(), Error> + 'a;

impl Tables {
    /// Those of a vehicle with so many drive units.
    pub fn new(drives: usize) -> Self {
        let axes = || ["x", "y", "z"].map(str::to_owned).to_vec();
        let of_drives = || -> Vec<String> { (1..=drives).map(|i| format!("drive_{i}")).collect() };
        let table = |name, columns: Vec<String>, unit, step: f64| Table {
            name,
            units: vec![unit; columns.len()],
            steps: vec![step; columns.len()],
            columns,
            is_vector: false,
            is_used: false,
        };
        let vector = |name, unit, step| Table {
            is_vector: true,
            ..table(name, axes(), unit, step)
        };
        let value = || vec!["value".to_owned()];
        let mut command = table("command", of_drives(), "Nm", 1e-3);
        for (column, unit, step) in [("clamp_pressure", "MPa", 1e-5), ("brake", "1", 1e-6)] {
            command.columns.push(column.into());
            command.units.push(unit);
            command.steps.push(step);
        }
        let auxiliary = (1..=MAX_AUXILIARY)
            .map(|i| format!("reading_{i}"))
            .collect();
        let truth = ["slope", "effective_slope"].map(str::to_owned).to_vec();
        Self {
            all: vec![
                vector("specific_force", "m/s2", 1e-5),
                vector("angular_rate", "rad/s", 1e-6),
                table("motor_torque", of_drives(), "Nm", 1e-3),
                table("wheel_speed", of_drives(), "m/s", 1e-5),
                table("clamp_pressure", of_drives(), "MPa", 1e-5),
                table("steering_angle", value(), "rad", 1e-6),
                table("inclination", value(), "rad", 1e-6),
                table("auxiliary", auxiliary, "1", 1e-3),
                command,
                table("truth", truth, "rad", 1e-6),
            ],
            drives,
        }
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
        for (table, sample) in [(FORCE, z.specific_force_mps2), (RATE, z.angular_rate_radps)] {
            if let Some(sample) = sample {
                let at = Instants {
                    stamp_ns: sample.t.ns(),
                    arrival_ns,
                };
                sink(table, at, &sample.value)?;
            }
        }
        let of_drives = |slots: &[Option<Sample<f64>>]| {
            slots.iter().take(self.drives).copied().collect::<Vec<_>>()
        };
        for (table, slots) in [
            (TORQUE, of_drives(&z.motor_torque_nm)),
            (WHEEL, of_drives(&z.wheel_speed_mps)),
            (CLAMP, of_drives(&z.clamp_pressure_mpa)),
            (STEERING, vec![z.steering_angle_rad]),
            (INCLINATION, vec![z.inclination_rad]),
            (AUXILIARY, z.auxiliary.to_vec()),
        ] {
            by_stamp(&slots, &mut |stamp_ns, values| {
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
fn by_stamp(slots: &[Option<Sample<f64>>], sink: &mut Rows<'_>) -> Result<(), Error> {
    let mut stamps: Vec<i64> = slots.iter().flatten().map(|s| s.t.ns()).collect();
    stamps.sort_unstable();
    stamps.dedup();
    for stamp in stamps {
        let value = |slot: &Option<Sample<f64>>| {
            slot.filter(|s| s.t.ns() == stamp)
                .map_or(f64::NAN, |s| s.value)
        };
        let values: Vec<f64> = slots.iter().map(value).collect();
        sink(stamp, &values)?;
    }
    Ok(())
}
