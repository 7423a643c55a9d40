//! A sink on its own thread, so that the run does not wait for the encoding of its columns.

use super::{Chunk, Layout, Sink};
use crate::error::Error;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Chunks on their way to the thread at most: one more, and the run waits.
const QUEUE: usize = 1;

/// Hands chunks to a sink on a thread of its own, in order: what the sink writes is the same. It begins on the caller's
/// thread.
///
/// An error of the sink is returned by the call after it, at last by [`Sink::finish`]. Dropped before that, the sink is
/// dropped too, and this waits until it is.
pub struct BackgroundSink<S> {
    /// Sink before its begin.
    sink: Option<S>,
    worker: Option<Worker>,
}

struct Worker {
    orders: SyncSender<Order>,
    thread: JoinHandle<Result<(), Error>>,
}

enum Order {
    Chunk(Chunk),
    Finish,
}

impl<S: Sink + Send + 'static> BackgroundSink<S> {
    /// Wraps this sink.
    pub fn new(sink: S) -> Self {
        Self {
            sink: Some(sink),
            worker: None,
        }
    }
}

impl<S> BackgroundSink<S> {
    fn order(&mut self, order: Order) -> Result<(), Error> {
        let sent = self.worker.as_ref().map(|w| w.orders.send(order).is_ok());
        match sent {
            Some(true) => Ok(()),
            // the thread has ended: its result is the reason
            _ => self.wait(),
        }
    }

    /// Wait for the thread. A panic in it goes on here.
    fn wait(&mut self) -> Result<(), Error> {
        let Some(Worker { orders, thread }) = self.worker.take() else {
            return Ok(());
        };
        drop(orders);
        thread.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl<S: Sink + Send + 'static> Sink for BackgroundSink<S> {
    fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
        let Some(mut sink) = self.sink.take() else {
            return Ok(());
        };
        sink.begin(layout)?;
        let (orders, received) = sync_channel(QUEUE);
        self.worker = Some(Worker {
            orders,
            thread: std::thread::spawn(move || work(sink, &received)),
        });
        Ok(())
    }

    fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
        self.order(Order::Chunk(chunk.clone()))
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.order(Order::Finish)?;
        self.wait()
    }
}

fn work(mut sink: impl Sink, orders: &Receiver<Order>) -> Result<(), Error> {
    for order in orders {
        match order {
            Order::Chunk(chunk) => sink.chunk(&chunk)?,
            Order::Finish => return sink.finish(),
        }
    }
    Ok(())
}

impl<S> Drop for BackgroundSink<S> {
    fn drop(&mut self) {
        // Not finished: an error or an interrupt. There is no one to return another one to.
        let _ = self.worker.take().map(|w| {
            drop(w.orders);
            w.thread.join()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::testing::{layout_of, sample_chunk, sample_train};
    use std::path::PathBuf;
    use std::sync::{Arc, Mutex};

    /// Notes what it is called with; the chunk at the place `fails_at` is an error.
    #[derive(Clone, Default)]
    struct Notes {
        calls: Arc<Mutex<Vec<String>>>,
        fails_at: Option<usize>,
    }

    impl Notes {
        fn note(&self, what: String) {
            self.calls.lock().unwrap().push(what);
        }
    }

    impl Sink for Notes {
        fn begin(&mut self, layout: &Layout<'_>) -> Result<(), Error> {
            self.note(format!("begin {}", layout.scenario));
            Ok(())
        }
        fn chunk(&mut self, chunk: &Chunk) -> Result<(), Error> {
            if self.fails_at == Some(self.calls.lock().unwrap().len() - 1) {
                let source = std::io::Error::other("disk full");
                let path = PathBuf::from("run");
                return Err(Error::Io { path, source });
            }
            self.note(format!("{:?}", chunk.values));
            Ok(())
        }
        fn finish(&mut self) -> Result<(), Error> {
            self.note("finish".into());
            Ok(())
        }
    }

    fn drive(mut sink: impl Sink, chunks: usize) -> Result<(), Error> {
        let train = sample_train();
        sink.begin(&layout_of(&[], &train))?;
        (0..chunks).try_for_each(|i| sink.chunk(&sample_chunk(3, i * 10, 10)))?;
        sink.finish()
    }

    #[test]
    fn the_sink_gets_the_same_calls_in_the_same_order() {
        let (here, there) = (Notes::default(), Notes::default());
        drive(here.clone(), 20).unwrap();
        drive(BackgroundSink::new(there.clone()), 20).unwrap();
        let calls = here.calls.lock().unwrap();
        assert_eq!(*calls, *there.calls.lock().unwrap());
        assert_eq!(calls.len(), 22);
    }

    /// Any chunk may fail, the last one too: then `finish` has the error.
    #[test]
    fn an_error_reaches_the_caller() {
        for fails_at in [0, 5, 19] {
            let sink = Notes {
                fails_at: Some(fails_at),
                ..Notes::default()
            };
            let error = drive(BackgroundSink::new(sink.clone()), 20).unwrap_err();
            assert!(error.to_string().contains("disk full"), "{error}");
            assert_eq!(sink.calls.lock().unwrap().len(), 1 + fails_at);
        }
    }

    #[test]
    fn dropped_before_the_end_it_is_dropped_with_all_chunks() {
        let notes = Notes::default();
        let train = sample_train();
        let mut sink = BackgroundSink::new(notes.clone());
        sink.begin(&layout_of(&[], &train)).unwrap();
        for i in 0..5 {
            sink.chunk(&sample_chunk(3, i * 10, 10)).unwrap();
        }
        drop(sink);
        assert_eq!(notes.calls.lock().unwrap().len(), 6);
        assert_eq!(Arc::strong_count(&notes.calls), 1);
    }
}
