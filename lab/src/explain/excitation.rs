//! A drive that excites more: the same speed reference with a ripple on it.

use monorig_sim::config::scenario::DriveCycle;
use serde_json::{Value, json};

/// Description of the source: the motion that is added.
pub(crate) const WHAT: &str = "too little excitation: with a ripple of 20 % and 10 s on the speed reference, so that the motors pull and push in turn";

/// Amplitude of the ripple as a share of the reference.
const RIPPLE: f64 = 0.2;
const PERIOD_S: f64 = 10.0;
/// Points of the reference in a period.
const POINTS: f64 = 8.0;
/// Largest number of points of a drive with ripple.
const MAX_POINTS: usize = 20_000;

/// The speed reference with the ripple, as YAML; `None` for a reference by chainage, a repeated reference or
/// standstill.
pub(crate) fn excited(drive: &DriveCycle) -> Option<String> {
    if drive.every_s.is_some() {
        return None;
    }
    let points = drive.speed.iter();
    let points = points.map(|p| Some((p.at_s?.get(), p.mps.get(), p.name.clone())));
    let mut points = points.collect::<Option<Vec<_>>>()?;
    let (last, speed) = points.last().map(|p| (p.0, p.1))?;
    if points.iter().all(|p| p.1 == 0.0) {
        return None;
    }
    // the last value holds: the ripple goes on for as long as a run may well take
    let end = if speed == 0.0 { last } else { last + 600.0 };
    points.push((end, speed, None));
    let mut all: Vec<Value> = Vec::new();
    for pair in points.windows(2) {
        let [(t0, v0, name), (t1, v1, _)] = pair else {
            continue;
        };
        all.push(point(*t0, *v0, name.as_deref()));
        let steps = ((t1 - t0) / (PERIOD_S / POINTS)).ceil().max(1.0) as usize;
        for i in 1..steps {
            let share = i as f64 / steps as f64;
            all.push(point(t0 + share * (t1 - t0), v0 + share * (v1 - v0), None));
        }
    }
    all.push(point(end, speed, None));
    all.dedup_by(|b, a| a["at_s"] == b["at_s"]);
    (all.len() <= MAX_POINTS).then(|| Value::Array(all).to_string())
}

fn point(t: f64, v: f64, name: Option<&str>) -> Value {
    let ripple = 1.0 + RIPPLE * (std::f64::consts::TAU * t / PERIOD_S).sin();
    match name {
        Some(name) => json!({"at_s": t, "mps": v * ripple, "name": name}),
        None => json!({"at_s": t, "mps": v * ripple}),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ripple_is_about_the_reference_and_names_stay() {
        let mut drive =
            DriveCycle::by_time(&[(0.0, 0.0), (5.0, 1.0), (45.0, 1.0), (50.0, 0.0)]).unwrap();
        drive.speed[1].name = Some("at_speed".into());
        let text = excited(&drive).unwrap();
        let all: Vec<Value> = serde_json::from_str(&text).unwrap();
        let at = |p: &Value| (p["at_s"].as_f64().unwrap(), p["mps"].as_f64().unwrap());
        let moving = all.iter().map(at).filter(|(t, _)| (5.0..45.0).contains(t));
        let (n, sum) = moving.fold((0.0, 0.0), |(n, sum), (_, v)| (n + 1.0, sum + v));
        assert!((sum / n - 1.0f64).abs() < 0.02, "{}", sum / n);
        assert!(
            all.windows(2).all(|w| at(&w[0]).0 < at(&w[1]).0),
            "times ascend"
        );
        assert!(text.contains("at_speed"));
        assert_eq!(
            at(all.last().unwrap()),
            (50.0, 0.0),
            "what stands at the end stands still"
        );
        let by_chainage = DriveCycle::by_chainage(&[(0.0, 1.0)], 0.2).unwrap();
        assert!(excited(&by_chainage).is_none());
        assert!(excited(&DriveCycle::by_time(&[(0.0, 0.0)]).unwrap()).is_none());
    }
}
