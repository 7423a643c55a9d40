//! Steering angle: angle of a car's front wheels against its axis, rad, + left.
//!
//! Real cars measure it at the steering wheel; ratio and play of the gear are errors of scale and quantisation here.

use crate::error::Error;
use crate::plant::Truth;
use crate::sensors::fault::FaultWindow;
use crate::sensors::shake::Ride;
use crate::sensors::signal_path::SignalPath;
use crate::sensors::value_sampler::SamplingMode;
use crate::sensors::{Instrument, InstrumentKind, SensorChannel, StepInterval};
use monorig_estimators::api::signals::{Measurand, Measurements, Slot};

const SLOT: Slot = Measurand::SteeringAngle.slot(0);

/// The steering angle of a car, as a data sheet names it.
pub const KIND: InstrumentKind = InstrumentKind {
    name: "steering_angle",
    unsuited: |car| (!car).then_some("a train is not steered"),
    build: |spec, on| {
        Ok(Box::new(SteeringAngle {
            path: SignalPath::scalar(KIND.name, SamplingMode::Instant, spec, on),
            before: None,
        }))
    },
};

/// The one steering-angle sensor of a car.
#[derive(Clone, Debug)]
struct SteeringAngle {
    path: SignalPath<1>,
    before: Option<f64>,
}

impl Instrument for SteeringAngle {
    fn name(&self) -> &str {
        KIND.name
    }

    fn rate_hz(&self) -> f64 {
        self.path.rate_hz()
    }

    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error> {
        let now = ideal(truth);
        let before = self.before.replace(now).unwrap_or(now);
        self.path
            .observe(step, Ride::at_imu(truth), [before], [now])?;
        SLOT.set(z, self.path.deliver(step.to_ns));
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        SLOT.set(z, self.path.ideal());
    }

    fn add_fault(&mut self, _unit: Option<usize>, fault: FaultWindow) {
        self.path.add_fault(fault);
    }

    fn channels(&self) -> Vec<SensorChannel> {
        SensorChannel::of(SLOT)
    }
}

/// The ideal value, rad; 0 for a vehicle that is not steered.
pub fn ideal(truth: &Truth) -> f64 {
    truth.road.map_or(0.0, |r| r.steering_rad)
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
