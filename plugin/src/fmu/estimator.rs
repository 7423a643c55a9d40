//! An FMU in a run.

use super::calls::{DISCARD, Instance, WARNING};
use super::description::{Kind, Variable};
use super::package::Fmu;
use super::ports::{self, Ports};
use crate::foreign::checked;
use crate::signals::STAMPED;
use monorig_estimators::api::params::{Key, KeyKind, Setting};
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::api::snapshot::SnapshotError;
use monorig_estimators::{Error, Estimator, Real, Vehicle};
use monorig_sim::closed_loop::interned;
use monorig_sim::closed_loop::registry::{BoxedEstimator, EstimatorType, NamedSettings, Refusal};
use monorig_sim::config::scenario::Settings;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

/// Names that scenarios use themselves, or the host sets.
const NOT_OFFERED: [&str; 6] = ["is", "from", "library", "fmu", "map", STAMPED];

/// The estimator that an FMU is, with the names that the settings map.
pub(crate) fn estimator_of(path: &Path, settings: &Settings) -> Result<EstimatorType, Refusal> {
    let fmu = Fmu::load(path)?;
    if let Some(is) = &settings.is {
        return Err(Refusal::new(
            format!("{} is one estimator, and `is` names `{is}` in it", fmu.at),
            "`fmu` without `is`",
        ));
    }
    // what `map` has wrong is told before anything is built
    ports::find(&fmu.at, &fmu.description, settings)?;
    let settings = settings.clone();
    let groups = parameters(fmu, path, &settings);
    let name = fmu.description.identifier.clone();
    let build = move |_: &Vehicle, set: NamedSettings<'_>| {
        Ok(Box::new(Running::build(fmu, &settings, set)?) as BoxedEstimator)
    };
    Ok(EstimatorType::new(&name, groups, build))
}

/// A parameter of an FMU as ours are; none of a kind that a scenario cannot set.
fn key(v: &Variable) -> Option<Key> {
    let start = v.start.as_deref().unwrap_or_default();
    let kind = match v.kind {
        Kind::Real | Kind::Integer => KeyKind::Number {
            unit: interned(v.unit.as_deref().unwrap_or("-")),
            default: start.parse::<f64>().ok().filter(|x| !x.is_nan()),
            range: [
                v.range[0].unwrap_or(f64::NEG_INFINITY),
                v.range[1].unwrap_or(f64::INFINITY),
            ],
        },
        Kind::Boolean => KeyKind::Flag {
            default: matches!(start, "true" | "1"),
        },
        Kind::Word => {
            let words = v.words.iter().map(|(word, _)| interned(word));
            let words: &'static [&'static str] = words.collect::<Vec<_>>().leak();
            let number = start.parse::<i64>().ok();
            let first = v.words.iter().position(|(_, n)| Some(*n) == number);
            KeyKind::Choice {
                default: words.get(first.unwrap_or(0))?,
                choices: words,
            }
        }
        Kind::Other => return None,
    };
    Some(Key {
        name: interned(&v.name),
        doc: interned(&v.about),
        kind,
    })
}

/// Parameters of an FMU that a scenario can set, in groups.
type Groups = &'static [&'static [Key]];

/// The parameters of an FMU, and its inputs that nothing of ours feeds.
fn parameters(fmu: &Fmu, path: &Path, settings: &Settings) -> Groups {
    /// Kept once for each FMU and map: they live as long as the program.
    static KNOWN: Mutex<BTreeMap<(PathBuf, String), Groups>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let of = (path.to_owned(), format!("{:?}", settings.map));
    known.entry(of).or_insert_with(|| {
        let all = fmu.description.variables.iter();
        let all = all.filter(|v| v.causality == "parameter");
        let all = all.chain(ports::unconnected(&fmu.description, settings));
        let offered = all.filter(|v| !NOT_OFFERED.contains(&v.name.as_str()));
        let keys: Vec<Key> = offered.filter_map(key).collect();
        vec![&*keys.leak()].leak()
    })
}

/// Gives back the one instance that there may be.
struct InUse(&'static Fmu);

impl Drop for InUse {
    fn drop(&mut self) {
        if let Some(in_use) = &self.0.in_use {
            in_use.store(false, Ordering::Release);
        }
    }
}

/// Value of a parameter.
#[derive(Clone, Copy)]
enum SetTo {
    Real(f64),
    Integer(i64),
    Flag(bool),
    Word(i64),
}

/// An instance of an FMU in a run.
struct Running {
    instance: Instance,
    ports: Ports,
    /// Parameters that are set, by their references.
    set: Vec<(u32, SetTo)>,
    /// Inputs of a step: references and values of those that are new.
    references: Vec<u32>,
    values: Vec<f64>,
    /// Outputs of a step.
    numbers: Vec<f64>,
    flags: Vec<bool>,
    /// The step of an FMU that takes no other, s; its start, s; steps made since.
    fixed_step_s: Option<f64>,
    began_s: Option<f64>,
    made: u64,
    last: Estimate,
    /// Why it cannot go on, if it cannot.
    broken: Option<String>,
    /// Dropped after the instance.
    _in_use: InUse,
}

/// The value of a parameter for the FMU.
fn set_to(v: &Variable, setting: Setting<'_>) -> Option<SetTo> {
    Some(match (v.kind, setting) {
        (Kind::Real, Setting::Number(x)) => SetTo::Real(x),
        // whole numbers up to this are exact
        (Kind::Integer, Setting::Number(x)) if x == x.trunc() && x.abs() < 9e15 => {
            SetTo::Integer(x as i64)
        }
        (Kind::Boolean, Setting::Flag(flag)) => SetTo::Flag(flag),
        (Kind::Word, Setting::Choice(word)) => {
            SetTo::Word(v.words.iter().find(|(name, _)| name == word)?.1)
        }
        _ => return None,
    })
}

impl Running {
    /// Makes an instance; the settings are checked by the registry.
    fn build(
        fmu: &'static Fmu,
        settings: &Settings,
        named: NamedSettings<'_>,
    ) -> Result<Self, Refusal> {
        let description = &fmu.description;
        let open = ports::unconnected(description, settings);
        let open = open
            .into_iter()
            .find(|v| !named.iter().any(|(key, _)| *key == v.name));
        if let Some(v) = open {
            let name = &v.name;
            return Err(Refusal::new(
                format!(
                    "{}: its input `{name}` is none of ours, and nothing is connected to it",
                    fmu.at
                ),
                format!(
                    "`map: {{wheel_speed[1]: {name}}}` or the like; `{name}: 0` among the parameters holds it there"
                ),
            ));
        }
        let mut set = Vec::new();
        for (key, setting) in named {
            let Some(v) = description.variables.iter().find(|v| v.name == *key) else {
                continue;
            };
            let value = set_to(v, *setting).ok_or_else(|| {
                let message = format!("{}: `{key}` cannot be {setting}", fmu.at);
                Refusal::new(message, "a whole number")
            })?;
            set.push((v.reference, value));
        }
        let taken = fmu.in_use.as_ref().map(|u| u.swap(true, Ordering::AcqRel));
        if taken == Some(true) {
            return Err(Refusal::new(
                format!(
                    "{} can have one instance at a time (canBeInstantiatedOnlyOncePerProcess)",
                    fmu.at
                ),
                "one estimator of it in a scenario, and one run at a time (`--jobs 1`)",
            ));
        }
        let in_use = InUse(fmu);
        let ports = ports::find(&fmu.at, description, settings)?;
        if let Some(stamped) = ports.stamped {
            set.push((stamped, SetTo::Flag(true)));
        }
        let mut running = Self {
            instance: Instance::new(fmu)?,
            set,
            references: Vec::with_capacity(ports.inputs.len()),
            values: Vec::with_capacity(ports.inputs.len()),
            numbers: vec![0.0; ports.numbers.len()],
            flags: vec![false; ports.flags.len()],
            fixed_step_s: description.fixed_step_s,
            began_s: None,
            made: 0,
            last: ports.start,
            broken: None,
            ports,
            _in_use: in_use,
        };
        running.begin().map_err(|why| {
            Refusal::new(
                format!("{} cannot be initialized: {why}", fmu.at),
                "a vehicle and parameters that this FMU can be initialized with",
            )
        })?;
        Ok(running)
    }

    /// Sets the parameters and initializes.
    fn begin(&mut self) -> Result<(), String> {
        let instance = &mut self.instance;
        for (reference, value) in &self.set {
            let code = match *value {
                SetTo::Real(x) => instance.set_reals(&[*reference], &[x]),
                SetTo::Integer(x) => instance.set_integer(*reference, x, false),
                SetTo::Word(x) => instance.set_integer(*reference, x, true),
                SetTo::Flag(flag) => instance.set_boolean(*reference, flag),
            };
            if code > WARNING {
                return Err(instance.told());
            }
        }
        match instance.initialize() > WARNING {
            true => Err(instance.told()),
            false => Ok(()),
        }
    }

    /// Steps up to now. A fixed step is made as often as it fits.
    fn advance(&mut self, now_s: f64, dt_s: f64) -> i32 {
        let Some(step_s) = self.fixed_step_s else {
            return self.instance.step(now_s - dt_s, dt_s);
        };
        let began_s = *self.began_s.get_or_insert(now_s - dt_s);
        let mut worst = 0;
        loop {
            let from_s = began_s + self.made as f64 * step_s;
            if from_s + step_s > now_s + 1e-6 * step_s || worst > WARNING {
                return worst;
            }
            worst = worst.max(self.instance.step(from_s, step_s));
            self.made += 1;
        }
    }
}

impl Estimator for Running {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        if let Some(why) = &self.broken {
            return Err(Error::broken(why));
        }
        self.references.clear();
        self.values.clear();
        for (reference, source) in &self.ports.inputs {
            if let Some(x) = source.value(z, u) {
                self.references.push(*reference);
                self.values.push(x);
            }
        }
        let set = self.instance.set_reals(&self.references, &self.values);
        let stepped = match set > WARNING {
            true => set,
            false => self.advance(z.t.s(), dt),
        };
        if stepped == DISCARD {
            return Err(Error::own(self.instance.told()));
        }
        let got = match stepped > WARNING {
            true => stepped,
            false => {
                let got = self.instance.reals(&self.ports.numbers, &mut self.numbers);
                got.max(self.instance.booleans(&self.ports.flags, &mut self.flags))
            }
        };
        if got > WARNING {
            let why = self.instance.told();
            let error = Error::broken(&why);
            self.broken = Some(why);
            return Err(error);
        }
        let flag = |place: usize| self.flags.get(place).copied().unwrap_or_default();
        if self.ports.refused.is_some_and(flag) {
            return Err(Error::own(self.instance.told()));
        }
        let e = &mut self.last;
        let numbers = self.ports.numbers_at.iter().zip(&self.numbers);
        numbers.for_each(|(put, x)| put(e, *x));
        let flags = self.ports.flags_at.iter().zip(&self.flags);
        flags.for_each(|(put, x)| put(e, *x));
        if self.ports.grade_is_effective {
            e.effective_grade_rad = e.grade_rad;
        }
        e.t = z.t;
        checked(*e)
    }

    fn reset(&mut self) {
        (self.began_s, self.made, self.last) = (None, 0, self.ports.start);
        let why = match self.instance.reset() > WARNING {
            true => Err(self.instance.told()),
            false => self.begin(),
        };
        self.broken = why.err();
    }

    fn snapshot(&self, bytes: &mut [u8]) -> Result<usize, SnapshotError> {
        let state = self.instance.save().ok_or(SnapshotError::NotKept)?;
        let room = bytes.get_mut(..state.len());
        room.ok_or(SnapshotError::Room(state.len()))?
            .copy_from_slice(&state);
        Ok(state.len())
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), SnapshotError> {
        match self.instance.restore(snapshot) {
            true => Ok(()),
            false => Err(SnapshotError::Corrupt),
        }
    }
}
