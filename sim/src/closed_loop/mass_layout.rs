//! Mass layout for the estimators: where the masses of a train sit, by its drawings and data sheets, whatever the load
//! is now.

use crate::train::{ConnectionKind, Train};
use monorig_estimators::api::mass_layout::{CarriedMass, MAX_MASSES, MassLayout, SuspendedLoad};
use nalgebra::{DMatrix, DVector, Point3};

/// Layout of a train around a place `at_m` from its front (≤ 0); this place is the middle of the body `imu_body`, whose
/// IMU sits `imu_depth_m` below the rail's line. `None` if the train carries no load or has more bodies than a layout
/// can hold.
pub fn of_train(train: &Train, at_m: f64, imu_body: usize, imu_depth_m: f64) -> Option<MassLayout> {
    let load_index = train.load?;
    let mut layout = MassLayout {
        imu_depth_m,
        load: load(train, load_index, at_m, imu_body)?,
        ..MassLayout::default()
    };
    let mut places = layout.masses.iter_mut();
    for (i, body) in train.bodies.iter().enumerate() {
        if i != load_index && body.mass_kg > 0.0 {
            let com = body.start_pose * Point3::from(body.com);
            *places.next()? = CarriedMass {
                places_m: places_of(train, i, at_m, MAX_MASSES)?,
                mass_kg: body.mass_kg,
                depth_m: -com.z,
            };
        }
    }
    Some(layout)
}

/// The load's suspension.
fn load(train: &Train, load: usize, at_m: f64, imu_body: usize) -> Option<SuspendedLoad> {
    let payload = train.payload?;
    let chain = train
        .connections
        .iter()
        .find(|c| c.kind == ConnectionKind::Chain && (c.a == load || c.b == load))?;
    let (support, upper, lower) = if chain.a == load {
        (chain.b, chain.anchor_b, chain.anchor_a)
    } else {
        (chain.a, chain.anchor_a, chain.anchor_b)
    };
    let hook = train.bodies[support].start_pose * Point3::from(upper);
    Some(SuspendedLoad {
        places_m: places_of(train, load, at_m, MAX_MASSES)?,
        swinging_tare_kg: payload.gear.mass_kg,
        hook_depth_m: -hook.z,
        below_chains_m: lower.z - payload.nominal.com.z,
        chain_m: chain.length_m,
        longitudinal_stiffness_npm: stiffness_npm(train, load, support, imu_body),
    })
}

/// Returns the two places that carry a body, m behind `at_m`: its own stations, or the stations of the body on which it
/// hangs. `None` if it hangs on nothing.
fn places_of(train: &Train, i: usize, at_m: f64, depth: usize) -> Option<[f64; 2]> {
    let body = &train.bodies[i];
    let span = |places: &mut dyn Iterator<Item = f64>| {
        places.fold([f64::MAX, f64::MIN], |[near, far], x| {
            [near.min(x), far.max(x)]
        })
    };
    if !body.stations.is_empty() {
        let mut stations = body.stations.iter().map(|st| at_m - body.start_s - st.x_m);
        return Some(span(&mut stations));
    }
    let mut supports = train.supports(i);
    supports.sort_unstable();
    supports.dedup();
    let below = depth.checked_sub(1)?;
    if let [only] = supports[..] {
        return places_of(train, only, at_m, below);
    }
    let mids: Option<Vec<f64>> = supports
        .iter()
        .map(|&s| places_of(train, s, at_m, below).map(|[near, far]| 0.5 * (near + far)))
        .collect();
    let mids = mids.filter(|mids| !mids.is_empty())?;
    Some(span(&mut mids.into_iter()))
}

/// Longitudinal stiffness between the body that the load hangs on and that with the IMU, N/m: of drawbars and hangers
/// in a train that is pulled at the former and held by the inertia of all its bodies. `None` if they are one body.
fn stiffness_npm(train: &Train, load: usize, support: usize, imu_body: usize) -> Option<f64> {
    if support == imu_body {
        return None;
    }
    let n = train.bodies.len();
    let mut stiffness = DMatrix::<f64>::zeros(n, n);
    for c in &train.connections {
        if c.kind != ConnectionKind::Chain {
            for (i, j) in [(c.a, c.b), (c.b, c.a)] {
                stiffness[(i, i)] += c.k;
                stiffness[(i, j)] -= c.k;
            }
        }
    }
    let mut masses: Vec<f64> = train.bodies.iter().map(|b| b.mass_kg).collect();
    masses[load] = 0.0;
    let drives = train.drives.len().max(1) as f64;
    for drive in &train.drives {
        masses[drive.body] += train.rotating_mass_kg() / drives;
    }
    let total: f64 = masses.iter().sum();
    let mut force = DVector::from_iterator(n, masses.iter().map(|m| -m / total));
    force[support] += 1.0;
    // The body with the IMU is held; what has no stiffness (the load) stays where it is.
    for i in 0..n {
        if i == imu_body || stiffness[(i, i)] == 0.0 {
            stiffness.row_mut(i).fill(0.0);
            stiffness.column_mut(i).fill(0.0);
            stiffness[(i, i)] = 1.0;
            force[i] = 0.0;
        }
    }
    let give = stiffness.lu().solve(&force)?[support];
    (give > 0.0 && give.is_finite()).then(|| 1.0 / give)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::train;

    #[test]
    fn the_layout_has_the_tare_the_length_and_the_pendulum_of_the_drawings() {
        let t = train("dx80_176y");
        let drive = t.drives[0].body;
        let middle = t.bodies[drive].start_s;
        let layout = of_train(&t, middle, drive, 0.25).unwrap();
        assert!((layout.tare_kg() - t.tare_kg()).abs() < 1e-6);
        let load = layout.load;
        // Chains of 0.6 m from 0.70 m below the rail; the payload's centre 0.70 m below the spreader's hooks
        // (load.urdf).
        let told = [load.chain_m, load.hook_depth_m, load.below_chains_m];
        for (told, drawn) in told.iter().zip([0.6, 0.70, 0.70]) {
            assert!((told - drawn).abs() < 0.02, "{told} {drawn}");
        }
        assert_eq!(load.swinging_tare_kg, 300.0);
        assert!((load.places_m[1] - load.places_m[0] - 2.8).abs() < 0.05);
        // Four drawbars of 5 MN/m lie between, the force in them falling towards the front: softer than one, stiffer
        // than four in series.
        let stiffness = load.longitudinal_stiffness_npm.unwrap();
        assert!((1.25e6..5e6).contains(&stiffness), "{stiffness}");
        // It does not depend on the load.
        let empty = of_train(&t.with_load_mass(0.0).unwrap(), middle, drive, 0.25);
        assert_eq!(empty, Some(layout));
    }

    #[test]
    fn a_load_under_the_unit_with_the_imu_has_no_couplings_between() {
        let t = train("single_drive_unit");
        let layout = of_train(&t, t.bodies[0].start_s, 0, 0.25).unwrap();
        assert_eq!(layout.load.longitudinal_stiffness_npm, None);
        assert!((layout.load.places_m[1] - layout.load.places_m[0] - 0.6).abs() < 1e-9);
        assert!((layout.load.hook_depth_m - 0.33).abs() < 0.02);
    }
}
