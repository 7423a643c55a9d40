//! A recorded drive in the loop: the estimators of a run, fed by what plays a recording back instead of plant, sensors
//! and controller.

use super::end::EndCondition;
use super::events::EventSchedule;
use super::moving::Moving;
use super::parts;
use super::registry::{BoxedController, BoxedEstimator, Registry};
use super::simulation::Simulation;
use crate::config::file::Document;
use crate::config::input_files::InputFiles;
use crate::config::scenario::{LogScenario, NominalVehicle, Scenario, ToldValue};
use crate::control::PerceptionModel;
use crate::error::Error;
use crate::plant::Plant;
use crate::rail::alignment::Angle;
use crate::rail::{Rail, Section};
use crate::sensors::spec::InstrumentSpecs;
use crate::sensors::{Fitting, Instrument, Suite};
use crate::train::Train;
use monorig_estimators::api::signals::{Vehicle, VehicleData};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A recording to play back, with its estimators and bounds.
pub struct RecordedDrive {
    /// Estimators, bounds and recording by the map file.
    pub scenario: LogScenario,
    /// The map file: errors are reported in it.
    pub document: Document,
    /// The files that were read so far.
    pub inputs: InputFiles,
    /// Nominal vehicle for the estimators.
    pub vehicle: Vehicle,
    /// Plant that gives the time and the references, and reports the end of the recording.
    pub plant: Box<dyn Plant>,
    /// Delivers the samples.
    pub instrument: Box<dyn Instrument>,
    /// Gives the recorded commands.
    pub controller: BoxedController,
    /// Put around every estimator: what resets it where a new segment begins.
    pub around: Box<dyn Fn(BoxedEstimator) -> BoxedEstimator>,
    /// Step, s.
    pub dt_s: f64,
}

impl Simulation {
    /// A recorded drive, ready to run in the same loop as a simulation. It has no rail, no bodies and no instruments of
    /// its own; its seed is 1.
    pub fn recorded(drive: RecordedDrive, registry: &Registry) -> Result<Self, Error> {
        let RecordedDrive {
            scenario,
            document,
            inputs,
            vehicle,
            plant,
            instrument,
            controller,
            around,
            dt_s,
        } = drive;
        let reading = inputs.clone();
        let scenario = reading.during(|| Scenario::of_log(scenario, document, inputs))?;
        let train = Train {
            name: "recorded".into(),
            ..Train::default()
        };
        let on = Fitting::new(&train, scenario.file.physics.gravity_mps2.get(), 1);
        let fitted = Suite::new(&InstrumentSpecs::default(), &on).and_then(|mut sensors| {
            sensors.fit(instrument)?;
            Ok(sensors)
        });
        let sensors = fitted.map_err(|e| e.in_file(scenario.path()))?;
        let estimators = parts::estimators(&scenario, registry, &vehicle, &mut BTreeMap::new())?;
        let estimators = estimators.into_iter().map(|e| e.within(&around)).collect();
        let drive = &scenario.file.drive;
        let mass_kg = vehicle.tare_kg;
        Ok(Self {
            seed: 1,
            instruments: InstrumentSpecs::default(),
            rail: Arc::new(no_rail()),
            plant,
            plant_is_ours: false,
            sensors,
            estimators,
            in_loop: None,
            cycle: drive.cycle(0.0),
            perception: PerceptionModel::new(drive.controller.feedforward, mass_kg, &vehicle),
            controller,
            events: EventSchedule::new(&[], 0.0),
            end: EndCondition {
                after_s: f64::INFINITY,
                at_m: f64::INFINITY,
                start_m: 0.0,
                train_length_m: 0.0,
                track_length_m: f64::INFINITY,
            },
            dt_s,
            imu_offset_m: 0.0,
            obstacles: Vec::new(),
            train,
            vehicle,
            scenario,
        })
    }
}

/// Rail of zero length, on which nothing runs.
fn no_rail() -> Rail {
    let level = Angle {
        start: 0.0,
        end: 0.0,
        pieces: Vec::new(),
    };
    Rail::new(
        "unknown",
        Vector3::zeros(),
        level.clone(),
        level,
        None,
        Section::road(1.0),
    )
}

/// Nominal vehicle of a train or a car in a file, with changes as in a scenario.
pub fn nominal_vehicle(file: &Path, changes: NominalVehicle) -> Result<VehicleData, Error> {
    let mut scenario = Scenario::in_code("", None, None);
    scenario.file.vehicle = changes;
    let exact = &mut scenario.file.vehicle.exact;
    exact.insert(ToldValue::All, "the drive is real".into());
    let moving = Moving::of_file(file)?;
    let train = moving.consist();
    let imu = train.mount("imu_link").unwrap_or(0);
    Ok(moving.nominal_vehicle(&scenario, &train, imu, 0))
}
