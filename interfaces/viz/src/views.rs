//! Views and containers of the viewer's layout, with fixed ids.

use crate::motion::follow_entity;
use crate::stream::{TIMELINE, entity};
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EntityBehavior, EyeControls3D, LineGrid3D, PanelBlueprint,
    PlotBackground, PlotLegend, ScalarAxis, TextLogColumns, TimeAxis, TimePanelBlueprint,
    ViewBlueprint, ViewContents, ViewportBlueprint, VisualBounds2D,
};
use re_sdk_types::blueprint::components::{
    ActiveTab, BackgroundKind, ColumnShare, ContainerKind, Corner2D, IncludedContent, PanelState,
    PlayState, RootContainer, RowShare,
};
use re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use re_sdk_types::components::Range1D;
use re_sdk_types::datatypes::{Range2D, TimeRange, TimeRangeBoundary};
use re_sdk_types::external::uuid::Uuid;
use rerun::{AsComponents, EntityPath};

/// Entities of the blueprint store, in order.
pub type Entities = Vec<(EntityPath, Box<dyn AsComponents + Send>)>;

/// First of the ids of views and containers; they count up from here, so that they are the same in every recording.
/// The 3-D view has this one.
pub const FIRST_ID: u128 = 0x6d6f_6e6f_7269_6700_0000_0000_0000_0001;

/// Dark, like a mine.
const BACKGROUND: [u8; 3] = [24, 27, 33];
/// m: shorter trains are not looked at from nearer.
const LEAST_LENGTH: f64 = 6.0;

/// Viewpoint of the train.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Camera {
    /// From the right, somewhat behind and above: the train runs to the right like time in the plots.
    Side,
    /// From the front of the train, along the rail.
    Driver,
    /// From above.
    Above,
}

impl Camera {
    /// Eye and what it looks at in the frame that follows the train (x forward, z up), in lengths of the train.
    fn pose(self) -> [[f32; 3]; 2] {
        match self {
            Self::Side => [[-0.18, -0.88, 0.18], [0.0, 0.0, -0.04]],
            Self::Driver => [[0.42, 0.0, -0.05], [1.4, 0.0, -0.03]],
            Self::Above => [[-0.02, 0.0, 1.3], [0.0, 0.0, 0.0]],
        }
    }
}

/// Axis and legend of a plot.
#[derive(Clone, Copy, Debug)]
pub struct PlotStyle {
    /// Range of the axis; `None` for the range of the data.
    pub range: Option<[f64; 2]>,
    /// Corner of the legend.
    pub corner: Corner2D,
    /// True if there is a legend.
    pub legend: bool,
}

/// Path of a view or container in the blueprint store, and its id.
#[derive(Clone)]
pub struct Placed {
    path: EntityPath,
    id: Uuid,
}

/// Makes views and containers, and gives them their ids.
pub struct Builder {
    next: u128,
    out: Entities,
}

impl Builder {
    /// Without any.
    pub fn new() -> Self {
        Self {
            next: FIRST_ID,
            out: Vec::new(),
        }
    }

    /// Paths of what was made so far.
    #[cfg(test)]
    pub fn entities(&self) -> impl Iterator<Item = String> + '_ {
        self.out.iter().map(|(path, _)| path.to_string())
    }

    fn place(&mut self, kind: &str) -> Placed {
        let id = Uuid::from_u128(self.next);
        self.next += 1;
        let path = entity([kind, &id.to_string()]);
        Placed { path, id }
    }

    fn add(&mut self, path: EntityPath, what: impl AsComponents + Send + 'static) {
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

    fn property(&mut self, view: &Placed, name: &str, what: impl AsComponents + Send + 'static) {
        self.add(view.path.join(&entity([name])), what);
    }

    /// The scene; that from the side is made first, and has the first id.
    ///
    /// Its origin is a frame that moves with the train, and in that frame the camera stands still: so it follows.
    pub fn world(&mut self, name: &str, camera: Camera, vehicle_length_m: f64) -> Placed {
        let place = self.view(
            "3D",
            name,
            &follow_entity().to_string(),
            &["/world/**".into()],
        );
        let far = vehicle_length_m.max(LEAST_LENGTH) as f32;
        let [eye, target] = camera.pose().map(|p| p.map(|x| x * far));
        let controls = EyeControls3D::new()
            .with_position(eye)
            .with_look_target(target)
            .with_eye_up([0.0, 0.0, 1.0]);
        self.property(&place, "EyeControls3D", controls);
        self.property(&place, "LineGrid3D", LineGrid3D::new().with_visible(false));
        let background = Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND);
        self.property(&place, "Background", background);
        place
    }

    /// The track from above: `middle` and half of the side of a square, m.
    pub fn plan(&mut self, name: &str, (middle, half): ([f32; 2], f32)) -> Placed {
        let place = self.view("2D", name, "/plan", &["/plan/**".into()]);
        let side = |k: usize| [f64::from(middle[k] - half), f64::from(middle[k] + half)].into();
        let bounds = VisualBounds2D::new(Range2D {
            x_range: side(0),
            y_range: side(1),
        });
        self.property(&place, "VisualBounds2D", bounds);
        let background = Background::new(BackgroundKind::SolidColor).with_color(BACKGROUND);
        self.property(&place, "Background", background);
        place
    }

    /// A view of one text.
    pub fn text(&mut self, class: &str, name: &str, contents: &str) -> Placed {
        self.view(class, name, "/", &[contents.to_owned()])
    }

    /// The log of events.
    pub fn events(&mut self) -> Placed {
        let events = self.text("TextLog", "Events", "/events");
        let body = TextLogColumn {
            visible: true.into(),
            kind: TextLogColumnKind::Body,
        };
        let columns = TextLogColumns::new().with_text_log_columns([body]);
        self.property(&events, "TextLogColumns", columns);
        events
    }

    /// Lanes of states over time, all of them below `origin`.
    pub fn states(&mut self, name: &str, origin: &str, lanes: &[EntityPath]) -> Placed {
        let paths: Vec<String> = lanes.iter().map(|l| l.to_string()).collect();
        let place = self.view("StateTimeline", name, origin, &paths);
        self.property(&place, "TimeAxis", whole_run());
        place
    }

    /// A plot of these lines, and of others that are hidden at first; none if there are none.
    pub fn plot(
        &mut self,
        title: &str,
        [lines, hidden]: [&[EntityPath]; 2],
        style: PlotStyle,
    ) -> Option<Placed> {
        if lines.is_empty() {
            return None;
        }
        let all = lines.iter().chain(hidden);
        let paths: Vec<String> = all.map(|l| l.to_string()).collect();
        let place = self.view("TimeSeries", title, "/", &paths);
        for line in hidden {
            let path = ViewContents::blueprint_base_visualizer_path_for_entity(place.id, line);
            self.add(path, EntityBehavior::new().with_visible(false));
        }
        self.property(&place, "TimeAxis", whole_run());
        if let Some([low, high]) = style.range {
            let axis = ScalarAxis::new().with_range(Range1D::new(low, high));
            self.property(&place, "ScalarAxis", axis);
        }
        let legend = PlotLegend::new()
            .with_corner(style.corner)
            .with_visible(style.legend);
        self.property(&place, "PlotLegend", legend);
        // the truth is white: it must be seen in a light theme, too
        let background = PlotBackground::new().with_color(BACKGROUND);
        self.property(&place, "PlotBackground", background);
        Some(place)
    }

    /// A container of these; none if there are none.
    pub fn filled(
        &mut self,
        kind: ContainerKind,
        name: &str,
        contents: Vec<Placed>,
        shares: &[f32],
    ) -> Option<Placed> {
        (!contents.is_empty()).then(|| self.container(kind, name, contents, shares))
    }

    /// A container of these.
    pub fn container(
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

    /// One of these at a time; `active` first.
    pub fn tabs(&mut self, name: &str, contents: Vec<Placed>, active: Placed) -> Placed {
        let place = self.place("container");
        let active = ActiveTab(active.path.to_string().as_str().into());
        let blueprint = ContainerBlueprint::new(ContainerKind::Tabs)
            .with_display_name(name)
            .with_contents(contents.iter().map(included))
            .with_active_tab(active);
        self.add(place.path.clone(), blueprint);
        place
    }

    /// Adds the frame of the views: panels closed, time running. Returns all entities.
    pub fn finish(mut self, root: Placed) -> Entities {
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
        self.out
    }
}

fn whole_run() -> TimeAxis {
    TimeAxis::new().with_view_range(TimeRange {
        start: TimeRangeBoundary::Infinite,
        end: TimeRangeBoundary::Infinite,
    })
}

fn included(place: &Placed) -> IncludedContent {
    IncludedContent(place.path.to_string().as_str().into())
}
