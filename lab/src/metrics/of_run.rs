//! Metrics of train and controller: work of the wheels and jerk.

use crate::metrics::series::Tracking;
use crate::metrics::statistics::{Accumulator, Mean, Running};

/// Acceleration and jerk are taken over steps of this length: shorter ones show the springs of the wheels, s.
const COMFORT_STEP_S: f64 = 0.1;

/// Work of the wheels while they drive, J.
pub(super) fn energy() -> Running<Tracking> {
    Box::new(Energy::default())
}

/// [`energy`] over the distance covered, J/m.
pub(super) fn energy_per_metre() -> Running<Tracking> {
    Box::new(EnergyPerMetre::default())
}

/// Integral over time by trapezoids; not a number before the second sample.
#[derive(Default)]
struct Integral {
    last: Option<(f64, f64)>,
    so_far: Option<f64>,
}

impl Integral {
    fn add(&mut self, t_s: f64, y: f64) {
        if let Some((last_s, last)) = self.last {
            *self.so_far.get_or_insert(0.0) += 0.5 * (last + y) * (t_s - last_s);
        }
        self.last = Some((t_s, y));
    }

    fn value(&self) -> f64 {
        self.so_far.unwrap_or(f64::NAN)
    }
}

#[derive(Default)]
struct Energy(Integral);

impl Accumulator<Tracking> for Energy {
    fn add(&mut self, x: &Tracking) {
        // of a recorded drive nobody knows the traction: `max` would make 0 of it
        let driving = if x.traction_w < 0.0 {
            0.0
        } else {
            x.traction_w
        };
        self.0.add(x.t_s, driving);
    }

    fn value(&self) -> f64 {
        self.0.value()
    }
}

#[derive(Default)]
struct EnergyPerMetre {
    energy: Energy,
    way: Integral,
}

impl Accumulator<Tracking> for EnergyPerMetre {
    fn add(&mut self, x: &Tracking) {
        self.energy.add(x);
        self.way.add(x.t_s, x.way_speed.abs());
    }

    fn value(&self) -> f64 {
        self.energy.value() / self.way.value()
    }
}

/// Root mean square change of the acceleration, m/s³.
pub(super) fn jerk() -> Running<Tracking> {
    Box::new(Jerk::default())
}

/// Speeds (time, m/s) a step of [`COMFORT_STEP_S`] apart: the last and the one before.
#[derive(Default)]
struct Jerk {
    last: Option<(f64, f64)>,
    before: Option<(f64, f64)>,
    squares: Mean,
}

impl Accumulator<Tracking> for Jerk {
    fn add(&mut self, x: &Tracking) {
        let too_soon = |(t_s, _): (f64, f64)| x.t_s - t_s < COMFORT_STEP_S - 1e-9;
        if self.last.is_some_and(too_soon) {
            return;
        }
        let c = (x.t_s, x.way_speed);
        if let (Some(a), Some(b)) = (self.before, self.last) {
            let earlier = (b.1 - a.1) / (b.0 - a.0);
            let later = (c.1 - b.1) / (c.0 - b.0);
            let jerk = (later - earlier) / (0.5 * (c.0 - a.0));
            self.squares.add(jerk * jerk);
        }
        (self.before, self.last) = (self.last, Some(c));
    }

    fn value(&self) -> f64 {
        self.squares.value().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use crate::metrics::measure_run;
    use crate::metrics::series::{ErrorSeries, Tracking};

    /// v = 0.3 t², F = 200 N forwards until 5 s, then backwards: jerk 0.6, way 0.1 t³.
    fn series() -> ErrorSeries {
        let at = |i: u32| {
            let t_s = 0.005 * f64::from(i);
            let way_speed = 0.3 * t_s * t_s;
            let force = if t_s <= 5.0 { 200.0 } else { -200.0 };
            Tracking {
                t_s,
                way_speed,
                traction_w: force * way_speed,
                speed: 0.5,
                accel: -2.0,
                off_rail: 0.001 * t_s,
                chainage: 0.1 * t_s.powi(3),
            }
        };
        ErrorSeries {
            tracking: (0..=2000).map(at).collect(),
            ..Default::default()
        }
    }

    /// Of a recorded drive, whose traction is not known, there is no energy: not zero.
    #[test]
    fn an_unknown_traction_is_no_energy() {
        let mut s = series();
        s.tracking.iter_mut().for_each(|x| x.traction_w = f64::NAN);
        for metric in ["traction_energy_j", "traction_energy_jpm"] {
            let x = measure_run(&s, metric, 0.0, f64::INFINITY).unwrap();
            assert!(x.is_nan(), "{metric}: {x}");
        }
    }

    #[test]
    fn they_are_what_their_names_say() {
        let s = series();
        let close = |metric: &str, expected: f64, share: f64| {
            let x = measure_run(&s, metric, 0.0, f64::INFINITY).unwrap();
            assert!((x / expected - 1.0).abs() < share, "{metric}: {x}");
        };
        close("speed_rmse_mps", 0.5, 1e-12);
        close("accel_rms_mps2", 2.0, 1e-12);
        close("jerk_rms_mps3", 0.6, 1e-9);
        // 200 N over the first 12.5 m; the way is 100 m
        close("traction_energy_j", 2500.0, 2e-3);
        close("traction_energy_jpm", 25.0, 2e-3);
        close("off_rail_max_m", 0.010, 1e-12);
        assert!(
            measure_run(&s, "jerk_rms_mps3", 20.0, 30.0)
                .unwrap()
                .is_nan()
        );
        assert!(measure_run(&s, "mass_rmse_kg", 0.0, 1.0).is_none());
    }
}
