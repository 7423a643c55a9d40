//! Recorder: an observer that collects the channels of every step and hands them to sinks in chunks.

use super::channels::{self, ControlState, RowSource};
use super::moments::Moments;
use super::parquet::ParquetSink;
use super::{Channel, Chunk, Emphasis, ExtraChannels, Layout, MarkedStretch, MarkedTime, Sink};
use crate::closed_loop::Simulation;
use crate::closed_loop::estimators::RunningEstimator;
use crate::closed_loop::run::{Observer, StepFrame};
use crate::config::scenario::{Event, Record};
use crate::error::Error;
use crate::sensors::SensorChannel;
use std::path::Path;

/// Default of the least simulated time between two chunks, s.
const CHUNK_S: f64 = 30.0;
/// Approximate number of chunks of a long run: every chunk costs room in the files beside its values.
const CHUNKS: f64 = 60.0;
/// Largest number of values of a chunk without a given length: they are held in memory, 8 bytes each.
const MAX_CHUNK_VALUES: f64 = 4e6;
/// Rows at the full rate; after as many again at half of it, it is halved again, and so on: two hours at 50 Hz.
const FULL_RATE_ROWS: usize = 360_000;

/// Records a run.
pub struct Recorder<'a> {
    sinks: Vec<Box<dyn Sink + 'a>>,
    extra: Option<Box<dyn ExtraChannels + 'a>>,
    moments: Moments,
    chunk: Chunk,
    chunk_ns: i64,
    next_chunk_ns: i64,
    row_ns: i64,
    next_row_ns: i64,
    pose_ns: i64,
    next_pose_ns: i64,
    sensors: Vec<SensorChannel>,
    /// Newest value of each column since the last row; NaN if none arrived.
    latest: Vec<f64>,
    row: Vec<f64>,
    rows: usize,
    thin_at: usize,
    thin_poses_at: usize,
    pose_rows: usize,
}

impl Recorder<'static> {
    /// Makes a recorder into `channels.parquet` in this folder, which is made if missing.
    pub fn parquet(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let folder = folder.as_ref();
        std::fs::create_dir_all(folder).map_err(Error::at(folder))?;
        let sink = ParquetSink::create(folder.join("channels.parquet"))?;
        Ok(Self::new(vec![Box::new(sink)]))
    }
}

impl<'a> Recorder<'a> {
    /// A recorder into these sinks. It hands on what was recorded every 30 s of simulated time, in long runs less
    /// often; and after 360 000 rows it records at half the rate, and so on.
    pub fn new(sinks: Vec<Box<dyn Sink + 'a>>) -> Self {
        Self {
            sinks,
            extra: None,
            moments: Moments::default(),
            chunk: Chunk::default(),
            chunk_ns: 0,
            next_chunk_ns: 0,
            row_ns: 0,
            next_row_ns: 0,
            pose_ns: 0,
            next_pose_ns: 0,
            sensors: Vec::new(),
            latest: Vec::new(),
            row: Vec::new(),
            rows: 0,
            thin_at: FULL_RATE_ROWS,
            thin_poses_at: FULL_RATE_ROWS,
            pose_rows: 0,
        }
    }

    /// Passes on the recorded rows every `chunk_s` (s) of simulated time.
    pub fn every_s(mut self, chunk_s: f64) -> Self {
        self.chunk_ns = period_ns(1.0 / chunk_s);
        self
    }

    /// Adds these channels after the channels of the simulator.
    pub fn with(mut self, extra: impl ExtraChannels + 'a) -> Self {
        self.extra = Some(Box::new(extra));
        self
    }

    /// Records at the full rate for any length of the run.
    pub fn full_rate(mut self) -> Self {
        self.thin_at = usize::MAX;
        self.thin_poses_at = usize::MAX;
        self
    }

    /// Records an event.
    pub(crate) fn event(&mut self, time_ns: i64, text: String) {
        self.chunk.events.push((time_ns, text));
    }

    fn row(&mut self, f: &StepFrame<'_>) {
        let source = RowSource {
            truth: f.truth,
            sensors: &self.sensors,
            samples: &self.latest,
            control: ControlState {
                reference: *f.reference,
                perception: *f.perception,
                command: *f.command,
                drives: f.truth.drives.len(),
            },
            estimators: f.estimators,
        };
        channels::values(&source, &mut self.row);
        if let Some(extra) = &self.extra {
            extra.values(&mut self.row);
        }
        for (column, value) in self.chunk.values.iter_mut().zip(&self.row) {
            column.push(*value);
        }
        self.rows += 1;
    }

    fn poses(&mut self, f: &StepFrame<'_>) {
        for (column, (p, q)) in self.chunk.poses.iter_mut().zip(&f.truth.poses) {
            column.push(([p.x, p.y, p.z], [q.i, q.j, q.k, q.w]));
        }
        for (column, d) in self.chunk.wheel_angles.iter_mut().zip(&f.truth.drives) {
            column.push(d.wheel_angle_rad);
        }
    }

    fn flush(&mut self) -> Result<(), Error> {
        let c = &mut self.chunk;
        if c.time_ns.is_empty() && c.pose_time_ns.is_empty() && c.events.is_empty() {
            return Ok(());
        }
        for s in &mut self.sinks {
            s.chunk(c)?;
        }
        c.time_ns.clear();
        c.pose_time_ns.clear();
        c.events.clear();
        c.values.iter_mut().for_each(Vec::clear);
        c.poses.iter_mut().for_each(Vec::clear);
        c.wheel_angles.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

/// Channels of a simulation, in the order of the columns.
pub(crate) fn channels(simulation: &Simulation) -> Vec<Channel> {
    channels::channels(&RowSource {
        truth: simulation.plant.truth(),
        sensors: &simulation.sensors.channels(),
        samples: &[],
        control: ControlState::default(),
        estimators: &simulation.estimators,
    })
}

/// Stretches of another adhesion.
fn zones(events: &[Event]) -> Vec<MarkedStretch> {
    let zone = |event: &Event| match event {
        Event::Adhesion {
            from_m,
            to_m,
            adhesion,
            name,
            ..
        } => Some(MarkedStretch {
            from_m: from_m.get(),
            to_m: to_m.get(),
            what: match name {
                Some(name) => format!("{name}: adhesion {}", adhesion.get()),
                None => format!("adhesion {}", adhesion.get()),
            },
        }),
        _ => None,
    };
    events.iter().filter_map(zone).collect()
}

/// Faults of instruments.
fn faults(events: &[Event]) -> Vec<MarkedTime> {
    let fault = |event: &Event| match event {
        Event::SensorFault {
            from_s,
            to_s,
            sensor,
            fault,
            ..
        } => Some(MarkedTime {
            from_s: from_s.get(),
            to_s: to_s.map_or(f64::INFINITY, f64::from),
            of: sensor.clone(),
            what: format!("{fault:?}").to_lowercase(),
        }),
        _ => None,
    };
    events.iter().filter_map(fault).collect()
}

/// Simulated time between two chunks, s, of a run of at most `limit_s` (s) with this number of values in a row.
fn chunk_s(limit_s: f64, record: &Record, values: usize) -> f64 {
    let rate_hz = record.rate_hz.get().max(record.pose_rate_hz.get());
    let room_s = MAX_CHUNK_VALUES / (rate_hz * values.max(1) as f64);
    CHUNK_S.max((limit_s / CHUNKS).min(room_s))
}

/// Doubles the period after this number of rows, and again after as many further rows.
fn thin(rows: usize, at: &mut usize, period_ns: &mut i64) {
    if rows >= *at {
        *period_ns *= 2;
        *at = at.saturating_add(FULL_RATE_ROWS);
    }
}

fn period_ns(rate_hz: f64) -> i64 {
    libm::round(1e9 / rate_hz) as i64
}

impl Observer for Recorder<'_> {
    fn begin(&mut self, simulation: &Simulation) -> Result<(), Error> {
        let (scenario, train) = (&simulation.scenario, &simulation.train);
        let mut channels = channels(simulation);
        if let Some(extra) = &mut self.extra {
            channels.extend(extra.begin(simulation));
        }
        let obstacles = simulation.obstacles.iter();
        let obstacles: Vec<_> = obstacles.map(|o| (o.pose, o.size)).collect();
        let estimators = &simulation.estimators;
        let is_reference = |e: &&RunningEstimator| e.reference;
        let references: Vec<&str> = estimators
            .iter()
            .filter(is_reference)
            .map(|e| e.name.as_str())
            .collect();
        let in_loop = simulation.in_loop.and_then(|i| estimators.get(i));
        let emphasis = Emphasis {
            in_loop: in_loop.map(|e| e.name.as_str()),
            references: &references,
            faults: &faults(&scenario.file.events),
            recorded: simulation.plant.is_recorded(),
        };
        let layout = Layout {
            scenario: &scenario.name,
            seed: simulation.seed,
            why: &scenario.file.why,
            channels: &channels,
            train,
            rail: &simulation.rail_samples(),
            profile: simulation.rail.outline(),
            obstacles: &obstacles,
            zones: &zones(&scenario.file.events),
            emphasis,
        };
        for sink in &mut self.sinks {
            sink.begin(&layout)?;
        }
        self.moments = Moments::of(simulation);
        let record = &scenario.file.record;
        self.sensors = simulation.sensors.channels();
        self.latest = vec![f64::NAN; self.sensors.len()];
        self.row_ns = period_ns(record.rate_hz.get());
        self.pose_ns = period_ns(record.pose_rate_hz.get());
        if self.chunk_ns == 0 {
            let values = channels.len() + 7 * train.bodies.len();
            self.chunk_ns = period_ns(1.0 / chunk_s(simulation.end.after_s, record, values));
        }
        self.next_chunk_ns = self.chunk_ns;
        self.chunk.values = vec![Vec::new(); channels.len()];
        self.chunk.poses = vec![Vec::new(); train.bodies.len()];
        self.chunk.wheel_angles = vec![Vec::new(); train.drives.len()];
        Ok(())
    }

    fn wants_truth(&self, time_ns: i64) -> bool {
        time_ns >= self.next_row_ns || time_ns >= self.next_pose_ns
    }

    fn on_step(&mut self, f: &StepFrame<'_>) -> Result<(), Error> {
        if f.sampled {
            for (latest, channel) in self.latest.iter_mut().zip(&self.sensors) {
                if let Some(x) = (channel.value)(f.measurements) {
                    *latest = x;
                }
            }
        }
        if let Some(extra) = &mut self.extra {
            extra.step(f.truth);
        }
        for text in f.events {
            self.event(f.time_ns, text.clone());
        }
        if f.time_ns >= self.next_row_ns {
            self.chunk.time_ns.push(f.time_ns);
            self.row(f);
            let come = self.moments.come(f.truth.t_s, f.truth.chainage_m);
            self.chunk.events.extend(come.map(|text| (f.time_ns, text)));
            // A value stands in the row of the period it arrived in, and in no other.
            self.latest.fill(f64::NAN);
            while self.next_row_ns <= f.time_ns {
                self.next_row_ns += self.row_ns;
            }
            thin(self.rows, &mut self.thin_at, &mut self.row_ns);
        }
        if f.time_ns >= self.next_pose_ns {
            self.chunk.pose_time_ns.push(f.time_ns);
            self.poses(f);
            while self.next_pose_ns <= f.time_ns {
                self.next_pose_ns += self.pose_ns;
            }
            self.pose_rows += 1;
            thin(self.pose_rows, &mut self.thin_poses_at, &mut self.pose_ns);
        }
        if f.time_ns >= self.next_chunk_ns {
            self.next_chunk_ns += self.chunk_ns;
            self.flush()?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Error> {
        self.flush()?;
        for s in &mut self.sinks {
            s.finish()?;
        }
        Ok(())
    }
}
