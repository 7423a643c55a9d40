//! A part of a scenario that is a kind by its name and its parameters: estimator, controller, plant, instrument.

use super::ParameterValue;
use monorig_estimators::api::params::Setting;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, forward_to_deserialize_any};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

/// A part of a scenario: the keys that every part of its sort has, such as the name of its kind, and its parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct NamedPart<K> {
    /// Keys that are not parameters.
    #[serde(flatten)]
    pub keys: K,
    /// Parameters by name.
    #[serde(flatten)]
    pub values: BTreeMap<String, ParameterValue>,
}

/// Keys of a sort of part that are not parameters: a struct whose fields are these keys.
pub trait PartKeys: for<'de> Deserialize<'de> + JsonSchema {
    /// Form in which a part is written, for errors.
    const FORM: &'static str;
    /// True if a part without parameters can be written as the name of its kind alone.
    const NAME_ALONE: bool = false;

    /// Keys of a part that is written as a name alone.
    fn of_name(_: &str) -> Option<Self> {
        None
    }

    /// The keys, if their combination is allowed.
    fn checked(self) -> Result<Self, &'static str> {
        Ok(self)
    }
}

impl<K> NamedPart<K> {
    /// Sets the value of a parameter.
    pub fn set(mut self, key: &str, value: impl Into<ParameterValue>) -> Self {
        self.values.insert(key.into(), value.into());
        self
    }

    /// The parameters as a build function takes them.
    pub fn named(&self) -> Vec<(&str, Setting<'_>)> {
        let values = self.values.iter();
        values.map(|(k, v)| (k.as_str(), v.setting())).collect()
    }
}

impl<K> From<K> for NamedPart<K> {
    /// A part with its default parameters.
    fn from(keys: K) -> Self {
        Self {
            keys,
            values: BTreeMap::new(),
        }
    }
}

impl<K> Deref for NamedPart<K> {
    type Target = K;
    fn deref(&self) -> &K {
        &self.keys
    }
}

impl<K> DerefMut for NamedPart<K> {
    fn deref_mut(&mut self) -> &mut K {
        &mut self.keys
    }
}

/// Reads a key that must have a value.
pub(super) fn given<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    de: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(de).map(Some)
}

impl<'de, K: PartKeys> Deserialize<'de> for NamedPart<K> {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        match K::NAME_ALONE {
            true => de.deserialize_any(PartVisitor(PhantomData)),
            false => de.deserialize_map(PartVisitor(PhantomData)),
        }
    }
}

struct PartVisitor<K>(PhantomData<K>);

impl<'de, K: PartKeys> Visitor<'de> for PartVisitor<K> {
    type Value = NamedPart<K>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(K::FORM)
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<NamedPart<K>, E> {
        let keys = K::of_name(name).map(NamedPart::from);
        keys.ok_or_else(|| E::invalid_type(Unexpected::Str(name), &self))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NamedPart<K>, A::Error> {
        let mut values = BTreeMap::new();
        let keys = K::deserialize(Splitter {
            map,
            known: &[],
            values: &mut values,
        })?;
        let keys = keys.checked().map_err(A::Error::custom)?;
        Ok(NamedPart { keys, values })
    }
}

/// Hands the known keys of a mapping to a struct, and puts the others among the parameters. Unlike `flatten` of serde
/// it copies nothing, so that an error keeps its place.
struct Splitter<'a, A> {
    map: A,
    known: &'static [&'static str],
    values: &'a mut BTreeMap<String, ParameterValue>,
}

impl<'de, A: MapAccess<'de>> Deserializer<'de> for Splitter<'_, A> {
    type Error = A::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, A::Error> {
        visitor.visit_map(Self { known, ..self })
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, A::Error> {
        MapAccessDeserializer::new(self.map).deserialize_any(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Splitter<'_, A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, A::Error> {
        while let Some(key) = self.map.next_key::<String>()? {
            if self.known.contains(&key.as_str()) {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            let value = self.map.next_value()?;
            self.values.insert(key, value);
        }
        Ok(None)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

impl<K: PartKeys> JsonSchema for NamedPart<K> {
    fn schema_name() -> Cow<'static, str> {
        K::schema_name()
    }

    fn inline_schema() -> bool {
        K::inline_schema()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut part = K::json_schema(generator);
        let parameter = generator.subschema_for::<ParameterValue>();
        part.insert("additionalProperties".into(), parameter.into());
        match K::NAME_ALONE {
            true => {
                let about = part.remove("description");
                json_schema!({ "description": about, "anyOf": [{ "type": "string" }, part] })
            }
            false => part,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
    #[serde(default)]
    struct WheelKeys {
        kind: String,
        #[serde(deserialize_with = "given", skip_serializing_if = "Option::is_none")]
        axle: Option<u8>,
    }

    impl PartKeys for WheelKeys {
        const FORM: &'static str = "a wheel, such as {kind: NAME}";
    }

    fn read(text: &str) -> Result<NamedPart<WheelKeys>, String> {
        let tree: serde_yaml::Value = serde_yaml::from_str(text).unwrap();
        serde_path_to_error::deserialize(&tree).map_err(|e| e.to_string())
    }

    #[test]
    fn keys_stand_beside_parameters_in_any_order_and_are_read_back() {
        let part = read("{gain: 2, kind: steel, wet: true, axle: 3, tyre: none}").unwrap();
        assert_eq!((part.kind.as_str(), part.axle), ("steel", Some(3)));
        let names: Vec<&str> = part.named().iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["gain", "tyre", "wet"]);
        assert_eq!(read(&serde_yaml::to_string(&part).unwrap()), Ok(part));
    }

    #[test]
    fn an_error_is_at_the_key_or_parameter_it_is_of() {
        for (text, told) in [
            ("{gain: 2, axle: x}", "axle: invalid type: string \"x\""),
            ("{axle: null}", "axle: invalid type: unit value"),
            ("{axle: 1, gain: [2]}", "gain: invalid type: sequence"),
            ("{gain: .nan}", "gain: "),
            ("steel", "a wheel, such as {kind: NAME}"),
            ("[1]", "a wheel, such as {kind: NAME}"),
        ] {
            let e = read(text).unwrap_err();
            assert!(e.contains(told), "{text}: {e}");
        }
    }
}
