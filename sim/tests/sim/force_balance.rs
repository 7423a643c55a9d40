//! The force balance of the recording closes, and its terms are what they are called.

use monorig_estimators::Command;
use monorig_sim::plant::Plant;
use monorig_sim::plant::train::balance::ForceBalance;
use monorig_sim::rail::Rail;
use monorig_sim::testing::{Cruise, asset_track, slope, torque, track, train, world};
use monorig_sim::train::Train;
use std::sync::Arc;

const DT: f64 = 2e-3;

/// Drive for so long and give the balance of every step to `look`, after holding it against the change of momentum: the
/// sum of the forces is M_eff v̇ to 1e-6 of the largest term, v̇ from the speeds of two steps.
fn closes(
    name: &str,
    plant: &mut dyn Plant,
    seconds: f64,
    mut drive: impl FnMut(&dyn Plant, f64) -> Command,
    mut look: impl FnMut(&ForceBalance),
) {
    let mut speed: Option<f64> = None;
    for k in 0..(seconds / DT) as usize {
        let command = drive(plant, k as f64 * DT);
        plant.step(&command, DT).unwrap();
        let b = plant.truth().balance.unwrap();
        let largest = b.terms_n().iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let gap = (b.sum_n() - b.inertia_n).abs();
        assert!(
            gap < 1e-6 * largest,
            "{name} at {:.3} s: {gap} N of {largest} N: {b:?}",
            k as f64 * DT
        );
        if let Some(before) = speed {
            let change = b.effective_mass_kg * (b.speed_mps - before) / DT;
            let gap = (b.sum_n() - change).abs();
            assert!(
                gap < 1e-6 * largest,
                "{name} at {:.3} s: {gap} N of {largest} N",
                k as f64 * DT
            );
        }
        speed = Some(b.speed_mps);
        look(&b);
    }
}

/// A cruise at a speed; the brake comes on at a time, s.
fn cruise(train: &Train, speed: f64, brake_s: f64) -> impl FnMut(&dyn Plant, f64) -> Command {
    let (train, mut cruise) = (train.clone(), Cruise::new(train, speed));
    move |plant, t| {
        let command = cruise.command_at(&train, plant.truth().speed_mps, DT);
        if t > brake_s {
            Command {
                brake: 0.4,
                ..torque(&train, 0.0)
            }
        } else {
            command
        }
    }
}

#[test]
fn forces_along_the_rail_add_up_to_the_change_of_momentum() {
    let train = train("dx80_176y").with_load_mass(10_000.0).unwrap();
    let crest = "vertical: [{kind: grade, length_m: 45}, {kind: arc, to_grade_deg: -8, radius_m: 10}, {kind: grade, length_m: 80}]\n";
    let rails: [(&str, Arc<Rail>, f64, f64); 5] = [
        ("climb", slope(8.0), 0.8, 15.0),
        ("winding", asset_track("winding"), 0.8, 60.0),
        ("crest", track(crest), 1.0, 60.0),
        ("level", slope(0.0), 1.5, 12.0),
        ("down", slope(-12.0), 0.5, 10.0),
    ];
    for (name, rail, speed, brake_s) in rails {
        let mut w = world(&train, &rail, 22.0, 0.0);
        let load = train.load.unwrap();
        let push = rail.frame(20.0).t * 0.3;
        w.set_velocity(load, push);
        let mut largest = [0.0_f64; 10];
        closes(
            name,
            &mut w,
            brake_s + 5.0,
            cruise(&train, speed, brake_s),
            |b| {
                for (most, term) in largest.iter_mut().zip(b.terms_n()) {
                    *most = most.max(term.abs());
                }
            },
        );
        let [
            drive,
            clamped,
            running,
            guide,
            bearing,
            air,
            brake,
            grade,
            curve,
            contact,
        ] = largest;
        println!(
            "{name}: drive {drive:.0} clamped {clamped:.0} running {running:.0} guide {guide:.1} bearing {bearing:.0} air {air:.2} brake {brake:.0} grade {grade:.0} curve {curve:.3} contact {contact}"
        );
        let straight = ["climb", "level", "down"].contains(&name);
        // Nothing bends on a straight rail: what is left there is the rounding of forces of 1e5 N.
        assert_eq!(curve < 1e-6, straight, "{name}: curve {curve} N");
        assert_eq!(guide > 1.0, name == "winding", "{name}: guides {guide} N");
        assert!(brake > 1e4 && drive > 1e3 && contact == 0.0, "{name}");
    }
}
