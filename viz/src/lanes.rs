//! Validity of each estimator as a lane of states over time: what is marked valid, and when that changed.

use crate::series::estimators;
use crate::stream::{MessageStream, entity, send, times};
use monorig_sim::error::Error;
use monorig_sim::record::{Channel, Chunk};
use re_sdk_types::archetypes::{StateChange, StateConfiguration};
use rerun::EntityPath;

/// The states of validity: neither, mass, slope, both; with the colour of the lane.
const STATES: [(&str, [u8; 3]); 4] = [
    ("nothing valid", [70, 72, 80]),
    ("mass valid", [190, 150, 30]),
    ("slope valid", [40, 120, 190]),
    ("mass and slope valid", [0, 150, 100]),
];

/// One lane for each estimator.
pub struct ValidityLanes {
    names: Vec<String>,
    lanes: Vec<Lane>,
}

struct Lane {
    entity: EntityPath,
    /// Channels that are 1 where mass and slope are valid.
    valid: [Option<usize>; 2],
    state: Option<usize>,
}

/// The entity of an estimator's lane.
pub fn lane_entity(estimator: &str) -> EntityPath {
    entity(["validity", estimator])
}

impl ValidityLanes {
    /// Colours of the lanes are logged here.
    pub fn begin(stream: &mut MessageStream, channels: &[Channel]) -> Result<Self, Error> {
        let names = estimators(channels);
        let colours = STATES.map(|(_, [r, g, b])| u32::from_be_bytes([r, g, b, 255]));
        let style = StateConfiguration::new()
            .with_values(STATES.map(|(name, _)| name))
            .with_colors(colours);
        let mut lanes = Vec::new();
        for name in &names {
            let find = |leaf: &str| {
                let path = format!("estimates/{name}/{leaf}_valid");
                channels.iter().position(|c| c.path == path)
            };
            let entity = lane_entity(name);
            stream.fixed(entity.clone(), &style)?;
            lanes.push(Lane {
                entity,
                valid: [find("total_mass"), find("grade")],
                state: None,
            });
        }
        Ok(Self { names, lanes })
    }

    /// Names of the estimators, in the order of the lanes.
    pub fn estimators(&self) -> &[String] {
        &self.names
    }

    /// Sends the changes in a chunk.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        for lane in &mut self.lanes {
            let (mut ns, mut states) = (Vec::new(), Vec::new());
            for (row, &t) in chunk.time_ns.iter().enumerate() {
                let state = lane.at(chunk, row);
                if lane.state.replace(state) != Some(state) {
                    ns.push(t);
                    states.push(STATES[state].0);
                }
            }
            if !ns.is_empty() {
                let columns = StateChange::update_fields()
                    .with_state(states)
                    .columns_of_unit_batches();
                send(stream, lane.entity.clone(), times(ns), columns)?;
            }
        }
        Ok(())
    }
}

impl Lane {
    /// Index of the state in a row.
    fn at(&self, chunk: &Chunk, row: usize) -> usize {
        let is = |channel: Option<usize>| {
            let column = channel.and_then(|c| chunk.values.get(c));
            column.and_then(|c| c.get(row)) == Some(&1.0)
        };
        usize::from(is(self.valid[0])) + 2 * usize::from(is(self.valid[1]))
    }
}
