//! Joined shards of a campaign: the same rows as if it had been run whole.

use crate::campaign::store::to_line;
use crate::campaign::wrong;
use crate::campaign::{Campaign, CampaignKind, CampaignRow, Rows, Shard};
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The files of all shards of a campaign: their rows in the order of the list of runs.
pub struct Shards<R: CampaignRow> {
    campaign: Campaign,
    parts: Vec<Rows<R>>,
    next: u64,
}

impl<R: CampaignRow> Shards<R> {
    /// Opens the files. All must be there, whole, and of one campaign of this kind.
    pub fn open(paths: &[PathBuf], kind: CampaignKind) -> Result<Self, Error> {
        let mut whole: Option<Campaign> = None;
        let mut parts: Vec<(Shard, Rows<R>)> = Vec::new();
        for path in paths {
            // what differs between the files says more than what is wrong in one of them
            let own = Campaign::read(path)?.part(None);
            let first = whole.get_or_insert_with(|| own.clone());
            if let Some(what) = own.differs(first) {
                let message = format!(
                    "these results do not belong to the first file: {what} (here: the first file)"
                );
                let help = "name the shards of one campaign, made by one program on machines with equal arithmetic";
                return Err(wrong(path, Some(1), message, help));
            }
            let rows = Rows::open(path, &[kind])?;
            parts.push((rows.campaign().shard(), rows));
        }
        parts.sort_by_key(|(shard, _)| shard.part);
        let of = parts.first().map_or(1, |(shard, _)| shard.of);
        let numbers = parts.iter().map(|(shard, _)| (shard.part, shard.of));
        let (Some(campaign), true) = (whole, numbers.eq((1..=of).map(|part| (part, of)))) else {
            let there = parts.iter().map(|(s, _)| format!("{}/{}", s.part, s.of));
            let there: Vec<String> = there.collect();
            let message = format!("these shards do not make a whole: {}", there.join(", "));
            let path = paths.first().map_or(Path::new(""), PathBuf::as_path);
            let help = "name every shard of the campaign once, 1/n to n/n";
            return Err(wrong(path, None, message, help));
        };
        Ok(Self {
            campaign,
            parts: parts.into_iter().map(|(_, rows)| rows).collect(),
            next: 0,
        })
    }

    /// The whole campaign.
    pub fn campaign(&self) -> &Campaign {
        &self.campaign
    }
}

impl<R: CampaignRow> Iterator for Shards<R> {
    type Item = Result<(String, R), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next == self.campaign.runs() {
            // a row too many, or a line that breaks off
            return self.parts.iter_mut().find_map(Iterator::next);
        }
        let of = self.parts.len() as u64;
        let part = self.parts.get_mut((self.next % of) as usize)?;
        self.next += 1;
        Some(part.must())
    }
}

/// Writes the shards as the file of the whole campaign, and returns the number of runs.
pub fn merge<R: CampaignRow>(shards: Shards<R>, to: &Path) -> Result<u64, Error> {
    // under a temporary name first: there is never half a result
    whole::replaceable(to)?;
    let partial = whole::partial(to);
    let failed = Error::at(to);
    let runs = shards.campaign.runs();
    let fill = || {
        let mut out = BufWriter::new(whole::create(&partial)?);
        writeln!(out, "{}", to_line(&shards.campaign)).map_err(&failed)?;
        for row in shards {
            writeln!(out, "{}", row?.0).map_err(&failed)?;
        }
        out.flush().map_err(&failed)?;
        std::fs::rename(&partial, to).map_err(&failed)
    };
    let done = fill();
    if done.is_err() {
        let _ = std::fs::remove_file(&partial);
    }
    done.map(|()| runs)
}
