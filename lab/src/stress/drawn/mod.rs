//! Faults that are drawn, each on a drawn course: a condition that nobody chose, and nobody tuned an estimator on.

mod table;

use crate::draw::{Course, Draws, four_digits, round};
use crate::stress::{ConditionFile, Group};
use monorig_sim::config::checked::{Finite, NonNegative, Positive, Version1};
use monorig_sim::config::scenario::{Axis, Event, FaultKind};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use table::{Drawn, SENSORS, Sensor};

/// Share of the conditions with two faults at once.
const TWO: f64 = 0.3;
/// Share of the faults on one drive unit, and on one axis, if there are several.
const ONE_OF_MANY: f64 = 0.5;
/// Share of the faults that begin at the start.
const FROM_START: f64 = 0.2;
/// Share of the run after which no fault begins.
const LATEST: f64 = 0.95;
/// Share of the faults that last to the end of the run.
const TO_END: f64 = 0.3;
/// Shortest fault, s.
const SHORTEST_S: f64 = 1.0;
/// Classes of a size by its place in the logarithm of its range.
const SIZES: [&str; 3] = ["small", "middle", "large"];

/// Name of the condition of this seed.
pub fn fault_name(seed: u64) -> String {
    format!("fault_{seed}")
}

/// Draws the condition of this seed for a course: one fault, or two at once.
pub fn fault(course: &Course, seed: u64) -> ConditionFile {
    let mut draws = Draws::new(seed, "fault");
    let mut made = ConditionFile {
        version: Version1,
        condition: String::new(),
        group: Group::Instruments,
        classes: BTreeMap::new(),
        set: BTreeMap::new(),
        told_factor: BTreeMap::new(),
        events: Vec::new(),
    };
    let faults = if draws.chance(TWO) { 2 } else { 1 };
    for _ in 0..faults {
        // samples are late by one time: a second delay of the same instrument is drawn again
        while !add(&mut made, course, &mut draws) {}
    }
    made.condition += ".";
    made
}

/// Adds a fault to a condition; returns false if it cannot be combined with the existing faults.
fn add(made: &mut ConditionFile, course: &Course, draws: &mut Draws) -> bool {
    let fitted = |s: &Sensor| {
        let there = s.instruments.iter().all(|i| course.instruments.contains(i));
        if there { s.weight } else { 0.0 }
    };
    let sensor = &SENSORS[draws.place(&SENSORS.each_ref().map(fitted))];
    let faults = sensor.faults();
    let range = faults[draws.place(&vec![1.0; faults.len()])];
    let place = draws.within([0.0, 1.0]);
    let size = range.size.map(|[low, high]| {
        let [low, high] = [low, high].map(libm::log);
        four_digits(libm::exp(low + (high - low) * place))
    });
    let class = match range.size {
        Some(_) => SIZES[((place * 3.0) as usize).min(2)],
        None => "without",
    };
    let words = match range.fault {
        Drawn::Event(kinds, made_of) => {
            let fault = kinds[draws.place(&vec![1.0; kinds.len()])];
            let plus = draws.chance(0.5);
            let size = size.map(|size| made_of(size, plus));
            event(made, sensor, fault, size, course, draws)
        }
        Drawn::Late { wrong_stamps } => {
            match late(made, sensor, size.unwrap_or_default(), wrong_stamps) {
                Some(words) => words,
                None => return false,
            }
        }
    };
    if !made.condition.is_empty() {
        made.condition += "; ";
    }
    made.condition += &words;
    for (by, class) in [
        ("kind", range.kind),
        ("size", class),
        ("sensor", sensor.name),
    ] {
        let classes: &mut BTreeSet<String> = made.classes.entry(by.into()).or_default();
        classes.insert(class.into());
    }
    true
}

/// Delays the samples of a sensor by a time, ms; `None` if they are already delayed.
fn late(made: &mut ConditionFile, sensor: &Sensor, ms: f64, wrong_stamps: bool) -> Option<String> {
    let key = |i: &str, key: &str| format!("sensors.{i}.sampling.{key}");
    let mut instruments = sensor.instruments.iter();
    if instruments.any(|i| made.set.contains_key(&key(i, "latency_ms"))) {
        return None;
    }
    for i in sensor.instruments {
        made.set.insert(key(i, "latency_ms"), json!(ms));
        if wrong_stamps {
            made.set.insert(key(i, "clock.offset_ms"), json!(ms));
        }
    }
    let stamps = if wrong_stamps {
        "stamped as they arrive"
    } else {
        "with right stamps"
    };
    Some(format!("{}: {ms} ms late, {stamps}", sensor.name))
}

/// Adds a fault as an event: of a sensor or a part of it, for a time.
fn event(
    made: &mut ConditionFile,
    sensor: &Sensor,
    fault: FaultKind,
    size: Option<f64>,
    course: &Course,
    draws: &mut Draws,
) -> String {
    let one = draws.chance(ONE_OF_MANY);
    let part = draws.within([0.0, 1.0]);
    let of = |many: usize| ((part * many as f64) as usize).min(many.saturating_sub(1));
    let axis = (one && fault.is_of_an_axis() && sensor.has_axes)
        .then(|| [Axis::Forward, Axis::Left, Axis::Up][of(3)]);
    let name = match sensor.has_axes {
        false if one && course.drives > 1 => format!("{}[{}]", sensor.name, of(course.drives)),
        _ => sensor.name.to_owned(),
    };

    let from_s = match draws.chance(FROM_START) {
        true => 0.0,
        false => round(draws.within([0.0, LATEST * course.over_s]), 1),
    };
    let rest_s = (course.over_s - from_s).max(SHORTEST_S);
    let length_s = libm::exp(draws.within([libm::log(SHORTEST_S), libm::log(rest_s)]));
    let to_s = (!draws.chance(TO_END)).then(|| round(from_s + length_s, 1));

    let unit = match fault {
        FaultKind::Scale | FaultKind::Dropouts => String::new(),
        FaultKind::Drift => format!(" {} per s", sensor.unit),
        _ => format!(" {}", sensor.unit),
    };
    let size_words = size.map_or(String::new(), |size| format!(" {size}{unit}"));
    let axis_words = axis.map_or(String::new(), |axis| format!(" {axis:?}").to_lowercase());
    let until = to_s.map_or("on".to_owned(), |to_s| format!("to {to_s} s"));
    let words = format!(
        "{name}{axis_words}: {}{size_words} from {from_s} s {until}",
        fault.name()
    );
    made.events.push(Event::SensorFault {
        name: None,
        from_s: NonNegative::new(from_s),
        to_s: to_s.map(Positive::new),
        sensor: name,
        fault,
        size: size.map(Finite::new),
        axis,
    });
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(drives: usize, instruments: &[&'static str]) -> Course {
        Course {
            name: "test".into(),
            files: Vec::new(),
            over_s: 200.0,
            drives,
            instruments: instruments.to_vec(),
        }
    }

    const ALL: [&str; 5] = [
        "accelerometer",
        "clamp_pressure",
        "gyro",
        "motor_torque",
        "wheel_speed",
    ];

    fn many(course: &Course) -> Vec<ConditionFile> {
        (0..4000).map(|seed| fault(course, seed)).collect()
    }

    fn has(made: &ConditionFile, of: &str, class: &str) -> bool {
        made.classes[of].contains(class)
    }

    /// Each sensor, kind and size is drawn; events hold, begin in the run and are of parts that are there.
    #[test]
    fn everything_is_drawn_and_stands_within_its_range() {
        let made = many(&course(8, &ALL));
        for sensor in &SENSORS {
            for range in sensor.faults() {
                let both = made
                    .iter()
                    .filter(|m| has(m, "kind", range.kind) && has(m, "sensor", sensor.name));
                let sizes: BTreeSet<&String> = both.flat_map(|m| &m.classes["size"]).collect();
                assert!(!sizes.is_empty(), "{} {}", sensor.name, range.kind);
            }
        }
        for event in made.iter().flat_map(|m| &m.events) {
            let (name, window) = event.sensor_fault().unwrap().unwrap();
            assert!((0.0..=190.0).contains(&window.from_s) && window.to_s > window.from_s);
            let unit = name
                .split_once('[')
                .map(|(_, unit)| unit.trim_end_matches(']'));
            assert!(
                unit.is_none_or(|unit| unit.parse::<usize>().unwrap() < 8),
                "{name}"
            );
            let sensor = SENSORS.iter().find(|s| name.starts_with(s.name)).unwrap();
            assert!(window.axis.is_none() || sensor.has_axes);
            let Event::SensorFault { fault, size, .. } = event else {
                panic!()
            };
            let range = sensor.faults().into_iter().find(|f| match f.fault {
                Drawn::Event(kinds, _) => kinds.contains(fault),
                Drawn::Late { .. } => false,
            });
            let Some([low, high]) = range.unwrap().size else {
                assert!(size.is_none());
                continue;
            };
            let size = size.unwrap().get().abs();
            let size = if *fault == FaultKind::Scale {
                libm::log(size).abs()
            } else {
                size
            };
            let near = 0.9 * low..=1.1 * high; // four digits of a factor
            assert!(near.contains(&size), "{fault:?} {size}");
        }
        let late = |m: &&ConditionFile| has(m, "kind", "late") || has(m, "kind", "stamped_late");
        for m in made.iter().filter(late) {
            let late = m.set.iter().filter(|(key, _)| key.ends_with("latency_ms"));
            let mut late = late.map(|(_, ms)| ms.as_f64().unwrap()).peekable();
            assert!(late.peek().is_some());
            assert!(late.all(|ms| (5.0..=2000.0).contains(&ms)));
        }
    }

    /// Shares are those asked for, and a third of the sizes is in each class.
    #[test]
    fn shares_are_those_of_the_table() {
        let made = many(&course(8, &ALL));
        let share = |of: &dyn Fn(&ConditionFile) -> bool| {
            made.iter().filter(|m| of(m)).count() as f64 / made.len() as f64
        };
        let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 0.04, "{found}");
        near(share(&|m| m.condition.contains("; ")), TWO);
        let events: Vec<&Event> = made.iter().flat_map(|m| &m.events).collect();
        let of = |holds: &dyn Fn(f64, Option<f64>) -> bool| {
            let times = events.iter().filter_map(|e| e.times_s());
            times.filter(|(a, b)| holds(*a, *b)).count() as f64 / events.len() as f64
        };
        near(of(&|from, _| from == 0.0), FROM_START);
        near(of(&|_, to| to.is_none()), TO_END);
        let one = made
            .iter()
            .filter(|m| !m.condition.contains("; ") && !has(m, "size", "without"));
        let one: Vec<&ConditionFile> = one.collect();
        for class in SIZES {
            let there = one.iter().filter(|m| has(m, "size", class)).count();
            near(there as f64 / one.len() as f64, 1.0 / 3.0);
        }
    }

    /// An instrument that a course does not have has no fault, and a fault is the same whenever it is drawn.
    #[test]
    fn faults_are_of_what_is_there_and_of_their_seed_alone() {
        let poor = course(1, &["gyro", "wheel_speed"]);
        for (seed, made) in (0..).zip(many(&poor)) {
            let sensors = &made.classes["sensor"];
            assert!(sensors.iter().all(|s| s == "gyro" || s == "wheel_speed"));
            assert!(!made.condition.contains('['), "{}", made.condition);
            assert_eq!(made.to_yaml(), fault(&poor, seed).to_yaml());
        }
    }
}
