//! The layout of the viewer. All of Rerun's blueprint types, which it marks as unstable, are in this file and in
//! `views`.
//!
//! Tabs: *Overview*: how good a handful of estimators is and when they are valid, beside the train; of a recorded
//! drive, of which no train is known, beside the values. *Values*: estimates and truth. *Forces*, *Sensors*.
//! *Estimators*: a tab for each, if there are more than a handful. *Filters*: what goes on inside each, a tab for each.
//! `plots` has which line goes to which plot.

use crate::lanes::lane_entity;
use crate::plots::{ERRORS, FORCES, OVERVIEW, Plot, Range, SENSORS, Titled, VALUES, plot};
use crate::series::PlottedSeries;
use crate::views::{Builder, Camera, Entities, Placed, PlotStyle};
use re_sdk_types::blueprint::components::{ContainerKind, Corner2D};
use rerun::EntityPath;

/// NIS is drawn up to here: well over its 99.9 % limit.
const MAX_NIS: f64 = 15.0;
/// Test ratios are drawn up to here; the gate is at 1.
const MAX_TEST_RATIO: f64 = 3.0;
/// A legend with more entries would hide the lines: pointing at a line names it.
const MAX_LEGEND: usize = 6;

/// Values that the layout depends on.
pub struct Contents<'a> {
    /// All lines.
    pub series: &'a [PlottedSeries],
    /// The largest value of each line without its sign; not a number where there is none. Before the first row, as for
    /// a viewer that watches, there is none of any.
    pub largest: &'a [f64],
    /// Names of the estimators.
    pub estimators: &'a [String],
    /// Names of those that are shown together; the others are hidden at first.
    pub shown: &'a [String],
    /// Lanes of what acts on the run.
    pub acting: &'a [EntityPath],
    /// True for a recorded drive, of which neither rail nor train is known.
    pub recorded: bool,
    /// m.
    pub vehicle_length_m: f64,
    /// True if the vehicle has a load that can swing.
    pub load: bool,
    /// Middle of the plan and half of its side, m.
    pub plan: ([f32; 2], f32),
}

impl Contents<'_> {
    /// True of a line that a plot can show: it has a value, or the run has not begun.
    fn has_values(&self, index: usize) -> bool {
        let of = |x: &f64| !x.is_nan();
        !self.largest.iter().any(of) || self.largest.get(index).is_some_and(of)
    }

    /// The lines that have values and that `wanted` takes, with their largest values.
    fn lines(&self, wanted: impl Fn(&PlottedSeries) -> bool) -> Vec<(&PlottedSeries, f64)> {
        let all = self.series.iter().enumerate();
        let found = all.filter(|(i, s)| self.has_values(*i) && wanted(s));
        let largest = |i: usize| self.largest.get(i).copied().unwrap_or(f64::NAN);
        found.map(|(i, s)| (s, largest(i))).collect()
    }

    /// True of a line that is not hidden at first.
    fn is_shown(&self, s: &PlottedSeries) -> bool {
        s.estimator()
            .is_none_or(|e| self.shown.iter().any(|n| n == e))
    }
}

/// The whole layout.
pub fn entities(contents: &Contents<'_>) -> Entities {
    let mut b = Builder::new();
    let (scene, share) = match contents.recorded {
        true => (values(&mut b), 0.5),
        false => (scene(&mut b, contents), 1.0),
    };
    let mut plots = plots_of(&mut b, contents, &OVERVIEW);
    let mut shares = vec![3.0; plots.len()];
    for (name, origin, lanes) in [
        (
            "Marked valid, by estimator",
            "/validity",
            lanes(contents.shown),
        ),
        (
            "Faults, and another adhesion",
            "/acting",
            contents.acting.to_vec(),
        ),
    ] {
        if !lanes.is_empty() {
            shares.push(1.0 + 0.6 * lanes.len() as f32);
            plots.push(b.states(name, origin, &lanes));
        }
    }
    let plots = b.filled(ContainerKind::Vertical, "Estimates", plots, &shares);
    let overview = [Some(scene), plots].into_iter().flatten().collect();
    let shares = [share, 1.0];
    let overview = b.container(ContainerKind::Horizontal, "Overview", overview, &shares);
    let mut tabs = vec![overview.clone()];
    for (name, plots) in [
        ("Values", &VALUES[..]),
        ("Forces", &FORCES),
        ("Sensors", &SENSORS),
    ] {
        let views = plots_of(&mut b, contents, plots);
        tabs.extend(b.filled(ContainerKind::Grid, name, views, &[]));
    }
    tabs.extend(each(&mut b, contents));
    tabs.extend(filters(&mut b, contents));
    let root = b.tabs("Run", tabs, overview);
    b.finish(root)
}

fn lanes(estimators: &[String]) -> Vec<EntityPath> {
    estimators.iter().map(|e| lane_entity(e)).collect()
}

/// Makes a tab for each estimator with its errors and its validity; `None` if one tab shows all estimators.
fn each(b: &mut Builder, contents: &Contents<'_>) -> Option<Placed> {
    if contents.estimators.len() <= contents.shown.len() {
        return None;
    }
    let mut tabs = Vec::new();
    for name in contents.estimators {
        let alone = Contents {
            shown: std::slice::from_ref(name),
            ..*contents
        };
        let mut views = plots_of(b, &alone, &ERRORS);
        views.push(b.states("Marked valid", "/validity", &lanes(alone.shown)));
        tabs.push(b.container(ContainerKind::Vertical, name, views, &[]));
    }
    let first = tabs.first().cloned()?;
    Some(b.tabs("Estimators", tabs, first))
}

/// Beside the estimates of a recorded drive: values, events.
fn values(b: &mut Builder) -> Placed {
    let readout = b.text("TextDocument", "Values", "/readout");
    let events = b.events();
    let about = b.text("TextDocument", "About", "/about");
    b.container(
        ContainerKind::Vertical,
        "Log",
        vec![readout, events, about],
        &[2.0, 2.0, 1.0],
    )
}

/// The train from the side, from the driver's seat and from above; below it the plan, values, events.
fn scene(b: &mut Builder, contents: &Contents<'_>) -> Placed {
    let car = contents.series.iter().any(PlottedSeries::is_of_car);
    let vehicle = if car { "Car" } else { "Train" };
    let side = b.world(vehicle, Camera::Side, contents.vehicle_length_m);
    let others = [("Driver", Camera::Driver), ("Above", Camera::Above)];
    let others = others.map(|(name, camera)| b.world(name, camera, contents.vehicle_length_m));
    let views = std::iter::once(side.clone()).chain(others).collect();
    let world = b.tabs(vehicle, views, side);
    let readout = b.text("TextDocument", "Values", "/readout");
    let plan = b.plan("Plan", contents.plan);
    let below = b.container(
        ContainerKind::Horizontal,
        "Where",
        vec![plan, readout],
        &[2.0, 3.0],
    );
    let events = b.events();
    let about = b.text("TextDocument", "About", "/about");
    let texts = b.tabs("Texts", vec![events.clone(), about], events);
    b.container(
        ContainerKind::Vertical,
        vehicle,
        vec![world, below, texts],
        &[5.0, 3.0, 2.0],
    )
}

fn plots_of(b: &mut Builder, contents: &Contents<'_>, plots: &[Titled]) -> Vec<Placed> {
    let on = |p: Plot| contents.lines(|s| plot(s) == Some(p));
    let shown = plots
        .iter()
        .filter(|(p, ..)| contents.load || *p != Plot::Sway);
    let mut views = Vec::new();
    for &(p, title) in shown {
        let mut lines = on(p);
        if p == Plot::Speed {
            // One measured wheel speed is enough to see what the estimators get.
            lines.extend(on(Plot::WheelSpeed).into_iter().take(1));
            // a log has no reference speed
            lines.retain(|(s, _)| !contents.recorded || s.group() != "control");
        }
        let (lines, hidden): (Vec<_>, Vec<_>) =
            lines.into_iter().partition(|(s, _)| contents.is_shown(s));
        let (range, off_scale) = match p.range() {
            Range::Data => (None, None),
            Range::Errors(ends) => errors_axis(&lines, ends),
        };
        let title = match contents.recorded {
            true => title
                .replace(", reference violet", "")
                .replace("truth", "reference"),
            false => title.to_owned(),
        };
        let title = match lines.iter().any(|(s, _)| s.group() == "bound") {
            true => title,
            false => title.replace("; white: Cramér-Rao bound, ±2σ", ""),
        };
        let title = match off_scale {
            Some(told) => format!("{title} OFF SCALE: {told}"),
            None => title,
        };
        let mut names: Vec<String> = lines.iter().map(|(s, _)| s.name()).collect();
        names.sort_unstable();
        names.dedup();
        let style = PlotStyle {
            range,
            corner: match p {
                Plot::Speed => Corner2D::RightBottom,
                _ => Corner2D::RightTop,
            },
            legend: names.len() <= MAX_LEGEND,
        };
        let entities = |lines: &[(&PlottedSeries, f64)]| -> Vec<EntityPath> {
            lines.iter().map(|(s, _)| s.entity.clone()).collect()
        };
        views.extend(b.plot(&title, [&entities(&lines), &entities(&hidden)], style));
    }
    views
}

/// The axis of a plot of errors, and the lines that leave it, each with its largest value; no axis before there is a
/// value.
fn errors_axis(
    lines: &[(&PlottedSeries, f64)],
    [least, most]: [f64; 2],
) -> (Option<[f64; 2]>, Option<String>) {
    let (errors, spreads): (Vec<&(&PlottedSeries, f64)>, Vec<_>) =
        lines.iter().partition(|(s, _)| s.is_estimators_error());
    let largest = errors.iter().map(|e| e.1).fold(f64::NAN, f64::max);
    if largest.is_nan() || largest == 0.0 {
        return (None, None);
    }
    let spread = spreads.iter().map(|s| s.1).fold(0.0, f64::max);
    let end = ROOM * largest.max(spread.min(SPREAD * largest));
    let end = end.clamp(least, most);
    let mut beyond: Vec<_> = errors.iter().filter(|e| e.1 > end).collect();
    beyond.sort_by(|a, b| b.1.total_cmp(&a.1));
    let named = beyond.iter().take(NAMED_OFF_SCALE).map(|(s, x)| {
        let name = s.estimator().unwrap_or_default();
        format!("{name} to {x:.0} {}", s.unit)
    });
    let mut told: Vec<String> = named.collect();
    if let Some(more) = beyond.len().checked_sub(told.len()).filter(|n| *n > 0) {
        told.push(format!("{more} more"));
    }
    let told = (!told.is_empty()).then(|| told.join(", "));
    (Some([-end, end]), told)
}

/// Largest reach of an axis for the standard deviations, as a multiple of the largest error.
const SPREAD: f64 = 2.0;
/// An axis ends so much beyond the largest error.
const ROOM: f64 = 1.1;
/// Largest number of estimators beyond the axis that the title names; the others are counted.
const NAMED_OFF_SCALE: usize = 3;

/// Makes a tab for each estimator: innovation, NIS with its limits, test ratios with the gate, and internal quantities,
/// a plot for each unit.
fn filters(b: &mut Builder, contents: &Contents<'_>) -> Option<Placed> {
    let names = contents.estimators.iter();
    let tabs: Vec<Placed> = names
        .filter_map(|name| filter(b, contents.series, name))
        .collect();
    let first = tabs.first().cloned()?;
    Some(b.tabs("Filters", tabs, first))
}

/// The tab of one estimator; none if nothing of its inside is recorded.
fn filter(b: &mut Builder, series: &[PlottedSeries], name: &str) -> Option<Placed> {
    let own = |s: &PlottedSeries| s.estimator() == Some(name) && s.is_raw();
    let is = |s: &PlottedSeries, group: &str, leaf: &str| {
        own(s) && s.group() == group && s.leaf() == leaf
    };
    let limits = |names: &[&str]| {
        let wanted = |s: &PlottedSeries| s.group() == "limits" && names.contains(&s.leaf());
        lines(series, wanted)
    };
    let mut views = Vec::new();
    let mut add = |title: &str, lines: Vec<EntityPath>, limits: Vec<EntityPath>, range| {
        // the title names a line that is alone
        let legend = (2..=MAX_LEGEND).contains(&(lines.len() + limits.len()));
        if !lines.is_empty() {
            let all: Vec<EntityPath> = lines.into_iter().chain(limits).collect();
            let corner = Corner2D::RightTop;
            let style = PlotStyle {
                range,
                corner,
                legend,
            };
            views.extend(b.plot(title, [&all, &[]], style));
        }
    };
    let innovation = lines(series, |s| is(s, "estimates", "innovation"));
    add("Innovation [m/s]", innovation, vec![], None);
    let nis = lines(series, |s| is(s, "estimates", "nis"));
    let nis_limits = limits(&["nis_95", "nis_999"]);
    let title = "NIS, limits of χ² with 1 degree of freedom at 95 % and 99.9 %";
    add(title, nis, nis_limits, Some([0.0, MAX_NIS]));
    let ratios = lines(series, |s| is(s, "aid", "test_ratio"));
    let title = "Test ratio of each measurement, gate at 1";
    let gate = limits(&["gate"]);
    add(title, ratios, gate, Some([0.0, MAX_TEST_RATIO]));
    let inside = |s: &&PlottedSeries| own(s) && s.group() == "internals";
    let mut units: Vec<&str> = Vec::new();
    for s in series.iter().filter(inside) {
        if !units.contains(&s.unit.as_str()) {
            units.push(&s.unit);
        }
    }
    for unit in units {
        let of_unit: Vec<&PlottedSeries> = series
            .iter()
            .filter(inside)
            .filter(|s| s.unit == unit)
            .collect();
        let title = match of_unit.as_slice() {
            [one] => format!("{} [{unit}]", one.leaf()),
            _ => format!("Internals [{unit}]"),
        };
        let of_unit = of_unit.iter().map(|s| s.entity.clone());
        add(&title, of_unit.collect(), vec![], None);
    }
    b.filled(ContainerKind::Grid, name, views, &[])
}

fn lines(series: &[PlottedSeries], wanted: impl Fn(&PlottedSeries) -> bool) -> Vec<EntityPath> {
    series
        .iter()
        .filter(|s| wanted(s))
        .map(|s| s.entity.clone())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::plan;
    use crate::views::FIRST_ID;
    use monorig_sim::record::{Channel, Emphasis};
    use re_sdk_types::external::uuid::Uuid;

    /// The axis follows errors and near standard deviations, up to the cap; an error beyond is named with its value.
    #[test]
    fn axes_of_errors_follow_the_data_and_name_what_leaves_them() {
        let channels = [
            ("truth/total_mass", "kg"),
            ("estimates/good/total_mass", "kg"),
            ("estimates/bad/total_mass", "kg"),
        ]
        .map(|(path, unit)| Channel {
            path: path.into(),
            unit,
        });
        let series = plan(&channels, &Emphasis::default());
        let axis = |good: f64, bad: f64, spread: f64| {
            let of = |s: &PlottedSeries| match (s.is_estimators_error(), s.estimator()) {
                (true, Some("good")) => good,
                (true, Some("bad")) => bad,
                _ => spread,
            };
            let lines: Vec<_> = series.iter().map(|s| (s, of(s))).collect();
            errors_axis(&lines, [2.0, 40.0])
        };
        assert_eq!(axis(0.5, 1.0, 0.7), (Some([-2.0, 2.0]), None));
        for (spread, expected) in [(8.0, 11.0), (15.0, 16.5), (1e6, 22.0)] {
            let (ends, told) = axis(0.5, 10.0, spread);
            let near = |[_, end]: [f64; 2]| (end - expected).abs() < 1e-9;
            assert!(ends.is_some_and(near) && told.is_none());
        }
        let (capped, told) = axis(0.5, 103.0, 1e6);
        assert_eq!(capped, Some([-40.0, 40.0]));
        assert_eq!(told.as_deref(), Some("bad to 103 %"));
        assert_eq!(axis(0.0, 0.0, 1.0), (None, None));
    }

    /// Titles of the plots of a tab, each with the number of its entities that are hidden at first.
    fn plots(contents: &Contents<'_>) -> Vec<(String, usize)> {
        let of = |views: &[Titled]| -> Vec<(String, usize)> {
            let mut count = Vec::new();
            for one in views {
                let mut b = Builder::new();
                if plots_of(&mut b, contents, &[*one]).is_empty() {
                    continue;
                }
                let all = b.entities();
                let hidden = all.filter(|path| path.contains("/overrides/")).count();
                count.push((one.1.to_owned(), hidden));
            }
            count
        };
        of(&OVERVIEW)
    }

    /// A plot has its place if it has data; those that are not shown together are hidden in it.
    #[test]
    fn plots_without_data_are_left_out_and_others_hide_what_is_for_reference() {
        let channels = [
            ("truth/total_mass", "kg"),
            ("truth/grade_at_imu", "rad"),
            ("estimates/mine/grade", "rad"),
            ("estimates/other/grade", "rad"),
            ("estimates/mine/total_mass", "kg"),
            ("control/reference_speed", "m/s"),
        ]
        .map(|(path, unit)| Channel {
            path: path.into(),
            unit,
        });
        let series = plan(&channels, &Emphasis::default());
        // the log has no mass
        let is = |s: &PlottedSeries| {
            if s.path.ends_with("mass") {
                f64::NAN
            } else {
                1.0
            }
        };
        let largest: Vec<f64> = series.iter().map(is).collect();
        let shown = ["mine".to_owned()];
        let of = |largest: &[f64], recorded| {
            let contents = Contents {
                series: &series,
                largest,
                estimators: &[],
                shown: &shown,
                acting: &[],
                recorded,
                vehicle_length_m: 18.0,
                load: true,
                plan: ([0.0; 2], 10.0),
            };
            let all = plots(&contents).into_iter();
            let short = |(t, n): (String, usize)| (t.split(',').next().unwrap().to_owned(), n);
            all.map(short).collect::<Vec<_>>()
        };
        let named = |title: &str, n: usize| (title.to_owned(), n);
        let (slope, speed) = (named("Slope error", 1), named("Speed", 0));
        assert_eq!(of(&largest, true), std::slice::from_ref(&slope));
        assert_eq!(of(&largest, false), [slope.clone(), speed.clone()]);
        // a viewer that watches gets its layout before there are values
        let before = [named("Mass error", 0), slope, speed];
        assert_eq!(of(&vec![f64::NAN; series.len()], false), before);
    }

    /// Every view and container is the content of exactly one container, but for the root: nothing is lost, nothing
    /// is there twice.
    #[test]
    fn ids_are_unique_and_fixed() {
        let channels = [
            ("truth/total_mass", "kg"),
            ("truth/grade_at_imu", "rad"),
            ("sensors/imu/specific_force_x", "m/s²"),
            ("internals/jekf/gain", "1"),
        ]
        .map(|(path, unit)| Channel {
            path: path.into(),
            unit,
        });
        let paths = || -> Vec<String> {
            let contents = Contents {
                series: &plan(&channels, &Emphasis::default()),
                largest: &[],
                estimators: &["jekf".into()],
                shown: &["jekf".into()],
                acting: &[],
                recorded: false,
                vehicle_length_m: 18.0,
                load: true,
                plan: ([0.0; 2], 10.0),
            };
            let all = entities(&contents);
            all.iter().map(|(path, _)| path.to_string()).collect()
        };
        assert_eq!(paths(), paths());
        let mut places: Vec<String> = paths()
            .into_iter()
            .filter(|p| p.split('/').count() == 3)
            .collect();
        let n = places.len();
        places.sort();
        places.dedup();
        assert_eq!(places.len(), n);
        let first = Uuid::from_u128(FIRST_ID);
        assert!(places.contains(&format!("/view/{first}")), "{places:?}");
    }
}
