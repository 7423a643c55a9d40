//! Rail memory: what was read of the rail, at evenly spaced nodes along the way run, over the last stretch.
//!
//! Each node holds u = sin θ + b/g as the accelerometer reads it, b the bias of its time, and the horizontal curvature
//! without its sign. u is the sum that is observed well. A reader takes off today's estimate of the bias, so old nodes
//! get better as that estimate does.
//!
//! Nodes are written by linear interpolation where the middle of the unit passes them, and kept in single precision.
//! The way run is a whole number of nodes and a rest, which stays exact however far a train runs.
//!
//! A way that nothing has measured well puts what was read before at a wrong distance. The memory keeps the standard
//! deviation of that distance, and forgets the rail when it can no longer place it.

use crate::Real;
use crate::api::real::{floor, stored, within};
use crate::api::snapshot::state;
use crate::tuning::{MEMORY, RAIL};

/// A place on the covered track: whole nodes and a rest of less than their distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    node: i64,
    rest_m: Real,
}

/// Rail at a place, from the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// u = sin θ + b/g.
    pub u: Real,
    /// Distance of the place ahead of the read rail, m; 0 on it.
    pub ahead_m: Real,
    /// Distance of the place behind the read rail, m; 0 on it.
    pub behind_m: Real,
}

/// The memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RailMemory {
    pitch_m: Real,
    /// u and the curvature at each node.
    nodes: [[f32; 2]; MEMORY.nodes],
    /// First and last node read.
    known: Option<[i64; 2]>,
    here: Place,
    last: Option<(Place, [Real; 2])>,
    /// Standard deviation of the distance to the read rail, m.
    doubt_m: Real,
    /// True if the train came to the first node unseen.
    unseen: bool,
}

impl RailMemory {
    /// Builds the rail memory for a train that reaches over `span_m`.
    pub fn new(span_m: Real) -> Self {
        Self {
            pitch_m: ((span_m + MEMORY.spare_m) / MEMORY.nodes as Real).max(MEMORY.min_pitch_m),
            nodes: [[0.0; 2]; MEMORY.nodes],
            known: None,
            here: Place::default(),
            last: None,
            doubt_m: 0.0,
            unseen: false,
        }
    }

    /// Adds the standard deviation of a covered distance, m, to the standard deviation of the distance to the read
    /// rail; returns true if the rail is forgotten because of it.
    pub fn doubt(&mut self, way_sd_m: Real) -> bool {
        self.doubt_m += way_sd_m;
        let lost = self.doubt_m > RAIL.edge_m;
        if lost {
            self.forget();
        }
        lost
    }

    /// Forgets the rail: the train came to where it is unseen.
    pub fn forget(&mut self) {
        (self.known, self.last) = (None, None);
        (self.doubt_m, self.unseen) = (0.0, true);
    }

    /// Returns true if rail has been read.
    pub fn is_known(&self) -> bool {
        self.known.is_some()
    }

    /// Standard deviation of the grade 9 m behind the read rail, rad.
    pub fn behind_sd_rad(&self) -> Real {
        let [seen, unseen] = RAIL.behind_sd_rad;
        if self.unseen { unseen } else { seen }
    }

    /// Standard deviation of the distance to the read rail, m.
    pub fn doubt_m(&self) -> Real {
        self.doubt_m
    }

    /// Place of the unit's middle.
    pub fn here(&self) -> Place {
        self.here
    }

    /// The place `offset_m` ahead of `place`.
    pub fn ahead(&self, place: Place, offset_m: Real) -> Place {
        let way = place.rest_m + within(offset_m, -1e6, 1e6);
        let nodes = floor(way / self.pitch_m);
        Place {
            node: place.node.saturating_add(nodes as i64),
            rest_m: within(way - nodes * self.pitch_m, 0.0, self.pitch_m),
        }
    }

    /// The place in the middle between two.
    pub fn between(&self, a: Place, b: Place) -> Place {
        let way = b.node.saturating_sub(a.node) as Real * self.pitch_m + b.rest_m - a.rest_m;
        self.ahead(a, 0.5 * way)
    }

    /// Moves on by `way_m` and reads `now` = [u, curvature] there; `None` if it cannot be read. Nodes passed meanwhile
    /// are filled by a straight line, once there is something to read again.
    pub fn step(&mut self, way_m: Real, now: Option<[Real; 2]>) {
        self.here = self.ahead(self.here, way_m);
        // What was read before goes out of the memory as the train runs on.
        self.doubt_m *= 1.0 - (way_m.abs() / (MEMORY.nodes as Real * self.pitch_m)).min(1.0);
        let Some(now) = now else { return };
        let (start, before) = self
            .last
            .replace((self.here, now))
            .unwrap_or((self.here, now));
        let (from, to) = (start.node, self.here.node);
        let whole = (to - from) as Real * self.pitch_m + self.here.rest_m - start.rest_m;
        if self.known.is_none() || (to - from).abs() > MEMORY.nodes as i64 {
            self.write(to, now);
        } else if to > from {
            // Nodes passed forwards: from + 1 … to.
            for k in 1..=to - from {
                let way = k as Real * self.pitch_m - start.rest_m;
                self.write(from + k, mix(before, now, way / whole));
            }
        } else if to < from {
            for k in 0..from - to {
                let way = k as Real * self.pitch_m + start.rest_m;
                self.write(from - k, mix(before, now, way / -whole));
            }
        }
    }

    fn write(&mut self, node: i64, value: [Real; 2]) {
        let room = MEMORY.nodes as i64;
        let seen = self
            .known
            .is_some_and(|[low, high]| (low..=high).contains(&node));
        let near = self
            .known
            .filter(|[low, high]| node >= low - 1 && node <= high + 1);
        let share = if seen { MEMORY.revisit } else { 1.0 };
        if let Some(place) = self.nodes.get_mut(slot(node)) {
            *place = mix(place.map(Real::from), value, share).map(stored);
        }
        self.known = Some(match near {
            None => [node, node],
            Some([low, high]) if node > high => [low.max(node - room + 1), node],
            Some([low, high]) if node < low => [node, high.min(node + room - 1)],
            Some(known) => known,
        });
    }

    fn node(&self, node: i64) -> [Real; 2] {
        self.nodes
            .get(slot(node))
            .map_or([0.0; 2], |node| node.map(Real::from))
    }

    /// Growth of u per metre at the front end.
    pub fn end_gradient(&self) -> Real {
        let Some([low, high]) = self.known else {
            return 0.0;
        };
        let count = floor(MEMORY.end_m / self.pitch_m).max(1.0) as i64;
        if high - low < count {
            return 0.0;
        }
        let ([end, _], [inside, _]) = (self.node(high), self.node(high - count));
        (end - inside) / (count as Real * self.pitch_m)
    }

    /// Returns the rail `offset_m` ahead of `place`: between nodes a straight line, beyond the front end its `gradient`
    /// for some metres, behind the rear end the value of that end.
    pub fn at(&self, place: Place, offset_m: Real, gradient: Real) -> Spot {
        let Some([low, high]) = self.known else {
            return Spot::default();
        };
        let Place { node, rest_m } = self.ahead(place, offset_m);
        let beyond = |from: i64| node.saturating_sub(from) as Real * self.pitch_m + rest_m;
        if node >= high {
            let [u, _] = self.node(high);
            let ahead_m = beyond(high);
            Spot {
                u: u + gradient * ahead_m.min(MEMORY.onward_m),
                ahead_m,
                behind_m: 0.0,
            }
        } else if node < low {
            let [u, _] = self.node(low);
            Spot {
                u,
                ahead_m: 0.0,
                behind_m: -beyond(low),
            }
        } else {
            let [u, _] = mix(self.node(node), self.node(node + 1), rest_m / self.pitch_m);
            Spot {
                u,
                ..Spot::default()
            }
        }
    }

    /// Horizontal curvature `offset_m` ahead of `place`, 1/m.
    pub fn curvature_per_m(&self, place: Place, offset_m: Real) -> Real {
        let Some([low, high]) = self.known else {
            return 0.0;
        };
        let node = self.ahead(place, offset_m).node.clamp(low, high);
        let [_, curvature] = self.node(node);
        curvature
    }

    /// Returns true if the rail up to `offset_m` ahead of `place` has been read.
    pub fn read_up_to(&self, place: Place, offset_m: Real) -> bool {
        let node = self.ahead(place, offset_m).node;
        self.known.is_some_and(|[_, high]| node < high)
    }
}

fn slot(node: i64) -> usize {
    node.rem_euclid(MEMORY.nodes as i64) as usize
}

/// Returns true if these can be the first and the last node read.
fn is_whole([low, high]: [i64; 2]) -> bool {
    low <= high && high.saturating_sub(low) < MEMORY.nodes as i64
}

fn mix([a, b]: [Real; 2], [c, d]: [Real; 2], share: Real) -> [Real; 2] {
    let share = within(share, 0.0, 1.0);
    [a + share * (c - a), b + share * (d - b)]
}

state!(RailMemory { nodes, known, here, last, doubt_m, unseen; pitch_m } where |this| this.known.is_none_or(is_whole));

state!(Place { node, rest_m; });

#[cfg(test)]
mod tests {
    use super::*;

    /// A rail whose grade is a known function of place, run over at a speed that varies.
    fn run(memory: &mut RailMemory, from_m: Real, to_m: Real) {
        let steps = 4_000;
        let way = (to_m - from_m) / steps as Real;
        for k in 1..=steps {
            let s = from_m + k as Real * way;
            memory.step(way, Some([0.05 * (0.3 * s).sin(), 0.01 * s.abs()]));
        }
    }

    #[test]
    fn what_was_read_is_found_again_at_its_place() {
        let mut memory = RailMemory::new(18.0);
        run(&mut memory, 0.0, 25.0);
        let here = memory.here();
        for back in [0.5, 3.3, 11.1, 20.0] {
            let spot = memory.at(here, -back, 0.0);
            let s = 25.0 - back;
            // Linear interpolation: error at most pitch²/8 of the second derivative.
            assert!((spot.u - 0.05 * (0.3 * s).sin()).abs() < 2e-5, "{back}");
            assert!((memory.curvature_per_m(here, -back) - 0.01 * s).abs() < 2e-3);
            assert_eq!((spot.ahead_m, spot.behind_m), (0.0, 0.0));
        }
        assert!(memory.read_up_to(here, -0.3) && !memory.read_up_to(here, 0.3));
        // Back again: a revisit changes nothing on the same rail.
        run(&mut memory, 25.0, 10.0);
        let spot = memory.at(memory.here(), 5.0, 0.0);
        assert!((spot.u - 0.05 * (0.3 * 15.0 as Real).sin()).abs() < 5e-5);
    }

    #[test]
    fn beyond_its_ends_it_goes_on_and_says_how_far() {
        let mut memory = RailMemory::new(18.0);
        for k in 0..500 {
            memory.step(0.01, Some([0.002 * k as Real * 0.01, 0.0]));
        }
        let gradient = memory.end_gradient();
        assert!((gradient - 0.002).abs() < 1e-5, "{gradient}");
        let ahead = memory.at(memory.here(), 2.0, gradient);
        assert!((ahead.u - 0.002 * 7.0).abs() < 1e-4 && (ahead.ahead_m - 2.0).abs() < 0.2);
        let behind = memory.at(memory.here(), -10.0, gradient);
        assert!(behind.u.abs() < 1e-5 && (behind.behind_m - 5.0).abs() < 0.2);
    }

    #[test]
    fn it_forgets_the_far_end() {
        let mut memory = RailMemory::new(18.0);
        run(&mut memory, 0.0, 100.0);
        assert!(memory.at(memory.here(), -50.0, 0.0).behind_m < 0.5);
        assert!(memory.at(memory.here(), -64.0, 0.0).behind_m > 5.0);
    }
}
