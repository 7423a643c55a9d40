//! Windows of a log for the force balance: all quantities of a window are means with the same weights.
//!
//! The acceleration of a window is the slope of the regression of the speed over its time, Σ c v with c = (t − t̄)/Σ(t
//! − t̄)². By summation by parts it is also the mean of dv/dt with weights that fall from the middle to zero at both
//! ends. Forces and slopes are averaged with these weights, so that a force that changes within the window goes with
//! the acceleration that it causes, wherever the window begins. Windows overlap.

use super::tracks::Tracks;
use crate::drive::{Reference, Step};
use crate::notation::STANDARD_GRAVITY_MPS2 as G;
use monorig_estimators::api::signals::Vehicle;

/// Least length of a window, s.
pub(crate) const WINDOW_S: f64 = 0.5;
/// A window is so many intervals of the slowest channel long, or longer; one that would be longer than this, s, shows
/// no change of the speed, and such a channel is not followed.
const INTERVALS: f64 = 8.0;
const MAX_WINDOW_S: f64 = 10.0;
/// Windows begin so often in the least length of one.
pub(crate) const OVERLAP: usize = 4;
/// Fewest steps of a window.
const MIN_STEPS: usize = 8;
/// Below this speed friction is not the running resistance, m/s.
const MIN_SPEED_MPS: f64 = 0.2;
/// Below this the vehicle stands, m/s.
const STANDING_MPS: f64 = 0.02;
/// A stretch is worked off after this time, so that memory does not grow with the log, ns.
const STRETCH_NS: i64 = 600_000_000_000;

/// Weighted means of a window; not a number where something of it is not known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceWindow {
    /// Its middle, s of the replay.
    pub t_s: f64,
    /// Acceleration by the regression of the speed, m/s²; not a number where that is not known.
    pub acceleration: f64,
    /// Speed, m/s; its sign, and its square with the sign.
    pub speed: f64,
    pub sign: f64,
    pub speed_squared: f64,
    /// Force of the motors at the rims as the nominal vehicle has it, N; not a number where the brake was asked for.
    pub force_n: f64,
    pub specific_force: [f64; 3],
    pub rate: [f64; 3],
    /// sin of the slope, and sin and cos × sgn v of the effective one.
    pub sin: f64,
    pub sin_effective: f64,
    pub against: f64,
    /// Change of the slope, rad/s.
    pub slope_rate: f64,
    pub mass_kg: f64,
    /// True where the vehicle moves one way all the time, and true where it stands.
    pub moves: bool,
    pub stands: bool,
}

/// One step of a stretch.
#[derive(Clone, Copy, Debug)]
struct Point {
    t_s: f64,
    speed: f64,
    /// Values that are averaged, in the order of [`ForceWindow`].
    values: [f64; 13],
    slope: f64,
}

/// Makes windows of the steps of a log.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    tracks: Tracks,
    references: Vec<[f64; 3]>,
    segment: u32,
    /// The windows so far, and the length of the longest, s.
    pub windows: Vec<ForceWindow>,
    pub longest_s: f64,
}

impl Windows {
    /// Takes a step; slope and effective slope (rad) and mass (kg) at its end, not numbers where they are not known.
    /// The tracks of a stretch that is over are handed to `over`.
    pub fn see(
        &mut self,
        step: &Step,
        reference: [f64; 3],
        vehicle: &Vehicle,
        over: &mut dyn FnMut(&mut Tracks),
    ) {
        let first = self.tracks.times_ns.first();
        let long = first.is_some_and(|t| step.t_ns - t > STRETCH_NS);
        if step.segment != self.segment || long {
            self.finish(vehicle, over);
            self.segment = step.segment;
        }
        self.tracks.see(step);
        self.references.push(reference);
    }

    /// The log, or a stretch of it, is over.
    pub fn finish(&mut self, vehicle: &Vehicle, over: &mut dyn FnMut(&mut Tracks)) {
        let mut tracks = std::mem::take(&mut self.tracks);
        let references = std::mem::take(&mut self.references);
        tracks.settle();
        let points = points(&mut tracks.clone(), &references, vehicle);
        let length_s = match INTERVALS * tracks.slowest_s() {
            s if s > MAX_WINDOW_S => WINDOW_S,
            s => s.max(WINDOW_S),
        };
        over(&mut tracks);
        let step_s = match points.as_slice() {
            [a, .., b] => (b.t_s - a.t_s) / (points.len() - 1) as f64,
            _ => return,
        };
        let steps = |s: f64| ((s / step_s).round() as usize).max(MIN_STEPS);
        let hop = (steps(WINDOW_S) / OVERLAP).max(1);
        self.longest_s = self.longest_s.max(length_s);
        let windows = points.windows(steps(length_s) + 1).step_by(hop);
        self.windows.extend(windows.filter_map(window));
    }
}

/// Reads the tracks at the ends of the steps.
fn points(tracks: &mut Tracks, references: &[[f64; 3]], vehicle: &Vehicle) -> Vec<Point> {
    let times = std::mem::take(&mut tracks.times_ns);
    let braked = std::mem::take(&mut tracks.braked);
    let steps = times.into_iter().zip(braked).zip(references);
    steps
        .map(|((t, braked), [slope, effective, mass])| {
            let speed = tracks.speed_at(t);
            let force = match braked {
                true => f64::NAN,
                false => tracks.force_at(t, speed, vehicle),
            };
            let [fx, fy, fz] = tracks.force.each_mut().map(|track| track.at(t));
            let [wx, wy, wz] = tracks.rate.each_mut().map(|track| track.at(t));
            let values = [
                speed,
                speed * speed.abs(),
                force,
                fx,
                fy,
                fz,
                wx,
                wy,
                wz,
                slope.sin(),
                effective.sin(),
                effective.cos() * speed.signum(),
                *mass,
            ];
            Point {
                t_s: t as f64 * 1e-9,
                speed,
                values,
                slope: *slope,
            }
        })
        .collect()
}

/// The means of a window; none of one that begins and ends at once.
fn window(points: &[Point]) -> Option<ForceWindow> {
    let n = points.len() as f64;
    let middle = points.iter().map(|p| p.t_s).sum::<f64>() / n;
    let squares: f64 = points.iter().map(|p| (p.t_s - middle).powi(2)).sum();
    let c = |p: &Point| (p.t_s - middle) / squares;
    let slope_of = |of: fn(&Point) -> f64| points.iter().map(|p| c(p) * of(p)).sum::<f64>();
    let acceleration = slope_of(|p| p.speed);
    let is_known = acceleration.is_finite();
    if squares == 0.0 {
        return None;
    }
    // the weight of an interval: the sum of c behind it, times its length
    let (mut behind, mut means) = (0.0, [0.0; 13]);
    for pair in points.windows(2).rev() {
        let [a, b] = pair else { continue };
        behind += c(b);
        let weight = 0.5 * behind * (b.t_s - a.t_s);
        for ((mean, x), y) in means.iter_mut().zip(a.values).zip(b.values) {
            *mean += weight * (x + y);
        }
    }
    let [
        speed,
        speed_squared,
        force_n,
        fx,
        fy,
        fz,
        wx,
        wy,
        wz,
        sin,
        sin_effective,
        against,
        mass_kg,
    ] = means;
    let speeds = || points.iter().map(|p| p.speed);
    let least = speeds().fold(f64::INFINITY, f64::min);
    let most = speeds().fold(f64::NEG_INFINITY, f64::max);
    Some(ForceWindow {
        t_s: middle,
        acceleration,
        speed,
        sign: speed.signum(),
        speed_squared,
        force_n,
        specific_force: [fx, fy, fz],
        rate: [wx, wy, wz],
        sin,
        sin_effective,
        against,
        slope_rate: slope_of(|p| p.slope),
        mass_kg,
        moves: is_known && (least > MIN_SPEED_MPS || most < -MIN_SPEED_MPS),
        stands: is_known && most.max(-least) < STANDING_MPS,
    })
}

/// Air drag of a window over the drag area, N/m²: half the density times v |v|; 0 of a vehicle without drag.
pub(crate) fn drag_pressure(w: &ForceWindow, vehicle: &Vehicle) -> f64 {
    let density = vehicle.road.map_or(0.0, |r| r.air_density_kgpm3);
    0.5 * density * w.speed_squared
}

/// Reads slope, effective slope and mass of the references at a time, which must not fall.
pub(crate) fn known(reference: &mut Reference, t_ns: i64) -> [f64; 3] {
    let (slope, mass) = reference.at(t_ns);
    let effective = reference.effective_at(t_ns).unwrap_or(slope);
    [slope, effective, mass]
}

/// Specific force forward of a window by speed and slope, m/s².
pub(super) fn expected_force(w: &ForceWindow) -> f64 {
    w.acceleration + G * w.sin
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force that follows the acceleration within the window goes with it exactly, whatever the shape: of v = t³ the
    /// mean acceleration is the mean of 3t² with the same weights, up to the trapezoid's h²/2.
    #[test]
    fn the_force_is_weighted_as_the_acceleration() {
        let point = |i: i32| {
            let t_s = 2.0 + f64::from(i) * 0.01;
            let mut values = [0.0; 13];
            (values[0], values[2]) = (t_s.powi(3), 3.0 * t_s * t_s);
            Point {
                t_s,
                speed: t_s.powi(3),
                values,
                slope: 0.1 * t_s,
            }
        };
        let points: Vec<Point> = (0..=100).map(point).collect();
        let w = window(&points).unwrap();
        assert!((w.acceleration - w.force_n).abs() < 1e-4, "{w:?}");
        assert!((w.slope_rate - 0.1).abs() < 1e-12 && w.moves && !w.stands);
    }
}
