//! The process that runs a part: it does what it is asked over its standard input, a socket, until that is closed.

use crate::protocol::{
    BUILD, Body, CONTROL, CONTROLLER, Commanded, DONE, DROP, FOLDER, LOAD, Message, NOT_KEPT,
    REFUSED, RESET, RESTORE, SNAPSHOT, STEP, Task, receive,
};
use monorig_c::{Aid, BROKEN, Estimated, Input, NominalVehicle, OK, REFUSED as NOT_DONE, Reason};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::params::Key;
use monorig_estimators::api::signals::Estimate;
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Vehicle};
use monorig_sim::closed_loop::registry::{
    BoxedController, BoxedEstimator, ControllerType, EstimatorType, Refusal,
};
use monorig_sim::control::ControllerSetup;
use monorig_sim::guarded::guarded;
use std::ffi::OsStr;
use std::io::{BufReader, ErrorKind, Result};
use std::os::fd::AsFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::parent_id;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// Time between two checks that the program still runs.
const LOOKS: Duration = Duration::from_millis(500);

/// Runs parts for the program that has started this process, until the program ends the connection.
pub fn serve() -> ExitCode {
    let folder = std::env::var_os(FOLDER).map(PathBuf::from);
    if let Some(folder) = &folder {
        crate::fmu::unpack_in(folder.clone());
    }
    // the program removes it, too, unless it was killed; an error leaves files that the system removes one day
    let remove = move || drop(folder.as_ref().map(std::fs::remove_dir_all));
    // a part in an endless loop outlives the program otherwise
    let (parent, remove_late) = (parent_id(), remove.clone());
    let watch = move || {
        while parent_id() == parent {
            std::thread::sleep(LOOKS);
        }
        remove_late();
        end_at_once();
    };
    // without a thread for it, the end of the socket alone ends this process
    let _ = std::thread::Builder::new().spawn(watch);
    let socket = std::io::stdin().as_fd().try_clone_to_owned();
    let served = socket.and_then(|socket| answer(UnixStream::from(socket)));
    remove();
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
            (CONTROL, Some(Either::Controller(controller))) => {
                control(controller, asked, &mut message)?;
            }
            (DROP, place) => {
                *place = None;
                message.begin(DONE);
            }
            (what, Some(Either::Estimator(instance))) => match what {
                STEP => instance.step(asked, &mut message)?,
                RESET => instance.reset(&mut message),
                SNAPSHOT => instance.snapshot(asked, &mut message)?,
                RESTORE => instance.restore(asked, &mut message),
                _ => return Err(ErrorKind::InvalidData.into()),
            },
            _ => return Err(ErrorKind::InvalidData.into()),
        }
        message.send(&mut socket)?;
    }
}

/// An estimator or a controller.
enum Either<E, C> {
    Estimator(E),
    Controller(C),
}

/// The type of a part.
type PartType = Either<EstimatorType, ControllerType>;
/// A part that is run.
type ServedPart = Either<ServedEstimator, BoxedController>;

/// The part that is named at the beginning of a message.
fn part(asked: &mut Body<'_>) -> Result<std::result::Result<PartType, Refusal>> {
    let what = asked.take::<u64>()?;
    let path = Path::new(OsStr::from_bytes(asked.bytes()?));
    let settings = asked.text()?;
    Ok(match what {
        CONTROLLER => crate::load::load_controller(path, &serde_json::from_str(settings)?)
            .map(Either::Controller),
        _ => crate::load::load(path, &serde_json::from_str(settings)?).map(Either::Estimator),
    })
}

fn refuse(refusal: &Refusal, message: &mut Message) {
    let message = message.begin(REFUSED);
    message.text(&refusal.message).text(&refusal.help);
}

fn describe(mut asked: Body<'_>, message: &mut Message) -> Result<()> {
    let (name, keys): (String, Vec<&Key>) = match part(&mut asked)? {
        Ok(Either::Estimator(of_type)) => (of_type.name().into(), of_type.keys().collect()),
        Ok(Either::Controller(of_type)) => (of_type.name().into(), of_type.keys().collect()),
        Err(refusal) => {
            refuse(&refusal, message);
            return Ok(());
        }
    };
    message.begin(DONE).text(&name);
    for key in keys {
        message.key(key);
    }
    Ok(())
}

fn build(mut asked: Body<'_>, message: &mut Message) -> Result<Option<ServedPart>> {
    let of_type = part(&mut asked)?;
    let vehicle: NominalVehicle = asked.take()?;
    let settings = asked.all(Body::setting)?;
    let built = of_type.and_then(|of_type| {
        let vehicle = Vehicle::try_from(&vehicle)?;
        let build = || -> std::result::Result<ServedPart, Refusal> {
            Ok(match of_type {
                Either::Estimator(of_type) => {
                    let built = of_type.build(&vehicle, &settings)?;
                    Either::Estimator(ServedEstimator::new(built, vehicle.drives))
                }
                // an FMU has what it is built for among its parameters
                Either::Controller(of_type) => {
                    let setup = ControllerSetup::default();
                    Either::Controller(of_type.build(&vehicle, &setup, &settings)?)
                }
            })
        };
        let panicked =
            |told| Refusal::new(format!("it panicked: {told}"), "use a part that does not");
        guarded(build).map_err(panicked)?
    });
    match built {
        Ok(mut built) => {
            message.begin(DONE);
            if let Either::Estimator(instance) = &mut built {
                instance.describe(message);
            }
            Ok(Some(built))
        }
        Err(refusal) => {
            refuse(&refusal, message);
            Ok(None)
        }
    }
}

fn control(
    controller: &mut BoxedController,
    mut asked: Body<'_>,
    message: &mut Message,
) -> Result<()> {
    let (reference, perception, dt_s) = asked.take::<Task>()?.read();
    let made = guarded(|| controller.control(&reference, &perception, dt_s));
    let command = made.as_ref().copied().unwrap_or_default();
    let (code, reason) = match (&made, controller.broken()) {
        (Ok(_), None) => (OK, Reason::default()),
        (Ok(_), Some(why)) => (BROKEN, Reason::of(why)),
        (Err(told), _) => (BROKEN, Reason::of(format_args!("it panicked: {told}"))),
    };
    message.begin(DONE).put(&[code as u64]).put(&[reason]);
    message.put(&[Commanded::from(&command)]);
    Ok(())
}

/// An estimator that is run.
struct ServedEstimator {
    estimator: BoxedEstimator,
    drives: usize,
    values: Vec<f64>,
    status: Vec<AidStatus>,
    last: Estimate,
}

impl ServedEstimator {
    fn new(estimator: BoxedEstimator, drives: usize) -> Self {
        Self {
            values: vec![f64::NAN; estimator.internals().len()],
            status: vec![AidStatus::default(); estimator.aid_sources().len()],
            last: Estimate::default(),
            estimator,
            drives,
        }
    }

    /// Appends names of internals and sources, and the state.
    fn describe(&mut self, message: &mut Message) {
        message.put(&[self.values.len() as u64, self.status.len() as u64]);
        for internal in self.estimator.internals() {
            message.text(internal.name).text(internal.unit);
        }
        for source in self.estimator.aid_sources() {
            message.text(source);
        }
        self.state(OK, Reason::default(), message);
    }

    /// Appends code, reason, the last estimate, and the estimator's internals.
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
