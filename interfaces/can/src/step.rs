//! Samples and command of a step as frames, and back.

use crate::SEQUENCES;
use crate::frame::Frame;
use crate::message::{Commanded, Message, Value};
use crate::signal::Numbers;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Command, Measurements, Sample, Shape, Slot};

/// A step for an estimator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// The new samples, and the instant of the step.
    pub z: Measurements,
    /// The command of the step.
    pub u: Command,
    /// Time since the step before, s.
    pub dt_s: f64,
    /// True for the first step: the estimator starts from its initial state.
    pub start: bool,
    /// Number of the step.
    pub sequence: u16,
}

impl Step {
    /// Passes the frames of a step for this number of drive units to `each`, with the frame of the step itself last.
    pub fn frames(&self, numbers: Numbers, drives: usize, each: &mut impl FnMut(&Frame)) {
        let mut send = |message: Message, values: &[Value]| {
            each(&message.encode(numbers, values).0);
        };
        for slot in Slot::all().filter(|s| on_vehicle(s, drives)) {
            if let Some(Sample { t, value }) = slot.get(&self.z) {
                let [x, y, z] = value.map(Value::Number);
                send(Message::Sample(slot), &[Value::Instant(t.ns()), x, y, z]);
            }
        }
        let now = Value::Instant(self.z.t.ns());
        let torques = self.u.motor_torque_nm.iter().take(drives).enumerate();
        let torques = torques.map(|(i, torque)| (Commanded::Torque(i), *torque));
        let others = [
            (Commanded::Clamp, self.u.clamp_pressure_mpa),
            (Commanded::Brake, self.u.brake),
        ];
        for (commanded, value) in torques.chain(others) {
            send(Message::Command(commanded), &[now, Value::Number(value)]);
        }
        let (dt, start) = (Value::Number(self.dt_s), Value::Flag(self.start));
        send(
            Message::Step,
            &[now, dt, start, Value::Sequence(self.sequence)],
        );
    }
}

fn on_vehicle(slot: &Slot, drives: usize) -> bool {
    slot.measurand.shape() != Shape::PerDrive || slot.index < drives
}

/// Steps joined from received frames.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    numbers: Numbers,
    next: Step,
    last: Option<Step>,
}

impl Steps {
    /// Makes a reader of steps with numbers of this kind.
    pub fn new(numbers: Numbers) -> Self {
        Self {
            numbers,
            ..Self::default()
        }
    }

    /// Takes a frame. Returns the step that it ends; frames of others are passed over. After steps that did not come,
    /// the time step is counted from the last one that did.
    pub fn take(&mut self, frame: &Frame) -> Option<Step> {
        let message = Message::of(frame.id).filter(|_| !frame.extended)?;
        match message {
            Message::Sample(slot) => {
                let [Value::Instant(ns), values @ ..] = message.decode::<4>(self.numbers, frame)?
                else {
                    return None;
                };
                let value = values.map(|v| match v {
                    Value::Number(x) => x,
                    _ => 0.0,
                });
                let t = Time::from_ns(ns);
                slot.set(&mut self.next.z, Some(Sample { t, value }));
                None
            }
            Message::Command(commanded) => {
                let [_, Value::Number(value)] = message.decode::<2>(self.numbers, frame)? else {
                    return None;
                };
                let u = &mut self.next.u;
                match commanded {
                    Commanded::Torque(index) => {
                        if let Some(torque) = u.motor_torque_nm.get_mut(index) {
                            *torque = value;
                        }
                    }
                    Commanded::Clamp => u.clamp_pressure_mpa = value,
                    Commanded::Brake => u.brake = value,
                }
                None
            }
            Message::Step => self.end(frame),
            _ => None,
        }
    }

    fn end(&mut self, frame: &Frame) -> Option<Step> {
        let values = Message::Step.decode::<4>(self.numbers, frame)?;
        let [
            Value::Instant(ns),
            Value::Number(dt_s),
            Value::Flag(start),
            Value::Sequence(sequence),
        ] = values
        else {
            return None;
        };
        let mut step = Step {
            dt_s,
            start,
            sequence,
            ..self.next
        };
        step.z.t = Time::from_ns(ns);
        if let Some(last) = &self.last
            && !start
            && sequence != (last.sequence + 1) % SEQUENCES
            && sequence != last.sequence
        {
            step.dt_s = step.z.t.since(last.z.t);
        }
        self.last = Some(step);
        self.next.z = Measurements::default();
        Some(step)
    }
}
