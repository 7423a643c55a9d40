//! An estimator outside the program in a run: each step is sent, and its answer is waited for.

use super::link::Link;
use super::real_time::RealTime;
use crate::foreign::checked;
use monorig_estimators::api::estimator::Internal;
use monorig_estimators::api::signals::{Command, Estimate, Measurements};
use monorig_estimators::{Error, Estimator, Real};
use monorig_sim::closed_loop::{AnswerCounter, AnswerCounts, WallClock};
use monorig_sim::config::scenario::{AnswerFaults, External};
use monorig_sim::interrupt;
use monorig_wire::SEQUENCES;
use monorig_wire::answer::{Answer, Answers, Came};
use monorig_wire::signal::Numbers;
use monorig_wire::step::Step;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time for every answer except the first.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time for an answer after the program was asked to end.
const LAST_WORD: Duration = Duration::from_millis(500);
/// Time between two checks for an answer in real time.
const LOOKS: Duration = Duration::from_micros(50);
/// Internal quantities of the estimator.
const INTERNALS: [Internal; 2] = [
    Internal::new("sent_again", "1"),
    Internal::new("began_again", "1"),
];

/// An estimator at the end of a connection.
pub(super) struct Outside {
    link: Box<dyn Link>,
    numbers: Numbers,
    drives: usize,
    answers: Answers,
    /// Number of the last step.
    sequence: u16,
    /// True before the first step after a reset.
    start: bool,
    /// Number of times that the last step was sent.
    times: u32,
    /// Number of steps that were sent more than once, and of steps in which the estimator said that it begins without a
    /// request.
    again: [u64; 2],
    /// The time, if it is real.
    real_time: Option<RealTime>,
    /// Counts of its answers, which the rig reads.
    counter: AnswerCounter,
    faults: AnswerFaults,
    /// Time for the first answer.
    start_time: Duration,
    /// True once a step was answered.
    answered: bool,
    /// True once the first step was answered in real time.
    begun: bool,
    /// Reason why the estimator no longer answers.
    lost: Option<String>,
}

/// Meaning of a frame from the other end.
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
    pub fn new(link: Box<dyn Link>, numbers: Numbers, drives: usize, external: &External) -> Self {
        Self {
            link,
            numbers,
            drives,
            answers: Answers::new(numbers),
            sequence: SEQUENCES - 1,
            start: true,
            times: 0,
            again: [0; 2],
            real_time: None,
            counter: AnswerCounter::default(),
            faults: external.faults,
            start_time: external.start(),
            answered: false,
            begun: false,
            lost: None,
        }
    }

    /// Makes the estimator for real time on a clock, with the counts of its answers in `counter`.
    pub fn on_clock(
        mut self,
        clock: Arc<WallClock>,
        deadline: Duration,
        counter: AnswerCounter,
    ) -> Self {
        self.real_time = Some(RealTime::new(clock, deadline, self.faults));
        self.counter = counter;
        self.counter.set(AnswerCounts::default());
        self
    }

    /// Sends a step and waits for its answer until the deadline: none if it has not come.
    fn ask_in_time(&mut self, step: &Step) -> Result<Option<Answer>, String> {
        let Some(time) = &mut self.real_time else {
            return self.ask(step).map(Some);
        };
        let t_s = step.z.t.s();
        if !self.begun {
            let answer = self.ask(step)?;
            self.link.never_wait()?;
            self.begun = true;
            if let Some(time) = &mut self.real_time {
                time.begin(t_s, Instant::now());
            }
            return Ok(Some(answer));
        }
        let link = self.link.as_mut();
        link.begin();
        let ns = step.z.t.ns();
        step.frames(self.numbers, self.drives, &mut |frame| link.put(frame, ns));
        let sent = Instant::now();
        time.send(step.sequence, t_s, sent)?;
        link.send()?;
        loop {
            let (answers, mut taken) = (&mut self.answers, Ok(None));
            link.receive(&mut |frame| {
                let came = answers.take(frame, step.z.t);
                if let Ok(before) = &taken {
                    let before = *before;
                    taken = time
                        .take(came, step.sequence, Instant::now())
                        .map(|a| a.or(before));
                }
            })?;
            let now = Instant::now();
            if let Some(answer) = taken?.or(time.released(step.sequence, now)) {
                return Ok(Some(answer));
            }
            if now.duration_since(sent) >= time.deadline {
                return Ok(None);
            }
            std::thread::sleep(LOOKS);
        }
    }

    /// Sends a step and waits for its answer.
    fn ask(&mut self, step: &Step) -> Result<Answer, String> {
        let Self { link, .. } = self;
        let (mut last, ns) = (0, step.z.t.ns());
        link.begin();
        step.frames(self.numbers, self.drives, &mut |frame| {
            last = frame.id;
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
                Judged::Answered(answer) => {
                    self.answered = true;
                    return Ok(answer);
                }
                Judged::Wrong(why) => return Err(why),
                Judged::Waiting => {}
            }
            if interrupt::requested() && begun.elapsed() > LAST_WORD {
                return Err("was interrupted".to_owned());
            }
            let time = match self.answered {
                true => PATIENCE,
                false => self.start_time,
            };
            if begun.elapsed() > time {
                let more = match self.answered {
                    true => "",
                    false => ", or set `start_s`",
                };
                return Err(format!(
                    "gives no answer within {} s to step {} (up to {last:X}): flush each answer{more}",
                    time.as_secs_f64(),
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

/// Judges received frames during the wait for an answer; `repeated` if the previous step was sent more than once and
/// may be answered more than once.
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
                "answers step {of} twice: two estimators may have the same identifier"
            )),
            _ => Judged::Wrong(format!("answers step {of}, but was given step {sequence}")),
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
        let answered = self.ask_in_time(&step);
        if let Some(time) = &self.real_time {
            self.counter.set(time.counts);
        }
        let began = matches!(answered, Ok(Some(answer)) if answer.began);
        self.again[0] += u64::from(self.times > 1);
        self.again[1] += u64::from(began && !step.start);
        match answered {
            Ok(None) => Err(Error::own("the answer did not come in time")),
            Ok(Some(answer)) if answer.refused => Err(Error::own("it refused the step")),
            Ok(Some(answer)) => checked(answer.estimate),
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
        for (value, count) in values.iter_mut().zip(self.again) {
            *value = count as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(sequence: u16) -> Came {
        Came::Answer(Answer {
            sequence,
            ..Answer::default()
        })
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
        assert!(words(answer(7), true).contains("answers step 7, but was given step 0"));
        assert!(words(Came::Incomplete(0), false).contains("without mass and grade"));
    }
}
