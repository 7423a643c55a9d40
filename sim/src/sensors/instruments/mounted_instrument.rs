//! An instrument bolted to a link: accelerometer, gyro and inclinometer share this.

use super::fault::FaultWindow;
use super::lean::Lean;
use super::shake::Ride;
use super::signal_path::{Align, SignalPath, StepInterval};
use super::spec::InstrumentSpec;
use super::{Fitting, Instrument, SensorChannel, mount};
use crate::error::{DataError, Error};
use crate::plant::{MountState, Truth};
use monorig_estimators::api::signals::{Measurements, Sample};

/// A quantity of `N` axes measured at a mount.
#[derive(Clone, Copy)]
pub struct MountQuantity<const N: usize> {
    /// Name in data sheets and events.
    pub name: &'static str,
    /// Name of a group of instruments in events.
    pub group: Option<&'static str>,
    /// Path of the channel of each axis, below `sensors/`, and unit.
    pub channels: [(&'static str, &'static str); N],
    /// The ideal signal at both ends of a step, from the motion of the mount there.
    pub signal: fn(&MotionStep<'_>) -> [[f64; N]; 2],
    /// Puts its sample into the measurements.
    pub put: fn(&mut Measurements, Option<Sample<[f64; N]>>),
    /// Takes it out.
    pub take: fn(&Measurements) -> Option<[f64; N]>,
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
            mount: mount::find(on.train, quantity.name, &spec.mounting.link)?,
            quantity,
            path,
            gravity_mps2: on.gravity_mps2,
            lean: spec.mounting.lean.map(|lean| Lean::new(&lean)),
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
        (self.quantity.put)(z, self.path.deliver(step.to_ns));
        Ok(())
    }

    fn ideal(&self, z: &mut Measurements) {
        (self.quantity.put)(z, self.path.ideal());
    }

    fn add_fault(&mut self, _unit: Option<usize>, fault: FaultWindow) {
        self.path.add_fault(fault);
    }

    fn channels(&self) -> Vec<SensorChannel> {
        let take = self.quantity.take;
        let axes = self.quantity.channels.into_iter().enumerate();
        axes.map(|(i, (path, unit))| SensorChannel::new(path, unit, move |z| take(z).map(|v| v[i])))
            .collect()
    }
}
