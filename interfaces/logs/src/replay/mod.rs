//! A log and its map as a simulation: the loop of every run, with a plant, an instrument and a controller that play
//! back.
//!
//! | file | what it holds |
//! |---|---|
//! | `playback` | the steps that are played; plant and controller |
//! | `instrument` | the samples of a step, and the channels that are recorded of them |
//! | `segmented` | estimators that are reset where a segment begins |
//! | `judge` | estimates made elsewhere, played back beside those in the loop |

mod instrument;
mod judge;
mod playback;
mod segmented;

pub use judge::EstimatesFile;

use crate::drive::{Drive, Found, Plan, Reference, Step, calibrate};
use crate::identify::Noise;
use crate::map::{Map, NoiseSource};
use crate::wrong;
use instrument::RecordedInstrument;
use monorig_estimators::api::signals::Command;
use monorig_sim::Simulation;
use monorig_sim::closed_loop::recorded::RecordedDrive;
use monorig_sim::closed_loop::registry::Registry;
use monorig_sim::config::scenario::{LogScenario, Settings};
use monorig_sim::error::Error;
use monorig_sim::plant::Truth;
use monorig_sim::record::manifest::sum;
use playback::{Playback, RecordedCommand, RecordedPlant, Shared};
use segmented::Segmented;
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicU32;
use std::sync::{Arc, Mutex};

/// Options of a replay, in addition to the map.
#[derive(Clone, Debug, Default)]
pub struct ReplayOptions {
    /// Estimators by their names in the registry, instead of those of the map.
    pub estimators: Vec<String>,
    /// Estimates of another program, with the name for the results.
    pub judged: Vec<(String, EstimatesFile)>,
    /// Source of the noise for estimators, instead of the map's source. From the log, a parameter so given is among the
    /// values found.
    pub noise: Option<NoiseSource>,
    /// Values that were found of the log beforehand; they are kept in the results with those found now.
    pub found: Vec<Found>,
}

/// A simulation that plays the log of a map.
pub fn simulation(
    map: &Map,
    options: &ReplayOptions,
    registry: &Registry,
) -> Result<Simulation, Error> {
    build(map, options, registry).map(|built| built.simulation)
}

/// A simulation that plays a log, and notes about it.
pub struct Built {
    /// The simulation.
    pub simulation: Simulation,
    /// Values found by calibration and, where it was asked for, of noise.
    pub found: Vec<Found>,
    /// Default values for missing values of the map, with advice; `None` if the map is complete.
    pub taken: Option<String>,
}

/// A log shorter than this is read as a whole for the noise that a silent map does not tell, ns.
const NOISE_NS: i64 = 600_000_000_000;

/// A simulation that plays the log of a map, with the values found by calibration and of noise.
pub fn build(map: &Map, options: &ReplayOptions, registry: &Registry) -> Result<Built, Error> {
    let mut plan = Plan::new(map)?;
    let mut found = calibrate(map, &mut plan)?;
    found.extend(options.found.iter().cloned());
    let mut drive = Drive::open(map, &plan)?;
    let reference = Reference::load(map, drive.origin_ns())?;
    let Some(first) = drive.next(map)? else {
        let path = map.files.values().next().cloned().unwrap_or_default();
        return Err(wrong(
            &path,
            None,
            "this log has no row",
            "use a log with rows, and with the columns that the map file names",
        ));
    };
    let mut registry = registry.clone();
    let mut estimators = estimators(map, options, &mut registry, drive.origin_ns())?;
    let noise = options.noise.or(map.file.noise);
    let mut taken = plan.taken.clone();
    let mut silent = Vec::new();
    match noise {
        Some(NoiseSource::FromLog) => {
            let noise = Noise::of_log(map, &plan, i64::MAX)?;
            found.extend(noise.give(&mut estimators, &registry, true));
        }
        Some(NoiseSource::Defaults) => {}
        None => {
            let noise = Noise::of_log(map, &plan, NOISE_NS)?;
            silent = noise.give(&mut estimators, &registry, false);
            taken.extend(noise.taken(&silent));
        }
    }
    if estimators.is_empty() {
        return Err(map.error(
            "estimators",
            "the map has no estimator to run",
            "give `estimators: {NAME: {}}` in the map file, or --estimators NAME,…",
        ));
    }
    let all: Vec<Found> = found.iter().chain(&silent).cloned().collect();
    let scenario = scenario(map, options, estimators, &all)?;
    let recorded = recorded(map, &plan, drive, reference, first, scenario);
    let how = "set `bias_sd` of the channels and `noise: from-log` or `noise: defaults` in the map";
    Ok(Built {
        simulation: Simulation::recorded(recorded, &registry)?,
        found,
        taken: (!taken.is_empty())
            .then(|| format!("the map does not give {}; {how}", taken.join(", "))),
    })
}

/// The estimators to be run, with their settings; those of files are added to the registry.
fn estimators(
    map: &Map,
    options: &ReplayOptions,
    registry: &mut Registry,
    origin_ns: i64,
) -> Result<BTreeMap<String, Settings>, Error> {
    let named = options.estimators.iter();
    let mut estimators = match options.estimators.is_empty() {
        true => map.file.estimators.clone(),
        false => named.map(|n| (n.clone(), Settings::default())).collect(),
    };
    for (name, file) in &options.judged {
        let added = file.add(registry, name, origin_ns);
        added.map_err(|e| {
            wrong(
                &file.path,
                None,
                e.to_string(),
                "use --name with another name",
            )
        })?;
        estimators.insert(name.clone(), Settings::default());
    }
    Ok(estimators)
}

/// The scenario of a log, with the check sum of each of its files.
fn scenario(
    map: &Map,
    options: &ReplayOptions,
    estimators: BTreeMap<String, Settings>,
    found: &[Found],
) -> Result<LogScenario, Error> {
    let mut digests = BTreeMap::new();
    let judged = options.judged.iter().map(|(_, file)| &file.path);
    for path in map.files.values().chain(&map.dbc).chain(judged) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        digests.insert(name.into_owned(), sum(path)?);
    }
    Ok(LogScenario {
        name: map.name.clone(),
        why: map.file.why.clone(),
        estimators,
        expect: map.file.expect.clone(),
        availability: map.file.availability,
        integrity: map.file.integrity.clone(),
        known_failures: map.file.known_failures.clone(),
        record: map.file.record,
        log: json!({ "map": map.file, "calibrated": found }),
        digests,
    })
}

/// The parts of the loop that play the log back; `first` is its first step.
fn recorded(
    map: &Map,
    plan: &Plan,
    drive: Drive,
    reference: Reference,
    first: Step,
    scenario: LogScenario,
) -> RecordedDrive {
    let vehicle = plan.vehicle;
    let point = vehicle.tare_span_m == [0.0; 2]
        && vehicle.load_span_m == [0.0; 2]
        && vehicle.imu_arm_m == 0.0;
    let step_s = map.step_ns() as f64 * 1e-9;
    // the loop begins a step before the first one
    let mut truth = Truth::unknown((first.t_ns - map.step_ns()) as f64 * 1e-9);
    truth.sd.total_mass_kg = reference.mass_sd_kg;
    truth.sd.grade_rad = reference.slope_sd_rad;
    let shared: Shared = Arc::new(Mutex::new(Playback {
        drive,
        map: map.clone(),
        reference,
        steps: [first, Step::default()],
        now: 1,
        more: true,
        command: Command::default(),
    }));
    let segment = Arc::new(AtomicU32::new(0));
    let of_segment = segment.clone();
    RecordedDrive {
        scenario,
        document: map.document.clone(),
        inputs: map.inputs.clone(),
        vehicle,
        plant: Box::new(RecordedPlant {
            shared: shared.clone(),
            segment,
            truth,
            over: false,
            point,
        }),
        instrument: Box::new(RecordedInstrument {
            shared: shared.clone(),
            targets: plan.targets().collect(),
            drives: vehicle.drives,
        }),
        controller: Box::new(RecordedCommand(shared)),
        around: Box::new(move |inner| {
            Box::new(Segmented {
                inner,
                segment: of_segment.clone(),
                known: None,
                step_s,
            })
        }),
        dt_s: step_s,
    }
}
