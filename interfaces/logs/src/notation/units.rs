//! The closed list of units of a log, each with its quantity and the way to its SI unit.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::f64::consts::PI;

/// A measured quantity: columns of another quantity cannot stand for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Specific force or acceleration, m/s².
    Acceleration,
    /// Angular rate, rad/s.
    AngularRate,
    /// Speed, m/s.
    Speed,
    /// Torque, N·m.
    Torque,
    /// Force, N.
    Force,
    /// Power, W.
    Power,
    /// Pressure, MPa (the unit of [`Measurements`](monorig_estimators::Measurements)).
    Pressure,
    /// Angle, rad.
    Angle,
    /// Slope, rad.
    Slope,
    /// Length, m.
    Length,
    /// Share or number, 1.
    Number,
}

/// The way from a value to one in the SI unit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ToSi {
    /// Times a factor.
    Factor(f64),
    /// asin of the value times a factor.
    Sine(f64),
    /// atan of the value times a factor.
    Tangent(f64),
}

/// A unit of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    /// Its name in map files.
    pub name: &'static str,
    /// Other ways logs write it.
    others: &'static [&'static str],
    /// Its quantity.
    pub quantity: Quantity,
    to_si: ToSi,
}

/// From rows of quantity, name, other names and way to the SI unit: the list of units.
macro_rules! units {
    ($($quantity:ident $name:literal [$($other:literal),*] $way:ident($factor:expr);)*) => {
        &[$(Unit { name: $name, others: &[$($other),*], quantity: Quantity::$quantity, to_si: ToSi::$way($factor) }),*]
    };
}

/// Standard gravity, m/s²: the unit `g`, and gravity where a log is held against it.
pub(crate) const STANDARD_GRAVITY_MPS2: f64 = 9.80665;

/// All units; a name may stand for several quantities (`deg`: angle and slope).
pub(crate) const UNITS: &[Unit] = units! {
    Acceleration "m/s2" ["m/s²", "m/s^2", "m/s/s", "mps2"] Factor(1.0);
    Acceleration "g" [] Factor(STANDARD_GRAVITY_MPS2);
    Acceleration "mg" [] Factor(STANDARD_GRAVITY_MPS2 * 1e-3);
    AngularRate "rad/s" ["radps"] Factor(1.0);
    AngularRate "deg/s" ["°/s", "dps", "degps"] Factor(PI / 180.0);
    Speed "m/s" ["mps"] Factor(1.0);
    Speed "km/h" ["kph", "kmh"] Factor(1.0 / 3.6);
    Speed "mm/s" [] Factor(1e-3);
    Speed "m/min" [] Factor(1.0 / 60.0);
    Speed "mph" [] Factor(0.44704);
    Torque "Nm" ["N·m", "N.m", "N m", "N*m", "nm"] Factor(1.0);
    Torque "kNm" ["kN·m"] Factor(1e3);
    Force "N" [] Factor(1.0);
    Force "kN" [] Factor(1e3);
    Power "W" [] Factor(1.0);
    Power "kW" [] Factor(1e3);
    Pressure "MPa" [] Factor(1.0);
    Pressure "bar" [] Factor(0.1);
    Pressure "kPa" [] Factor(1e-3);
    Pressure "Pa" [] Factor(1e-6);
    Angle "rad" [] Factor(1.0);
    Angle "deg" ["°"] Factor(PI / 180.0);
    Slope "rad" [] Factor(1.0);
    Slope "deg" ["°"] Factor(PI / 180.0);
    Slope "sin" [] Sine(1.0);
    Slope "tan" [] Tangent(1.0);
    Slope "%" ["percent"] Tangent(0.01);
    Length "m" [] Factor(1.0);
    Length "km" [] Factor(1e3);
    Length "mm" [] Factor(1e-3);
    Number "1" ["-"] Factor(1.0);
};

impl Quantity {
    /// The quantity whose SI unit (of a pressure MPa) is called so; of an angle and a slope it is the angle.
    pub fn of_si(unit: &str) -> Option<Self> {
        let is_si = |u: &&Unit| u.is_called(unit) && u.to_si == ToSi::Factor(1.0);
        UNITS.iter().find(is_si).map(|u| u.quantity)
    }

    /// Name of its SI unit.
    pub fn si_name(self) -> &'static str {
        self.units().next().map_or("1", |u| u.name)
    }

    /// The units of this quantity.
    pub fn units(self) -> impl Iterator<Item = &'static Unit> {
        UNITS.iter().filter(move |u| u.quantity == self)
    }

    /// The unit of this name for this quantity.
    pub fn unit(self, name: &str) -> Option<&'static Unit> {
        self.units().find(|u| u.is_called(name))
    }

    /// The names of its units, for messages.
    pub fn names(self) -> String {
        self.units().map(|u| u.name).collect::<Vec<_>>().join(", ")
    }

    /// In a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Acceleration => "an acceleration",
            Self::AngularRate => "an angular rate",
            Self::Speed => "a speed",
            Self::Torque => "a torque",
            Self::Force => "a force",
            Self::Power => "a power",
            Self::Pressure => "a pressure",
            Self::Angle => "an angle",
            Self::Slope => "a slope",
            Self::Length => "a length",
            Self::Number => "a number",
        }
    }
}

impl Unit {
    /// True if logs or map files call it so.
    pub fn is_called(&self, name: &str) -> bool {
        self.name == name || self.others.contains(&name)
    }

    /// The value in the SI unit of its quantity (pressure in MPa).
    pub fn to_si(self, x: f64) -> f64 {
        match self.to_si {
            ToSi::Factor(factor) => x * factor,
            ToSi::Sine(factor) => (x * factor).asin(),
            ToSi::Tangent(factor) => (x * factor).atan(),
        }
    }
}

/// A unit as a map file names it: one of the list by its place, not yet of a certain quantity.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub(crate) struct UnitName(usize);

impl UnitName {
    /// Its name in map files.
    pub fn as_str(&self) -> &'static str {
        self.unit().name
    }

    /// The unit, for the first of the quantities that it may stand for.
    pub fn unit(&self) -> &'static Unit {
        UNITS.get(self.0).unwrap_or(&UNITS[0])
    }
}

impl TryFrom<String> for UnitName {
    type Error = String;
    fn try_from(name: String) -> Result<Self, String> {
        match UNITS.iter().position(|u| u.is_called(&name)) {
            Some(place) => Ok(Self(place)),
            None => Err(format!("`{name}` is an unknown unit; known: {}", list())),
        }
    }
}

impl From<UnitName> for String {
    fn from(unit: UnitName) -> String {
        unit.as_str().to_owned()
    }
}

impl JsonSchema for UnitName {
    fn schema_name() -> Cow<'static, str> {
        "UnitName".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let mut names: Vec<&str> = UNITS
            .iter()
            .flat_map(|u| std::iter::once(u.name).chain(u.others.iter().copied()))
            .collect();
        names.sort_unstable();
        names.dedup();
        json_schema!({ "enum": names })
    }
}

/// The names of all units.
fn list() -> String {
    let mut names: Vec<&str> = Vec::new();
    for u in UNITS {
        if !names.contains(&u.name) {
            names.push(u.name);
        }
    }
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_lead_to_si() {
        let si = |q: Quantity, name: &str, x: f64| q.unit(name).unwrap().to_si(x);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(si(Quantity::Speed, "km/h", 36.0), 10.0);
        near(si(Quantity::AngularRate, "°/s", 180.0), PI);
        near(si(Quantity::Acceleration, "g", 1.0), 9.80665);
        near(si(Quantity::Pressure, "bar", 100.0), 10.0);
        near(si(Quantity::Slope, "%", 100.0), PI / 4.0);
        near(si(Quantity::Slope, "sin", 0.5), PI / 6.0);
        assert!(Quantity::Speed.unit("Nm").is_none());
        assert!(
            UnitName::try_from("furlong".to_owned())
                .unwrap_err()
                .contains("km/h")
        );
    }

    #[test]
    fn si_units_have_their_quantity() {
        for (unit, quantity, name) in [
            ("m/s²", Quantity::Acceleration, "m/s2"),
            ("N·m", Quantity::Torque, "Nm"),
            ("MPa", Quantity::Pressure, "MPa"),
            ("rad", Quantity::Angle, "rad"),
            ("1", Quantity::Number, "1"),
        ] {
            assert_eq!(Quantity::of_si(unit), Some(quantity));
            assert_eq!(quantity.si_name(), name);
        }
        assert_eq!(Quantity::of_si("km/h"), None);
    }

    /// Within a quantity a name has one meaning.
    #[test]
    fn names_are_given_once() {
        for (i, u) in UNITS.iter().enumerate() {
            for other in &UNITS[..i] {
                assert!(
                    other.quantity != u.quantity || !other.is_called(u.name),
                    "{}",
                    u.name
                );
            }
        }
    }
}
