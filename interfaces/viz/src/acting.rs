//! Faults of each instrument, and stretches of another adhesion, as lanes of states over time.

use crate::states::{send_changes, style};
use crate::stream::{MessageStream, entity};
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout, MarkedStretch, MarkedTime};
use rerun::EntityPath;

/// The state in which nothing acts, and the colours of the others.
const NOTHING: (&str, [u8; 3]) = ("no fault", [70, 72, 80]);
const FAULT: [u8; 3] = [205, 70, 60];
const ANOTHER_ADHESION: [u8; 3] = [150, 90, 200];

/// One lane for each instrument with a fault, and one for the rail.
pub struct ActingLanes(Vec<ActingLane>);

struct ActingLane {
    entity: EntityPath,
    acts: Acts,
    state: Option<String>,
}

enum Acts {
    Faults(Vec<MarkedTime>),
    /// Place of the IMU, by the channel of its chainage.
    Stretches(Vec<MarkedStretch>, usize),
}

impl Acts {
    /// Returns the state in a row.
    fn state(&self, chunk: &Chunk, row: usize) -> &str {
        let found = match self {
            Self::Faults(all) => {
                let t_s = chunk.time_ns[row] as f64 * 1e-9;
                let now = all.iter().find(|f| f.from_s <= t_s && t_s < f.to_s);
                now.map(|f| &f.what)
            }
            Self::Stretches(all, chainage) => {
                let column = chunk.values.get(*chainage);
                let at_m = column.and_then(|c| c.get(row)).copied();
                let at_m = at_m.unwrap_or(f64::NAN);
                let here = all.iter().find(|z| z.from_m <= at_m && at_m < z.to_m);
                here.map(|z| &z.what)
            }
        };
        found.map_or(NOTHING.0, String::as_str)
    }
}

impl ActingLanes {
    /// Colours of the lanes are logged here.
    pub fn begin(stream: &mut MessageStream, layout: &Layout<'_>) -> Result<Self, Error> {
        let mut lanes = Vec::new();
        let faults = layout.emphasis.faults;
        let mut names: Vec<&str> = faults.iter().map(|f| f.of.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        for name in names {
            let own = faults.iter().filter(|f| f.of == name).cloned().collect();
            lanes.push(lane(name, Acts::Faults(own)));
        }
        let mut channels = layout.channels.iter();
        let chainage = channels.position(|c| c.path == "truth/chainage");
        if let (false, Some(chainage)) = (layout.zones.is_empty(), chainage) {
            let acts = Acts::Stretches(layout.zones.to_vec(), chainage);
            lanes.push(lane("rail", acts));
        }
        for lane in &lanes {
            let (names, colour): (Vec<&str>, _) = match &lane.acts {
                Acts::Faults(all) => (all.iter().map(|f| f.what.as_str()).collect(), FAULT),
                Acts::Stretches(all, _) => {
                    let names = all.iter().map(|z| z.what.as_str());
                    (names.collect(), ANOTHER_ADHESION)
                }
            };
            let states = std::iter::once(NOTHING).chain(names.into_iter().map(|n| (n, colour)));
            stream.fixed(lane.entity.clone(), &style(states))?;
        }
        Ok(Self(lanes))
    }

    /// The entities of the lanes.
    pub fn entities(&self) -> Vec<EntityPath> {
        self.0.iter().map(|lane| lane.entity.clone()).collect()
    }

    /// Sends the changes in a chunk.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        for lane in &mut self.0 {
            let (mut ns, mut states) = (Vec::new(), Vec::new());
            for (row, &t) in chunk.time_ns.iter().enumerate() {
                let state = lane.acts.state(chunk, row);
                if lane.state.as_deref() != Some(state) {
                    lane.state = Some(state.to_owned());
                    ns.push(t);
                    states.push(state);
                }
            }
            send_changes(stream, &lane.entity, ns, states)?;
        }
        Ok(())
    }
}

fn lane(name: &str, acts: Acts) -> ActingLane {
    ActingLane {
        entity: entity(["acting", name]),
        acts,
        state: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_acts_in_its_window_and_a_stretch_where_the_train_is() {
        let fault = |from_s: f64, to_s: f64, what: &str| MarkedTime {
            from_s,
            to_s,
            of: "imu".into(),
            what: what.into(),
        };
        let faults = vec![fault(1.0, 2.0, "stuck"), fault(3.0, f64::INFINITY, "off")];
        let zone = MarkedStretch {
            from_m: 10.0,
            to_m: 20.0,
            what: "adhesion 0.12".into(),
        };
        let chunk = Chunk {
            time_ns: (0..5).map(|s| s * 1_000_000_000).collect(),
            values: vec![vec![0.0, 10.0, 15.0, 20.0, f64::NAN]],
            ..Chunk::default()
        };
        let states = |acts: &Acts| -> Vec<String> {
            (0..5)
                .map(|row| acts.state(&chunk, row).to_owned())
                .collect()
        };
        let nothing = NOTHING.0;
        let (faults, stretches) = (Acts::Faults(faults), Acts::Stretches(vec![zone], 0));
        assert_eq!(states(&faults), [nothing, "stuck", nothing, "off", "off"]);
        let slippery = "adhesion 0.12";
        let expected = [nothing, slippery, slippery, nothing, nothing];
        assert_eq!(states(&stretches), expected);
    }
}
