//! An estimator outside the program in real time: an answer that has not come in time counts as not delivered.

use monorig_sim::closed_loop::{AnswerCounts, WallClock};
use monorig_sim::config::scenario::AnswerFaults;
use monorig_wire::answer::{Answer, Came};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time without any answer after which the estimator counts as missing.
const PATIENCE: Duration = Duration::from_secs(2);
/// Largest number of steps whose answers are awaited.
const MAX_SENT: usize = 4096;

/// The clock, and the status of the steps so far.
pub(super) struct RealTime {
    pub clock: Arc<WallClock>,
    pub deadline: Duration,
    faults: AnswerFaults,
    /// Steps without an answer, and when they were sent.
    sent: VecDeque<(u16, Instant)>,
    /// Answers that are delayed on purpose, and the ends of their delays.
    held: Vec<(Instant, Answer)>,
    last_answer: Instant,
    pub counts: AnswerCounts,
}

impl RealTime {
    pub fn new(clock: Arc<WallClock>, deadline: Duration, faults: AnswerFaults) -> Self {
        Self {
            clock,
            deadline,
            faults,
            sent: VecDeque::new(),
            held: Vec::new(),
            last_answer: Instant::now(),
            counts: AnswerCounts::default(),
        }
    }

    /// The first step was answered: the time begins.
    pub fn begin(&mut self, t_s: f64, now: Instant) {
        self.clock.set(t_s);
        self.last_answer = now;
    }

    /// A step for this time of the simulation, s, is sent. Without an answer for too long that is an error.
    pub fn send(&mut self, sequence: u16, t_s: f64, now: Instant) -> Result<(), String> {
        self.counts.rig_late += u64::from(now > self.clock.due(t_s));
        self.counts.asked += 1;
        self.counts.lost += 1;
        self.counts.latency_ms = f64::NAN;
        if self.sent.len() == MAX_SENT {
            self.sent.pop_front();
        }
        self.sent.push_back((sequence, now));
        match now.duration_since(self.last_answer) > PATIENCE {
            true => Err(format!(
                "has given no answer for {} s, step {sequence}",
                PATIENCE.as_secs()
            )),
            false => Ok(()),
        }
    }

    /// Takes received frames. Returns the answer to the step, if it is one that is not lost or held up on purpose.
    pub fn take(&mut self, came: Came, step: u16, now: Instant) -> Result<Option<Answer>, String> {
        let answer = match came {
            Came::Part => return Ok(None),
            Came::Incomplete(of) => {
                return Err(format!(
                    "answers step {of} without mass and grade: 240, 241 and then 243"
                ));
            }
            Came::Answer(answer) => answer,
        };
        let of = answer.sequence;
        if !self.sent.iter().any(|(sent, _)| *sent == of) {
            return Err(format!(
                "answers step {of} twice or without having received it; the last step was {step}"
            ));
        }
        self.last_answer = now;
        let hits = |every: Option<std::num::NonZeroU16>| every.is_some_and(|n| of % n == 0);
        if hits(self.faults.lose_every) {
            self.sent.retain(|(sent, _)| *sent != of);
            return Ok(None);
        }
        if hits(self.faults.delay_every) {
            let delay = Duration::from_secs_f64(self.faults.delay_ms.unwrap_or(0.0) * 1e-3);
            self.held.push((now + delay, answer));
            return Ok(None);
        }
        Ok(self.arrive(answer, step, now))
    }

    /// Returns the answer to the step from the answers whose delay has ended.
    pub fn released(&mut self, step: u16, now: Instant) -> Option<Answer> {
        let mut found = None;
        while let Some(k) = self.held.iter().position(|(until, _)| *until <= now) {
            let (_, answer) = self.held.swap_remove(k);
            found = self.arrive(answer, step, now).or(found);
        }
        found
    }

    /// Counts an answer. Returns it if it is that to the step.
    fn arrive(&mut self, answer: Answer, step: u16, now: Instant) -> Option<Answer> {
        let k = self
            .sent
            .iter()
            .position(|(sent, _)| *sent == answer.sequence)?;
        let (_, sent) = self.sent.remove(k)?;
        let ms = now.duration_since(sent).as_secs_f64() * 1e3;
        let counts = &mut self.counts;
        counts.latency_ms = counts.latency_ms.max(ms);
        counts.lost -= 1;
        if answer.sequence == step && now.duration_since(sent) <= self.deadline {
            return Some(answer);
        }
        counts.late += 1;
        None
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

    /// Answers in time, late, lost on purpose and held up on purpose are counted, each once; one that was given before,
    /// and silence, are errors.
    #[test]
    fn every_answer_is_counted_once() {
        let faults = AnswerFaults {
            lose_every: std::num::NonZeroU16::new(4),
            delay_every: std::num::NonZeroU16::new(5),
            delay_ms: Some(8.0),
        };
        let ms = Duration::from_millis;
        let clock = Arc::new(WallClock::new(1.0));
        let mut all = RealTime::new(clock.clone(), ms(2), faults);
        let begun = Instant::now();
        all.begin(0.0, begun);
        let mut in_time = Vec::new();
        for step in 1..=20_u16 {
            let now = begun + ms(5) * u32::from(step);
            // the clock is not asked: it is another one's
            all.send(step, 1e6, now).unwrap();
            in_time.extend(all.released(step, now));
            let late = if step == 7 { 3 } else { 1 };
            in_time.extend(all.take(answer(step), step, now + ms(late)).unwrap());
        }
        let numbers: Vec<u16> = in_time.iter().map(|a| a.sequence).collect();
        assert_eq!(numbers, [1, 2, 3, 6, 9, 11, 13, 14, 17, 18, 19]);
        // 20 is lost and not held up; 4, 8, 12, 16 are lost; 5, 10 and 15 come later, 7 came late
        let AnswerCounts {
            asked, late, lost, ..
        } = all.counts;
        assert_eq!((asked, late, lost), (20, 4, 5));
        let now = begun + ms(101);
        assert!(
            all.take(answer(19), 20, now)
                .unwrap_err()
                .contains("step 19 twice")
        );
        assert!(all.take(Came::Incomplete(3), 20, now).is_err());
        assert!(
            all.send(21, 1e6, now + ms(2100))
                .unwrap_err()
                .contains("no answer for 2 s")
        );
        assert_eq!(all.counts.rig_late, 0);
        clock.set(0.0);
        let _ = all.send(22, 0.0, Instant::now() + ms(1));
        assert_eq!(all.counts.rig_late, 1, "sent after it was due");
    }
}
