//! Origin of the run, and links to its files.

use crate::reports::page::{Block, Section};
use crate::reports::parameters;
use crate::reports::run::recorded::Recorded;
use crate::reports::run::verdicts;
use crate::reports::table::Table;

const FILES: [(&str, &str); 4] = [
    ("run.rrd", "recording for the Rerun viewer"),
    ("channels.parquet", "every signal, column by column"),
    ("metrics.json", "metrics and verdicts"),
    ("manifest.json", "program and inputs of the run"),
];

/// Metadata and links.
pub(crate) fn section(run: &Recorded, link: &str) -> Section {
    let (manifest, summary) = (&run.manifest, &run.summary);
    let mut about = Table::new(&["", ""], &[]);
    let replayed = run.is_replay();
    for (key, value) in [
        (
            if replayed { "map" } else { "scenario" },
            manifest.scenario.clone(),
        ),
        ("seed", manifest.seed.to_string()),
        (
            if replayed { "replayed" } else { "simulated" },
            format!("{:.2} s in {} steps", summary.simulated_s, summary.steps),
        ),
        ("monorig", manifest.monorig.to_string()),
        (
            "hash of program, inputs and scenario",
            manifest.hash.clone(),
        ),
    ] {
        // the seed of a replay is always the same and means nothing
        if !(replayed && key == "seed") {
            about.row([key.into(), value.into()]);
        }
    }
    let mut inputs = Table::new(&["input file", "SHA-256"], &[]);
    for (name, hash) in &manifest.inputs {
        inputs.row([name.clone().into(), hash.clone().into()]);
    }
    let mut section = Section::new("About this run");
    for (name, what) in FILES {
        if run.folder.join(name).is_file() {
            let text = format!("{name}: {what}");
            section
                .blocks
                .push(Block::Link(text, format!("{link}{name}")));
        }
    }
    let resolved = serde_json::to_string_pretty(&manifest.resolved).unwrap_or_default();
    if !summary.estimators.is_empty() {
        section = section.table(verdicts::all_metrics(summary));
    }
    let settings = parameters::table(&run.estimator_settings());
    section = section.table(settings).table(about).table(inputs);
    let folded = "The scenario with all defaults filled in".to_owned();
    section.blocks.push(Block::Folded(folded, resolved));
    section
}
