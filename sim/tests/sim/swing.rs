//! The load swings as in the linearised model, braked and driving.

use monorig_estimators::Command;
use monorig_sim::plant::{Plant, rapier::World};
use monorig_sim::testing::modes::{Mode, natural_modes};
use monorig_sim::testing::{slope, torque, track, train, world};
use monorig_sim::train::Train;

const DT: f64 = 1e-3;

/// The slowest mode in which the load swings against the beam along the rail (axis 0) or across it (1).
fn swing(train: &Train, modes: &[Mode], axis: usize) -> Mode {
    let load = train.load.unwrap();
    let beam = train.supports(load)[0];
    let of = |m: &Mode| {
        let d = m.shape[load] - m.shape[beam];
        d[axis].abs() > 0.3 && d[axis].abs() > d[1 - axis].abs()
    };
    modes.iter().find(|m| of(m)).unwrap().clone()
}

/// Period of a signal by its crossings of its mean, s.
fn period(signal: &[f64], dt: f64) -> f64 {
    let mean = signal.iter().sum::<f64>() / signal.len() as f64;
    let crossings: Vec<f64> = signal
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0] < mean && w[1] >= mean)
        .map(|(k, w)| dt * (k as f64 + (mean - w[0]) / (w[1] - w[0])))
        .collect();
    assert!(crossings.len() > 5, "{} swings", crossings.len());
    (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64
}

/// A world under a command that is steady, after `seconds`.
fn steady(train: &Train, speed: f64, command: &Command, seconds: f64) -> World {
    let level = track("vertical: [{kind: grade, length_m: 400}]\n");
    let mut w = world(train, &level, 40.0, speed);
    for _ in 0..(seconds / DT) as usize {
        w.step(command, DT).unwrap();
    }
    w
}

/// Swing after a bump of the load, for so many seconds: along the rail and across it, rad.
fn bumped(w: &mut World, command: &Command, bump: [f64; 2], seconds: f64) -> [Vec<f64>; 2] {
    let load = w.dynamics().train.load.unwrap();
    let v = w.bodies()[load].v;
    w.set_velocity(load, v + nalgebra::Vector3::new(bump[0], bump[1], 0.0));
    let mut sway = [Vec::new(), Vec::new()];
    for _ in 0..(seconds / DT) as usize {
        w.step(command, DT).unwrap();
        let s = w.truth().sway_rad;
        sway[0].push(s[0]);
        sway[1].push(s[1]);
    }
    sway
}

/// Torque that holds a speed on the level: the resistance at that speed over what a motor's torque gives.
fn rolling_torque(train: &Train, speed: f64) -> f64 {
    let mut w = world(train, &slope(0.0), 40.0, speed);
    let d = train.drives[0];
    let per_torque =
        train.drives.len() as f64 * d.gear_ratio * d.efficiency_drive / d.wheel_radius_m;
    let (mut sum, n) = (0.0, 500);
    for _ in 0..n {
        w.step(&torque(train, 5.0), DT).unwrap();
        sum += w.truth().resistance_n;
    }
    sum / f64::from(n) / per_torque
}

#[test]
fn a_braked_train_and_a_driving_one_have_the_swing_of_the_linearised_model() {
    for load_kg in [2_000.0, 10_000.0, 20_000.0] {
        let train = train("dx80_176y").with_load_mass(load_kg).unwrap();
        let brake = Command {
            brake: 1.0,
            ..torque(&train, 0.0)
        };
        let drive = torque(&train, rolling_torque(&train, 1.0));
        for (name, command, speed) in [("braked", brake, 0.0), ("driving", drive, 1.0)] {
            let mut w = steady(&train, speed, &command, 3.0);
            let rail = track("vertical: [{kind: grade, length_m: 400}]\n");
            let modes = natural_modes(w.dynamics(), &rail, w.bodies(), &command, DT);
            // The first swing after the bump also shakes springs; a small swing, so that sin φ = φ to 1e-4.
            let [along, across] = bumped(&mut w, &command, [0.03, 0.02], 24.0);
            for (axis, signal, direction) in [(0, along, "along"), (1, across, "across")] {
                let mode = swing(&train, &modes, axis);
                let seen = period(&signal[2000..], DT);
                println!(
                    "{load_kg} kg {name} {direction}: {seen:.4} s, linearised {:.4} s, damping {:.4}",
                    mode.period_s, mode.damping_ratio
                );
                assert!(
                    (seen / mode.period_s - 1.0).abs() < 0.01,
                    "{load_kg} kg {name} {direction}: {seen} s against {} s",
                    mode.period_s
                );
            }
        }
    }
}

#[test]
fn without_brakes_the_train_swings_against_its_load() {
    // Two bodies on one spring: the stiffness of the pendulum works on the reduced mass, so the free period is shorter
    // than the braked one by √(M_train / (M_train + m)), M_train with its turning masses; chains and springs that give
    // change both alike.
    let train = train("dx80_176y").with_load_mass(10_000.0).unwrap();
    let load = train.bodies[train.load.unwrap()].mass_kg;
    let rest = train.total_mass_kg() - load + train.rotating_mass_kg();
    let rail = track("vertical: [{kind: grade, length_m: 400}]\n");
    let period = |command: &Command, speed: f64| {
        let w = steady(&train, speed, command, 3.0);
        let modes = natural_modes(w.dynamics(), &rail, w.bodies(), command, DT);
        swing(&train, &modes, 0).period_s
    };
    let braked = period(
        &Command {
            brake: 1.0,
            ..torque(&train, 0.0)
        },
        0.0,
    );
    let driving = period(&torque(&train, rolling_torque(&train, 1.0)), 1.0);
    let expected = (rest / (rest + load)).sqrt();
    assert!(
        (driving / braked / expected - 1.0).abs() < 0.05,
        "{driving} s over {braked} s against {expected}"
    );
}
