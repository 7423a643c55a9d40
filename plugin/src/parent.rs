//! Parts in processes of their own: a crash in one, or a step without an end, ends the run that it is in and nothing
//! else. A process runs one instance at a time, and is used again for the next one of the same file.

use crate::owned_process::{OwnedProcess, ended};
use crate::protocol::{
    BUILD, Body, DONE, DROP, LOAD, Message, NOT_KEPT, RESET, RESTORE, SNAPSHOT, STEP, receive,
};
use monorig_abi::{Aid, BROKEN, Estimated, Input, NominalVehicle, OK, Reason};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::params::Key;
use monorig_estimators::api::signals::{Command as Commanded, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Estimator, Real, Vehicle};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Refusal};
use monorig_sim::config::scenario::Settings;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::{self, BufReader, ErrorKind};
use std::net::Shutdown;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Time for an answer: to load a part, to build an instance, to make a step.
const LIMIT: Duration = Duration::from_secs(10);
/// Longest name of a file in a reason, characters: the rest of it must fit, too.
const LONGEST_NAME: usize = 40;

/// The processes of a program.
pub(crate) struct Host {
    /// The program that serves parts, and its arguments.
    program: Vec<OsString>,
    idle: Mutex<BTreeMap<PathBuf, Vec<Process>>>,
    known: Mutex<BTreeMap<Part, Known>>,
}

/// Name and parameters of a part, known once it was loaded.
#[derive(Clone, Copy)]
struct Known {
    name: &'static str,
    groups: &'static [&'static [Key]],
}

/// A part that a scenario names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Part {
    path: PathBuf,
    /// The keys of the scenario beside its parameters, as JSON.
    settings: String,
}

impl Part {
    fn put<'a>(&self, message: &'a mut Message) -> &'a mut Message {
        message.bytes(self.path.as_os_str().as_bytes());
        message.text(&self.settings)
    }

    /// Its file, as reasons name it.
    fn at(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        name.to_string_lossy().chars().take(LONGEST_NAME).collect()
    }

    fn refused(&self, why: &str, during: &str) -> Refusal {
        let help = "a part that works: `--in-process` runs it inside of the program, for a debugger or a sanitizer";
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

    /// The estimator that the settings name in a file.
    pub fn estimator(
        self: &Arc<Self>,
        path: &Path,
        settings: &Settings,
    ) -> Result<EstimatorType, Refusal> {
        let mut settings = settings.clone();
        settings.values.clear();
        settings.from = None;
        let part = Part {
            path: path.into(),
            // texts and numbers: nothing in it can fail to serialise
            settings: serde_json::to_string(&settings).unwrap_or_default(),
        };
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let Known { name, groups } = match known.get(&part) {
            Some(known) => *known,
            None => {
                let described = self.describe(&part)?;
                known.insert(part.clone(), described);
                described
            }
        };
        let host = self.clone();
        let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
            let built = Remote::build(&host, &part, vehicle, settings)?;
            Ok(Box::new(built) as BoxedEstimator)
        };
        Ok(EstimatorType::new(name, groups, build))
    }

    fn describe(&self, part: &Part) -> Result<Known, Refusal> {
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
    fn process(&self, part: &Part) -> Result<Process, Refusal> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(process) = idle.get_mut(&part.path).and_then(Vec::pop) {
            return Ok(process);
        }
        drop(idle);
        Process::start(&self.program).map_err(|e| {
            let path = part.path.display();
            Refusal::new(
                format!("no process can be started to run {path}: {e}"),
                "more processes (`ulimit -u`) and memory, or `--in-process`",
            )
        })
    }

    fn give_back(&self, part: &Part, process: Process) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.entry(part.path.clone()).or_default().push(process);
    }
}

/// A process, and the way to it.
struct Process {
    child: OwnedProcess,
    to: UnixStream,
    from: BufReader<UnixStream>,
    message: Message,
    body: Vec<u8>,
    /// Why it answers no more.
    lost: Option<String>,
}

impl Process {
    fn start(program: &[OsString]) -> io::Result<Self> {
        let (ours, theirs) = UnixStream::pair()?;
        ours.set_read_timeout(Some(LIMIT))?;
        ours.set_write_timeout(Some(LIMIT))?;
        let (name, arguments) = program.split_first().ok_or(ErrorKind::NotFound)?;
        let mut command = Command::new(name);
        command.args(arguments).stdin(OwnedFd::from(theirs));
        // what a part prints is no result of the program
        command.stdout(io::stderr().as_fd().try_clone_to_owned()?);
        let child = OwnedProcess::start(&mut command)?;
        Ok(Self {
            child,
            to: ours.try_clone()?,
            from: BufReader::new(ours),
            message: Message::default(),
            body: Vec::new(),
            lost: None,
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

    /// The same for what can be refused in words.
    fn ask_or(&mut self, part: &Part, during: &str) -> Result<(), Refusal> {
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

    /// Ends the process, and says why it is of no use any more.
    fn lose(&mut self, e: &io::Error) -> String {
        let why = match e.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => {
                self.child.kill();
                format!("gives no answer within {} s", LIMIT.as_secs())
            }
            ErrorKind::InvalidData => {
                self.child.kill();
                "spoils the standard input of its process".to_owned()
            }
            _ => match self.end() {
                Some(status) => ended(status),
                None => "closes the standard input of its process".to_owned(),
            },
        };
        self.lost = Some(why.clone());
        why
    }

    /// Waits until it ends by itself; kills it if it does not, and then there is no status.
    fn end(&mut self) -> Option<ExitStatus> {
        // an error says that the other end is closed already
        let _ = self.to.shutdown(Shutdown::Both);
        self.child.end()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // its process ends once nothing more can be asked of it
        let _ = self.to.shutdown(Shutdown::Both);
    }
}

/// An estimator that runs in a process of its own.
struct Remote {
    host: Arc<Host>,
    part: Part,
    /// None after it was given back.
    process: RefCell<Option<Process>>,
    input: Box<Input>,
    drives: usize,
    internals: Vec<Internal>,
    aids: Vec<&'static str>,
    values: Vec<f64>,
    status: Vec<AidStatus>,
}

impl Remote {
    fn build(
        host: &Arc<Host>,
        part: &Part,
        vehicle: &Vehicle,
        settings: NamedSettings<'_>,
    ) -> Result<Self, Refusal> {
        let mut process = host.process(part)?;
        let message = part.put(process.message.begin(BUILD));
        message.put(&[NominalVehicle::from(vehicle)]);
        for (name, value) in settings {
            message.setting(name, *value);
        }
        if let Err(refused) = process.ask_or(part, "while it is built") {
            if process.lost.is_none() {
                host.give_back(part, process);
            }
            return Err(refused);
        }
        let mut built = Self {
            host: host.clone(),
            part: part.clone(),
            process: RefCell::default(),
            input: Box::default(),
            drives: vehicle.drives,
            internals: Vec::new(),
            aids: Vec::new(),
            values: Vec::new(),
            status: Vec::new(),
        };
        let read = process.read(|mut answer| {
            let (internals, aids) = (answer.take::<u64>()?, answer.take::<u64>()?);
            for _ in 0..internals {
                let internal = Internal::new(answer.kept()?, answer.kept()?);
                built.internals.push(internal);
                built.values.push(f64::NAN);
            }
            for _ in 0..aids {
                built.aids.push(answer.kept()?);
                built.status.push(AidStatus::default());
            }
            built.state(answer)
        });
        read.map_err(|why| part.refused(&why, "while it is built"))?;
        built.process.replace(Some(process));
        Ok(built)
    }

    /// Takes a state over. Returns its code, reason and estimate.
    fn state(&mut self, mut answer: Body<'_>) -> io::Result<(i32, Reason, Estimated)> {
        let code = answer.take::<u64>()? as i32;
        let (reason, estimated) = (answer.take()?, answer.take()?);
        for value in &mut self.values {
            *value = answer.take()?;
        }
        for status in &mut self.status {
            *status = AidStatus::from(&answer.take::<Aid>()?);
        }
        Ok((code, reason, estimated))
    }

    /// Asks for what is answered by a state.
    fn ask(&mut self, put: impl FnOnce(&mut Message)) -> Result<(i32, Reason, Estimated), String> {
        let mut process = self.process.take().ok_or_else(String::new)?;
        put(&mut process.message);
        let asked = process.ask();
        let read = asked.and_then(|_| process.read(|answer| self.state(answer)));
        self.process.replace(Some(process));
        read.map_err(|why| format!("{} {why}", self.part.at()))
    }
}

impl Drop for Remote {
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

impl Estimator for Remote {
    fn step(&mut self, z: &Measurements, u: &Commanded, dt: Real) -> Result<Estimate, Error> {
        self.input.fill(z, u, dt, self.drives);
        let input = *self.input;
        let stepped = self.ask(|message| {
            message.begin(STEP).put(&[input]);
        });
        match stepped {
            Ok((OK, _, estimated)) => Ok(Estimate::from(&estimated)),
            Ok((BROKEN, reason, _)) => Err(Error::broken(reason.as_str())),
            Ok((_, reason, _)) => Err(Error::own(reason.as_str())),
            Err(why) => Err(Error::broken(why)),
        }
    }

    fn reset(&mut self) {
        // if the process is lost, the next step says so
        let _ = self.ask(|message| {
            message.begin(RESET);
        });
    }

    fn internals(&self) -> &[Internal] {
        &self.internals
    }

    fn internal_values(&self, values: &mut [Real]) {
        let both = values.iter_mut().zip(&self.values);
        both.for_each(|(to, from)| *to = *from);
    }

    fn aid_sources(&self) -> &[&'static str] {
        &self.aids
    }

    fn aid_status(&self, status: &mut [AidStatus]) {
        let both = status.iter_mut().zip(&self.status);
        both.for_each(|(to, from)| *to = *from);
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let mut process = self.process.borrow_mut();
        let process = process.as_mut().ok_or(SnapshotError::NotKept)?;
        process.message.begin(SNAPSHOT).put(&[bytes.len() as u64]);
        process.ask().map_err(|_| SnapshotError::NotKept)?;
        let read = process.read(|mut answer| {
            let (code, used) = (answer.take::<u64>()?, answer.take::<u64>()? as usize);
            if code == OK as u64 {
                let place = bytes.get_mut(..used).ok_or(ErrorKind::InvalidData)?;
                let taken = answer.0.get(..used).ok_or(ErrorKind::InvalidData)?;
                place.copy_from_slice(taken);
            }
            Ok((code, used))
        });
        match read {
            Ok((0, used)) => Ok(used),
            Ok((NOT_KEPT, _)) | Err(_) => Err(SnapshotError::NotKept),
            Ok((_, used)) => Err(SnapshotError::Room(used)),
        }
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        let restored = self.ask(|message| {
            message.begin(RESTORE).put(snapshot);
        });
        match restored {
            Ok((OK, ..)) => Ok(()),
            Ok((code, ..)) if code as u64 != NOT_KEPT => Err(SnapshotError::Corrupt),
            _ => Err(SnapshotError::NotKept),
        }
    }
}
