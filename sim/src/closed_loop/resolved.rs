//! Everything that a scenario leaves to defaults, written out: for manifests and hashes.

use super::registry::{PartType, Registry};
use crate::config::scenario::{PlantKind, Scenario};
use monorig_estimators::api::params::Setting;
use serde_json::{Map, Value, json};

/// Returns the scenario with its defaults, and under `parameters` the parameters of its parts from the registry; null
/// is a value derived from the vehicle.
pub fn resolved(scenario: &Scenario, registry: &Registry) -> Value {
    let mut estimators = Map::new();
    for (name, settings) in &scenario.file.estimators {
        if let Ok(of_type) = registry.estimator_of(name, settings) {
            estimators.insert(name.clone(), parameters(&of_type, &settings.named()));
        }
    }
    let given = &scenario.file.drive.controller;
    let controller = registry.controller_of(given).ok();
    let controller = controller.map(|kind| parameters(&kind, &given.named()));
    let mut parts = Map::new();
    parts.insert("estimators".into(), estimators.into());
    parts.insert("controller".into(), json!(controller));
    for (name, given) in &scenario.file.instruments {
        if let Ok(of_type) = registry.find_instrument(name) {
            let all = parts.entry("instruments").or_insert_with(|| json!({}));
            all[name] = parameters(of_type, &given.named());
        }
    }
    if let Some(PlantKind::Own(given)) = &scenario.file.physics.plant
        && let Ok(of_kind) = registry.find_plant(&given.kind)
    {
        parts.insert("plant".into(), parameters(of_kind, &given.named()));
    }
    // Strings, numbers and lists of them: nothing in a scenario can fail to serialise.
    let mut all = serde_json::to_value(scenario).unwrap_or_default();
    if let Some(all) = all.as_object_mut() {
        all.insert("parameters".into(), parts.into());
    }
    all
}

fn parameters<B: ?Sized>(of_type: &PartType<B>, given: &[(&str, Setting<'_>)]) -> Value {
    let value = |name: &str| given.iter().find(|(key, _)| *key == name).map(|(_, x)| *x);
    let all = of_type.keys().map(|key| {
        let setting = value(key.name).or_else(|| key.default());
        (key.name.to_owned(), setting.map_or(Value::Null, json_of))
    });
    Value::Object(all.collect())
}

fn json_of(setting: Setting<'_>) -> Value {
    match setting {
        Setting::Number(x) if x.is_finite() => json!(x),
        Setting::Number(x) => json!(x.to_string()),
        Setting::Flag(flag) => json!(flag),
        Setting::Choice(word) => json!(word),
    }
}
