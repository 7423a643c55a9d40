//! Which line goes to which plot: that follows from its path and unit, so a new channel finds its place.

use crate::series::PlottedSeries;

/// The plots, in order. A plot that no line goes to is left out.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Plot {
    Mass,
    Slope,
    Speed,
    Traction,
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
    WheelLoad,
}

/// Plots of the overview, with their titles.
pub const OVERVIEW: [(Plot, &str); 6] = [
    (Plot::Mass, "Total mass, kg (truth, estimates ±2σ)"),
    (Plot::Slope, "Slope, ° (truth, estimates ±2σ)"),
    (
        Plot::Speed,
        "Speed, m/s (reference, truth, measured, estimates)",
    ),
    (Plot::Traction, "Traction, resistance, brake, N"),
    (Plot::Sway, "Sway of the load, °"),
    (
        Plot::Steering,
        "Steering, sideslip, heading off the road, °",
    ),
];
/// Plots of instruments and drives, with their titles.
pub const SENSORS: [(Plot, &str); 9] = [
    (Plot::SpecificForce, "Specific force, m/s²"),
    (Plot::AngularRate, "Angular rate, rad/s"),
    (Plot::Torque, "Motor torque, N·m"),
    (Plot::WheelSpeed, "Wheel speed, m/s"),
    (Plot::Slip, "Slip, m/s"),
    (Plot::DriveForce, "Traction of each drive, N"),
    (Plot::Clamp, "Clamp pressure, MPa"),
    (Plot::WheelLoad, "Wheel loads, N"),
    (Plot::Rail, "Off the rail or the lane, clearance, m"),
];

/// Where a line is drawn outside the *Filters* tab.
pub fn plot(s: &PlottedSeries) -> Option<Plot> {
    let (group, leaf, whole) = (s.group(), s.leaf(), s.owner().is_empty());
    let is = |words: &[&str]| words.iter().any(|w| leaf.contains(w));
    if matches!(group, "internals") || leaf.ends_with("_sd") {
        return None;
    }
    match (s.unit.as_str(), group) {
        ("kg", "truth") if is(&["total"]) => Some(Plot::Mass),
        ("kg", "estimates") if !s.is_raw() => Some(Plot::Mass),
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
        ("m/s", "truth" | "control") if whole => Some(Plot::Speed),
        ("m/s", "estimates") if is(&["speed"]) => Some(Plot::Speed),
        ("N", _) if whole => Some(Plot::Traction),
        ("N", _) => Some(Plot::DriveForce),
        ("N·m", _) => Some(Plot::Torque),
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
    use monorig_sim::record::Channel;

    fn of(path: &str, unit: &'static str) -> Vec<Option<Plot>> {
        let channels = [Channel {
            path: path.into(),
            unit,
        }];
        plan(&channels).iter().map(plot).collect()
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

    /// What only a car has stands apart from what a train has too.
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
