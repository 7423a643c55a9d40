//! DBC: messages and signals of a CAN bus, and how a signal is taken out of a frame: Intel and Motorola order, 11 and
//! 29 bits, one level of multiplexing, floats.

use crate::read::text;
use crate::wrong;
use can_dbc::{ByteOrder, Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType, ValueType};
use monorig_sim::config::file::read_bytes;
use monorig_sim::error::Error;
use std::collections::HashMap;
use std::path::Path;

/// The messages of a bus.
#[derive(Clone, Debug, Default)]
pub struct Database {
    /// By identifier, and whether it has 29 bits.
    pub(super) messages: HashMap<(u32, bool), Message>,
}

/// The signals that are floats, by message and name.
type Floats<'a> = HashMap<(MessageId, &'a str), &'a SignalExtendedValueType>;

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
    presence: Presence,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Unsigned,
    Signed,
    Float32,
    Float64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Presence {
    Always,
    Switch,
    Case(u64),
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
                "a DBC file as Vector's tools and cantools write it",
            )
        })
    }

    /// Parses a text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let dbc = Dbc::try_from(text).map_err(|e| e.to_string())?;
        let mut messages = HashMap::new();
        let floats = dbc.signal_extended_value_type_list.iter();
        let floats: Floats<'_> = floats
            .map(|x| {
                (
                    (x.message_id, &*x.signal_name),
                    &x.signal_extended_value_type,
                )
            })
            .collect();
        for m in &dbc.messages {
            let id = match m.id {
                MessageId::Standard(id) => (u32::from(id), false),
                MessageId::Extended(id) => (id & 0x1FFF_FFFF, true),
            };
            let signals = m.signals.iter().map(|s| Signal::new(&floats, m, s));
            let message = Message {
                name: m.name.clone(),
                signals: signals.collect::<Result<_, _>>()?,
            };
            messages.insert(id, message);
        }
        Ok(Self { messages })
    }

    /// The number of messages.
    pub fn count(&self) -> usize {
        self.messages.len()
    }
}

impl Message {
    /// The case of a frame by its multiplexer; none of a message without.
    pub fn switch(&self, data: &[u8]) -> Option<u64> {
        self.signals
            .iter()
            .find(|s| s.presence == Presence::Switch)?
            .raw(data)
    }
}

impl Signal {
    fn new(floats: &Floats<'_>, m: &can_dbc::Message, s: &can_dbc::Signal) -> Result<Self, String> {
        let coding = match (floats.get(&(m.id, &*s.name)), &s.value_type) {
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
        if !fits || s.start_bit >= 512 {
            return Err(format!(
                "the signal `{}` of `{}` has {size} bits from bit {}",
                s.name, m.name, s.start_bit
            ));
        }
        let presence = match s.multiplexer_indicator {
            MultiplexIndicator::Plain => Presence::Always,
            MultiplexIndicator::Multiplexor => Presence::Switch,
            MultiplexIndicator::MultiplexedSignal(case) => Presence::Case(case),
            MultiplexIndicator::MultiplexorAndMultiplexedSignal(_) => {
                return Err(format!(
                    "the signal `{}` of `{}` is multiplexed and a multiplexer at once, which is not read",
                    s.name, m.name
                ));
            }
        };
        Ok(Self {
            name: s.name.clone(),
            unit: s.unit.clone(),
            start: s.start_bit as u32,
            size,
            motorola: s.byte_order == ByteOrder::BigEndian,
            coding,
            factor: s.factor,
            offset: s.offset,
            presence,
        })
    }

    /// True if it is in a frame of this case.
    pub fn is_present(&self, switch: Option<u64>) -> bool {
        match self.presence {
            Presence::Case(case) => switch == Some(case),
            _ => true,
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
    pub fn value(&self, data: &[u8]) -> Option<f64> {
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
