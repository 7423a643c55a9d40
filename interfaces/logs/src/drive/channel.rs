//! A channel: columns of a file in, samples in SI units out.

use super::faults::ChannelFaults;
use super::stamps::Stamps;
use crate::map::Many;
use crate::notation::Expression;
use crate::notation::Unit;
use crate::read::full_name;
use crate::read::merge::MergedRow;
use monorig_estimators::api::signals::{Measurand, Slot};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// The measurement that a channel becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Target {
    /// A sample of the measurements, in its unit. A motor torque is at the vehicle's gear ratio.
    Measured(Slot),
    /// Force at the rims, N.
    Force,
    /// Power of the motors that reaches the rims, W.
    Power,
    /// Commanded torque of a motor, N·m.
    CommandTorque(usize),
    /// Commanded clamp pressure, MPa.
    CommandClamp,
    /// Commanded share of the brake force.
    CommandBrake,
}

impl Target {
    /// True if motor torques are made of it.
    pub(crate) fn is_traction(self) -> bool {
        match self {
            Self::Measured(slot) => slot.measurand == Measurand::MotorTorque,
            target => matches!(target, Self::Force | Self::Power),
        }
    }
}

/// The way from three columns to a vector: bias off, unit, axes and mount in one matrix, lean.
#[derive(Clone, Debug)]
pub(super) struct VectorPath {
    /// True if it changes nothing: the values of the columns then are those of the channel to the last bit.
    pub is_identity: bool,
    /// In the unit of the columns.
    pub bias: [f64; 3],
    /// Bias found while standing, SI, in the axes of the vehicle.
    pub found_bias: Vector3<f64>,
    /// From the columns to forward, left, up.
    pub turn: Matrix3<f64>,
    /// rad per m/s².
    pub lean: f64,
}

/// A sample on its way: when it is delivered, when it was taken (ns of the replay), its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Waiting {
    pub deliver_ns: i64,
    pub stamp_ns: i64,
    pub value: [f64; 3],
}

/// A channel.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub target: Target,
    /// Its place in the map file, for errors.
    pub key: String,
    /// Index of its file.
    pub source: usize,
    /// One formula, or three; then, of a torque, the gear ratio.
    pub formulas: Vec<(Expression, Vec<usize>)>,
    /// Number of formulas that make the value itself: a row with a column of these makes a sample.
    pub main: usize,
    pub valid_if: Option<(Expression, Vec<usize>)>,
    /// Columns of all formulas, each once, the files that they are in, and their last values.
    pub slots: Vec<String>,
    pub sources: Vec<usize>,
    pub values: Vec<f64>,
    /// When the values came, ns of the replay; of columns of other files.
    pub came_ns: Vec<i64>,
    /// Table in which a slot was found.
    pub tables: Vec<Option<String>>,
    pub unit: Unit,
    /// Times the value, in SI.
    pub factor: f64,
    pub vector: Option<VectorPath>,
    pub latency_ns: i64,
    pub faults: Option<ChannelFaults>,
    pub waiting: VecDeque<Waiting>,
    /// True if the last row had a sample of it, whether that counts or not.
    pub offered: bool,
    /// Figures of its samples, for a check.
    pub watched: Option<Box<Stamps>>,
}

/// The columns of a table that go into a channel: slot and column.
#[derive(Clone, Debug, Default)]
pub(super) struct Binding {
    pub pairs: Vec<(usize, usize)>,
    /// The columns of the value where it is made of nothing else; one that is not used is not there in any row.
    direct: Option<[usize; 3]>,
    /// Of each pair: whether a new value of it makes a sample.
    of_value: Vec<bool>,
    /// True if the table has all columns of the channel: an empty field then is no value, and not the last one.
    whole: bool,
    /// True for a table of another file: its columns make no sample, and what they said last counts for a second.
    other: bool,
}

impl Channel {
    /// The slot of a column of a file.
    pub fn slot(&mut self, source: usize, column: &str) -> usize {
        let slots = self.slots.iter().zip(&self.sources);
        let known = |(name, of): (&String, &usize)| name == column && *of == source;
        match slots.into_iter().position(known) {
            Some(slot) => slot,
            None => {
                self.slots.push(column.to_owned());
                self.sources.push(source);
                self.came_ns.push(i64::MIN);
                self.values.push(f64::NAN);
                self.tables.push(None);
                self.slots.len() - 1
            }
        }
    }

    /// The other files of which it uses columns.
    pub fn others(&self) -> impl Iterator<Item = usize> {
        self.sources.iter().copied().filter(|s| *s != self.source)
    }

    /// Finds its columns in a table; an error names a column that is in two tables.
    pub fn bind(&mut self, row: &MergedRow) -> Result<Option<Binding>, String> {
        let Some(table) = row.table() else {
            return Ok(None);
        };
        let mut pairs = Vec::new();
        let of_file = |(_, source): &(&String, &usize)| **source == row.source;
        let own = self.sources.iter().filter(|s| **s == self.source).count();
        let slots = self.slots.iter().zip(&self.sources).enumerate();
        for (slot, (name, _)) in slots.filter(|(_, slot)| of_file(slot)) {
            let called = |c: &str| c == name || full_name(&table.name, c) == *name;
            let Some(column) = table.columns.iter().position(|c| called(&c.name)) else {
                continue;
            };
            if let Some(known) = self.tables.get_mut(slot) {
                if known.as_ref().is_some_and(|k| *k != table.name) {
                    return Err(format!(
                        "the column `{name}` is in two tables of the log, `{}` and `{}`",
                        known.as_deref().unwrap_or_default(),
                        table.name
                    ));
                }
                *known = Some(table.name.clone());
            }
            pairs.push((slot, column));
        }
        let other = row.source != self.source;
        let whole = !other && pairs.len() == own;
        let main = || self.formulas.iter().take(self.main);
        let of_value = |(slot, _): &(usize, usize)| main().any(|(_, slots)| slots.contains(slot));
        let of_value = pairs.iter().map(of_value).collect();
        let direct = self
            .direct(&pairs)
            .filter(|_| whole && own == self.slots.len());
        Ok((!pairs.is_empty()).then_some(Binding {
            pairs,
            direct,
            of_value,
            whole,
            other,
        }))
    }

    /// The columns of the value, if it is made of columns by themselves, always counts and has no gear ratio of its
    /// own.
    fn direct(&self, pairs: &[(usize, usize)]) -> Option<[usize; 3]> {
        let plain = self.valid_if.is_none() && self.formulas.len() == self.main;
        let mut columns = [usize::MAX; 3];
        for (place, (expression, slots)) in columns.iter_mut().zip(&self.formulas) {
            let slot = slots.first().filter(|_| expression.is_column())?;
            *place = pairs.iter().find(|(s, _)| s == slot)?.1;
        }
        plain.then_some(columns)
    }

    /// Takes the values of a row; the value of a new sample if it makes one, in SI units and the axes of the vehicle.
    // inlined for speed, with 16 channels a row: the three numbers stay in registers
    #[inline]
    pub fn take(&mut self, binding: &Binding, row: &[f64], t_ns: i64) -> Option<[f64; 3]> {
        if let Some(columns) = binding.direct {
            let raw = of_row(columns, row);
            let [a, b, c] = raw;
            self.offered = !(a.is_nan() && b.is_nan() && c.is_nan());
            return self.value(raw, 1.0);
        }
        let mut new = false;
        for (&(slot, column), of_value) in binding.pairs.iter().zip(&binding.of_value) {
            let x = row.get(column).copied().unwrap_or(f64::NAN);
            new |= *of_value && !x.is_nan();
            if (binding.whole || !x.is_nan())
                && let Some(place) = self.values.get_mut(slot)
            {
                *place = x;
                if binding.other
                    && let Some(came) = self.came_ns.get_mut(slot)
                {
                    *came = t_ns;
                }
            }
        }
        self.offered = new && !binding.other;
        if !self.offered {
            return None;
        }
        self.forget_old(t_ns);
        self.of_values()
    }

    /// Forgets values of other files that are older than a second.
    fn forget_old(&mut self, now_ns: i64) {
        let slots = self.sources.iter().zip(&self.came_ns);
        for ((source, came_ns), value) in slots.zip(&mut self.values) {
            if *source != self.source && now_ns.saturating_sub(*came_ns) > MAX_AGE_NS {
                *value = f64::NAN;
            }
        }
    }

    /// Counts the sample of a row for a check, if it had one: its stamp, and its value if it counts.
    #[inline]
    pub fn watch(&mut self, binding: &Binding, row: &[f64], t_ns: i64, value: Option<[f64; 3]>) {
        if self.watched.is_none() || !self.offered {
            return;
        }
        // a fault of the map is put behind the turn
        let mut columns = match (binding.direct, value.filter(|_| self.faults.is_some())) {
            (_, Some(value)) => value,
            (Some(columns), _) => of_row(columns, row),
            _ => self.raw(),
        };
        for (i, x) in columns.iter_mut().enumerate() {
            let formula = self.formulas.iter().take(self.main).nth(i);
            if formula.is_none_or(|(_, slots)| slots.is_empty()) {
                *x = f64::NAN; // not of the log
            }
        }
        if let Some(stamps) = &mut self.watched {
            stamps.see(t_ns, value, columns);
        }
    }

    /// The values of the formulas as the columns are now.
    fn raw(&self) -> [f64; 3] {
        let mut raw = [0.0; 3];
        for (x, (expression, slots)) in raw.iter_mut().zip(self.formulas.iter().take(self.main)) {
            *x = self.evaluate(expression, slots);
        }
        raw
    }

    /// The value of the columns as they are now; none if `valid_if` rejects it or it is not finite.
    fn of_values(&self) -> Option<[f64; 3]> {
        if self
            .valid_if
            .as_ref()
            .is_some_and(|(e, slots)| !e.holds(&self.gather(slots)))
        {
            return None;
        }
        let ratio = self.formulas.get(self.main);
        let ratio = ratio.map_or(1.0, |(e, slots)| self.evaluate(e, slots));
        self.value(self.raw(), ratio)
    }

    /// The value (SI units, axes of the vehicle) of the columns; none if it is not finite.
    #[inline]
    fn value(&self, raw: [f64; 3], ratio: f64) -> Option<[f64; 3]> {
        // number by number: as an array they go through memory, where what was just stored cannot be loaded at once
        let [x, y, z] = match &self.vector {
            Some(path) => path.apply(raw, &self.unit),
            None => [self.unit.to_si(raw[0]) * self.factor * ratio, 0.0, 0.0],
        };
        (x.is_finite() && y.is_finite() && z.is_finite()).then_some([x, y, z])
    }

    /// The value of a formula of these slots.
    fn evaluate(&self, expression: &Expression, slots: &[usize]) -> f64 {
        match slots {
            [slot] if expression.is_column() => self.values.get(*slot).copied().unwrap_or(f64::NAN),
            _ => expression.value(&self.gather(slots)),
        }
    }

    fn gather(&self, slots: &[usize]) -> [f64; MAX_TERMS] {
        let mut values = [f64::NAN; MAX_TERMS];
        for (value, slot) in values.iter_mut().zip(slots) {
            *value = self.values.get(*slot).copied().unwrap_or(f64::NAN);
        }
        values
    }

    /// Delivers the waiting samples that are due at `until_ns`, as one.
    #[inline]
    pub fn deliver(&mut self, until_ns: i64, many: Many) -> Option<Waiting> {
        let is_due = |w: &Waiting| w.deliver_ns <= until_ns;
        if !self.waiting.get(1).is_some_and(is_due) {
            return self.waiting.pop_front_if(|w| is_due(w));
        }
        let mut got: Option<Waiting> = None;
        let (mut count, mut sum, mut stamps) = (0i64, [0.0; 3], 0i128);
        while let Some(next) = self.waiting.pop_front_if(|w| is_due(w)) {
            count += 1;
            stamps += i128::from(next.stamp_ns);
            for (s, x) in sum.iter_mut().zip(next.value) {
                *s += x;
            }
            got = match (many, got) {
                (Many::Oldest, Some(first)) => Some(first),
                _ => Some(next),
            };
        }
        match (many, count) {
            (Many::Mean, 2..) => got.map(|w| Waiting {
                stamp_ns: (stamps / i128::from(count)) as i64,
                value: sum.map(|s| s / count as f64),
                ..w
            }),
            _ => got,
        }
    }
}

/// The values of these columns in a row.
#[inline]
fn of_row(columns: [usize; 3], row: &[f64]) -> [f64; 3] {
    columns.map(|column| row.get(column).copied().unwrap_or(0.0))
}

/// The value of a column of another file counts for this time, ns.
const MAX_AGE_NS: i64 = 1_000_000_000;
/// Most columns of one formula.
pub(super) const MAX_TERMS: usize = 16;

impl VectorPath {
    fn apply(&self, raw: [f64; 3], unit: &Unit) -> [f64; 3] {
        if self.is_identity {
            return raw.map(|x| unit.to_si(x));
        }
        let [a, b, c] = [0, 1, 2].map(|i: usize| {
            let (x, bias) = (
                raw.get(i).copied().unwrap_or(f64::NAN),
                self.bias.get(i).copied().unwrap_or(0.0),
            );
            unit.to_si(x - bias)
        });
        let v = self.turn * Vector3::new(a, b, c) - self.found_bias;
        // the body is pitched nose up by the lean, and the specific force of its axes turned back by it
        let (sin, cos) = (self.lean * v.x).sin_cos();
        [v.x * cos - v.z * sin, v.y, v.x * sin + v.z * cos]
    }
}
