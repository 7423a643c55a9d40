//! `samples.parquet` of a run: the samples that the estimators were given and the truth beside them, for each step in
//! which a sample arrived or the command changed. Written while the run goes on, read step by step.

use super::failed::failed;
use crate::drive::VehicleFile;
use crate::notation::NS;
use crate::{io, wrong};
use ::parquet::arrow::ArrowWriter;
use ::parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use ::parquet::basic::{Compression, ZstdLevel};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use arrow_array::builder::{Float64Builder, Int64Builder};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurements, Sample, Shape, Slot, Vehicle};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::closed_loop::run::{Observer, StepFrame};
use monorig_sim::error::Error;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name of the file in the folder of a run.
pub const NAME: &str = "samples.parquet";
/// Key of the description of the file, in its metadata.
const ABOUT: &str = "samples";
/// Rows of a batch.
const ROWS: usize = 8192;

/// The description of the file.
#[derive(Serialize, Deserialize)]
struct About {
    /// Length of a step, ns.
    step_ns: i64,
    /// Nominal vehicle of the estimators.
    vehicle: VehicleFile,
}

/// A step of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KeptStep {
    /// Its end, when its samples arrived, ns since the start.
    pub arrival_ns: i64,
    /// The samples.
    pub z: Measurements,
    /// The command of the step, if it is another than that of the step before.
    pub command: Option<Command>,
    /// True total mass, kg.
    pub total_mass_kg: f64,
    /// True slope at the IMU, rad.
    pub slope_rad: f64,
    /// True effective slope, rad.
    pub effective_slope_rad: f64,
}

/// All columns, in their order: a stamp and the values of every slot that a vehicle with so many drive units has,
/// the command, the truth.
fn columns(drives: usize) -> Vec<Column> {
    let mut all = vec![Column::Arrival];
    let on_vehicle = |s: &Slot| s.measurand.shape() != Shape::PerDrive || s.index < drives;
    for slot in Slot::all().filter(on_vehicle) {
        all.push(Column::Stamp(slot));
        let axes = 0..slot.measurand.shape().values();
        all.extend(axes.map(|axis| Column::Value(slot, axis)));
    }
    all.extend((0..drives).map(Column::CommandTorque));
    all.extend([
        Column::CommandClamp,
        Column::CommandBrake,
        Column::Mass,
        Column::Slope,
        Column::EffectiveSlope,
    ]);
    all
}

/// A column of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    Arrival,
    Stamp(Slot),
    Value(Slot, usize),
    CommandTorque(usize),
    CommandClamp,
    CommandBrake,
    Mass,
    Slope,
    EffectiveSlope,
}

/// A value of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    Whole(Option<i64>),
    Number(Option<f64>),
}

impl Column {
    fn name(self) -> String {
        let of = |slot: Slot| match slot.measurand.shape() {
            Shape::Vector | Shape::Scalar => slot.name().to_owned(),
            Shape::PerDrive | Shape::Auxiliary => format!("{}_{}", slot.name(), slot.index + 1),
        };
        match self {
            Self::Arrival => "arrival_ns".into(),
            Self::Stamp(slot) => format!("{}.stamp_ns", of(slot)),
            Self::Value(slot, axis) if slot.measurand.shape() == Shape::Vector => {
                let axes = ["x", "y", "z"];
                format!("{}.{}", of(slot), axes.get(axis).unwrap_or(&""))
            }
            Self::Value(slot, _) => of(slot),
            Self::CommandTorque(i) => format!("command.torque_{}", i + 1),
            Self::CommandClamp => "command.clamp_pressure".into(),
            Self::CommandBrake => "command.brake".into(),
            Self::Mass => "truth.total_mass".into(),
            Self::Slope => "truth.slope".into(),
            Self::EffectiveSlope => "truth.effective_slope".into(),
        }
    }

    fn is_whole(self) -> bool {
        matches!(self, Self::Arrival | Self::Stamp(_))
    }

    fn get(self, step: &KeptStep) -> Cell {
        let z = &step.z;
        let known = |x: f64| Cell::Number((!x.is_nan()).then_some(x));
        match self {
            Self::Arrival => Cell::Whole(Some(step.arrival_ns)),
            Self::Stamp(slot) => Cell::Whole(slot.get(z).map(|s| s.t.ns())),
            Self::Value(slot, axis) => {
                Cell::Number(slot.get(z).and_then(|s| s.value.get(axis).copied()))
            }
            Self::CommandTorque(i) => {
                Cell::Number(step.command.and_then(|c| c.motor_torque_nm.get(i).copied()))
            }
            Self::CommandClamp => Cell::Number(step.command.map(|c| c.clamp_pressure_mpa)),
            Self::CommandBrake => Cell::Number(step.command.map(|c| c.brake)),
            Self::Mass => known(step.total_mass_kg),
            Self::Slope => known(step.slope_rad),
            Self::EffectiveSlope => known(step.effective_slope_rad),
        }
    }

    /// Puts a value that is there into a step; stamps come before values.
    fn set(self, step: &mut KeptStep, whole: i64, number: f64) {
        let z = &mut step.z;
        let t = Time::from_ns(whole);
        match self {
            Self::Arrival => step.arrival_ns = whole,
            Self::Stamp(slot) => slot.set(z, Some(Sample { t, value: [0.0; 3] })),
            Self::Value(slot, axis) => {
                let mut sample = slot.get(z);
                if let Some(x) = sample.as_mut().and_then(|s| s.value.get_mut(axis)) {
                    *x = number;
                }
                slot.set(z, sample);
            }
            Self::CommandTorque(i) => {
                let command = step.command.get_or_insert_default();
                if let Some(torque) = command.motor_torque_nm.get_mut(i) {
                    *torque = number;
                }
            }
            Self::CommandClamp => {
                step.command.get_or_insert_default().clamp_pressure_mpa = number;
            }
            Self::CommandBrake => step.command.get_or_insert_default().brake = number,
            Self::Mass => step.total_mass_kg = number,
            Self::Slope => step.slope_rad = number,
            Self::EffectiveSlope => step.effective_slope_rad = number,
        }
    }
}

/// Keeps the samples of a run: an observer that writes `samples.parquet`.
pub struct SampleRecorder {
    path: PathBuf,
    open: Option<Open>,
}

/// The file while it is written.
struct Open {
    writer: ArrowWriter<File>,
    schema: SchemaRef,
    columns: Vec<Column>,
    steps: Vec<KeptStep>,
    last: Option<Command>,
}

impl SampleRecorder {
    /// Into this file.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self {
            path: path.into(),
            open: None,
        }
    }
}

impl Observer for SampleRecorder {
    fn begin(&mut self, simulation: &Simulation) -> Result<(), Error> {
        let broken = failed(&self.path);
        let columns = columns(simulation.vehicle.drives);
        let field = |c: &Column| {
            let kind = if c.is_whole() {
                DataType::Int64
            } else {
                DataType::Float64
            };
            Field::new(c.name(), kind, *c != Column::Arrival)
        };
        let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
        let level = ZstdLevel::try_new(1).map_err(|e| broken(&e))?;
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_compression(Compression::ZSTD(level))
            .set_statistics_enabled(EnabledStatistics::None)
            .build();
        let file = File::create(&self.path).map_err(|e| io(&self.path, e))?;
        let mut writer =
            ArrowWriter::try_new(file, schema.clone(), Some(properties)).map_err(|e| broken(&e))?;
        let about = About {
            step_ns: (simulation.dt_s * 1e9).round() as i64,
            vehicle: VehicleFile::of(&simulation.vehicle),
        };
        let about = serde_json::to_string(&about).map_err(|e| broken(&e))?;
        writer.append_key_value_metadata(KeyValue::new(ABOUT.into(), about));
        self.open = Some(Open {
            writer,
            schema,
            columns,
            steps: Vec::with_capacity(ROWS),
            last: None,
        });
        Ok(())
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        let broken = failed(&self.path);
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let change = (open.last.as_ref() != Some(f.command)).then_some(*f.command);
        if !f.sampled && change.is_none() {
            return Ok(());
        }
        open.last = Some(*f.command);
        open.steps.push(KeptStep {
            arrival_ns: f.time_ns,
            z: *f.measurements,
            command: change,
            total_mass_kg: f.truth.total_mass_kg,
            slope_rad: f.truth.grade_at_imu_rad,
            effective_slope_rad: f.truth.grade_effective_rad,
        });
        if open.steps.len() >= ROWS {
            open.flush().map_err(|e| broken(&e))?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        let broken = failed(&self.path);
        let Some(mut open) = self.open.take() else {
            return Ok(());
        };
        open.flush().map_err(|e| broken(&e))?;
        open.writer.close().map_err(|e| broken(&e))?;
        Ok(())
    }
}

impl Open {
    fn flush(&mut self) -> Result<(), String> {
        if self.steps.is_empty() {
            return Ok(());
        }
        let arrays = self.columns.iter().map(|c| self.array(*c)).collect();
        let batch = RecordBatch::try_new(self.schema.clone(), arrays).map_err(|e| e.to_string())?;
        self.steps.clear();
        self.writer.write(&batch).map_err(|e| e.to_string())
    }

    fn array(&self, column: Column) -> ArrayRef {
        let (mut whole, mut numbers) = (Int64Builder::new(), Float64Builder::new());
        for step in &self.steps {
            match column.get(step) {
                Cell::Whole(x) => whole.append_option(x),
                Cell::Number(x) => numbers.append_option(x),
            }
        }
        match column.is_whole() {
            true => Arc::new(whole.finish()),
            false => Arc::new(numbers.finish()),
        }
    }
}

/// Kept samples in memory: the columns of the file.
pub struct SampleColumns<'a>(Vec<(Column, &'a ArrayRef)>);

impl<'a> SampleColumns<'a> {
    /// Those of a vehicle with so many drive units; the error names the column that is not there.
    pub fn new(batch: &'a RecordBatch, drives: usize) -> Result<Self, String> {
        let found = columns(drives).into_iter().map(|column| {
            let kind = match column.is_whole() {
                true => DataType::Int64,
                false => DataType::Float64,
            };
            let name = column.name();
            let array = batch.column_by_name(&name);
            let array = array.filter(|a| *a.data_type() == kind);
            let array =
                array.ok_or_else(|| format!("the samples have no column `{name}` of {kind}"))?;
            Ok((column, array))
        });
        found.collect::<Result<_, String>>().map(Self)
    }

    /// The step in a row; what is not known of the truth is no number.
    pub fn step(&self, row: usize) -> KeptStep {
        let mut step = KeptStep {
            total_mass_kg: f64::NAN,
            slope_rad: f64::NAN,
            effective_slope_rad: f64::NAN,
            ..KeptStep::default()
        };
        for (column, array) in self.0.iter().filter(|(_, array)| array.is_valid(row)) {
            match column.is_whole() {
                true => {
                    let x = array.as_primitive::<Int64Type>().value(row);
                    column.set(&mut step, x, 0.0);
                }
                false => {
                    let x = array.as_primitive::<Float64Type>().value(row);
                    column.set(&mut step, 0, x);
                }
            }
        }
        step.z.t = Time::from_ns(step.arrival_ns);
        step
    }
}

/// The kept samples of a run.
pub struct Samples {
    path: PathBuf,
    /// Length of a step, ns.
    pub step_ns: i64,
    /// Nominal vehicle of the estimators.
    pub(super) vehicle: Vehicle,
    /// The same as a file.
    pub(super) vehicle_file: VehicleFile,
}

impl Samples {
    /// Opens the file of a run.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let builder = builder(path)?;
        let pairs = builder.metadata().file_metadata().key_value_metadata();
        let about = pairs.into_iter().flatten().find(|kv| kv.key == ABOUT);
        let about: About = about
            .and_then(|kv| serde_json::from_str(kv.value.as_deref()?).ok())
            .ok_or_else(|| broken_read(path, &"it has no description"))?;
        if !(1..=NS).contains(&about.step_ns) {
            return Err(broken_read(path, &"its step is not valid for a run"));
        }
        let vehicle = about
            .vehicle
            .data()
            .and_then(|data| Vehicle::new(data).ok());
        Ok(Self {
            path: path.into(),
            step_ns: about.step_ns,
            vehicle: vehicle.ok_or_else(|| broken_read(path, &"its vehicle is not possible"))?,
            vehicle_file: about.vehicle,
        })
    }

    /// Reads all steps; how many there are.
    pub fn count(&self) -> Result<u64, Error> {
        let mut steps = 0;
        self.each(&mut |_| {
            steps += 1;
            Ok(())
        })?;
        Ok(steps)
    }

    /// All steps, one after the other.
    pub(super) fn each(
        &self,
        sink: &mut dyn FnMut(&KeptStep) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let batches = builder(&self.path)?.with_batch_size(ROWS).build();
        for batch in batches.map_err(|e| broken_read(&self.path, &e))? {
            let batch = batch.map_err(|e| broken_read(&self.path, &e))?;
            let columns = SampleColumns::new(&batch, self.vehicle.drives);
            let columns = columns.map_err(|e| broken_read(&self.path, &e))?;
            for row in 0..batch.num_rows() {
                sink(&columns.step(row))?;
            }
        }
        Ok(())
    }
}

fn builder(path: &Path) -> Result<ParquetRecordBatchReaderBuilder<File>, Error> {
    let file = File::open(path).map_err(|e| io(path, e))?;
    ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| broken_read(path, &e))
}

fn broken_read(path: &Path, what: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("these kept samples cannot be read: {what}"),
        "make the samples again with `monorig run --keep-samples`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number of a step is in one column: what is got is set again.
    #[test]
    fn a_step_survives_its_columns() {
        let drives = 3;
        let mut step = KeptStep {
            arrival_ns: 42,
            command: Some(Command::default()),
            total_mass_kg: 1.5,
            slope_rad: -0.0,
            effective_slope_rad: 0.3,
            ..KeptStep::default()
        };
        for (k, slot) in Slot::all().enumerate() {
            if slot.measurand.shape() == Shape::PerDrive && slot.index >= drives {
                continue;
            }
            let (x, is_vector) = (0.1 * k as f64, slot.measurand.shape().values() == 3);
            let rest = if is_vector { [2.0, 3.0] } else { [0.0; 2] };
            let sample = Sample {
                t: Time::from_ns(-7 * k as i64),
                value: [x, rest[0], rest[1]],
            };
            slot.set(&mut step.z, Some(sample));
        }
        if let Some(command) = &mut step.command {
            command.motor_torque_nm[2] = 4.0;
            command.brake = 0.5;
        }
        let mut again = KeptStep::default();
        let mut names = Vec::new();
        for column in columns(drives) {
            match column.get(&step) {
                Cell::Whole(Some(x)) => column.set(&mut again, x, 0.0),
                Cell::Number(Some(x)) => column.set(&mut again, 0, x),
                _ => {}
            }
            names.push(column.name());
        }
        assert_eq!(again, step);
        names.sort();
        names.dedup();
        assert_eq!(names.len(), columns(drives).len(), "a name is there twice");
    }
}
