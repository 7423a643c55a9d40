//! With the viewer.

use crate::ui::note::note;
use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use monorig_sim::record::Sink;
use monorig_viz::RerunSink;
pub use monorig_viz::sink::LIVE_CHUNK_S;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// A recording in a file and, if `live`, in the viewer at this address; its lines are thinned unless the full rate is
/// wanted.
pub fn sink(
    path: PathBuf,
    live: Option<SocketAddr>,
    full_rate: bool,
) -> Option<Box<dyn Sink + Send>> {
    let rate = |sink: RerunSink| if full_rate { sink } else { sink.thinned() };
    let Some(viewer) = live else {
        return Some(Box::new(rate(RerunSink::file(path))));
    };
    let sink = rate(RerunSink::live(path, viewer));
    if sink.live_state().is_none() {
        note(&format!(
            "no Rerun viewer answers at {viewer}: start one with `rerun`; the recording goes to the file only"
        ));
    }
    Some(Box::new(sink))
}

/// Reads a recording back, and describes what is in it; `make_again` is the help for one that cannot be used.
pub fn read(path: &Path, make_again: &str) -> Result<String, Error> {
    let broken = |message: String| input_error(path, "", message, make_again);
    let found = monorig_viz::readback::read(path).map_err(|e| match e {
        Error::Io { source, .. } if source.kind() == std::io::ErrorKind::InvalidData => {
            broken(format!("this recording cannot be read: {source}"))
        }
        other => other,
    })?;
    let size = format!("{} entities, {} rows", found.entities.len(), found.rows());
    if found.application != "monorig" {
        return Err(broken("this recording was not written by monorig".into()));
    }
    if !found.complete {
        return Err(broken(format!("this recording breaks off after {size}")));
    }
    Ok(format!("{}, {size}, complete", found.id))
}
