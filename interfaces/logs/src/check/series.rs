//! A log for the checks: windows of a second, the samples of each channel, and the lags of channels.

use super::lag::Lags;
use crate::drive::{Drive, Plan, Rate, Reference, Stamps, Target};
use crate::identify::{Windows, known};
use crate::map::Map;
use monorig_sim::error::Error;

/// Length of a window, s.
pub(super) const WINDOW_S: f64 = 1.0;
/// Below this the vehicle stands, m/s.
const STANDING_MPS: f64 = 0.02;

/// Means of a window; not a number where nothing was delivered.
#[derive(Clone, Debug, Default)]
pub(super) struct Window {
    /// Segment of the log.
    pub segment: u32,
    /// Specific force and angular rate, in the axes of the vehicle.
    pub force: [f64; 3],
    pub rate: [f64; 3],
    /// Speed of each wheel, and of all.
    pub wheels: Vec<f64>,
    pub speed: f64,
    /// Largest speed of a wheel.
    pub fastest: f64,
}

impl Window {
    /// True if the vehicle stands; not known without a wheel.
    pub fn stands(&self) -> Option<bool> {
        self.speed
            .is_finite()
            .then_some(self.fastest < STANDING_MPS)
    }
}

/// Figures of a channel.
#[derive(Clone, Debug)]
pub(super) struct ChannelFigures {
    pub target: Target,
    pub stamps: Stamps,
    pub rate: Rate,
}

/// A log, read once.
#[derive(Debug, Default)]
pub(super) struct Series {
    pub windows: Vec<Window>,
    pub missing: Vec<(String, String)>,
    /// Figures of each channel.
    pub channels: Vec<ChannelFigures>,
    /// Windows with equal weights of force and acceleration; with the slope where the map has a reference of it.
    pub balance: Windows,
    /// Standard deviation of that reference, rad.
    pub slope_sd: f64,
    pub lags: Lags,
    pub segments: u32,
    pub seconds: f64,
    pub samples: u64,
}

#[derive(Default)]
struct WindowMeans {
    n: [u32; 6],
    sum: [f64; 6],
    wheels: Vec<(u32, f64)>,
    fastest: f64,
}

impl Series {
    /// Reads the log of a map.
    pub fn read(map: &Map, plan: &Plan) -> Result<Self, Error> {
        let mut drive = Drive::open(map, plan)?;
        drive.watch();
        let mut reference = Reference::load(map, drive.origin_ns())?;
        let mut series = Self::default();
        let (mut balance, vehicle) = (Windows::default(), &plan.vehicle);
        let mut sums = WindowMeans {
            wheels: vec![(0, 0.0); plan.wheels],
            ..WindowMeans::default()
        };
        let mut end: Option<(i64, u32)> = None;
        let window_ns = (WINDOW_S * 1e9) as i64;
        while let Some(step) = drive.next(map)? {
            let lags = &mut series.lags;
            let over = &mut |tracks: &mut _| lags.add(tracks, vehicle);
            balance.see(&step, known(&mut reference, step.t_ns), vehicle, over);
            let (until, segment) = *end.get_or_insert((step.t_ns + window_ns, step.segment));
            if step.t_ns >= until || step.segment != segment {
                series.windows.push(sums.window(segment));
                sums = WindowMeans {
                    wheels: vec![(0, 0.0); plan.wheels],
                    ..WindowMeans::default()
                };
                end = Some((step.t_ns + window_ns, step.segment));
            }
            let z = &step.z;
            for (first, sample) in [(0, z.specific_force_mps2), (3, z.angular_rate_radps)] {
                for (i, x) in (first..).zip(sample.iter().flat_map(|s| s.value)) {
                    sums.add(i, x);
                }
            }
            for (i, sample) in z.wheel_speed_mps.iter().take(plan.wheels).enumerate() {
                if let (Some(s), Some(wheel)) = (sample, sums.wheels.get_mut(i)) {
                    *wheel = (wheel.0 + 1, wheel.1 + s.value);
                    sums.fastest = sums.fastest.max(s.value.abs());
                }
            }
            series.segments = step.segment + 1;
            series.seconds = step.t_ns as f64 * 1e-9;
        }
        let lags = &mut series.lags;
        balance.finish(vehicle, &mut |tracks: &mut _| lags.add(tracks, vehicle));
        series.balance = balance;
        series.slope_sd = reference.slope_sd_rad;
        let figures = drive.watched().map(|(target, stamps)| {
            let rate = stamps.rate();
            ChannelFigures {
                target,
                stamps: stamps.clone(),
                rate,
            }
        });
        series.channels = figures.collect();
        series.samples = drive.samples();
        series.missing = drive.missing();
        Ok(series)
    }
}

impl WindowMeans {
    fn add(&mut self, i: usize, x: f64) {
        if let (Some(n), Some(sum)) = (self.n.get_mut(i), self.sum.get_mut(i)) {
            *n += 1;
            *sum += x;
        }
    }

    fn window(&self, segment: u32) -> Window {
        let mean = |i: usize| match (self.n.get(i), self.sum.get(i)) {
            (Some(n), Some(sum)) if *n > 0 => sum / f64::from(*n),
            _ => f64::NAN,
        };
        let wheels: Vec<f64> = self.wheels.iter().map(|(n, s)| s / f64::from(*n)).collect();
        let known: Vec<f64> = wheels.iter().copied().filter(|w| w.is_finite()).collect();
        Window {
            segment,
            force: [mean(0), mean(1), mean(2)],
            rate: [mean(3), mean(4), mean(5)],
            speed: known.iter().sum::<f64>() / known.len() as f64,
            wheels,
            fastest: self.fastest,
        }
    }
}
