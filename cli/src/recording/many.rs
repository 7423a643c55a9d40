//! Many runs: made on several threads, shown with their progress, and kept in the file of their campaign.

use crate::arguments::Jobs;
use crate::files::out;
use crate::ui::errors::CliError;
use crate::ui::note::note;
use crate::ui::progress::ProgressDisplay;
use monorig_lab::batch::{Interrupted, in_order};
use monorig_lab::campaign::{Campaign, CampaignRow, Store};
use monorig_sim::config::input_files::InputFiles;
use monorig_sim::record::inputs;
use std::path::{Path, PathBuf};

/// Does `work` on each of the items with a bar called `name`; `take` gets the results in the order of the items, and
/// the bar. `done` of `all` items are finished already.
pub fn many<I: Send, T: Send, E: Into<CliError> + Send>(
    name: &str,
    jobs: Jobs,
    (mut done, all): (u64, u64),
    items: impl Iterator<Item = I> + Send,
    work: impl Fn(I) -> Result<T, E> + Sync,
    mut take: impl FnMut(T, &mut ProgressDisplay) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let mut progress = ProgressDisplay::new(name);
    in_order(jobs.get(), items, work, |result| {
        take(result.map_err(E::into)?, &mut progress)?;
        done += 1;
        progress.at(done as f64 / all as f64);
        Ok(())
    })
}

/// Does `work` on each of the items, and returns the results in their order.
pub fn all_of<I: Send, T: Send, E: Into<CliError> + Send>(
    name: &str,
    jobs: Jobs,
    items: impl ExactSizeIterator<Item = I> + Send,
    work: impl Fn(I) -> Result<T, E> + Sync,
) -> Result<Vec<T>, CliError> {
    let mut results = Vec::new();
    let all = items.len() as u64;
    many(name, jobs, (0, all), items, work, |result, _| {
        results.push(result);
        Ok(())
    })?;
    Ok(results)
}

/// Makes the runs of a campaign that are missing in its file in `folder`, and returns the path of the file. Copies of
/// the inputs go beside the file. `there` gets the existing rows and the new rows.
pub fn resumed<R: CampaignRow + Send>(
    campaign: &Campaign,
    folder: &Path,
    of: &InputFiles,
    jobs: Jobs,
    work: impl Fn(u64) -> Result<R, Interrupted> + Sync,
    mut there: impl FnMut(R),
) -> Result<PathBuf, CliError> {
    out::make(folder)?;
    let path = folder.join(campaign.file_name());
    let mut store = Store::resume(&path, campaign, &mut there)?;
    inputs::keep(of, &folder.join("inputs"))?;
    let (all, begun) = (campaign.rows(), store.rows());
    if let Some(way) = of.elsewhere().filter(|_| begun > 0) {
        let message = format!(
            "{begun} of {all} runs exist already, and the estimator at {way} may be another program now"
        );
        let help = format!(
            "remove {} to begin anew, or name another folder with --out",
            path.display()
        );
        return Err(CliError::refused(message, help));
    }
    if begun > 0 {
        note(&format!("{begun} of {all} runs exist already"));
    }
    let rest = (begun..all).map(|n| campaign.index(n));
    let made = many(&campaign.name, jobs, (begun, all), rest, work, |row, _| {
        store.append(&row)?;
        there(row);
        Ok(())
    });
    if let Err(CliError::Interrupted) = made {
        note(&format!(
            "{} of {all} runs exist: the same command makes the rest",
            store.rows()
        ));
    }
    made.map(|()| path)
}
