//! The bound as channels of a recording: beside the errors in `channels.parquet`, in plots and in the viewer.

use super::{BoundSample, RunningBound};
use monorig_sim::closed_loop::Simulation;
use monorig_sim::plant::Truth;
use monorig_sim::record::{Channel, ChannelDescription, ExtraChannels};

/// Path, unit and description.
const CHANNELS: [(&str, &str, &str); 3] = [
    (
        "bound/total_mass",
        "kg",
        "Cramér-Rao bound of the total mass: the least standard deviation of its error.",
    ),
    (
        "bound/grade",
        "rad",
        "Cramér-Rao bound of the grade at the IMU.",
    ),
    (
        "bound/effective_grade",
        "rad",
        "Cramér-Rao bound of the effective grade.",
    ),
];

/// The kinds of channels, for lists.
pub fn descriptions() -> Vec<ChannelDescription> {
    let all = CHANNELS.iter();
    all.map(|&(path, unit, doc)| ChannelDescription {
        path: path.into(),
        unit,
        doc,
    })
    .collect()
}

/// Channels `bound/…` of a run; empty without a bound, as for a recorded drive.
#[derive(Default)]
pub struct BoundChannels {
    bound: Option<RunningBound>,
    /// Present sample, and the mass at its instant, kg.
    now: Option<(BoundSample, f64)>,
}

impl ExtraChannels for BoundChannels {
    fn begin(&mut self, simulation: &Simulation) -> Vec<Channel> {
        self.bound = RunningBound::of(simulation);
        let channels = CHANNELS.iter().filter(|_| self.bound.is_some());
        channels
            .map(|&(path, unit, _)| Channel {
                path: path.into(),
                unit,
            })
            .collect()
    }

    fn step(&mut self, truth: &Truth) {
        if let Some(bound) = &mut self.bound
            && bound.step(truth)
        {
            self.now = bound.now().map(|sample| (sample, truth.total_mass_kg));
        }
    }

    fn values(&self, row: &mut Vec<f64>) {
        if self.bound.is_some() {
            row.extend(match &self.now {
                Some((s, mass_kg)) => [s.mass_rel * mass_kg, s.slope_rad, s.effective_rad],
                None => [f64::NAN; 3],
            });
        }
    }
}
