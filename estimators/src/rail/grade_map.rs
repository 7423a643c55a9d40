//! Grade map: the grade by place on the rail. From it a long train has the mean under its masses, and not only the
//! grade at its accelerometer.
//!
//! On an 18 m train that runs onto a ramp, the accelerometer at the front reads the whole ramp while most of the mass
//! still stands on the level. The force balance then holds with the mean over the mass in place of the grade at the
//! instrument:
//!
//! M g sin θ → Σ mᵢ g sin θ(s − dᵢ),  s chainage of the instrument, dᵢ how far behind it mass mᵢ rests
//!
//! The wheels will pass a little later over the rail that the accelerometer has read. So u(s) = f − v̇ = g sin θ(s) + b
//! is kept by place ([`GradeMap`]) and averaged over where the tare and the load rest. The accelerometer's bias b stays
//! in the mean, as it is the same at every place. Rail that the instrument has not read (ahead of it; behind it at the
//! start of a run) is extrapolated from the end of the rail read, and its standard deviation grows with the distance.
//! Samples of the regression need no answer at once: they wait until the rail has been read.
//!
//! The instrument pitches with the unit that carries it, and that unit is suspended at two stations: it reads the grade
//! under the unit's middle, not under itself.
//!
//! Source: ours. Liu et al. 2023 treat the train as a point; with both spans 0 so does this.

use crate::Real;
use crate::api::real::{floor, within};
use crate::api::signals::Vehicle;
use crate::api::snapshot::{Archive, State, state};

/// Places remembered.
const CELLS: usize = 128;
/// Cells whose values are kept added up; divides [`CELLS`].
const BLOCK: usize = 8;
/// Cells that the longest span is divided into: fewer than there are, so that a whole train fits.
const CELLS_PER_SPAN: Real = 100.0;
/// Shortest cell, m.
const MIN_CELL_M: Real = 0.1;
/// Way over which the gradient at an end of the known rail is taken, m.
const END_M: Real = 1.0;
/// Longest way that a filter's delay can make, m.
const MAX_DELAY_M: Real = 2.0;
/// Length beyond an end of the known rail over which its gradient is extrapolated, m.
const ONWARD_M: Real = 3.0;
/// Largest change of u per metre of unseen rail although the end of the seen rail is straight, m/s² per m (1 mrad/m:
/// the undulation of a roadway).
const UNSEEN_MPS2_PER_M: Real = 0.01;

/// Signals of a place: u = g sin θ + b, m/s², and the horizontal curvature without its sign, 1/m.
pub type AtPlace = [Real; 2];

/// Signals by place on the rail, over the last stretch run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradeMap {
    cell_m: Real,
    cells: [AtPlace; CELLS],
    /// Sums over the cells, block by block: a mean over a train need not add up all of them.
    blocks: [AtPlace; CELLS / BLOCK],
    /// First and last cell known.
    known: Option<[i64; 2]>,
}

/// Mean over a span of the rail.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// u and curvature.
    pub value: AtPlace,
    /// Standard deviation of u for the part of the span not seen, m/s².
    pub doubt_mps2: Real,
    /// Length of the span beyond the rail seen, m.
    pub unseen_m: Real,
}

impl Mean {
    fn add(&mut self, share: Real, [u, curvature]: AtPlace) {
        let [sum_u, sum_curvature] = self.value;
        self.value = [sum_u + share * u, sum_curvature + share * curvature];
    }
}

fn plus([a, b]: AtPlace, [c, d]: &AtPlace) -> AtPlace {
    [a + c, b + d]
}

impl GradeMap {
    /// Room for a stretch of `span_m` metres.
    pub fn new(span_m: Real) -> Self {
        Self {
            cell_m: (span_m / CELLS_PER_SPAN).max(MIN_CELL_M),
            cells: [[0.0; 2]; CELLS],
            blocks: [[0.0; 2]; CELLS / BLOCK],
            known: None,
        }
    }

    fn cell(&self, place_m: Real) -> i64 {
        floor(place_m / self.cell_m).clamp(-1e15, 1e15) as i64
    }

    fn slot(cell: i64) -> usize {
        cell.rem_euclid(CELLS as i64) as usize
    }

    /// Signals of a cell or, beyond the known rail, of its end.
    fn at(&self, cell: i64, [low, high]: [i64; 2]) -> AtPlace {
        let slot = Self::slot(cell.clamp(low, high));
        self.cells.get(slot).copied().unwrap_or_default()
    }

    fn put(&mut self, cell: i64, value: AtPlace) {
        let slot = Self::slot(cell);
        if let Some(place) = self.cells.get_mut(slot) {
            *place = value;
        }
        self.add_up(slot / BLOCK);
    }

    /// Adds up a block anew, so that no rounding gathers.
    fn add_up(&mut self, block: usize) {
        if let Some(cells) = self.cells.chunks_exact(BLOCK).nth(block)
            && let Some(sum) = self.blocks.get_mut(block)
        {
            *sum = cells.iter().fold([0.0; 2], plus);
        }
    }

    /// Sum over known cells.
    fn sum(&self, first: i64, last: i64, known: [i64; 2]) -> AtPlace {
        let (block, mut cell, mut sum) = (BLOCK as i64, first, [0.0; 2]);
        while cell <= last {
            let whole = cell.rem_euclid(block) == 0 && cell + block <= last + 1;
            if whole && let Some(block) = self.blocks.get(Self::slot(cell) / BLOCK) {
                sum = plus(sum, block);
                cell += BLOCK as i64;
            } else {
                sum = plus(sum, &self.at(cell, known));
                cell += 1;
            }
        }
        sum
    }

    /// The instrument is at `place_m` and reads `value`. Cells passed over since the last visit are filled in between.
    pub fn visit(&mut self, place_m: Real, value: AtPlace) {
        let (here, room) = (self.cell(place_m), CELLS as i64);
        let known = match self.known {
            Some([low, high]) if here >= low - room && here <= high + room => [low, high],
            _ => [here, here],
        };
        let [low, high] = known;
        let end = here.clamp(low, high);
        let from = self.at(end, known);
        let steps = (here - end).abs();
        for k in 1..steps {
            let share = k as Real / steps as Real;
            let between = [0, 1].map(|i: usize| match (from.get(i), value.get(i)) {
                (Some(a), Some(b)) => a + share * (b - a),
                _ => 0.0,
            });
            self.put(end + (here - end).signum() * k, between);
        }
        self.put(here, value);
        let [low, high] = [low.min(here), high.max(here)];
        self.known = Some(if here == low {
            [low, high.min(low + room - 1)]
        } else {
            [low.max(high - room + 1), high]
        });
    }

    /// Mean from `rear_m` to `front_m`; `None` before the first visit.
    pub fn mean(&self, rear_m: Real, front_m: Real) -> Option<Mean> {
        let known = self.known?;
        let [low, high] = known;
        let (first, last) = (self.cell(rear_m), self.cell(front_m));
        if !(0..=2 * CELLS as i64).contains(&(last - first)) {
            return None;
        }
        // Share of the span that a cell has.
        let whole = front_m - rear_m;
        let share = |cell: i64| {
            let start = (cell as Real * self.cell_m).max(rear_m);
            let end = ((cell + 1) as Real * self.cell_m).min(front_m);
            if whole > 1e-9 {
                ((end - start) / whole).max(0.0)
            } else {
                1.0 / (last - first + 1) as Real
            }
        };
        let mut mean = Mean::default();
        // Known rail: its ends count by their shares, all between alike.
        let (rear, front) = (low.max(first + 1), high.min(last - 1));
        for end in [Some(first), Some(last).filter(|last| *last > first)] {
            if let Some(end) = end.filter(|end| (low..=high).contains(end)) {
                mean.add(share(end), self.at(end, known));
            }
        }
        if rear <= front {
            mean.add(self.cell_m / whole, self.sum(rear, front, known));
        }
        // Unseen rail, behind and ahead: as the known ends, and their gradient for a while.
        for (end, inward, unseen) in [
            (low, 1, first..low.min(last + 1)),
            (high, -1, first.max(high + 1)..last + 1),
        ] {
            if unseen.is_empty() {
                continue;
            }
            let [u, curvature] = self.at(end, known);
            let gradient = self.gradient(known, end, inward);
            let mut beyond_m = 0.0;
            for cell in unseen {
                let (share, away_m) = (share(cell), (cell - end).abs() as Real * self.cell_m);
                mean.add(share, [u + gradient * away_m.min(ONWARD_M), curvature]);
                beyond_m += share * away_m;
                mean.unseen_m = mean.unseen_m.max(away_m);
            }
            mean.doubt_mps2 += beyond_m * (UNSEEN_MPS2_PER_M + gradient.abs());
        }
        Some(mean)
    }

    /// Growth of u per metre outwards at an end of the known rail, m/s² per m; 0 while too little is known.
    fn gradient(&self, known: [i64; 2], end: i64, inward: i64) -> Real {
        let [low, high] = known;
        let way = floor(END_M / self.cell_m).max(1.0);
        if high - low < way as i64 {
            return 0.0;
        }
        let ([u_end, _], [u_inside, _]) = (
            self.at(end, known),
            self.at(end + inward * way as i64, known),
        );
        (u_end - u_inside) / (way * self.cell_m)
    }

    /// Returns true if all rail up to `front_m` has been seen.
    fn seen_up_to(&self, front_m: Real) -> bool {
        let front = self.cell(front_m);
        self.known.is_some_and(|[_, high]| front <= high)
    }
}

/// The train's place on the remembered rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedTrain {
    rail: GradeMap,
    /// Way run, delayed like all filtered signals, m.
    place_m: Real,
    /// Way run as of now, m.
    now_m: Real,
    here: Option<AtPlace>,
    tare_kg: Real,
    tare_span_m: [Real; 2],
    load_span_m: [Real; 2],
    arm_m: Real,
}

/// Means over where tare and load rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadedGrade {
    /// Mean over the tare.
    pub tare: Mean,
    /// Mean over the load.
    pub load: Mean,
}

impl LoadedGrade {
    /// Mean of u over a whole train of `mass_kg` with a tare of `tare_kg`, m/s², and its doubt.
    pub fn whole(&self, tare_kg: Real, mass_kg: Real) -> (Real, Real) {
        let tare_share = (tare_kg / mass_kg.max(tare_kg)).min(1.0);
        let mix = |tare: Real, load: Real| load + tare_share * (tare - load);
        let ([tare, _], [load, _]) = (self.tare.value, self.load.value);
        (
            mix(tare, load),
            mix(self.tare.doubt_mps2, self.load.doubt_mps2),
        )
    }
}

impl LoadedGrade {
    /// Loaded grade of a point that reads `here`.
    pub fn point(here: AtPlace) -> Self {
        let here = Mean {
            value: here,
            ..Mean::default()
        };
        Self {
            tare: here,
            load: here,
        }
    }

    /// Mean curvature under the train, 1/m.
    pub fn curvature_per_m(&self) -> Real {
        let [_, curvature] = self.tare.value;
        curvature
    }
}

impl MappedTrain {
    /// Builds the mapped train from the vehicle's nominal values.
    pub fn new(vehicle: &Vehicle) -> Self {
        let ([a, b], [c, d]) = (vehicle.tare_span_m, vehicle.load_span_m);
        let span_m = b.max(d).max(0.0) - a.min(c).min(0.0);
        Self {
            rail: GradeMap::new(span_m),
            place_m: 0.0,
            now_m: 0.0,
            here: None,
            tare_kg: vehicle.tare_kg,
            tare_span_m: vehicle.tare_span_m,
            load_span_m: vehicle.load_span_m,
            arm_m: vehicle.imu_arm_m,
        }
    }

    /// The train moves at `speed_mps`; `delayed_mps` is that speed behind the filters that what is read, `now`, has
    /// passed too.
    pub fn step(&mut self, now: Option<AtPlace>, delayed_mps: Real, speed_mps: Real, dt: Real) {
        self.place_m += delayed_mps * dt;
        self.now_m += speed_mps * dt;
        // What was lost while a signal was missing must not stay between the two.
        let apart = within(self.now_m - self.place_m, -MAX_DELAY_M, MAX_DELAY_M);
        self.now_m = self.place_m + apart;
        self.here = now;
        if let Some(value) = now {
            self.rail.visit(self.place_m, value);
        }
    }

    /// Where the unit with the instrument is (was, by the delay of the filters), m run.
    pub fn place_m(&self) -> Real {
        self.place_m
    }

    /// Returns true if the rail ahead of the instrument under the train has been seen by now, for the train at
    /// `place_m`.
    pub fn seen(&self, place_m: Real) -> bool {
        let ([tare, _], [load, _]) = (self.tare_span_m, self.load_span_m);
        self.rail.seen_up_to(place_m - tare.min(load).min(0.0))
    }

    /// Loaded grade with the instrument's unit at `place_m`; `None` without an accelerometer.
    pub fn felt(&self, place_m: Real) -> Option<LoadedGrade> {
        self.here?;
        let mean =
            |[nearest, farthest]: [Real; 2]| self.rail.mean(place_m - farthest, place_m - nearest);
        Some(LoadedGrade {
            tare: mean(self.tare_span_m)?,
            load: mean(self.load_span_m)?,
        })
    }

    /// Loaded grade now, the delay of the filters made up, and u at the instrument now, m/s².
    pub fn felt_now(&self) -> Option<(LoadedGrade, Real)> {
        let place_m = self.now_m + self.arm_m;
        let [here_mps2, _] = self.rail.mean(place_m, place_m)?.value;
        Some((self.felt(self.now_m)?, here_mps2))
    }

    /// u under the middle of the instrument's unit now, m/s².
    pub fn unit_now(&self) -> Option<Real> {
        let [u, _] = self.rail.mean(self.now_m, self.now_m)?.value;
        Some(u)
    }

    /// Mass of the empty train, kg.
    pub fn tare_kg(&self) -> Real {
        self.tare_kg
    }
}

impl State for GradeMap {
    fn visit(&mut self, archive: &mut Archive) {
        let Self {
            cells,
            known,
            blocks: _,
            cell_m: _,
        } = self;
        cells.visit(archive);
        known.visit(archive);
        let whole = |[low, high]: [i64; 2]| low <= high && high.saturating_sub(low) < CELLS as i64;
        archive.require(known.is_none_or(whole));
        (0..CELLS / BLOCK).for_each(|block| self.add_up(block));
    }
}

state!(Mean { value, doubt_mps2, unseen_m; } where |this| this.doubt_mps2 >= 0.0);
state!(LoadedGrade { tare, load; });
state!(MappedTrain { rail, place_m, now_m, here; tare_kg, tare_span_m, load_span_m, arm_m });

#[cfg(test)]
#[path = "grade_map_tests.rs"]
mod tests;
