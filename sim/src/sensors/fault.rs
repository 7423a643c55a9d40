//! Faults by event: off, stuck, drift, wrong scale, spikes.
//!
//! Drift, scale and spikes act on the sensed value, before quantisation and saturation: a fault cannot read beyond the
//! range. Off and stuck act on what is handed over. A fault holds for stamps from ≤ t < to. Its random draws come from a
//! stream of its own, so that a fault leaves the noise of the run as it was.

use super::stream::Stream;
use crate::config::file::input_error;
use crate::config::scenario::{Event, Fault};
use crate::error::Error;
use std::path::Path;

/// Share of samples that a spike hits while the fault `spikes` lasts.
pub const SPIKE_PROBABILITY: f64 = 0.02;

/// One fault of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// From, s.
    pub from_s: f64,
    /// Until, s; infinite = to the end.
    pub to_s: f64,
    /// What fails.
    pub fault: Fault,
    /// Size in the unit the fault needs: unit/s (drift), factor (scale), unit (spikes); 0 for off and stuck.
    pub size: f64,
}

/// All faults of one sensor of `N` axes.
#[derive(Clone, Debug)]
pub struct Faults<const N: usize> {
    windows: Vec<Window>,
    stream: Stream,
    /// The last value handed over while not stuck.
    last: Option<[f64; N]>,
}

impl<const N: usize> Faults<N> {
    /// No faults yet.
    pub fn new(seed: u64, name: &str) -> Self {
        Self {
            windows: Vec::new(),
            stream: Stream::new(seed, &format!("{name}/fault")),
            last: None,
        }
    }

    /// One more fault.
    pub fn add(&mut self, window: Window) {
        self.windows.push(window);
    }

    /// Drift, scale and spikes at stamp `t_s`, in the order of the events.
    pub fn disturb(&mut self, t_s: f64, value: &mut [f64; N]) {
        for w in self.windows.iter().filter(|w| w.holds(t_s)) {
            match w.fault {
                Fault::Drift => value
                    .iter_mut()
                    .for_each(|x| *x += w.size * (t_s - w.from_s)),
                Fault::Scale => value.iter_mut().for_each(|x| *x *= w.size),
                Fault::Spikes => {
                    if self.stream.uniform() < SPIKE_PROBABILITY {
                        for x in value.iter_mut() {
                            *x += if self.stream.uniform() < 0.5 {
                                w.size
                            } else {
                                -w.size
                            };
                        }
                    }
                }
                Fault::Off | Fault::Stuck => {}
            }
        }
    }

    /// What is handed over at stamp `t_s`: nothing when off, the last good value when stuck.
    pub fn hand_over(&mut self, t_s: f64, value: [f64; N]) -> Option<[f64; N]> {
        let holds = |fault| {
            self.windows
                .iter()
                .any(|w| w.fault == fault && w.holds(t_s))
        };
        let (off, stuck) = (holds(Fault::Off), holds(Fault::Stuck));
        // A sensor stuck from its first sample on stays at that one.
        let output = match self.last {
            Some(last) if stuck => last,
            _ => value,
        };
        self.last = Some(output);
        (!off).then_some(output)
    }
}

impl Window {
    fn holds(&self, t_s: f64) -> bool {
        self.from_s <= t_s && t_s < self.to_s
    }
}

/// The fault in event number `index` of a scenario, with the name of the sensor; `None` for other events.
pub fn read<'a>(
    scenario: &Path,
    index: usize,
    event: &'a Event,
) -> Result<Option<(&'a str, Window)>, Error> {
    let Event::SensorFault {
        from_s,
        to_s,
        sensor,
        fault,
        size,
    } = event
    else {
        return Ok(None);
    };
    let wrong = |key: &str, message: String, help: &str| {
        Err(input_error(
            scenario,
            format!("events[{index}].{key}"),
            message,
            help,
        ))
    };
    let window = Window {
        from_s: from_s.get(),
        to_s: to_s.map_or(f64::INFINITY, |t| t.get()),
        fault: *fault,
        size: size.map_or(0.0, |x| x.get()),
    };
    if window.to_s <= window.from_s {
        return wrong(
            "to_s",
            format!("the fault ends at {} s, before it begins", window.to_s),
            "to_s above from_s, or leave it out: to the end",
        );
    }
    match (fault, size) {
        (Fault::Drift, None) => wrong(
            "size",
            "a drift needs a size".into(),
            "size in the sensor's unit per second",
        ),
        (Fault::Scale, None) => wrong(
            "size",
            "a wrong scale needs a size".into(),
            "the factor values are multiplied by, such as 1.1",
        ),
        (Fault::Spikes, None) => wrong(
            "size",
            "spikes need a size".into(),
            "the height of a spike in the sensor's unit",
        ),
        (Fault::Off | Fault::Stuck, Some(_)) => wrong(
            "size",
            "a sensor that is off or stuck has no size of fault".into(),
            "leave `size` out",
        ),
        _ => Ok(Some((sensor, window))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::checked::{Finite, NonNegative, Positive};

    fn faults(list: &[(Fault, f64)]) -> Faults<1> {
        let mut faults = Faults::new(1, "test");
        for (fault, size) in list {
            faults.add(Window {
                from_s: 2.0,
                to_s: 4.0,
                fault: *fault,
                size: *size,
            });
        }
        faults
    }

    fn at(faults: &mut Faults<1>, t_s: f64, value: f64) -> Option<f64> {
        let mut x = [value];
        faults.disturb(t_s, &mut x);
        faults.hand_over(t_s, x).map(|[y]| y)
    }

    #[test]
    fn off_gives_nothing_inside_its_window_only() {
        let mut f = faults(&[(Fault::Off, 0.0)]);
        let seen = [1.99, 2.0, 3.99, 4.0].map(|t| at(&mut f, t, 7.0));
        assert_eq!(seen, [Some(7.0), None, None, Some(7.0)]);
    }

    #[test]
    fn stuck_repeats_the_last_value_before_it() {
        let mut f = faults(&[(Fault::Stuck, 0.0)]);
        let seen = [1.9, 2.0, 3.0, 4.0].map(|t| at(&mut f, t, t));
        assert_eq!(seen, [Some(1.9), Some(1.9), Some(1.9), Some(4.0)]);
        let mut from_the_start = faults(&[(Fault::Stuck, 0.0)]);
        assert_eq!(
            [2.5, 3.0].map(|t| at(&mut from_the_start, t, t)),
            [Some(2.5), Some(2.5)]
        );
    }

    #[test]
    fn drift_grows_from_its_beginning_and_scale_multiplies() {
        let mut f = faults(&[(Fault::Drift, 0.5)]);
        assert_eq!(
            [1.0, 2.0, 3.0, 5.0].map(|t| at(&mut f, t, 1.0)),
            [Some(1.0), Some(1.0), Some(1.5), Some(1.0)]
        );
        let mut f = faults(&[(Fault::Scale, 1.5)]);
        assert_eq!(
            [1.0, 3.0].map(|t| at(&mut f, t, -2.0)),
            [Some(-2.0), Some(-3.0)]
        );
    }

    #[test]
    fn spikes_are_rare_of_their_size_and_of_both_signs() {
        let mut f: Faults<1> = Faults::new(1, "spikes");
        f.add(Window {
            from_s: 0.0,
            to_s: f64::INFINITY,
            fault: Fault::Spikes,
            size: 3.0,
        });
        let n = 50_000;
        let (mut up, mut down) = (0.0, 0.0);
        for k in 0..n {
            match at(&mut f, f64::from(k), 1.0) {
                Some(4.0) => up += 1.0,
                Some(-2.0) => down += 1.0,
                other => assert_eq!(other, Some(1.0)),
            }
        }
        let each = SPIKE_PROBABILITY / 2.0 * f64::from(n);
        for count in [up, down] {
            assert!(
                f64::abs(count - each) < 5.0 * each.sqrt(),
                "{count} not {each}"
            );
        }
    }

    #[test]
    fn wrong_events_are_refused_at_the_right_key() {
        let event = |to_s: Option<f64>, fault, size: Option<f64>| Event::SensorFault {
            from_s: NonNegative::try_from(5.0).unwrap(),
            to_s: to_s.map(|t| Positive::try_from(t).unwrap()),
            sensor: "imu".into(),
            fault,
            size: size.map(|s| Finite::try_from(s).unwrap()),
        };
        let file = Path::new("scenario.yaml");
        for (e, key) in [
            (event(Some(5.0), Fault::Off, None), "events[3].to_s"),
            (event(None, Fault::Drift, None), "events[3].size"),
            (event(None, Fault::Scale, None), "events[3].size"),
            (event(None, Fault::Spikes, None), "events[3].size"),
            (event(None, Fault::Stuck, Some(1.0)), "events[3].size"),
        ] {
            match read(file, 3, &e) {
                Err(Error::Input(found)) => assert_eq!(found.key, key),
                other => panic!("{other:?}"),
            }
        }
        assert!(
            read(file, 0, &event(Some(6.0), Fault::Scale, Some(2.0)))
                .unwrap()
                .is_some()
        );
        let load = Event::LoadMass {
            at_s: NonNegative::try_from(1.0).unwrap(),
            every_s: None,
            load_mass_kg: NonNegative::try_from(1.0).unwrap(),
        };
        assert!(read(file, 0, &load).unwrap().is_none());
    }
}
