//! A recorded log, played to estimators, recorded and judged.

use crate::arguments::Json;
use crate::command::CommandOutcome;
use crate::files::out::prepare_out;
use crate::identity::identity;
use crate::recording::simulate::{RecordOptions, simulate};
use crate::recording::variant::Variant;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::progress::ProgressDisplay;
use crate::ui::{output, replayed, tables};
use crate::verdicts::{TestedScenario, junit};
use monorig_lab::verdicts::expected;
use monorig_logs::map::Map;
use monorig_logs::replay::{Built, ReplayOptions, build};
use monorig_sim::closed_loop::registry::Registry;
use serde_json::json;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

/// The way a log is played.
pub(crate) struct Playing<'a> {
    /// Estimators and noise.
    pub(crate) options: &'a ReplayOptions,
    /// Folder of the results.
    pub(crate) out: &'a Path,
    /// Also stream to the viewer at this address.
    pub(crate) live: Option<SocketAddr>,
    /// Do not write `run.rrd`.
    pub(crate) no_rerun: bool,
    /// Record long logs at the full rate too.
    pub(crate) full_rate: bool,
    /// Write the verdicts as JUnit XML here.
    pub(crate) junit: Option<&'a Path>,
    /// Results for programs.
    pub(crate) json: &'a Json,
    /// Changes to the map.
    pub(crate) sets: &'a [(String, String)],
}

/// Play a log, judge the estimators, and show the verdicts.
pub(crate) fn play(
    map: &Map,
    task: &Playing<'_>,
    registry: &Registry,
) -> Result<CommandOutcome, CliError> {
    if let Some(path) = task.junit {
        output::clear(path)?;
    }
    let out = task.out;
    let Built {
        mut simulation,
        found,
        taken,
    } = build(map, task.options, registry)?;
    expected::check(&simulation.scenario)?;
    let variant = Variant::new(task.sets, None);
    simulation.scenario.name = variant.run_name(&simulation.scenario.name);
    prepare_out(out)?;
    for f in &found {
        note(&format!(
            "found: {} = {} ± {} {}",
            f.what,
            tables::number(f.value),
            tables::number(f.sd),
            f.unit
        ));
    }
    if let Some(taken) = taken {
        note(&taken);
    }
    interrupt::listen();
    let mut progress = ProgressDisplay::new(&format!("replay of {}", map.name));
    let options = RecordOptions {
        out,
        live: task.live,
        pace: None,
        no_rerun: task.no_rerun,
        full_rate: task.full_rate,
        keep_samples: false,
        changes: &variant.changes,
        registry,
    };
    let run = simulate(simulation, &options, &mut |share| {
        progress.at(share);
        interrupt::go_on()
    })?;
    drop(progress);
    note(&format!("results in {}", run.folder.display()));
    let about = run.about(map.name.clone(), "replayed");
    let text = replayed::text(&run.summary, map.constant_mass_kg(), &about);
    output::result(&text, &[task.json.path(), task.junit])?;
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    task.json.write(|| {
        let monorig = identity().to_string();
        json!({ "version": 1, "kind": "run", "monorig": monorig, "runs": [run.json()] })
    })?;
    let judged = run.summary.verdict();
    let good = judged.held;
    if let Some(path) = task.junit {
        let tested = TestedScenario::new(judged, Duration::from_secs_f64(run.wall_s));
        output::write(path, &junit::xml(&[tested])?)?;
    }
    Ok(match good {
        true => CommandOutcome::Held,
        false => CommandOutcome::Failed,
    })
}
