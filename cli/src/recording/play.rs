//! A recorded log, played to estimators, recorded and judged.

use crate::arguments::{Foreign, Json, Out, VIEWER, address, assignment};
use crate::command::CommandOutcome;
use crate::files::out::prepare_out;
use crate::identity::identity;
use crate::recording::simulate::{RecordOptions, simulate};
use crate::recording::variant::Variant;
use crate::ui::errors::CliError;
use crate::ui::interrupt;
use crate::ui::note::note;
use crate::ui::progress::ProgressDisplay;
use crate::ui::{output, summary, tables};
use crate::verdicts::{TestedScenario, junit};
use monorig_lab::verdicts::expected;
use monorig_logs::map::Map;
use monorig_logs::replay::{Built, ReplayOptions, build};
use monorig_sim::closed_loop::registry::Registry;
use serde_json::json;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Options for playing a log.
pub(crate) struct Playing<'a> {
    /// Estimators and noise.
    pub(crate) options: &'a ReplayOptions,
    /// Results and changes.
    pub(crate) args: &'a PlayArgs,
    /// Record long logs at the full rate too.
    pub(crate) full_rate: bool,
}

/// Command-line options of every command that plays a log.
#[derive(Clone, Debug, clap::Args)]
pub struct PlayArgs {
    #[command(flatten)]
    pub out: Out,
    /// Also stream to a Rerun viewer; without an address to the open viewer on this machine
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "no_rerun", num_args = 0..=1, require_equals = true,
        default_missing_value = VIEWER, value_parser = address)]
    pub live: Option<SocketAddr>,
    /// Do not write run.rrd
    #[arg(long)]
    pub no_rerun: bool,
    /// Write the verdicts as JUnit XML, for CI servers
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Change a value of the map, such as `expect=[…]`; may be given several times
    #[arg(long = "set", value_name = "PATH=VALUE", value_parser = assignment)]
    pub sets: Vec<(String, String)>,
    #[command(flatten)]
    pub json: Json,
    #[command(flatten)]
    foreign: Foreign,
}

impl PlayArgs {
    /// The registry for a map that others may have sent.
    pub(crate) fn registry(&self, map: &Map, all: &Registry) -> Registry {
        self.foreign.registry(all, map.foreign_named_by(&self.sets))
    }
}

/// Play a log, judge the estimators, and show the verdicts.
pub(crate) fn play(
    map: &Map,
    task: &Playing<'_>,
    registry: &Registry,
) -> Result<CommandOutcome, CliError> {
    let args = task.args;
    let registry = &args.registry(map, registry);
    let junit = args.junit.as_deref();
    let out = &args.out.get();
    let Built {
        mut simulation,
        found,
        taken,
    } = build(map, task.options, registry)?;
    expected::check(&simulation.scenario)?;
    let variant = Variant::new(&args.sets, None);
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
    output::begin()?;
    let mut progress = ProgressDisplay::new(&format!("replay of {}", map.name));
    let options = RecordOptions {
        out,
        live: args.live,
        pace: None,
        no_rerun: args.no_rerun,
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
    let text = summary::text(&run.summary, &about);
    output::result(&text, &[args.json.path(), junit])?;
    if run.interrupted {
        return Err(CliError::Interrupted);
    }
    args.json.write(|| {
        let monorig = identity().to_string();
        json!({ "version": 1, "kind": "run", "monorig": monorig, "runs": [run.json()] })
    })?;
    let judged = run.summary.verdict();
    let good = judged.held;
    if let Some(path) = junit {
        let tested = TestedScenario::new(judged, Duration::from_secs_f64(run.wall_s));
        output::write(path, &junit::xml(&[tested])?)?;
    }
    Ok(CommandOutcome::of(good))
}
