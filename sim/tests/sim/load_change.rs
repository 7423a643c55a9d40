//! A load that is hung on brings its momentum, and one that is set down takes its own away.

use monorig_sim::plant::{Plant, PlantOptions, point_mass::PointMass, rapier::World};
use monorig_sim::testing::{options, run, slope, torque, train, world};
use nalgebra::Vector3;

const DT: f64 = 2e-3;
const SPEED: f64 = 1.0;

/// Linear momentum of all bodies, kg·m/s.
fn momentum(w: &World) -> Vector3<f64> {
    let bodies = w.bodies().iter().zip(&w.dynamics().train.bodies);
    bodies.map(|(s, b)| s.v * b.mass_kg).sum()
}

/// Angular momentum of the load about a fixed point, N·m·s.
fn spin(w: &World, about: &Vector3<f64>) -> Vector3<f64> {
    let i = w.dynamics().train.load.unwrap();
    let (s, b) = (&w.bodies()[i], &w.dynamics().train.bodies[i]);
    let inertia = s.r * b.inertia * s.r.transpose();
    inertia * s.w + (s.c - about).cross(&(s.v * b.mass_kg))
}

/// A train that rolls at 1 m/s on the level with so much load, its load swinging a little.
fn rolling(load_kg: f64) -> World {
    let train = train("dx80_176y").with_load_mass(load_kg).unwrap();
    let mut w = world(&train, &slope(0.0), 40.0, SPEED);
    let load = train.load.unwrap();
    w.set_velocity(load, Vector3::new(SPEED + 0.1, 0.05, 0.0));
    run(&mut w, &torque(&train, 4.0), 1.3, DT);
    w
}

#[test]
fn what_is_hung_on_brings_the_momentum_of_its_stated_speed() {
    for speed in [0.0, 0.7, -0.5] {
        let mut w = rolling(2_000.0);
        let before = momentum(&w);
        let i = w.dynamics().train.load.unwrap();
        let payload = w.dynamics().train.payload.unwrap();
        let hung_at = w.bodies()[i].point(&payload.nominal.com);
        let about = Vector3::new(60.0, 1.0, -3.0);
        let turning = spin(&w, &about);
        w.set_load_mass(14_000.0, Some(speed));
        let brought = Vector3::x() * (12_000.0 * speed);
        let gap = momentum(&w) - before - brought;
        assert!(gap.norm() < 1e-9 * before.norm(), "{speed} m/s: {gap}");
        let gap = spin(&w, &about) - turning - (hung_at - about).cross(&brought);
        assert!(gap.norm() < 1e-9 * turning.norm(), "{speed} m/s: {gap}");
        // The next step starts from there: nothing is added behind its back.
        let t0 = w.truth().balance.unwrap().speed_mps;
        w.step(&torque(&w.dynamics().train.clone(), 4.0), DT)
            .unwrap();
        let b = w.truth().balance.unwrap();
        assert!(
            (b.sum_n() - b.inertia_n).abs() < 1e-6 * b.drive_n.abs().max(1e3),
            "{b:?}, {t0}"
        );
    }
}

#[test]
fn without_a_speed_the_load_goes_on_as_it_moved() {
    for (from, to) in [(2_000.0, 14_000.0), (14_000.0, 0.0)] {
        let mut w = rolling(from);
        let i = w.dynamics().train.load.unwrap();
        let place = Vector3::new(0.3, -0.2, 0.4);
        let motion = |w: &World| {
            let s = &w.bodies()[i];
            (s.velocity(&s.point(&place)), s.w)
        };
        let before = motion(&w);
        w.set_load_mass(to, None);
        let after = motion(&w);
        assert!((before.0 - after.0).norm() < 1e-12 && (before.1 - after.1).norm() < 1e-12);
    }
}

#[test]
fn the_whole_train_is_slowed_by_a_standing_load_as_an_inelastic_collision_says() {
    // Run on without torque or resistance until the swing has spread: the momentum of all that moves along the rail
    // stays.
    let mut train = train("dx80_176y").with_load_mass(0.0).unwrap();
    train.resistance = Default::default();
    let mut w = world(&train, &slope(0.0), 40.0, SPEED);
    let coast = torque(&train, 0.0);
    run(&mut w, &coast, 1.0, DT);
    let before = w.truth().balance.unwrap();
    w.set_load_mass(5_000.0, Some(0.0));
    run(&mut w, &coast, 20.0, DT);
    let after = w.truth().balance.unwrap();
    let expected =
        before.effective_mass_kg * before.speed_mps / (before.effective_mass_kg + 5_000.0);
    assert!(
        (after.speed_mps / expected - 1.0).abs() < 1e-6,
        "{} against {expected}",
        after.speed_mps
    );

    // The point mass does the same at once.
    let o = PlantOptions {
        ..options(&train, 40.0, SPEED)
    };
    let mut p = PointMass::new(train.clone(), slope(0.0), &o);
    p.step(&coast, DT).unwrap();
    let before = p.truth().balance.unwrap();
    p.set_load_mass(5_000.0, Some(0.0));
    p.step(&coast, DT).unwrap();
    let expected =
        before.effective_mass_kg * before.speed_mps / (before.effective_mass_kg + 5_000.0);
    assert!((p.truth().speed_mps / expected - 1.0).abs() < 1e-9);
}
