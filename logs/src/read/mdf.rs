//! MDF 4, by `falcon_mdf`: a table a channel group, read in windows of rows. The stamp is the start of the recording plus the master channel.

use super::{Column, Out, ReadOptions, Row};
use crate::notation::TimeUnit;
use crate::wrong;
use falcon_mdf::{Mf4File, OpenOptions};
use monorig_sim::error::Error;
use std::path::Path;

/// Rows of a window.
const WINDOW: usize = 4096;
/// Largest block after decompression, bytes: above it the library truncates in silence, which the count of samples shows.
const MAX_BLOCK: u64 = 256 << 20;

fn broken(path: &Path, e: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("this MDF file cannot be read: {e}"),
        "a whole file of MDF 4.10 or 4.20",
    )
}

fn open(path: &Path) -> Result<Mf4File, Error> {
    let options = OpenOptions {
        max_decompressed: MAX_BLOCK,
        ..OpenOptions::default()
    };
    let file = Mf4File::open_with_options(path, options).map_err(|e| broken(path, &e))?;
    let version = file.version().to_string();
    if version.contains("4.30") || version.contains("4.3.0") {
        return Err(wrong(
            path,
            None,
            "this file is MDF 4.30, whose compressed blocks are not read",
            "save it as MDF 4.20 (asammdf: `MDF(name).convert('4.20')`)",
        ));
    }
    Ok(file)
}

/// The channel groups with a wanted column: data group and channel group.
pub(super) fn groups(
    path: &Path,
    options: &ReadOptions,
) -> Result<Vec<Option<(usize, usize)>>, Error> {
    let file = open(path)?;
    let mut found = Vec::new();
    for (d, group) in file.data_groups().iter().enumerate() {
        for (c, group) in group.channel_groups.iter().enumerate() {
            let name = table_name(&file, (d, c));
            if group
                .channels
                .iter()
                .any(|ch| !ch.is_master() && options.wants(&name, &ch.name))
            {
                found.push(Some((d, c)));
            }
        }
    }
    Ok(found)
}

/// Whether a channel holds numbers.
fn is_number(channel: &falcon_mdf::Channel) -> bool {
    use falcon_mdf::blocks::DataType::{FloatBe, FloatLe, IntBe, IntLe, UIntBe, UIntLe};
    matches!(
        channel.data_type,
        FloatBe | FloatLe | IntBe | IntLe | UIntBe | UIntLe
    )
}

/// The name of a group: its acquisition name, else its number.
fn table_name(file: &Mf4File, (d, c): (usize, usize)) -> String {
    let groups = file.data_groups();
    let name = groups
        .get(d)
        .and_then(|g| g.channel_groups.get(c))
        .map_or("", |g| g.acquisition_name.as_str());
    match name {
        "" => format!("group{d}_{c}"),
        name => name.to_owned(),
    }
}

/// Reads one channel group, or all of them one after the other.
pub(super) fn read(
    path: &Path,
    options: &ReadOptions,
    only: Option<(usize, usize)>,
    out: &mut Out<'_>,
) -> Result<(), Error> {
    let file = open(path)?;
    let start_ns = file.start_time().timestamp_ns;
    for (d, data_group) in file.data_groups().iter().enumerate() {
        for (c, group) in data_group.channel_groups.iter().enumerate() {
            if only.is_some_and(|only| only != (d, c)) {
                continue;
            }
            let name = table_name(&file, (d, c));
            let Some(master) = group.channels.iter().find(|ch| ch.is_master()) else {
                continue;
            };
            let readable = |ch: &&falcon_mdf::Channel| {
                !ch.is_master() && ch.unreadable().is_none() && options.wants(&name, &ch.name)
            };
            // channels of text have no numbers
            let mut channels = vec![master];
            channels.extend(
                group
                    .channels
                    .iter()
                    .filter(readable)
                    .filter(|ch| is_number(ch)),
            );
            let columns: Vec<Column> = channels
                .iter()
                .skip(1)
                .map(|ch| Column {
                    name: ch.name.clone(),
                    unit: ch.unit.clone(),
                })
                .collect();
            if columns.is_empty() {
                continue;
            }
            let table = out.table(&name, columns);
            let mut place = 0u64;
            for window in file
                .signals_chunks(&channels, WINDOW)
                .map_err(|e| broken(path, &e))?
            {
                let window = window.map_err(|e| broken(path, &e))?;
                let mut values = Vec::with_capacity(window.len());
                for signal in &window {
                    values.push((
                        signal.values_f64().map_err(|e| broken(path, &e))?,
                        signal.validity(),
                    ));
                }
                let Some(((times, _), columns)) = values.split_first() else {
                    continue;
                };
                for (row, t) in times.iter().enumerate() {
                    place += 1;
                    let stamp_ns = TimeUnit::Seconds
                        .of_f64(*t)
                        .and_then(|t| t.checked_add(start_ns))
                        .ok_or_else(|| {
                            broken(path, &format!("sample {place} of `{name}` has no time"))
                        })?;
                    let value = |(x, valid): &(Vec<f64>, Option<Vec<bool>>)| match valid
                        .as_ref()
                        .is_none_or(|v| v.get(row) != Some(&false))
                    {
                        true => x.get(row).copied().unwrap_or(f64::NAN),
                        false => f64::NAN,
                    };
                    let at = Row {
                        table,
                        piece: 0,
                        stamp_ns,
                        arrival_ns: stamp_ns,
                        place,
                        first: 0,
                    };
                    if !out.row(at, columns.iter().map(value)) {
                        return Ok(());
                    }
                }
            }
            if place != group.sample_count {
                return Err(broken(
                    path,
                    &format!(
                        "`{name}` has {place} of the {} samples that it declares",
                        group.sample_count
                    ),
                ));
            }
        }
    }
    Ok(())
}
