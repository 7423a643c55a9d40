//! Parts in their own processes: a crash in one, or a step without an end, ends the run that it is in and nothing else.
//! A process runs one instance at a time, and is used again for the next one of the same file.

use crate::owned_process::{OwnedProcess, ended};
use crate::protocol::{BUILD, Body, DONE, DROP, FOLDER, LOAD, Message, receive};
use monorig_c::NominalVehicle;
use monorig_estimators::Vehicle;
use monorig_estimators::api::params::Key;
use monorig_sim::closed_loop::registry::{NamedSettings, Refusal};
use monorig_sim::interrupt;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::{self, BufReader, ErrorKind, Read};
use std::net::Shutdown;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Time for an answer: to load a part, to build an instance, to make a step.
const LIMIT: Duration = Duration::from_secs(10);
/// Time between two checks for the wish to end, and for an answer after it.
const LOOKS: Duration = Duration::from_millis(100);
const LAST_WORD: Duration = Duration::from_millis(500);
/// Longest name of a file in a reason, characters: the rest of it must fit, too.
const LONGEST_NAME: usize = 40;

/// The processes of a program.
pub(crate) struct Host {
    /// The program that serves parts, and its arguments.
    program: Vec<OsString>,
    idle: Mutex<BTreeMap<PathBuf, Vec<PartProcess>>>,
    known: Mutex<BTreeMap<NamedPart, Known>>,
}

/// Name and parameters of a part, known after loading.
#[derive(Clone, Copy)]
pub(crate) struct Known {
    pub name: &'static str,
    pub groups: &'static [&'static [Key]],
}

/// A part that a scenario names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NamedPart {
    /// Role of the part in the loop.
    what: u64,
    path: PathBuf,
    /// The keys of the scenario beside its parameters, as JSON.
    settings: String,
}

impl NamedPart {
    pub fn new(what: u64, path: &Path, settings: &impl Serialize) -> Self {
        Self {
            what,
            path: path.into(),
            // texts and numbers: nothing in it can fail to serialise
            settings: serde_json::to_string(settings).unwrap_or_default(),
        }
    }

    fn put<'a>(&self, message: &'a mut Message) -> &'a mut Message {
        message.put(&[self.what]);
        message.bytes(self.path.as_os_str().as_bytes());
        message.text(&self.settings)
    }

    /// Returns the file of the part for messages.
    fn at(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        name.to_string_lossy().chars().take(LONGEST_NAME).collect()
    }

    fn refused(&self, why: &str, during: &str) -> Refusal {
        let help = "repair the part: `--in-process` runs it inside the program, for a debugger or a sanitizer";
        Refusal::new(format!("{} {why} {during}", self.path.display()), help)
    }
}

impl Host {
    pub fn new(program: Vec<OsString>) -> Self {
        Self {
            program,
            idle: Mutex::default(),
            known: Mutex::default(),
        }
    }

    pub fn known(&self, part: &NamedPart) -> Result<Known, Refusal> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = known.get(part) {
            return Ok(*known);
        }
        let described = self.describe(part)?;
        known.insert(part.clone(), described);
        Ok(described)
    }

    /// Starts a process that runs an instance of a part; the description of the instance is its answer.
    pub fn build(
        self: &Arc<Self>,
        part: &NamedPart,
        vehicle: &Vehicle,
        settings: NamedSettings<'_>,
    ) -> Result<Lent, Refusal> {
        let mut process = self.process(part)?;
        let message = part.put(process.message.begin(BUILD));
        message.put(&[NominalVehicle::from(vehicle)]);
        for (name, value) in settings {
            message.setting(name, *value);
        }
        if let Err(refused) = process.ask_or(part, "while it is built") {
            if process.lost.is_none() {
                self.give_back(part, process);
            }
            return Err(refused);
        }
        Ok(Lent {
            host: self.clone(),
            part: part.clone(),
            process: Some(process),
        })
    }

    fn describe(&self, part: &NamedPart) -> Result<Known, Refusal> {
        let mut process = self.process(part)?;
        part.put(process.message.begin(LOAD));
        process.ask_or(part, "while it is loaded")?;
        let read = |mut answer: Body<'_>| {
            let name = answer.kept()?;
            let keys: &'static [Key] = answer.all(Body::key)?.leak();
            let groups: &'static [&'static [Key]] = vec![keys].leak();
            Ok(Known { name, groups })
        };
        let described = process.read(read);
        let described = described.map_err(|why| part.refused(&why, "while it is loaded"))?;
        self.give_back(part, process);
        Ok(described)
    }

    /// A process that does nothing, for this part.
    fn process(&self, part: &NamedPart) -> Result<PartProcess, Refusal> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(process) = idle.get_mut(&part.path).and_then(Vec::pop) {
            return Ok(process);
        }
        drop(idle);
        PartProcess::start(&self.program).map_err(|e| {
            let path = part.path.display();
            Refusal::new(
                format!("a process for {path} cannot be started: {e}"),
                "allow more processes (`ulimit -u`) and memory, or use `--in-process`",
            )
        })
    }

    fn give_back(&self, part: &NamedPart, process: PartProcess) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.entry(part.path.clone()).or_default().push(process);
    }
}

/// A process that runs an instance, given back at the end.
pub(crate) struct Lent {
    host: Arc<Host>,
    part: NamedPart,
    /// `None` after the process was given back.
    process: Option<PartProcess>,
}

impl Lent {
    /// Asks with the message that `put` puts together, and reads the answer. The error names the part and its fate.
    pub fn ask<T>(
        &mut self,
        put: impl FnOnce(&mut Message),
        read: impl FnOnce(Body<'_>) -> io::Result<T>,
    ) -> Result<T, String> {
        let process = self.process.as_mut().ok_or_else(String::new)?;
        put(&mut process.message);
        let asked = process.ask().and_then(|_| process.read(read));
        asked.map_err(|why| format!("{} {why}", self.part.at()))
    }

    /// Reads the description of the built instance.
    pub fn built<T>(&mut self, read: impl FnOnce(Body<'_>) -> io::Result<T>) -> Result<T, Refusal> {
        let process = self.process.as_mut().ok_or(ErrorKind::NotFound);
        let process =
            process.map_err(|e| self.part.refused(&e.to_string(), "while it is built"))?;
        let read = process.read(read);
        read.map_err(|why| self.part.refused(&why, "while it is built"))
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        let Some(mut process) = self.process.take() else {
            return;
        };
        process.message.begin(DROP);
        if process.ask().is_ok() {
            self.host.give_back(&self.part, process);
        }
    }
}

/// Answers of a process, with a time limit, which is short after the program was asked to end.
struct Answers(UnixStream);

impl Read for Answers {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let (begun, mut asked) = (Instant::now(), None);
        loop {
            let read = self.0.read(bytes);
            let waits = |e: &io::Error| e.kind() == ErrorKind::WouldBlock;
            if interrupt::requested() {
                asked.get_or_insert_with(Instant::now);
            }
            let over = asked.is_some_and(|at| at.elapsed() > LAST_WORD) || begun.elapsed() > LIMIT;
            if over || !read.as_ref().is_err_and(waits) {
                return read;
            }
        }
    }
}

/// A process, and the way to it.
struct PartProcess {
    child: OwnedProcess,
    to: UnixStream,
    from: BufReader<Answers>,
    message: Message,
    body: Vec<u8>,
    /// Reason why the process no longer answers.
    lost: Option<String>,
    /// Temporary files of the process, removed after its end.
    _folder: TempDir,
}

impl PartProcess {
    fn start(program: &[OsString]) -> io::Result<Self> {
        let (ours, theirs) = UnixStream::pair()?;
        ours.set_read_timeout(Some(LOOKS))?;
        ours.set_write_timeout(Some(LIMIT))?;
        let (name, arguments) = program.split_first().ok_or(ErrorKind::NotFound)?;
        let folder = tempfile::Builder::new()
            .prefix(crate::fmu::FOLDER)
            .tempdir()?;
        let mut command = Command::new(name);
        command.args(arguments).env(FOLDER, folder.path());
        command.stdin(OwnedFd::from(theirs));
        // what a part prints is no result of the program
        command.stdout(io::stderr().as_fd().try_clone_to_owned()?);
        let child = OwnedProcess::start(&mut command)?;
        Ok(Self {
            child,
            to: ours.try_clone()?,
            from: BufReader::new(Answers(ours)),
            message: Message::default(),
            body: Vec::new(),
            lost: None,
            _folder: folder,
        })
    }

    /// Sends the message that was put together, and waits for the answer. The error is why there is none.
    fn ask(&mut self) -> Result<u64, String> {
        if let Some(why) = &self.lost {
            return Err(why.clone());
        }
        let sent = self.message.send(&mut self.to);
        let answered = sent.and_then(|()| receive(&mut self.from, &mut self.body));
        answered.map_err(|e| self.lose(&e))
    }

    /// Asks the process for an action that it may refuse with a reason.
    fn ask_or(&mut self, part: &NamedPart, during: &str) -> Result<(), Refusal> {
        let what = self.ask().map_err(|why| part.refused(&why, during))?;
        if what == DONE {
            return Ok(());
        }
        let told = self.read(|mut answer| Ok(Refusal::new(answer.text()?, answer.text()?)));
        Err(told.unwrap_or_else(|why| part.refused(&why, during)))
    }

    /// Reads the answer.
    fn read<T>(&mut self, read: impl FnOnce(Body<'_>) -> io::Result<T>) -> Result<T, String> {
        read(Body(&self.body)).map_err(|e| self.lose(&e))
    }

    /// Ends the process, and returns the reason why it can no longer be used.
    fn lose(&mut self, e: &io::Error) -> String {
        let why = match e.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                self.child.kill();
                match interrupt::requested() {
                    true => "was interrupted".to_owned(),
                    false => format!("gives no answer within {} s", LIMIT.as_secs()),
                }
            }
            ErrorKind::InvalidData => {
                self.child.kill();
                "disturbs the standard input of its process".to_owned()
            }
            _ => match self.end() {
                Some(status) => ended(status),
                None => "closes the standard input of its process".to_owned(),
            },
        };
        self.lost = Some(why.clone());
        why
    }

    /// Waits until the process ends by itself; else kills it and returns no status.
    fn end(&mut self) -> Option<ExitStatus> {
        // an error says that the other end is closed already
        let _ = self.to.shutdown(Shutdown::Both);
        self.child.end()
    }
}

impl Drop for PartProcess {
    fn drop(&mut self) {
        // its process ends once nothing more can be asked of it
        let _ = self.to.shutdown(Shutdown::Both);
    }
}
