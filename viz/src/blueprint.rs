//! The layout of the viewer. All of Rerun's blueprint types, which it marks as unstable, are in this file and in
//! `views`.
//!
//! Tabs: *Overview*: how good the estimates are and when they are valid, beside the train. *Values*: estimates and
//! truth. *Forces*,
//! *Sensors*. *Filters*: what goes on inside each estimator, a tab for each. `plots` has which line goes to which plot.

use crate::lanes::lane_entity;
use crate::plots::{FORCES, OVERVIEW, Plot, Range, SENSORS, Titled, VALUES, plot};
use crate::series::PlottedSeries;
use crate::views::{Builder, Camera, Entities, Placed, PlotStyle};
use re_sdk_types::blueprint::components::{ContainerKind, Corner2D};
use rerun::EntityPath;

/// NIS is drawn up to here: well over its 99.9 % limit.
const MAX_NIS: f64 = 15.0;
/// Test ratios are drawn up to here; the gate is at 1.
const MAX_TEST_RATIO: f64 = 3.0;

/// Values that the layout depends on.
pub struct Contents<'a> {
    /// All lines.
    pub series: &'a [PlottedSeries],
    /// The largest value of each line without its sign; empty before the first row, as for a viewer that watches.
    pub largest: &'a [f64],
    /// Names of the estimators.
    pub estimators: &'a [String],
    /// m.
    pub vehicle_length_m: f64,
    /// True if the vehicle has a load that can swing.
    pub load: bool,
    /// Middle of the plan and half of its side, m.
    pub plan: ([f32; 2], f32),
}

/// The whole layout.
pub fn entities(contents: &Contents<'_>) -> Entities {
    let mut b = Builder::new();
    let scene = scene(&mut b, contents);
    let mut plots = plots_of(&mut b, contents, &OVERVIEW);
    if !contents.estimators.is_empty() {
        let lanes: Vec<EntityPath> = contents.estimators.iter().map(|e| lane_entity(e)).collect();
        plots.push(b.states("Marked valid, by estimator", &lanes));
    }
    let plots = b.filled(ContainerKind::Vertical, "Estimates", plots, &[]);
    let overview = [Some(scene), plots].into_iter().flatten().collect();
    let overview = b.container(ContainerKind::Horizontal, "Overview", overview, &[1.0, 1.0]);
    let mut tabs = vec![overview.clone()];
    for (name, plots) in [
        ("Values", &VALUES[..]),
        ("Forces", &FORCES),
        ("Sensors", &SENSORS),
    ] {
        let views = plots_of(&mut b, contents, plots);
        tabs.extend(b.filled(ContainerKind::Grid, name, views, &[]));
    }
    tabs.extend(filters(&mut b, contents));
    let root = b.tabs("Run", tabs, overview);
    b.finish(root)
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
    let (series, load) = (contents.series, contents.load);
    let on = |p: Plot| lines(series, |s| plot(s) == Some(p));
    let shown = plots.iter().filter(|(p, ..)| load || *p != Plot::Sway);
    let mut views = Vec::new();
    for &(p, title, range) in shown {
        let mut lines = on(p);
        if p == Plot::Speed {
            // One measured wheel speed is enough to see what the estimators get.
            lines.extend(on(Plot::WheelSpeed).into_iter().take(1));
        }
        let corner = match p {
            Plot::Speed => Corner2D::RightBottom,
            _ => Corner2D::RightTop,
        };
        let legend = true;
        let (range, off_scale) = match range {
            Range::Data => (None, None),
            Range::Errors(ends) => errors_axis(contents, p, ends),
        };
        let title = match off_scale {
            Some(told) => format!("{title} OFF SCALE: {told}"),
            None => title.to_owned(),
        };
        let style = PlotStyle {
            range,
            corner,
            legend,
        };
        views.extend(b.plot(&title, &lines, style));
    }
    views
}

/// The axis of a plot of errors, and the lines that leave it, each with its largest value; no axis before there is a
/// value.
fn errors_axis(
    contents: &Contents<'_>,
    of: Plot,
    [least, most]: [f64; 2],
) -> (Option<[f64; 2]>, Option<String>) {
    let all = contents.series.iter().zip(contents.largest);
    let errors = all.filter(|(s, _)| s.is_estimators_error() && plot(s) == Some(of));
    let errors: Vec<(&PlottedSeries, f64)> = errors.map(|(s, x)| (s, *x)).collect();
    let largest = errors.iter().map(|e| e.1).fold(0.0, f64::max);
    if largest == 0.0 {
        return (None, None);
    }
    let end = (ROOM * largest).clamp(least, most);
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

/// An axis ends so much beyond the largest error.
const ROOM: f64 = 1.1;
/// So many estimators that leave the axis are named in the title; the others are counted.
const NAMED_OFF_SCALE: usize = 3;

/// For each estimator a tab: innovation, NIS with its limits, test ratios with the gate, and internal quantities, a
/// plot for each unit.
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
        let legend = lines.len() > 1;
        if !lines.is_empty() {
            let all: Vec<EntityPath> = lines.into_iter().chain(limits).collect();
            let corner = Corner2D::RightTop;
            let style = PlotStyle {
                range,
                corner,
                legend,
            };
            views.extend(b.plot(title, &all, style));
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
    use monorig_sim::record::Channel;
    use re_sdk_types::external::uuid::Uuid;

    /// The axis is that of the errors, up to the cap; what is beyond it is named with its value.
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
        let series = plan(&channels);
        let axis = |good: f64, bad: f64| {
            let of = |s: &PlottedSeries| match (s.is_estimators_error(), s.estimator()) {
                (true, Some("good")) => good,
                (true, Some("bad")) => bad,
                // what is no error does not count
                _ => 1e6,
            };
            let largest: Vec<f64> = series.iter().map(of).collect();
            let contents = Contents {
                series: &series,
                largest: &largest,
                estimators: &[],
                vehicle_length_m: 18.0,
                load: true,
                plan: ([0.0; 2], 10.0),
            };
            errors_axis(&contents, Plot::MassError, [2.0, 40.0])
        };
        assert_eq!(axis(0.5, 1.0), (Some([-2.0, 2.0]), None));
        let near = |axis: Option<[f64; 2]>| axis.is_some_and(|[_, end]| (end - 11.0).abs() < 1e-9);
        let (ten, told) = axis(0.5, 10.0);
        assert!(near(ten) && told.is_none());
        let (capped, told) = axis(0.5, 103.0);
        assert_eq!(capped, Some([-40.0, 40.0]));
        assert_eq!(told.as_deref(), Some("bad to 103 %"));
        assert_eq!(axis(0.0, 0.0), (None, None));
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
                series: &plan(&channels),
                largest: &[],
                estimators: &["jekf".into()],
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
