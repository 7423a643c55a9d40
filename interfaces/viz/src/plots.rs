//! The plot of each line: it follows from path and unit, so a new channel finds its place.

use crate::series::PlottedSeries;

/// The plots, in order. A plot that no line goes to is left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Plot {
    MassError,
    SlopeError,
    EffectiveSlopeError,
    Speed,
    Mass,
    Slope,
    EffectiveSlope,
    Traction,
    Balance,
    Sway,
    Steering,
    Rail,
    SpecificForce,
    AngularRate,
    Torque,
    WheelSpeed,
    Slip,
    Clamp,
    DriveForce,
    MotorTorque,
    WheelLoad,
}

/// The axis of a plot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Range {
    /// The range of the data.
    Data,
    /// The range of the errors that are drawn, the same to both sides: at least the first number, and at most the
    /// second, so that one bad estimator does not flatten the others. What is beyond is named in the title.
    Errors([f64; 2]),
}

impl Plot {
    /// The range of its axis.
    pub fn range(self) -> Range {
        match self {
            Self::MassError => Range::Errors([2.0, 40.0]),
            Self::SlopeError | Self::EffectiveSlopeError => Range::Errors([0.2, 6.0]),
            _ => Range::Data,
        }
    }
}

/// A plot in a tab: which, and its title.
pub type Titled = (Plot, &'static str);

/// Plots of the overview: how good the estimates are.
pub const OVERVIEW: [Titled; 3] = [
    (
        Plot::MassError,
        "Mass error, % (protection level or ±2σ where valid; white: Cramér-Rao bound, ±2σ)",
    ),
    (
        Plot::SlopeError,
        "Slope error, ° (protection level or ±2σ where valid; white: Cramér-Rao bound, ±2σ)",
    ),
    (
        Plot::Speed,
        "Speed, m/s (truth white, reference violet, measured, estimates)",
    ),
];
/// Plots of the errors of one estimator.
pub const ERRORS: [Titled; 3] = [OVERVIEW[0], OVERVIEW[1], VALUES[3]];
/// Plots of what is estimated, as absolute values.
pub const VALUES: [Titled; 5] = [
    (
        Plot::Mass,
        "Total mass, kg (truth, estimates ±2σ where valid)",
    ),
    (
        Plot::Slope,
        "Slope at the IMU, ° (truth, estimates ±2σ where valid)",
    ),
    (
        Plot::EffectiveSlope,
        "Effective slope of the whole train, ° (truth, estimates ±2σ where valid)",
    ),
    (
        Plot::EffectiveSlopeError,
        "Error of the effective slope, ° (protection level or ±2σ where valid; white: Cramér-Rao bound, ±2σ)",
    ),
    (
        Plot::Steering,
        "Steering, sideslip, heading off the road, °",
    ),
];
/// Plots of forces, and of what they move.
pub const FORCES: [Titled; 8] = [
    (Plot::Traction, "Traction, resistance, brake, N"),
    (Plot::Balance, "Balance of the forces along the rail, N"),
    (Plot::DriveForce, "Traction of each drive, N"),
    (
        Plot::MotorTorque,
        "Motor torque, N·m (actual and commanded)",
    ),
    (Plot::Slip, "Slip, m/s"),
    (Plot::WheelLoad, "Wheel loads, N"),
    (Plot::Sway, "Sway of the load, °"),
    (
        Plot::Rail,
        "Distance from the rail or the lane, clearance, m",
    ),
];
/// Plots of the instruments: samples only, so that a missing sample is visible.
pub const SENSORS: [Titled; 5] = [
    (Plot::SpecificForce, "Specific force, m/s²"),
    (Plot::AngularRate, "Angular rate, rad/s"),
    (Plot::Torque, "Motor torque, N·m"),
    (Plot::WheelSpeed, "Wheel speed, m/s"),
    (Plot::Clamp, "Clamp pressure, MPa"),
];

/// Place of a line outside the *Filters* tab.
pub fn plot(s: &PlottedSeries) -> Option<Plot> {
    let (group, leaf, whole) = (s.group(), s.leaf(), s.owner().is_empty());
    let is = |words: &[&str]| words.iter().any(|w| leaf.contains(w));
    if matches!(group, "internals" | "aid" | "limits")
        || leaf.ends_with("_sd")
        || leaf.ends_with("_protection")
    {
        return None;
    }
    let effective = matches!(leaf, "effective_grade" | "grade_effective");
    if s.is_error() {
        return Some(match s.unit.as_str() {
            "%" => Plot::MassError,
            _ if effective => Plot::EffectiveSlopeError,
            _ => Plot::SlopeError,
        });
    }
    match (s.unit.as_str(), group) {
        ("kg", "truth") if whole && is(&["total"]) => Some(Plot::Mass),
        ("kg", "estimates") if !s.is_raw() => Some(Plot::Mass),
        ("°", _) if effective => Some(Plot::EffectiveSlope),
        ("°", _) if is(&["grade", "pitch", "slope"]) => Some(Plot::Slope),
        ("°", _) if is(&["sway"]) => Some(Plot::Sway),
        ("°", "truth") if s.is_of_car() => Some(Plot::Steering),
        ("°", "sensors") if is(&["steering"]) => Some(Plot::Steering),
        ("m", _) if s.is_of_car() => Some(Plot::Rail),
        ("N", _) if s.is_of_car() => Some(Plot::WheelLoad),
        ("m/s²", _) if s.is_of_car() => Some(Plot::SpecificForce),
        ("rad/s", _) if s.is_of_car() => Some(Plot::AngularRate),
        ("m/s", _) if is(&["slip"]) => Some(Plot::Slip),
        ("m/s", "sensors") => Some(Plot::WheelSpeed),
        ("m/s", "truth" | "control") if whole && leaf != "speed_at_imu" => Some(Plot::Speed),
        // without its band, which may be wider than the speed
        ("m/s", "estimates") if is(&["speed"]) && s.line.width() == 1 => Some(Plot::Speed),
        ("N", _) if whole => Some(Plot::Traction),
        ("N", "truth") if s.owner() == "balance" => Some(Plot::Balance),
        ("N", _) => Some(Plot::DriveForce),
        ("N·m", "sensors") => Some(Plot::Torque),
        ("N·m", "truth" | "control") => Some(Plot::MotorTorque),
        ("MPa", _) => Some(Plot::Clamp),
        ("m/s²", "sensors") => Some(Plot::SpecificForce),
        ("rad/s", "sensors") => Some(Plot::AngularRate),
        ("m", "truth") if is(&["off_rail", "clearance"]) => Some(Plot::Rail),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::series::plan;
    use monorig_sim::record::{Channel, Emphasis};

    fn of(path: &str, unit: &'static str) -> Vec<Option<Plot>> {
        let channels = [Channel {
            path: path.into(),
            unit,
        }];
        let lines = plan(&channels, &Emphasis::default());
        let of_channel = lines.iter().filter(|s| s.group() != "limits");
        of_channel.map(plot).collect()
    }

    #[test]
    fn lines_find_their_plots() {
        assert_eq!(of("truth/total_mass", "kg"), [Some(Plot::Mass)]);
        assert_eq!(of("estimates/jekf/total_mass_sd", "kg"), [None]);
        // Radians are for the computer, degrees for the eye.
        assert_eq!(of("truth/grade_at_imu", "rad"), [None, Some(Plot::Slope)]);
        assert_eq!(of("control/reference_speed", "m/s"), [Some(Plot::Speed)]);
        assert_eq!(
            of("sensors/drive_1/wheel_speed", "m/s"),
            [Some(Plot::WheelSpeed)]
        );
        assert_eq!(of("truth/drive_1/traction", "N"), [Some(Plot::DriveForce)]);
        assert_eq!(of("internals/jekf/gain", "kg"), [None]);
    }

    #[test]
    fn errors_have_plots_of_their_own_and_the_effective_slope_too() {
        let channels = [
            ("truth/grade_at_imu", "rad"),
            ("truth/grade_effective", "rad"),
            ("estimates/e/grade", "rad"),
            ("estimates/e/effective_grade", "rad"),
            ("bound/grade", "rad"),
            ("bound/effective_grade", "rad"),
        ]
        .map(|(path, unit)| Channel {
            path: path.into(),
            unit,
        });
        let lines = plan(&channels, &Emphasis::default());
        let of = |entity: &str| {
            let found = lines.iter().find(|s| s.entity == entity.into());
            found.and_then(plot)
        };
        let (display, error) = ("display/estimates/e", Some(Plot::SlopeError));
        assert_eq!(of(&format!("{display}/grade/error")), error);
        let effective = of(&format!("{display}/effective_grade/error"));
        assert_eq!(effective, Some(Plot::EffectiveSlopeError));
        assert_eq!(of(&format!("{display}/grade")), Some(Plot::Slope));
        // the bound stands beside the errors, and nowhere else
        assert_eq!(of("display/bound/grade/two_sigma"), error);
        let of_effective = of("display/bound/effective_grade/two_sigma");
        assert_eq!(of_effective, effective);
        assert_eq!(of("bound/grade"), None);
        for path in [
            "display/truth/grade_effective",
            "display/estimates/e/effective_grade",
        ] {
            assert_eq!(of(path), Some(Plot::EffectiveSlope), "{path}");
        }
    }

    /// Lines that only a car has stand apart from those of a train.
    #[test]
    fn a_car_has_plots_of_its_own() {
        let steering = [None, Some(Plot::Steering)];
        assert_eq!(of("truth/road/steering_angle", "rad"), steering);
        assert_eq!(of("sensors/steering_angle", "rad"), steering);
        let load = of("truth/road/load_front_left", "N");
        assert_eq!(load, [Some(Plot::WheelLoad)]);
        assert_eq!(of("truth/road/offset", "m"), [Some(Plot::Rail)]);
        let across = of("truth/road/lateral_acceleration", "m/s²");
        assert_eq!(across, [Some(Plot::SpecificForce)]);
    }
}
