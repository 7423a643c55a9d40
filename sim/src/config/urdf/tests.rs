use super::file::rotation;
use super::*;
use std::path::PathBuf;

/// A folder of its own for each test, removed at the end.
pub(crate) struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("monorig-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    fn load(&self, links_and_joints: &str) -> Result<UrdfUnit, Error> {
        let path = self.0.join("unit.urdf");
        std::fs::write(
            &path,
            format!("<robot name=\"r\">\n{links_and_joints}\n</robot>"),
        )
        .unwrap();
        UrdfUnit::load(&path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn link(name: &str, inside: &str) -> String {
    format!("<link name=\"{name}\">{inside}</link>\n")
}

fn inertial(mass: f64, xyz: &str, [ixx, iyy, izz]: [f64; 3]) -> String {
    format!(
        "<inertial><origin xyz=\"{xyz}\"/><mass value=\"{mass}\"/>\
         <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" iyy=\"{iyy}\" iyz=\"0\" izz=\"{izz}\"/></inertial>"
    )
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{inside}</joint>\n"
    )
}

fn solid() -> String {
    inertial(1.0, "0 0 0", [1.0; 3])
}

const BOX: &str = "<visual><geometry><box size=\"1 1 1\"/></geometry></visual>";

#[test]
fn links_are_lumped_by_parallel_axes_through_turned_joints() {
    // Root 2 kg at the origin; child frame at (1, 0, 0) turned 90° about z, its 3 kg at child (0, 2, 0) = root (−1, 0,
    // 0). Masses at x = 0 and x = −1: centre x = −0.6. Child J = diag(1, 2, 2.5) turned: diag(2, 1, 2.5). J = diag(1+2,
    // 1+1 + 2·0.36 + 3·0.16, 1+2.5 + 1.2) = diag(3, 3.2, 4.7).
    let folder = Folder::new("lump");
    let text = link("a", &inertial(2.0, "0 0 0", [1.0; 3]))
        + &link("b", &inertial(3.0, "0 2 0", [1.0, 2.0, 2.5]))
        + &joint(
            "j",
            "revolute",
            "a",
            "b",
            "<origin xyz=\"1 0 0\" rpy=\"0 0 1.5707963267948966\"/><limit velocity=\"1\"/>",
        );
    let unit = folder.load(&text).unwrap();
    assert_eq!(unit.bodies.len(), 1);
    let m = unit.bodies[0].mass;
    assert!((m.mass_kg - 5.0).abs() < 1e-12);
    assert!((m.com - Vector3::new(-0.6, 0.0, 0.0)).norm() < 1e-12);
    let by_hand = Matrix3::from_diagonal(&Vector3::new(3.0, 3.2, 4.7));
    assert!((m.inertia - by_hand).norm() < 1e-12, "{}", m.inertia);
}

#[test]
fn roll_pitch_yaw_turn_about_fixed_axes_in_this_order() {
    let [r, p, y] = [0.3, -0.7, 1.9];
    let about = |angle: f64, axis| nalgebra::Rotation3::from_axis_angle(&axis, angle);
    let right =
        about(y, Vector3::z_axis()) * about(p, Vector3::y_axis()) * about(r, Vector3::x_axis());
    assert!((rotation([r, p, y]).to_rotation_matrix().matrix() - right.matrix()).norm() < 1e-14);
}

#[test]
fn a_floating_joint_starts_a_body_and_frames_need_no_mass() {
    let folder = Folder::new("floating");
    let text = link("a", &solid())
        + &link("mid", "")
        + &link("b", &solid())
        + &link("imu_link", "")
        + &joint("j1", "fixed", "a", "mid", "<origin xyz=\"1 0 0\"/>")
        + &joint("j2", "floating", "mid", "b", "<origin xyz=\"0 0 2\"/>")
        + &joint("j3", "fixed", "b", "imu_link", "<origin xyz=\"0 3 0\"/>");
    let unit = folder.load(&text).unwrap();
    assert_eq!(unit.bodies.len(), 2);
    assert_eq!(
        unit.bodies[1].pose.translation.vector,
        Vector3::new(1.0, 0.0, 2.0)
    );
    let imu = unit.place("imu_link").unwrap();
    assert_eq!(
        (imu.body, imu.pose.translation.vector),
        (1, Vector3::new(0.0, 3.0, 0.0))
    );
    assert!(unit.bodies.iter().all(|b| b.mass.mass_kg == 1.0));
}

#[test]
fn every_fault_of_a_tree_is_told_with_its_place() {
    let (a, b, c) = (
        link("a", &solid()),
        link("b", &solid()),
        link("c", &solid()),
    );
    let fixed = |name, parent, child| joint(name, "fixed", parent, child, "");
    let bad = |inside: &str| link("a", inside);
    let wheel = |axis: &str, limit: &str, inside: &str| {
        a.clone()
            + &link("w", inside)
            + &joint(
                "axle",
                "continuous",
                "a",
                "w",
                &format!("<axis xyz=\"{axis}\"/><limit {limit}/>"),
            )
    };
    let good = "effort=\"1\" velocity=\"1\"";
    let off_axle = solid()
        + "<visual><origin xyz=\"0.1 0 0\"/><geometry><cylinder radius=\"1\" length=\"1\"/></geometry></visual>";
    let mesh = |file: &str, scale: &str| {
        bad(&(solid()
            + &format!(
                "<visual><geometry><mesh filename=\"{file}\" {scale}/></geometry></visual>"
            )))
    };
    let cases: Vec<(String, &str, &str)> = vec![
        (String::new(), "the file has no link", ""),
        ("<a>".repeat(1_000), "nested", ""),
        ("<a>".repeat(300_000), "far too many tags", ""),
        ("<link".into(), "does not close", ""),
        (a.clone() + &a, "two links have this name", "link `a`"),
        (
            a.clone() + &b + &fixed("j", "a", "b") + &fixed("j", "b", "a"),
            "two joints have this name",
            "joint `j`",
        ),
        (
            a.clone() + &fixed("j", "a", "nowhere"),
            "no link `nowhere`",
            "joint `j`",
        ),
        (
            a.clone() + &fixed("j", "nowhere", "a"),
            "no link `nowhere`",
            "joint `j`",
        ),
        (a.clone() + &b, "several roots: a, b", ""),
        (
            a.clone() + &b + &fixed("j", "a", "b") + &fixed("k", "b", "a"),
            "cycle",
            "",
        ),
        (a.clone() + &fixed("j", "a", "a"), "cycle", ""),
        (
            a.clone() + &b + &c + &fixed("j", "b", "c") + &fixed("k", "c", "b"),
            "cycle that does not reach the root",
            "link `b`",
        ),
        (
            a.clone() + &b + &c + &fixed("j", "a", "c") + &fixed("k", "b", "c"),
            "already the child of joint `j`",
            "joint `k`",
        ),
        (
            a.clone() + &b + &joint("j", "planar", "a", "b", ""),
            "planar",
            "joint `j`",
        ),
        (bad(BOX), "<inertial> is missing", "link `a`"),
        (bad(""), "has no mass", "link `a`"),
        (
            bad(&inertial(0.0, "0 0 0", [1.0; 3])),
            "mass 0 kg",
            "link `a`",
        ),
        (
            bad(&inertial(-2.0, "0 0 0", [1.0; 3])),
            "mass -2 kg",
            "link `a`",
        ),
        (
            bad(&inertial(f64::NAN, "0 0 0", [1.0; 3])),
            "mass NaN kg",
            "link `a`",
        ),
        (
            bad(&inertial(1.0, "0 0 0", [1.0, 1.0, 2.5])),
            "triangle inequality",
            "link `a`",
        ),
        (
            bad(&inertial(1.0, "0 0 0", [1.0, 0.0, 1.0])),
            "not positive definite",
            "link `a`",
        ),
        (
            bad(&inertial(1.0, "0 inf 0", [1.0; 3])),
            "not finite",
            "link `a`",
        ),
        (
            bad(&inertial(1e10, "0 0 0", [1.0; 3])),
            "beyond 1e9",
            "link `a`",
        ),
        (
            bad(&(solid() + "<visual><geometry><box size=\"1 0 1\"/></geometry></visual>")),
            "shape measures",
            "link `a`",
        ),
        (
            bad(&(solid()
                + "<visual><geometry><capsule radius=\"1\" length=\"1\"/></geometry></visual>")),
            "capsules",
            "link `a`",
        ),
        (mesh("gone.stl", ""), "is missing", "link `a`"),
        (mesh("gone.dae", ""), "not an .stl file", "link `a`"),
        (
            mesh("gone.stl", "scale=\"1 0 1\""),
            "mesh scale",
            "link `a`",
        ),
        (
            wheel("0 0 1", good, ""),
            "needs mass and inertia",
            "joint `axle`",
        ),
        (
            wheel("0 0 0", good, &solid()),
            "no direction",
            "joint `axle`",
        ),
        (
            wheel("0 1 0", good, &solid()),
            "not upright",
            "joint `axle`",
        ),
        (
            wheel("0 0 1", "effort=\"0\" velocity=\"1\"", &solid()),
            "needs its limits",
            "joint `axle`",
        ),
        (
            wheel("0 0 1", good, &off_axle),
            "not centred on its axle",
            "link `w`",
        ),
    ];
    let folder = Folder::new("faults");
    for (text, message, place) in cases {
        let error = folder
            .load(&text)
            .err()
            .unwrap_or_else(|| panic!("accepted: {text}"))
            .to_string();
        assert!(
            error.contains(message) && error.contains(place),
            "wanted `{message}` at `{place}`, got: {error}"
        );
    }
}

#[test]
fn an_error_points_at_its_line() {
    let folder = Folder::new("line");
    let text = link("a", &solid()) + &link("b", BOX) + &joint("j", "fixed", "a", "b", "");
    let Err(Error::Input(e)) = folder.load(&text) else {
        panic!("accepted")
    };
    assert_eq!((e.line, e.column), (Some(3), Some(1)));
}
