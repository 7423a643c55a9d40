//! Everything that a scenario leaves to defaults, written out: for manifests and hashes.

use super::registry::{PartType, Registry};
use crate::config::scenario::Scenario;
use monorig_estimators::api::params::Setting;
use serde_json::{Map, Value, json};

/// The scenario with its defaults, and under `parameters` those of its estimators and controller; null is what they
/// derive from the vehicle.
pub fn resolved(scenario: &Scenario, registry: &Registry) -> Value {
    let mut estimators = Map::new();
    for (name, settings) in &scenario.file.estimators {
        if let Ok(of_type) = registry.estimator_of(name, settings) {
            estimators.insert(name.clone(), parameters(&of_type, &settings.named()));
        }
    }
    let settings = &scenario.file.drive.controller;
    let controller = registry.controller_of(settings).ok();
    let controller = controller.map(|kind| parameters(&kind, &settings.named()));
    // Strings, numbers and lists of them: nothing in a scenario can fail to serialise.
    let mut all = serde_json::to_value(scenario).unwrap_or_default();
    if let Some(all) = all.as_object_mut() {
        let both = json!({ "estimators": estimators, "controller": controller });
        all.insert("parameters".into(), both);
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
