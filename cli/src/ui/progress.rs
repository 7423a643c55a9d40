//! Progress of a run on standard error: a bar on a terminal, plain lines otherwise.

use crate::ui::note::note;
use crate::ui::terminal;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use monorig_lab::text::spelled_out;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Shortest time between two plain lines.
const NOTE_INTERVAL: Duration = Duration::from_secs(10);

/// Positions of the bar.
const STEPS: u64 = 1000;

/// The progress of one run on the terminal.
pub struct ProgressDisplay {
    name: String,
    bar: Option<ProgressBar>,
    begun: Instant,
    last_note: Instant,
}

impl ProgressDisplay {
    /// Makes the progress of a run called `name`.
    pub fn new(name: &str) -> Self {
        let shown = std::io::stderr().is_terminal() && !terminal::quiet();
        let bar = shown.then(|| {
            let bar =
                ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(10));
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {percent} % {eta}")
            {
                bar.set_style(style);
            }
            bar.with_prefix(spelled_out(name))
        });
        Self {
            name: name.to_owned(),
            bar,
            begun: Instant::now(),
            last_note: Instant::now(),
        }
    }

    /// Changes the shown name.
    pub fn rename(&mut self, name: &str) {
        self.name = name.to_owned();
        if let Some(bar) = &self.bar {
            bar.set_prefix(spelled_out(name));
        }
    }

    /// Shows the share of the run that is done, 0…1.
    pub fn at(&mut self, share: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position((share * STEPS as f64) as u64);
        } else if self.last_note.elapsed() >= NOTE_INTERVAL {
            let left = match share {
                s if s > 0.0 => {
                    let left_s = self.begun.elapsed().as_secs_f64() * (1.0 - s) / s;
                    format!(", about {left_s:.0} s left")
                }
                _ => String::new(),
            };
            note(&format!("{}: {:.0} %{left}", self.name, share * 100.0));
            self.last_note = Instant::now();
        }
    }

    /// Does work that writes to the terminal; the bar is hidden meanwhile.
    pub fn aside<T>(&self, write: impl FnOnce() -> T) -> T {
        match &self.bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }
}

impl Drop for ProgressDisplay {
    /// Ends the progress after the run or its breakdown, and removes the bar from the terminal.
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
