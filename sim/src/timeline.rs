//! The events of a scenario, made to happen at their time.

use crate::control::SpeedController;
use crate::plant::Plant;
use crate::scenario::Event;

/// The events of a scenario that act on train and controller. Adhesion zones act on the rail and sensor faults in the
/// sensors, so they are handed over when the rig is built; here they are only told.
pub struct Timeline {
    events: Vec<(f64, Event)>,
    next: usize,
    brake: f64,
    happened: Vec<String>,
}

impl Timeline {
    /// In order of time.
    pub fn new(events: &[Event]) -> Self {
        let mut list: Vec<(f64, Event)> = Vec::new();
        for e in events {
            match e {
                Event::LoadMass { at_s, .. }
                | Event::ClampPressure { at_s, .. }
                | Event::Brake { at_s, .. } => {
                    list.push((at_s.get(), e.clone()));
                }
                Event::SensorFault { from_s, .. } => list.push((from_s.get(), e.clone())),
                Event::Adhesion { .. } => {}
            }
        }
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            events: list,
            next: 0,
            brake: 0.0,
            happened: Vec::new(),
        }
    }

    /// Make happen what is due at `t`.
    pub fn apply(&mut self, t: f64, plant: &mut dyn Plant, controller: &mut SpeedController) {
        self.happened.clear();
        while let Some((_, e)) = self.events.get(self.next).filter(|(at, _)| *at <= t) {
            match e {
                Event::LoadMass { load_mass_kg, .. } => {
                    plant.set_load_mass(load_mass_kg.get());
                    self.happened
                        .push(format!("load is now {} kg", load_mass_kg.get()));
                }
                Event::ClampPressure { clamp_mpa, .. } => {
                    plant.set_clamp_limit(clamp_mpa.get());
                    controller.set_clamp(clamp_mpa.get());
                    self.happened
                        .push(format!("clamp pressure {} MPa", clamp_mpa.get()));
                }
                Event::Brake { brake, .. } => {
                    self.brake = brake.get();
                    self.happened.push(match brake.get() {
                        0.0 => "emergency brake released".to_string(),
                        b => format!("emergency brake at {:.0} %", b * 100.0),
                    });
                }
                Event::SensorFault { sensor, fault, .. } => {
                    self.happened
                        .push(format!("fault on {sensor}: {fault:?}").to_lowercase());
                }
                Event::Adhesion { .. } => {}
            }
            self.next += 1;
        }
    }

    /// Share of the brake asked for by hand.
    pub fn emergency_brake(&self) -> f64 {
        self.brake
    }

    /// What happened in the last call of [`Timeline::apply`].
    pub fn happened(&self) -> &[String] {
        &self.happened
    }
}
