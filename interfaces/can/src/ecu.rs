//! An estimator behind frames: what runs on a controller.

use crate::answer::Answer;
use crate::frame::Frame;
use crate::signal::Numbers;
use crate::step::Steps;
use monorig_estimators::{Estimate, Estimator};

/// The frames of an estimator: what it is given, and its last answer.
pub struct Ecu {
    numbers: Numbers,
    steps: Steps,
    answer: Option<Answer>,
}

impl Ecu {
    /// Makes the estimator for a bus with these numbers.
    pub fn new(numbers: Numbers) -> Self {
        Self {
            numbers,
            steps: Steps::new(numbers),
            answer: None,
        }
    }

    /// Takes a frame; passes on the frames of the estimator's answer if the frame ends a step. A step that comes again
    /// is answered as before and not made again: its answer was lost.
    pub fn take(
        &mut self,
        estimator: &mut (impl Estimator + ?Sized),
        frame: &Frame,
        each: &mut impl FnMut(&Frame),
    ) {
        let Some(step) = self.steps.take(frame) else {
            return;
        };
        let again = self.answer.filter(|a| a.sequence == step.sequence);
        let before = match again {
            Some(answer) if answer.estimate.t == step.z.t => {
                return answer.frames(self.numbers, each);
            }
            _ => self.answer.map(|a| a.estimate).unwrap_or_default(),
        };
        if step.start {
            estimator.reset();
        }
        let made = estimator.step(&step.z, &step.u, step.dt_s);
        let answer = Answer {
            sequence: step.sequence,
            refused: made.is_err(),
            began: step.start || self.answer.is_none(),
            estimate: made.unwrap_or(Estimate {
                t: step.z.t,
                ..before
            }),
        };
        answer.frames(self.numbers, each);
        self.answer = Some(answer);
    }
}
