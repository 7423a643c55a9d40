//! A ghost: the nominal vehicle on the drive of a log, with speed, slope and mass as measured, so that what it needs of
//! traction and what its accelerometer shows follow; beside what was measured of both. What was measured of the
//! traction is not known where samples were rejected and where the brake was asked for.
//!
//! A simulation of the force balance that is turned round (inverse dynamics), over the last second: the acceleration is
//! the slope of the regression of the wheel speeds over it, all else its mean.
//!
//! F = (m + m_rot) a + m g (sin θ_eff + f cos θ_eff sgn v) + ½ ρ c_d A v |v|,  f_x = a + g sin θ

use crate::drive::Step;
use crate::identify::LastValues;
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Vehicle;
use monorig_sim::sensors::SensorChannel;
use std::collections::VecDeque;

/// Time over which is averaged, s.
const WINDOW_S: f64 = 1.0;
/// Below this speed friction is not the running resistance, m/s.
const MIN_SPEED_MPS: f64 = 0.05;
/// Least share of the steps of the window in which the traction must be known.
const MIN_KNOWN: f64 = 0.5;

/// A step of the log.
#[derive(Clone, Copy, Debug)]
struct DrivenStep {
    t_s: f64,
    speed: f64,
    torque_nm: f64,
    force_n: f64,
    specific_force_x: Option<f64>,
    slope_rad: f64,
    effective_rad: f64,
    mass_kg: f64,
    braked: bool,
}

/// A recorded channel of a ghost: its value, or the measured one minus it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GhostChannel {
    Traction,
    TractionDifference,
    Torque,
    TorqueDifference,
    SpecificForce,
    SpecificForceDifference,
}

/// Paths and units of what is recorded.
const QUANTITIES: [(&str, &str, GhostChannel); 6] = [
    ("ghost/traction", "N", GhostChannel::Traction),
    (
        "ghost/traction_difference",
        "N",
        GhostChannel::TractionDifference,
    ),
    ("ghost/motor_torque", "N·m", GhostChannel::Torque),
    (
        "ghost/motor_torque_difference",
        "N·m",
        GhostChannel::TorqueDifference,
    ),
    (
        "ghost/specific_force_x",
        "m/s²",
        GhostChannel::SpecificForce,
    ),
    (
        "ghost/specific_force_x_difference",
        "m/s²",
        GhostChannel::SpecificForceDifference,
    ),
];

/// The ghost of a vehicle.
pub(crate) struct Ghost {
    vehicle: Vehicle,
    last: LastValues,
    rows: VecDeque<DrivenStep>,
    segment: u32,
    now: Option<[f64; 6]>,
}

impl Ghost {
    /// Of this vehicle.
    pub fn new(vehicle: Vehicle) -> Self {
        Self {
            vehicle,
            last: LastValues::default(),
            rows: VecDeque::new(),
            segment: 0,
            now: None,
        }
    }

    /// A step of the log, slope and effective slope (rad) and mass (kg) at its end.
    pub fn see(&mut self, step: &Step, slopes_rad: [f64; 2], mass_kg: f64) {
        let (z, segment) = (&step.z, step.segment);
        let t_s = step.t_ns as f64 * 1e-9;
        self.last.see(z, &self.vehicle);
        if segment != self.segment {
            self.rows.clear();
            self.segment = segment;
        }
        let [slope_rad, effective_rad] = slopes_rad;
        self.rows.push_back(DrivenStep {
            t_s,
            speed: self.last.speed(),
            torque_nm: self.last.torque(),
            force_n: self.last.force_n,
            specific_force_x: z.specific_force_mps2.map(|s| s.value[0]),
            slope_rad,
            effective_rad,
            mass_kg,
            braked: step.brake > 0.0,
        });
        // a step more than a second: the window has both its ends
        let too_old = |r: &DrivenStep| t_s - r.t_s > WINDOW_S + 1e-6;
        while self.rows.front().is_some_and(too_old) {
            self.rows.pop_front();
        }
        let whole = self
            .rows
            .front()
            .is_some_and(|r| t_s - r.t_s > 0.9 * WINDOW_S);
        self.now = whole.then(|| self.values());
    }

    fn values(&self) -> [f64; 6] {
        let n = self.rows.len() as f64;
        let mean = |of: fn(&DrivenStep) -> f64| self.rows.iter().map(of).sum::<f64>() / n;
        let (t, speed) = (mean(|r| r.t_s), mean(|r| r.speed));
        let (sxx, sxy) = self.rows.iter().fold((0.0, 0.0), |(a, b), r| {
            let dt = r.t_s - t;
            (a + dt * dt, b + dt * (r.speed - speed))
        });
        let acceleration = sxy / sxx;
        let (mass, effective) = (mean(|r| r.mass_kg), mean(|r| r.effective_rad));
        let v = &self.vehicle;
        // near a standstill the resistance is anything between forwards and backwards
        let against = match speed.abs() > MIN_SPEED_MPS {
            true => speed.signum(),
            false => f64::NAN,
        };
        let resistance = v.running_resistance * effective.cos() * against;
        let air = v.road.map_or(0.0, |r| {
            0.5 * r.air_density_kgpm3 * r.drag_area_m2 * speed * speed.abs()
        });
        let force = (mass + v.rotating_mass_kg) * acceleration
            + mass * G * (effective.sin() + resistance)
            + air;
        let efficiency = match force * speed >= 0.0 {
            true => v.efficiency,
            false => 1.0 / v.efficiency,
        };
        let torque = force * v.wheel_radius_m / (v.gear_ratio * efficiency);
        let torque = torque / self.last.motors() as f64;
        let specific_force = acceleration + G * mean(|r| r.slope_rad.sin());
        let measured = self.rows.iter().filter_map(|r| r.specific_force_x);
        let (count, sum) = measured.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
        let braked = self.rows.iter().any(|r| r.braked);
        // of the steps in which it is known; a gap where these are few
        let of_known = |of: fn(&DrivenStep) -> f64| {
            let known = self.rows.iter().map(of).filter(|x| x.is_finite());
            let (count, sum) = known.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
            match braked || count < MIN_KNOWN * n {
                true => f64::NAN,
                false => sum / count,
            }
        };
        [
            force,
            of_known(|r| r.force_n) - force,
            torque,
            of_known(|r| r.torque_nm) - torque,
            specific_force,
            sum / count - specific_force,
        ]
    }

    fn value(&self, quantity: GhostChannel) -> Option<f64> {
        let value = self.now?.get(quantity as usize).copied();
        value.filter(|x| x.is_finite())
    }
}

/// The recorded channels of a ghost; `with` gives the ghost to a closure.
pub(crate) fn channels<W>(with: W) -> Vec<SensorChannel>
where
    W: Fn(&dyn Fn(&Ghost) -> Option<f64>) -> Option<f64> + Clone + 'static,
{
    let channel = |(path, unit, quantity): (&str, &'static str, GhostChannel)| {
        let with = with.clone();
        SensorChannel {
            path: path.to_owned(),
            unit,
            value: Box::new(move |_| with(&|ghost| ghost.value(quantity))),
        }
    };
    QUANTITIES.map(channel).into()
}
