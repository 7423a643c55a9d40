//! An instance of an FMU in a run: its parameters, its steps.

use super::calls::Fmu;
use super::calls::{DISCARD, Instance, WARNING};
use super::description::{Kind, Port, Variable};
use super::ports::Map;
use crate::signals::STAMPED;
use monorig_estimators::Error;
use monorig_estimators::api::params::{Key, KeyKind, Setting};
use monorig_sim::closed_loop::interned;
use monorig_sim::closed_loop::registry::{NamedSettings, Refusal};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

/// Names that scenarios use themselves, or the host sets.
const NOT_OFFERED: [&str; 8] = [
    "is",
    "from",
    "library",
    "fmu",
    "map",
    "kind",
    "feedforward",
    STAMPED,
];

/// Converts a parameter of an FMU into our key; `None` for a kind that a scenario cannot set.
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

/// Returns the parameters of an FMU, and its inputs that are not connected to ours. `role` is what it is in the loop.
pub(crate) fn parameters(
    fmu: &Fmu,
    path: &Path,
    role: &str,
    map: &Map,
    open: &[&Variable],
) -> Groups {
    /// Kept once for each FMU, role and map: they live as long as the program.
    static KNOWN: Mutex<BTreeMap<(PathBuf, String), Groups>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    let of = (path.to_owned(), format!("{role} {map:?}"));
    known.entry(of).or_insert_with(|| {
        let all = fmu.description.variables.iter();
        let all = all.filter(|v| v.causality == "parameter");
        let all = all.chain(open.iter().copied());
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
pub(crate) enum SetTo {
    Number(f64),
    Flag(bool),
}

/// The value of a parameter for the FMU.
fn set_to(v: &Variable, setting: Setting<'_>) -> Option<SetTo> {
    Some(match (v.kind, setting) {
        (Kind::Real, Setting::Number(x)) => SetTo::Number(x),
        // whole numbers up to this are exact
        (Kind::Integer, Setting::Number(x)) if x == x.trunc() && x.abs() < 9e15 => SetTo::Number(x),
        (Kind::Boolean, Setting::Flag(flag)) => SetTo::Flag(flag),
        (Kind::Word, Setting::Choice(word)) => {
            SetTo::Number(v.words.iter().find(|(name, _)| name == word)?.1 as f64)
        }
        _ => return None,
    })
}

/// An instance of an FMU in a run.
pub(crate) struct RunningFmu {
    instance: Instance,
    /// Parameters that are set, by their references.
    set: Vec<(Port, SetTo)>,
    /// References of the outputs, and their values after the last step.
    outputs: (Vec<Port>, Vec<u32>),
    pub numbers: Vec<f64>,
    pub flags: Vec<bool>,
    /// Fixed step of an FMU, s; its start, s; number of steps since the start.
    fixed_step_s: Option<f64>,
    began_s: Option<f64>,
    made: u64,
    /// Reason why it cannot go on, if there is one.
    broken: Option<String>,
    /// Dropped after the instance.
    _in_use: InUse,
}

impl RunningFmu {
    /// Makes an instance; the settings are checked by the registry. `open` are the inputs that nothing of ours feeds,
    /// `like` is one of ours for messages, `outputs` the references of numbers and flags.
    pub fn build(
        fmu: &'static Fmu,
        named: NamedSettings<'_>,
        (open, like): (&[&Variable], &str),
        more: impl IntoIterator<Item = (Port, SetTo)>,
        outputs: (Vec<Port>, Vec<u32>),
    ) -> Result<Self, Refusal> {
        let description = &fmu.description;
        let given = |v: &Variable| named.iter().any(|(key, _)| *key == v.name);
        // an input that nothing feeds stays at its start, unless nothing is fed at all
        let inputs = description
            .variables
            .iter()
            .filter(|v| v.causality == "input");
        let fed = inputs.count() > open.len();
        let held = |v: &&&Variable| given(v) || fed && v.start.is_some();
        if let Some(v) = open.iter().find(|v| !held(v)) {
            let name = &v.name;
            let held = match v.kind {
                Kind::Other => "texts and arrays cannot have another fixed value".to_owned(),
                _ => format!("`{name}: 0` among the parameters gives the input a fixed value"),
            };
            return Err(Refusal::new(
                format!(
                    "{}: its input `{name}` is unknown and not connected",
                    fmu.at
                ),
                format!("use `map: {{{like}: {name}}}` or a similar entry; {held}"),
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
            set.push((v.port(), value));
        }
        set.extend(more);
        let taken = fmu.in_use.as_ref().map(|u| u.swap(true, Ordering::AcqRel));
        if taken == Some(true) {
            return Err(Refusal::new(
                format!(
                    "{} can have one instance at a time (canBeInstantiatedOnlyOncePerProcess)",
                    fmu.at
                ),
                "use it once in a scenario, and make one run at a time (`--jobs 1`)",
            ));
        }
        let in_use = InUse(fmu);
        let mut running = Self {
            instance: Instance::new(fmu)?,
            set,
            numbers: vec![0.0; outputs.0.len()],
            flags: vec![false; outputs.1.len()],
            outputs,
            fixed_step_s: description.fixed_step_s,
            began_s: None,
            made: 0,
            broken: None,
            _in_use: in_use,
        };
        running.begin().map_err(|why| {
            Refusal::new(
                format!("{} cannot be initialized: {why}", fmu.at),
                "use a vehicle and parameters with which this FMU can be initialized",
            )
        })?;
        Ok(running)
    }

    /// Sets the parameters and initializes.
    fn begin(&mut self) -> Result<(), String> {
        let instance = &mut self.instance;
        for (port, value) in &self.set {
            let code = match *value {
                SetTo::Number(x) => instance.set_numbers(&[*port], &[x]),
                SetTo::Flag(flag) => instance.set_boolean(port.0, flag),
            };
            if code > WARNING {
                return Err(instance.told());
            }
        }
        let initialized = instance.initialize();
        match initialized > WARNING || self.get() > WARNING {
            true => Err(self.instance.told()),
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

    /// Gets the outputs.
    fn get(&mut self) -> i32 {
        let (numbers, flags) = &self.outputs;
        let got = self.instance.numbers(numbers, &mut self.numbers);
        got.max(self.instance.booleans(flags, &mut self.flags))
    }

    /// Makes a step of `dt_s` up to `now_s`, with the inputs that `set` sets, and gets the outputs. An error is a step
    /// that the FMU discards, or the end of it.
    pub fn step(
        &mut self,
        set: impl FnOnce(&mut Instance) -> i32,
        now_s: f64,
        dt_s: f64,
    ) -> Result<(), Error> {
        if let Some(why) = &self.broken {
            return Err(Error::broken(why));
        }
        let mut code = set(&mut self.instance);
        if code <= WARNING {
            code = self.advance(now_s, dt_s);
        }
        if code == DISCARD {
            return Err(Error::own(self.told()));
        }
        if code <= WARNING {
            code = self.get();
        }
        if code <= WARNING {
            return Ok(());
        }
        let why = self.told();
        let error = Error::broken(&why);
        self.broken = Some(why);
        Err(error)
    }

    /// Removes and returns the last message of the FMU.
    pub fn told(&self) -> String {
        self.instance.told()
    }

    /// Back to the state after the building.
    pub fn reset(&mut self) {
        (self.began_s, self.made) = (None, 0);
        let why = match self.instance.reset() > WARNING {
            true => Err(self.told()),
            false => self.begin(),
        };
        self.broken = why.err();
    }

    /// Returns the state as bytes; `None` if the FMU cannot save its state.
    pub fn save(&self) -> Option<Vec<u8>> {
        self.instance.save()
    }

    /// Goes on from a state.
    pub fn restore(&mut self, bytes: &[u8]) -> bool {
        self.instance.restore(bytes)
    }
}
