//! Events of a scenario. The keys of an event determine its kind.

use super::fault_kind::{Axis, FaultKind};
use crate::config::checked::{Finite, Fraction, NonNegative, Positive};
use crate::error::DataError;
use crate::sensors::fault;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

/// An event of a run, recognised by its keys.
#[serde_with::skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(remote = "Self", untagged, deny_unknown_fields)]
pub enum Event {
    /// The load changes.
    LoadMass {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// kg.
        load_mass_kg: NonNegative,
        /// Speed along the rail of the mass that is hung on, m/s: 0 = it stood on the ground; none = the load's own
        /// speed. Mass that is set down leaves with the load's own speed and pushes nothing.
        load_speed_mps: Option<Finite>,
    },
    /// The rail is slippery.
    Adhesion {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// m.
        from_m: NonNegative,
        /// m.
        to_m: Positive,
        /// Coefficient.
        adhesion: NonNegative,
    },
    /// A sensor fails.
    SensorFault {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        from_s: NonNegative,
        /// s; none = to the end.
        to_s: Option<Positive>,
        /// Sensor name.
        sensor: String,
        /// Kind of the fault.
        fault: FaultKind,
        /// Size of the fault, in the unit it needs.
        size: Option<Finite>,
        /// Faulty axis of a three-axis sensor; none = all.
        axis: Option<Axis>,
    },
    /// The clamp pressure changes by command or by loss.
    ClampPressure {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// MPa.
        clamp_mpa: NonNegative,
    },
    /// Emergency brake.
    Brake {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// Share of the brake force, 0 releases.
        brake: Fraction,
    },
    /// A clamp brake drags: the controller does not know of it, and drives on.
    DraggingBrake {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// Share of the brake force, 0 ends the dragging.
        dragging_brake: Fraction,
    },
    /// A drive unit gives no torque any more; the other units take over its share.
    IsolatedDrive {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// Index of the unit, as in `wheel_speed[3]`.
        isolated_drive: u32,
    },
    /// The estimators' computer restarts.
    Restart {
        /// Name, for windows of expectations.
        name: Option<String>,
        /// s.
        at_s: NonNegative,
        /// Period of repetition, s; none = once.
        every_s: Option<Positive>,
        /// Time without a running estimator, s. Then all begin anew; the samples of that time are lost.
        restart_s: Positive,
    },
}

impl Event {
    /// Returns the name of the event, if it has one.
    pub(crate) fn name(&self) -> Option<&str> {
        match self {
            Event::LoadMass { name, .. }
            | Event::Adhesion { name, .. }
            | Event::SensorFault { name, .. }
            | Event::ClampPressure { name, .. }
            | Event::Brake { name, .. }
            | Event::DraggingBrake { name, .. }
            | Event::IsolatedDrive { name, .. }
            | Event::Restart { name, .. } => name.as_deref(),
        }
    }

    /// Returns the first begin and the end of the event, s; `None` for an event at a place, no end for an event that
    /// has no end.
    pub fn times_s(&self) -> Option<(f64, Option<f64>)> {
        match self {
            Event::LoadMass { at_s, .. }
            | Event::ClampPressure { at_s, .. }
            | Event::Brake { at_s, .. }
            | Event::DraggingBrake { at_s, .. }
            | Event::IsolatedDrive { at_s, .. } => Some((at_s.get(), None)),
            Event::Restart {
                at_s, restart_s, ..
            } => Some((at_s.get(), Some(at_s.get() + restart_s.get()))),
            Event::SensorFault { from_s, to_s, .. } => {
                Some((from_s.get(), to_s.map(Positive::get)))
            }
            Event::Adhesion { .. } => None,
        }
    }

    /// Sensor fault of this event, with the name of the sensor; `None` for other events. Keys in errors are those of
    /// the event.
    pub fn sensor_fault(&self) -> Result<Option<(&str, fault::FaultWindow)>, DataError> {
        let Event::SensorFault {
            from_s,
            to_s,
            sensor,
            fault: kind,
            size,
            axis,
            ..
        } = self
        else {
            return Ok(None);
        };
        let wrong = |key: &str, message: &str, help: &str| Err(DataError::new(key, message, help));
        let (from_s, to_s) = (from_s.get(), to_s.map_or(f64::INFINITY, |t| t.get()));
        if to_s <= from_s {
            return wrong(
                "to_s",
                &format!("the fault ends at {to_s} s, before it begins"),
                "use `to_s` above `from_s`, or leave out `to_s`: the fault then lasts to the end",
            );
        }
        let fault = match (kind.sized(), size.map(|x| x.get())) {
            (Err(fault), None) => fault,
            (Ok((_, build, can, _)), Some(size)) if can.contains(&size) => build(size),
            (Ok((what, .., help)), size) => {
                let found = size.map_or(String::new(), |size| format!(" other than {size}"));
                return wrong("size", &format!("{what} a size{found}"), help);
            }
            (Err(_), Some(_)) => {
                return wrong(
                    "size",
                    &format!("a fault of the kind `{}` has no size", kind.name()),
                    "leave `size` out",
                );
            }
        };
        if axis.is_some() && !kind.is_of_an_axis() {
            let message = format!(
                "a fault of the kind `{}` is always on all axes",
                kind.name()
            );
            return wrong("axis", &message, "leave `axis` out");
        }
        let window = fault::FaultWindow {
            from_s,
            to_s,
            fault,
            axis: axis.map(|axis| axis as usize),
        };
        Ok(Some((sensor, window)))
    }
}

/// Every key an event can have.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EventKeys {
    name: Option<String>,
    at_s: Option<NonNegative>,
    every_s: Option<Positive>,
    from_s: Option<NonNegative>,
    to_s: Option<Positive>,
    from_m: Option<NonNegative>,
    to_m: Option<Positive>,
    load_mass_kg: Option<NonNegative>,
    load_speed_mps: Option<Finite>,
    adhesion: Option<NonNegative>,
    sensor: Option<String>,
    fault: Option<FaultKind>,
    size: Option<Finite>,
    axis: Option<Axis>,
    clamp_mpa: Option<NonNegative>,
    brake: Option<Fraction>,
    restart_s: Option<Positive>,
    dragging_brake: Option<Fraction>,
    isolated_drive: Option<u32>,
}

/// A kind of event: the key that identifies it, the keys it needs, those it may have, and an example.
struct Kind(
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
    &'static str,
);

const KINDS: [Kind; 8] = [
    Kind(
        "load_mass_kg",
        &["at_s", "load_mass_kg"],
        &["every_s", "load_speed_mps"],
        "{at_s: 30, load_mass_kg: 10000}",
    ),
    Kind(
        "adhesion",
        &["from_m", "to_m", "adhesion"],
        &[],
        "{from_m: 80, to_m: 95, adhesion: 0.12}",
    ),
    Kind(
        "fault",
        &["from_s", "sensor", "fault"],
        &["to_s", "size", "axis"],
        "{from_s: 40, to_s: 43, sensor: imu, fault: stuck}",
    ),
    Kind(
        "clamp_mpa",
        &["at_s", "clamp_mpa"],
        &["every_s"],
        "{at_s: 20, clamp_mpa: 6}",
    ),
    Kind(
        "brake",
        &["at_s", "brake"],
        &["every_s"],
        "{at_s: 50, brake: 1}",
    ),
    Kind(
        "dragging_brake",
        &["at_s", "dragging_brake"],
        &["every_s"],
        "{at_s: 40, dragging_brake: 0.05}",
    ),
    Kind(
        "isolated_drive",
        &["at_s", "isolated_drive"],
        &["every_s"],
        "{at_s: 0, isolated_drive: 3}",
    ),
    Kind(
        "restart_s",
        &["at_s", "restart_s"],
        &["every_s"],
        "{at_s: 45, restart_s: 3}",
    ),
];

/// Kind that the given keys identify, or the mistake in them.
fn kind(given: &[&str]) -> Result<&'static Kind, String> {
    let matched: Vec<&Kind> = KINDS.iter().filter(|k| given.contains(&k.0)).collect();
    let kind = match matched[..] {
        [one] => one,
        [] => {
            let examples: Vec<_> = KINDS.iter().map(|k| k.3).collect();
            return Err(format!(
                "this event has no key for its kind; write one of {}",
                examples.join(", ")
            ));
        }
        [a, b, ..] => {
            return Err(format!(
                "`{}` and `{}` are two events; write them as two list items",
                a.0, b.0
            ));
        }
    };
    if let Some(missing) = kind.1.iter().find(|key| !given.contains(key)) {
        return Err(format!(
            "this `{}` event lacks the key `{missing}`; write it like {}",
            kind.0, kind.3
        ));
    }
    if let Some(extra) = given
        .iter()
        .find(|key| **key != "name" && !kind.1.contains(key) && !kind.2.contains(key))
    {
        return Err(format!(
            "`{extra}` means nothing in a `{}` event; write it like {}",
            kind.0, kind.3
        ));
    }
    Ok(kind)
}

impl<'de> Deserialize<'de> for Event {
    fn deserialize<D: Deserializer<'de>>(de: D) -> Result<Self, D::Error> {
        let keys = EventKeys::deserialize(de)?;
        let mut event = serde_json::to_value(keys).map_err(D::Error::custom)?;
        let mut given = Vec::new();
        if let serde_json::Value::Object(keys) = &mut event {
            keys.retain(|_, value| !value.is_null());
            given = keys.keys().map(String::as_str).collect();
        }
        kind(&given).map_err(D::Error::custom)?;
        Event::deserialize(event).map_err(D::Error::custom)
    }
}

impl Serialize for Event {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        Event::serialize(self, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_is_an_event_and_comes_back_from_its_json() {
        for Kind(name, .., example) in &KINDS {
            let event: Event =
                serde_yaml::from_str(example).unwrap_or_else(|e| panic!("{name}: {e}"));
            let json = serde_json::to_string(&event).unwrap();
            assert_eq!(serde_json::from_str::<Event>(&json).unwrap(), event);
            assert!(json.contains(name), "{json}");
        }
    }

    #[test]
    fn an_event_short_of_any_key_it_needs_is_refused_by_that_key() {
        for Kind(name, needs, may, _) in &KINDS {
            for absent in *needs {
                let given: Vec<&str> = needs
                    .iter()
                    .chain(*may)
                    .filter(|k| k != &absent)
                    .copied()
                    .collect();
                let wrong = kind(&given).err().unwrap();
                assert!(wrong.contains(absent) || absent == name, "{wrong}");
            }
        }
    }

    #[test]
    fn wrong_faults_are_refused_at_the_right_key() {
        let event = |to_s: Option<f64>, fault, size: Option<f64>| Event::SensorFault {
            name: None,
            from_s: NonNegative::new(5.0),
            to_s: to_s.map(Positive::new),
            sensor: "imu".into(),
            fault,
            size: size.map(Finite::new),
            axis: None,
        };
        for (e, key) in [
            (event(Some(5.0), FaultKind::Off, None), "to_s"),
            (event(None, FaultKind::Drift, None), "size"),
            (event(None, FaultKind::Scale, None), "size"),
            (event(None, FaultKind::Spikes, None), "size"),
            (event(None, FaultKind::Stuck, Some(1.0)), "size"),
            (event(None, FaultKind::KmPerH, Some(3.6)), "size"),
            (event(None, FaultKind::Bias, None), "size"),
            (event(None, FaultKind::Noise, Some(-0.1)), "size"),
            (event(None, FaultKind::Quantised, Some(0.0)), "size"),
            (event(None, FaultKind::Dropouts, Some(1.1)), "size"),
        ] {
            assert_eq!(e.sensor_fault().unwrap_err().key, key);
        }
        let told = event(None, FaultKind::KmPerH, Some(3.6));
        assert!(
            told.sensor_fault()
                .unwrap_err()
                .message
                .contains("`km_per_h`")
        );
        let right = event(Some(6.0), FaultKind::Scale, Some(2.0));
        let (sensor, window) = right.sensor_fault().unwrap().unwrap();
        assert_eq!(
            (sensor, window.to_s, window.fault),
            ("imu", 6.0, fault::Fault::Scale(2.0))
        );
        for (fault, good) in [
            ("stuck", true),
            ("bias, size: 1", true),
            ("off", false),
            ("in_g", false),
            ("dropouts, size: 0.5", false),
            ("axes_xy_swapped", false),
        ] {
            let text = format!("{{from_s: 1, sensor: gyro, axis: up, fault: {fault}}}");
            let event: Event = serde_yaml::from_str(&text).unwrap();
            match event.sensor_fault() {
                Ok(found) => assert!(good && found.unwrap().1.axis == Some(2), "{fault}"),
                Err(e) => assert!(!good && e.key == "axis", "{fault}"),
            }
        }
        let load = Event::LoadMass {
            name: None,
            at_s: NonNegative::new(1.0),
            every_s: None,
            load_mass_kg: NonNegative::new(1.0),
            load_speed_mps: None,
        };
        assert!(load.sensor_fault().unwrap().is_none());
    }
}
