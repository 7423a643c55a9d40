//! A measurement: steps a second in lockstep.

use super::{OURS, ecu, file, registry, scenario, watch};
use monorig_sim::closed_loop::Simulation;
use std::net::UdpSocket;
use std::time::Instant;

/// Steps a second in lockstep: `cargo test --release --test cli -- --ignored --nocapture steps_a_second`.
#[test]
#[ignore = "a measurement"]
fn steps_a_second() {
    let registry = registry();
    let port = {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap();
        free.local_addr().unwrap().port()
    };
    let at = file("minimal.yaml");
    let mut listening = std::process::Command::new(OURS)
        .args([
            "ecu",
            "rail_fusion",
            "--udp",
            &format!("127.0.0.1:{port}"),
            "--scenario",
        ])
        .arg(&at)
        .spawn()
        .unwrap();
    let mut steps = Vec::new();
    let mut last_ns = 0;
    let mut vehicle = None;
    let run = scenario("minimal.yaml", "{attitude: {}}", "60");
    vehicle.replace(
        Simulation::build(run.clone(), &registry, 3)
            .unwrap()
            .vehicle,
    );
    let ran = watch(run, &registry, &mut |frame| {
        steps.push((
            *frame.measurements,
            *frame.command,
            (frame.time_ns - last_ns) as f64 * 1e-9,
        ));
        last_ns = frame.time_ns;
    });
    ran.unwrap();
    for (what, settings) in [
        ("in the loop", "{is: rail_fusion}".to_owned()),
        ("by a pipe", ecu("rail_fusion", "minimal.yaml", "fixed")),
        (
            "by a pipe, float",
            ecu("rail_fusion", "minimal.yaml", "float"),
        ),
        (
            "by UDP",
            format!("{{external: {{udp: \"127.0.0.1:{port}\"}}}}"),
        ),
    ] {
        let settings = serde_yaml::from_str(&settings).unwrap();
        let of_type = registry.estimator_of("ecu", &settings).unwrap();
        let mut estimator = of_type.build(&vehicle.unwrap(), &[]).unwrap();
        let mut best = f64::INFINITY;
        for _ in 0..10 {
            estimator.reset();
            let begun = Instant::now();
            for (z, u, dt) in &steps {
                estimator.step(z, u, *dt).unwrap();
            }
            best = best.min(begun.elapsed().as_secs_f64());
        }
        println!("{what}: {:.0} steps/s", steps.len() as f64 / best);
    }
    listening.kill().unwrap();
    listening.wait().unwrap();
}
