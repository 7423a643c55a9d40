//! Sums of verdicts, as counts and in words. Terminal, lists and pages say it with these words, so that none of them is
//! greener than another.

use crate::verdicts::verdict::{Check, ScenarioVerdict, Tally};

/// The grade of a judgement: the colour in which it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// A check failed: red.
    Failed,
    /// Held, with known failures, undecided checks or weakened limits: yellow.
    HeldBut,
    /// All checks held: green.
    Held,
    /// Nothing was expected: grey.
    Unasked,
}

/// The checks of a scenario or of a run, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Judgement {
    /// All checks.
    pub checks: usize,
    /// Checks that fail.
    pub failed: usize,
    /// Checks that fail as a known failure.
    pub known: usize,
    /// Checks that could not be decided.
    pub not_judged: usize,
    /// Limits that are weaker than usual.
    pub weakened: usize,
    /// Bounds in the scenario, and checks added by other code. Without any, only the checks of every run are there.
    pub stated: usize,
}

impl Judgement {
    fn of(checks: &[Check], stated: usize, weakened: usize) -> Self {
        let count = |which: fn(&Check) -> bool| checks.iter().filter(|c| which(c)).count();
        Self {
            checks: checks.len(),
            failed: count(|c| !c.held),
            known: count(Check::fails_as_known),
            not_judged: count(|c| c.not_judged),
            weakened,
            stated,
        }
    }

    /// The grade.
    pub fn grade(&self) -> Grade {
        match self {
            j if j.failed > 0 => Grade::Failed,
            j if j.known + j.not_judged + j.weakened > 0 => Grade::HeldBut,
            j if j.stated == 0 => Grade::Unasked,
            _ => Grade::Held,
        }
    }

    /// Verdict in a few words, such as `held but for 2 known failures`.
    pub fn word(&self) -> String {
        match self.grade() {
            Grade::Failed => "FAILED".to_owned(),
            Grade::Unasked => "nothing was expected".to_owned(),
            Grade::Held => "held".to_owned(),
            Grade::HeldBut => {
                let with = match self.weakened {
                    0 => "held",
                    _ => "held with weakened limits",
                };
                match self.exceptions() {
                    but if but.is_empty() => with.to_owned(),
                    but => format!("{with} but for {but}"),
                }
            }
        }
    }

    /// Verdict in a sentence with its counts, such as `FAILED: 1 of 14 checks; 2 known failures`.
    pub fn words(&self) -> String {
        let all = self.checks;
        match self.grade() {
            Grade::Failed => {
                let but = match self.exceptions() {
                    but if but.is_empty() => but,
                    but => format!("; {but}"),
                };
                format!("FAILED: {} of {all} checks{but}", self.failed)
            }
            Grade::Unasked => format!("nothing was expected; the {all} checks of every run held"),
            _ => match all - self.known - self.not_judged {
                hold if hold == all => format!("{}: all {all} checks", self.word()),
                hold => format!("{}: {hold} of {all} checks hold", self.word()),
            },
        }
    }

    /// Exceptions of a verdict: known failures and checks that were not judged.
    fn exceptions(&self) -> String {
        let known = match self.known {
            0 => None,
            1 => Some("1 known failure".to_owned()),
            n => Some(format!("{n} known failures")),
        };
        let open = (self.not_judged > 0).then(|| format!("{} not judged", self.not_judged));
        let all: Vec<String> = known.into_iter().chain(open).collect();
        all.join(" and ")
    }
}

impl ScenarioVerdict {
    /// Sums up a verdict.
    pub fn judgement(&self) -> Judgement {
        let summaries = self.runs.iter().filter_map(|r| r.summary.as_ref());
        let stated = summaries.map(|s| s.expectations.len()).max().unwrap_or(0);
        let added = self.checks.iter().filter(|c| c.is_added()).count();
        Judgement::of(&self.checks, stated + added, self.weakened.len())
    }
}

impl Tally {
    /// Sums up the runs.
    pub fn judgement(&self) -> Judgement {
        Judgement::of(&self.checks(), self.stated(), self.weakened().count())
    }
}

/// The verdicts of many scenarios, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Scenarios that were judged.
    pub scenarios: usize,
    /// Scenarios that failed.
    pub failed: usize,
    /// Scenarios without expectations.
    pub unasked: usize,
    /// Scenarios with weakened limits.
    pub weakened: usize,
    /// Undecided checks of all scenarios.
    pub not_judged: usize,
    /// Known failures of all scenarios.
    pub known: usize,
    /// Runs of all scenarios.
    pub runs: usize,
}

impl Totals {
    /// Counts these verdicts.
    pub fn of<'a>(verdicts: impl IntoIterator<Item = &'a ScenarioVerdict>) -> Self {
        let mut all = Self::default();
        for verdict in verdicts {
            let judged = verdict.judgement();
            let grade = judged.grade();
            all.scenarios += 1;
            all.runs += verdict.runs.len();
            all.known += judged.known;
            all.failed += usize::from(grade == Grade::Failed);
            all.unasked += usize::from(grade == Grade::Unasked);
            all.weakened += usize::from(judged.weakened > 0);
            all.not_judged += judged.not_judged;
        }
        all
    }

    /// Grade of all scenarios together.
    pub fn grade(&self) -> Grade {
        match self {
            t if t.failed > 0 || t.scenarios == 0 => Grade::Failed,
            t if t.known + t.weakened + t.not_judged > 0 => Grade::HeldBut,
            t if t.unasked == t.scenarios => Grade::Unasked,
            _ => Grade::Held,
        }
    }

    /// Verdict in a sentence, such as `held but for 3 known failures: 2 scenarios, 8 runs`.
    pub fn words(&self) -> String {
        let counted = |n: usize, thing: &str| match n {
            1 => format!("1 {thing}"),
            n => format!("{n} {thing}s"),
        };
        let known = counted(self.known, "known failure");
        let (scenarios, runs) = (
            counted(self.scenarios, "scenario"),
            counted(self.runs, "run"),
        );
        let mut beside = Vec::new();
        let text = match self.grade() {
            Grade::Failed => {
                beside.extend((self.known > 0).then_some(known));
                format!("FAILED: {} of {scenarios}, {runs}", self.failed)
            }
            Grade::Unasked => return format!("nothing was expected: {scenarios}, {runs}"),
            Grade::HeldBut if self.known > 0 => {
                format!("held but for {known}: {scenarios}, {runs}")
            }
            _ => format!("held: {scenarios}, {runs}"),
        };
        let weakened = format!("{} with weakened limits", self.weakened);
        beside.extend((self.weakened > 0).then_some(weakened));
        let open = format!("{} not judged", counted(self.not_judged, "check"));
        beside.extend((self.not_judged > 0).then_some(open));
        let unasked = format!("nothing was expected of {}", self.unasked);
        beside.extend((self.unasked > 0).then_some(unasked));
        std::iter::once(text)
            .chain(beside)
            .collect::<Vec<_>>()
            .join("; ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(failed: usize, known: usize, weakened: usize, stated: usize) -> Judgement {
        Judgement {
            checks: 14,
            failed,
            known,
            not_judged: 0,
            weakened,
            stated,
        }
    }

    /// Only what hides nothing is green, and nothing that fails is anything but red.
    #[test]
    fn green_hides_nothing() {
        for (of, grade, words) in [
            (judged(0, 0, 0, 9), Grade::Held, "held: all 14 checks"),
            (
                judged(0, 2, 0, 9),
                Grade::HeldBut,
                "held but for 2 known failures: 12 of 14 checks hold",
            ),
            (
                judged(0, 1, 1, 9),
                Grade::HeldBut,
                "held with weakened limits but for 1 known failure: 13 of 14 checks hold",
            ),
            (
                judged(0, 0, 1, 0),
                Grade::HeldBut,
                "held with weakened limits: all 14 checks",
            ),
            (
                judged(0, 0, 0, 0),
                Grade::Unasked,
                "nothing was expected; the 14 checks of every run held",
            ),
            (
                judged(1, 2, 1, 9),
                Grade::Failed,
                "FAILED: 1 of 14 checks; 2 known failures",
            ),
            (judged(1, 0, 0, 0), Grade::Failed, "FAILED: 1 of 14 checks"),
        ] {
            assert_eq!((of.grade(), of.words().as_str()), (grade, words));
            assert!(of.words().starts_with(&of.word()), "{words}");
        }
    }

    #[test]
    fn the_total_is_no_greener_than_its_scenarios() {
        let total = |failed, known, unasked| Totals {
            scenarios: 3,
            failed,
            unasked,
            weakened: 0,
            not_judged: 0,
            known,
            runs: 8,
        };
        for (of, words) in [
            (total(0, 0, 0), "held: 3 scenarios, 8 runs"),
            (
                total(0, 4, 1),
                "held but for 4 known failures: 3 scenarios, 8 runs; nothing was expected of 1",
            ),
            (
                total(1, 1, 0),
                "FAILED: 1 of 3 scenarios, 8 runs; 1 known failure",
            ),
            (total(0, 0, 3), "nothing was expected: 3 scenarios, 8 runs"),
        ] {
            assert_eq!(of.words(), words);
        }
        assert_eq!(Totals::default().grade(), Grade::Failed);
    }
}
