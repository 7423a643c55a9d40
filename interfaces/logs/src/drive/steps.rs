//! Rows into steps: at the end of each, what was delivered in it.

use super::channel::{Binding, Channel, Target, Waiting};
use super::plan::Plan;
use super::stamps::Stamps;
use crate::map::{Many, Map, Origin};
use crate::read::merge::{Merged, MergedRow};
use crate::wrong;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurand, Measurements, Sample, Vehicle};
use monorig_sim::error::Error;

/// The torque of a motor that came longer ago makes no sum with those of the others, ns.
const MAX_AGE_NS: i64 = 1_000_000_000;
/// Below this speed no force follows from a power, m/s.
const MIN_SPEED_MPS: f64 = 0.5;
/// Steps that a log may have beside those of its rows, and for each row: more are hours of work for nothing.
const FREE_STEPS: u64 = 1_000_000;
const STEPS_A_ROW: u64 = 1_000;

/// A step of the replay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Its end, ns of the replay.
    pub t_ns: i64,
    /// The samples that were delivered in it; stamps are in the time of the replay.
    pub z: Measurements,
    /// The last command recorded until its end; none of a log without.
    pub command: Option<Command>,
    /// Share of the brake force that was asked for last; 0 of a log without a brake.
    pub brake: f64,
    /// Segment of the log, from 0: gaps and runs begin new ones.
    pub segment: u32,
}

/// The channels that take something of a table, by place in the list.
type Bound = Vec<(usize, Binding)>;

/// A log that is played step by step.
pub struct Drive {
    merged: Merged,
    channels: Vec<Channel>,
    /// By part and table: the channels that take something of it. None until a row of it is seen.
    bindings: Vec<Vec<Option<Bound>>>,
    row: MergedRow,
    many: Many,
    vehicle: Vehicle,
    wheels_mps: Vec<f64>,
    torques_nm: Vec<f64>,
    torques_ns: Vec<i64>,
    /// Commanded torques, and the rest of the command.
    commanded_nm: Vec<f64>,
    command: Command,
    origin_ns: i64,
    step_ns: i64,
    until_ns: i64,
    gap_ns: i64,
    steps: i64,
    segment: u32,
    /// Piece of the last row of each part; none of one without a row so far.
    pieces: Vec<Option<u32>>,
    begun: bool,
    by_arrival: bool,
    samples: u64,
    /// Rows taken, and steps made.
    taken: u64,
    made: u64,
}

impl Drive {
    /// Opens the files of a map.
    pub fn open(map: &Map, plan: &Plan) -> Result<Self, Error> {
        let mut wanted = plan.wanted(map);
        super::reference::want(map, &mut wanted)?;
        let mut sources = map.sources(&wanted);
        for asked in plan.channels.iter().flat_map(Channel::others) {
            if let Some(source) = sources.get_mut(asked) {
                source.leads = true;
            }
        }
        let mut merged = Merged::open(&sources, map.by())?;
        columns_are_there(map, plan, &merged)?;
        let first_ns = merged.next_ns().unwrap_or(0);
        let origin_ns = match map.file.time.origin {
            Origin::First => first_ns,
            Origin::Zero => 0,
        };
        let trim = map.trim_ns();
        let (step_ns, from_ns) = (map.step_ns(), *trim.start());
        let mut row = MergedRow::default();
        let before = |t: i64| t.saturating_sub(origin_ns) < from_ns;
        while merged.next_ns().is_some_and(before) {
            merged.next(&mut row)?;
        }
        Ok(Self {
            origin_ns,
            merged,
            channels: plan.channels.clone(),
            bindings: Vec::new(),
            row,
            many: map.file.step.many,
            vehicle: plan.vehicle,
            wheels_mps: vec![f64::NAN; plan.wheels],
            torques_nm: vec![f64::NAN; plan.motors],
            torques_ns: vec![i64::MIN; plan.motors],
            commanded_nm: vec![0.0; plan.commanded],
            command: Command::default(),
            step_ns,
            until_ns: *trim.end(),
            gap_ns: map.segment_gap_ns(),
            // the first step ends at time zero or where the part that is played begins, with the row that stands there
            steps: from_ns.max(0).saturating_sub(1).div_euclid(step_ns),
            segment: 0,
            pieces: Vec::new(),
            begun: false,
            by_arrival: map.by() == crate::read::merge::By::Arrival,
            samples: 0,
            taken: 0,
            made: 0,
        })
    }

    /// Time zero of the replay, ns on the common clock of the log.
    pub(crate) fn origin_ns(&self) -> i64 {
        self.origin_ns
    }

    /// Samples of all channels so far.
    pub(crate) fn samples(&self) -> u64 {
        self.samples
    }

    /// The channels for which no column was seen so far, as their key in the map file and a column that is missing.
    pub(crate) fn missing(&self) -> Vec<(String, String)> {
        let mut missing = Vec::new();
        for channel in &self.channels {
            let slot = channel.tables.iter().position(Option::is_none);
            if let Some(column) = slot.and_then(|s| channel.slots.get(s)) {
                missing.push((channel.key.clone(), column.clone()));
            }
        }
        missing
    }

    /// The next step; `None` at the end of the log.
    pub fn next(&mut self, map: &Map) -> Result<Option<Step>, Error> {
        let mut step = Step::default();
        Ok(self.next_into(map, &mut step)?.then_some(step))
    }

    /// The next step in place of what `step` holds; false at the end of the log, where it is left as it is.
    pub(crate) fn next_into(&mut self, map: &Map, step: &mut Step) -> Result<bool, Error> {
        let next_ns = self.next_ns();
        let waits = self
            .channels
            .iter()
            .filter_map(|c| c.waiting.front())
            .map(|w| w.deliver_ns)
            .min();
        let Some(earliest) = [next_ns, waits].into_iter().flatten().min() else {
            return Ok(false);
        };
        let now_ns = self.steps.saturating_mul(self.step_ns);
        let jump = !self.begun && earliest > now_ns.saturating_add(self.gap_ns);
        if jump || (waits.is_none() && earliest > now_ns.saturating_add(self.gap_ns)) {
            // over the gap to the step in which the next row is
            self.steps = (earliest.saturating_sub(1)).div_euclid(self.step_ns);
            self.segment += u32::from(self.begun);
        }
        self.begun = true;
        self.steps += 1;
        self.made += 1;
        if self.made > FREE_STEPS + STEPS_A_ROW * self.taken {
            return Err(map.error(
                "step.rate_hz",
                format!("each row of this log would have more than {STEPS_A_ROW} steps"),
                "use fewer steps per second, or a shorter `time.segment_gap_s`: the steps of a longer gap are left out",
            ));
        }
        let until_ns = self.steps.saturating_mul(self.step_ns);
        while self.next_ns().is_some_and(|t| t <= until_ns) {
            self.merged.next(&mut self.row)?;
            self.take_row(map)?;
        }
        step.t_ns = until_ns;
        step.z = Measurements::at(Time::from_ns(until_ns));
        step.segment = self.segment;
        self.fill(&mut step.z, until_ns);
        step.command = (!self.commanded_nm.is_empty()).then(|| self.command());
        step.brake = self.command.brake;
        Ok(true)
    }

    /// The time of the next row that is played, ns of the replay; none at the end.
    fn next_ns(&self) -> Option<i64> {
        let next = self.merged.next_ns()?.saturating_sub(self.origin_ns);
        (next <= self.until_ns).then_some(next)
    }

    /// Starts to count the samples of each channel.
    pub(crate) fn watch(&mut self) {
        let channels = self.channels.iter_mut();
        channels.for_each(|c| c.watched = Some(Box::default()));
    }

    /// The channels with the figures of their samples.
    pub(crate) fn watched(&mut self) -> impl Iterator<Item = (Target, &mut Stamps)> {
        self.channels.iter_mut().filter_map(|c| {
            let stamps = c.watched.as_deref_mut()?;
            Some((c.target, stamps))
        })
    }

    fn take_row(&mut self, map: &Map) -> Result<(), Error> {
        self.taken += 1;
        let row = &self.row;
        if self.pieces.len() <= row.part {
            self.pieces.resize(row.part + 1, None);
        }
        let before = self.pieces.get_mut(row.part);
        let before = before.and_then(|piece| piece.replace(row.row.piece));
        self.segment += u32::from(before.is_some_and(|piece| piece != row.row.piece));
        let (part, table) = (row.part, row.row.table as usize);
        let known = self.bindings.get(part).and_then(|tables| tables.get(table));
        if !matches!(known, Some(Some(_))) {
            let mut bound = Vec::new();
            for (i, channel) in self
                .channels
                .iter_mut()
                .enumerate()
                .filter(|(_, c)| c.sources.contains(&row.source))
            {
                let binding = channel.bind(row).map_err(|message| {
                    map.error(
                        channel.key.clone(),
                        message,
                        "write `TABLE.COLUMN`; `monorig log info` shows the names",
                    )
                })?;
                bound.extend(binding.map(|b| (i, b)));
            }
            if self.bindings.len() <= part {
                self.bindings.resize_with(part + 1, Vec::new);
            }
            if let Some(tables) = self.bindings.get_mut(part) {
                if tables.len() <= table {
                    tables.resize_with(table + 1, || None);
                }
                if let Some(place) = tables.get_mut(table) {
                    *place = Some(bound);
                }
            }
        }
        let stamp_ns = row.row.stamp_ns.saturating_sub(self.origin_ns);
        let time_ns = match self.by_arrival {
            true => row.row.arrival_ns.saturating_sub(self.origin_ns),
            false => stamp_ns,
        };
        let bound = self.bindings.get(part).and_then(|tables| tables.get(table));
        for (i, binding) in bound.and_then(Option::as_ref).into_iter().flatten() {
            let Some(channel) = self.channels.get_mut(*i) else {
                continue;
            };
            let taken = channel.take(binding, &row.values, stamp_ns);
            let mut left = taken.map(|value| (stamp_ns, 0, value));
            if let (Some(faults), Some(value)) = (&mut channel.faults, taken) {
                left = faults.apply(stamp_ns, value, channel.vector.is_some());
            }
            let stamp = left.map_or(stamp_ns, |(stamp, ..)| stamp);
            let value = left.map(|(.., value)| value);
            channel.watch(binding, &row.values, stamp, value);
            let Some((stamp_ns, late_ns, value)) = left else {
                continue;
            };
            self.samples += 1;
            let deliver_ns = time_ns
                .saturating_add(channel.latency_ns)
                .saturating_add(late_ns);
            channel.waiting.push_back(Waiting {
                deliver_ns,
                stamp_ns,
                value,
            });
        }
        Ok(())
    }

    /// The command: a torque for each drive unit, or the sum of all in equal shares.
    fn command(&self) -> Command {
        let mut command = self.command;
        let (drives, sum_nm) = (self.vehicle.drives, self.commanded_nm.iter().sum::<f64>());
        let each = self.commanded_nm.len() == drives;
        let torques = command.motor_torque_nm.iter_mut().take(drives).enumerate();
        for (i, torque) in torques {
            *torque = match self.commanded_nm.get(i) {
                Some(own) if each => *own,
                _ => sum_nm / drives as f64,
            };
        }
        command
    }

    /// Puts what is delivered until `until_ns` into `z`.
    fn fill(&mut self, z: &mut Measurements, until_ns: i64) {
        let drives = self.vehicle.drives;
        let mut shared_torque = None;
        for channel in &mut self.channels {
            let many = match channel.target {
                Target::CommandTorque(_) | Target::CommandClamp | Target::CommandBrake => {
                    Many::Newest
                }
                _ => self.many,
            };
            let Some(w) = channel.deliver(until_ns, many) else {
                continue;
            };
            let t = Time::from_ns(w.stamp_ns);
            let [x, ..] = w.value;
            match channel.target {
                Target::Measured(slot) => {
                    let measured = match slot.measurand {
                        Measurand::WheelSpeed => self.wheels_mps.get_mut(slot.index),
                        Measurand::MotorTorque => {
                            if let Some(came) = self.torques_ns.get_mut(slot.index) {
                                *came = w.stamp_ns;
                            }
                            self.torques_nm.get_mut(slot.index)
                        }
                        _ => None,
                    };
                    if let Some(measured) = measured {
                        *measured = x;
                    }
                    let is_torque = slot.measurand == Measurand::MotorTorque;
                    match is_torque && self.torques_nm.len() != drives {
                        true => {
                            let young = |came: &i64| w.stamp_ns.saturating_sub(*came) <= MAX_AGE_NS;
                            if self.torques_ns.iter().all(young) {
                                shared_torque = Some((t, self.torques_nm.iter().sum::<f64>()));
                            }
                        }
                        false => slot.set(z, Some(Sample { t, value: w.value })),
                    }
                }
                Target::Force => {
                    shared_torque = Some((t, torque_of(&self.vehicle, x, &self.wheels_mps)))
                }
                Target::Power => {
                    let v = mean(&self.wheels_mps);
                    if v.abs() >= MIN_SPEED_MPS {
                        shared_torque =
                            Some((t, torque_of(&self.vehicle, x / v, &self.wheels_mps)));
                    }
                }
                Target::CommandTorque(i) => {
                    if let Some(torque) = self.commanded_nm.get_mut(i) {
                        *torque = x;
                    }
                }
                Target::CommandClamp => self.command.clamp_pressure_mpa = x,
                Target::CommandBrake => self.command.brake = x,
            }
        }
        // a force of the whole vehicle, or motors that are not one a drive unit, in equal shares
        if let Some((t, torque_nm)) = shared_torque.filter(|(_, torque)| torque.is_finite()) {
            for slot in z.motor_torque_nm.iter_mut().take(drives) {
                *slot = Some(Sample {
                    t,
                    value: torque_nm / drives as f64,
                });
            }
        }
    }
}

/// Refuses a plan with a column that is not in its file. A file whose columns show only when it is read (MCAP) is not
/// refused here.
fn columns_are_there(map: &Map, plan: &Plan, merged: &Merged) -> Result<(), Error> {
    for channel in &plan.channels {
        let mut slots = channel.slots.iter().zip(&channel.sources);
        let missing =
            slots.find(|(column, source)| merged.has_column(**source, column) == Some(false));
        if let Some((column, source)) = missing {
            let file = map.files.values().nth(*source);
            let path = file.cloned().unwrap_or_default();
            if merged.is_empty(*source) {
                let message = "this file has no row after the names of the columns";
                return Err(wrong(&path, None, message, "use a log with rows"));
            }
            let file = path.display();
            return Err(map.error(
                channel.key.clone(),
                format!("there is no column `{column}` in {file}"),
                "`monorig log info` shows the columns; an expression begins with `=`",
            ));
        }
    }
    Ok(())
}

/// The sum of the motor torques that estimators make this force (N) at the rims of: by gear, radius and efficiency,
/// which is on the other side while the vehicle drives its motors.
fn torque_of(vehicle: &Vehicle, force_n: f64, wheels_mps: &[f64]) -> f64 {
    let v = mean(wheels_mps);
    let drives = force_n * if v.is_finite() { v } else { 0.0 } >= 0.0;
    let efficiency = if drives {
        vehicle.efficiency
    } else {
        1.0 / vehicle.efficiency
    };
    force_n * vehicle.wheel_radius_m / (vehicle.gear_ratio * efficiency)
}

/// Mean of those that are known.
fn mean(x: &[f64]) -> f64 {
    let known = x.iter().filter(|x| x.is_finite());
    let (count, sum) = known.fold((0, 0.0), |(n, s), x| (n + 1, s + x));
    sum / f64::from(count)
}
