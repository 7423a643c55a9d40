//! `monorig list runs`: the runs in the folder for results.

use crate::command::CommandOutcome;
use crate::files::folders::entries;
use crate::ui::errors::CliError;
use crate::ui::output;
use crate::ui::tables::{lines, right, table, within_terminal};
use monorig_lab::verdicts::summary::Summary;
use monorig_sim::config::file::read_result;
use monorig_sim::record::manifest::{self, Manifest};
use std::path::{Path, PathBuf};

/// A run that was found.
struct Found {
    name: String,
    seed: String,
    simulated: String,
    verdict: String,
    changes: Vec<String>,
}

/// List the runs, by name and seed.
pub fn list(out: &Path, filter: &str) -> Result<CommandOutcome, CliError> {
    if out.exists() && !out.is_dir() {
        let message = format!("{} is a file", out.display());
        let help = "name the folder of `monorig run --out`";
        return Err(CliError::refused(message, help));
    }
    let mut found = Vec::new();
    for folder in folders(out)? {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        if !name.contains(filter) {
            continue;
        }
        let mut seeds = folders(&folder)?;
        seeds.retain(|seed| seed.join(manifest::NAME).is_file());
        seeds.sort_by_key(|seed| number(seed));
        found.extend(seeds.iter().map(|seed| read(&name, seed)));
    }
    if found.is_empty() {
        output::print(&format!("no runs in {}\n", out.display()))?;
        return Ok(CommandOutcome::Held);
    }
    output::verdicts(&(text(&found) + "\n"))?;
    Ok(CommandOutcome::Held)
}

fn text(found: &[Found]) -> String {
    let mut table = table(["run", "seed", "simulated", "verdict"]);
    let mut changes: Vec<(&str, &[String])> = Vec::new();
    for run in found {
        table.add_row([
            run.name.as_str(),
            run.seed.as_str(),
            run.simulated.as_str(),
            run.verdict.as_str(),
        ]);
        if !run.changes.is_empty() && changes.iter().all(|(name, _)| *name != run.name) {
            changes.push((&run.name, &run.changes));
        }
    }
    within_terminal(&mut table);
    right(&mut table, 1..=2);
    let mut text = lines(&table);
    for (name, changes) in changes {
        text += &format!("\n\n{name}\n");
        let lines: Vec<String> = changes.iter().map(|c| format!("  {c}")).collect();
        text += &lines.join("\n");
    }
    text
}

/// Reads the row of a run; the row of an unreadable run says so.
fn read(name: &str, folder: &Path) -> Found {
    let seed = folder.file_name().unwrap_or_default().to_string_lossy();
    let manifest = Manifest::of_run(folder);
    let summary = read_result(&folder.join("metrics.json"))
        .ok()
        .and_then(|text| serde_json::from_str::<Summary>(&text).ok());
    let (simulated, verdict) = match &summary {
        _ if manifest.is_err() => ("-".to_owned(), "damaged".to_owned()),
        None => ("-".to_owned(), "damaged".to_owned()),
        Some(s) if !s.finished => (format!("{:.1} s", s.simulated_s), "not finished".to_owned()),
        Some(s) if s.check().is_err() => ("-".to_owned(), "damaged".to_owned()),
        Some(s) => {
            let word = s.verdict().judgement().word();
            (format!("{:.1} s", s.simulated_s), word)
        }
    };
    Found {
        name: name.to_owned(),
        seed: seed.into_owned(),
        simulated,
        verdict,
        changes: manifest.map(|m| m.changes).unwrap_or_default(),
    }
}

/// Seed in the name of a run's folder; an interrupted run comes after the complete runs.
fn number(folder: &Path) -> (u64, String) {
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let digits = name.split('.').next().and_then(|d| d.parse().ok());
    (digits.unwrap_or(u64::MAX), name.into_owned())
}

/// Folders in a folder, sorted by name, without hidden folders. A missing folder gives an empty list.
fn folders(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut found = entries(folder)?;
    found.retain(|path| path.is_dir());
    Ok(found)
}
