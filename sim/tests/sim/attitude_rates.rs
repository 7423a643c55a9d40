//! The angular velocity of a plant is the motion of its orientation: what a gyro integrates is the attitude.

use monorig_sim::plant::{Plant, point_mass::PointMass};
use monorig_sim::testing::{Cruise, asset_track, options, train};

const DT: f64 = 1e-3;

/// Over crests, sags and bends at once: the integral of the rate over a step is the turn of the step.
#[test]
fn the_rate_of_the_point_mass_is_the_turn_of_its_frame() {
    let train = train("dx80_176y");
    let o = options(&train, 40.0, 1.5);
    let mut plant = PointMass::new(train.clone(), asset_track("winding"), &o);
    let (mut off, mut turned): (f64, f64) = (0.0, 0.0);
    let mut last = plant.truth().mounts[o.imu];
    let mut cruise = Cruise::new(&train, 1.5);
    for _ in 0..120_000 {
        let command = cruise.command_at(&train, plant.truth().speed_mps, DT);
        plant.step(&command, DT).unwrap();
        let now = plant.truth().mounts[o.imu];
        let turn = (now.q_wm * last.q_wm.inverse()).scaled_axis();
        let rate = 0.5 * (now.w_w + last.w_w) * DT;
        off += (turn - rate).norm();
        turned += turn.norm();
        last = now;
        if plant.truth().chainage_m > 200.0 {
            break;
        }
    }
    // A step over the edge of an element has half of the change of the curvature.
    assert!(turned > 1.0, "{turned} rad");
    assert!(off < 1e-3 * turned, "{off} rad of {turned}");
}
