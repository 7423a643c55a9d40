//! Validity of each estimator as a lane of states over time: what is marked valid, and when that changed.

use crate::series::estimators;
use crate::states::{send_changes, style};
use crate::stream::{MessageStream, entity};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Emphasis, Layout};
use rerun::EntityPath;

/// The states of validity: neither, mass, slope, both; with the colour of the lane.
const STATES: [(&str, [u8; 3]); 4] = [
    ("nothing valid", [70, 72, 80]),
    ("mass valid", [190, 150, 30]),
    ("slope valid", [40, 120, 190]),
    ("mass and slope valid", [0, 150, 100]),
];

/// Largest number of estimators that are shown together.
const HANDFUL: usize = 5;
/// Shortest time, ns, after which a change of validity is written.
const LASTING_NS: i64 = 1_000_000_000;

/// One lane for each estimator.
pub struct ValidityLanes {
    names: Vec<String>,
    shown: Vec<String>,
    lanes: Vec<Lane>,
}

struct Lane {
    entity: EntityPath,
    /// Channels that are 1 where mass and slope are valid.
    valid: [Option<usize>; 2],
    state: Option<usize>,
    /// Time of the last change, and the last state that was written.
    since_ns: i64,
    told: usize,
    /// True if changes of this estimator are written.
    shown: bool,
}

/// The entity of an estimator's lane.
pub fn lane_entity(estimator: &str) -> EntityPath {
    entity(["validity", estimator])
}

impl ValidityLanes {
    /// Colours of the lanes are logged here.
    pub fn begin(stream: &mut MessageStream, layout: &Layout<'_>) -> Result<Self, Error> {
        let channels = layout.channels;
        let names = estimators(channels);
        let shown = handful(&names, &layout.emphasis);
        let style = style(STATES);
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
                since_ns: 0,
                told: 0,
                shown: shown.contains(name),
            });
        }
        Ok(Self {
            names,
            shown,
            lanes,
        })
    }

    /// Names of the estimators, in the order of the lanes.
    pub fn estimators(&self) -> &[String] {
        &self.names
    }

    /// Names of those that are shown together.
    pub fn shown(&self) -> &[String] {
        &self.shown
    }

    /// Sends the changes in a chunk, and returns the lasting changes of the estimators that are shown together.
    pub fn log(
        &mut self,
        stream: &mut MessageStream,
        chunk: &Chunk,
    ) -> Result<Vec<(i64, String)>, Error> {
        let mut changes = Vec::new();
        for (lane, name) in self.lanes.iter_mut().zip(&self.names) {
            let (mut ns, mut states) = (Vec::new(), Vec::new());
            for (row, &t) in chunk.time_ns.iter().enumerate() {
                let state = lane.at(chunk, row);
                if lane.state.replace(state) != Some(state) {
                    ns.push(t);
                    states.push(STATES[state].0);
                    lane.since_ns = t;
                }
                if lane.shown && lane.told != state && t - lane.since_ns >= LASTING_NS {
                    lane.told = state;
                    changes.push((lane.since_ns, format!("{name}: {}", STATES[state].0)));
                }
            }
            send_changes(stream, &lane.entity, ns, states)?;
        }
        Ok(changes)
    }
}

/// The estimators that are shown together: the one in the loop, then others that are not for reference only. If there
/// are none of these, the first of all.
fn handful(names: &[String], emphasis: &Emphasis<'_>) -> Vec<String> {
    let first = |n: &&String| Some(n.as_str()) == emphasis.in_loop;
    let judged = |n: &&String| !first(n) && !emphasis.references.contains(&n.as_str());
    let some = names
        .iter()
        .filter(first)
        .chain(names.iter().filter(judged));
    let mut shown: Vec<&String> = some.take(HANDFUL).collect();
    if shown.is_empty() {
        shown = names.iter().take(HANDFUL).collect();
    }
    let shown = names.iter().filter(|n| shown.contains(n));
    shown.cloned().collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handful_is_shown_and_the_one_in_the_loop_is_of_it() {
        let names: Vec<String> = ["a", "b", "c", "d", "e", "f", "g", "h"]
            .map(str::to_owned)
            .into();
        let shown = |in_loop, references: &[&str]| -> String {
            let emphasis = Emphasis {
                in_loop,
                references,
                ..Emphasis::default()
            };
            handful(&names, &emphasis).concat()
        };
        assert_eq!(shown(None, &[]), "abcde");
        assert_eq!(shown(Some("h"), &[]), "abcdh");
        assert_eq!(shown(Some("h"), &["a", "b"]), "cdefh");
        let all = ["a", "b", "c", "d", "e", "f", "g", "h"];
        assert_eq!(shown(None, &all), "abcde");
    }
}
