//! Moments of a scenario, found among its events and the places of its track.

use super::{Event, Moment, MomentOf, ScenarioFile, VehiclePart};
use crate::config::checked::Finite;
use crate::config::file::suggestion;
use crate::rail::Place;

/// Keys of a moment that hold a name.
const KEYS: &str = "front_enters, front_leaves, imu_enters, imu_leaves, rear_enters, rear_leaves, event, event_end";

impl Moment {
    /// Resolves it in a scenario on a track with these places. The error is the key below the moment's, message and
    /// help.
    pub fn find(
        &self,
        file: &ScenarioFile,
        places: &[Place],
    ) -> Result<MomentOf, (&'static str, String, String)> {
        let (key, name) = match self.given()[..] {
            [one] => one,
            [] => {
                return Err((
                    "",
                    "this has no key for the moment".into(),
                    format!("one of {KEYS}, such as {{rear_enters: climb}}"),
                ));
            }
            [(a, _), (b, _), ..] => {
                return Err((
                    b,
                    format!("`{a}` and `{b}` are two moments"),
                    "keep one of them".into(),
                ));
            }
        };
        let plus_s = self.plus_s.map_or(0.0, Finite::get);
        if key.starts_with("event") {
            return event(file, key, name).map(|at| MomentOf::Instant(at + plus_s));
        }
        let (from_m, to_m) = place(file, places, name).map_err(|(m, h)| (key, m, h))?;
        let part = match key {
            "front_enters" | "front_leaves" => VehiclePart::Front,
            "imu_enters" | "imu_leaves" => VehiclePart::Imu,
            _ => VehiclePart::Rear,
        };
        let at_m = if key.ends_with("enters") {
            from_m
        } else {
            to_m
        };
        Ok(MomentOf::Passing(part, at_m, plus_s))
    }
}

fn event(
    file: &ScenarioFile,
    key: &'static str,
    name: &str,
) -> Result<f64, (&'static str, String, String)> {
    let named = || {
        let events = file.events.iter();
        let events = events.filter_map(|e| Some((e.name()?, e.times_s()?)));
        let points = file.drive.speed.iter();
        let points = points.filter_map(|p| Some((p.name.as_deref()?, (p.at_s?.get(), None))));
        events.chain(points)
    };
    match named().find(|(n, _)| *n == name) {
        Some((_, (at_s, _))) if key == "event" => Ok(at_s),
        Some((_, (_, Some(end_s)))) => Ok(end_s),
        Some(_) => Err((
            key,
            format!("the event `{name}` has no end"),
            "`event`, or a `to_s` in the event".into(),
        )),
        None => {
            let (message, help) = unknown(name, "event", named().map(|(n, _)| n));
            Err((key, message, help))
        }
    }
}

/// Beginning and end of a place, m.
fn place(
    file: &ScenarioFile,
    places: &[Place],
    name: &str,
) -> Result<(f64, f64), (String, String)> {
    let of_track = places.iter().map(|p| (p.name.as_str(), p.from_m, p.to_m));
    let of_events = file.events.iter().filter_map(|e| match e {
        Event::Adhesion {
            from_m, to_m, name, ..
        } => Some((name.as_deref()?, from_m.get(), to_m.get())),
        _ => None,
    });
    let all: Vec<(&str, f64, f64)> = of_track.chain(of_events).collect();
    match all.iter().find(|(n, ..)| *n == name) {
        Some((_, from, to)) => Ok((*from, *to)),
        None => Err(unknown(name, "place", all.iter().map(|(n, ..)| *n))),
    }
}

/// Error for a name without an event or place.
fn unknown<'a>(
    name: &str,
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> (String, String) {
    let message = format!("there is no {what} `{name}`");
    let list: Vec<&str> = names.clone().collect();
    let help = match (list.is_empty(), what) {
        (false, _) => suggestion(name, names, "one of"),
        (true, "event") => "give an event this name: {name: outage, from_s: 40, …}".into(),
        _ => "give an element of the track file this name: {kind: grade, name: climb, …}".into(),
    };
    (message, help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> ScenarioFile {
        serde_yaml::from_str(
            "{version: 1, why: w, track: t, train: t, stop: {after_s: 60}, sensors: s, drive: {speed: [{at_s: 0, mps: 1}, {at_s: 12, mps: 0, name: stands}]},
              events: [{name: outage, from_s: 4, to_s: 7, sensor: imu, fault: off}, {name: brake, at_s: 9, brake: 1},
                       {name: wet, from_m: 30, to_m: 40, adhesion: 0.1}, {at_s: 11, brake: 0}]}",
        )
        .unwrap()
    }

    fn find(text: &str) -> Result<MomentOf, (&'static str, String, String)> {
        let places = [Place {
            name: "climb".into(),
            from_m: 10.0,
            to_m: 25.0,
        }];
        let moment: Moment = serde_yaml::from_str(text).unwrap();
        moment.find(&file(), &places)
    }

    #[test]
    fn moments_are_instants_of_events_and_passings_of_places() {
        for (text, is) in [
            ("{event: outage}", MomentOf::Instant(4.0)),
            ("{event_end: outage, plus_s: 2}", MomentOf::Instant(9.0)),
            ("{event: brake, plus_s: -1}", MomentOf::Instant(8.0)),
            ("{event: stands}", MomentOf::Instant(12.0)),
            (
                "{rear_enters: climb}",
                MomentOf::Passing(VehiclePart::Rear, 10.0, 0.0),
            ),
            (
                "{imu_leaves: climb, plus_s: 3}",
                MomentOf::Passing(VehiclePart::Imu, 25.0, 3.0),
            ),
            (
                "{front_leaves: wet}",
                MomentOf::Passing(VehiclePart::Front, 40.0, 0.0),
            ),
        ] {
            assert_eq!(find(text).unwrap(), is, "{text}");
        }
    }

    #[test]
    fn a_name_that_is_not_there_leads_to_the_nearest() {
        for (text, key, help) in [
            ("{event: outag}", "event", "`outage`"),
            ("{event_end: brake}", "event_end", "to_s"),
            ("{rear_enters: clim}", "rear_enters", "`climb`"),
            ("{plus_s: 3}", "", "rear_enters"),
            ("{event: brake, imu_leaves: climb}", "event", "keep one"),
        ] {
            let (at, _, right) = find(text).unwrap_err();
            assert!(at == key && right.contains(help), "{text}: {at}, {right}");
        }
    }
}
