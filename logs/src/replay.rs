//! A log and its map as a simulation: the loop of every run, with a plant, an instrument and a controller that play back.

use crate::drive::{Drive, Found, Plan, Reference, Step, Target, calibrate};
use crate::ghost::{self, Ghost};
use crate::judge::EstimatesFile;
use crate::map::Map;
use crate::noise::Noise;
use crate::wrong;
use monorig_estimators::Real;
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::{Estimator, Internal};
use monorig_estimators::api::signals::{Command, Estimate, Measurand, Measurements, Shape, Slot};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_sim::Simulation;
use monorig_sim::closed_loop::recorded::RecordedDrive;
use monorig_sim::closed_loop::registry::{BoxedEstimator, Registry};
use monorig_sim::config::scenario::{LogScenario, Settings};
use monorig_sim::control::{Controller, Perception, Reference as Asked};
use monorig_sim::error::Error;
use monorig_sim::plant::{Plant, Truth};
use monorig_sim::record::manifest::sum;
use monorig_sim::sensors::fault::FaultWindow;
use monorig_sim::sensors::{Instrument, SensorChannel, StepInterval};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What is asked for beside what the map says.
#[derive(Clone, Debug, Default)]
pub struct ReplayOptions {
    /// Estimators by their names in the registry, instead of those of the map.
    pub estimators: Vec<String>,
    /// Estimates made elsewhere, by the name under which they are judged.
    pub judged: Vec<(String, EstimatesFile)>,
    /// Give estimators the noise of the log where the map does not set it: a parameter so given is among what was found.
    pub noise_from_log: bool,
    /// Record the vehicle of the map on the same drive beside the log: what it needs of traction with the speed that was measured on the
    /// reference slope with the reference mass.
    pub ghost: bool,
    /// What was found of the log beforehand, to be kept in the results with what is found now.
    pub found: Vec<Found>,
}

/// A log being played: shared by what says the time and what delivers the samples.
struct Playback {
    drive: Drive,
    map: Map,
    reference: Reference,
    /// The step that is played and the one after it: they are large, and stay where they are.
    steps: [Step; 2],
    /// Which of the two is played; the other one comes next.
    now: usize,
    /// Whether there is a next one.
    more: bool,
    /// The command of the next step; in a log without commands the last measured torques.
    command: Command,
    ghost: Option<Ghost>,
}

impl Playback {
    fn step(&self) -> &Step {
        &self.steps[self.now & 1]
    }

    fn next(&self) -> Option<&Step> {
        self.more.then(|| &self.steps[1 - (self.now & 1)])
    }
}

type Shared = Arc<Mutex<Playback>>;

fn lock(shared: &Shared) -> MutexGuard<'_, Playback> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The plant of a replay: time and references.
struct RecordedPlant {
    shared: Shared,
    segment: Arc<AtomicU32>,
    truth: Truth,
    over: bool,
    /// Whether the vehicle is a point, whose effective slope is that at the IMU.
    point: bool,
}

impl Plant for RecordedPlant {
    fn step(&mut self, _: &Command, _: f64) -> Result<(), Error> {
        let mut play = lock(&self.shared);
        let play = &mut *play;
        if !play.more {
            return Ok(());
        }
        play.now = 1 - play.now;
        let [a, b] = &mut play.steps;
        let (now, next) = if play.now == 0 { (a, b) } else { (b, a) };
        let (drive, map, reference) = (&mut play.drive, &play.map, &mut play.reference);
        play.more = drive.next_into(map, next)?;
        if !play.more
            && let Some((key, column)) = drive.missing().into_iter().next()
        {
            return Err(map.error(
                key,
                format!("there is no column `{column}` in the log"),
                "`monorig inspect` shows the columns",
            ));
        }
        self.over = !play.more;
        self.segment.store(now.segment, Ordering::Relaxed);
        if now.command.is_none() {
            let torques = play.command.motor_torque_nm.iter_mut();
            for (torque, sample) in torques.zip(&now.z.motor_torque_nm) {
                *torque = sample.map_or(*torque, |s| s.value);
            }
        }
        let effective = reference.effective_at(now.t_ns);
        let (slope, mass) = reference.at(now.t_ns);
        if let Some(ghost) = &mut play.ghost {
            let at = (now.t_ns as f64 * 1e-9, now.segment);
            ghost.see(at, &now.z, [slope, effective.unwrap_or(slope)], mass);
        }
        let t = &mut self.truth;
        t.t_s = now.t_ns as f64 * 1e-9;
        t.total_mass_kg = mass;
        t.grade_at_imu_rad = slope;
        match effective {
            Some(effective) => t.grade_effective_rad = effective,
            None if self.point => t.grade_effective_rad = slope,
            None => {}
        }
        Ok(())
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    fn set_load_mass(&mut self, _: f64, _: Option<f64>) {}

    fn set_clamp_limit(&mut self, _: f64) {}

    fn is_over(&self) -> bool {
        self.over
    }
}

/// The instrument of a replay: the samples of the step.
struct RecordedInstrument {
    shared: Shared,
    targets: Vec<Target>,
    drives: usize,
    ghost: bool,
}

impl Instrument for RecordedInstrument {
    fn name(&self) -> &str {
        "log"
    }

    fn rate_hz(&self) -> f64 {
        0.0
    }

    fn mount(&self) -> Option<usize> {
        None
    }

    fn measure(&mut self, _: StepInterval, _: &Truth, z: &mut Measurements) -> Result<(), Error> {
        // of all that there is of a replay nothing else measures
        *z = lock(&self.shared).step().z;
        Ok(())
    }

    fn add_fault(&mut self, _: Option<usize>, _: FaultWindow) {}

    fn channels(&self) -> Vec<SensorChannel> {
        let traction = self.targets.iter().any(|t| t.is_traction());
        let is_there = |slot: &Slot| match slot.measurand {
            Measurand::MotorTorque => traction,
            _ => self.targets.contains(&Target::Measured(*slot)),
        };
        let on_vehicle =
            |slot: &Slot| slot.measurand.shape() != Shape::PerDrive || slot.index < self.drives;
        let slots = Slot::all().filter(is_there).filter(on_vehicle);
        let mut all: Vec<SensorChannel> = slots.flat_map(SensorChannel::of).collect();
        if self.ghost {
            let shared = self.shared.clone();
            all.extend(ghost::channels(move |of| {
                lock(&shared).ghost.as_ref().and_then(of)
            }));
        }
        all
    }
}

/// The controller of a replay: the command that was recorded, else what was measured of the torque.
struct RecordedCommand(Shared);

impl Controller for RecordedCommand {
    fn control(&mut self, _: &Asked, _: &Perception, _: f64) -> Command {
        let mut play = lock(&self.0);
        if let Some(command) = play.next().and_then(|next| next.command) {
            play.command = command;
        }
        play.command
    }
}

/// A first sample later than this after zero of the log's clock is of a clock that has run before, s.
const MAX_FIRST_STEP_S: f64 = 1.0;

/// An estimator that is reset where a new segment of the log begins.
struct Segmented {
    inner: BoxedEstimator,
    segment: Arc<AtomicU32>,
    known: Option<u32>,
    step_s: f64,
}

impl Estimator for Segmented {
    fn step(
        &mut self,
        z: &Measurements,
        u: &Command,
        dt: Real,
    ) -> Result<Estimate, monorig_estimators::Error> {
        let segment = self.segment.load(Ordering::Relaxed);
        match self.known.replace(segment) {
            Some(known) if known == segment => return self.inner.step(z, u, dt),
            Some(_) => self.inner.reset(),
            // a log whose clock began with it
            None if dt > 0.0 && dt <= MAX_FIRST_STEP_S => return self.inner.step(z, u, dt),
            None => {}
        }
        // the first step of a segment: the time before it does not count
        self.inner.step(z, u, self.step_s)
    }
    fn reset(&mut self) {
        self.inner.reset();
    }
    fn internals(&self) -> &[Internal] {
        self.inner.internals()
    }
    fn internal_values(&self, values: &mut [Real]) {
        self.inner.internal_values(values);
    }
    fn aid_sources(&self) -> &[&'static str] {
        self.inner.aid_sources()
    }
    fn aid_status(&self, status: &mut [AidStatus]) {
        self.inner.aid_status(status);
    }
    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        self.inner.snapshot(bytes)
    }
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        self.inner.restore(snapshot)
    }
}

/// A simulation that plays the log of a map, and what was found by calibration.
pub fn simulation(
    map: &Map,
    options: &ReplayOptions,
    registry: &Registry,
) -> Result<Simulation, Error> {
    build(map, options, registry).map(|(simulation, _)| simulation)
}

/// The same, with what was found by calibration and of noise.
pub fn build(
    map: &Map,
    options: &ReplayOptions,
    registry: &Registry,
) -> Result<(Simulation, Vec<Found>), Error> {
    let mut plan = Plan::new(map)?;
    let mut found = calibrate(map, &mut plan)?;
    found.extend(options.found.iter().cloned());
    let mut drive = Drive::open(map, &plan)?;
    let reference = Reference::load(map, drive.origin_ns())?;
    if options.ghost && reference.known() != (true, true) {
        return Err(map.error(
            "reference",
            "a ghost drives over a slope with a mass, and one of the two is not known",
            "`slope` and `mass` under `reference`",
        ));
    }
    let Some(first) = drive.next(map)? else {
        let path = map.files.values().next().cloned().unwrap_or_default();
        return Err(wrong(
            &path,
            None,
            "there is no row in this log",
            "a log with rows, and columns that the map file names",
        ));
    };
    let estimators = match options.estimators.is_empty() {
        true => map.file.estimators.clone(),
        false => options
            .estimators
            .iter()
            .map(|name| (name.clone(), Settings::default()))
            .collect(),
    };
    let (mut estimators, mut registry) = (estimators, registry.clone());
    for (name, file) in &options.judged {
        let added = file.add(&mut registry, name, drive.origin_ns());
        added.map_err(|e| wrong(&file.path, None, e.to_string(), "--name with another name"))?;
        estimators.insert(name.clone(), Settings::default());
    }
    if options.noise_from_log || map.file.noise.is_some() {
        found.extend(Noise::of_log(map, &plan)?.give(&mut estimators, &registry));
    }
    if estimators.is_empty() {
        return Err(map.error(
            "estimators",
            "there is no estimator to be run",
            "`estimators: {NAME: {}}` in the map file, or --estimators NAME,…",
        ));
    }
    let mut digests = BTreeMap::new();
    let judged = options.judged.iter().map(|(_, file)| &file.path);
    for path in map.files.values().chain(&map.dbc).chain(judged) {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        digests.insert(name, sum(path)?);
    }
    let (slope_sd, mass_sd) = (reference.slope_sd_rad, reference.mass_sd_kg);
    let vehicle = plan.vehicle;
    let point = vehicle.tare_span_m == [0.0; 2]
        && vehicle.load_span_m == [0.0; 2]
        && vehicle.imu_arm_m == 0.0;
    let step_s = map.step_ns() as f64 * 1e-9;
    let targets = plan.targets().collect();
    // the loop begins a step before the first one
    let mut truth = Truth::unknown((first.t_ns - map.step_ns()) as f64 * 1e-9);
    truth.sd.total_mass_kg = mass_sd;
    truth.sd.grade_rad = slope_sd;
    let shared: Shared = Arc::new(Mutex::new(Playback {
        drive,
        map: map.clone(),
        reference,
        steps: [first, Step::default()],
        now: 1,
        more: true,
        ghost: options.ghost.then(|| Ghost::new(vehicle)),
        command: Command::default(),
    }));
    let segment = Arc::new(AtomicU32::new(0));
    let of_segment = segment.clone();
    let recorded = RecordedDrive {
        scenario: LogScenario {
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
        },
        document: map.document.clone(),
        inputs: map.inputs.clone(),
        vehicle,
        plant: Box::new(RecordedPlant {
            shared: shared.clone(),
            segment: segment.clone(),
            truth,
            over: false,
            point,
        }),
        instrument: Box::new(RecordedInstrument {
            shared: shared.clone(),
            targets,
            drives: vehicle.drives,
            ghost: options.ghost,
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
    };
    Ok((Simulation::recorded(recorded, &registry)?, found))
}
