//! Errors over time and their distributions; whether the stated uncertainty fits them.

use crate::metrics::Quantity;
use crate::metrics::VALID;
use crate::reports::page::Section;
use crate::reports::plot::axis::{Axis, common_range, without_outliers};
use crate::reports::plot::boxes::Boxes;
use crate::reports::plot::cdf::Cdf;
use crate::reports::plot::consistency::Consistency;
use crate::reports::plot::line::{Band, Level, Line, LineChart};
use crate::reports::plot::theme::Ink;
use crate::reports::plot::{Figure, ValueGroup};
use crate::reports::run::recorded::{DEGREES, Recorded};
use crate::verdicts::summary::ExpectationVerdict;
use monorig_sim::error::Error;

/// Errors of one quantity for all estimators with valid samples of this quantity, with their times.
pub(crate) type ErrorGroups = Vec<ValueGroup<(f64, f64)>>;

/// Plots of the errors.
pub(crate) fn section(run: &Recorded) -> Result<Section, Error> {
    let slope = slope(run)?;
    let mass = mass(run)?;
    let after_s = run.summary.after_s;
    let truth = match run.is_replay() {
        true => "reference",
        false => "truth",
    };
    let section = Section::new("Errors").text(format!(
            "Estimate minus {truth} where the estimator marks its value valid; distributions from {after_s} s on. The slope's \
             {truth} is the grade of the track at the IMU. Metrics use every estimator step, plots use the recorded rows."
        ));
    let section = over_time(run, section, Quantity::Slope, &slope)?;
    let section = over_time(run, section, Quantity::Mass, &mass)?;
    Ok(section
        .figures(distributions(run, "slope error, °", &slope, after_s))
        .figures(distributions(run, "mass error, %", &mass, after_s)))
}

/// Errors of the slope, °.
pub(crate) fn slope(run: &Recorded) -> Result<ErrorGroups, Error> {
    let truth = run.column("truth/grade_at_imu")?;
    errors(run, "grade", |i, x| (x - truth[i]) * DEGREES, truth.len())
}

/// Errors of the mass, %.
pub(crate) fn mass(run: &Recorded) -> Result<ErrorGroups, Error> {
    let truth = run.column("truth/total_mass")?;
    let error = |i: usize, x: f64| 100.0 * (x - truth[i]) / truth[i];
    errors(run, "total_mass", error, truth.len())
}

/// `error` of each of the `rows` rows, counted from 0; NaN if the sample is not valid.
fn errors(
    run: &Recorded,
    what: &str,
    error: impl Fn(usize, f64) -> f64,
    rows: usize,
) -> Result<ErrorGroups, Error> {
    let mut groups = Vec::new();
    for (name, ink) in run.estimators() {
        let channel = format!("estimates/{name}/{what}");
        let estimate = run.column(&channel)?;
        let valid = run.column(&format!("{channel}_valid"))?;
        let times = run.times()?.iter().take(rows);
        let values = times.zip(estimate).zip(valid).enumerate();
        let values = values.map(|(i, ((t, x), v))| match v {
            1.0 => (*t, error(i, *x)),
            _ => (*t, f64::NAN),
        });
        groups.push(ValueGroup::new(name, ink, values.collect()));
    }
    groups.retain(|g: &ValueGroup<(f64, f64)>| g.values.iter().any(|v| v.1.is_finite()));
    Ok(groups)
}

/// Lines across a plot of errors: the alert limit, and the largest errors that the scenario allows, over the time that
/// they are about.
fn bounds(run: &Recorded, quantity: Quantity) -> Vec<Level> {
    let metric = match quantity {
        Quantity::Mass => "mass_error_rel_max",
        Quantity::Slope => "slope_error_max_deg",
        Quantity::EffectiveSlope => "effective_slope_error_max_deg",
    };
    let (_, factor) = quantity.unit();
    let alert = factor * quantity.alert(&run.summary.limits);
    let both = |name: String, x: f64, from_to: (f64, f64)| {
        [x, -x].map(|value| Level {
            name: name.clone(),
            value,
            from_to,
        })
    };
    let always = (f64::NEG_INFINITY, f64::INFINITY);
    let mut all = both("alert limit".into(), alert, always).to_vec();
    let of = |v: &&ExpectationVerdict| v.metric.strip_suffix(VALID).unwrap_or(&v.metric) == metric;
    for expected in run.summary.expectations.iter().filter(of) {
        if let Some(most) = expected.at_most {
            let from = expected.after_s.unwrap_or(f64::NEG_INFINITY);
            let to = expected.until_s.unwrap_or(f64::INFINITY);
            let name = format!("bound of {}", expected.what());
            all.extend(both(name, factor * most, (from, to)));
        }
    }
    all
}

/// A plot of each estimator with its ± 2 σ; those of baselines are folded. Plots beside each other have the same axis.
fn over_time(
    run: &Recorded,
    section: Section,
    quantity: Quantity,
    errors: &ErrorGroups,
) -> Result<Section, Error> {
    let (main, others): (Vec<_>, Vec<_>) = errors.iter().partition(|g| run.is_main(&g.name));
    let section = section.figures(with_bands(run, quantity, &main)?);
    if others.is_empty() {
        return Ok(section);
    }
    let what = "Error of baselines, which are not judged";
    Ok(section.folded_figures(what, with_bands(run, quantity, &others)?))
}

/// A plot of each of these errors over the band of its estimator.
fn with_bands(
    run: &Recorded,
    quantity: Quantity,
    errors: &[&ValueGroup<(f64, f64)>],
) -> Result<Vec<Figure>, Error> {
    let bounds = bounds(run, quantity);
    let bands = errors.iter().map(|group| told(run, quantity, group));
    let bands: Vec<Band> = bands.collect::<Result<_, _>>()?;
    let range = range(errors, &bands, &bounds);
    let figure = |(group, band): (&&ValueGroup<(f64, f64)>, Band)| {
        let title = format!("{} error: {}", quantity.title(), group.name);
        let mut chart = chart(run, quantity, title, range, &bounds)?;
        chart.bands.push(band);
        chart.add(Line::new("error", group.ink, group.values.clone()));
        Ok(chart.figure())
    };
    errors.iter().zip(bands).map(figure).collect()
}

/// Range of these errors, and of bands and bounds that are not too wide for the plot.
fn range(
    errors: &[&ValueGroup<(f64, f64)>],
    bands: &[Band],
    bounds: &[Level],
) -> Option<(f64, f64)> {
    let each = errors.iter();
    let each = each.filter_map(|g| without_outliers(g.values.iter().map(|v| v.1), FAR, 0.25));
    let ((low, high), _) = common_range(&each.collect::<Vec<_>>())?;
    let reach = REACH * low.abs().max(high.abs());
    let near = bounds.iter().map(|b| b.value).filter(|x| x.abs() <= reach);
    let (low, high) = near.fold((low, high), |(a, b), x| (a.min(x), b.max(x)));
    let ends = bands.iter().filter_map(|band| {
        let halves = band.rows.iter().map(|row| row.2);
        Some(without_outliers(halves, USUAL, 0.1)?.1)
    });
    let half = ends.fold(0.0, f64::max).min(2.0 * reach);
    let (low, high) = (low.min(-half), high.max(half));
    Some((low.min(0.0), high.max(0.0) + 1e-9))
}

/// One half width of a band in this number may lie outside the axis.
const USUAL: f64 = 0.1;
/// Largest bound that is drawn, as a multiple of the errors.
const REACH: f64 = 3.0;

/// An empty plot of errors with the bounds that are on its axis.
fn chart(
    run: &Recorded,
    quantity: Quantity,
    title: String,
    range: Option<(f64, f64)>,
    bounds: &[Level],
) -> Result<LineChart, Error> {
    let axis = format!("{} error, {}", quantity.words(), quantity.unit().0);
    let mut chart = run.chart(title, Axis::linear(axis));
    chart.lines = cramer_rao(run, quantity)?;
    chart.y.range = range;
    let (low, high) = range.unwrap_or_default();
    let near = bounds.iter().filter(|b| (low..=high).contains(&b.value));
    chart.levels = near.cloned().collect();
    chart.levels.push(Level::across("", 0.0));
    Ok(chart)
}

/// Band of two reported standard deviations around zero, where the error is drawn.
pub(crate) fn told(
    run: &Recorded,
    quantity: Quantity,
    of: &ValueGroup<(f64, f64)>,
) -> Result<Band, Error> {
    let sd = run.column(&format!("estimates/{}/{}_sd", of.name, quantity.channel()))?;
    let mass = run.column("truth/total_mass")?;
    let rows = of.values.iter().zip(sd).zip(mass);
    let rows = rows.map(|(((t, error), sd), mass)| {
        let half = match error.is_finite() {
            true => 2.0 * in_unit(quantity, *sd, *mass),
            false => f64::NAN,
        };
        (*t, -half, half)
    });
    Ok(Band {
        name: "± 2 σ".into(),
        ink: of.ink,
        rows: rows.collect(),
    })
}

/// A standard deviation in the unit of the plots: of a mass as a share of it.
fn in_unit(quantity: Quantity, sd: f64, mass: f64) -> f64 {
    match quantity {
        Quantity::Mass => 100.0 * sd / mass,
        _ => sd * DEGREES,
    }
}

/// The Cramér-Rao bound of the run, as lines two standard deviations from zero; empty if the run has no such channel.
fn cramer_rao(run: &Recorded, quantity: Quantity) -> Result<Vec<Line>, Error> {
    let Some(sd) = run.find(&format!("bound/{}", quantity.channel())) else {
        return Ok(Vec::new());
    };
    let mass = run.column("truth/total_mass")?;
    let rows = || run.times().into_iter().flatten().zip(sd).zip(mass);
    let line = |(name, sides): (&str, f64)| {
        let points = rows().map(|((t, sd), mass)| (*t, sides * in_unit(quantity, *sd, *mass)));
        Line::new(name, Ink::Text, points.collect()).faintly()
    };
    Ok([("Cramér-Rao bound, ± 2 σ", 2.0), ("", -2.0)]
        .map(line)
        .into())
}

/// One value in this number may lie outside the axis at each end.
const FAR: f64 = 0.005;

/// Distributions of the errors of the judged estimators.
fn distributions(run: &Recorded, what: &str, errors: &ErrorGroups, after_s: f64) -> Vec<Figure> {
    let from = |g: &ValueGroup<(f64, f64)>| {
        let later = g.values.iter().filter(|v| v.0 >= after_s);
        let values = later.map(|v| v.1).filter(|x| x.is_finite());
        ValueGroup::new(&g.name, g.ink, values.collect::<Vec<f64>>())
    };
    let main = errors.iter().filter(|g| run.is_main(&g.name));
    let groups: Vec<ValueGroup<f64>> = main.map(from).collect();
    let mut absolute = groups.clone();
    for group in &mut absolute {
        group.values.iter_mut().for_each(|x| *x = x.abs());
    }
    let title = |kind: &str| {
        let mut name = what.split(',').next().unwrap_or(what).to_owned();
        name[..1].make_ascii_uppercase();
        format!("{name}: {kind}")
    };
    let mut figures = vec![
        Cdf {
            title: title("share of time within a bound"),
            x: Axis::linear(format!("|{}", what.replacen(',', "|,", 1))),
            groups: absolute,
        }
        .figure(),
    ];
    if groups.len() > 1 {
        let (title, y) = (title("side by side"), Axis::linear(what));
        figures.push(Boxes::new(title, y, groups).figure());
    }
    figures
}

/// Number of rows in each mean of the NIS: a second, as a rule.
const MEAN_OF: usize = 50;

/// Plots of the consistency.
pub(crate) fn consistency(run: &Recorded) -> Result<Section, Error> {
    let nees = |title: &str, what: &str, truth: &str| -> Result<Figure, Error> {
        let truth = run.column(truth)?;
        let mut groups = Vec::new();
        for (name, _) in run.estimators().filter(|(name, _)| run.is_main(name)) {
            let sd = run.column(&format!("estimates/{name}/{what}_sd"))?;
            let square = |i: usize, x: f64| {
                ((x - truth[i]) / sd.get(i).copied().unwrap_or(f64::NAN)).powi(2)
            };
            let of = errors(run, what, square, truth.len())?;
            groups.extend(of.into_iter().filter(|g| g.name == name));
        }
        let chart = Consistency {
            title: title.into(),
            y: "(error / σ)²".into(),
            groups,
            mean_of: 1,
            happenings: run.happenings(),
        };
        Ok(chart.figure())
    };
    let mut nis = Vec::new();
    for (name, ink) in run.estimators().filter(|(name, _)| run.is_main(name)) {
        let rows = run.over_time(&format!("estimates/{name}/nis"), 1.0)?;
        let valid = run.column(&format!("estimates/{name}/grade_valid"))?;
        let rows = rows.into_iter().zip(valid).map(|((t, x), v)| match v {
            1.0 => (t, x),
            _ => (t, f64::NAN),
        });
        let values = rows.collect();
        nis.push(ValueGroup::new(name, ink, values));
    }
    let nis = Consistency {
        title: "Innovations (NIS)".into(),
        y: format!("NIS, mean of {MEAN_OF} rows"),
        groups: nis,
        mean_of: MEAN_OF,
        happenings: run.happenings(),
    };
    Ok(Section::new("Consistency")
        .text(
            "Is the stated uncertainty the real uncertainty? 95 % of the samples of a consistent filter lie between the lines. Above: the \
             stated uncertainty is too small; below: too large. Errors change slowly, so this share may vary in a single run.",
        )
        .figure(nees("Slope error (NEES)", "grade", "truth/grade_at_imu")?)
        .figure(nees("Mass error (NEES)", "total_mass", "truth/total_mass")?)
        .figure(nis.figure()))
}
