//! A study as one HTML page.

use crate::metrics::series::ErrorSample;
use crate::reports::page::{Page, Section};
use crate::reports::plot::Figure;
use crate::reports::plot::axis::Axis;
use crate::reports::plot::history::History;
use crate::reports::plot::line::{Line, LineChart};
use crate::reports::plot::pareto::Pareto;
use crate::reports::plot::theme::Ink;
use crate::reports::table::{Cell, Table};
use crate::text::number;
use crate::tuning::result::{Trace, TuningResult};
use crate::tuning::sensitivity::Curve;
use crate::tuning::study::as_number;
use crate::tuning::study::{Combine, Scale, TuningStudy};
use crate::tuning::trial_store::Trial;
use crate::tuning::validate::{ComparisonVerdict, PairedComparison};
use crate::verdicts::interval::Interval;
use crate::verdicts::judgement::Grade;
use monorig_sim::config::scenario::ParameterValue;

const LOSS: &str = "loss (defaults = 1)";

pub(crate) fn page(study: &TuningStudy, result: &TuningResult) -> String {
    let mut page = Page::new(format!("Tuning {}", study.name));
    page.subtitle = study.file.why.trim().to_owned();
    page.banner = Some(match &result.validation {
        None => (
            "FAILED: no trial could be measured and kept all constraints".into(),
            Grade::Failed,
        ),
        Some(v) => {
            let grade = match v.verdict() {
                ComparisonVerdict::Better => Grade::Held,
                ComparisonVerdict::NoDifference => Grade::Unasked,
                ComparisonVerdict::Worse => Grade::Failed,
            };
            (v.sentence(study), grade)
        }
    });
    page.sections.push(found(study, result));
    if let Some(v) = &result.validation {
        let mut section = Section::new("Validation").text(
            "The winner on runs that the search did not use, in pairs with the same scenario and seed. Differences have 95 % confidence intervals.",
        );
        for c in &v.comparisons {
            section = section.table(comparison(c));
        }
        page.sections.push(section);
    }
    page.sections.push(search(study, &result.search.trials));
    let space = ParameterAxes(study);
    let marks = |name: &str| space.marks(result, name);
    let curves = result
        .sensitivity
        .curves
        .iter()
        .map(|c| curve(&space, c, marks(&c.parameter)));
    page.sections.push(
        Section::new("Sensitivity")
            .text("The loss over the tuning runs around the winner: one parameter at a time. A gap is a trial that fails or breaks a constraint.")
            .figures(curves),
    );
    let traces = result.traces.iter().flat_map(trace);
    page.sections.push(
        Section::new("Before and after")
            .text("Errors in a validation run of each scenario, while the estimator marks its estimate valid.")
            .figures(traces),
    );
    page.to_html()
}

fn found(study: &TuningStudy, result: &TuningResult) -> Section {
    let mut table = Table::new(&["parameter"], &["default", "published", "winner"]);
    let defaults = study.defaults();
    let winner = result.best();
    for (name, x) in winner.iter().flat_map(|t| &t.parameters) {
        let text =
            |x: Option<&ParameterValue>| x.map_or("–".to_owned(), |x| x.setting().to_string());
        table.row([
            name.as_str().into(),
            text(defaults.get(name)).into(),
            text(study.file.published.get(name)).into(),
            format!("{}{}", x.setting(), edge(study, name, x)).into(),
        ]);
    }
    let mut losses = Table::new(&["loss (defaults = 1)"], &["winner"]);
    if let Some(v) = &result.validation {
        for (name, x) in [
            ("tuning runs", v.tuning_loss),
            ("validation runs", v.validation_loss),
        ] {
            losses.row([name.into(), Cell::number(x)]);
        }
    }
    Section::new("Found").table(table).table(losses)
}

/// Marks a winner at an end of its range.
fn edge(study: &TuningStudy, name: &str, x: &ParameterValue) -> &'static str {
    match study.is_at_end(name, x) {
        true => ", an end of its range",
        false => "",
    }
}

fn comparison(c: &PairedComparison) -> Table {
    let mut table = Table::new(
        &["metric", "scenario"],
        &["winner", &c.against, "difference", "95 % from", "to"],
    );
    table.caption = format!("Against {}: {}", c.against, c.verdict.words());
    let ends = |i: &Interval| [i.mean, i.low, i.high].map(Cell::number);
    let row = |metric: &str, scenario: &str, values: [f64; 2], i: &Interval| {
        let [mean, low, high] = ends(i);
        let mean = match ComparisonVerdict::of(Some(i)) {
            ComparisonVerdict::NoDifference => mean,
            verdict => mean.judged(verdict == ComparisonVerdict::Better),
        };
        let [a, b] = values.map(Cell::number);
        [metric.into(), scenario.into(), a, b, mean, low, high]
    };
    for r in &c.rows {
        table.row(row(
            &r.metric,
            &r.scenario,
            [r.winner, r.other],
            &r.difference,
        ));
    }
    if let Some(i) = &c.loss {
        table.row(row("loss", "all", [f64::NAN; 2], i));
    }
    table
}

fn search(study: &TuningStudy, trials: &[Trial]) -> Section {
    let named = |origin: &str| trials.iter().find(|t| t.origin == origin);
    let references = ["default", "published"]
        .into_iter()
        .filter_map(|o| Some((o.to_owned(), named(o)?.loss())));
    let history = History {
        title: "Trials in order".into(),
        y: Axis::linear(LOSS),
        scores: trials.iter().map(Trial::loss).collect(),
        references: references.collect(),
    };
    let mut section = Section::new("Search").figure(history.figure());
    if study.file.objective.combine == Combine::Pareto {
        section = section.figure(front(study, trials));
    }
    section
}

/// The first two metrics of a front.
fn front(study: &TuningStudy, trials: &[Trial]) -> Figure {
    let title = |i: usize| {
        let metric = study
            .file
            .objective
            .metrics
            .get(i)
            .map_or("", |t| t.metric.as_str());
        Axis::linear(format!("{metric}, {LOSS}"))
    };
    let place = |t: &Trial| match t.losses[..] {
        [a, b, ..] if t.loss().is_finite() => (a, b),
        _ => (f64::NAN, f64::NAN),
    };
    let named = trials.iter().filter(|t| t.origin != "search");
    Pareto {
        title: "Front".into(),
        x: title(0),
        y: title(1),
        candidates: trials.iter().map(place).collect(),
        named: named.map(|t| (t.origin.clone(), place(t))).collect(),
    }
    .figure()
}

fn curve(space: &ParameterAxes<'_>, c: &Curve, marks: Vec<(String, f64)>) -> Figure {
    let points = c.values.iter().zip(&c.losses);
    let points: Vec<_> = points
        .map(|(x, y)| (space.shown(&c.parameter, x), y.unwrap_or(f64::NAN)))
        .collect();
    let (x, y) = (space.axis(&c.parameter), Axis::linear(LOSS));
    let mut chart = LineChart::new(c.parameter.clone(), x, y);
    chart.add(Line::new("", Ink::Series(0), points.clone()).dotted());
    chart.add(Line::new("tuning", Ink::Series(0), points));
    let inks = [Ink::Good, Ink::Muted, Ink::Series(4)];
    chart.marks = marks
        .into_iter()
        .zip(inks)
        .map(|((name, at), ink)| (name, at, ink))
        .collect();
    chart.figure()
}

fn trace(t: &Trace) -> [Figure; 2] {
    let chart = |what: &str, y: &str, of: fn(&ErrorSample) -> (bool, f64)| {
        let points = |samples: &[ErrorSample]| {
            let place = |s: &ErrorSample| {
                let (valid, x) = of(s);
                (s.t_s, if valid { x } else { f64::NAN })
            };
            samples.iter().map(place).collect::<Vec<_>>()
        };
        let title = format!("{what}, {}", t.scenario);
        let mut chart = LineChart::new(title, Axis::linear("time, s"), Axis::linear(y));
        chart.add(Line::new("default", Ink::Series(0), points(&t.before)));
        chart.add(Line::new("winner", Ink::Series(1), points(&t.after)));
        chart.figure()
    };
    [
        chart("Slope", "error, °", |s| {
            (s.slope_valid, s.slope.to_degrees())
        }),
        chart("Mass", "error, %", |s| (s.mass_valid, 100.0 * s.mass_rel)),
    ]
}

/// Axes of the parameters. Forgetting factors are drawn as their memory, on a logarithmic axis.
struct ParameterAxes<'a>(&'a TuningStudy);

impl ParameterAxes<'_> {
    fn scale(&self, name: &str) -> Scale {
        let range = self.0.file.parameters.get(name);
        range.map_or(Scale::Linear, |r| r.scale)
    }

    fn is_log(&self, name: &str) -> bool {
        self.scale(name) != Scale::Linear
    }

    /// Values to try, if a value is not a number: then they stand side by side on the axis.
    fn words(&self, name: &str) -> Option<&[ParameterValue]> {
        let choices = self.0.file.parameters.get(name)?.choices.as_deref()?;
        let numbers = choices.iter().all(|x| as_number(x).is_some());
        (!numbers).then_some(choices)
    }

    /// Position of a value on the axis.
    fn shown(&self, name: &str, value: &ParameterValue) -> f64 {
        if let Some(words) = self.words(name) {
            let place = words.iter().position(|w| w == value);
            return place.map_or(f64::NAN, |i| i as f64);
        }
        let x = as_number(value).unwrap_or(f64::NAN);
        match self.scale(name) {
            Scale::Memory => 1.0 / (1.0 - x),
            _ => x,
        }
    }

    fn title(&self, name: &str) -> String {
        match self.scale(name) {
            Scale::Memory => format!("{name}: 1/(1 − x), samples"),
            _ => {
                let key = self.0.of.key(name).ok();
                match key.and_then(|k| k.number()) {
                    None | Some((_, "-")) => name.to_owned(),
                    Some((_, unit)) => format!("{name}, {unit}"),
                }
            }
        }
    }

    fn axis(&self, name: &str) -> Axis {
        if let Some(words) = self.words(name) {
            let words = words.iter().map(|w| w.setting().to_string());
            Axis::names(self.title(name), words.collect())
        } else if self.is_log(name) {
            Axis::log(self.title(name))
        } else {
            Axis::linear(self.title(name))
        }
    }

    fn marks(&self, result: &TuningResult, name: &str) -> Vec<(String, f64)> {
        let of = |what: &str, t: Option<&Trial>| {
            let value = t?.parameters.get(name)?;
            let x = self.shown(name, value);
            let text = match self.words(name) {
                Some(_) => value.setting().to_string(),
                None => number(x),
            };
            Some((format!("{what} {text}"), x))
        };
        let named = |origin: &str| result.search.trials.iter().find(|t| t.origin == origin);
        let marks = [
            of("winner", result.best()),
            of("default", named("default")),
            of("published", named("published")),
        ];
        marks.into_iter().flatten().collect()
    }
}
