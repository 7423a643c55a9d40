//! A viewer that watches a run. It may be absent, slow, or go away: the run never waits for it longer than a few
//! seconds.

use rerun::external::re_uri::ProxyUri;
use rerun::log::LogMsg;
use rerun::sink::{GrpcSink, LogSink};
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::time::{Duration, Instant};

/// Messages on their way to the viewer at most; more, and the run waits (see [`PATIENCE`]).
const QUEUE: usize = 2000;
/// Longest time for a port to answer.
const PROBE: Duration = Duration::from_millis(300);
/// Longest wait for a viewer that takes nothing; then the run goes on without it.
const PATIENCE: Duration = Duration::from_secs(5);

/// A connection to a viewer.
///
/// Rerun's `GrpcSink` blocks without bound when nobody listens, so it lives on a thread of its own behind a bounded
/// queue, and that thread is left behind when it does not come back.
pub struct Live {
    queue: Option<SyncSender<LogMsg>>,
    done: Receiver<()>,
    patience: Duration,
    gave_up: bool,
}

impl Live {
    /// Connect, if something answers at this address (Rerun's viewer listens at 127.0.0.1:9876); none otherwise.
    pub fn connect(address: SocketAddr) -> Option<Self> {
        Self::connect_with(address, QUEUE, PATIENCE)
    }

    fn connect_with(address: SocketAddr, queue: usize, patience: Duration) -> Option<Self> {
        TcpStream::connect_timeout(&address, PROBE).ok()?;
        let uri: ProxyUri = format!("rerun+http://{address}/proxy").parse().ok()?;
        let (queue, messages) = sync_channel::<LogMsg>(queue);
        let (tell_done, done) = channel();
        std::thread::Builder::new()
            .name("viewer".into())
            .spawn(move || {
                let sink = GrpcSink::new(uri);
                for message in messages {
                    sink.send(message);
                }
                let _ = sink.flush_blocking(patience);
                let _ = tell_done.send(());
            })
            .ok()?;
        Some(Self {
            queue: Some(queue),
            done,
            patience,
            gave_up: false,
        })
    }

    /// Returns whether the viewer was too slow, and the run went on without it.
    pub fn gave_up(&self) -> bool {
        self.gave_up
    }

    /// Hand a message over. Waits while the viewer is behind, but not for ever.
    pub(crate) fn send(&mut self, message: LogMsg) {
        let Some(queue) = &self.queue else { return };
        let start = Instant::now();
        let mut message = message;
        loop {
            match queue.try_send(message) {
                Ok(()) => return,
                Err(TrySendError::Full(back)) if start.elapsed() < self.patience => {
                    message = back;
                    std::thread::sleep(Duration::from_millis(2));
                }
                Err(_) => {
                    self.gave_up = true;
                    self.queue = None;
                    return;
                }
            }
        }
    }

    /// Wait until the viewer has everything, but not for ever.
    pub(crate) fn finish(&mut self) {
        if self.queue.take().is_some() && self.done.recv_timeout(2 * self.patience).is_err() {
            self.gave_up = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::{MessageStream, entity};

    use std::net::TcpListener;

    #[test]
    fn nobody_listens() {
        // A port that was free a moment ago.
        let address = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap();
        let start = Instant::now();
        assert!(Live::connect(address).is_none());
        assert!(start.elapsed() < Duration::from_secs(1));
    }

    /// Something that takes the connection and then never reads: the run gives it up, and the file is whole.
    #[test]
    fn a_viewer_that_takes_nothing_is_given_up() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run.rrd");
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let start = Instant::now();
        let live = Live::connect_with(address, 10, Duration::from_millis(200)).unwrap();
        let mut stream = MessageStream::create(&path, "deaf-1", Some(live)).unwrap();
        for i in 0..500 {
            let text = re_sdk_types::archetypes::TextDocument::new(i.to_string());
            stream
                .fixed(entity(["text", &i.to_string()]), &text)
                .unwrap();
        }
        stream.finish().unwrap();
        assert!(stream.live().unwrap().gave_up());
        assert!(
            start.elapsed() < Duration::from_secs(5),
            "{:?}",
            start.elapsed()
        );
        let read = crate::readback::read(&path).unwrap();
        assert!(read.complete);
        assert_eq!(read.entities.len(), 500);
    }
}
