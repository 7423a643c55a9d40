//! Reading a recording back: its entities and their values. For tests, and for `monorig check run.rrd`.

use crate::frames;
use monorig_sim::error::Error;
use monorig_sim::guarded::decoded;
use re_log_encoding::Decoder;
use re_sdk_types::archetypes::{Scalars, TextLog, Transform3D};
use rerun::log::{Chunk, LogMsg};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// A recording, entity by entity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// `monorig`.
    pub application: String,
    /// Scenario and seed.
    pub id: String,
    /// Entities by path, such as `/truth/speed`.
    pub entities: BTreeMap<String, Entity>,
    /// Entities of the viewer's layout.
    pub layout: Vec<String>,
    /// True if the file was closed properly (has its footer).
    pub complete: bool,
}

/// The rows recorded at one entity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Entity {
    /// Number of rows without a time.
    pub fixed: usize,
    /// Times of the rows with a time, ns, in the order of the file.
    pub times: Vec<i64>,
    /// Scalars of these rows, one or several a row, in a row.
    pub scalars: Vec<f64>,
    /// Positions of these rows, if it is a pose.
    pub positions: Vec<[f32; 3]>,
    /// Orientations of these rows (quaternion xyzw), if it is a pose.
    pub quaternions: Vec<[f32; 4]>,
    /// Texts of these rows, if it is a log.
    pub texts: Vec<String>,
}

impl Recording {
    /// Rows with a time, of all entities.
    pub fn rows(&self) -> usize {
        self.entities.values().map(|e| e.times.len()).sum()
    }
}

/// Reads a recording. A file that breaks off is read as far as it goes; see [`Recording::complete`]. A damaged file is
/// an error, also where the decoders of Rerun and Arrow panic. They trust the lengths in a file: one from elsewhere can
/// ask for more memory than there is.
pub fn read(path: &Path) -> Result<Recording, Error> {
    decoded(|| decode(path)).unwrap_or_else(|e| Err(damaged(path, e.into())))
}

fn damaged(path: &Path, what: String) -> Error {
    Error::at(path)(std::io::Error::new(std::io::ErrorKind::InvalidData, what))
}

fn decode(path: &Path) -> Result<Recording, Error> {
    let fail = Error::at(path);
    let other = |e: String| damaged(path, e);
    frames::check_lengths(path).map_err(&fail)?;
    let file = BufReader::new(File::open(path).map_err(&fail)?);
    let mut messages = Decoder::<LogMsg>::decode_eager(file).map_err(|e| other(e.to_string()))?;
    let mut found = Recording::default();
    for message in messages.by_ref() {
        let LogMsg::ArrowMsg(store, arrow) = message.map_err(|e| other(e.to_string()))? else {
            continue;
        };
        let chunk = Chunk::from_arrow_msg(&arrow).map_err(|e| other(e.to_string()))?;
        let name = chunk.entity_path().to_string();
        if !store.is_recording() {
            found.layout.push(name);
            continue;
        }
        let id = store.recording_id().to_string();
        if !found.entities.is_empty() && found.id != id {
            return Err(other(format!("{} and {id} in one file", found.id)));
        }
        (found.application, found.id) = (store.application_id().to_string(), id);
        found.entities.entry(name).or_default().add(&chunk);
    }
    let manifests = messages.rrd_manifests().map_err(|e| other(e.to_string()))?;
    found.complete = !manifests.is_empty() && frames::ends_with_index(path).map_err(fail)?;
    Ok(found)
}

impl Entity {
    fn add(&mut self, chunk: &Chunk) {
        if chunk.is_static() {
            self.fixed += chunk.num_rows();
        }
        for timeline in chunk.timelines().values() {
            self.times.extend_from_slice(timeline.times_raw());
        }
        for row in chunk.iter_slices::<f64>(Scalars::descriptor_scalars().component) {
            self.scalars.extend_from_slice(row);
        }
        if !chunk.is_static() {
            let positions = Transform3D::descriptor_translation().component;
            for row in chunk.iter_slices::<[f32; 3]>(positions) {
                self.positions.extend_from_slice(row);
            }
            let quaternions = Transform3D::descriptor_quaternion().component;
            for row in chunk.iter_slices::<[f32; 4]>(quaternions) {
                self.quaternions.extend_from_slice(row);
            }
        }
        for row in chunk.iter_slices::<String>(TextLog::descriptor_text().component) {
            self.texts.extend(row.iter().map(|t| t.to_string()));
        }
    }
}
