use monorig_tests::*;
use monorig_sim::plant::Plant;
use monorig_estimators::signals::Command;
fn main() {
    let train = train("dx80_176y");
    let rail = asset_track("winding");
    let mut w = world(&train, &rail, 20.0, 0.0);
    let mut cruise = Cruise::new(&train, 0.9);
    let t0 = std::time::Instant::now();
    let n = 50_000;
    for _ in 0..n { let c = cruise.command(&train, &w, 2e-3); w.step(&c, 2e-3).unwrap(); }
    println!("{:.2} us/step at {}", t0.elapsed().as_secs_f64()/n as f64*1e6, w.truth().chainage_m);
    let _ = Command::default();
}
