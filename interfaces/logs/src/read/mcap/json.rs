//! Numbers of a JSON message, by the path to them: `torque.0`, `header.seq`.

use serde_json::Value;

/// Parses a message. The words `NaN` and `Infinity`, which JSON does not have and Python writes, stand for no value.
pub(super) fn parse(data: &[u8]) -> Result<Value, serde_json::Error> {
    serde_json::from_slice(data).or_else(|e| {
        let (mut text, mut rest) = (Vec::with_capacity(data.len()), data);
        let (mut in_string, mut escaped) = (false, false);
        while let Some((byte, behind)) = rest.split_first() {
            let words: [&[u8]; 3] = [b"NaN", b"-Infinity", b"Infinity"];
            let word = words.iter().find(|w| !in_string && rest.starts_with(w));
            if let Some(word) = word {
                text.extend(b"null");
                rest = rest.get(word.len()..).unwrap_or_default();
                continue;
            }
            in_string ^= *byte == b'"' && !escaped;
            escaped = in_string && *byte == b'\\' && !escaped;
            text.push(*byte);
            rest = behind;
        }
        serde_json::from_slice(&text).map_err(|_| e)
    })
}

/// Puts every number, truth value and `null` (NaN) of a message into `values`, in the order of the message.
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
        Value::Null => values.push((own(), f64::NAN)),
        Value::String(_) => {}
    }
}
