//! Parameters of the force balance with a swinging load.

use crate::Real;
use crate::api::params::params;
use crate::api::real::sqrt;
use crate::api::tolerances::TOLERANCES;

params! {
    /// Priors and noise of the force balance with a swinging load. Shares are of the nominal weight or running
    /// resistance.
    SwingBalanceParams {
        mass0_kg ["kg"] = none, 1.0 => 1e7, "Total mass at the start; not set: tare and half the rated load.";
        torque_noise ["-"] = 0.01, 0.0 => 1.0, "Standard deviation of a torque sample, as a share of the torque.";
        torque_noise_nm ["N·m"] = 0.2, 0.0 => 1e3, "Constant part of the standard deviation of a torque sample.";
        torque_gain_sd ["-"] = 0.005, 0.0 => 0.2, "Standard deviation of the scale of one torque sensor: no measurement shows it, so it adds to the mass's.";
        efficiency_sd ["-"] = TOLERANCES.efficiency, 0.0 => 0.2, "Standard deviation of the efficiency of the gears, which adds to the mass's.";
        radius_sd ["-"] = TOLERANCES.wheel_radius, 0.0 => 0.2, "Standard deviation of the wheels' radius (wear), which adds to the mass's.";
        resistance_sd ["-"] = 2.0 * TOLERANCES.running_resistance, 0.0 => 2.0, "Standard deviation of the constant part of running resistance, as a share of all resistance: twice the tolerance of the nominal value, because of other influences.";
        speed_resistance ["s/m"] = 0.03, 0.0 => 1.0, "Part of running resistance that grows with speed, as a share of all per m/s.";
        speed_resistance_sd ["s/m"] = 0.04, 0.0 => 1.0, "Standard deviation of the part of running resistance that grows with speed.";
        bend_resistance_sd ["N·m"] = 15e3, 0.0 => 1e6, "Standard deviation of the resistance in bends: force times radius.";
        swing_sd ["rad"] = 0.02, 0.0 => 1.0, "Standard deviation of the swing angle at the start.";
        swing_rate_sd ["rad/s"] = 0.08, 0.0 => 2.0, "Standard deviation of the swing rate at the start.";
        swing_walk ["rad/s/√s"] = 0.003, 0.0 => 1.0, "Random walk of the swing rate.";
        swing_damping ["-"] = 0.04, 0.0 => 1.0, "Uncertainty of the swing, as a share of its amplitude per √s.";
        length_sd ["-"] = TOLERANCES.chain, 0.0 => 1.0, "Standard deviation of the pendulum's length (natural logarithm).";
        length_walk ["1/√s"] = 0.0, 0.0 => 0.1, "Random walk of the pendulum's length: hoisting.";
        force_sd_mps2 ["m/s²"] = 0.006, 0.0 => 1.0, "Standard deviation of unmodelled force per mass, with a memory of 2 s.";
        place_sd_m ["m"] = 0.06, 0.0 => 1.0, "Error of the places of the masses, which turns a change of grade into unmodelled force.";
        bend_force_sd ["m²/s²"] = 0.15, 0.0 => 10.0, "Addition by bends to the standard deviation of unmodelled force per mass, times curvature.";
        model_sd_mps2 ["m/s²"] = 0.0016, 0.0 => 1.0, "Standard deviation of the balance of one block per mass: rail, acceleration.";
        swing_model_sd ["-"] = 0.015, 0.0 => 1.0, "Standard deviation of the balance of one block, as a share of the load times the accelerations.";
        eta_sd_rad ["rad"] = 0.02, 0.0 => 1.0, "Standard deviation of the grade 9 m behind the rail read.";
    }
}

params! {
    /// Switches of the supervisors of the force balance.
    SwingSupervision {
        swing [flag] = true, "The load swings; off: it is rigid.";
        depth [flag] = true, "Masses hang below the rail; off: they are on it.";
        wait_for_rail [flag] = true, "Blocks wait until the rail under the front of the train is read; off: they are used at once.";
        torque_monitor [flag] = true, "Torques are compared with the command; off: no comparison.";
        force_fusion [flag] = true, "The effective grade uses the force balance for unread rail; off: it does not.";
    }
}

impl SwingBalanceParams {
    /// Standard deviation of the scale of the force of `drives` units, which cannot be separated from the mass.
    pub fn gain_sd(&self, drives: usize) -> Real {
        let torque = self.torque_gain_sd * self.torque_gain_sd / drives.max(1) as Real;
        sqrt(torque + self.efficiency_sd * self.efficiency_sd + self.radius_sd * self.radius_sd)
    }
}
