//! The side of a tuning run that answers: a process that works on the questions in a folder until the search is over.

use crate::replay::cache::Cache;
use crate::tuning::evaluate::Evaluator;
use crate::tuning::queue::{LOOK, Queue};
use crate::tuning::study::TuningStudy;
use crate::tuning::trial_store::TrialsHeader;
use monorig_sim::config::file::input_error;
use monorig_sim::error::Error;
use monorig_sim::record::identity::Identity;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A worker waits so long for a search to begin, or for one that has gone silent.
const PATIENCE: Duration = Duration::from_secs(600);

/// Study, folders and threads of a worker.
pub struct Worker<'a> {
    /// The study, as this process has read it.
    pub study: &'a TuningStudy,
    /// Folder of the queue.
    pub folder: &'a Path,
    /// Folder of the recordings.
    pub cache: PathBuf,
    /// Threads.
    pub jobs: usize,
    /// This program.
    pub monorig: Identity,
}

impl Worker<'_> {
    /// Answer until the search is over, or `go_on` ends it. How many questions were answered.
    pub fn run(&self, go_on: &(dyn Fn() -> bool + Sync)) -> Result<u64, Error> {
        let queue = Queue::at(self.folder);
        if !self.admitted(&queue, go_on)? {
            return Ok(0);
        }
        let cache = Cache::new(&self.cache, &self.monorig);
        let evaluator = Evaluator::of_worker(self.study, &cache);
        let answered = AtomicU64::new(0);
        let error: Mutex<Option<Error>> = Mutex::new(None);
        let failed = || {
            error
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .is_some()
        };
        let one = || {
            let mut silence = Silence::new(&queue);
            while go_on() && !queue.finished() && !failed() {
                let step = queue.take().and_then(|taken| match taken {
                    None => silence.check(&queue, self.folder),
                    Some(taken) => {
                        let values = taken.work(|| evaluator.answer(&taken.question, go_on));
                        if !go_on() {
                            return Ok(()); // what it has taken is asked again
                        }
                        queue.answer(&taken, &values?)?;
                        answered.fetch_add(1, Ordering::Relaxed);
                        Ok(())
                    }
                });
                if let Err(e) = step {
                    // a search that ends takes its folders away
                    if !queue.finished() {
                        *error.lock().unwrap_or_else(PoisonError::into_inner) = Some(e);
                    }
                    return;
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.jobs {
                let _ = std::thread::Builder::new().spawn_scoped(scope, one);
            }
            one();
        });
        match error.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(e) => Err(e),
            None => Ok(answered.into_inner()),
        }
    }

    /// Wait for the search to begin, and see that it is that of this study. False if it ended before it began here.
    fn admitted(&self, queue: &Queue, go_on: &dyn Fn() -> bool) -> Result<bool, Error> {
        let begun = Instant::now();
        let asked = loop {
            if !go_on() || queue.finished() {
                return Ok(false);
            }
            if let Some(asked) = queue.search()? {
                break asked;
            }
            if begun.elapsed() > PATIENCE {
                return Err(silent(self.folder));
            }
            std::thread::sleep(LOOK);
        };
        let here = TrialsHeader {
            study: self.study.name.clone(),
            made_from: self.study.made_from(&self.monorig),
        };
        if asked == here {
            return Ok(true);
        }
        let what = match asked.made_from.differs(&here.made_from) {
            Some(what) => format!("the search here is made from something else: {what}"),
            None => format!("the search here is of {}", asked.study),
        };
        let help = "the same program and files on all machines";
        Err(input_error(
            &self.folder.join("search.json"),
            "",
            what,
            help,
        ))
    }
}

/// Watches for signs of life of the search while there is nothing to do.
struct Silence {
    last: Option<std::time::SystemTime>,
    since: Instant,
}

impl Silence {
    fn new(queue: &Queue) -> Self {
        Self {
            last: queue.alive(),
            since: Instant::now(),
        }
    }

    fn check(&mut self, queue: &Queue, folder: &Path) -> Result<(), Error> {
        let now = queue.alive();
        if now != self.last {
            (self.last, self.since) = (now, Instant::now());
        } else if self.since.elapsed() > PATIENCE {
            return Err(silent(folder));
        }
        std::thread::sleep(LOOK);
        Ok(())
    }
}

fn silent(folder: &Path) -> Error {
    let message = format!(
        "no search has given a sign of life for {} s",
        PATIENCE.as_secs()
    );
    input_error(
        folder,
        "",
        message,
        "start `monorig tune FILE --queue DIR` with this folder",
    )
}
