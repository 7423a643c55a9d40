//! Plant of a scenario: a plant of monorig, or of another program.

use super::named_part::{NamedPart, PartKeys};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

/// The plant of a train or a car: `rapier` for rigid bodies, `point-mass` for a point on the rail, `road` for a car on
/// a road, or one that the program adds, with its parameters.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(try_from = "PlantSettings")]
pub enum PlantKind {
    /// Rigid bodies in rapier.
    Rapier,
    /// A point on the rail.
    PointMass,
    /// A car on a road.
    Road,
    /// One of the registry.
    Own(PlantSettings),
}

/// A plant by its name, and its parameters.
pub type PlantSettings = NamedPart<PlantKeys>;

/// The plant of a train or a car: `rapier` for rigid bodies, `point-mass` for a point on the rail, `road` for a car on
/// a road, or one that the program adds, with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "PlantKind")]
pub struct PlantKeys {
    /// Name of the plant.
    pub kind: String,
}

impl PartKeys for PlantKeys {
    const FORM: &'static str =
        "the name of a plant, or a mapping such as {kind: NAME, mass_kg: 2000}";
    const NAME_ALONE: bool = true;

    fn of_name(name: &str) -> Option<Self> {
        Some(Self { kind: name.into() })
    }
}

/// Ours, by name.
const OURS: [(&str, PlantKind); 3] = [
    ("rapier", PlantKind::Rapier),
    ("point-mass", PlantKind::PointMass),
    ("road", PlantKind::Road),
];

impl PlantKind {
    /// Returns the names of monorig's plants.
    pub fn names() -> impl Iterator<Item = &'static str> {
        OURS.iter().map(|(name, _)| *name)
    }

    /// Returns the plant of monorig with this name, else a plant of the registry with its defaults.
    pub fn named(name: &str) -> Self {
        let ours = OURS.iter().find(|(known, _)| *known == name);
        ours.map_or_else(
            || Self::Own(PlantSettings::of_kind(name)),
            |(_, kind)| kind.clone(),
        )
    }
}

impl PlantSettings {
    /// A plant of this name, with its defaults.
    pub fn of_kind(name: &str) -> Self {
        Self::from(PlantKeys { kind: name.into() })
    }
}

impl TryFrom<PlantSettings> for PlantKind {
    type Error = String;
    fn try_from(part: PlantSettings) -> Result<Self, String> {
        match Self::named(&part.kind) {
            Self::Own(_) => Ok(Self::Own(part)),
            ours if part.values.is_empty() => Ok(ours),
            _ => Err(format!("`{}` has no parameters", part.kind)),
        }
    }
}

impl Serialize for PlantKind {
    fn serialize<S: Serializer>(&self, ser: S) -> Result<S::Ok, S::Error> {
        let name = match self {
            Self::Own(part) if !part.values.is_empty() => return part.serialize(ser),
            Self::Own(part) => &part.kind,
            ours => OURS
                .iter()
                .find(|(_, kind)| kind == ours)
                .map_or("", |(name, _)| *name),
        };
        ser.serialize_str(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ours_are_words_and_others_have_parameters() {
        let read = |text: &str| serde_yaml::from_str::<PlantKind>(text);
        for (name, kind) in OURS {
            assert_eq!(read(name).unwrap(), kind);
            assert_eq!(serde_yaml::to_string(&kind).unwrap().trim(), name);
        }
        assert_eq!(read("mine").unwrap(), PlantKind::named("mine"));
        let own = read("{kind: mine, gain: 2}").unwrap();
        assert_eq!(
            own,
            read(&serde_yaml::to_string(&own).unwrap()).unwrap(),
            "read back"
        );
        assert!(matches!(own, PlantKind::Own(part) if part.values.len() == 1));
        for bad in ["{kind: rapier, gain: 2}", "{gain: 2}", "[rapier]"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
