//! Campaigns: ordered lists of runs, and the file of JSON lines that their results are kept in.
//!
//! A [`Campaign`] is the first line of the file: the list of runs, and the program, files and values they are made
//! from. Behind it stands a [`CampaignRow`] for each run, in the order of the list. A [`Store`] adds rows, and goes on
//! with a file that a kill has torn; [`Rows`] reads and checks them; [`Shards`] reads the files of several machines as
//! one.

mod header;
mod lines;
mod merge;
mod rows;
mod shard;
mod store;

pub use header::{Campaign, CampaignKind, PlannedRun, RunList};
pub use merge::{Shards, merge};
pub(crate) use monorig_sim::error::wrong;
pub use rows::{CampaignRow, Rows};
pub use shard::Shard;
pub use store::{Store, text};
