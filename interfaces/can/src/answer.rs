//! An estimate as frames, and back.

use crate::frame::Frame;
use crate::message::{Message, Value};
use crate::signal::Numbers;
use monorig_estimators::Time;
use monorig_estimators::api::signals::{Estimate, Flags, Value as Estimated};

/// Answer to a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Answer {
    /// Number of the step.
    pub sequence: u16,
    /// The estimate; for a refused step the previous estimate.
    pub estimate: Estimate,
    /// True if the estimator refused the step.
    pub refused: bool,
    /// True of the first step that the estimator was given since it began.
    pub began: bool,
}

impl Answer {
    /// Passes the frames of the answer to `each`, with the frame of the motion last.
    pub fn frames(&self, numbers: Numbers, each: &mut impl FnMut(&Frame)) {
        use Value::{Flag, Number};
        let (e, sequence) = (&self.estimate, Value::Sequence(self.sequence));
        let mut send = |message: Message, values: &[Value]| {
            each(&message.encode(numbers, values).0);
        };
        let levels = &e.protection;
        for (message, v, level) in [
            (Message::Mass, e.total_mass_kg, levels.total_mass_kg),
            (Message::Grade, e.grade_rad, levels.grade_rad),
        ] {
            let (value, sd) = (Number(v.value), Number(v.sd));
            let values = [value, sd, Number(level), Flag(v.valid), sequence];
            send(message, &values);
        }
        let flags = &e.flags;
        let status = [
            Number(e.innovation),
            Number(e.nis),
            Flag(flags.moving),
            Flag(flags.excited),
            Flag(flags.saturated),
            Flag(self.refused),
            Flag(self.began),
            sequence,
        ];
        send(Message::Status, &status);
        let (grade, speed) = (e.effective_grade_rad, e.speed_mps);
        let motion = [
            Number(grade.value),
            Number(grade.sd),
            Number(speed.value),
            Number(speed.sd),
            Number(levels.effective_grade_rad),
            Flag(grade.valid),
            Flag(speed.valid),
            sequence,
        ];
        send(Message::Motion, &motion);
    }
}

/// Answers joined from received frames.
#[derive(Clone, Debug, Default)]
pub struct Answers {
    numbers: Numbers,
    next: Answer,
    /// Numbers of the steps of mass, grade and status.
    of: [Option<u16>; 3],
}

/// Result of reading a frame from an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Came {
    /// The frame is a part of an answer, or has another identifier.
    Part,
    /// The frame ends an answer.
    Answer(Answer),
    /// The frame ends an answer to a step, but the other frames are missing.
    Incomplete(u16),
}

impl Answers {
    /// Makes a reader of answers with numbers of this kind.
    pub fn new(numbers: Numbers) -> Self {
        Self {
            numbers,
            ..Self::default()
        }
    }

    /// Takes a frame. Returns the answer that it ends, for an estimate of the instant `t`.
    pub fn take(&mut self, frame: &Frame, t: Time) -> Came {
        let message = Message::of(frame.id).filter(|_| !frame.extended);
        let taken = message.and_then(|message| self.part(message, frame, t));
        taken.unwrap_or(Came::Part)
    }

    fn part(&mut self, message: Message, frame: &Frame, t: Time) -> Option<Came> {
        use Value::{Flag, Number, Sequence};
        let numbers = self.numbers;
        let [mass, grade, status] = &mut self.of;
        let e = &mut self.next.estimate;
        match message {
            Message::Mass | Message::Grade => {
                let [
                    Number(value),
                    Number(sd),
                    Number(level),
                    Flag(valid),
                    Sequence(of),
                ] = message.decode(numbers, frame)?
                else {
                    return None;
                };
                let levels = &mut e.protection;
                let (to, of_level, number) = match message {
                    Message::Mass => (&mut e.total_mass_kg, &mut levels.total_mass_kg, mass),
                    _ => (&mut e.grade_rad, &mut levels.grade_rad, grade),
                };
                (*to, *of_level) = (Estimated { value, sd, valid }, level);
                *number = Some(of);
            }
            Message::Status => {
                let [
                    Number(innovation),
                    Number(nis),
                    Flag(moving),
                    Flag(excited),
                    Flag(saturated),
                    Flag(refused),
                    Flag(began),
                    Sequence(of),
                ] = message.decode(numbers, frame)?
                else {
                    return None;
                };
                (e.innovation, e.nis) = (innovation, nis);
                e.flags = Flags {
                    moving,
                    excited,
                    saturated,
                };
                (self.next.refused, self.next.began) = (refused, began);
                *status = Some(of);
            }
            Message::Motion => {
                let [
                    Number(grade_rad),
                    Number(grade_sd),
                    Number(speed_mps),
                    Number(speed_sd),
                    Number(level),
                    Flag(grade_valid),
                    Flag(speed_valid),
                    Sequence(of),
                ] = message.decode(numbers, frame)?
                else {
                    return None;
                };
                let value = |value, sd, valid| Estimated { value, sd, valid };
                e.effective_grade_rad = value(grade_rad, grade_sd, grade_valid);
                e.speed_mps = value(speed_mps, speed_sd, speed_valid);
                e.protection.effective_grade_rad = level;
                if *mass != Some(of) || *grade != Some(of) {
                    return Some(Came::Incomplete(of));
                }
                let mut answer = self.next;
                if *status != Some(of) {
                    let e = &mut answer.estimate;
                    (e.innovation, e.nis, e.flags) = (0.0, 0.0, Flags::default());
                    (answer.refused, answer.began) = (false, false);
                }
                answer.sequence = of;
                answer.estimate.t = t;
                return Some(Came::Answer(answer));
            }
            _ => {}
        }
        Some(Came::Part)
    }
}
