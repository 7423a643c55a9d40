//! A folder as a queue: the questions of a tuning run, answered by any process that sees the folder.
//!
//! | in the folder | what it is |
//! |---|---|
//! | `monorig-queue` | the mark of such a folder, locked while a search runs; without it nothing is removed |
//! | `search.json` | which study asks, made from and by what: workers with another refuse to work |
//! | `alive` | its time of change moves while the search runs |
//! | `open/` | questions nobody has taken: one parameter set over one run each |
//! | `taken/` | questions that are being worked on; their time of change moves while they are |
//! | `answers/` | answers |
//! | `finished` | the search is over |
//!
//! A question is taken by renaming it, which succeeds for one process only. One that nobody works on any more is
//! asked again; should both answer after all, both answers are the same bits. Clocks of machines are never compared:
//! a sign of life is a time that *moves*.

use crate::tuning::progress::Progress;
use crate::tuning::study::Stage;
use crate::tuning::study::Values;
use crate::tuning::trial_store::TrialsHeader;
use monorig_sim::config::file::{input_error, read_result};
use monorig_sim::error::Error;
use monorig_sim::record::whole;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// Name of the mark, and what is in it.
const MARK: &str = "monorig-queue";
const MARKED: &str = "Questions of `monorig tune --queue` and their answers. A new search removes those of an earlier one.\n";
/// The folders of a queue.
const PARTS: [&str; 3] = ["open", "taken", "answers"];
/// A search that is alive gives a sign of life within this time.
const ALIVE: Duration = Duration::from_secs(3);
/// Signs of life come this often.
pub(crate) const BEAT: Duration = Duration::from_secs(1);
/// A question without a sign of life for so long is asked again.
const LOST: Duration = Duration::from_secs(6);
/// Between looks into a folder.
pub(crate) const LOOK: Duration = Duration::from_millis(5);

/// A parameter set over one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Question {
    /// Stage of the study.
    pub(crate) stage: Stage,
    /// Number of the run within the stage, from 0.
    pub(crate) run: usize,
    /// The parameters.
    pub(crate) values: Values,
}

/// An answer. Numbers as their bits: JSON has no infinity.
#[derive(Debug, Serialize, Deserialize)]
struct Answer {
    bits: Option<Vec<u64>>,
    failed: Option<String>,
}

/// The folder.
#[derive(Clone, Debug)]
pub(crate) struct Queue {
    folder: PathBuf,
}

/// A question that this process has taken.
pub(crate) struct Taken {
    pub(crate) question: Question,
    id: String,
    place: PathBuf,
}

impl Queue {
    /// In this folder; nothing is made.
    pub(crate) fn at(folder: &Path) -> Self {
        Self {
            folder: folder.into(),
        }
    }

    fn place(&self, part: &str, name: &str) -> PathBuf {
        self.folder.join(part).join(name)
    }

    /// The search that asks here; none if there is none yet.
    pub(crate) fn search(&self) -> Result<Option<TrialsHeader>, Error> {
        let path = self.folder.join("search.json");
        if !path.exists() {
            return Ok(None);
        }
        let text = read_result(&path)?;
        let help = "a folder that only `monorig tune --queue` has written to";
        let wrong = |e: serde_json::Error| {
            input_error(
                &path,
                "",
                format!("this is no search of monorig's: {e}"),
                help,
            )
        };
        serde_json::from_str(&text).map(Some).map_err(wrong)
    }

    /// True after the end of the search.
    pub(crate) fn finished(&self) -> bool {
        self.folder.join("finished").exists()
    }

    /// When the search last gave a sign of life, by whatever clock.
    pub(crate) fn alive(&self) -> Option<SystemTime> {
        changed(&self.folder.join("alive"))
    }

    /// Waits until the folder's last search has shown that it is over: it said so, or it gives no sign of life. False
    /// if `progress` stopped the wait; a search that is alive is an error.
    fn is_silent(&self, progress: &dyn Progress) -> Result<bool, Error> {
        let (begun, last) = (Instant::now(), self.alive());
        while last.is_some() && !self.finished() && begun.elapsed() < ALIVE {
            if !progress.go_on() {
                return Ok(false);
            }
            if self.alive() != last {
                let help = "another folder, or wait for the other search";
                return Err(input_error(&self.folder, "", IN_USE, help));
            }
            std::thread::sleep(LOOK);
        }
        Ok(true)
    }

    /// Take a question; none if all are taken.
    pub(crate) fn take(&self) -> Result<Option<Taken>, Error> {
        for name in names(&self.folder.join("open"))? {
            let place = self.place("taken", &format!("{name}@{}", whole::unique()));
            if std::fs::rename(self.place("open", &name), &place).is_err() {
                continue; // another was faster
            }
            touch(&place);
            let Ok(text) = read_result(&place) else {
                continue; // taken for lost, and asked again
            };
            let Ok(question) = serde_json::from_str(&text) else {
                continue; // of another version; the header says so
            };
            let id = name;
            return Ok(Some(Taken {
                question,
                id,
                place,
            }));
        }
        Ok(None)
    }

    /// Answer a question.
    pub(crate) fn answer(
        &self,
        taken: &Taken,
        values: &Result<Vec<f64>, String>,
    ) -> Result<(), Error> {
        let answer = Answer {
            bits: values
                .as_ref()
                .ok()
                .map(|v| v.iter().map(|x| x.to_bits()).collect()),
            failed: values.as_ref().err().cloned(),
        };
        let text = serde_json::to_string(&answer).unwrap_or_default();
        whole::write(&self.place("answers", &taken.id), text.as_bytes())?;
        let _ = std::fs::remove_file(&taken.place);
        Ok(())
    }
}

impl Taken {
    /// Do `work` with a sign of life meanwhile.
    pub(crate) fn work<T>(&self, work: impl FnOnce() -> T) -> T {
        let (done, ended) = mpsc::channel::<()>();
        std::thread::scope(|scope| {
            // without a thread the question may be asked twice, which costs time and nothing else
            let _ = std::thread::Builder::new().spawn_scoped(scope, move || {
                while ended.recv_timeout(BEAT) == Err(mpsc::RecvTimeoutError::Timeout) {
                    touch(&self.place);
                }
            });
            let result = work();
            drop(done);
            result
        })
    }
}

/// The side that asks.
pub struct Asker<'a> {
    queue: Queue,
    asked: AtomicU64,
    beat: Option<(mpsc::Sender<()>, JoinHandle<()>)>,
    /// The mark; the lock on it ends with the search.
    _mark: File,
    /// Asked whether to go on while it waits for answers.
    progress: &'a dyn Progress,
}

impl<'a> Asker<'a> {
    /// Begin a search in a folder; questions and answers of an earlier one go. A folder with anything else in it, or
    /// with another search, is refused and left as it is. None if `progress` stopped it.
    pub(crate) fn new(
        folder: &Path,
        header: &TrialsHeader,
        progress: &'a dyn Progress,
    ) -> Result<Option<Self>, Error> {
        let queue = Queue::at(folder);
        let mark = mark(folder)?;
        if !queue.is_silent(progress)? {
            return Ok(None);
        }
        let _ = std::fs::remove_file(folder.join("search.json"));
        for part in PARTS {
            let part = folder.join(part);
            std::fs::create_dir_all(&part).map_err(|source| Error::Io {
                path: part.clone(),
                source,
            })?;
            for name in all_names(&part)?.iter().filter(|name| is_question(name)) {
                let _ = std::fs::remove_file(part.join(name));
            }
        }
        let _ = std::fs::remove_file(folder.join("finished"));
        let alive = folder.join("alive");
        whole::write(&alive, b"")?;
        let header = serde_json::to_string(header).unwrap_or_default();
        whole::write(&folder.join("search.json"), header.as_bytes())?;
        let (stop, stopped) = mpsc::channel::<()>();
        let beat = std::thread::Builder::new().spawn(move || {
            while stopped.recv_timeout(BEAT) == Err(mpsc::RecvTimeoutError::Timeout) {
                touch(&alive);
            }
        });
        Ok(Some(Self {
            queue,
            asked: AtomicU64::new(0),
            beat: beat.ok().map(|beat| (stop, beat)),
            _mark: mark,
            progress,
        }))
    }

    /// Ask, and wait for all answers; this process answers too, by `work` on `jobs` threads. An
    /// error if it is stopped meanwhile.
    pub(crate) fn ask(
        &self,
        questions: &[Question],
        jobs: usize,
        work: &(dyn Fn(&Question) -> Result<Vec<f64>, String> + Sync),
    ) -> Result<Vec<Result<Vec<f64>, String>>, Error> {
        let mut waiting: BTreeMap<String, usize> = BTreeMap::new();
        for (i, question) in questions.iter().enumerate() {
            // ids of one search never come again, and those of an earlier one are none of its
            let n = self.asked.fetch_add(1, Ordering::Relaxed);
            let id = format!("{n:012}-{}.json", whole::unique());
            let text = serde_json::to_string(question).unwrap_or_default();
            whole::write(&self.queue.place("open", &id), text.as_bytes())?;
            waiting.insert(id, i);
        }
        let mut answers: Vec<Option<Result<Vec<f64>, String>>> = vec![None; questions.len()];
        let (send, receive) = mpsc::channel();
        let over = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            let mut threads = 0;
            for _ in 0..jobs.max(1) {
                let (send, over) = (send.clone(), &over);
                let helper = move || {
                    while !over.load(Ordering::Relaxed) {
                        match self.queue.take() {
                            Ok(Some(taken)) => {
                                let values = taken.work(|| work(&taken.question));
                                let _ = std::fs::remove_file(&taken.place);
                                if send.send(Ok((taken.id.clone(), values))).is_err() {
                                    return;
                                }
                            }
                            Ok(None) => std::thread::sleep(LOOK),
                            Err(e) => {
                                let _ = send.send(Err(e));
                                return;
                            }
                        }
                    }
                };
                let spawned = std::thread::Builder::new().spawn_scoped(scope, helper);
                threads += usize::from(spawned.is_ok());
            }
            let mut seen: HashMap<String, (Option<SystemTime>, Instant)> = HashMap::new();
            let mut result = Ok(());
            while !waiting.is_empty() && result.is_ok() {
                if !self.progress.go_on() {
                    result = Err(self.interrupted());
                    continue;
                }
                match receive.recv_timeout(LOOK) {
                    Ok(Ok((id, values))) => {
                        if let Some(i) = waiting.remove(&id) {
                            answers[i] = Some(values);
                        }
                    }
                    Ok(Err(e)) => result = Err(e),
                    Err(_) => {
                        result = self
                            .collect(&mut waiting, &mut answers)
                            .and_then(|()| self.ask_again(&mut seen));
                        // no thread was to be had: then here
                        if threads == 0
                            && let Ok(Some(taken)) = self.queue.take()
                        {
                            let values = taken.work(|| work(&taken.question));
                            let _ = std::fs::remove_file(&taken.place);
                            let _ = send.send(Ok((taken.id, values)));
                        }
                    }
                }
            }
            over.store(true, Ordering::Relaxed);
            result
        })?;
        Ok(answers.into_iter().flatten().collect())
    }

    fn interrupted(&self) -> Error {
        Error::Io {
            path: self.queue.folder.clone(),
            source: std::io::ErrorKind::Interrupted.into(),
        }
    }

    /// Answers of others.
    fn collect(
        &self,
        waiting: &mut BTreeMap<String, usize>,
        answers: &mut [Option<Result<Vec<f64>, String>>],
    ) -> Result<(), Error> {
        for name in names(&self.queue.folder.join("answers"))? {
            let path = self.queue.place("answers", &name);
            let text = read_result(&path).unwrap_or_default();
            let answer: Option<Answer> = serde_json::from_str(&text).ok();
            let _ = std::fs::remove_file(&path);
            let Some(i) = waiting.get(&name) else {
                continue; // a second answer to a question that was asked again
            };
            let values = match answer {
                Some(Answer { bits: Some(b), .. }) => {
                    Ok(b.into_iter().map(f64::from_bits).collect())
                }
                Some(Answer {
                    failed: Some(e), ..
                }) => Err(e),
                _ => continue,
            };
            answers[*i] = Some(values);
            waiting.remove(&name);
        }
        Ok(())
    }

    /// Questions whose worker gives no sign of life go back.
    fn ask_again(
        &self,
        seen: &mut HashMap<String, (Option<SystemTime>, Instant)>,
    ) -> Result<(), Error> {
        let taken = self.queue.folder.join("taken");
        for name in all_names(&taken)? {
            let place = taken.join(&name);
            let now = changed(&place);
            let (last, since) = seen.entry(name.clone()).or_insert((now, Instant::now()));
            if *last != now {
                (*last, *since) = (now, Instant::now());
            } else if since.elapsed() > LOST {
                seen.remove(&name);
                if let Some((id, _)) = name.split_once('@') {
                    let _ = std::fs::rename(&place, self.queue.place("open", id));
                }
            }
        }
        Ok(())
    }
}

impl Drop for Asker<'_> {
    fn drop(&mut self) {
        let _ = whole::write(&self.queue.folder.join("finished"), b"");
        if let Some((stop, beat)) = self.beat.take() {
            drop(stop);
            let _ = beat.join();
        }
    }
}

/// The mark of a folder, locked. One that has no mark must be empty, or is made.
fn mark(folder: &Path) -> Result<File, Error> {
    let failed = |source| Error::Io {
        path: folder.into(),
        source,
    };
    let refused = |message: &str, help: &str| Err(input_error(folder, "", message, help));
    let path = folder.join(MARK);
    std::fs::create_dir_all(folder).map_err(failed)?;
    let is_file = |found: std::fs::Metadata| found.is_file();
    if !std::fs::symlink_metadata(&path).is_ok_and(is_file) {
        if std::fs::read_dir(folder).map_err(failed)?.next().is_some() {
            return refused(
                "there is something in this folder, and it is no queue of monorig's",
                "a folder that is empty or not there yet; nothing was changed in this one",
            );
        }
        whole::write(&path, MARKED.as_bytes())?;
    }
    let file = File::options()
        .read(true)
        .write(true)
        .open(&path)
        .map_err(failed)?;
    for part in PARTS {
        let part = folder.join(part);
        let there = std::fs::symlink_metadata(&part);
        if there.is_ok_and(|part| !part.is_dir()) {
            return refused(
                "a folder of this queue is a file or a link",
                "another folder",
            );
        }
        let others = all_names(&part).unwrap_or_default();
        if let Some(other) = others.iter().find(|name| !is_question(name)) {
            let message = format!("{} is no question of monorig's", part.join(other).display());
            return refused(&message, "another folder; nothing was changed in this one");
        }
    }
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => {
            refused(IN_USE, "another folder, or wait for the other search")
        }
        // a disk without locks: signs of life tell
        _ => Ok(file),
    }
}

const IN_USE: &str = "another search asks through this folder";

/// Accepts the names that questions and answers have: digits, what is unique to a process, and `.json`, with the worker
/// behind it where it is taken.
fn is_question(name: &str) -> bool {
    let (id, _) = name.split_once('@').unwrap_or((name, ""));
    let number = id.split('-').next().unwrap_or_default();
    let digits = number.len() >= 12 && number.bytes().all(|b| b.is_ascii_digit());
    digits && id.ends_with(".json")
}

/// Names of files that are whole, in order.
fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let mut names = all_names(folder)?;
    names.retain(|n| n.ends_with(".json"));
    Ok(names)
}

fn all_names(folder: &Path) -> Result<Vec<String>, Error> {
    let entries = std::fs::read_dir(folder).map_err(|source| Error::Io {
        path: folder.into(),
        source,
    })?;
    let names = entries.flatten().map(|e| e.file_name());
    let mut names: Vec<String> = names.filter_map(|n| n.into_string().ok()).collect();
    names.retain(|n| !n.starts_with('.'));
    names.sort_unstable();
    Ok(names)
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).ok()?.modified().ok()
}

/// A sign of life.
fn touch(path: &Path) {
    let file = File::options().write(true).open(path);
    let _ = file.and_then(|f| f.set_modified(SystemTime::now()));
}
