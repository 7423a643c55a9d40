//! What the metrics of train and controller are computed from.

use crate::metrics::series::Tracking;
use crate::metrics::statistics::rms;

/// Acceleration and jerk are taken over steps of this length: shorter ones show the springs of the wheels, s.
const COMFORT_STEP_S: f64 = 0.1;

/// Work of the wheels while they drive, J.
pub(super) fn energy(s: &[Tracking]) -> f64 {
    integral(s, |x| x.traction_w.max(0.0))
}

/// [`energy`] over the way gone, J/m.
pub(super) fn energy_per_metre(s: &[Tracking]) -> f64 {
    energy(s) / integral(s, |x| x.way_speed.abs())
}

/// Integral over time by trapezoids.
fn integral(s: &[Tracking], f: fn(&Tracking) -> f64) -> f64 {
    let step = |w: &[Tracking]| match w {
        [a, b] => 0.5 * (f(a) + f(b)) * (b.t_s - a.t_s),
        _ => 0.0,
    };
    match s.len() {
        0 | 1 => f64::NAN,
        _ => s.windows(2).map(step).sum(),
    }
}

/// Root mean square change of the acceleration, m/s³.
pub(super) fn jerk(s: &[Tracking]) -> f64 {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for x in s {
        if points
            .last()
            .is_none_or(|(t, _)| x.t_s - t >= COMFORT_STEP_S - 1e-9)
        {
            points.push((x.t_s, x.way_speed));
        }
    }
    rms(points.windows(3).filter_map(|w| match w {
        [a, b, c] => {
            let before = (b.1 - a.1) / (b.0 - a.0);
            let after = (c.1 - b.1) / (c.0 - b.0);
            Some((after - before) / (0.5 * (c.0 - a.0)))
        }
        _ => None,
    }))
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
