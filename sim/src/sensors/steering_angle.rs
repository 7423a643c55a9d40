//! Steering angle: angle of a car's front wheels against its axis, rad, + left.
//!
//! Real cars measure it at the steering wheel; ratio and play of the gear are errors of scale and quantisation here.

use super::fault::Window;
use super::instrument::{Instrument, SamplingMode, StepInterval};
use crate::config::sensor_sheet_file::PlainSensor;
use crate::error::Error;
use crate::plant::Truth;
use monorig_estimators::api::signals::Sample;

/// Name in events and errors.
pub const NAME: &str = "steering_angle";

/// The one steering-angle sensor of a car.
#[derive(Clone, Debug)]
pub struct SteeringAngle {
    instrument: Instrument<1>,
    before: Option<f64>,
}

impl SteeringAngle {
    /// A sensor as the sheet has it.
    pub fn new(sheet: &PlainSensor, seed: u64) -> Self {
        Self {
            instrument: Instrument::new(
                NAME,
                SamplingMode::Instant,
                (&sheet.sampling, &sheet.errors),
                [("", 0.0)],
                seed,
            ),
            before: None,
        }
    }

    /// Add a fault.
    pub fn add_fault(&mut self, window: Window) {
        self.instrument.add_fault(window);
    }

    /// Look at the truth at the end of `span`; what arrived, if anything.
    pub fn measure(
        &mut self,
        span: StepInterval,
        truth: &Truth,
    ) -> Result<Option<Sample<f64>>, Error> {
        let now = ideal(truth);
        let before = self.before.replace(now).unwrap_or(now);
        self.instrument.observe(span, [before], [now])?;
        Ok(self.instrument.deliver(span.to_ns).map(plain))
    }

    /// The ideal value behind the sample last handed over.
    pub fn ideal(&self) -> Option<Sample<f64>> {
        self.instrument.ideal().map(plain)
    }
}

/// The ideal value, rad; 0 where nobody steers.
pub fn ideal(truth: &Truth) -> f64 {
    truth.road.map_or(0.0, |r| r.steering_rad)
}

fn plain(s: Sample<[f64; 1]>) -> Sample<f64> {
    Sample {
        t: s.t,
        value: s.value[0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::RoadState;

    #[test]
    fn it_is_the_angle_of_the_front_wheels() {
        let road = RoadState {
            steering_rad: -0.07,
            ..RoadState::default()
        };
        let truth = Truth {
            road: Some(road),
            ..Truth::default()
        };
        assert_eq!(ideal(&truth), -0.07);
    }
}
