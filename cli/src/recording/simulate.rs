//! One run of a scenario with one seed, recorded: the folder `OUT/<scenario>/<seed>/`.

use crate::identity::identity;
use crate::recording::pace::Pace;
use crate::ui::errors::CliError;
use crate::ui::note::{detail, note};
use crate::ui::summary::About;
use crate::viewer;
use monorig_lab::bound::BoundChannels;
use monorig_lab::text::quoted;
use monorig_lab::verdicts::measure::SummaryObserver;
use monorig_lab::verdicts::run_files::{CHANNELS, RunFiles};
use monorig_lab::verdicts::summary::Summary;
use monorig_logs::export::{SAMPLES, SampleRecorder};
use monorig_sim::closed_loop::WallClock;
use monorig_sim::closed_loop::run;
use monorig_sim::closed_loop::run::Observer;
use monorig_sim::closed_loop::{Registry, Simulation};
use monorig_sim::record::parquet::ParquetSink;
use monorig_sim::record::{BackgroundSink, Recorder, Sink};
use serde_json::json;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// A run that was simulated and recorded.
pub struct SimulatedRun {
    /// Numbers for the report.
    pub summary: Summary,
    /// True if it was stopped from outside.
    pub interrupted: bool,
    /// Its folder.
    pub folder: PathBuf,
    /// Time it took, s.
    pub wall_s: f64,
    /// The estimator that the controller uses.
    pub in_loop: Option<String>,
}

impl SimulatedRun {
    /// Title, time and hints of the run; `done` is the verb, such as `simulated`.
    pub(crate) fn about(&self, title: String, done: &str) -> About {
        let (t_s, wall_s) = (self.summary.simulated_s, self.wall_s);
        let speed = match wall_s {
            w if w > 0.0 => format!(", {:.0} times real time", t_s / w),
            _ => String::new(),
        };
        let recording = self.folder.join(RECORDING);
        let look = recording
            .is_file()
            .then(|| format!("look: rerun {}", quoted(&recording.to_string_lossy())));
        let folder = quoted(&self.folder.to_string_lossy());
        let report = format!("report: monorig report {folder}");
        About {
            title,
            in_loop: self.in_loop.clone(),
            took: format!("{t_s:.1} s {done} in {wall_s:.2} s{speed}"),
            hints: look.into_iter().chain([report]).collect(),
            interrupted: self.interrupted,
        }
    }

    /// Folder, verdict and numbers of the run for programs.
    pub(crate) fn json(&self) -> serde_json::Value {
        let verdict = self.summary.verdict();
        json!({
            "folder": self.folder,
            "held": verdict.held,
            "verdict": verdict.judgement().words(),
            "checks": verdict.checks,
            "metrics": self.summary,
        })
    }
}

/// The recording for the viewer, in the folder of a run.
const RECORDING: &str = "run.rrd";

/// Options of a recorded run.
pub struct RecordOptions<'a> {
    /// Folder the results go to.
    pub out: &'a Path,
    /// Also stream to the viewer at this address.
    pub live: Option<SocketAddr>,
    /// Clock that slows the run down; `None` = as fast as possible.
    pub pace: Option<Arc<WallClock>>,
    /// Do not write `run.rrd`.
    pub no_rerun: bool,
    /// Record long runs at the full rate too.
    pub full_rate: bool,
    /// Keep every sample in `samples.parquet`.
    pub keep_samples: bool,
    /// Changes to the scenario file, as `path=value`; the scenario's name already includes the variant.
    pub changes: &'a [String],
    /// Registry of estimators and controllers: their defaults go into the manifest.
    pub registry: &'a Registry,
}

/// Shortest chunk of a recording that is streamed to a viewer, s.
const MIN_CHUNK_S: f64 = 0.5;

/// Simulates. `go_on` gets the share done, 0…1, and returns false to stop; a stopped run is recorded completely up to
/// there.
pub fn simulate(
    mut simulation: Simulation,
    options: &RecordOptions<'_>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<SimulatedRun, CliError> {
    let (scenario, seed) = (simulation.scenario.clone(), simulation.seed);
    let in_loop = simulation
        .in_loop
        .and_then(|i| simulation.estimators.get(i));
    let in_loop = in_loop.map(|e| e.name.clone());
    let (out, registry) = (options.out, options.registry);
    let files = RunFiles::create(out, &simulation, registry, &identity(), options.changes)?;
    for (file, sum) in &scenario.input_digests() {
        detail(&format!(
            "read {file} (SHA-256 {})",
            sum.get(..12).unwrap_or(sum)
        ));
    }
    for (name, settings) in &scenario.file.estimators {
        detail(&format!("estimator {name}: {}", settings.origin(name)));
    }
    let parquet = ParquetSink::create(files.path(CHANNELS))?;
    let mut sinks: Vec<Box<dyn Sink>> = vec![Box::new(BackgroundSink::new(parquet))];
    if !options.no_rerun {
        match viewer::sink(files.path(RECORDING), options.live, options.full_rate) {
            // it takes longest to finish: the others do so meanwhile
            Some(rerun) => sinks.insert(0, Box::new(BackgroundSink::new(rerun))),
            None => note(&viewer::not_written(RECORDING)),
        }
    }
    let mut metrics = SummaryObserver::default();
    let started = Instant::now();
    let mut recorder = Recorder::new(sinks).with(BoundChannels::default());
    if options.live.is_some() {
        // whoever watches gets something about as often, however fast the run is
        let chunk_s = options.pace.as_ref().map_or(viewer::LIVE_CHUNK_S, |clock| {
            clock.times_real().clamp(MIN_CHUNK_S, viewer::LIVE_CHUNK_S)
        });
        recorder = recorder.every_s(chunk_s);
    }
    if options.full_rate {
        recorder = recorder.full_rate();
    }
    let mut pace = options.pace.clone().map(Pace::new);
    let mut observers: Vec<&mut dyn Observer> = vec![&mut recorder, &mut metrics];
    let mut samples = SampleRecorder::new(files.path(SAMPLES));
    if options.keep_samples {
        observers.push(&mut samples);
    }
    if let Some(pace) = &mut pace {
        observers.push(pace);
    }
    let outcome = run::run(&mut simulation, &mut observers, go_on)?;
    let wall_s = started.elapsed().as_secs_f64();
    detail(&format!(
        "{} steps of {} ms in {wall_s:.2} s, recording included: {:.0} times real time",
        outcome.steps,
        scenario.file.physics.dt_ms.get(),
        outcome.simulated_s / wall_s
    ));

    let summary = metrics.summary(&scenario, seed, &outcome);
    let folder = files.finish(&summary, outcome.interrupted)?;
    for (name, settings) in &scenario.file.estimators {
        if settings.is_foreign() {
            note(&format!("{name} is {}", settings.origin(name)));
        }
    }
    if let Some(fmu) = &scenario.file.drive.controller.fmu {
        note(&format!("the controller is foreign, from {fmu}"));
    }
    for (name, times, reason) in &outcome.refusals {
        note(&format!(
            "{name} refused {times} steps, the first because {reason}"
        ));
    }
    Ok(SimulatedRun {
        summary,
        interrupted: outcome.interrupted,
        folder,
        wall_s,
        in_loop,
    })
}
