//! The lines of plots: thinned if that is wished, and handed on in messages of many rows, since each costs as much as a
//! hundred of them.

use crate::gaps::GapFinder;
use crate::series::{PlottedSeries, plan};
use crate::source::ScalarSource;
use crate::stream::{MessageStream, send, times};
use crate::thinning::LineChunk;
use monorig_sim::error::Error;
use monorig_sim::record::{Chunk, Layout};
use re_sdk_types::archetypes::Scalars;

/// A message has so many rows, but for the last of its line.
pub const ROWS_A_MESSAGE: usize = 4096;
/// Thinned lines go through the smallest and the largest value of each period, ns: ten points a second.
const PERIOD_NS: i64 = 200_000_000;

/// All lines, and what is not yet sent of them.
pub struct PlottedLines {
    series: Vec<PlottedSeries>,
    pending: Vec<PendingLine>,
    thinned: bool,
}

/// Entity of a line.
struct PendingLine {
    gaps: GapFinder,
    time_ns: Vec<i64>,
    values: Vec<f64>,
    /// The largest value that was drawn, without its sign; not a number before there is one.
    largest: f64,
}

impl PlottedLines {
    /// Styles are logged here. Lines that are not thinned go through all rows.
    pub fn begin(
        stream: &mut MessageStream,
        layout: &Layout<'_>,
        thinned: bool,
    ) -> Result<Self, Error> {
        let series = plan(layout.channels, &layout.emphasis);
        for s in &series {
            stream.fixed(s.entity.clone(), &s.style())?;
        }
        let pending = series.iter().map(|s| PendingLine {
            gaps: GapFinder::new(s.is_sampled()),
            time_ns: Vec::new(),
            values: Vec::new(),
            largest: f64::NAN,
        });
        Ok(Self {
            pending: pending.collect(),
            series,
            thinned,
        })
    }

    /// The lines.
    pub fn series(&self) -> &[PlottedSeries] {
        &self.series
    }

    /// The largest value of each line so far, without its sign; not a number where there is none.
    pub fn largest(&self) -> Vec<f64> {
        self.pending.iter().map(|line| line.largest).collect()
    }

    /// Some seconds of the run.
    pub fn log(&mut self, stream: &mut MessageStream, chunk: &Chunk) -> Result<(), Error> {
        for (s, line) in self.series.iter().zip(&mut self.pending) {
            if let ScalarSource::Limit(limit) = s.line {
                let ends = [chunk.time_ns.first(), chunk.time_ns.last()];
                line.time_ns.extend(ends.into_iter().flatten());
                line.time_ns.dedup();
                line.values.resize(line.time_ns.len(), limit);
                line.largest = limit;
            } else {
                line.add(s, chunk, self.thinned);
            }
            if line.time_ns.len() >= ROWS_A_MESSAGE {
                line.flush(stream, s)?;
            }
        }
        Ok(())
    }

    /// Send what is left.
    pub fn flush(&mut self, stream: &mut MessageStream) -> Result<(), Error> {
        let mut lines = self.series.iter().zip(&mut self.pending);
        lines.try_for_each(|(s, line)| line.flush(stream, s))
    }
}

impl PendingLine {
    /// Rows without a finite value are left out, but for the first of a gap: that one is not a number, and the line
    /// breaks there.
    fn add(&mut self, series: &PlottedSeries, chunk: &Chunk, thinned: bool) {
        let width = series.line.width();
        let values = series.line.scalars(&chunk.values, chunk.time_ns.len());
        let all = LineChunk {
            time_ns: &chunk.time_ns,
            values: &values,
            width,
        };
        let written = all.written(&mut self.gaps);
        let kept = match thinned {
            false => written,
            true => all.thin(&written, PERIOD_NS),
        };
        for row in kept {
            let numbers = &values[row * width..(row + 1) * width];
            let whole = numbers.iter().all(|x| x.is_finite());
            if whole {
                self.largest = numbers.iter().fold(self.largest, |a, x| a.max(x.abs()));
            }
            let number = |x: &f64| if whole { *x } else { f64::NAN };
            self.time_ns.push(chunk.time_ns[row]);
            self.values.extend(numbers.iter().map(number));
        }
    }

    fn flush(&mut self, stream: &mut MessageStream, series: &PlottedSeries) -> Result<(), Error> {
        if self.time_ns.is_empty() {
            return Ok(());
        }
        let rows = self.time_ns.len();
        let columns = Scalars::new(std::mem::take(&mut self.values));
        let columns = columns.columns(std::iter::repeat_n(series.line.width(), rows));
        let time_ns = std::mem::take(&mut self.time_ns);
        send(stream, series.entity.clone(), times(time_ns), columns)
    }
}
