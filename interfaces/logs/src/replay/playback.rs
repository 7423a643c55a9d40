//! A log being played: the plant and the controller of the loop, and the steps that they and the instrument share.

use crate::drive::{Drive, Reference, Step};
use crate::map::Map;
use monorig_estimators::api::signals::Command;
use monorig_sim::control::{Controller, Perception, Reference as Asked};
use monorig_sim::error::Error;
use monorig_sim::plant::{Plant, Truth};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A log being played: shared by the plant, which gives the time, and the instrument, which delivers the samples.
pub(super) struct Playback {
    pub drive: Drive,
    pub map: Map,
    pub reference: Reference,
    /// The step that is played and the one after it: they are large, and stay where they are.
    pub steps: [Step; 2],
    /// Index of the step that is played; the other one comes next.
    pub now: usize,
    /// True if there is a next one.
    pub more: bool,
    /// The command of the next step; in a log without commands the last measured torques.
    pub command: Command,
}

impl Playback {
    pub fn step(&self) -> &Step {
        &self.steps[self.now & 1]
    }

    fn next(&self) -> Option<&Step> {
        self.more.then(|| &self.steps[1 - (self.now & 1)])
    }
}

pub(super) type Shared = Arc<Mutex<Playback>>;

pub(super) fn lock(shared: &Shared) -> MutexGuard<'_, Playback> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The plant of a replay: time and references.
pub(super) struct RecordedPlant {
    pub shared: Shared,
    pub segment: Arc<AtomicU32>,
    pub truth: Truth,
    pub over: bool,
    /// True for a vehicle that is a point: its effective slope is that at the IMU.
    pub point: bool,
}

impl Plant for RecordedPlant {
    fn is_recorded(&self) -> bool {
        true
    }

    fn step(&mut self, _: &Command, _: f64) -> Result<(), Error> {
        let mut play = lock(&self.shared);
        let play = &mut *play;
        if !play.more {
            return Ok(());
        }
        play.now = 1 - play.now;
        let [a, b] = &mut play.steps;
        let (now, next) = if play.now == 0 { (a, b) } else { (b, a) };
        let (drive, map, reference) = (&mut play.drive, &play.map, &mut play.reference);
        play.more = drive.next_into(map, next)?;
        if !play.more
            && let Some((key, column)) = drive.missing().into_iter().next()
        {
            return Err(map.error(
                key,
                format!("there is no column `{column}` in the log"),
                "`monorig log info` shows the columns",
            ));
        }
        self.over = !play.more;
        self.segment.store(now.segment, Ordering::Relaxed);
        if now.command.is_none() {
            play.command.brake = now.brake;
            let torques = play.command.motor_torque_nm.iter_mut();
            for (torque, sample) in torques.zip(&now.z.motor_torque_nm) {
                *torque = sample.map_or(*torque, |s| s.value);
            }
        }
        let effective = reference.effective_at(now.t_ns);
        let (slope, mass) = reference.at(now.t_ns);
        let t = &mut self.truth;
        t.t_s = now.t_ns as f64 * 1e-9;
        t.total_mass_kg = mass;
        t.grade_at_imu_rad = slope;
        match effective {
            Some(effective) => t.grade_effective_rad = effective,
            None if self.point => t.grade_effective_rad = slope,
            None => {}
        }
        Ok(())
    }

    fn truth(&self) -> &Truth {
        &self.truth
    }

    fn set_load_mass(&mut self, _: f64, _: Option<f64>) {}

    fn set_clamp_limit(&mut self, _: f64) {}

    fn is_over(&self) -> bool {
        self.over
    }
}

/// The controller of a replay: the command that was recorded, else what was measured of the torque.
pub(super) struct RecordedCommand(pub Shared);

impl Controller for RecordedCommand {
    fn control(&mut self, _: &Asked, _: &Perception, _: f64) -> Command {
        let mut play = lock(&self.0);
        if let Some(command) = play.next().and_then(|next| next.command) {
            play.command = command;
        }
        play.command
    }
}
