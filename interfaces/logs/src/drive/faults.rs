//! Faults of a replayed log: those of the rig's sensors, and jitter, loss and lag, put on samples before they are
//! delivered.

use crate::map::{LogFault, LogFaultKind, Map};
use monorig_sim::config::scenario::Event;
use monorig_sim::error::Error;
use monorig_sim::sensors::fault::Faults;
use monorig_sim::sensors::stream::Stream;

/// Seed of the faults' random draws: the same log and map give the same samples.
const SEED: u64 = 1;

/// Faults of one channel.
#[derive(Clone, Debug)]
pub(super) struct ChannelFaults {
    vector: Faults<3>,
    scalar: Faults<1>,
    timing: Vec<Timing>,
    stream: Stream,
}

/// Jitter, loss or lag, and its time interval.
#[derive(Clone, Copy, Debug)]
struct Timing {
    from_s: f64,
    to_s: f64,
    /// Stamps are off by up to this, s.
    jitter_s: f64,
    /// Share of samples that are lost.
    loss: f64,
    /// Samples come later by this, with a later stamp, ns.
    lag_ns: i64,
}

impl ChannelFaults {
    pub(super) fn new(name: &str) -> Self {
        Self {
            vector: Faults::new(SEED, name),
            scalar: Faults::new(SEED, name),
            timing: Vec::new(),
            stream: Stream::new(SEED, &format!("{name}/timing")),
        }
    }

    /// Puts the faults on a sample: its stamp (ns of the replay), by how much it comes later (ns) and its value; none
    /// if it is not delivered.
    pub fn apply(
        &mut self,
        stamp_ns: i64,
        value: [f64; 3],
        is_vector: bool,
    ) -> Option<(i64, i64, [f64; 3])> {
        let t_s = stamp_ns as f64 * 1e-9;
        let value = if is_vector {
            let mut sensed = value;
            self.vector.disturb(t_s, &mut sensed);
            self.vector.hand_over(t_s, sensed)
        } else {
            let mut sensed = [value[0]];
            self.scalar.disturb(t_s, &mut sensed);
            self.scalar.hand_over(t_s, sensed).map(|[x]| [x, 0.0, 0.0])
        };
        let (mut stamp_ns, mut late_ns, mut lost) = (stamp_ns, 0i64, false);
        for w in self
            .timing
            .iter()
            .filter(|w| w.from_s <= t_s && t_s < w.to_s)
        {
            late_ns = late_ns.saturating_add(w.lag_ns);
            if w.loss > 0.0 {
                lost |= self.stream.uniform() < w.loss;
            }
            if w.jitter_s > 0.0 {
                let off_s = (2.0 * self.stream.uniform() - 1.0) * w.jitter_s;
                stamp_ns = stamp_ns.saturating_add((off_s * 1e9).round() as i64);
            }
        }
        let stamp_ns = stamp_ns.saturating_add(late_ns);
        value
            .filter(|_| !lost)
            .map(|value| (stamp_ns, late_ns, value))
    }
}

impl ChannelFaults {
    pub(super) fn push(&mut self, map: &Map, key: &str, fault: &LogFault) -> Result<(), Error> {
        let (from_s, to_s) = (fault.from_s, fault.to_s);
        if let Some(kind) = fault.fault.of_rig() {
            let event = Event::SensorFault {
                name: None,
                from_s,
                to_s,
                sensor: String::new(),
                fault: kind,
                size: fault.size,
                axis: None,
            };
            let window = event.sensor_fault();
            let window =
                window.map_err(|e| map.error(format!("{key}.{}", e.key), e.message, e.help))?;
            if let Some((_, window)) = window {
                self.vector.add(window);
                self.scalar.add(window);
            }
            return Ok(());
        }
        let size = fault.size.map_or(f64::NAN, |x| x.get());
        let is_loss = fault.fault == LogFaultKind::Loss;
        let is_lag = fault.fault == LogFaultKind::Lag;
        let good = if is_loss { 0.0..=1.0 } else { 0.0..=1000.0 };
        if !good.contains(&size) {
            let help = if is_loss {
                "`size`: share of the lost samples, 0 to 1"
            } else {
                "`size`: largest error of the stamps, or delay of the samples, 0 to 1000 ms"
            };
            return Err(map.error(format!("{key}.size"), "this fault needs a size", help));
        }
        self.timing.push(Timing {
            from_s: from_s.get(),
            to_s: to_s.map_or(f64::INFINITY, |t| t.get()),
            jitter_s: if is_loss || is_lag { 0.0 } else { size * 1e-3 },
            loss: if is_loss { size } else { 0.0 },
            lag_ns: if is_lag {
                (size * 1e6).round() as i64
            } else {
                0
            },
        });
        Ok(())
    }
}
