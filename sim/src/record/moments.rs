//! The moments of a run that its scenario and its track name: events of a recording beside those that act.

use crate::closed_loop::Simulation;
use crate::config::scenario::Event;

/// A moment, and the text that is recorded at this moment.
struct Awaited {
    when: When,
    text: String,
}

#[derive(Clone, Copy)]
enum When {
    /// An instant, s.
    At(f64),
    /// The IMU comes to a chainage, m.
    Imu(f64),
}

impl When {
    fn has_come(self, t_s: f64, imu_m: f64) -> bool {
        match self {
            Self::At(at_s) => t_s >= at_s,
            Self::Imu(at_m) => imu_m >= at_m,
        }
    }
}

/// Moments to come.
#[derive(Default)]
pub(super) struct Moments(Vec<Awaited>);

impl Moments {
    /// Collects the named points of the drive cycle, the train's arrivals at the named stretches of the track, and the
    /// ends of faults. What the start is beyond already does not come.
    pub(super) fn of(simulation: &Simulation) -> Self {
        let file = &simulation.scenario.file;
        let named = file.drive.speed.iter();
        let named = named.filter_map(|p| Some((p.at_s?.get(), p.name.clone()?)));
        let ends = file.events.iter().filter_map(|event| match event {
            Event::SensorFault {
                to_s: Some(to_s),
                sensor,
                fault,
                ..
            } => {
                let fault = format!("{fault:?}").to_lowercase();
                Some((to_s.get(), format!("fault on {sensor}: {fault} is over")))
            }
            _ => None,
        });
        let instants = named.chain(ends).map(|(at_s, text)| Awaited {
            when: When::At(at_s),
            text,
        });
        let mut all: Vec<Awaited> = instants.collect();
        let truth = simulation.plant.truth();
        // the rail of a recorded drive is not known
        if !simulation.plant.is_recorded() {
            let front_m = simulation.imu_offset_m;
            let rear_m = front_m + simulation.train.limits.length_m;
            all.extend(simulation.rail.places.iter().flat_map(|place| {
                let at = |imu_m: f64, what: &str| Awaited {
                    when: When::Imu(imu_m),
                    text: format!("{what} {}", place.name),
                };
                [
                    at(place.from_m + front_m, "front enters"),
                    at(place.from_m + rear_m, "rear enters"),
                    at(place.to_m + rear_m, "rear leaves"),
                ]
            }));
        }
        all.retain(|m| !m.when.has_come(truth.t_s, truth.chainage_m));
        Self(all)
    }

    /// Removes and returns the moments that have been reached.
    pub(super) fn come(&mut self, t_s: f64, imu_m: f64) -> impl Iterator<Item = String> {
        let come = self.0.extract_if(.., move |m| m.when.has_come(t_s, imu_m));
        come.map(|m| m.text)
    }
}
