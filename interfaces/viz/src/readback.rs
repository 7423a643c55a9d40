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
    let mut all = read_all(&[path])?;
    match all.len() {
        0 => Ok(Recording::default()),
        1 => Ok(all.remove(0)),
        n => Err(damaged(path, format!("{n} recordings in one file"))),
    }
}

/// Reads files into one store, as a viewer with all of them does: only application and id of a message separate
/// recordings, so files with the same application and id become one recording. In the order in which they begin.
pub fn read_all(paths: &[&Path]) -> Result<Vec<Recording>, Error> {
    let mut all = Vec::new();
    for path in paths {
        decoded(|| decode(path, &mut all)).unwrap_or_else(|e| Err(damaged(path, e.into())))?;
    }
    Ok(all)
}

fn damaged(path: &Path, what: String) -> Error {
    Error::at(path)(std::io::Error::new(std::io::ErrorKind::InvalidData, what))
}

fn decode(path: &Path, all: &mut Vec<Recording>) -> Result<(), Error> {
    let fail = Error::at(path);
    let other = |e: String| damaged(path, e);
    frames::check_lengths(path).map_err(&fail)?;
    let file = BufReader::new(File::open(path).map_err(&fail)?);
    let mut messages = Decoder::<LogMsg>::decode_eager(file).map_err(|e| other(e.to_string()))?;
    let mut of_file = Vec::new();
    let mut layout = Vec::new();
    for message in messages.by_ref() {
        if let LogMsg::ArrowMsg(store, arrow) = message.map_err(|e| other(e.to_string()))? {
            let chunk = Chunk::from_arrow_msg(&arrow).map_err(|e| other(e.to_string()))?;
            if store.is_recording() {
                let id = store.recording_id().to_string();
                let application = store.application_id().to_string();
                let name = chunk.entity_path().to_string();
                let same = |r: &Recording| r.id == id && r.application == application;
                let place = all.iter().position(same).unwrap_or_else(|| {
                    all.push(Recording {
                        application,
                        id,
                        ..Recording::default()
                    });
                    all.len() - 1
                });
                if !of_file.contains(&place) {
                    of_file.push(place);
                }
                if let Some(recording) = all.get_mut(place) {
                    recording.entities.entry(name).or_default().add(&chunk);
                }
            } else {
                layout.push(chunk.entity_path().to_string());
            }
        }
    }
    let manifests = messages.rrd_manifests().map_err(|e| other(e.to_string()))?;
    let complete = !manifests.is_empty() && frames::ends_with_index(path).map_err(fail)?;
    for place in of_file {
        if let Some(recording) = all.get_mut(place) {
            recording.layout.clone_from(&layout);
            recording.complete = complete;
        }
    }
    Ok(())
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
