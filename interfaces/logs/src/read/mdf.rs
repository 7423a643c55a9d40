//! MDF 4, by `falcon_mdf`: a table a channel group, read in windows of rows. The stamp is the start of the recording
//! plus the master channel. A channel whose values have names (flags, gears) is read as its numbers; of one that
//! names some of its values, such as "not available", and computes the others, the named ones are no values.

use super::{Asked, LogColumn, LogReader, Out, ReadOptions, Row, Section};
use crate::notation::TimeUnit;
use crate::wrong;
use falcon_mdf::{Channel, ChannelGroup, Conversion, Mf4File, OpenOptions, Signal, TableEntry};
use monorig_sim::error::Error;
use std::path::Path;

/// Rows of a window.
const WINDOW: usize = 4096;
/// Largest block after decompression, bytes: above it the library truncates in silence, which the count of samples
/// shows.
const MAX_BLOCK: u64 = 256 << 20;

fn broken(path: &Path, e: &dyn std::fmt::Display) -> Error {
    wrong(
        path,
        None,
        format!("this MDF file cannot be read: {e}"),
        "use a complete file of MDF 4.10 or 4.20",
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
            "this file is MDF 4.30, whose compressed blocks monorig cannot read",
            "save it as MDF 4.20 (asammdf: `MDF(name).convert('4.20')`)",
        ));
    }
    Ok(file)
}

/// The reader of MDF: its channel groups are sections.
pub(super) struct MdfReader;

impl LogReader for MdfReader {
    fn name(&self) -> &'static str {
        "MDF4"
    }

    fn magics(&self) -> &[&'static [u8]] {
        &[b"MDF     ", b"UnFinMF "]
    }

    fn endings(&self) -> &[&'static str] {
        &["mf4", "mdf"]
    }

    fn sections(&self, path: &Path, options: &ReadOptions) -> Result<Vec<Section>, Error> {
        let file = open(path)?;
        let is_wanted = |&(d, c, group): &(usize, usize, &ChannelGroup)| {
            let name = table_name(&file, (d, c));
            let mut channels = group.channels.iter();
            channels.any(|ch| !ch.is_master() && options.wants(&name, &ch.name))
        };
        let wanted = groups(&file).filter(is_wanted);
        Ok(wanted.map(|(d, c, _)| Section::Group(d, c)).collect())
    }

    fn read(&self, asked: Asked<'_>, out: &mut Out<'_>) -> Result<(), Error> {
        let Asked {
            path,
            options,
            section,
        } = asked;
        let file = open(path)?;
        let is_frame = |ch: &Channel| ch.name.starts_with("CAN_DataFrame");
        let is_bus = || groups(&file).any(|(.., group)| group.channels.iter().any(is_frame));
        if options.wanted.is_none() && options.dbc.is_some() && is_bus() {
            let what = "this MDF file has frames of a CAN bus, which monorig cannot read from MDF: `--dbc` has no effect";
            let help =
                "export the frames as candump, ASC or BLF, for example with asammdf or python-can";
            return Err(wrong(path, None, what, help));
        }
        for (d, c, group) in groups(&file) {
            let is_read = section == Section::Whole || section == Section::Group(d, c);
            if is_read && !read_group(path, &file, (d, c, group), options, out)? {
                break;
            }
        }
        Ok(())
    }
}

/// All channel groups, with the numbers of data group and channel group.
fn groups(file: &Mf4File) -> impl Iterator<Item = (usize, usize, &ChannelGroup)> {
    let each = file.data_groups().iter().enumerate();
    each.flat_map(|(d, data)| {
        let of_data = data.channel_groups.iter().enumerate();
        of_data.map(move |(c, group)| (d, c, group))
    })
}

/// True if a channel holds numbers.
fn is_number(channel: &Channel) -> bool {
    use falcon_mdf::blocks::DataType::{FloatBe, FloatLe, IntBe, IntLe, UIntBe, UIntLe};
    matches!(
        channel.data_type,
        FloatBe | FloatLe | IntBe | IntLe | UIntBe | UIntLe
    )
}

/// The numbers of a channel, also of one whose conversion makes texts of them.
fn numbers(signal: &Signal) -> Result<Vec<f64>, falcon_mdf::Mf4Error> {
    let channel = signal.channel();
    let computes_some = match &channel.conversion {
        Conversion::ValueToText {
            entries, default, ..
        }
        | Conversion::RangeToText {
            entries, default, ..
        } => entries.iter().chain(default).any(TableEntry::is_nested),
        Conversion::Bitfield { .. } => false,
        _ => return signal.values_f64(),
    };
    let raw = signal.raw_values()?.to_f64();
    Ok(match computes_some {
        true => raw.into_iter().map(|x| channel.convert(x)).collect(),
        false => raw,
    })
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

/// Reads a channel group; false if no more is wanted.
fn read_group(
    path: &Path,
    file: &Mf4File,
    (d, c, group): (usize, usize, &ChannelGroup),
    options: &ReadOptions,
    out: &mut Out<'_>,
) -> Result<bool, Error> {
    let start_ns = file.start_time().timestamp_ns;
    let name = table_name(file, (d, c));
    let Some(master) = group.channels.iter().find(|ch| ch.is_master()) else {
        return Ok(true);
    };
    // channels of text have no numbers
    let is_wanted = |ch: &&Channel| {
        !ch.is_master()
            && ch.unreadable().is_none()
            && is_number(ch)
            && options.wants(&name, &ch.name)
    };
    let mut channels = vec![master];
    channels.extend(group.channels.iter().filter(is_wanted));
    let columns = channels.iter().skip(1).map(|ch| LogColumn {
        name: ch.name.clone(),
        unit: ch.unit.clone(),
    });
    let columns: Vec<LogColumn> = columns.collect();
    if columns.is_empty() {
        return Ok(true);
    }
    let table = out.table(&name, columns);
    let mut place = 0u64;
    let windows = file.signals_chunks(&channels, WINDOW);
    for window in windows.map_err(|e| broken(path, &e))? {
        let window = window.map_err(|e| broken(path, &e))?;
        let mut values = Vec::with_capacity(window.len());
        for signal in &window {
            let numbers = numbers(signal).map_err(|e| broken(path, &e))?;
            values.push((numbers, signal.validity()));
        }
        let Some(((times, _), columns)) = values.split_first() else {
            continue;
        };
        for (row, t) in times.iter().enumerate() {
            place += 1;
            let since_start = TimeUnit::Seconds.of_f64(*t);
            let stamp_ns = since_start.and_then(|t| t.checked_add(start_ns));
            let Some(stamp_ns) = stamp_ns else {
                let message = format!("sample {place} of `{name}` has no time");
                return Err(broken(path, &message));
            };
            let value = |(x, valid): &(Vec<f64>, Option<Vec<bool>>)| {
                let there = valid.as_ref().is_none_or(|v| v.get(row) != Some(&false));
                let value = x.get(row).copied().filter(|_| there);
                value.unwrap_or(f64::NAN)
            };
            if !out.row(Row::at(table, stamp_ns, place), columns.iter().map(value)) {
                return Ok(false);
            }
        }
    }
    if place != group.sample_count {
        let declared = group.sample_count;
        let message = format!("`{name}` has {place} of the {declared} samples that it declares");
        return Err(broken(path, &message));
    }
    Ok(true)
}
