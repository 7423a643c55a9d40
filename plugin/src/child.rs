//! The process that runs a part: it does what it is asked over its standard input, a socket, until that is closed.

use crate::protocol::{
    BUILD, Body, DONE, DROP, LOAD, Message, NOT_KEPT, REFUSED, RESET, RESTORE, SNAPSHOT, STEP,
    receive,
};
use monorig_abi::{Aid, BROKEN, Estimated, Input, NominalVehicle, OK, REFUSED as NOT_DONE, Reason};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::signals::Estimate;
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Vehicle};
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, Refusal};
use monorig_sim::config::scenario::Settings;
use monorig_sim::guarded::guarded;
use std::ffi::OsStr;
use std::io::{BufReader, ErrorKind, Result};
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::parent_id;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// Time between two looks whether the program is still there.
const LOOKS: Duration = Duration::from_millis(500);

/// Runs parts for the program that has started this process, until it is asked for nothing more.
pub fn serve() -> ExitCode {
    // a part in an endless loop outlives the program otherwise
    let parent = parent_id();
    let watch = move || {
        while parent_id() == parent {
            std::thread::sleep(LOOKS);
        }
        end_at_once();
    };
    // without a thread for it, the end of the socket alone ends this process
    let _ = std::thread::Builder::new().spawn(watch);
    let socket = std::io::stdin().as_fd().try_clone_to_owned();
    let served = socket.and_then(|socket| answer(UnixStream::from(socket)));
    match served.map_err(|e| e.kind()) {
        Err(ErrorKind::UnexpectedEof) => ExitCode::SUCCESS,
        _ => ExitCode::from(2),
    }
}

/// Ends the process without the exit handlers of libraries, which may hang as their code does.
fn end_at_once() -> ! {
    unsafe extern "C" {
        fn _exit(code: i32) -> !;
    }
    // SAFETY: the function of POSIX, which can be called at any time.
    unsafe { _exit(2) }
}

fn answer(mut socket: UnixStream) -> Result<()> {
    let mut from = BufReader::new(socket.try_clone()?);
    let (mut body, mut message) = (Vec::new(), Message::default());
    let mut instance = None;
    loop {
        let what = receive(&mut from, &mut body)?;
        let asked = Body(&body);
        match (what, &mut instance) {
            (LOAD, _) => describe(asked, &mut message)?,
            (BUILD, place) => *place = build(asked, &mut message)?,
            (STEP, Some(instance)) => instance.step(asked, &mut message)?,
            (RESET, Some(instance)) => instance.reset(&mut message),
            (SNAPSHOT, Some(instance)) => instance.snapshot(asked, &mut message)?,
            (RESTORE, Some(instance)) => instance.restore(asked, &mut message),
            (DROP, place) => {
                *place = None;
                message.begin(DONE);
            }
            _ => return Err(ErrorKind::InvalidData.into()),
        }
        message.send(&mut socket)?;
    }
}

/// The part that is named at the beginning of a message.
fn part(asked: &mut Body<'_>) -> Result<std::result::Result<EstimatorType, Refusal>> {
    let path = Path::new(OsStr::from_bytes(asked.bytes()?));
    let settings: Settings = serde_json::from_str(asked.text()?)?;
    Ok(crate::load(path, &settings))
}

fn refuse(refusal: &Refusal, message: &mut Message) {
    let message = message.begin(REFUSED);
    message.text(&refusal.message).text(&refusal.help);
}

fn describe(mut asked: Body<'_>, message: &mut Message) -> Result<()> {
    match part(&mut asked)? {
        Ok(of_type) => {
            message.begin(DONE).text(of_type.name());
            for key in of_type.keys() {
                message.key(key);
            }
        }
        Err(refusal) => refuse(&refusal, message),
    }
    Ok(())
}

/// An estimator that is run.
struct Instance {
    estimator: BoxedEstimator,
    drives: usize,
    values: Vec<f64>,
    status: Vec<AidStatus>,
    last: Estimate,
}

fn build(mut asked: Body<'_>, message: &mut Message) -> Result<Option<Instance>> {
    let of_type = part(&mut asked)?;
    let vehicle: NominalVehicle = asked.take()?;
    let settings = asked.all(Body::setting)?;
    let built = of_type.and_then(|of_type| {
        let vehicle = Vehicle::try_from(&vehicle)?;
        let built = guarded(|| of_type.build(&vehicle, &settings));
        let panicked = |told| Refusal::new(format!("it panicked: {told}"), "a part that does not");
        Ok((built.map_err(panicked)??, vehicle.drives))
    });
    let (estimator, drives) = match built {
        Ok(built) => built,
        Err(refusal) => {
            refuse(&refusal, message);
            return Ok(None);
        }
    };
    let mut instance = Instance {
        values: vec![f64::NAN; estimator.internals().len()],
        status: vec![AidStatus::default(); estimator.aid_sources().len()],
        last: Estimate::default(),
        estimator,
        drives,
    };
    message.begin(DONE);
    message.put(&[instance.values.len() as u64, instance.status.len() as u64]);
    for internal in instance.estimator.internals() {
        message.text(internal.name).text(internal.unit);
    }
    for source in instance.estimator.aid_sources() {
        message.text(source);
    }
    instance.state(OK, Reason::default(), message);
    Ok(Some(instance))
}

impl Instance {
    /// Appends code, reason, the last estimate, and what the estimator shows of itself.
    fn state(&mut self, code: i32, reason: Reason, message: &mut Message) {
        message.put(&[code as u64]).put(&[reason]);
        message.put(&[Estimated::from(&self.last)]);
        self.estimator.internal_values(&mut self.values);
        message.put(&self.values);
        self.estimator.aid_status(&mut self.status);
        self.status.iter().for_each(|status| {
            message.put(&[Aid::from(status)]);
        });
    }

    fn step(&mut self, mut asked: Body<'_>, message: &mut Message) -> Result<()> {
        let (z, u, dt) = asked.take::<Input>()?.read(self.drives);
        let (code, reason) = match guarded(|| self.estimator.step(&z, &u, dt)) {
            Ok(Ok(estimate)) => {
                self.last = estimate;
                (OK, Reason::default())
            }
            Ok(Err(Error::Broken(why))) => (BROKEN, Reason::of(why)),
            Ok(Err(why)) => (NOT_DONE, Reason::of(why)),
            Err(told) => (BROKEN, Reason::of(format_args!("it panicked: {told}"))),
        };
        self.state(code, reason, message.begin(DONE));
        Ok(())
    }

    fn reset(&mut self, message: &mut Message) {
        self.estimator.reset();
        self.state(OK, Reason::default(), message.begin(DONE));
    }

    fn snapshot(&mut self, mut asked: Body<'_>, message: &mut Message) -> Result<()> {
        let mut bytes = vec![0; usize::try_from(asked.take::<u64>()?).unwrap_or_default()];
        let (code, used) = match self.estimator.snapshot(&mut bytes) {
            Ok(used) => (OK as u64, used),
            Err(SnapshotError::Room(used)) => (NOT_DONE as u64, used),
            Err(_) => (NOT_KEPT, 0),
        };
        message.begin(DONE).put(&[code, used as u64]);
        if code == OK as u64 {
            message.put(bytes.get(..used).unwrap_or_default());
        }
        Ok(())
    }

    fn restore(&mut self, asked: Body<'_>, message: &mut Message) {
        let code = match self.estimator.restore(asked.0) {
            Ok(()) => OK,
            Err(SnapshotError::NotKept) => NOT_KEPT as i32,
            Err(_) => NOT_DONE,
        };
        self.state(code, Reason::default(), message.begin(DONE));
    }
}
