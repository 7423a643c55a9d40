//! Steps in the form that the core gives to a method.

use crate::Real;
use crate::api::reading::Reading;
use crate::fusion::attitude::Attitude;
use crate::models::force_balance::ForceBalance;
use crate::models::single_track::Bend;
use crate::preprocess::front_end::motion;
use crate::supervised::pipeline::Step;

/// A step of a core without error: attitude by the `grade_rad` of the rail, traction by the torque of the reading.
pub fn attitude(reading: &Reading, grade_rad: Real) -> Attitude {
    Attitude {
        speed_mps: reading.speed_mps.unwrap_or(0.0),
        pitch_rad: grade_rad,
        imu: reading.specific_force_mps2.is_some(),
        ..Attitude::default()
    }
}

/// A step of a train that is a point.
pub fn step<'a>(
    reading: &'a Reading,
    attitude: &'a Attitude,
    balance: &ForceBalance,
    dt: Real,
) -> Step<'a> {
    let (moving, running) = motion(reading, 0.05);
    let net = |torque| balance.net_traction(torque, attitude.speed_mps);
    Step {
        reading,
        attitude,
        traction_n: reading.motor_torque_nm.filter(|_| running).map(net),
        bias_sd_mps2: 0.0,
        curvature_per_m: 0.0,
        bend: Bend::default(),
        moving,
        running,
        dt,
    }
}
