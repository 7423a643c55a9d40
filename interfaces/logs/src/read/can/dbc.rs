//! DBC: messages and signals of a CAN bus, and how a signal is taken out of a frame: Intel and Motorola order, 11 and
//! 29 bits, multiplexing of any depth, floats; messages of J1939 by their parameter group.

use crate::read::text;
use crate::wrong;
use can_dbc::{
    AttributeValue, ByteOrder, Dbc, ExtendedMultiplex, MessageId, MultiplexIndicator,
    SignalExtendedValueType, ValueType,
};
use monorig_sim::config::file::read_bytes;
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::Path;

/// The messages of a bus.
#[derive(Clone, Debug, Default)]
pub struct Database {
    /// By identifier, and whether it has 29 bits.
    pub(super) messages: HashMap<(u32, bool), Message>,
    /// Identifiers of the messages of J1939 by their parameter group; none of a bus of another kind.
    groups: HashMap<u32, u32>,
}

/// Properties of signals that stand outside of their messages, by message and name: floats, multiplexers.
#[derive(Default)]
struct Apart<'a> {
    floats: HashMap<(MessageId, &'a str), &'a SignalExtendedValueType>,
    multiplexed: HashMap<(MessageId, &'a str), &'a ExtendedMultiplex>,
    /// Names of more than 32 characters, of which the message has a shorter form; those of messages by no name.
    long_names: HashMap<(MessageId, &'a str), &'a str>,
}

impl Apart<'_> {
    /// The long name of a signal of a message, or of the message; the short one where there is no other.
    fn name(&self, message: MessageId, signal: &str, short: &str) -> String {
        let long = self.long_names.get(&(message, signal));
        long.map_or(short, |name| name).to_owned()
    }
}

/// A message.
#[derive(Clone, Debug, Default)]
pub(super) struct Message {
    /// Its name.
    pub name: String,
    /// Its signals.
    pub signals: Vec<Signal>,
}

/// A signal of a message.
#[derive(Clone, Debug)]
pub(super) struct Signal {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    start: u32,
    size: u32,
    motorola: bool,
    coding: Coding,
    factor: f64,
    offset: f64,
    /// Its multiplexer, by its place in the message, and the numbers there with which it is in a frame.
    cases: Option<(usize, Vec<RangeInclusive<u64>>)>,
    /// Reason why it cannot be read.
    pub unreadable: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Unsigned,
    Signed,
    Float32,
    Float64,
}

impl Database {
    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let bytes = read_bytes(path)?;
        Self::parse(&text::of_bytes(&bytes)).map_err(|message| {
            wrong(
                path,
                None,
                format!("this database of CAN messages cannot be used: {message}"),
                "use a DBC file as Vector's tools and cantools write it",
            )
        })
    }

    /// Parses a text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let dbc = Dbc::try_from(text).map_err(|e| e.to_string())?;
        let (mut messages, mut groups) = (HashMap::new(), HashMap::new());
        let mut apart = Apart::default();
        for x in &dbc.signal_extended_value_type_list {
            let key = (x.message_id, &*x.signal_name);
            apart.floats.insert(key, &x.signal_extended_value_type);
        }
        for x in &dbc.extended_multiplex {
            apart.multiplexed.insert((x.message_id, &x.signal_name), x);
        }
        let of_messages = dbc
            .attribute_values_message
            .iter()
            .map(|a| (a.message_id, "", &a.name, &a.value));
        let of_signals = dbc.attribute_values_signal.iter();
        let of_signals = of_signals.map(|a| (a.message_id, &*a.signal_name, &a.name, &a.value));
        for (id, signal, attribute, value) in of_messages.chain(of_signals) {
            let is_name =
                ["SystemMessageLongSymbol", "SystemSignalLongSymbol"].contains(&&**attribute);
            if let (true, AttributeValue::String(name)) = (is_name, value) {
                apart.long_names.insert((id, signal), name);
            }
        }
        for m in &dbc.messages {
            let id = match m.id {
                MessageId::Standard(id) => (u32::from(id), false),
                MessageId::Extended(id) => (id & 0x1FFF_FFFF, true),
            };
            let signals = m.signals.iter().map(|s| Signal::new(&apart, m, s));
            let message = Message {
                name: apart.name(m.id, "", &m.name),
                signals: signals.collect(),
            };
            messages.insert(id, message);
            if let (id, true) = id {
                groups.insert(parameter_group(id), id);
            }
        }
        // the address FE stands for any sender
        let any_sender = groups.values().any(|id| id & 0xFF == 0xFE);
        if !any_sender && !text.contains("J1939") {
            groups.clear();
        }
        Ok(Self { messages, groups })
    }

    /// The identifier in the database of the message that a frame has; of J1939 whatever the address of its sender.
    pub(super) fn known_as(&self, id: (u32, bool)) -> Option<(u32, bool)> {
        if self.messages.contains_key(&id) {
            return Some(id);
        }
        let group = self.groups.get(&parameter_group(id.0)).filter(|_| id.1);
        group.map(|id| (*id, true))
    }

    /// The number of messages.
    pub fn count(&self) -> usize {
        self.messages.len()
    }
}

/// The parameter group of an identifier of J1939: without priority, sender and, below F000, the receiver.
fn parameter_group(id: u32) -> u32 {
    match id >> 16 & 0xFF {
        0..0xF0 => id >> 8 & 0x3_FF00,
        _ => id >> 8 & 0x3_FFFF,
    }
}

impl Message {
    /// The value of a signal; none if it is not in this frame.
    pub fn value(&self, signal: usize, data: &[u8]) -> Option<f64> {
        let signal = self.signals.get(signal)?;
        let mut at = signal;
        // no chain of multiplexers is longer than the list of signals
        for _ in &self.signals {
            let Some((multiplexer, cases)) = &at.cases else {
                return signal.value(data);
            };
            at = self.signals.get(*multiplexer)?;
            let case = at.raw(data)?;
            cases.iter().any(|c| c.contains(&case)).then_some(())?;
        }
        None
    }
}

impl Signal {
    fn new(apart: &Apart<'_>, m: &can_dbc::Message, s: &can_dbc::Signal) -> Self {
        let coding = match (apart.floats.get(&(m.id, &*s.name)), &s.value_type) {
            (Some(SignalExtendedValueType::IEEEfloat32Bit), _) => Coding::Float32,
            (Some(SignalExtendedValueType::IEEEdouble64bit), _) => Coding::Float64,
            (_, ValueType::Signed) => Coding::Signed,
            _ => Coding::Unsigned,
        };
        let size = s.size as u32;
        let fits = match coding {
            Coding::Float32 => size == 32,
            Coding::Float64 => size == 64,
            _ => (1..=64).contains(&size),
        };
        let fits = fits && s.start_bit < 512;
        let case = match s.multiplexer_indicator {
            MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor => None,
            MultiplexIndicator::MultiplexedSignal(case)
            | MultiplexIndicator::MultiplexorAndMultiplexedSignal(case) => Some(case),
        };
        // `SG_MUL_VAL_` names multiplexer and ranges; without it the only multiplexer and one number are meant
        let extended = apart.multiplexed.get(&(m.id, &*s.name));
        let cases = case.map(|case| {
            let is_multiplexer = |other: &can_dbc::Signal| match extended {
                Some(e) => other.name == e.multiplexor_signal_name,
                None => other.multiplexer_indicator == MultiplexIndicator::Multiplexor,
            };
            let place = m.signals.iter().position(is_multiplexer);
            let ranges = extended.map(|e| e.mappings.iter().map(|r| r.min_value..=r.max_value));
            let ranges = ranges.map_or(vec![case..=case], Iterator::collect);
            (place.unwrap_or(usize::MAX), ranges)
        });
        let unreadable = (!fits).then(|| {
            format!(
                "the signal `{}` of `{}` has {size} bits from bit {}",
                s.name, m.name, s.start_bit
            )
        });
        Self {
            name: apart.name(m.id, &s.name, &s.name),
            unit: s.unit.clone(),
            start: s.start_bit as u32,
            size,
            motorola: s.byte_order == ByteOrder::BigEndian,
            coding,
            factor: s.factor,
            offset: s.offset,
            cases,
            unreadable,
        }
    }

    /// Its bits; none if the frame is too short.
    fn raw(&self, data: &[u8]) -> Option<u64> {
        let bit = |at: u32| {
            data.get((at / 8) as usize)
                .map(|byte| u64::from(byte >> (at % 8) & 1))
        };
        let mut raw = 0;
        if self.motorola {
            // most significant bit first; within a byte downwards, then on to bit 7 of the next byte
            let mut at = self.start;
            for _ in 0..self.size {
                raw = raw << 1 | bit(at)?;
                at = if at.is_multiple_of(8) {
                    at + 15
                } else {
                    at - 1
                };
            }
        } else {
            for k in 0..self.size {
                raw |= bit(self.start + k)? << k;
            }
        }
        Some(raw)
    }

    /// Its value; none if the frame is too short.
    fn value(&self, data: &[u8]) -> Option<f64> {
        let raw = self.raw(data)?;
        let number = match self.coding {
            Coding::Float32 => f64::from(f32::from_bits(raw as u32)),
            Coding::Float64 => f64::from_bits(raw),
            Coding::Signed => ((raw << (64 - self.size)) as i64 >> (64 - self.size)) as f64,
            Coding::Unsigned => raw as f64,
        };
        Some(number * self.factor + self.offset)
    }
}
