//! An instrument bolted to a link: accelerometer, gyro and inclinometer share this.

use super::mount;
use crate::error::{DataError, Error};
use crate::plant::{MountState, Truth};
use crate::sensors::fault::FaultWindow;
use crate::sensors::lean::Lean;
use crate::sensors::shake::Ride;
use crate::sensors::signal_path::{Align, SignalPath};
use crate::sensors::spec::InstrumentSpec;
use crate::sensors::{Fitting, Instrument, SensorChannel, StepInterval};
use monorig_estimators::api::signals::{Measurand, Measurements};

/// A quantity of `N` axes measured at a mount.
#[derive(Clone, Copy)]
pub struct MountQuantity<const N: usize> {
    /// Name in data sheets and events.
    pub name: &'static str,
    /// Name of a group of instruments in events.
    pub group: Option<&'static str>,
    /// The place of its samples in the measurements.
    pub measurand: Measurand,
    /// The ideal signal at both ends of a step, from the motion of the mount there.
    pub signal: fn(&MotionStep<'_>) -> [[f64; N]; 2],
}

/// Motion of a mount over a physics step.
pub struct MotionStep<'a> {
    /// At the begin of the step.
    pub before: &'a MountState,
    /// At its end.
    pub now: &'a MountState,
    /// Length of the step, s, above 0; of an empty step, at which both states are the same, 1 ns.
    pub dt_s: f64,
    /// Gravity, m/s².
    pub gravity_mps2: f64,
}

/// An instrument at a mount.
pub struct MountedInstrument<const N: usize> {
    quantity: MountQuantity<N>,
    mount: usize,
    path: SignalPath<N>,
    gravity_mps2: f64,
    lean: Option<Lean>,
    before: Option<MountState>,
}

impl<const N: usize> MountedInstrument<N>
where
    SignalPath<N>: Align<N>,
{
    /// An instrument at the mount that its specification names.
    pub fn boxed(
        quantity: MountQuantity<N>,
        path: SignalPath<N>,
        spec: &InstrumentSpec,
        on: &Fitting<'_>,
    ) -> Result<Box<dyn Instrument>, DataError>
    where
        Self: 'static,
    {
        Ok(Box::new(Self {
            mount: mount::find(on.train, quantity.name, &spec.mount)?,
            quantity,
            path,
            gravity_mps2: on.gravity_mps2,
            lean: spec.lean.map(|lean| Lean::new(&lean)),
            before: None,
        }))
    }
}

impl<const N: usize> Instrument for MountedInstrument<N>
where
    SignalPath<N>: Align<N>,
{
    fn name(&self) -> &str {
        self.quantity.name
    }

    fn group(&self) -> Option<&str> {
        self.quantity.group
    }

    fn rate_hz(&self) -> f64 {
        self.path.rate_hz()
    }

    fn mount(&self) -> Option<usize> {
        Some(self.mount)
    }

    fn measure(
        &mut self,
        step: StepInterval,
        truth: &Truth,
        z: &mut Measurements,
    ) -> Result<(), Error> {
        let mut now = truth.mounts[self.mount];
        if let Some(lean) = &mut self.lean {
            now = lean.apply(step.length_s(), truth.accel_mps2, &now);
        }
        let before = self.before.replace(now).unwrap_or(now);
        let [start, end] = (self.quantity.signal)(&MotionStep {
            before: &before,
            now: &now,
            dt_s: step.length_s(),
            gravity_mps2: self.gravity_mps2,
        });
        self.path.observe(step, Ride::at_imu(truth), start, end)?;
        let sample = self.path.deliver(step.to_ns);
        self.quantity.measurand.slot(0).set(z, sample);
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        self.quantity.measurand.slot(0).set(z, self.path.ideal());
    }

    fn add_fault(&mut self, _unit: Option<usize>, fault: FaultWindow) {
        self.path.add_fault(fault);
    }

    fn channels(&self) -> Vec<SensorChannel> {
        SensorChannel::of(self.quantity.measurand.slot(0))
    }
}
