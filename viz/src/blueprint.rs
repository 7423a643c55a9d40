//! The layout of the viewer. All of Rerun's blueprint types, which it marks as unstable, are in this file.
//!
//! Three tabs. *Overview*: the train from a camera that follows it, events, and estimates against truth. *Sensors*:
//! instruments and drives. *Filters*: what goes on inside each estimator. `plots` has which line goes to which plot.

use crate::columns::follow_entity;
use crate::plots::{OVERVIEW, Plot, SENSORS, plot};
use crate::series::PlottedSeries;
use crate::stream::{TIMELINE, entity};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    TextLogColumns, TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use re_sdk_types::blueprint::components::{
    ActiveTab, BackgroundKind, ColumnShare, ContainerKind, Corner2D, IncludedContent, PanelState,
    PlayState, RootContainer, RowShare,
};
use re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use re_sdk_types::datatypes::{TimeRange, TimeRangeBoundary};
use re_sdk_types::external::uuid::Uuid;
use rerun::{AsComponents, EntityPath};

/// Entities of the blueprint store, in order.
type Entities = Vec<(EntityPath, Box<dyn AsComponents>)>;

/// First of the ids of views and containers; they count up from here, so that they are the same in every recording.
/// The 3-D view has this one.
pub const FIRST_ID: u128 = 0x6d6f_6e6f_7269_6700_0000_0000_0000_0001;

/// Dark, like a mine.
const BACKGROUND: [u8; 3] = [24, 27, 33];
/// The camera's place in the frame it follows (x forward, z up), in lengths of the train: on the right, somewhat
/// behind and above, so that the train runs to the right like time in the plots, and one sees where it goes.
const EYE: [f32; 3] = [-0.28, -0.74, 0.16];
/// m: shorter trains are not looked at from nearer.
const LEAST_LENGTH: f64 = 6.0;

/// The whole layout. `load`: whether the vehicle has one that can swing.
pub fn entities(series: &[PlottedSeries], vehicle_length_m: f64, load: bool) -> Entities {
    let mut b = Builder {
        next: FIRST_ID,
        out: Vec::new(),
    };
    let car = series.iter().any(PlottedSeries::is_of_car);
    let vehicle = if car { "Car" } else { "Train" };
    let world = b.world(vehicle, vehicle_length_m);
    let events = b.text_views();
    let scene = b.container(
        ContainerKind::Vertical,
        vehicle,
        vec![world, events],
        &[4.0, 1.0],
    );
    let on = |p: Plot| lines(series, |s| plot(s) == Some(p));
    let mut speeds = on(Plot::Speed);
    // One measured wheel speed is enough to see what the estimators get.
    speeds.extend(on(Plot::WheelSpeed).into_iter().take(1));
    let plots = OVERVIEW
        .iter()
        .filter(|(p, _)| load || *p != Plot::Sway)
        .map(|&(p, title)| match p {
            Plot::Speed => (title, speeds.clone()),
            p => (title, on(p)),
        })
        .collect();
    let plots = b.plots(ContainerKind::Vertical, "Estimates", plots);
    let overview = b.container(
        ContainerKind::Horizontal,
        "Overview",
        [Some(scene), plots].into_iter().flatten().collect(),
        &[3.0, 2.0],
    );
    let sensors = SENSORS.iter().map(|&(p, title)| (title, on(p))).collect();
    let sensors = b.plots(ContainerKind::Grid, "Sensors", sensors);
    let filters = filters(&mut b, series);
    let tabs = [Some(overview.clone()), sensors, filters];
    let root = b.tabs(tabs.into_iter().flatten().collect(), overview);
    b.frame(root);
    b.out
}

/// One plot of each estimator's consistency, and one of each of its internal quantities by unit.
fn filters(b: &mut Builder, series: &[PlottedSeries]) -> Option<Placed> {
    let mut names: Vec<&str> = Vec::new();
    for s in series
        .iter()
        .filter(|s| matches!(s.group(), "internals" | "estimates"))
    {
        if !names.contains(&s.owner()) {
            names.push(s.owner());
        }
    }
    let mut plots = Vec::new();
    for name in names {
        let own = |s: &PlottedSeries| s.owner() == name && s.is_raw();
        let innovation = |s: &PlottedSeries| own(s) && ["innovation", "nis"].contains(&s.leaf());
        let inside = |s: &PlottedSeries| own(s) && s.group() == "internals" && !innovation(s);
        plots.push((
            format!("{name}: innovation, NIS"),
            lines(series, innovation),
        ));
        let mut units: Vec<&str> = Vec::new();
        for s in series.iter().filter(|s| inside(s)) {
            if !units.contains(&s.unit.as_str()) {
                units.push(&s.unit);
            }
        }
        for unit in units {
            let title = format!("{name}: internals [{unit}]");
            plots.push((title, lines(series, |s| inside(s) && s.unit == unit)));
        }
    }
    let plots = plots.iter().map(|(t, l)| (t.as_str(), l.clone())).collect();
    b.plots(ContainerKind::Grid, "Filters", plots)
}

fn lines(series: &[PlottedSeries], wanted: impl Fn(&PlottedSeries) -> bool) -> Vec<EntityPath> {
    series
        .iter()
        .filter(|s| wanted(s))
        .map(|s| s.entity.clone())
        .collect()
}

/// Path of a view or container in the blueprint store, and its id.
#[derive(Clone)]
struct Placed {
    path: EntityPath,
    id: Uuid,
}

struct Builder {
    next: u128,
    out: Entities,
}

impl Builder {
    fn place(&mut self, kind: &str) -> Placed {
        let id = Uuid::from_u128(self.next);
        self.next += 1;
        let path = entity([kind, &id.to_string()]);
        Placed { path, id }
    }

    fn add(&mut self, path: EntityPath, what: impl AsComponents + 'static) {
        self.out.push((path, Box::new(what)));
    }

    fn view(&mut self, class: &str, name: &str, origin: &str, contents: &[String]) -> Placed {
        let place = self.place("view");
        let query: Vec<String> = contents.iter().map(|e| format!("+ {e}")).collect();
        let query = query.iter().map(String::as_str);
        self.property(&place, "ViewContents", ViewContents::new(query));
        let blueprint = ViewBlueprint::new(class)
            .with_display_name(name)
            .with_space_origin(origin);
        self.add(place.path.clone(), blueprint);
        place
    }

    fn property(&mut self, view: &Placed, name: &str, what: impl AsComponents + 'static) {
        self.add(view.path.join(&entity([name])), what);
    }

    /// The scene. Its id is the first.
    ///
    /// Its origin is a frame that moves with the train, and in that frame the camera stands still: so it follows.
    fn world(&mut self, name: &str, vehicle_length_m: f64) -> Placed {
        let place = self.view(
            "3D",
            name,
            &follow_entity().to_string(),
            &["/world/**".into()],
        );
        let far = vehicle_length_m.max(LEAST_LENGTH) as f32;
        let controls = EyeControls3D::new()
            .with_position(EYE.map(|x| x * far))
            .with_look_target([0.0, 0.0, -0.02 * far])
            .with_eye_up([0.0, 0.0, 1.0]);
        self.property(&place, "EyeControls3D", controls);
        self.property(&place, "LineGrid3D", LineGrid3D::new().with_visible(false));
        let background = Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND);
        self.property(&place, "Background", background);
        place
    }

    fn text_views(&mut self) -> Placed {
        let events = self.view("TextLog", "Events", "/", &["/events".into()]);
        let body = TextLogColumn {
            visible: true.into(),
            kind: TextLogColumnKind::Body,
        };
        let columns = TextLogColumns::new().with_text_log_columns([body]);
        self.property(&events, "TextLogColumns", columns);
        let about = self.view("TextDocument", "About", "/", &["/about".into()]);
        self.tabs(vec![events.clone(), about], events)
    }

    /// A container of plots; none of them if nothing is in them.
    fn plots(
        &mut self,
        kind: ContainerKind,
        name: &str,
        plots: Vec<(&str, Vec<EntityPath>)>,
    ) -> Option<Placed> {
        let filled = plots.into_iter().filter(|(_, lines)| !lines.is_empty());
        let views: Vec<Placed> = filled
            .map(|(title, lines)| self.plot(title, &lines))
            .collect();
        (!views.is_empty()).then(|| self.container(kind, name, views, &[]))
    }

    fn plot(&mut self, title: &str, lines: &[EntityPath]) -> Placed {
        let paths: Vec<String> = lines.iter().map(|l| l.to_string()).collect();
        let place = self.view("TimeSeries", title, "/", &paths);
        let whole = TimeRange {
            start: TimeRangeBoundary::Infinite,
            end: TimeRangeBoundary::Infinite,
        };
        self.property(&place, "TimeAxis", TimeAxis::new().with_view_range(whole));
        // where the run begins: what it comes to is what one wants to see
        let legend = PlotLegend::new().with_corner(Corner2D::LeftTop);
        self.property(&place, "PlotLegend", legend);
        place
    }

    fn container(
        &mut self,
        kind: ContainerKind,
        name: &str,
        contents: Vec<Placed>,
        shares: &[f32],
    ) -> Placed {
        let place = self.place("container");
        let mut blueprint = ContainerBlueprint::new(kind)
            .with_display_name(name)
            .with_contents(contents.iter().map(included));
        if kind == ContainerKind::Vertical && !shares.is_empty() {
            blueprint = blueprint.with_row_shares(shares.iter().map(|&s| RowShare(s.into())));
        } else if !shares.is_empty() {
            blueprint = blueprint.with_col_shares(shares.iter().map(|&s| ColumnShare(s.into())));
        }
        self.add(place.path.clone(), blueprint);
        place
    }

    fn tabs(&mut self, contents: Vec<Placed>, active: Placed) -> Placed {
        let place = self.place("container");
        let active = ActiveTab(active.path.to_string().as_str().into());
        let blueprint = ContainerBlueprint::new(ContainerKind::Tabs)
            .with_contents(contents.iter().map(included))
            .with_active_tab(active);
        self.add(place.path.clone(), blueprint);
        place
    }

    /// What is around the views: panels closed, time running.
    fn frame(&mut self, root: Placed) {
        let viewport = ViewportBlueprint::new()
            .with_root_container(RootContainer(root.id.into()))
            .with_auto_layout(false)
            .with_auto_views(false);
        self.add(entity(["viewport"]), viewport);
        for panel in ["blueprint_panel", "selection_panel"] {
            let hidden = PanelBlueprint::new().with_state(PanelState::Collapsed);
            self.add(entity([panel]), hidden);
        }
        let time = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TIMELINE)
            .with_play_state(PlayState::Playing);
        self.add(entity(["time_panel"]), time);
    }
}

fn included(place: &Placed) -> IncludedContent {
    IncludedContent(place.path.to_string().as_str().into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::plan;
    use monorig_sim::record::Channel;

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
            let all = entities(&plan(&channels), 18.0, true);
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
