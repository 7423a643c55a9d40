//! An instance of an FMU for both standards: its variables, its phase, and the receiver of its messages.

use crate::model::{self, Model, Stepped};
use crate::part::{FILE, Part, token};
use crate::variable::{Causality, Kind, TIME, Variable};
use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Status codes of both standards.
pub(crate) const OK: i32 = 0;
pub(crate) const WARNING: i32 = 1;
pub(crate) const DISCARD: i32 = 2;
pub(crate) const ERROR: i32 = 3;

/// Logger of FMI 2.0: environment, instance, status, category, format, and what the format asks for.
pub(crate) type LogTwo =
    unsafe extern "C" fn(*mut c_void, *const c_char, i32, *const c_char, *const c_char, ...);
/// Logger of FMI 3.0: environment, status, category, message.
pub(crate) type LogThree = unsafe extern "C" fn(*mut c_void, i32, *const c_char, *const c_char);

/// The receiver of messages. It is a copy: an importer may keep its callbacks only as long as the call that gives them.
#[derive(Clone, Copy)]
pub(crate) enum Log {
    Two(Option<LogTwo>, *mut c_void),
    Three(Option<LogThree>, *mut c_void),
}

impl Log {
    /// Sends the importer a message.
    pub fn tell(self, instance: &CStr, status: i32, message: &str) {
        let category = match status {
            WARNING => c"logStatusWarning",
            DISCARD => c"logStatusDiscard",
            _ => c"logStatusError",
        };
        // a text of ours has no zero byte
        let message = CString::new(message).unwrap_or_default();
        let (category, text) = (category.as_ptr(), message.as_ptr());
        match self {
            // SAFETY: the logger and its environment that the importer gave; the texts live until it is over.
            Self::Two(Some(log), environment) => unsafe {
                log(
                    environment,
                    instance.as_ptr(),
                    status,
                    category,
                    c"%s".as_ptr(),
                    text,
                );
            },
            // SAFETY: as above.
            Self::Three(Some(log), environment) => unsafe {
                log(environment, status, category, text);
            },
            Self::Two(None, _) | Self::Three(None, _) => {}
        }
    }
}

/// Phase of an instance.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Parameters are set.
    Set,
    /// Steps are made.
    Running,
    /// A step broke.
    Broken,
}

/// An instance.
pub(crate) struct Instance {
    name: CString,
    log: Log,
    variables: Vec<Variable>,
    values: Vec<f64>,
    model: Box<dyn Model>,
    phase: Phase,
    /// Present time, s.
    time_s: f64,
}

/// The place of the resources: a path, or a URI with `%20` and the like.
fn place(resources: &str) -> PathBuf {
    let Some(path) = resources.strip_prefix("file:") else {
        return PathBuf::from(resources);
    };
    let path = path.strip_prefix("//").unwrap_or(path);
    let path = path.strip_prefix("localhost").unwrap_or(path);
    // `/C:/…` on Windows
    let drive = path.get(2..3) == Some(":");
    let path = if drive {
        path.get(1..).unwrap_or(path)
    } else {
        path
    };
    let mut bytes = Vec::new();
    let mut rest = path.as_bytes();
    while let [first, others @ ..] = rest {
        let code = others
            .get(..2)
            .and_then(|hex| std::str::from_utf8(hex).ok());
        let code = code.and_then(|hex| u8::from_str_radix(hex, 16).ok());
        (bytes, rest) = match (first, code) {
            (b'%', Some(code)) => ([bytes, vec![code]].concat(), &others[2..]),
            _ => ([bytes, vec![*first]].concat(), others),
        };
    }
    PathBuf::from(String::from_utf8_lossy(&bytes).into_owned())
}

fn read(resources: &str, wanted: &str) -> Result<(Vec<Variable>, Box<dyn Model>), String> {
    let resources = place(resources);
    let file: &Path = &resources.join(FILE);
    let bytes = std::fs::read(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let token = token(&bytes);
    if token != wanted {
        return Err(format!(
            "the importer's token is {wanted}, but this FMU has {token}"
        ));
    }
    let part: Part =
        serde_json::from_slice(&bytes).map_err(|e| format!("{}: {e}", file.display()))?;
    model::of(part, &resources)
}

impl Instance {
    /// Makes an instance from the resources of the FMU. An error is reported to the importer.
    pub fn new(name: &CStr, token: &str, resources: &str, log: Log) -> Option<Self> {
        let made = catch_unwind(|| read(resources, token));
        let made = made.unwrap_or_else(|_| Err("it panicked".to_owned()));
        match made {
            Ok((variables, model)) => Some(Self {
                name: name.into(),
                log,
                values: variables.iter().map(|v| v.start).collect(),
                variables,
                model,
                phase: Phase::Set,
                time_s: 0.0,
            }),
            Err(why) => {
                log.tell(name, ERROR, &why);
                None
            }
        }
    }

    /// Runs `act` on the instance. An error is reported to the importer, and a panic ends the instance.
    pub fn act(&mut self, act: impl FnOnce(&mut Self) -> Result<i32, String>) -> i32 {
        let acted = catch_unwind(AssertUnwindSafe(|| act(self)));
        let acted = acted.unwrap_or_else(|_| {
            self.phase = Phase::Broken;
            Err("it panicked".to_owned())
        });
        acted.unwrap_or_else(|why| {
            self.log.tell(&self.name, ERROR, &why);
            ERROR
        })
    }

    fn index(&self, reference: u32, kind: fn(Kind) -> bool) -> Result<usize, String> {
        let index = (reference as usize).wrapping_sub(1);
        match self.variables.get(index) {
            Some(v) if kind(v.kind) => Ok(index),
            Some(v) => Err(format!("`{}` ({reference}) is of another type", v.name)),
            None => Err(format!("no variable has the reference {reference}")),
        }
    }

    /// The value of a variable.
    pub fn get(&self, reference: u32, kind: fn(Kind) -> bool) -> Result<f64, String> {
        if reference == TIME && kind(Kind::Real) {
            return Ok(self.time_s);
        }
        let index = self.index(reference, kind)?;
        Ok(self.values.get(index).copied().unwrap_or_default())
    }

    /// Sets a variable.
    pub fn set(&mut self, reference: u32, kind: fn(Kind) -> bool, x: f64) -> Result<(), String> {
        let index = self.index(reference, kind)?;
        let name = || self.variables.get(index).map_or("", |v| v.name.as_str());
        match self.variables.get(index).map(|v| v.causality) {
            Some(Causality::Output) => Err(format!("`{}` is an output", name())),
            Some(Causality::Parameter) if self.phase != Phase::Set => Err(format!(
                "`{}` is a parameter: set it before the end of the initialization",
                name()
            )),
            _ => {
                if let Some(value) = self.values.get_mut(index) {
                    *value = x;
                }
                Ok(())
            }
        }
    }

    /// Ends the initialization.
    pub fn begin(&mut self) -> Result<i32, String> {
        if self.phase != Phase::Set {
            return Err("the instance has begun already: reset it first".to_owned());
        }
        self.model.begin(&mut self.values)?;
        self.phase = Phase::Running;
        Ok(OK)
    }

    /// Makes a step.
    pub fn step(&mut self, t_s: f64, dt_s: f64) -> Result<i32, String> {
        match self.phase {
            Phase::Set => return Err("a step came before the end of the initialization".to_owned()),
            Phase::Broken => return Err("the instance cannot go on: reset it first".to_owned()),
            Phase::Running => {}
        }
        if !(t_s.is_finite() && dt_s.is_finite() && dt_s > 0.0) {
            return Err(format!("a step of {dt_s} s from {t_s} s is not possible"));
        }
        let (code, why) = match self.model.step(&mut self.values, t_s, dt_s) {
            Ok(Stepped::Done) => (OK, String::new()),
            Ok(Stepped::Refused(why)) => (WARNING, why),
            Ok(Stepped::NotMade(why)) => (DISCARD, why),
            Err(why) => {
                self.phase = Phase::Broken;
                return Err(why);
            }
        };
        if code != OK {
            self.log.tell(&self.name, code, &why);
        }
        if code != DISCARD {
            self.time_s = t_s + dt_s;
        }
        Ok(code)
    }

    /// Resets the instance to its first state.
    pub fn reset(&mut self) -> Result<i32, String> {
        self.values = self.variables.iter().map(|v| v.start).collect();
        (self.phase, self.time_s) = (Phase::Set, 0.0);
        Ok(OK)
    }

    /// All data of the instance, as bytes.
    pub fn save(&self) -> Result<Vec<u8>, String> {
        let state = match self.phase {
            Phase::Broken => return Err("the instance cannot go on, so it has no state".to_owned()),
            Phase::Set => Vec::new(),
            Phase::Running => self
                .model
                .save()
                .ok_or("the state of the instance cannot be saved")?,
        };
        let mut bytes = vec![u8::from(self.phase == Phase::Running)];
        let numbers = [self.time_s].into_iter().chain(self.values.iter().copied());
        numbers.for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(state);
        Ok(bytes)
    }

    /// Restores the data of [`Instance::save`].
    pub fn load(&mut self, bytes: &[u8]) -> Result<i32, String> {
        let torn = "the state has the wrong length";
        let (running, rest) = bytes.split_first().ok_or(torn)?;
        let numbers = 8 * (1 + self.values.len());
        let (numbers, state) = rest.split_at_checked(numbers).ok_or(torn)?;
        let (numbers, _) = numbers.as_chunks();
        let mut numbers = numbers.iter().map(|x| f64::from_le_bytes(*x));
        let time_s = numbers.next().ok_or(torn)?;
        let mut values: Vec<f64> = numbers.collect();
        if *running != 0 {
            self.model.load(&mut values, state)?;
        }
        self.phase = if *running != 0 {
            Phase::Running
        } else {
            Phase::Set
        };
        (self.time_s, self.values) = (time_s, values);
        Ok(OK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_path_or_a_uri() {
        for (told, path) in [
            ("/a b/resources/", "/a b/resources/"),
            ("file:///a%20b/resources", "/a b/resources"),
            ("file:/a/100%", "/a/100%"),
            ("file://localhost/a", "/a"),
            ("file:///C:/a", "C:/a"),
        ] {
            assert_eq!(place(told), PathBuf::from(path));
        }
    }
}
