//! Running and guide wheels of one station: what holds a rail-bound body to the rail.

use super::body_state::{BodyState, Wrench};
use super::implicit::yielding;
use crate::rail::RailFrame;
use crate::train::Station;
use nalgebra::Vector3;

/// Loads of one station, at its expected place and motion.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    /// Loads of left wheel (running side, less hold-down side), right wheel and guide, N.
    pub loads: [f64; 3],
    /// Loss of them for each m/s of more rate, N·s/m.
    yields: [f64; 3],
    /// Power lost in the dampers, W.
    pub loss: f64,
    /// Deviation from the rail's line, m: left, up.
    pub off: [f64; 2],
    /// Speed along the rail, m/s.
    pub v_t: f64,
    /// Place of the station, m, and the axes of the rail there.
    at: Vector3<f64>,
    axes: [Vector3<f64>; 3],
}

/// Load of a wheel pressed in by `depth` at `rate`: positive on the running side, negative on the hold-down side, which
/// has `play`. Neither side can pull. Also the power its damper loses, and the share of the step in which a side
/// touches. Means over a step of `dt` (s) at this rate, with `depth` in its middle.
fn wheel(st: &Station, depth: f64, rate: f64, dt: f64) -> [f64; 3] {
    let side = |x: f64, v: f64| -> [f64; 3] {
        let (press, damping) = (st.wheel_k * x, st.wheel_c * v);
        let (sweep, parted) = (0.5 * dt * st.wheel_k * v.abs(), (-damping).max(0.0));
        if press + sweep <= parted {
            return [0.0, -press.max(0.0) * v, 0.0];
        }
        let (mean, share) = if press - sweep >= parted {
            (press, 1.0)
        } else {
            let touching = press + sweep - parted;
            (parted + 0.5 * touching, 0.5 * touching / sweep)
        };
        [share * (mean + damping), share * damping * v, share]
    };
    let [n, a, on] = side(depth, rate);
    let [h, b, held] = side(-depth - st.holddown_play_m, -rate);
    [n - h, a + b, on + held]
}

/// Rates of left wheel, right wheel and guide, m/s, or their places, m: of a station that moves to the left, up and
/// rolls (+ lifts the left side). Guide wheels touch the rail at height z: rolling by φ moves that point by −z φ to the
/// left.
fn at_wheels(st: &Station, left: f64, up: f64, roll: f64) -> [f64; 3] {
    let arm = st.half_gauge_m * roll;
    [up + arm, up - arm, left - st.guide_z_m * roll]
}

/// Evaluate a station at its place `at` on `body`, over the rail at `f`, for a step of `dt` (s).
pub fn grip(st: &Station, body: &BodyState, at: &Vector3<f64>, f: &RailFrame, dt: f64) -> Grip {
    let (d, v) = (at - f.p, body.velocity(at));
    let off = [d.dot(&f.l), d.dot(&f.u)];
    let [left, right, y] = at_wheels(st, off[0], off[1], body.r.column(1).dot(&f.u));
    let rates = at_wheels(st, v.dot(&f.l), v.dot(&f.u), body.w.dot(&f.t));

    let [n_left, loss_left, on_left] = wheel(st, -left, -rates[0], dt);
    let [n_right, loss_right, on_right] = wheel(st, -right, -rates[1], dt);
    let wheel_yields = yielding(st.wheel_k, st.wheel_c, dt);
    Grip {
        loads: [n_left, n_right, -st.guide_k * y - st.guide_c * rates[2]],
        yields: [
            on_left * wheel_yields,
            on_right * wheel_yields,
            yielding(st.guide_k, st.guide_c, dt),
        ],
        loss: loss_left + loss_right + st.guide_c * rates[2] * rates[2],
        off,
        v_t: v.dot(&f.t),
        at: *at,
        axes: [f.t, f.l, f.u],
    }
}

impl Grip {
    /// Adds loads of left wheel, right wheel and guide, and a force along the rail (N) to what acts on the body.
    /// Returns the force, N.
    pub fn press(
        &self,
        st: &Station,
        body: &BodyState,
        along: f64,
        [left, right, guide]: [f64; 3],
        out: &mut Wrench,
    ) -> Vector3<f64> {
        let [t, l, u] = &self.axes;
        let force = u * (left + right) + l * guide + t * along;
        out.add(body, &force, &self.at);
        out.torque += t * (st.half_gauge_m * (left - right) - st.guide_z_m * guide);
        force
    }

    /// Returns what the loads gain, N, as the body's velocities change by `more` than expected.
    pub fn gained(&self, st: &Station, body: &BodyState, more: &[Vector3<f64>; 2]) -> [f64; 3] {
        let ([t, l, u], v) = (&self.axes, body.change(more, &self.at));
        let rates = at_wheels(st, v.dot(l), v.dot(u), more[1].dot(t));
        [0, 1, 2].map(|k| -self.yields[k] * rates[k])
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
