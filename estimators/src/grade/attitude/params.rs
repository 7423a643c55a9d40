//! Parameters of the attitude filter: the sensor sheet, noise of the model, gates.

use crate::api::params::params;

params! {
    /// Sensor sheet and model noise of the attitude filter.
    AttitudeParams {
        accel_bias_sd_mps2 ["m/s²"] = 0.00978, 0.0 => 1.0, "Standard deviation of the accelerometer's bias, by its sheet.";
        velocity_random_walk ["m/s/√s"] = 6.94e-4, 1e-8 => 1.0, "Velocity random walk of the accelerometer: its noise density over √2.";
        accel_bias_walk ["m/s²/√s"] = 1.5e-4, 0.0 => 0.1, "Random walk of the accelerometer's bias (warm-up).";
        mount_sd_deg ["deg"] = 0.0, 0.0 => 10.0, "Standard deviation of the pitch of the IMU against its unit: it goes into the grade, nothing can see it.";
        gyro_bias_sd_radps ["rad/s"] = 2.424e-6, 0.0 => 0.1, "Standard deviation of the gyro's bias, by its sheet.";
        gyro_bias_walk ["rad/s/√s"] = 0.0, 0.0 => 0.1, "Random walk of the gyro's bias.";
        angle_random_walk ["rad/√s"] = 4.072e-5, 1e-9 => 0.1, "Angle random walk of the gyro.";
        wheel_speed_sd_mps ["m/s"] = 0.005, 1e-6 => 10.0, "Standard deviation of one wheel speed.";
        wheel_scale_sd ["-"] = 0.0033, 0.0 => 0.2, "Standard deviation of the scale of one wheel speed.";
        speed_walk ["m/s/√s"] = 0.002, 0.0 => 1.0, "Random walk of the speed that the accelerometer does not measure.";
        roll_walk ["rad/√s"] = 2e-4, 0.0 => 0.1, "Random walk of the roll that the gyro does not measure (play of the guide wheels).";
        lateral_force_sd_mps2 ["m/s²"] = 0.05, 1e-4 => 10.0, "Standard deviation of the lateral force's model (side slip, guide wheels).";
        force_noise_factor ["-"] = 5.0, 1.0 => 1e3, "Factor on the variance of the vertical force's noise: bounce.";
        curvature_sd_per_m ["1/m"] = 0.03, 0.0 => 1.0, "Standard deviation of the vertical curvature, for times without a gyro.";
        curvature_length_m ["m"] = 5.0, 0.1 => 1e4, "Way over which the curvature becomes another.";
        wheel_gate ["-"] = 5.0, 1.0 => 100.0, "Standard deviations beyond which a wheel is taken to slip.";
    }
}

params! {
    /// Which supervisors of the attitude filter are on.
    AttitudeSupervision {
        slip_gate [flag] = true, "Wheels beyond the gate do not count; off: all do.";
        accelerometer_gate [flag] = true, "The accelerometer is out of use while |f| is not g or it is stuck; off: it is always used.";
        spike_gate [flag] = true, "Single outliers of the gyro are left out; off: they are not.";
        gyro_monitor [flag] = true, "The pitch is doubted while wheels that agree contradict it; off: it is not.";
        vertical_force [flag] = true, "The vertical force is a measurement (bias by |f| = g); off: it is not used.";
        gyro [flag] = true, "The gyro is used; off: grade changes are a random walk.";
    }
}
