//! Messages between the program and a process that runs a part for it. One answers the other in turn. A message is two
//! numbers of 64 bits, what it is and the length of the rest, and then structs of the header as they lie in memory:
//! both ends are on one machine.

use monorig_c::{Aid, Estimated, Input, NominalVehicle, Reason, Text};
use monorig_estimators::api::params::{Key, KeyKind, Setting};
use monorig_estimators::api::signals::{Command, Estimate, MAX_DRIVES};
use monorig_sim::closed_loop::interned;
use monorig_sim::control::{Perception, Reference};
use std::io::{Error, ErrorKind, Read, Result, Write};

/// Variable of the environment with the folder for temporary files, which the program removes.
pub(crate) const FOLDER: &str = "MONORIG_PART_FOLDER";

/// Describe a part: its role in the loop, its file, and its keys in a scenario as JSON. Answer: [`DONE`] with its name
/// and its parameters.
pub(crate) const LOAD: u64 = 1;
/// Build an instance: the part as before, vehicle, settings. Answer: [`DONE`], of an estimator with internals, sources
/// and the state.
pub(crate) const BUILD: u64 = 2;
/// Make a step: [`Input`]. Answer: the state.
pub(crate) const STEP: u64 = 3;
/// Go back to the state after the building. Answer: the state.
pub(crate) const RESET: u64 = 4;
/// Take a snapshot: the room for it. Answer: a code, the bytes it takes, the bytes.
pub(crate) const SNAPSHOT: u64 = 5;
/// Take the state of a snapshot: its bytes. Answer: the state.
pub(crate) const RESTORE: u64 = 6;
/// Drop the instance. Answer: nothing.
pub(crate) const DROP: u64 = 7;
/// Make a step of a controller: [`Task`]. Answer: a code, a [`Reason`], [`Commanded`].
pub(crate) const CONTROL: u64 = 8;
/// Answer: done, and what was asked for. A state is a code, a [`Reason`], [`Estimated`], internals, aid status.
pub(crate) const DONE: u64 = 100;
/// Roles of a part in the loop.
pub(crate) const ESTIMATOR: u64 = 0;
pub(crate) const CONTROLLER: u64 = 1;
/// Answer to [`LOAD`] and [`BUILD`]: refused, with message and help.
pub(crate) const REFUSED: u64 = 101;

/// Beside the codes of the header, of a snapshot: none is kept.
pub(crate) const NOT_KEPT: u64 = 3;

/// Largest length of a message.
const MAX_BYTES: u64 = 1 << 30;

/// Data without padding, for which all bytes are a value.
///
/// # Safety
/// The type is `repr(C)`, has no padding, and each of its fields is plain.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: bytes.
unsafe impl Plain for u8 {}
// SAFETY: numbers.
unsafe impl Plain for u64 {}
// SAFETY: numbers.
unsafe impl Plain for f64 {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Input {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Estimated {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for Aid {}
// SAFETY: numbers of eight bytes.
unsafe impl Plain for NominalVehicle {}
// SAFETY: bytes.
unsafe impl<const N: usize> Plain for Text<N> {}

/// Input of a controller in a step.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Task {
    reference: [f64; 4],
    speed_grade_mass: [f64; 3],
    valid: u64,
    slip_mps: [f64; MAX_DRIVES],
    estimates: u64,
    estimate: Estimated,
    dt_s: f64,
}

// SAFETY: numbers of eight bytes.
unsafe impl Plain for Task {}

impl Task {
    pub fn new(r: &Reference, p: &Perception, dt_s: f64) -> Self {
        Self {
            reference: [
                r.speed_mps,
                r.accel_mps2,
                r.emergency_brake,
                r.clamp_pressure_mpa,
            ],
            speed_grade_mass: [p.speed_mps, p.grade_rad, p.total_mass_kg],
            valid: p.valid.into(),
            slip_mps: p.slip_mps,
            estimates: p.estimate.is_some().into(),
            estimate: Estimated::from(&p.estimate.unwrap_or_default()),
            dt_s,
        }
    }

    pub fn read(&self) -> (Reference, Perception, f64) {
        let mut reference = Reference::default();
        [
            reference.speed_mps,
            reference.accel_mps2,
            reference.emergency_brake,
            reference.clamp_pressure_mpa,
        ] = self.reference;
        let mut perception = Perception::default();
        [
            perception.speed_mps,
            perception.grade_rad,
            perception.total_mass_kg,
        ] = self.speed_grade_mass;
        perception.valid = self.valid != 0;
        perception.slip_mps = self.slip_mps;
        perception.estimate = (self.estimates != 0).then(|| Estimate::from(&self.estimate));
        (reference, perception, self.dt_s)
    }
}

/// A command.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct Commanded {
    motor_torque_nm: [f64; MAX_DRIVES],
    clamp_pressure_mpa: f64,
    brake: f64,
}

// SAFETY: numbers of eight bytes.
unsafe impl Plain for Commanded {}

impl From<&Command> for Commanded {
    fn from(command: &Command) -> Self {
        Self {
            motor_torque_nm: command.motor_torque_nm,
            clamp_pressure_mpa: command.clamp_pressure_mpa,
            brake: command.brake,
        }
    }
}

impl From<&Commanded> for Command {
    fn from(commanded: &Commanded) -> Self {
        Self {
            motor_torque_nm: commanded.motor_torque_nm,
            clamp_pressure_mpa: commanded.clamp_pressure_mpa,
            brake: commanded.brake,
        }
    }
}

/// Kinds of a parameter and of its value.
const NUMBER: u64 = 0;
const FLAG: u64 = 1;
const WORD: u64 = 2;

const _: () = assert!(size_of::<Reason>() == 200);

/// A message that is put together. Its memory is kept for the next one.
#[derive(Default)]
pub(crate) struct Message(Vec<u8>);

impl Message {
    /// Begins a message.
    pub fn begin(&mut self, what: u64) -> &mut Self {
        self.0.clear();
        self.put(&[what, 0])
    }

    /// Appends values.
    pub fn put<T: Plain>(&mut self, values: &[T]) -> &mut Self {
        // SAFETY: the type is plain: all its bytes are data, for as long as the values live.
        let bytes = unsafe {
            std::slice::from_raw_parts(values.as_ptr().cast::<u8>(), size_of_val(values))
        };
        self.0.extend_from_slice(bytes);
        self
    }

    /// Appends bytes after their number.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.put(&[bytes.len() as u64]);
        self.0.extend_from_slice(bytes);
        self
    }

    /// Appends a text after its length.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.bytes(text.as_bytes())
    }

    /// Appends the description of a parameter.
    pub fn key(&mut self, key: &Key) -> &mut Self {
        self.text(key.name).text(key.doc);
        match key.kind {
            KeyKind::Number {
                unit,
                default,
                range: [least, most],
            } => {
                let known = u64::from(default.is_some());
                let numbers = [default.unwrap_or_default(), least, most];
                self.put(&[NUMBER, known]).text(unit).put(&numbers)
            }
            KeyKind::Flag { default } => self.put(&[FLAG, default.into()]),
            KeyKind::Choice { default, choices } => {
                self.put(&[WORD, choices.len() as u64]).text(default);
                choices
                    .iter()
                    .fold(self, |message, word| message.text(word))
            }
        }
    }

    /// Appends the value of a parameter.
    pub fn setting(&mut self, name: &str, value: Setting<'_>) -> &mut Self {
        self.text(name);
        match value {
            Setting::Number(number) => self.put(&[NUMBER]).put(&[number]),
            Setting::Flag(flag) => self.put(&[FLAG, flag.into()]),
            Setting::Choice(word) => self.put(&[WORD]).text(word),
        }
    }

    /// Sends it.
    pub fn send(&mut self, to: &mut impl Write) -> Result<()> {
        let rest = (self.0.len() - 16) as u64;
        self.0[8..16].copy_from_slice(&rest.to_ne_bytes());
        to.write_all(&self.0)
    }
}

/// Receives a message: what it is, and its rest into `body`.
pub(crate) fn receive(from: &mut impl Read, body: &mut Vec<u8>) -> Result<u64> {
    let mut header = [0; 16];
    from.read_exact(&mut header)?;
    let mut header = Body(&header);
    let (what, length) = (header.take::<u64>()?, header.take::<u64>()?);
    if length > MAX_BYTES {
        return Err(ErrorKind::InvalidData.into());
    }
    body.clear();
    match from.take(length).read_to_end(body)? as u64 == length {
        true => Ok(what),
        false => Err(ErrorKind::UnexpectedEof.into()),
    }
}

/// The rest of a message that is not yet read.
pub(crate) struct Body<'a>(pub &'a [u8]);

impl<'a> Body<'a> {
    /// The next value.
    pub fn take<T: Plain>(&mut self) -> Result<T> {
        let bytes = self.cut(size_of::<T>())?;
        // SAFETY: so many bytes are there, and the type is plain: any of them are a value.
        Ok(unsafe { bytes.as_ptr().cast::<T>().read_unaligned() })
    }

    /// All of a kind up to the end.
    pub fn all<T>(&mut self, mut take: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>> {
        let mut values = Vec::new();
        while !self.0.is_empty() {
            values.push(take(self)?);
        }
        Ok(values)
    }

    /// The next bytes, after their number.
    pub fn bytes(&mut self) -> Result<&'a [u8]> {
        let length = self.take::<u64>()?;
        self.cut(usize::try_from(length).unwrap_or(usize::MAX))
    }

    /// The next bytes, as a text.
    pub fn text(&mut self) -> Result<&'a str> {
        std::str::from_utf8(self.bytes()?).map_err(|_| ErrorKind::InvalidData.into())
    }

    /// The next text, kept as long as the program.
    pub fn kept(&mut self) -> Result<&'static str> {
        Ok(interned(self.text()?))
    }

    /// The next description of a parameter.
    pub fn key(&mut self) -> Result<Key> {
        let (name, doc) = (self.kept()?, self.kept()?);
        let kind = match (self.take()?, self.take::<u64>()?) {
            (NUMBER, known) => {
                let unit = self.kept()?;
                let [default, least, most] = [self.take()?, self.take()?, self.take()?];
                KeyKind::Number {
                    unit,
                    default: (known != 0).then_some(default),
                    range: [least, most],
                }
            }
            (FLAG, default) => KeyKind::Flag {
                default: default != 0,
            },
            (WORD, count) => {
                let default = self.kept()?;
                let words: Result<Vec<&'static str>> = (0..count).map(|_| self.kept()).collect();
                KeyKind::Choice {
                    default,
                    choices: words?.leak(),
                }
            }
            _ => return Err(ErrorKind::InvalidData.into()),
        };
        Ok(Key { name, doc, kind })
    }

    /// The next value of a parameter, and its name.
    pub fn setting(&mut self) -> Result<(&'a str, Setting<'a>)> {
        let name = self.text()?;
        let value = match self.take()? {
            NUMBER => Setting::Number(self.take()?),
            FLAG => Setting::Flag(self.take::<u64>()? != 0),
            WORD => Setting::Choice(self.text()?),
            _ => return Err(ErrorKind::InvalidData.into()),
        };
        Ok((name, value))
    }

    fn cut(&mut self, length: usize) -> Result<&'a [u8]> {
        let (bytes, rest) = self
            .0
            .split_at_checked(length)
            .ok_or_else(|| Error::from(ErrorKind::InvalidData))?;
        self.0 = rest;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_is_received() {
        let mut message = Message::default();
        let mut wire = Vec::new();
        for what in [STEP, DONE] {
            let message = message.begin(what).put(&[2.5_f64, f64::NAN]);
            message.text("slope °").put(&[7_u64]);
            message.send(&mut wire).unwrap();
        }
        let (mut from, mut body) = (&wire[..], Vec::new());
        for what in [STEP, DONE] {
            assert_eq!(receive(&mut from, &mut body).unwrap(), what);
            let mut body = Body(&body);
            assert_eq!(body.take::<f64>().unwrap(), 2.5);
            assert!(body.take::<f64>().unwrap().is_nan());
            assert_eq!(body.text().unwrap(), "slope °");
            assert_eq!(body.all(Body::take::<u64>).unwrap(), [7]);
        }
        assert!(receive(&mut from, &mut body).is_err(), "nothing is left");
        assert!(receive(&mut &wire[..wire.len() - 1], &mut body).is_ok());
    }

    #[test]
    fn parameters_and_their_values_come_as_they_are() {
        let number = |default| KeyKind::Number {
            unit: "m/s²",
            default,
            range: [f64::NEG_INFINITY, 1.5],
        };
        let choice = KeyKind::Choice {
            default: "two words",
            choices: &["one", "two words"],
        };
        let kinds = [
            number(None),
            number(Some(-0.5)),
            KeyKind::Flag { default: true },
            choice,
        ];
        let doc = "A parameter.";
        let name = "name";
        let keys = kinds.map(|kind| Key { name, doc, kind });
        let values = [
            ("a", Setting::Number(1e-300)),
            ("b", Setting::Flag(true)),
            ("c", Setting::Choice("two words")),
        ];
        let mut message = Message::default();
        message.begin(LOAD);
        for key in &keys {
            message.key(key);
        }
        for (name, value) in values {
            message.setting(name, value);
        }
        let mut body = Body(&message.0[16..]);
        assert_eq!(keys.map(|_| body.key().unwrap()), keys);
        assert_eq!(body.all(Body::setting).unwrap(), values);
    }

    /// Whatever a broken process sends is an error and no panic.
    #[test]
    fn nonsense_is_an_error() {
        let mut body = Vec::new();
        assert!(receive(&mut &[0xff; 64][..], &mut body).is_err());
        let mut short = Body(&[1, 0, 0]);
        assert!(short.take::<u64>().is_err() && short.bytes().is_err() && short.key().is_err());
        let long = [u64::MAX.to_ne_bytes(), [0; 8]].concat();
        assert!(Body(&long).bytes().is_err());
    }
}
