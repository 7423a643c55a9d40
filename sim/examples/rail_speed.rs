//! Nanoseconds per frame: the stations of a train beside the rail, at 2 m/s, every 2 ms.
//!
//!     cargo run --release -p monorig-sim --example rail_speed -- assets/tracks/winding.yaml

use monorig_sim::rail::{Cursor, Rail};
use nalgebra::Vector3;
use std::hint::black_box;
use std::time::Instant;

/// Stations of a train, 0.6 m apart, and steps of 2 ms.
const STATIONS: usize = 28;
const STEPS: usize = 10_000;

fn main() -> Result<(), monorig_sim::error::Error> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "assets/tracks/winding.yaml".into());
    let rail = Rail::load(path.as_ref())?;
    println!("{}: {:.1} m", rail.name, rail.length());
    let ride = |station: usize, step: usize| {
        let f = rail.frame(20.0 - 0.6 * station as f64 + 0.004 * step as f64);
        f.p + f.l * 0.003 - f.u * 0.06
    };
    let points: Vec<_> = (0..STEPS)
        .flat_map(|step| (0..STATIONS).map(move |station| (station, step)))
        .map(|(station, step)| ride(station, step))
        .collect();
    type Ask = fn(&Rail, &Vector3<f64>, &mut Cursor) -> f64;
    let asks: [(&str, Ask); 3] = [
        ("track", |r, p, c| r.track(p, c).u.z),
        ("project + frame_at", |r, p, c| {
            let s = r.project(p, c);
            r.frame_at(s, c).u.z
        }),
        ("frame_at", |r, _, c| r.frame_at(c.s + 0.004, c).u.z),
    ];
    for (name, ask) in asks {
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            let mut cursors: Vec<_> = (0..STATIONS)
                .map(|i| Cursor::at(20.0 - 0.6 * i as f64))
                .collect();
            let begin = Instant::now();
            for step in points.chunks(STATIONS) {
                for (p, cursor) in step.iter().zip(&mut cursors) {
                    black_box(ask(&rail, p, cursor));
                }
            }
            best = best.min(begin.elapsed().as_secs_f64() / points.len() as f64);
        }
        println!("{name:20} {:6.1} ns", best * 1e9);
    }
    Ok(())
}
