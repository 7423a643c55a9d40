//! Takes values of a signal that is linear between physics steps: at an instant, or as the mean since the instant
//! before.

use super::low_pass::LowPass;
use super::step_interval::StepInterval;

/// Sampling mode of an instrument: what one value stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplingMode {
    /// Value of the signal at the instant.
    Instant,
    /// Mean of the signal since the last instant.
    Integrating,
}

/// Values of a signal of `N` axes at the instants of a schedule.
#[derive(Clone, Debug)]
pub struct ValueSampler<const N: usize> {
    mode: SamplingMode,
    low_pass: Option<LowPass<N>>,
    span: StepInterval,
    start: [f64; N],
    end: [f64; N],
    /// Time up to which the span is integrated, ns.
    here_ns: i64,
    /// Integral of the signal since `since_ns`, unit·ns; `None` before the first instant.
    since_ns: Option<i64>,
    integral: [f64; N],
}

impl<const N: usize> ValueSampler<N> {
    /// Makes a sampler without values; `bandwidth_hz` is the corner of the low-pass of the signal.
    pub fn new(mode: SamplingMode, bandwidth_hz: Option<f64>) -> Self {
        Self {
            mode,
            low_pass: bandwidth_hz.map(LowPass::new),
            span: StepInterval {
                from_ns: 0,
                to_ns: 0,
            },
            start: [0.0; N],
            end: [0.0; N],
            here_ns: 0,
            since_ns: None,
            integral: [0.0; N],
        }
    }

    /// True if a span without an instant has no effect: nothing is filtered, nothing integrated.
    pub fn has_no_memory(&self) -> bool {
        self.mode == SamplingMode::Instant && self.low_pass.is_none()
    }

    /// The signal goes from `start` to `end` over `span`. Spans follow each other without gap.
    pub fn begin(&mut self, span: StepInterval, start: [f64; N], end: [f64; N]) {
        let length_ns = span.to_ns - span.from_ns;
        (self.start, self.end) = match &mut self.low_pass {
            Some(filter) => filter.pass(length_ns, start, end),
            None => (start, end),
        };
        self.span = span;
        self.here_ns = span.from_ns;
    }

    /// Returns the value at `t_ns`, within the span; for a mean `None` at the first instant, which only opens a period.
    pub fn take(&mut self, t_ns: i64) -> Option<[f64; N]> {
        match self.mode {
            SamplingMode::Instant => Some(self.at(t_ns)),
            SamplingMode::Integrating => {
                self.integrate(t_ns);
                let mean = self
                    .since_ns
                    .map(|since| self.integral.map(|x| x / (t_ns - since) as f64));
                self.since_ns = Some(t_ns);
                self.integral = [0.0; N];
                mean
            }
        }
    }

    /// Ends the span.
    pub fn finish(&mut self) {
        if self.mode == SamplingMode::Integrating {
            self.integrate(self.span.to_ns);
        }
    }

    fn at(&self, t_ns: i64) -> [f64; N] {
        if t_ns >= self.span.to_ns {
            return self.end;
        }
        let length_ns = self.span.to_ns - self.span.from_ns;
        let share = (t_ns - self.span.from_ns) as f64 / length_ns as f64;
        std::array::from_fn(|i| self.start[i] + share * (self.end[i] - self.start[i]))
    }

    fn integrate(&mut self, to_ns: i64) {
        if self.since_ns.is_some() && to_ns > self.here_ns {
            let (a, b) = (self.at(self.here_ns), self.at(to_ns));
            let half = 0.5 * (to_ns - self.here_ns) as f64;
            for i in 0..N {
                self.integral[i] += half * (a[i] + b[i]);
            }
        }
        self.here_ns = to_ns;
    }
}
