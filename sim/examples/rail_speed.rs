//! Nanoseconds per `Rail::track` call: a point that rides beside the rail at 2 m/s, every 2 ms.
//!
//!     cargo run --release -p monorig-sim --example rail_speed -- assets/tracks/winding.yaml

use monorig_sim::rail::{Cursor, Rail};
use std::hint::black_box;
use std::time::Instant;

const CALLS: usize = 200_000;

fn main() -> Result<(), monorig_sim::error::Error> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "assets/tracks/winding.yaml".into());
    let rail = Rail::load(path.as_ref())?;
    println!("{}: {:.1} m", rail.name, rail.length());
    let points: Vec<_> = (0..CALLS)
        .map(|i| {
            let f = rail.frame((i as f64 * 0.004) % rail.length());
            f.p + f.l * 0.003 - f.u * 0.06
        })
        .collect();
    type Ask = fn(&Rail, &nalgebra::Vector3<f64>, &mut Cursor) -> f64;
    let asks: [(&str, Ask); 3] = [
        ("track", |r, p, c| r.track(p, c).u.z),
        ("project + frame_at", |r, p, c| {
            let s = r.project(p, c);
            r.frame_at(s, c).u.z
        }),
        ("frame_at", |r, _, c| r.frame_at(c.s + 0.003, c).u.z),
    ];
    for (name, ask) in asks {
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            let mut cursor = Cursor::default();
            let begin = Instant::now();
            for p in &points {
                black_box(ask(&rail, black_box(p), &mut cursor));
            }
            best = best.min(begin.elapsed().as_secs_f64() / CALLS as f64);
        }
        println!("{name:20} {:6.1} ns", best * 1e9);
    }
    Ok(())
}
