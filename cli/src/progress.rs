//! How far a run has come: a bar on a terminal, plain lines otherwise. All of it goes to standard error.

use crate::output::note;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Between two plain lines at least this long.
const PATIENCE: Duration = Duration::from_secs(10);

/// Positions of the bar.
const STEPS: u64 = 1000;

/// Progress of one run.
pub struct Progress {
    name: String,
    bar: Option<ProgressBar>,
    started: Instant,
    spoke: Instant,
}

impl Progress {
    /// A run called `name`.
    pub fn new(name: &str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(10));
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent} % {eta}") {
                bar.set_style(style);
            }
            bar.with_prefix(name.to_owned())
        });
        let now = Instant::now();
        Self { name: name.to_owned(), bar, started: now, spoke: now }
    }

    /// The run has come to this share of its way, 0…1.
    pub fn at(&mut self, share: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position((share * STEPS as f64) as u64);
        } else if self.spoke.elapsed() >= PATIENCE {
            note(&format!("{}: {:.0} %", self.name, share * 100.0));
            self.spoke = Instant::now();
        }
    }

    /// The run is over at `t_s`.
    pub fn done(&self, t_s: f64) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let took_s = self.started.elapsed().as_secs_f64();
        note(&format!(
            "{}: {t_s:.1} s simulated in {took_s:.2} s",
            self.name
        ));
    }
}

impl Drop for Progress {
    /// A run that breaks down leaves no half bar on the terminal.
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
