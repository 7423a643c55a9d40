//! The messages: which there are, their identifiers, names and signals.

use crate::frame::{Frame, bytes_of};
use crate::signal::{Content, Name, Numbers, Signal};
use monorig_estimators::api::signals::{MAX_DRIVES, Measurand, Shape, Slot};

/// First identifiers of the samples (sixteen for each measured quantity), of the commands, and of the other messages.
const SAMPLES: u32 = 0x100;
const PER_MEASURAND: u32 = 0x10;
const COMMANDS: u32 = 0x200;
const STEP: u32 = 0x220;
const TRUTH: u32 = 0x230;
const MASS: u32 = 0x240;
const GRADE: u32 = 0x241;
const STATUS: u32 = 0x242;
const MOTION: u32 = 0x243;
const LAST_MEASURAND: u32 = SAMPLES + PER_MEASURAND * Measurand::ALL.len() as u32;

const _: () = assert!(MAX_DRIVES <= PER_MEASURAND as usize && LAST_MEASURAND <= COMMANDS);

/// Largest number of signals of a message.
const MAX_SIGNALS: usize = 8;

/// A message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Message {
    /// A sample.
    Sample(Slot),
    /// Command of a motor torque, counted from 0; then the command of the clamp pressure, then of the brake.
    Command(Commanded),
    /// The end of a step: its samples and commands have been sent.
    Step,
    /// A true slope, for logs alone: 0 = at the IMU, 1 = the effective one.
    Truth(usize),
    /// Estimate of the mass.
    Mass,
    /// Estimate of the grade at the IMU.
    Grade,
    /// Innovation, flags, refusal of a step: it need not be sent.
    Status,
    /// Estimate of effective grade and speed: the end of an answer.
    Motion,
}

/// A commanded quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commanded {
    /// Motor torque of a drive unit, counted from 0.
    Torque(usize),
    /// Clamp cylinder pressure.
    Clamp,
    /// Share of the clamp-brake force.
    Brake,
}

/// Unit in ASCII, and step of a fixed-point signal.
const fn scale(measurand: Measurand) -> (&'static str, f64) {
    match measurand {
        Measurand::SpecificForce => ("m/s2", 1e-5),
        Measurand::AngularRate => ("rad/s", 1e-6),
        Measurand::MotorTorque => ("Nm", 1e-3),
        Measurand::WheelSpeed => ("m/s", 1e-5),
        Measurand::ClampPressure => ("MPa", 1e-5),
        Measurand::SteeringAngle | Measurand::Inclination => ("rad", 1e-6),
        Measurand::Auxiliary => ("1", 1e-3),
    }
}

const RAD: (&str, f64) = ("rad", 1e-6);
const KG: (&str, f64) = ("kg", 0.1);
const MPS: (&str, f64) = ("m/s", 1e-5);

const STAMP: Signal = Signal::new(Name::of("stamp"), "", Content::Instant);
const SEQUENCE: Signal = Signal::new(Name::of("sequence"), "", Content::Sequence);

const fn number(name: Name, (unit, step): (&'static str, f64)) -> Signal {
    Signal::new(name, unit, Content::Signed(step))
}

const fn deviation(name: &'static str, (unit, step): (&'static str, f64)) -> Signal {
    Signal::new(Name::of(name), unit, Content::Unsigned(step))
}

const fn flag(name: &'static str) -> Signal {
    Signal::new(Name::of(name), "", Content::Flag)
}

impl Message {
    /// The message of an identifier.
    pub fn of(id: u32) -> Option<Self> {
        let command = id.wrapping_sub(COMMANDS) as usize;
        match id {
            STEP => Some(Self::Step),
            MASS => Some(Self::Mass),
            GRADE => Some(Self::Grade),
            STATUS => Some(Self::Status),
            MOTION => Some(Self::Motion),
            TRUTH => Some(Self::Truth(0)),
            _ if id == TRUTH + 1 => Some(Self::Truth(1)),
            SAMPLES..LAST_MEASURAND => {
                let at = id - SAMPLES;
                let measurand = Measurand::ALL.get((at / PER_MEASURAND) as usize)?;
                let index = (at % PER_MEASURAND) as usize;
                let there = index < measurand.shape().slots();
                there.then(|| Self::Sample(measurand.slot(index)))
            }
            COMMANDS.. if command < MAX_DRIVES => Some(Self::Command(Commanded::Torque(command))),
            COMMANDS.. if command == MAX_DRIVES => Some(Self::Command(Commanded::Clamp)),
            COMMANDS.. if command == MAX_DRIVES + 1 => Some(Self::Command(Commanded::Brake)),
            _ => None,
        }
    }

    /// Returns the identifier of the message.
    pub fn id(self) -> u32 {
        match self {
            Self::Sample(slot) => {
                SAMPLES + PER_MEASURAND * slot.measurand as u32 + slot.index as u32
            }
            Self::Command(Commanded::Torque(index)) => COMMANDS + index as u32,
            Self::Command(Commanded::Clamp) => COMMANDS + MAX_DRIVES as u32,
            Self::Command(Commanded::Brake) => COMMANDS + MAX_DRIVES as u32 + 1,
            Self::Step => STEP,
            Self::Truth(which) => TRUTH + which as u32,
            Self::Mass => MASS,
            Self::Grade => GRADE,
            Self::Status => STATUS,
            Self::Motion => MOTION,
        }
    }

    /// All messages of a vehicle with this number of drive units except the truth, by identifier.
    pub fn all(drives: usize) -> impl Iterator<Item = Self> + Clone {
        (SAMPLES..=MOTION)
            .filter_map(Self::of)
            .filter(move |m| match m {
                Self::Sample(slot) => {
                    slot.measurand.shape() != Shape::PerDrive || slot.index < drives
                }
                Self::Command(Commanded::Torque(index)) => *index < drives,
                Self::Truth(_) => false,
                _ => true,
            })
    }

    /// True if the estimator sends the message.
    pub fn is_answer(self) -> bool {
        matches!(self, Self::Mass | Self::Grade | Self::Status | Self::Motion)
    }

    /// Its name.
    pub fn name(self) -> Name {
        let drive = |name: &'static str, index| Name::joined(name, "drive").at(index);
        match self {
            Self::Sample(slot) => match slot.measurand.shape() {
                Shape::Vector => Name::of(slot.name()),
                Shape::Scalar => Name::joined(slot.name(), "value"),
                Shape::PerDrive => drive(slot.name(), slot.index),
                Shape::Auxiliary => Name::joined(slot.name(), "reading").at(slot.index),
            },
            Self::Command(Commanded::Torque(index)) => drive("command", index),
            Self::Command(Commanded::Clamp) => Name::joined("command", "clamp_pressure"),
            Self::Command(Commanded::Brake) => Name::joined("command", "brake"),
            Self::Step => Name::of("step"),
            Self::Truth(0) => Name::joined("truth", "slope"),
            Self::Truth(_) => Name::joined("truth", "effective_slope"),
            Self::Mass => Name::joined("estimate", "mass"),
            Self::Grade => Name::joined("estimate", "grade"),
            Self::Status => Name::joined("estimate", "status"),
            Self::Motion => Name::joined("estimate", "motion"),
        }
    }

    /// Returns the signals of the message in their order.
    pub fn signals(self) -> impl Iterator<Item = Signal> {
        self.table().into_iter().flatten()
    }

    fn table(self) -> [Option<Signal>; MAX_SIGNALS] {
        let stamped = |values: [Option<Signal>; 3]| {
            let [a, b, c] = values;
            [Some(STAMP), a, b, c, None, None, None, None]
        };
        let one = |name, scale| stamped([Some(number(name, scale)), None, None]);
        match self {
            Self::Sample(slot) => {
                let scale = scale(slot.measurand);
                match slot.measurand.shape() {
                    Shape::Vector => {
                        stamped(["x", "y", "z"].map(|axis| Some(number(Name::of(axis), scale))))
                    }
                    Shape::Scalar => one(Name::of("value"), scale),
                    Shape::PerDrive => one(Name::of("drive").at(slot.index), scale),
                    Shape::Auxiliary => one(Name::of("reading").at(slot.index), scale),
                }
            }
            Self::Command(Commanded::Torque(index)) => {
                one(Name::of("drive").at(index), ("Nm", 1e-3))
            }
            Self::Command(Commanded::Clamp) => one(Name::of("clamp_pressure"), ("MPa", 1e-5)),
            Self::Command(Commanded::Brake) => one(Name::of("brake"), ("1", 1e-6)),
            Self::Truth(0) => one(Name::of("slope"), RAD),
            Self::Truth(_) => one(Name::of("effective_slope"), RAD),
            Self::Step => {
                let dt = Signal::new(Name::of("dt"), "s", Content::Duration);
                let all = [STAMP, dt, flag("start"), SEQUENCE].map(Some);
                let [a, b, c, d] = all;
                [a, b, c, d, None, None, None, None]
            }
            Self::Mass | Self::Grade => {
                let (name, scale) = match self {
                    Self::Mass => ("mass", KG),
                    _ => ("grade", RAD),
                };
                let value = number(Name::of(name), scale);
                let [sd, level] = ["sd", "protection"].map(|name| deviation(name, scale));
                let [a, b, c, d, e] = [value, sd, level, flag("valid"), SEQUENCE].map(Some);
                [a, b, c, d, e, None, None, None]
            }
            Self::Status => [
                number(Name::of("innovation"), MPS),
                deviation("nis", ("1", 1e-3)),
                flag("moving"),
                flag("excited"),
                flag("saturated"),
                flag("refused"),
                flag("start"),
                SEQUENCE,
            ]
            .map(Some),
            Self::Motion => [
                Some(number(Name::of("effective_grade"), RAD)),
                Some(deviation("effective_grade_sd", RAD)),
                Some(number(Name::of("speed"), MPS)),
                Some(deviation("speed_sd", MPS)),
                Some(deviation("effective_grade_protection", RAD)),
                Some(flag("effective_grade_valid")),
                Some(flag("speed_valid")),
                Some(SEQUENCE),
            ],
        }
    }

    /// Bytes of its frame.
    pub fn bytes(self, numbers: Numbers) -> usize {
        bytes_of(self.signals().map(|s| s.bits(numbers)).sum())
    }

    /// A frame of the message with these values, one for each signal. True beside it if one of them is out of range and
    /// written as its end.
    pub fn encode(self, numbers: Numbers, values: &[Value]) -> (Frame, bool) {
        let mut frame = Frame::new(self.id());
        let (mut at, mut clipped) = (0, false);
        for (signal, value) in self.signals().zip(values) {
            let raw = match *value {
                Value::Instant(ns) => Signal::raw_instant(ns, numbers),
                Value::Number(number) => {
                    let (raw, is_out) = signal.raw_number(number, numbers);
                    clipped |= is_out;
                    raw
                }
                Value::Flag(flag) => flag.into(),
                Value::Sequence(sequence) => sequence.into(),
            };
            let bits = signal.bits(numbers);
            frame.put(at, bits, raw);
            at += bits;
        }
        frame.set_bits(at);
        (frame, clipped)
    }

    /// The values of a frame; `None` if the frame is too short, or `N` smaller than the number of its signals. What it
    /// has not stays as it was.
    pub fn decode<const N: usize>(self, numbers: Numbers, frame: &Frame) -> Option<[Value; N]> {
        let mut values = [Value::Flag(false); N];
        (self.signals().count() <= N).then_some(())?;
        let mut at = 0;
        for (signal, value) in self.signals().zip(&mut values) {
            let bits = signal.bits(numbers);
            let raw = frame.get(at, bits)?;
            at += bits;
            *value = match signal.content {
                Content::Instant => Value::Instant(Signal::instant(raw, numbers)),
                Content::Duration | Content::Signed(_) | Content::Unsigned(_) => {
                    Value::Number(signal.number(raw, numbers))
                }
                Content::Flag => Value::Flag(raw != 0),
                Content::Sequence => Value::Sequence(raw as u16),
            };
        }
        Some(values)
    }
}

/// A value of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// An instant, ns since the start.
    Instant(i64),
    /// A number.
    Number(f64),
    /// A flag.
    Flag(bool),
    /// The number of a step.
    Sequence(u16),
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn an_identifier_has_one_message_and_a_message_one_identifier() {
        let all: Vec<Message> = Message::all(MAX_DRIVES).collect();
        assert_eq!(all.len(), Slot::COUNT + MAX_DRIVES + 2 + 5);
        for message in &all {
            assert_eq!(Message::of(message.id()), Some(*message));
        }
        let names: BTreeSet<_> = all.iter().map(|m| m.name().to_string()).collect();
        assert_eq!(names.len(), all.len());
        assert_eq!((0..=0x7FF).filter_map(Message::of).count(), all.len() + 2);
        for slot in Slot::all() {
            assert_eq!(
                Message::of(Message::Sample(slot).id()),
                Some(Message::Sample(slot))
            );
        }
    }

    /// A value within its range comes back within half a step of a fixed-point signal, and as it was of a
    /// floating-point one; beyond it comes its end, and NaN is NaN.
    #[test]
    fn values_come_back_within_half_a_step() {
        for message in Message::all(2).chain([Message::Truth(0), Message::Truth(1)]) {
            for numbers in [Numbers::Fixed, Numbers::Float] {
                for x in [0.0, 0.123_456_789, -1.5, 7.25, 1e9, f64::NAN] {
                    let given: Vec<Value> = message
                        .signals()
                        .map(|s| match s.content {
                            Content::Instant => Value::Instant(123_456_789_000),
                            Content::Duration | Content::Unsigned(_) => Value::Number(x.abs()),
                            Content::Signed(_) => Value::Number(x),
                            Content::Flag => Value::Flag(x > 0.0),
                            Content::Sequence => Value::Sequence(0x5A5A),
                        })
                        .collect();
                    let (frame, clipped) = message.encode(numbers, &given);
                    assert_eq!(frame.data().len(), message.bytes(numbers));
                    assert_eq!(Message::of(frame.id), Some(message));
                    let back: [Value; MAX_SIGNALS] = message.decode(numbers, &frame).unwrap();
                    for ((signal, given), back) in message.signals().zip(&given).zip(back) {
                        let (Value::Number(x), Value::Number(y)) = (*given, back) else {
                            assert_eq!(*given, back);
                            continue;
                        };
                        let step = signal.factor(numbers);
                        if numbers == Numbers::Float {
                            assert_eq!(x.to_bits(), y.to_bits());
                        } else if clipped {
                            assert!((1e9 - y) > step && y > 7e6 * step, "{y}");
                        } else {
                            assert!((x - y).abs() <= 0.501 * step || x.is_nan() && y.is_nan());
                        }
                    }
                    assert_eq!(
                        clipped,
                        x == 1e9
                            && numbers == Numbers::Fixed
                            && message.signals().any(|s| s.is_float(Numbers::Float))
                    );
                }
            }
        }
    }

    #[test]
    fn a_frame_or_an_array_that_is_too_short_has_no_values() {
        for message in Message::all(1) {
            let short = Frame::with(message.id(), false, &[0; 3]).unwrap();
            assert_eq!(message.decode::<7>(Numbers::Fixed, &short), None);
        }
        let (frame, _) = Message::Step.encode(Numbers::Fixed, &[Value::Flag(false); 4]);
        assert!(Message::Step.decode::<4>(Numbers::Fixed, &frame).is_some());
        assert_eq!(Message::Step.decode::<3>(Numbers::Fixed, &frame), None);
    }
}
