//! An estimator outside of the program in a run: each step is sent, and its answer is waited for.

use super::link::Link;
use crate::foreign::checked;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::{Error, Estimator, Real};
use monorig_wire::SEQUENCES;
use monorig_wire::answer::{Answer, Answers, Came};
use monorig_wire::signal::Numbers;
use monorig_wire::step::Step;
use std::time::{Duration, Instant};

/// Time for an answer, and for the first one of a process, which starts.
const PATIENCE: Duration = Duration::from_secs(2);
/// What it shows of itself.
const INTERNALS: [Internal; 1] = [Internal::new("sent_again", "1")];

/// An estimator at the end of a way.
pub(super) struct Outside {
    link: Box<dyn Link>,
    numbers: Numbers,
    drives: usize,
    answers: Answers,
    /// Number of the last step.
    sequence: u16,
    /// True before the first step after a reset.
    start: bool,
    /// Times that the last step was sent.
    times: u32,
    /// Steps that were sent more than once.
    sent_again: u64,
    /// Why it answers no more.
    lost: Option<String>,
}

/// What a frame from the other end means.
enum Judged {
    /// Nothing yet.
    Waiting,
    /// The answer to the step.
    Answered(Answer),
    /// No answer can come of it.
    Wrong(String),
}

impl Outside {
    /// One for a vehicle of so many drive units.
    pub fn new(link: Box<dyn Link>, numbers: Numbers, drives: usize) -> Self {
        Self {
            link,
            numbers,
            drives,
            answers: Answers::new(numbers),
            sequence: SEQUENCES - 1,
            start: true,
            times: 0,
            sent_again: 0,
            lost: None,
        }
    }

    /// Sends a step and waits for its answer.
    fn ask(&mut self, step: &Step) -> Result<Answer, String> {
        let Self { link, .. } = self;
        let (mut frames, mut last, ns) = (0, 0, step.z.t.ns());
        link.begin();
        step.frames(self.numbers, self.drives, &mut |frame| {
            (frames, last) = (frames + 1, frame.id);
            link.put(frame, ns);
        });
        let repeated = std::mem::replace(&mut self.times, 1) > 1;
        let begun = Instant::now();
        link.send()?;
        loop {
            let (answers, mut judged) = (&mut self.answers, Judged::Waiting);
            let came = link.receive(&mut |frame| {
                if matches!(judged, Judged::Waiting) {
                    judged = judge(answers.take(frame, step.z.t), step.sequence, repeated);
                }
            })?;
            match judged {
                Judged::Answered(answer) => return Ok(answer),
                Judged::Wrong(why) => return Err(why),
                Judged::Waiting => {}
            }
            if begun.elapsed() > PATIENCE {
                let s = PATIENCE.as_secs();
                return Err(format!(
                    "gives no answer within {s} s to {frames} frames up to {last:X}, step {}",
                    step.sequence
                ));
            }
            if !came {
                // lost on the way, or with an estimator that starts again
                self.times += 1;
                link.send()?;
            }
        }
    }
}

/// Judges what came while the answer to a step is waited for; `repeated` if the step before was sent more than once
/// and may be answered more than once.
fn judge(came: Came, sequence: u16, repeated: bool) -> Judged {
    let before = (sequence + SEQUENCES - 1) % SEQUENCES;
    match came {
        Came::Part => Judged::Waiting,
        Came::Answer(answer) if answer.sequence == sequence => Judged::Answered(answer),
        Came::Answer(Answer { sequence: of, .. }) | Came::Incomplete(of) => match of {
            _ if of == sequence => Judged::Wrong(format!(
                "answers step {of} without mass and grade: 240, 241 and then 243"
            )),
            _ if of == before && repeated => Judged::Waiting,
            _ if of == before => Judged::Wrong(format!(
                "answers step {of} twice: are there two of them on one identifier?"
            )),
            _ => Judged::Wrong(format!("answers step {of}, and was given step {sequence}")),
        },
    }
}

impl Estimator for Outside {
    fn step(&mut self, z: &Measurements, u: &Command, dt: Real) -> Result<Estimate, Error> {
        if let Some(why) = &self.lost {
            return Err(Error::broken(why));
        }
        self.sequence = (self.sequence + 1) % SEQUENCES;
        let step = Step {
            z: *z,
            u: *u,
            dt_s: dt,
            start: std::mem::take(&mut self.start),
            sequence: self.sequence,
        };
        let answered = self.ask(&step);
        self.sent_again += u64::from(self.times > 1);
        match answered {
            Ok(answer) if answer.refused => Err(Error::own("it refused the step")),
            Ok(answer) => checked(answer.estimate),
            Err(why) => {
                let why = format!("{} {why}", self.link.at());
                self.lost = Some(why.clone());
                Err(Error::broken(why))
            }
        }
    }

    fn reset(&mut self) {
        self.start = true;
    }

    fn internals(&self) -> &[Internal] {
        &INTERNALS
    }

    fn internal_values(&self, values: &mut [Real]) {
        if let [sent_again, ..] = values {
            *sent_again = self.sent_again as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use monorig_estimators::Time;

    fn answer(sequence: u16) -> Came {
        let mut answer = Answer::default();
        answer.sequence = sequence;
        answer.estimate.t = Time::from_ns(1);
        Came::Answer(answer)
    }

    /// Each mistake at the other end has words of its own, also where the numbers begin again.
    #[test]
    fn what_comes_is_judged_by_its_number() {
        let words = |came, repeated| match judge(came, 0, repeated) {
            Judged::Waiting => "waiting".into(),
            Judged::Answered(answer) => format!("answer {}", answer.sequence),
            Judged::Wrong(why) => why,
        };
        assert_eq!(words(answer(0), false), "answer 0");
        assert_eq!(words(Came::Part, false), "waiting");
        assert_eq!(words(answer(SEQUENCES - 1), true), "waiting");
        assert!(words(answer(SEQUENCES - 1), false).contains("twice"));
        assert!(words(answer(7), true).contains("answers step 7, and was given step 0"));
        assert!(words(Came::Incomplete(0), false).contains("without mass and grade"));
    }
}
