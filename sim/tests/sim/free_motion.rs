//! Bodies that nothing can touch are advanced without rapier's pipeline: the motion is that of the pipeline but for
//! rounding.

use monorig_sim::plant::obstacles::ObstacleBox;
use monorig_sim::plant::rapier::World;
use monorig_sim::plant::{Plant, PlantOptions};
use monorig_sim::rail::Rail;
use monorig_sim::testing::{Cruise, options, slope, track, train};
use monorig_sim::train::Train;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

const DT_S: f64 = 2e-3;

/// The same start twice; the second goes through the whole pipeline in every step.
fn both(train: &Train, rail: &Arc<Rail>, options: &PlantOptions) -> [World; 2] {
    let build = || World::new(train.clone(), rail.clone(), options).expect("world");
    let mut worlds = [build(), build()];
    worlds[1].set_engine_always(true);
    worlds
}

/// Drive both at a speed; largest distance of two bodies of one name, m, after each step to `seen`.
fn drive(
    worlds: &mut [World; 2],
    train: &Train,
    speed: f64,
    seconds: f64,
    mut seen: impl FnMut(usize, &mut [World; 2], f64),
) {
    let mut cruise = Cruise::new(train, speed);
    for step in 0..(seconds / DT_S) as usize {
        // one command for both: what is compared is the motion under it
        let command = cruise.command(train, &worlds[0], DT_S);
        for world in worlds.iter_mut() {
            world.step(&command, DT_S).expect("step");
        }
        let apart = apart(worlds);
        seen(step, worlds, apart);
    }
}

fn apart([a, b]: &[World; 2]) -> f64 {
    let bodies = a.bodies().iter().zip(b.bodies());
    bodies.map(|(a, b)| (a.p - b.p).norm()).fold(0.0, f64::max)
}

#[test]
fn on_a_straight_both_ways_are_one_motion() {
    let train = train("dx80_176y");
    let mut worlds = both(&train, &slope(8.0), &options(&train, 60.0, 0.0));
    let mut most: f64 = 0.0;
    drive(&mut worlds, &train, 1.5, 20.0, |_, _, apart| {
        most = most.max(apart);
    });
    assert!(worlds[0].truth().chainage_m > 70.0);
    println!("straight: {most:e} m");
    assert!(most < 1e-11, "{most:e}");
}

#[test]
fn in_the_tightest_bend_both_ways_are_one_motion() {
    let train = train("dx80_176y");
    let rail = track(
        "horizontal: [{kind: line, length_m: 60}, {kind: arc, radius_m: 4, angle_deg: 90, easement_m: 1}, {kind: line, length_m: 80}]\n",
    );
    let mut worlds = both(&train, &rail, &options(&train, 58.0, 0.8));
    let mut most: f64 = 0.0;
    drive(&mut worlds, &train, 0.8, 20.0, |_, _, apart| {
        most = most.max(apart);
    });
    println!("bend of 4 m: {most:e} m");
    assert!(most < 1e-9, "{most:e}");
}

/// Mass that is hung on, and a velocity given by hand, reach both.
#[test]
fn changes_by_hand_reach_both() {
    let train = train("dx80_176y");
    let mut worlds = both(&train, &slope(3.0), &options(&train, 60.0, 0.5));
    let mut most: f64 = 0.0;
    drive(&mut worlds, &train, 0.5, 4.0, |step, worlds, apart| {
        most = most.max(apart);
        for world in worlds {
            match step {
                500 => world.set_load_mass(9000.0, Some(0.0)),
                1000 => world.set_load_mass(2000.0, None),
                1500 => world.set_velocity(0, Vector3::new(0.6, 0.01, 0.0)),
                _ => {}
            }
        }
    });
    assert!(most < 1e-9, "{most:e}");
}

/// Up to the contact the first goes without the pipeline, then with it: it hits the same wall in the same way.
#[test]
fn a_wall_is_hit_alike() {
    let train = train("dx80_176y");
    let rail = slope(0.0);
    let start = rail.frame(64.0).p;
    let wall = ObstacleBox {
        pose: Isometry3::translation(start.x, start.y, start.z - 1.0),
        size: Vector3::new(0.2, 4.0, 3.0),
    };
    let options = PlantOptions {
        obstacles: vec![wall],
        ..options(&train, 60.0, 0.6)
    };
    let mut worlds = both(&train, &rail, &options);
    let (mut before, mut after, mut contact): (f64, f64, f64) = (0.0, 0.0, 0.0);
    drive(&mut worlds, &train, 0.6, 9.0, |_, worlds, apart| {
        let force = worlds[0].truth().balance.map_or(0.0, |b| b.contact_n);
        contact = contact.max(force.abs());
        if contact > 100.0 {
            after = after.max(apart);
        } else {
            before = before.max(apart);
        }
    });
    println!("before the wall {before:e} m, from the contact on {after:e} m, {contact:.0} N");
    assert!(contact > 1000.0, "the wall was not hit: {contact} N");
    assert!(before < 1e-10, "{before:e}");
    assert!(after < 1e-6, "{after:e}");
}
