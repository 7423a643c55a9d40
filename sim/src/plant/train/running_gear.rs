//! Running and guide wheels of one station: what holds a rail-bound body to the rail.

use super::body_state::BodyState;
use crate::rail::RailFrame;
use crate::train::Station;
use nalgebra::Vector3;

/// Force and torque of one station on its body.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    /// Force at the station, N, in the world: wheels and guides, without resistance.
    pub force: Vector3<f64>,
    /// Torque about the rail's tangent from the left-right difference of the wheel loads and the height of the guides,
    /// N·m.
    pub roll: f64,
    /// Sum of the wheel loads (running and hold-down side), N, none negative.
    pub wheel_load: f64,
    /// Guide force, N, not negative.
    pub guide_load: f64,
    /// Power lost in the dampers, W.
    pub loss: f64,
    /// Deviation from the rail's line, m: left, up.
    pub off: [f64; 2],
    /// Speed along the rail, m/s.
    pub v_t: f64,
}

/// Load of a wheel pressed in by `depth` at `rate`: positive on the running side, negative on the hold-down side, which
/// has `play`. Neither side can pull. Also the power its damper loses.
fn wheel(st: &Station, depth: f64, rate: f64) -> (f64, f64) {
    let side = |x: f64, v: f64| -> (f64, f64) {
        if x <= 0.0 {
            return (0.0, 0.0);
        }
        let load = st.wheel_k * x + st.wheel_c * v;
        if load > 0.0 {
            (load, st.wheel_c * v * v)
        } else {
            (0.0, -st.wheel_k * x * v)
        }
    };
    let (n, a) = side(depth, rate);
    let (h, b) = side(-depth - st.holddown_play_m, -rate);
    (n - h, a + b)
}

/// Evaluate a station at its place `at` on `body`, over the rail at `f`.
pub fn grip(st: &Station, body: &BodyState, at: &Vector3<f64>, f: &RailFrame) -> Grip {
    let d = at - f.p;
    let v = body.velocity(at);
    let (left, up) = (d.dot(&f.l), d.dot(&f.u));
    let (v_left, v_up, v_t) = (v.dot(&f.l), v.dot(&f.u), v.dot(&f.t));
    // Roll of the body against the rail: + lifts the left side.
    let roll = body.r.column(1).dot(&f.u);
    let roll_rate = body.w.dot(&f.t);

    let arm = st.half_gauge_m;
    let (n_left, loss_left) = wheel(st, -(up + arm * roll), -(v_up + arm * roll_rate));
    let (n_right, loss_right) = wheel(st, -(up - arm * roll), -(v_up - arm * roll_rate));

    // Guide wheels touch the rail at height z: rolling by φ moves that point by −z φ to the left.
    let y = left - st.guide_z_m * roll;
    let v_y = v_left - st.guide_z_m * roll_rate;
    let guide = -st.guide_k * y - st.guide_c * v_y;

    Grip {
        force: f.u * (n_left + n_right) + f.l * guide,
        roll: arm * (n_left - n_right) - st.guide_z_m * guide,
        wheel_load: n_left.abs() + n_right.abs(),
        guide_load: guide.abs(),
        loss: loss_left + loss_right + st.guide_c * v_y * v_y,
        off: [left, up],
        v_t,
    }
}

/// Energy stored in the springs of a station, J.
pub fn stored(st: &Station, body: &BodyState, at: &Vector3<f64>, f: &RailFrame) -> f64 {
    let d = at - f.p;
    let (left, up) = (d.dot(&f.l), d.dot(&f.u));
    let roll = body.r.column(1).dot(&f.u);
    let one = |depth: f64| {
        let x = depth.max(0.0);
        let h = (-depth - st.holddown_play_m).max(0.0);
        0.5 * st.wheel_k * (x * x + h * h)
    };
    let y = left - st.guide_z_m * roll;
    one(-(up + st.half_gauge_m * roll))
        + one(-(up - st.half_gauge_m * roll))
        + 0.5 * st.guide_k * y * y
}
