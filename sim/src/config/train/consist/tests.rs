use super::*;
use crate::config::urdf::tests::Folder;
use crate::testing::{asset, train};
use crate::train::{Drive, Geometry, Shape};
use nalgebra::Matrix3;
use std::path::PathBuf;

fn assets() -> PathBuf {
    asset("")
}

fn dx80() -> Train {
    train("dx80_176y")
}

fn single() -> Train {
    train("single_drive_unit")
}

/// Corners of a shape in the train's frame on a straight level rail (of its box, for round shapes).
fn corners(body: &Body, shape: &Shape) -> Vec<Vector3<f64>> {
    let of_box = |h: Vector3<f64>| {
        let sign = |i: usize, bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        (0..8)
            .map(|i| Vector3::new(sign(i, 0) * h.x, sign(i, 1) * h.y, sign(i, 2) * h.z))
            .collect()
    };
    let local: Vec<Vector3<f64>> = match &shape.geometry {
        Geometry::Box(size) => of_box(size / 2.0),
        Geometry::Cylinder(r, l) => of_box(Vector3::new(*r, *r, l / 2.0)),
        Geometry::Sphere(r) => of_box(Vector3::repeat(*r)),
        Geometry::Mesh { vertices, .. } => vertices.iter().map(|v| (*v).into()).collect(),
    };
    let pose = Translation3::new(body.start_s, 0.0, 0.0) * body.start_pose * shape.pose;
    local
        .iter()
        .map(|c| (pose * nalgebra::Point3::from(*c)).coords)
        .collect()
}

#[test]
fn the_dx80_is_what_its_data_sheet_says() {
    let train = dx80();
    assert_eq!(train.bodies.len(), 18);
    assert_eq!(train.drives.len(), 8);
    for d in &train.drives {
        assert!((2.0 * d.wheel_radius_m - 0.340).abs() < 1e-12);
        assert!((d.wheel_inertia - 2.0).abs() < 1e-12);
        assert_eq!(d.contact, Vector3::zeros());
    }
    for s in train.bodies.iter().flat_map(|b| &b.stations) {
        assert!((2.0 * s.wheel_radius_m - 0.175).abs() < 1e-12);
    }
    assert_eq!(train.load_mass_kg(), 20_000.0);
    assert!(
        (train.tare_kg() - 9_000.0).abs() < 1e-6,
        "{}",
        train.tare_kg()
    );
    assert!((train.total_mass_kg() - 29_000.0).abs() < 1e-6);
    let sum = |f: fn(&Drive) -> f64| train.drives.iter().map(f).sum::<f64>();
    let traction = sum(|d| d.torque_max_nm * d.gear_ratio * d.efficiency_drive / d.wheel_radius_m);
    assert!((traction / 80e3 - 1.0).abs() < 1e-3, "{traction}");
    assert!((sum(|d| d.power_w) - 60e3).abs() < 1e-6);
    assert!((120e3..=160e3).contains(&sum(|d| d.brake_max_n)));
    for d in &train.drives {
        assert!((d.speed_max_radps * 60.0 / std::f64::consts::TAU - 2600.0).abs() < 1e-9);
        assert!(d.speed_max_radps / d.gear_ratio * d.wheel_radius_m >= 2.4);
        let grip = 2.0 * d.adhesion * d.piston_area_m2 * 1e6;
        assert!(grip * 8.0 > 10e3, "8 MPa carry the traction: {grip} N/MPa");
        // Full traction is there at the loaded speed of 0.5 m/s.
        assert!(d.power_w * d.efficiency_drive / 0.5 > 10e3);
    }
    // Length over couplings: from the front of the first unit to the rear of the last.
    let lengths = 2.0 * 2.3 + 8.0 * 1.1 + 4.7;
    assert!((lengths - 18.1_f64).abs() < 1e-12);
    let body = |name: &str| train.bodies.iter().find(|b| b.name == name).unwrap();
    assert!((body("cab_front").start_s + body("cab_rear").start_s + 18.1).abs() < 1e-9);
}

#[test]
fn running_resistance_at_19_t_is_0_02_of_the_weight() {
    let train = dx80().with_load_mass(10_000.0).unwrap();
    let (r, weight) = (train.resistance, train.total_mass_kg() * 9.81);
    let clamp: f64 = train
        .drives
        .iter()
        .map(|d| 2.0 * d.piston_area_m2 * d.clamp_mpa * 1e6)
        .sum();
    let on_rail = train
        .bodies
        .iter()
        .filter(|b| !b.stations.is_empty())
        .count() as f64;
    let force = r.running_wheel * weight
        + r.clamped_wheel * clamp
        + on_rail * (r.bearing_n + r.bearing_nspm)
        + r.air_nspm2;
    assert!((force / weight - 0.02).abs() < 1e-3, "{}", force / weight);
}

#[test]
fn the_dx80_is_1_04_m_wide_and_1_45_m_high_and_within_18_1_m() {
    let train = dx80();
    let own = train
        .bodies
        .iter()
        .enumerate()
        .filter(|(i, _)| Some(*i) != train.load)
        .map(|(_, b)| b);
    let points: Vec<_> = own
        .flat_map(|b| b.shapes.iter().flat_map(move |s| corners(b, s)))
        .collect();
    let range = |axis: usize| {
        let along = points.iter().map(|p| p[axis]);
        (
            along.clone().fold(f64::INFINITY, f64::min),
            along.fold(f64::NEG_INFINITY, f64::max),
        )
    };
    let (rear, front) = range(0);
    assert!(front <= 0.0 && rear >= -18.1, "{rear} … {front}");
    let (right, left) = range(1);
    assert!((left - right - 1.04).abs() < 0.01, "{right} … {left}");
    let (low, high) = range(2);
    assert!((high - low - 1.45).abs() < 0.01, "{low} … {high}");
}

#[test]
fn bodies_hold_together_at_the_start() {
    for train in [dx80(), single()] {
        let at = |i: usize, p: &Vector3<f64>| {
            let b = &train.bodies[i];
            (b.start_pose * nalgebra::Point3::from(*p)).coords + Vector3::new(b.start_s, 0.0, 0.0)
        };
        for c in &train.connections {
            let distance = (at(c.a, &c.anchor_a) - at(c.b, &c.anchor_b)).norm();
            assert!((distance - c.length_m).abs() < 1e-9, "{c:?}");
            assert!((c.kind == ConnectionKind::Hanger) == (c.length_m == 0.0));
        }
        // Everything hangs together: from body 0 every body can be reached.
        let mut reached = vec![0];
        for _ in 0..train.bodies.len() {
            for c in &train.connections {
                for (a, b) in [(c.a, c.b), (c.b, c.a)] {
                    if reached.contains(&a) && !reached.contains(&b) {
                        reached.push(b);
                    }
                }
            }
        }
        assert_eq!(reached.len(), train.bodies.len());
        // A rail-bound body is upright when its centre of mass is below the wheels' contact, 62 mm under the rail's
        // line.
        for b in train.bodies.iter().filter(|b| !b.stations.is_empty()) {
            assert!(b.com.z < -0.062, "{}: {}", b.name, b.com.z);
            assert!(b.com.y.abs() < 1e-9);
        }
    }
    let train = dx80();
    let count = |kind| train.connections.iter().filter(|c| c.kind == kind).count();
    assert_eq!(count(ConnectionKind::Drawbar), 10);
    assert_eq!(count(ConnectionKind::Hanger), 6);
    assert_eq!(count(ConnectionKind::Chain), 4);
}

#[test]
fn the_single_drive_unit_runs_with_2500_kg() {
    let train = single();
    assert!((train.total_mass_kg() - 2_500.0).abs() < 1e-6);
    assert_eq!((train.bodies.len(), train.drives.len()), (2, 1));
    assert_eq!(train.resistance.running_wheel, 0.4);
    let d = &train.drives[0];
    let needed = 2_500.0 * 9.81 * (0.4 * 8_f64.to_radians().cos() + 8_f64.to_radians().sin());
    let given = d.torque_max_nm * d.gear_ratio * d.efficiency_drive / d.wheel_radius_m;
    let carried = 2.0 * d.adhesion * d.piston_area_m2 * d.clamp_mpa * 1e6;
    assert!(
        needed < given && given < carried,
        "{needed} {given} {carried}"
    );
    assert!(train.mount("drive_1/imu_link").is_some());
}

#[test]
fn the_load_comes_and_goes_and_the_gear_stays() {
    let full = dx80();
    let index = full.load.unwrap();
    let payload = full.payload.unwrap();
    let empty = full.clone().with_load_mass(0.0).unwrap();
    assert_eq!(empty.bodies[index].mass_kg, payload.gear.mass_kg);
    assert!((empty.total_mass_kg() - 9_000.0).abs() < 1e-6);
    assert!((empty.tare_kg() - full.tare_kg()).abs() < 1e-9);
    let half = full.clone().with_load_mass(10_000.0).unwrap();
    assert!((half.total_mass_kg() - 19_000.0).abs() < 1e-6);
    // Two halves on one gear are the whole: moments about the frame's origin add up.
    let origin = |b: &Body| {
        let d = b.com;
        b.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * b.mass_kg
    };
    let [o, h, f] = [&empty, &half, &full].map(|t| origin(&t.bodies[index]));
    assert!((h * 2.0 - o - f).norm() < 1e-9 * f.norm());
    let back = half.with_load_mass(20_000.0).unwrap();
    assert_eq!(back.bodies[index].mass_kg, full.bodies[index].mass_kg);
    assert_eq!(back.bodies[index].inertia, full.bodies[index].inertia);
    for wrong in [-1.0, 20_001.0, f64::NAN] {
        assert!(full.clone().with_load_mass(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn rotating_mass_is_that_of_wheels_and_motors() {
    // 8 · (2 · 2 kg·m² + 19² · 0.002 kg·m²) / 0.17² m²
    let by_hand = 8.0 * (4.0 + 361.0 * 0.002) / 0.0289;
    assert!((dx80().rotating_mass_kg() - by_hand).abs() < 1e-9);
}

#[test]
fn both_trains_take_steps_of_5_ms_with_any_load_and_not_of_20_ms() {
    for (train, loads) in [
        (dx80(), [0.0, 500.0, 20_000.0]),
        (single(), [0.0, 500.0, 1_800.0]),
    ] {
        for mass_kg in loads {
            let train = train.clone().with_load_mass(mass_kg).unwrap();
            assert!(
                train.check_step(5e-3).is_ok(),
                "{} with {mass_kg} kg: {} s",
                train.name,
                train.longest_step().0
            );
            assert!(train.check_step(20e-3).is_err());
        }
    }
}

#[test]
fn a_reversed_unit_is_the_same_unit_seen_from_behind() {
    let train = dx80();
    let body = |name: &str| train.bodies.iter().find(|b| b.name == name).unwrap();
    let (front, rear) = (body("cab_front"), body("cab_rear"));
    let turn = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    assert!((turn * front.com - rear.com).norm() < 1e-12);
    assert!((turn * front.inertia * turn - rear.inertia).norm() < 1e-9);
    let ends = |b: &Body| {
        b.shapes
            .iter()
            .flat_map(|s| corners(b, s))
            .map(|c| c.x)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            })
    };
    let ((a, b), (c, d)) = (ends(front), ends(rear));
    assert!((a + d + 18.1).abs() < 1e-9 && (b + c + 18.1).abs() < 1e-9);
}

#[test]
fn friction_wheels_are_marked_and_sit_beside_the_web() {
    let train = dx80();
    let mut seen = std::collections::BTreeSet::new();
    for b in &train.bodies {
        for s in &b.shapes {
            let Some((drive, side)) = s.spins else {
                continue;
            };
            assert_eq!(train.bodies[train.drives[drive].body].name, b.name);
            let y = s.pose.translation.y;
            assert!((y.abs() - (0.170 + 0.0035)).abs() < 1e-9 && (y > 0.0) == (side == 0));
            assert!((s.pose.rotation * Vector3::z() - Vector3::z()).norm() < 1e-9);
            seen.insert((drive, side));
        }
    }
    assert_eq!(seen.len(), 16);
    assert_eq!(train.mount("imu_link"), train.mount("drive_1/imu_link"));
    assert_eq!(
        train.bodies[train.mounts[train.mount("drive_4/imu_link").unwrap()].body].name,
        "drive_4"
    );
    assert!(train.mount("drive_9/imu_link").is_none());
}

/// A copy of the assets that may be spoilt.
fn copy(name: &str) -> Folder {
    let folder = Folder::new(name);
    for sub in ["units", "units/meshes", "trains"] {
        std::fs::create_dir_all(folder.0.join(sub)).unwrap();
        for entry in std::fs::read_dir(assets().join(sub)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                std::fs::copy(&path, folder.0.join(sub).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
    folder
}

#[test]
fn faults_of_train_and_unit_files_are_told() {
    let train = "trains/dx80_176y.yaml";
    let drive = "units/drive_unit.yaml";
    let cases = [
        (train, "version: 1", "version: 2", "format version 2"),
        (
            train,
            "name: drive_2,",
            "name: drive_1,",
            "two units are named `drive_1`",
        ),
        (
            train,
            "name: drive_2,",
            "name: a/b,",
            "is not a valid name for a unit",
        ),
        (train, "under: beam", "under: boom", "no unit `boom`"),
        (train, "under: beam", "under: cab_front", "no link `hook_1`"),
        (
            train,
            "max_speed_mps: 2.4",
            "max_speed_mps: 2.6",
            "the drive units reach",
        ),
        (
            train,
            "max_load_kg: 20000",
            "max_load_kg: 19999",
            "rated for 19999 kg",
        ),
        (train, "max_grade_deg: 30", "max_grade_deg: 90", "too steep"),
        (
            train,
            "running_wheel: 0.012",
            "running_wheel: -0.012",
            "-0.012",
        ),
        (train, "units/load.yaml", "units/cab.yaml", "no `load`"),
        (
            train,
            "{name: drive_1, unit: ../units/drive_unit.yaml}",
            "{name: drive_1, unit: ../units/load.yaml}",
            "no length_m",
        ),
        (
            train,
            "{name: drive_1, unit: ../units/drive_unit.yaml}",
            "{name: drive_1, unit: ../units/gone.yaml}",
            "gone.yaml",
        ),
        (drive, "version: 1", "version: 0", "format version 0"),
        (drive, "length_m: 1.1", "length_m: 0.7", "drawbar"),
        (drive, "length_m: 1.1", "length_m: 0", "above zero"),
        (
            drive,
            "torque_max_nm: 94.2",
            "torque_max_nm: 200",
            "the URDF joint allows 1600 N·m",
        ),
        (
            drive,
            "speed_max_rpm: 2600",
            "speed_max_rpm: 3000",
            "the URDF joint allows 14.4 rad/s",
        ),
        (
            drive,
            "efficiency_drive: 0.95",
            "efficiency_drive: 0",
            "transmits no power",
        ),
        (drive, "running_gear:", "walking_gear:", "walking_gear"),
        (drive, "drive_unit.urdf", "cab.urdf", "friction wheels is 0"),
        (
            drive,
            "drive_unit.urdf",
            "carrier_trolley.urdf",
            "friction wheels is 0",
        ),
        (
            "units/lifting_beam.yaml",
            "carried_by:\n  trolley: carrier_trolley.yaml\n  links: [hanger_front, hanger_rear]\n  stiffness_npm: 4.0e+6\n  damping_nspm: 1.0e+4\n",
            "",
            "holds this unit to the rail",
        ),
        (
            "units/load.yaml",
            "payload_link: payload",
            "payload_link: hook_1",
            "cannot be the payload",
        ),
        ("units/load.yaml", "hook_1, ", "hook_9, ", "link `hook_9`"),
        (
            "units/cab.yaml",
            "carrier_trolley.yaml",
            "load.yaml",
            "does not run on the rail",
        ),
        (
            "units/cab.yaml",
            "hanger_rear]",
            "hanger_middle]",
            "link `hanger_middle`",
        ),
        (
            "units/cab.yaml",
            "[hanger_front, hanger_rear]",
            "[hanger_front]",
            "two hangers",
        ),
        (
            "units/carrier_trolley.urdf",
            "running_wheel_front_left",
            "rolling_wheel_front_left",
            "has no partner",
        ),
        (
            "units/carrier_trolley.urdf",
            "guide_wheel_rear",
            "guide_roller_rear",
            "no guide wheel near",
        ),
        (
            "units/drive_unit.urdf",
            "<mass value=\"75\"/>",
            "<mass value=\"0\"/>",
            "mass 0 kg",
        ),
        (
            "units/meshes/clamp_arm.stl",
            "vertex",
            "corner",
            "no triangle",
        ),
    ];
    for (i, (file, old, new, message)) in cases.into_iter().enumerate() {
        let folder = copy(&format!("train-faults-{i}"));
        let path = folder.0.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(old), "{file} has no `{old}`");
        std::fs::write(&path, text.replace(old, new)).unwrap();
        match Train::load(&folder.0.join(train)) {
            Ok(_) => panic!("accepted: {file}: {new}"),
            Err(e) => assert!(
                e.to_string().contains(message),
                "{file}: {new}: wanted `{message}`, got: {e}"
            ),
        }
    }
}

#[test]
fn a_part_on_a_floating_joint_is_a_body_and_must_be_held() {
    let folder = copy("floating-part");
    let urdf = folder.0.join("units/drive_unit.urdf");
    let yaml = folder.0.join("units/drive_unit.yaml");
    let train = folder.0.join("trains/single_drive_unit.yaml");
    let part = "<link name=\"tool_box\"><inertial><mass value=\"40\"/><inertia ixx=\"2\" ixy=\"0\" ixz=\"0\" iyy=\"2\" iyz=\"0\" izz=\"2\"/></inertial></link>\
        <joint name=\"free\" type=\"floating\"><parent link=\"frame\"/><child link=\"tool_box\"/><origin xyz=\"0.2 0 -0.5\"/></joint></robot>";
    let text = std::fs::read_to_string(&urdf).unwrap();
    std::fs::write(&urdf, text.replace("</robot>", part)).unwrap();
    let error = Train::load(&train).unwrap_err().to_string();
    assert!(error.contains("nothing holds `tool_box`"), "{error}");

    let text = std::fs::read_to_string(&yaml).unwrap();
    let held = "connections: [{kind: chain, from: frame, to: tool_box, stiffness_npm: 1.0e+5, damping_nspm: 100}]";
    std::fs::write(&yaml, format!("{text}\n{held}\n")).unwrap();
    let train = Train::load(&train).unwrap();
    assert!((train.total_mass_kg() - 2_540.0).abs() < 1e-6);
    let index = train
        .bodies
        .iter()
        .position(|b| b.name == "drive_1/tool_box")
        .unwrap();
    let part = &train.bodies[index];
    assert!((part.start_s - train.bodies[0].start_s - 0.2).abs() < 1e-12);
    assert_eq!(
        part.start_pose.translation.vector,
        Vector3::new(0.0, 0.0, -0.5)
    );
    let chain = train.connections.iter().find(|c| c.b == index).unwrap();
    assert!((chain.length_m - (0.2_f64 * 0.2 + 0.5 * 0.5).sqrt()).abs() < 1e-12);
}

#[test]
fn mangled_files_are_refused_without_a_panic() {
    let folder = copy("mangled");
    let train = folder.0.join("trains/single_drive_unit.yaml");
    let (mut tried, mut refused) = (0, 0);
    for file in [
        "units/drive_unit.urdf",
        "units/drive_unit.yaml",
        "trains/single_drive_unit.yaml",
        "units/load_block.urdf",
    ] {
        let path = folder.0.join(file);
        let good = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = good.lines().collect();
        let mut spoilt: Vec<String> = (0..12)
            .map(|i| good.chars().take(good.chars().count() * i / 12).collect())
            .collect();
        for (i, line) in lines.iter().enumerate().filter(|(i, _)| i % 3 == 0) {
            let with = |middle: &str| {
                [
                    lines[..i].join("\n"),
                    middle.to_owned(),
                    lines[i + 1..].join("\n"),
                ]
                .join("\n")
            };
            spoilt.push(with(""));
            spoilt.push(with(&format!("{line}\n{line}")));
            spoilt.push(with(&line.replace(['1', '2', '3', '5'], "NaN")));
            spoilt.push(with(&line.replace('0', "-1e300")));
            spoilt.push(with(&line.replace(['"', ':'], "<")));
        }
        for text in spoilt {
            tried += 1;
            std::fs::write(&path, &text).unwrap();
            match Train::load(&train) {
                Ok(t) => assert!(
                    t.total_mass_kg().is_finite() && t.bodies.iter().all(|b| b.mass_kg > 0.0)
                ),
                Err(e) => {
                    refused += 1;
                    assert!(!e.to_string().is_empty());
                }
            }
        }
        std::fs::write(&path, good).unwrap();
    }
    assert!(tried > 300 && refused > tried / 3, "{refused} of {tried}");
}
