//! The plant that a scenario names: one of ours, or one that a program adds.

use super::ParameterValue;
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

/// The plant of a train or a car.
#[derive(Clone, Debug, PartialEq)]
pub enum PlantKind {
    /// Rigid bodies in rapier.
    Rapier,
    /// A point on the rail.
    PointMass,
    /// A car on a road.
    Road,
    /// One of the registry.
    Own {
        /// Its name.
        kind: String,
        /// Its parameters by name.
        values: BTreeMap<String, ParameterValue>,
    },
}

/// Ours, by name.
const OURS: [(&str, PlantKind); 3] = [
    ("rapier", PlantKind::Rapier),
    ("point-mass", PlantKind::PointMass),
    ("road", PlantKind::Road),
];

impl PlantKind {
    /// The names of ours.
    pub fn names() -> impl Iterator<Item = &'static str> {
        OURS.iter().map(|(name, _)| *name)
    }

    /// One of the registry, with its defaults; one of ours if that has the name.
    pub fn named(name: &str) -> Self {
        let ours = OURS.iter().find(|(known, _)| *known == name);
        ours.map_or_else(
            || Self::Own {
                kind: name.into(),
                values: BTreeMap::new(),
            },
            |(_, kind)| kind.clone(),
        )
    }
}

/// Parameters by name as a build function takes them.
pub(crate) fn settings(values: &BTreeMap<String, ParameterValue>) -> Vec<(&str, Setting<'_>)> {
    let values = values.iter();
    values.map(|(k, v)| (k.as_str(), v.setting())).collect()
}

impl<'de> Deserialize<'de> for PlantKind {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = PlantKind;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a plant, or a mapping such as {kind: NAME, mass_kg: 2000}")
            }
            fn visit_str<E: Error>(self, name: &str) -> Result<PlantKind, E> {
                Ok(PlantKind::named(name))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<PlantKind, A::Error> {
                let (mut name, mut given) = (None::<String>, BTreeMap::new());
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "kind" => name = Some(map.next_value()?),
                        _ => {
                            given.insert(key, map.next_value()?);
                        }
                    }
                }
                let name = name.ok_or_else(|| A::Error::missing_field("kind"))?;
                match PlantKind::named(&name) {
                    PlantKind::Own { kind, .. } => Ok(PlantKind::Own {
                        kind,
                        values: given,
                    }),
                    ours if given.is_empty() => Ok(ours),
                    _ => Err(A::Error::custom(format!("`{name}` has no parameters"))),
                }
            }
        }
        de.deserialize_any(Entries)
    }
}

impl Serialize for PlantKind {
    fn serialize<S: Serializer>(&self, ser: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Own { kind, values } if !values.is_empty() => {
                let mut map = ser.serialize_map(None)?;
                map.serialize_entry("kind", kind)?;
                for (key, value) in values {
                    map.serialize_entry(key, value)?;
                }
                map.end()
            }
            Self::Own { kind, .. } => ser.serialize_str(kind),
            ours => {
                let named = OURS.iter().find(|(_, kind)| kind == ours);
                ser.serialize_str(named.map_or("", |(name, _)| name))
            }
        }
    }
}

impl JsonSchema for PlantKind {
    fn schema_name() -> Cow<'static, str> {
        "PlantKind".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = generator.subschema_for::<ParameterValue>();
        json_schema!({
            "description": "The plant of a train or a car: `rapier` for rigid bodies, `point-mass` for a point on the rail, `road` for a car on a road, or one that the program adds, with its parameters.",
            "anyOf": [
                { "type": "string" },
                {
                    "type": "object",
                    "properties": { "kind": { "type": "string" } },
                    "required": ["kind"],
                    "additionalProperties": value
                }
            ]
        })
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
        assert!(matches!(own, PlantKind::Own { values, .. } if values.len() == 1));
        for bad in ["{kind: rapier, gain: 2}", "{gain: 2}", "[rapier]"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
