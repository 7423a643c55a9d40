//! Units of the variables of FMUs, by the base units that the standards know.

/// A unit: exponents of kg, m, s and rad, and the factor to these.
pub struct Unit {
    /// The name.
    pub name: &'static str,
    /// Exponent of kg.
    pub kg: i32,
    /// Exponent of m.
    pub m: i32,
    /// Exponent of s.
    pub s: i32,
    /// Exponent of rad.
    pub rad: i32,
    /// Factor to the base units.
    pub factor: f64,
}

const fn unit(name: &'static str, [kg, m, s, rad]: [i32; 4], factor: f64) -> Unit {
    Unit {
        name,
        kg,
        m,
        s,
        rad,
        factor,
    }
}

/// Units of inputs, outputs and parameters that the base units can express.
const UNITS: [Unit; 24] = [
    unit("s", [0, 0, 1, 0], 1.0),
    unit("Hz", [0, 0, -1, 0], 1.0),
    unit("1/s", [0, 0, -1, 0], 1.0),
    unit("m", [0, 1, 0, 0], 1.0),
    unit("1/m", [0, -1, 0, 0], 1.0),
    unit("m/s", [0, 1, -1, 0], 1.0),
    unit("s/m", [0, -1, 1, 0], 1.0),
    unit("m/s²", [0, 1, -2, 0], 1.0),
    unit("s²/m", [0, -1, 2, 0], 1.0),
    unit("m/s³", [0, 1, -3, 0], 1.0),
    unit("s³/m", [0, -1, 3, 0], 1.0),
    unit("m²/s²", [0, 2, -2, 0], 1.0),
    unit("m²/s³", [0, 2, -3, 0], 1.0),
    unit("m²/s⁵", [0, 2, -5, 0], 1.0),
    unit("rad", [0, 0, 0, 1], 1.0),
    unit("deg", [0, 0, 0, 1], std::f64::consts::PI / 180.0),
    unit("rad/s", [0, 0, -1, 1], 1.0),
    unit("rad²/s", [0, 0, -1, 2], 1.0),
    unit("rad²/s³", [0, 0, -3, 2], 1.0),
    unit("kg", [1, 0, 0, 0], 1.0),
    unit("kg²s⁴/m²", [2, -2, 4, 0], 1.0),
    unit("N", [1, 1, -2, 0], 1.0),
    unit("N·m", [1, 2, -2, 0], 1.0),
    unit("MPa", [1, -1, -2, 0], 1e6),
];

/// Names of units that tools write without their base units.
const OTHERS: [Unit; 6] = [
    unit("°", [0, 0, 0, 1], std::f64::consts::PI / 180.0),
    unit("deg/s", [0, 0, -1, 1], std::f64::consts::PI / 180.0),
    unit("%", [0, 0, 0, 0], 0.01),
    unit("g", [0, 1, -2, 0], 9.80665),
    unit("km/h", [0, 1, -1, 0], 1.0 / 3.6),
    unit("kN", [1, 1, -2, 0], 1e3),
];

/// Finds the unit of this name among our units and the units of other tools.
pub(crate) fn named(name: &str) -> Option<&'static Unit> {
    find(name).or_else(|| OTHERS.iter().find(|u| u.name == name))
}

/// The unit of this name; none if the base units cannot express it.
pub fn find(name: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|u| u.name == name)
}
