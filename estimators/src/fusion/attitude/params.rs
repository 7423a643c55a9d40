//! Parameters of the attitude filter: the sensor sheet, noise of the model, gates.

use crate::Real;
use crate::api::params::params;
use crate::api::real::sqrt;
use crate::api::tolerances::TOLERANCES;
use crate::api::vehicle::Vehicle;
use crate::models::attitude::AttitudeNoise;
use crate::tuning::{ATTITUDE, CALIBRATION, TIMES};

params! {
    /// Sensor sheet and model noise of the attitude filter.
    AttitudeParams {
        accel_bias_sd_mps2 ["m/s²"] = none, 0.0 => 1.0, "Standard deviation of the accelerometer's bias; not set: the value of the vehicle's sheet, or 0.00978 (1 mg).";
        velocity_random_walk ["m/s/√s"] = 6.94e-4, 1e-8 => 1.0, "Velocity random walk of the accelerometer: its noise density over √2.";
        accel_bias_walk ["m/s²/√s"] = 1.5e-4, 0.0 => 0.1, "Random walk of the accelerometer's bias (warm-up).";
        mount_sd_deg ["deg"] = TOLERANCES.mount_deg, 0.0 => 10.0, "Standard deviation of the pitch of the IMU against its unit: it adds to the grade's, because no measurement shows it.";
        gyro_bias_sd_radps ["rad/s"] = none, 0.0 => 0.1, "Standard deviation of the gyro's bias; not set: the value of the vehicle's sheet, or 2.4e-6 (0.5 °/h).";
        gyro_bias_walk ["rad/s/√s"] = 0.0, 0.0 => 0.1, "Random walk of the gyro's bias.";
        angle_random_walk ["rad/√s"] = 4.072e-5, 1e-9 => 0.1, "Angle random walk of the gyro.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of one wheel speed.";
        wheel_scale_sd ["-"] = 0.0033, 0.0 => 0.2, "Standard deviation of the scale of one wheel speed.";
        speed_walk ["m/s/√s"] = 0.002, 0.0 => 1.0, "Random walk of the speed that the accelerometer does not measure.";
        roll_walk ["rad/√s"] = 2e-4, 0.0 => 0.1, "Random walk of the roll that the gyro does not measure (play of the guide wheels).";
        lateral_force_sd_mps2 ["m/s²"] = none, 1e-4 => 10.0, "Standard deviation of the lateral force's model (guide wheels, side slip); not set: 0.05 on a rail, 5 on a road, where the gyro gives the roll.";
        turn_coupling_sd_rad ["rad"] = none, 0.0 => 0.2, "Standard deviation of the roll that couples a yaw rate into the pitch rate; not set: 0 on a rail, 0.01 on a road.";
        force_noise_factor ["-"] = 5.0, 1.0 => 1e3, "Factor on the variance of the vertical force's noise: bounce.";
        curvature_sd_per_m ["1/m"] = 0.03, 0.0 => 1.0, "Standard deviation of the vertical curvature, for times without a gyro.";
        curvature_length_m ["m"] = 5.0, 0.1 => 1e4, "Correlation distance of the curvature.";
    }
}

params! {
    /// Switches of the supervisors of the attitude filter.
    AttitudeSupervision {
        accelerometer_gate [flag] = true, "The accelerometer is out of use while |f| differs from g or the instrument is stuck; off: it is always used.";
        slip_gate [flag] = true, "Wheels beyond the gate do not count; off: all wheels count.";
        spike_gate [flag] = true, "Single outliers of the gyro are left out; off: they are used.";
        separation [flag] = true, "The reported deviation of the pitch covers the hypotheses of a wrong gyro, accelerometer or wheels; off: it is the filter's deviation.";
        noise_learning [flag] = true, "The accelerometer's noise is at least the noise in its samples; off: it is the noise of the sheet.";
        vertical_force [flag] = true, "The vertical force is a measurement (bias by |f| = g); off: it is not used.";
        gyro [flag] = true, "The gyro is used; off: grade changes are a random walk.";
    }
}

impl AttitudeParams {
    /// Standard deviation of the lateral force's model, m/s².
    pub fn lateral_sd(&self, vehicle: &Vehicle) -> Real {
        let [rail, road] = ATTITUDE.lateral_sd_mps2;
        let default = if vehicle.road.is_some() { road } else { rail };
        self.lateral_force_sd_mps2.unwrap_or(default)
    }

    /// Variance of the pitch by time and yaw rate squared, s, that the coupling of turns makes.
    pub fn turn_walk(&self, vehicle: &Vehicle) -> Real {
        let default = if vehicle.road.is_some() {
            ATTITUDE.road_coupling_rad
        } else {
            0.0
        };
        let coupling = self.turn_coupling_sd_rad.unwrap_or(default);
        coupling * coupling * TIMES.pause_s
    }

    /// Process noise of the model, for a number of drives.
    pub fn noise(&self, drives: usize) -> AttitudeNoise {
        AttitudeNoise {
            velocity_walk: self.velocity_random_walk,
            speed_walk: self.speed_walk,
            angle_walk: self.angle_random_walk,
            roll_walk: self.roll_walk,
            accel_bias_walk: self.accel_bias_walk,
            gyro_bias_walk: self.gyro_bias_walk,
            curvature_sd_per_m: self.curvature_sd_per_m,
            curvature_length_m: self.curvature_length_m,
            scale_sd: self.wheel_scale_sd / sqrt(drives.max(1) as Real),
        }
    }

    /// Standard deviations of the biases of accelerometer, m/s², and gyro, rad/s, if not set: of the vehicle's sheet,
    /// or of a calibrated instrument.
    pub fn bias_sd(&self, vehicle: &Vehicle) -> [Real; 2] {
        let gyro = self.gyro_bias_sd_radps.or(vehicle.gyro_bias_sd_radps);
        [
            vehicle.accel_bias_sd(self.accel_bias_sd_mps2, CALIBRATION.accel_bias_mps2),
            gyro.unwrap_or(CALIBRATION.gyro_bias_radps),
        ]
    }
}
