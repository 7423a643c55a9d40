//! The DBC of the messages: what the tools of a bus read to name its signals.

use crate::message::Message;
use crate::signal::Numbers;
use core::fmt::{Result, Write};

/// Values of the attribute `VFrameFormat`; the last one marks a CAN FD frame.
const FRAME_FORMATS: [&str; 15] = {
    let mut all = ["reserved"; 15];
    (all[0], all[1], all[3]) = ("StandardCAN", "ExtendedCAN", "J1939PG");
    all[14] = "StandardCAN_FD";
    all
};

/// Writes the DBC of these messages: the rig sends samples, commands and steps, the estimator its answers.
pub fn write(
    out: &mut impl Write,
    numbers: Numbers,
    messages: impl Iterator<Item = Message> + Clone,
) -> Result {
    out.write_str("VERSION \"monorig\"\n\nNS_ :\n\nBS_:\n\nBU_: monorig ecu\n\n")?;
    for m in messages.clone() {
        let sender = if m.is_answer() { "ecu" } else { "monorig" };
        let (id, name, bytes) = (m.id(), m.name(), m.bytes(numbers));
        writeln!(out, "BO_ {id} {name}: {bytes} {sender}")?;
        let mut at = 0;
        for s in m.signals() {
            let (name, bits, unit) = (s.name(numbers), s.bits(numbers), s.unit(numbers));
            let sign = if s.is_signed(numbers) { '-' } else { '+' };
            let factor = s.factor(numbers);
            writeln!(
                out,
                " SG_ {name} : {at}|{bits}@1{sign} ({factor},0) [0|0] \"{unit}\" Vector__XXX"
            )?;
            at += bits;
        }
        out.write_str("\n")?;
    }
    out.write_str("BA_DEF_ BO_ \"VFrameFormat\" ENUM ")?;
    for (k, format) in FRAME_FORMATS.iter().enumerate() {
        let comma = if k == 0 { "" } else { "," };
        write!(out, "{comma}\"{format}\"")?;
    }
    out.write_str(";\nBA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\n")?;
    for m in messages.clone().filter(|m| m.bytes(numbers) > 8) {
        let fd = FRAME_FORMATS.len() - 1;
        writeln!(out, "BA_ \"VFrameFormat\" BO_ {} {fd};", m.id())?;
    }
    for m in messages {
        for s in m.signals().filter(|s| s.is_float(numbers)) {
            writeln!(out, "SIG_VALTYPE_ {} {} : 2;", m.id(), s.name(numbers))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_dbc::{Dbc, MessageId};
    use std::string::{String, ToString};

    /// A parser of others finds the messages, their lengths and their signals.
    #[test]
    fn the_dbc_is_one() {
        for numbers in [Numbers::Fixed, Numbers::Float] {
            let mut text = String::new();
            write(&mut text, numbers, Message::all(3)).unwrap();
            let dbc = Dbc::try_from(text.as_str()).unwrap();
            assert_eq!(dbc.messages.len(), Message::all(3).count());
            for (ours, theirs) in Message::all(3).zip(&dbc.messages) {
                assert_eq!(theirs.id, MessageId::Standard(ours.id() as u16));
                assert_eq!(theirs.name, ours.name().to_string());
                assert_eq!(theirs.size as usize, ours.bytes(numbers));
                let mut free = 0;
                for (ours, theirs) in ours.signals().zip(&theirs.signals) {
                    assert_eq!(theirs.name, ours.name(numbers).to_string());
                    assert_eq!(theirs.start_bit, free, "{}", theirs.name);
                    free += theirs.size;
                    assert_eq!(theirs.factor, ours.factor(numbers));
                }
                assert!(free <= theirs.size * 8);
                assert_eq!(theirs.signals.len(), ours.signals().count());
            }
        }
    }
}
