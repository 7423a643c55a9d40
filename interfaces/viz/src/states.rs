//! States over time, each with a colour.

use crate::stream::{MessageStream, send, times};
use monorig_sim::error::Error;
use re_sdk_types::archetypes::{StateChange, StateConfiguration};
use rerun::EntityPath;

/// The colours of states.
pub fn style<'a>(states: impl IntoIterator<Item = (&'a str, [u8; 3])>) -> StateConfiguration {
    let states = states.into_iter();
    let (names, colours): (Vec<&str>, Vec<u32>) = states
        .map(|(name, [r, g, b])| (name, u32::from_be_bytes([r, g, b, 255])))
        .unzip();
    StateConfiguration::new()
        .with_values(names)
        .with_colors(colours)
}

/// Sends changes of the state, if there are any.
pub fn send_changes(
    stream: &mut MessageStream,
    entity: &EntityPath,
    ns: Vec<i64>,
    states: Vec<&str>,
) -> Result<(), Error> {
    if ns.is_empty() {
        return Ok(());
    }
    let columns = StateChange::update_fields()
        .with_state(states)
        .columns_of_unit_batches();
    send(stream, entity.clone(), times(ns), columns)
}
