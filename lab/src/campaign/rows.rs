//! The rows of a campaign, read back and checked against its list of runs: a line that was edited, or is of another
//! campaign, is found.

use crate::campaign::lines::{Lines, RawLine};
use crate::campaign::wrong;
use crate::campaign::{Campaign, CampaignKind};
use monorig_sim::error::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;
use std::path::Path;

/// Result of a run: a line of JSON.
pub trait CampaignRow: Serialize + DeserializeOwned {
    /// Values of the campaign for checking rows.
    type Plan;

    /// Reads these values. The error says what of the campaign does not fit.
    fn plan(campaign: &Campaign) -> Result<Self::Plan, String>;

    /// Checks that the row can belong to this run of the campaign.
    fn check(&self, campaign: &Campaign, plan: &Self::Plan, index: u64) -> Result<(), String>;
}

/// Reads rows one after the other, each with its line. A last line without an end is no row.
pub struct Rows<R: CampaignRow> {
    campaign: Campaign,
    plan: R::Plan,
    lines: Lines,
    read: u64,
    torn: bool,
    row: PhantomData<R>,
}

impl<R: CampaignRow> Rows<R> {
    /// Opens a file of results of one of these kinds.
    pub fn open(path: &Path, kinds: &[CampaignKind]) -> Result<Self, Error> {
        let (campaign, lines) = Campaign::open(path)?;
        if !kinds.contains(&campaign.kind) {
            let words: Vec<&str> = kinds.iter().map(|k| k.word()).collect();
            let message = format!("these are results of `monorig {}`", campaign.kind.word());
            let help = format!("results of `monorig {}`", words.join("` or `monorig "));
            return Err(wrong(path, Some(1), message, help));
        }
        Self::behind(campaign, lines)
    }

    /// Reads the rows after the header.
    pub(crate) fn behind(campaign: Campaign, lines: Lines) -> Result<Self, Error> {
        let plan = campaign.check().and_then(|()| R::plan(&campaign));
        let plan = plan.map_err(|message| lines.wrong(message, campaign.kind.again()))?;
        Ok(Self {
            campaign,
            plan,
            lines,
            read: 0,
            torn: false,
            row: PhantomData,
        })
    }

    /// The campaign.
    pub fn campaign(&self) -> &Campaign {
        &self.campaign
    }

    /// Number of rows that were read.
    pub(crate) fn read(&self) -> u64 {
        self.read
    }

    /// Number of bytes of the complete lines that were read.
    pub(crate) fn whole_bytes(&self) -> u64 {
        self.lines.whole_bytes()
    }

    /// Makes an error in the line that was read last.
    pub(crate) fn wrong(&self, message: impl Into<String>) -> Error {
        self.lines.wrong(message, self.campaign.kind.again())
    }

    /// Returns the next row, which must exist.
    pub(crate) fn must(&mut self) -> Result<(String, R), Error> {
        let index = self.campaign.index(self.read);
        self.next().unwrap_or_else(|| {
            Err(self.wrong(match self.torn {
                true => format!("this is not the result of run {index}: the line is incomplete"),
                false => format!("these results end before run {index}"),
            }))
        })
    }

    fn row(&self, line: String) -> Result<(String, R), String> {
        let index = self.campaign.index(self.read);
        if index >= self.campaign.runs() {
            return Err("the file has more results than the campaign has runs".into());
        }
        let row = serde_json::from_str::<R>(&line);
        let row = row.map_err(|e| format!("this is not the result of run {index}: {e}"))?;
        row.check(&self.campaign, &self.plan, index)?;
        Ok((line, row))
    }
}

impl<R: CampaignRow> Iterator for Rows<R> {
    type Item = Result<(String, R), Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let RawLine { bytes, torn } = match self.lines.read() {
            Ok(line) => line?,
            Err(e) => return Some(Err(e)),
        };
        self.torn = torn;
        if torn {
            return None;
        }
        let text = String::from_utf8(bytes);
        let text = text.map_err(|_| "this line is not text in UTF-8".to_owned());
        let row = text.and_then(|line| self.row(line));
        self.read += 1;
        Some(row.map_err(|message| self.wrong(message)))
    }
}
