//! How far a run has come: a bar on a terminal, plain lines otherwise. All of it goes to standard error.

use crate::output::note;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Between two plain lines at least this long.
const PATIENCE: Duration = Duration::from_secs(10);

/// Progress of one run.
pub struct Progress {
    name: String,
    end_s: f64,
    bar: Option<ProgressBar>,
    started: Instant,
    spoke: Instant,
}

impl Progress {
    /// A run called `name` that goes to `end_s` of simulated time at most.
    pub fn new(name: &str, end_s: f64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::with_draw_target(
                Some(milliseconds(end_s)),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {msg} {eta}") {
                bar.set_style(style);
            }
            bar.with_prefix(name.to_owned())
        });
        let now = Instant::now();
        Self {
            name: name.to_owned(),
            end_s,
            bar,
            started: now,
            spoke: now,
        }
    }

    /// The run has come to `t_s`.
    pub fn at(&mut self, t_s: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position(milliseconds(t_s));
            bar.set_message(format!("{t_s:.1} s"));
        } else if self.spoke.elapsed() >= PATIENCE {
            note(&format!("{}: {t_s:.1} of {:.1} s", self.name, self.end_s));
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

fn milliseconds(t_s: f64) -> u64 {
    (t_s.max(0.0) * 1e3) as u64
}
