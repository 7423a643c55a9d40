//! A log for the checks: windows of the force balance, the samples of each channel, and the lags of channels.

use super::lag::Lags;
use crate::drive::{Drive, Plan, Rate, Reference, Stamps, Target};
use crate::identify::{LastValues, Windows, known};
use crate::map::Map;
use monorig_sim::error::Error;

/// Figures of a channel.
#[derive(Clone, Debug)]
pub(super) struct ChannelFigures {
    pub target: Target,
    pub stamps: Stamps,
    pub rate: Rate,
}

/// Slower than this the vehicle may stand, m/s.
pub(super) const MOVING_MPS: f64 = 0.1;

/// Sums over the steps in which the vehicle moves and a wheel is known: of its speed, and of the mean of all, m/s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WheelSums {
    pub own: f64,
    pub all: f64,
    pub steps: usize,
}

/// A log, read once.
#[derive(Debug, Default)]
pub(super) struct Series {
    pub missing: Vec<(String, String)>,
    /// Figures of each channel.
    pub channels: Vec<ChannelFigures>,
    /// Windows with equal weights of force and acceleration; with the slope where the map has a reference of it.
    pub balance: Windows,
    /// Standard deviation of that reference, rad.
    pub slope_sd: f64,
    pub lags: Lags,
    pub wheels: Vec<WheelSums>,
    pub segments: u32,
    pub seconds: f64,
    pub samples: u64,
}

impl Series {
    /// Reads the log of a map.
    pub fn read(map: &Map, plan: &Plan) -> Result<Self, Error> {
        let mut drive = Drive::open(map, plan)?;
        drive.watch();
        let mut reference = Reference::load(map, drive.origin_ns())?;
        let mut series = Self::default();
        let (mut balance, vehicle) = (Windows::default(), &plan.vehicle);
        let mut last = LastValues::default();
        series.wheels = vec![WheelSums::default(); plan.wheels];
        while let Some(step) = drive.next(map)? {
            let lags = &mut series.lags;
            let over = &mut |tracks: &mut _| lags.add(tracks, vehicle);
            balance.see(&step, known(&mut reference, step.t_ns), vehicle, over);
            last.see(&step.z, vehicle);
            let speed = last.speed();
            for (sums, own) in series.wheels.iter_mut().zip(last.wheels()) {
                if let Some(own) = own.filter(|_| speed.abs() > MOVING_MPS) {
                    sums.own += own * speed.signum();
                    sums.all += speed.abs();
                    sums.steps += 1;
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
