//! Estimators and controllers that run in their own processes.

use crate::parent::{Host, Known, Lent, NamedPart};
use crate::protocol::{
    Body, CONTROL, CONTROLLER, Commanded, ESTIMATOR, Message, NOT_KEPT, RESET, RESTORE, SNAPSHOT,
    STEP, Task,
};
use monorig_c::{Aid, BROKEN, Estimated, Input, OK, Reason};
use monorig_estimators::api::aid::AidStatus;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Estimator, Real, Vehicle};
use monorig_sim::closed_loop::registry::{
    BoxedController, BoxedEstimator, ControllerType, EstimatorType, NamedSettings, Refusal,
};
use monorig_sim::config::scenario::{ControllerSettings, Settings};
use monorig_sim::control::{Controller, ControllerSetup, Perception, Reference};
use std::cell::RefCell;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::Arc;

impl Host {
    /// The estimator that the settings name in a file.
    pub fn estimator(
        self: &Arc<Self>,
        path: &Path,
        settings: &Settings,
    ) -> Result<EstimatorType, Refusal> {
        let mut settings = settings.clone();
        settings.values.clear();
        settings.from = None;
        let part = NamedPart::new(ESTIMATOR, path, &settings);
        let Known { name, groups } = self.known(&part)?;
        let host = self.clone();
        let build = move |vehicle: &Vehicle, settings: NamedSettings<'_>| {
            let built = RemoteEstimator::build(&host, &part, vehicle, settings)?;
            Ok(Box::new(built) as BoxedEstimator)
        };
        Ok(EstimatorType::new(name, groups, build))
    }

    /// The controller that is in a file.
    pub fn controller(
        self: &Arc<Self>,
        path: &Path,
        settings: &ControllerSettings,
    ) -> Result<ControllerType, Refusal> {
        let mut settings = settings.clone();
        settings.values.clear();
        let part = NamedPart::new(CONTROLLER, path, &settings);
        let Known { name, groups } = self.known(&part)?;
        let host = self.clone();
        let build = move |vehicle: &Vehicle, _: &ControllerSetup, settings: NamedSettings<'_>| {
            let process = host.build(&part, vehicle, settings)?;
            Ok(Box::new(RemoteController::new(process)) as BoxedController)
        };
        Ok(ControllerType::new(name, groups, build))
    }
}

/// An estimator that runs in its own process.
pub(crate) struct RemoteEstimator {
    process: RefCell<Lent>,
    input: Box<Input>,
    drives: usize,
    internals: Vec<Internal>,
    aids: Vec<&'static str>,
    shown: Shown,
}

/// Numbers that an estimator shows of itself after a step.
#[derive(Default)]
struct Shown {
    values: Vec<f64>,
    status: Vec<AidStatus>,
}

impl Shown {
    /// Takes over a state. Returns its code, reason and estimate.
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
}

impl RemoteEstimator {
    pub fn build(
        host: &Arc<Host>,
        part: &NamedPart,
        vehicle: &Vehicle,
        settings: NamedSettings<'_>,
    ) -> Result<Self, Refusal> {
        let mut process = host.build(part, vehicle, settings)?;
        let (mut internals, mut aids) = (Vec::new(), Vec::new());
        let mut shown = Shown::default();
        process.built(|mut answer| {
            let counts: [u64; 2] = [answer.take()?, answer.take()?];
            for _ in 0..counts[0] {
                internals.push(Internal::new(answer.kept()?, answer.kept()?));
                shown.values.push(f64::NAN);
            }
            for _ in 0..counts[1] {
                aids.push(answer.kept()?);
                shown.status.push(AidStatus::default());
            }
            shown.state(answer)
        })?;
        Ok(Self {
            process: RefCell::new(process),
            input: Box::default(),
            drives: vehicle.drives,
            internals,
            aids,
            shown,
        })
    }

    /// Asks for what is answered by a state.
    fn ask(&mut self, put: impl FnOnce(&mut Message)) -> Result<(i32, Reason, Estimated), String> {
        let shown = &mut self.shown;
        self.process
            .get_mut()
            .ask(put, |answer| shown.state(answer))
    }
}

impl Estimator for RemoteEstimator {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
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
        let both = values.iter_mut().zip(&self.shown.values);
        both.for_each(|(to, from)| *to = *from);
    }

    fn aid_sources(&self) -> &[&'static str] {
        &self.aids
    }

    fn aid_status(&self, status: &mut [AidStatus]) {
        let both = status.iter_mut().zip(&self.shown.status);
        both.for_each(|(to, from)| *to = *from);
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let room = bytes.len() as u64;
        let put = |message: &mut Message| {
            message.begin(SNAPSHOT).put(&[room]);
        };
        let read = self.process.borrow_mut().ask(put, |mut answer| {
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

/// A controller that runs in its own process.
pub(crate) struct RemoteController {
    process: Lent,
    /// Reason why it cannot go on, if there is one.
    broken: Option<String>,
}

impl RemoteController {
    pub fn new(process: Lent) -> Self {
        Self {
            process,
            broken: None,
        }
    }
}

impl Controller for RemoteController {
    fn control(&mut self, r: &Reference, p: &Perception, dt_s: f64) -> Command {
        let task = Task::new(r, p, dt_s);
        let put = |message: &mut Message| {
            message.begin(CONTROL).put(&[task]);
        };
        let asked = self.process.ask(put, |mut answer| {
            let (code, reason) = (answer.take::<u64>()? as i32, answer.take::<Reason>()?);
            Ok((code, reason, answer.take::<Commanded>()?))
        });
        match asked {
            Ok((OK, _, commanded)) => Command::from(&commanded),
            Ok((_, reason, _)) => {
                self.broken = Some(reason.as_str().to_owned());
                r.command()
            }
            Err(why) => {
                self.broken = Some(why);
                r.command()
            }
        }
    }

    fn broken(&self) -> Option<&str> {
        self.broken.as_deref()
    }
}
