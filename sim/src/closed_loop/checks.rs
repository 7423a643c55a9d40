//! Checks a scenario against its vehicle and its track.

use crate::config::scenario::{Event, MomentOf, Scenario};
use crate::error::Error;
use crate::plant::train::adhesion::AdhesionZone;
use crate::rail::Rail;
use crate::train::Train;

/// Free rail behind the last wheel at the start if no start chainage is given, m.
const REAR_ROOM_M: f64 = 1.0;

/// A car runs on a road, a train on a rail.
pub fn track(scenario: &Scenario, rail: &Rail, car: bool) -> Result<(), Error> {
    match (car, rail.profile()) {
        (true, Some(_)) => Err(scenario.error(
            "track",
            "this track is a rail, and a car needs a road",
            "a track with `road_width_m` in place of `profile`",
        )),
        (false, None) => Err(scenario.error(
            "track",
            "this track is a road, and a train needs a rail",
            "a track with `profile` in place of `road_width_m`",
        )),
        _ => Ok(()),
    }
}

/// The physics step suits the train's springs. The error is the scenario's: it chooses the step.
pub fn step(scenario: &Scenario, train: &Train, dt_s: f64) -> Result<(), Error> {
    train.check_step(dt_s).map_err(|e| {
        scenario.error(
            "physics.dt_ms",
            format!("{} (train {})", e.message, scenario.vehicle.display()),
            e.help,
        )
    })
}

/// No event asks for more load than the train may carry, or isolates a drive that it does not have.
pub fn events(scenario: &Scenario, train: &Train) -> Result<(), Error> {
    let max_kg = if train.load.is_some() {
        train.limits.max_load_kg
    } else {
        0.0
    };
    let drives = train.drives.len();
    for (i, e) in scenario.file.events.iter().enumerate() {
        if let Event::IsolatedDrive { isolated_drive, .. } = e
            && *isolated_drive as usize >= drives
        {
            return Err(scenario.error(
                format!("events[{i}].isolated_drive"),
                format!("there is no drive {isolated_drive}"),
                format!("an index below {drives}, counted from 0 at the front"),
            ));
        }
        if let Event::LoadMass { load_mass_kg, .. } = e
            && load_mass_kg.get() > max_kg
        {
            return Err(scenario.error(
                format!("events[{i}].load_mass_kg"),
                format!("the train cannot carry a load of {} kg", load_mass_kg.get()),
                format!("a load from 0 to {max_kg} kg"),
            ));
        }
    }
    Ok(())
}

/// Chainage of the front at the start.
pub fn front(scenario: &Scenario, rail: &Rail, train: &Train) -> Result<f64, Error> {
    let length = train.limits.length_m;
    let behind = length + REAR_ROOM_M;
    let front = scenario.file.start.chainage_m.map_or(behind, f64::from);
    if front < length || front > rail.length() {
        return Err(scenario.error(
            "start.chainage_m",
            format!("a train with its front at {front} m is not on the track"),
            format!(
                "a chainage from {} m (the train is that long) to {} m (the track ends there)",
                libm::ceil(length * 1e3 - 1e-6) / 1e3,
                rail.end_m()
            ),
        ));
    }
    if let Some(end) = scenario
        .file
        .stop
        .at_m
        .filter(|end| end.get() > rail.length())
    {
        return Err(scenario.error(
            "stop.at_m",
            format!("{} m is beyond the end of the track", end.get()),
            format!("a chainage of at most {} m", rail.end_m()),
        ));
    }
    Ok(front)
}

/// The zones of another adhesion, each on the track.
pub fn zones(scenario: &Scenario, rail: &Rail) -> Result<Vec<AdhesionZone>, Error> {
    let mut zones = Vec::new();
    for (i, e) in scenario.file.events.iter().enumerate() {
        if let Event::Adhesion {
            from_m,
            to_m,
            adhesion,
            ..
        } = e
        {
            let z = AdhesionZone {
                from_m: from_m.get(),
                to_m: to_m.get(),
                adhesion: adhesion.get(),
            };
            if z.from_m >= rail.length() {
                return Err(scenario.error(
                    format!("events[{i}].from_m"),
                    format!(
                        "the zone starts at {} m, beyond the end of the track",
                        z.from_m
                    ),
                    format!("a chainage below {} m", rail.end_m()),
                ));
            }
            if z.to_m > rail.length() {
                return Err(scenario.error(
                    format!("events[{i}].to_m"),
                    format!("the zone ends at {} m, beyond the end of the track", z.to_m),
                    format!("a chainage of at most {} m", rail.end_m()),
                ));
            }
            zones.push(z);
        }
    }
    Ok(zones)
}

/// Every window of an expectation names places of this track and events of this scenario.
pub fn windows(scenario: &Scenario, rail: &Rail) -> Result<(), Error> {
    let file = &scenario.file;
    let of_bounds = file.expect.iter().enumerate();
    let of_bounds = of_bounds.map(|(i, e)| (format!("expect[{i}]"), [&e.after, &e.until]));
    let known = file.known_failures.iter();
    let known = known.map(|k| {
        let at = format!("known_failures[{}]", k.entry);
        (at, [&k.after, &k.until])
    });
    for (at, ends) in of_bounds.chain(known) {
        for (key, moment) in ["after", "until"].into_iter().zip(ends) {
            let Some(moment) = moment else { continue };
            let found = moment
                .find(file, &rail.places)
                .map_err(|(below, message, help)| {
                    let key = format!("{at}.{key}.{below}");
                    scenario.error(key.trim_end_matches('.'), message, help)
                })?;
            let end_s = file.stop.time_limit_s();
            let within = match found {
                MomentOf::Instant(t_s) => (0.0..=end_s).contains(&t_s),
                MomentOf::Passing(_, _, plus_s) => plus_s.abs() <= end_s,
            };
            if !within {
                return Err(scenario.error(
                    format!("{at}.{key}"),
                    format!(
                        "{moment} is not within the run, which lasts from 0 to {end_s} s at most"
                    ),
                    "a smaller `plus_s`, or another event",
                ));
            }
        }
    }
    Ok(())
}
