//! Two runs compared: what they were made from, their figures, and their errors over time in common plots.

mod changes;
mod curves;
mod figures;
mod signals;
mod two_runs;

pub use two_runs::Pair;

use crate::reports::page::{Block, Page, Section};
use crate::reports::run::recorded::Recorded;
use crate::reports::run::verdicts;
use crate::reports::table::{Cell, Table};
use crate::verdicts::judgement::Grade;
use crate::verdicts::signals::SignalComparison;
use monorig_sim::error::Error;

impl Pair {
    /// Lay out the report. `links` lead from its folder to those of A and B, each empty or with a slash at its end.
    pub fn page(&self, links: [&str; 2], signals: &SignalComparison) -> Result<Page, Error> {
        let [a, b] = [&self.a, &self.b].map(name);
        let mut page = Page::new(format!("{b} against {a}"));
        page.subtitle = format!("A: {a}. B: {b}. Differences are B minus A.");
        let changes = changes::of(self);
        page.banner = Some((changes::sentence(&changes), Grade::Unasked));
        page.sections.push(changes::section(&changes));
        page.sections.push(self.verdicts(links));
        page.sections.push(signals::section(self, signals)?);
        page.sections.push(figures::section(self));
        page.sections.push(curves::section(self)?);
        Ok(page)
    }

    /// Number of differences in the inputs of the two runs, in a sentence.
    pub fn sentence(&self) -> String {
        changes::sentence(&changes::of(self))
    }

    fn verdicts(&self, links: [&str; 2]) -> Section {
        let mut table = Table::new(&["", "run", "outcome"], &[]);
        let mut section = Section::new("Outcome");
        for (letter, run) in [("A", &self.a), ("B", &self.b)] {
            let (text, grade) = verdicts::banner(&run.summary);
            let outcome = Cell::from(text).graded(grade);
            table.row([letter.into(), name(run).into(), outcome]);
        }
        section = section.table(table);
        for (letter, run, link) in [("A", &self.a, links[0]), ("B", &self.b, links[1])] {
            for file in ["report.html", "run.rrd", "channels.parquet"] {
                if run.folder.join(file).is_file() {
                    let text = format!("{letter}: {file}");
                    let to = format!("{link}{file}");
                    section.blocks.push(Block::Link(text, to));
                }
            }
        }
        section
    }
}

/// Name of a run: scenario with variant, and seed.
fn name(run: &Recorded) -> String {
    format!("{}, seed {}", run.summary.scenario, run.summary.seed)
}
