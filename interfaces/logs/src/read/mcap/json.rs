//! Numbers of a JSON message, by the path to them: `torque.0`, `header.seq`.

use serde_json::Value;

/// Puts every number and truth value of a message into `values`, in the order of the message.
pub(super) fn flatten(value: &Value, path: &str, values: &mut Vec<(String, f64)>) {
    let below = |key: &str| match path {
        "" => key.to_owned(),
        _ => format!("{path}.{key}"),
    };
    let own = || {
        if path.is_empty() {
            "data".to_owned()
        } else {
            path.to_owned()
        }
    };
    match value {
        Value::Number(n) => values.push((own(), n.as_f64().unwrap_or(f64::NAN))),
        Value::Bool(b) => values.push((own(), f64::from(u8::from(*b)))),
        Value::Object(fields) => fields
            .iter()
            .for_each(|(key, v)| flatten(v, &below(key), values)),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .for_each(|(i, v)| flatten(v, &below(&i.to_string()), values)),
        Value::Null | Value::String(_) => {}
    }
}
