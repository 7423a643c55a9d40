//! Event schedule: applies the events of a scenario when they are due.

use crate::config::scenario::Event;
use crate::control::Reference;
use crate::plant::Plant;
use monorig_estimators::api::signals::Command;
use std::collections::VecDeque;

/// The estimators' computer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Computer {
    /// The estimators' computer runs.
    Up,
    /// The computer of the estimators restarts: no estimator runs.
    Down,
    /// The computer of the estimators has just restarted: every estimator starts again.
    UpAgain,
}

/// An event and its time.
#[derive(Clone, Debug)]
struct Entry {
    at_s: f64,
    every_s: Option<f64>,
    event: Event,
}

/// Schedule of the events of a scenario that act on train, controller and estimators. Adhesion zones act on the rail
/// and sensor faults in the sensors, so they are handed over when the simulation is built; here they are only logged.
pub struct EventSchedule {
    /// Events to come, in order of time.
    events: VecDeque<Entry>,
    emergency_brake: f64,
    clamp_pressure_mpa: f64,
    /// Share of the brake force with which a brake drags.
    dragging_brake: f64,
    /// Index of the drive unit that gives no torque.
    isolated_drive: Option<usize>,
    /// Time at which the computer of the estimators runs again, s; `None` while it runs.
    up_again_s: Option<f64>,
    happened: Vec<String>,
}

impl EventSchedule {
    /// Makes the schedule from the events of a scenario; the commanded clamp pressure is `clamp_pressure_mpa` (MPa)
    /// until an event changes it.
    pub fn new(events: &[Event], clamp_pressure_mpa: f64) -> Self {
        let mut list: Vec<Entry> = events
            .iter()
            .filter_map(|e| {
                let (at_s, every_s) = match e {
                    Event::LoadMass { at_s, every_s, .. }
                    | Event::ClampPressure { at_s, every_s, .. }
                    | Event::Brake { at_s, every_s, .. }
                    | Event::DraggingBrake { at_s, every_s, .. }
                    | Event::IsolatedDrive { at_s, every_s, .. }
                    | Event::Restart { at_s, every_s, .. } => (at_s, *every_s),
                    Event::SensorFault { from_s, .. } => (from_s, None),
                    Event::Adhesion { .. } => return None,
                };
                Some(Entry {
                    at_s: at_s.get(),
                    every_s: every_s.map(f64::from),
                    event: e.clone(),
                })
            })
            .collect();
        list.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        Self {
            events: list.into(),
            emergency_brake: 0.0,
            clamp_pressure_mpa,
            dragging_brake: 0.0,
            isolated_drive: None,
            up_again_s: None,
            happened: Vec::new(),
        }
    }

    /// Apply the events that are due at `t` (s): loads and clamp limits to the plant, emergency brake and clamp
    /// pressure to the reference.
    pub fn apply(&mut self, t: f64, plant: &mut dyn Plant, reference: &mut Reference) {
        self.happened.clear();
        while let Some(now) = self.events.pop_front_if(|e| e.at_s <= t) {
            match &now.event {
                Event::LoadMass {
                    load_mass_kg,
                    load_speed_mps,
                    ..
                } => {
                    let heavier = load_mass_kg.get() > plant.truth().load_mass_kg;
                    let speed = load_speed_mps.map(f64::from);
                    plant.set_load_mass(load_mass_kg.get(), speed);
                    let how = match speed.filter(|_| heavier) {
                        Some(speed) => format!("hung on at {speed} m/s"),
                        None if heavier => "hung on at the load's speed".into(),
                        None => "set down at the load's speed".into(),
                    };
                    self.happened
                        .push(format!("load is now {} kg, {how}", load_mass_kg.get()));
                }
                Event::ClampPressure { clamp_mpa, .. } => {
                    plant.set_clamp_limit(clamp_mpa.get());
                    self.clamp_pressure_mpa = clamp_mpa.get();
                    self.happened
                        .push(format!("clamp pressure {} MPa", clamp_mpa.get()));
                }
                Event::Brake { brake, .. } => {
                    self.emergency_brake = brake.get();
                    self.happened.push(match brake.get() {
                        0.0 => "emergency brake released".to_string(),
                        b => format!("emergency brake at {:.0} %", b * 100.0),
                    });
                }
                Event::DraggingBrake { dragging_brake, .. } => {
                    self.dragging_brake = dragging_brake.get();
                    let share = self.dragging_brake * 100.0;
                    self.happened.push(format!("a brake drags at {share} %"));
                }
                Event::IsolatedDrive { isolated_drive, .. } => {
                    self.isolated_drive = Some(*isolated_drive as usize);
                    self.happened
                        .push(format!("drive {isolated_drive} is isolated"));
                }
                Event::Restart { restart_s, .. } => {
                    self.up_again_s = Some(t + restart_s.get());
                    let s = restart_s.get();
                    self.happened
                        .push(format!("the estimators' computer restarts, {s} s"));
                }
                Event::SensorFault { sensor, fault, .. } => {
                    self.happened
                        .push(format!("fault on {sensor}: {fault:?}").to_lowercase());
                }
                Event::Adhesion { .. } => {}
            }
            if let Some(every_s) = now.every_s {
                let again = Entry {
                    at_s: now.at_s + every_s,
                    ..now
                };
                let place = self.events.partition_point(|e| e.at_s <= again.at_s);
                self.events.insert(place, again);
            }
        }
        reference.emergency_brake = self.emergency_brake;
        reference.clamp_pressure_mpa = self.clamp_pressure_mpa;
    }

    /// The command as a machine with `drives` units carries it out: a brake may drag, a drive be isolated.
    pub(crate) fn carried_out(&self, command: &Command, drives: usize) -> Command {
        let mut done = *command;
        done.brake = done.brake.max(self.dragging_brake);
        if let Some(isolated) = self.isolated_drive {
            let torques = done.motor_torque_nm.iter_mut().take(drives).enumerate();
            let others = drives as f64 / drives.saturating_sub(1).max(1) as f64;
            torques.for_each(|(i, torque)| *torque *= if i == isolated { 0.0 } else { others });
        }
        done
    }

    /// State of the estimators' computer at `t` (s); it is reported as restarted once.
    pub(crate) fn computer(&mut self, t: f64) -> Computer {
        match self.up_again_s {
            None => Computer::Up,
            Some(up_again_s) if t < up_again_s => Computer::Down,
            Some(_) => {
                self.up_again_s = None;
                Computer::UpAgain
            }
        }
    }

    /// Events applied by the last call of [`EventSchedule::apply`].
    pub fn happened(&self) -> &[String] {
        &self.happened
    }
}
