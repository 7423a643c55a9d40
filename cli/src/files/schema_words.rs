//! Words in the schemas: names of the program's estimators with their parameters, controllers, plants, metrics and
//! instruments.

use monorig_estimators::api::params::{Key, KeyKind};
use monorig_lab::metrics::METRICS;
use monorig_sim::closed_loop::registry::{EstimatorType, Registry};
use monorig_sim::config::scenario::PlantKind;
use monorig_sim::sensors::instruments::SHEET_KEYS;
use serde_json::{Map, Value, json};

/// Kind of the words that a key of a schema can have.
#[derive(Clone, Copy, Debug)]
pub enum Words {
    /// The name of a type of estimator.
    EstimatorTypes,
    /// The name of a type of controller.
    Controllers,
    /// The name of a plant, with parameters if the program adds the plant.
    Plants,
    /// The names of instruments that the program adds, with their parameters.
    OwnInstruments,
    /// The name of a metric.
    Metric,
    /// The name of a metric, or a list of them.
    Metrics,
    /// The name of an instrument, of the IMU, or of one of several equal instruments, such as `wheel_speed[2]`.
    Instruments,
    /// Estimators by name: the name of a type with its parameters, or another name with the key `is`.
    Estimators,
}

impl Words {
    /// Puts the words into the schema of a key, which is at `place` in its file. `of_entry`: keys of an estimator's
    /// entry that are not parameters.
    pub fn put(
        self,
        key: &mut Map<String, Value>,
        place: &str,
        registry: &Registry,
        of_entry: &[String],
    ) {
        let types = registry.estimators();
        match self {
            Self::EstimatorTypes => one_of(key, types.iter().map(|t| t.name())),
            Self::Controllers => one_of(key, registry.controllers().iter().map(|t| t.name())),
            Self::Plants => {
                let mut names: Vec<&str> = PlantKind::names().collect();
                names.extend(registry.plants().iter().map(|t| t.name()));
                let names = json!({ "enum": names });
                if let Some(either) = key.get_mut("anyOf") {
                    either[1]["properties"]["kind"] = names.clone();
                    either[0] = names;
                }
            }
            Self::OwnInstruments => {
                let own = registry.instruments().iter().map(|t| {
                    let keys = t.keys().map(|key| (key.name.to_owned(), parameter(key)));
                    let properties = Value::Object(keys.collect());
                    let entry = json!({"type": "object", "description": t.description(), "properties": properties, "additionalProperties": false});
                    (t.name().to_owned(), entry)
                });
                key.insert("properties".into(), Value::Object(own.collect()));
                key.insert("additionalProperties".into(), false.into());
            }
            Self::Metric => one_of(key, METRICS.iter().map(|m| m.name)),
            Self::Metrics => {
                let mut one = Map::new();
                one_of(&mut one, METRICS.iter().map(|m| m.name));
                key.remove("$ref");
                key.insert(
                    "anyOf".into(),
                    json!([one, {"type": "array", "items": one}]),
                );
            }
            Self::Instruments => {
                let mut named = Map::new();
                // the first key is the source of the sheet
                let own = registry.instruments().iter().map(|t| t.name());
                let of_sheet = SHEET_KEYS.iter().skip(1).copied().chain(["imu"]);
                one_of(&mut named, of_sheet.chain(own));
                let one_of_several = json!({"pattern": "^[a-z_]+\\[[0-9]+\\]$"});
                key.insert("anyOf".into(), json!([named, one_of_several]));
            }
            Self::Estimators => {
                let mut parameters = Map::new();
                let named = types.iter().map(|t| {
                    let entry = of_type(t, of_entry, place, &mut parameters);
                    (t.name().to_owned(), entry)
                });
                key.insert("properties".into(), Value::Object(named.collect()));
                key.insert("$defs".into(), parameters.into());
                let typed = types.iter().map(|t| {
                    let is = json!({"properties": {"is": {"const": t.name()}}, "required": ["is"]});
                    json!({"if": is, "then": {"$ref": format!("#{place}/properties/{}", t.name())}})
                });
                let settings = std::iter::once(json!({"$ref": "#/$defs/Settings"}));
                // `from` names parameters and no estimator
                let names_one = of_entry.iter().filter(|k| *k != "from");
                let of_its_own = json!({
                    "allOf": settings.chain(typed).collect::<Vec<_>>(),
                    "anyOf": names_one.map(|k| json!({"required": [k]})).collect::<Vec<_>>(),
                });
                key.insert("additionalProperties".into(), of_its_own);
            }
        }
    }
}

fn one_of<'a>(key: &mut Map<String, Value>, words: impl Iterator<Item = &'a str>) {
    let mut all: Vec<&str> = words.collect();
    all.dedup();
    key.insert("enum".into(), all.into());
}

/// Entry of an estimator: its parameters and its source. Many estimators share parameters, so each parameter stands
/// once in `parameters`, the definitions of the key at `place`.
fn of_type(
    of: &EstimatorType,
    of_entry: &[String],
    place: &str,
    parameters: &mut Map<String, Value>,
) -> Value {
    let mut properties = Map::new();
    for key in of.keys() {
        let schema = parameter(key);
        let mut names = (1..).map(|i| format!("{}_{i}", key.name));
        let same = |name: &String| parameters.get(name).is_none_or(|there| *there == schema);
        let Some(name) = names.find(same) else {
            continue;
        };
        let there = json!({"$ref": format!("#{place}/$defs/{name}")});
        parameters.insert(name, schema);
        properties.insert(key.name.to_owned(), there);
    }
    for key in of_entry {
        let one = json!({"$ref": format!("#/$defs/Settings/properties/{key}")});
        properties.insert(key.clone(), one);
    }
    json!({
        "description": of.description(),
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    })
}

fn parameter(key: &Key) -> Value {
    let mut schema = match key.kind {
        KeyKind::Number {
            range: [low, high], ..
        } => json!({"type": "number", "minimum": low, "maximum": high}),
        KeyKind::Flag { .. } => json!({"type": "boolean"}),
        KeyKind::Choice { choices, .. } => json!({"enum": choices}),
    };
    schema["description"] = key.doc.into();
    schema
}
