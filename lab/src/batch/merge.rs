//! Shards of a study put together: the same bytes as if it had been run whole.

use crate::batch::jsonl::to_line;
use crate::batch::lines::{Lines, wrong};
use crate::batch::{Shard, StudyHeader, StudyOfHeader};
use crate::verdicts::run_result::RunResult;
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// An open shard.
struct Part {
    path: PathBuf,
    shard: Shard,
    study: Option<StudyOfHeader>,
    lines: Lines,
    read: usize,
}

/// Merges the shards in `parts` into `to` and returns the number of runs. All must be there, whole, and of one study.
pub fn merge(parts: &[PathBuf], to: &Path) -> Result<u64, Error> {
    let mut opened = Vec::new();
    let mut whole: Option<StudyHeader> = None;
    for path in parts {
        let (mut part, mut header) = open(path)?;
        let study = StudyOfHeader::new(&header);
        header.shard = None;
        match &whole {
            Some(first) => {
                if let Some(what) = header.differs(first) {
                    return Err(wrong(
                        path,
                        Some(1),
                        format!(
                            "these are other results than in the first file: {what} (here: the first file)"
                        ),
                        "name the shards of one study, made by one program",
                    ));
                }
            }
            None => whole = Some(header),
        }
        // after what differs between the files, which says more
        let help = "run `monorig study` for this shard again";
        part.study = Some(study.map_err(|message| wrong(path, Some(1), message, help))?);
        opened.push(part);
    }
    opened.sort_by_key(|p| p.shard.part);
    let of = opened.first().map_or(1, |p| p.shard.of);
    let numbers = opened.iter().map(|p| (p.shard.part, p.shard.of));
    if !numbers.eq((1..=of).map(|part| (part, of))) {
        let there = opened
            .iter()
            .map(|p| format!("{}/{}", p.shard.part, p.shard.of));
        return Err(wrong(
            parts.first().map_or(to, PathBuf::as_path),
            None,
            format!(
                "these shards do not make a whole: {}",
                there.collect::<Vec<_>>().join(", ")
            ),
            "name every shard of the study once, 1/n to n/n",
        ));
    }
    let Some(header) = whole else {
        return Err(wrong(
            to,
            None,
            "there is nothing to merge",
            "name the files with the shards",
        ));
    };
    write(&mut opened, &header, to)?;
    Ok(header.runs)
}

fn open(path: &Path) -> Result<(Part, StudyHeader), Error> {
    let mut lines = Lines::open(path)?;
    let first = lines.next().and_then(Result::ok).unwrap_or_default();
    let header: StudyHeader = serde_json::from_str(&first).map_err(|_| {
        wrong(
            path,
            Some(1),
            "these are not the results of a study",
            "a file that `monorig study` wrote",
        )
    })?;
    let part = Part {
        path: path.into(),
        shard: header.shard.unwrap_or(Shard::WHOLE),
        study: None,
        lines,
        read: 1,
    };
    Ok((part, header))
}

/// Under a temporary name first: there is never half a result.
fn write(parts: &mut [Part], header: &StudyHeader, to: &Path) -> Result<(), Error> {
    whole::replaceable(to)?;
    let partial = whole::partial(to);
    let done = fill(parts, header, &partial).and_then(|()| {
        std::fs::rename(&partial, to).map_err(|source| Error::Io {
            path: to.into(),
            source,
        })
    });
    if done.is_err() {
        let _ = std::fs::remove_file(&partial);
    }
    done
}

fn fill(parts: &mut [Part], header: &StudyHeader, to: &Path) -> Result<(), Error> {
    let failed = |source| Error::Io {
        path: to.into(),
        source,
    };
    let mut out = BufWriter::new(whole::create(to)?);
    writeln!(out, "{}", to_line(header)).map_err(failed)?;
    let of = parts.len() as u64;
    for index in 0..header.runs {
        if let Some(part) = parts.get_mut((index % of) as usize) {
            writeln!(out, "{}", part.line(index)?).map_err(failed)?;
        }
    }
    for part in parts {
        if part.lines.next().is_some() {
            return Err(wrong(
                &part.path,
                Some(part.read + 1),
                "there are more results than the study has runs",
                "run this shard again",
            ));
        }
    }
    out.flush().map_err(failed)
}

impl Part {
    /// The line of the run of this index, which must come next.
    fn line(&mut self, index: u64) -> Result<String, Error> {
        let line = match self.lines.next() {
            Some(line) => line?,
            None => String::new(),
        };
        self.read += 1;
        let message = match serde_json::from_str::<RunResult>(&line) {
            Ok(result) => match &self.study {
                Some(study) => match study.check(index / self.shard.of.max(1), &result) {
                    Ok(()) => return Ok(line),
                    Err(message) => message,
                },
                None => "its header has no study".to_owned(),
            },
            Err(_) if line.is_empty() => format!("this shard stops before run {index}"),
            Err(_) => format!("this is not the result of run {index}"),
        };
        Err(wrong(
            &self.path,
            Some(self.read),
            message,
            "run `monorig study` for this shard again: it goes on where it stopped",
        ))
    }
}
