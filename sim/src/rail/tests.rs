//! The curve: position, frames, projection, joints, mesh; what is read from files is in `files`.

mod files;

use super::*;
use crate::config::track::TrackFile;
use crate::testing::{asset, profile, try_track as rail};
use std::path::Path;

fn load(name: &str) -> Rail {
    Rail::load(&asset("tracks").join(name)).unwrap()
}

const TRACKS: [&str; 7] = [
    "level_200m.yaml",
    "straight_15deg.yaml",
    "steep_30deg.yaml",
    "liu2023_section1.yaml",
    "liu2023_section2.yaml",
    "liu2023_vehicle_test.yaml",
    "winding.yaml",
];

/// Numbers from −1 to 1 that look random (a linear congruence, Knuth's MMIX constants).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// The independent description of a rail: (length, curvature at its begin, at its end) per stretch, worked by hand.
struct Oracle(Vec<(f64, f64, f64, f64, f64)>);

impl Oracle {
    fn new(stretches: impl Iterator<Item = (f64, f64, f64)>) -> Self {
        let (mut s, mut angle) = (0.0, 0.0);
        Self(
            stretches
                .map(|(length, k0, k1)| {
                    let now = (s, angle, k0, (k1 - k0) / length, length);
                    s += length;
                    angle += 0.5 * (k0 + k1) * length;
                    now
                })
                .collect(),
        )
    }

    fn angle(&self, s: f64) -> f64 {
        let i = self.0.partition_point(|x| x.0 <= s).max(1) - 1;
        let (from, angle, k, slope, length) = self.0[i];
        let x = (s - from).min(length);
        angle + k * x + 0.5 * slope * x * x
    }

    fn ends(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|x| x.0 + x.4)
    }
}

/// 10 km of 4 m arcs left and right with clothoids, and 10 m crests and sags up to ±20°, against composite Simpson
/// quadrature with 4 mm steps (its own error here is below 1e-11 m).
#[test]
fn ten_kilometres_agree_with_a_fine_quadrature() {
    let r = rail(
        "horizontal:
  - kind: repeat
    times: 500
    elements:
      - {kind: line, length_m: 2}
      - {kind: arc, radius_m: 4, angle_deg: 90, easement_m: 2}
      - {kind: clothoid, length_m: 1.5, to_radius_m: -4}
      - {kind: arc, length_m: 5, angle_deg: -71.61972439135291}
      - {kind: clothoid, length_m: 1.5}
vertical:
  - kind: repeat
    times: 500
    elements:
      - {kind: arc, to_grade_deg: 20, radius_m: 10, easement_m: 1}
      - {kind: grade, length_m: 3}
      - {kind: transition, to_grade_deg: -20, radius_m: 10}
      - {kind: arc, to_grade_deg: 0, length_m: 4}
",
    )
    .unwrap();
    let a = 90_f64.to_radians();
    let h = Oracle::new((0..500).flat_map(|_| {
        [
            (2.0, 0.0, 0.0),
            (2.0, 0.0, 0.25),
            (4.0 * a - 2.0, 0.25, 0.25),
            (2.0, 0.25, 0.0),
            (1.5, 0.0, -0.25),
            (5.0, -0.25, -0.25),
            (1.5, -0.25, 0.0),
        ]
    }));
    let g = 20_f64.to_radians();
    let v = Oracle::new((0..500).flat_map(|_| {
        [
            (1.0, 0.0, 0.1),
            (10.0 * g - 1.0, 0.1, 0.1),
            (1.0, 0.1, 0.0),
            (3.0, 0.0, 0.0),
            (20.0 * g, 0.0, -0.1),
            (20.0 * g, -0.1, 0.0),
            (4.0, g / 4.0, g / 4.0),
        ]
    }));
    assert!(r.length() > 10_000.0);
    let mut borders: Vec<f64> = h.ends().chain(v.ends()).collect();
    borders.sort_by(f64::total_cmp);
    let tangent = |s: f64| {
        let (psi, theta) = (h.angle(s), v.angle(s));
        Vector3::new(
            theta.cos() * psi.cos(),
            theta.cos() * psi.sin(),
            theta.sin(),
        )
    };
    let (mut p, mut from, mut worst) = (Vector3::zeros(), 0.0, 0.0_f64);
    let mut cursor = Cursor::default();
    for border in borders {
        // half way and at the border, so that insides of nodes are looked at too
        for to in [0.5 * (from + border), border] {
            let n = ((to - from) / 0.004).ceil().max(1.0);
            let step = (to - from) / n;
            let sum = (0..n as usize).fold(Vector3::zeros(), |sum, i| {
                let s = from + step * i as f64;
                sum + tangent(s) + tangent(s + 0.5 * step) * 4.0 + tangent(s + step)
            });
            p += sum * (step / 6.0);
            worst = worst.max((r.frame_at(to, &mut cursor).p - p).norm());
            from = to;
        }
    }
    println!("largest distance over {:.0} m: {worst:e} m", r.length());
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn frames_are_right_handed_and_made_of_derivatives() {
    let mut worst = 0.0_f64;
    for name in TRACKS {
        let r = load(name);
        let mut draw = Draw(7);
        for _ in 0..2000 {
            let s = (0.5 + 0.5 * draw.next()) * r.length();
            let f = r.frame(s);
            let (psi, theta) = (r.heading(s), r.grade(s));
            let t = Vector3::new(
                theta.cos() * psi.cos(),
                theta.cos() * psi.sin(),
                theta.sin(),
            );
            let l = Vector3::new(-psi.sin(), psi.cos(), 0.0);
            worst = worst
                .max((f.t - t).norm())
                .max((f.l - l).norm())
                .max((f.u - t.cross(&l)).norm());
            assert!(worst < 1e-11, "{name} at {s}: {worst:e}");
            let k = f.l * (r.curvature_horizontal(s) * theta.cos()) + f.u * r.curvature_vertical(s);
            assert!(
                (f.k - k).norm() < 1e-8,
                "{name} at {s}: {}",
                (f.k - k).norm()
            );
            let h = 1e-4;
            let difference = (r.frame(s + h).p - r.frame(s - h).p) / (2.0 * h);
            assert!(
                (difference - f.t).norm() < 1e-4 * (0.26 + 1e-6),
                "dp/ds at {s}"
            );
        }
    }
}

#[test]
fn projecting_a_point_of_a_cross_section_gives_its_chainage() {
    let joints = rail("vertical: [{kind: arc, radius_m: 30, to_grade_deg: 40}]\njoints: {every_m: 2.5, kink_deg: 0.3, step_m: 0.001}").unwrap();
    for (r, size) in TRACKS
        .map(load)
        .iter()
        .map(|r| (r, 0.5))
        .chain([(&joints, 0.01)])
    {
        let mut draw = Draw(11);
        for _ in 0..3000 {
            let s = (0.5 + 0.5 * draw.next()) * r.length();
            let f = r.frame(s);
            let p = f.p + f.l * (size * draw.next()) + f.u * (size * draw.next());
            let near = if size < 0.1 { 0.005 } else { 0.3 };
            let mut cursor = Cursor::at(s + near * draw.next());
            assert!(
                (r.project(&p, &mut cursor) - s).abs() < 1e-9,
                "{} at {s}",
                r.name
            );
            assert!(
                (r.project(&p, &mut cursor.clone()) - cursor.s).abs() < 1e-9,
                "once more changes nothing"
            );
        }
    }
}

/// A point well below the rail, beyond the radius of curvature of a step, goes along without a jump at the joints.
#[test]
fn a_point_below_a_jointed_rail_has_one_chainage() {
    let r = rail("horizontal: [{kind: line, length_m: 30}]\njoints: {every_m: 3, kink_deg: 0.1, step_m: 0.0005}").unwrap();
    let mut cursor = Cursor::at(1.0);
    let mut last = None;
    for i in 0..28_000 {
        let s = 1.0 + 0.001 * f64::from(i);
        let p = Vector3::new(s, 0.0, -0.5);
        let f = r.track_without_steps(&p, &mut cursor);
        // 0.5 m times the angle, and how fast the angle turns in a kink
        assert!(
            (f.s - s).abs() < 0.5 * 0.1_f64.to_radians() + 1e-4,
            "{} at {s}",
            f.s
        );
        assert!(f.t.z.abs() < 0.06_f64.to_radians());
        if let Some(last) = last {
            let moved: f64 = f.s - last;
            assert!((0.9e-3..1.1e-3).contains(&moved), "{moved} m at {s}");
        }
        last = Some(f.s);
    }
}

#[test]
fn tracking_agrees_with_the_converged_projection() {
    let joints = rail("horizontal: [{kind: arc, radius_m: 4, angle_deg: 300, easement_m: 2}]\njoints: {every_m: 2, kink_deg: 0.2, step_m: 0.001}").unwrap();
    for (r, size) in TRACKS
        .map(load)
        .iter()
        .map(|r| (r, 0.1))
        .chain([(&joints, 0.004)])
    {
        let mut draw = Draw(3);
        let mut worst = [0.0_f64; 3];
        for i in 0..20_000 {
            let s = (0.5 + 0.5 * draw.next()) * r.length();
            let f = r.frame(s);
            let p = f.p + f.l * (size * draw.next()) + f.u * (size * draw.next());
            // from a hair to two centimetres of movement since the last call
            let mut warm = Cursor::at(s + draw.next() * [1e-5, 1e-3, 5e-3, 2e-2][i % 4]);
            let ours = r.track(&p, &mut warm);
            let mut cursor = Cursor::at(s);
            let exact = r.project(&p, &mut cursor);
            let exact = r.frame_at(exact, &mut cursor);
            assert_eq!(ours.s, warm.s);
            worst[0] = worst[0]
                .max((ours.s - exact.s).abs())
                .max((ours.p - exact.p).norm());
            worst[1] = worst[1]
                .max((ours.t - exact.t).norm())
                .max((ours.u - exact.u).norm())
                .max((ours.l - exact.l).norm());
            // at a jump of curvature either side is right
            if (r.frame(s - 1e-6).k - r.frame(s + 1e-6).k).norm() < 1e-3 {
                worst[2] = worst[2].max((ours.k - exact.k).norm());
            }
        }
        println!(
            "{}: s, p {:.1e} m; t, l, u {:.1e}; k {:.1e} 1/m",
            r.name, worst[0], worst[1], worst[2]
        );
        assert!(
            worst[0] < 1e-9 && worst[1] < 1e-7 && worst[2] < 1e-4,
            "{}: {worst:?}",
            r.name
        );
    }
}

#[test]
fn beyond_its_ends_the_rail_goes_on_straight() {
    let r = load("winding.yaml");
    for (end, away) in [(0.0, -1.0), (r.length(), 1.0)] {
        let at = r.frame(end);
        for far in [0.01, 3.0, 1e4] {
            let f = r.frame(end + away * far);
            assert!(
                (f.p - (at.p + at.t * (away * far))).norm() < 1e-9
                    && f.t == at.t
                    && f.k.norm() == 0.0
            );
            let s = r.project(&(f.p + f.l * 0.1), &mut Cursor::at(end));
            assert!((s - f.s).abs() < 1e-9);
            assert!((r.track(&f.p, &mut Cursor::at(end)).p - f.p).norm() < 1e-9);
        }
    }
}

#[test]
fn nonsense_in_is_no_panic() {
    let r = load("steep_30deg.yaml");
    for s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
        let mut cursor = Cursor {
            s,
            node: usize::MAX,
            smooth: usize::MAX,
        };
        r.frame(s);
        r.track(&Vector3::new(s, 0.0, 0.0), &mut cursor);
        r.track(
            &Vector3::new(1.0, 0.0, 0.0),
            &mut Cursor {
                s,
                node: usize::MAX,
                smooth: usize::MAX,
            },
        );
        r.nearest(&Vector3::new(0.0, s, 0.0));
        let _ = (r.grade(s), r.heading(s), r.curvature_vertical(s));
    }
    assert_eq!(r.samples(0.0).len(), 2);
    assert_eq!(r.samples(f64::NAN).len(), 2);
}

#[test]
fn nearest_finds_its_place_without_a_hint() {
    let r = load("liu2023_vehicle_test.yaml");
    for i in 0..=100 {
        let f = r.frame(r.length() * f64::from(i) / 100.0);
        assert!((r.nearest(&(f.p + f.l * 0.3 - f.u * 0.2)).s - f.s).abs() < 1e-9);
    }
}

#[test]
fn samples_are_even_and_include_both_ends() {
    let r = load("level_200m.yaml");
    let s = r.samples(0.5);
    assert_eq!((s.len(), s[0].s, s[400].s), (401, 0.0, 200.0));
    assert!(s.windows(2).all(|w| (w[1].s - w[0].s - 0.5).abs() < 1e-9));
}

#[test]
fn the_start_moves_and_turns_the_whole_rail() {
    let body = "horizontal: [{kind: arc, radius_m: 4, angle_deg: 200}]\nvertical: [{kind: arc, radius_m: 20, to_grade_deg: 10}]";
    let a = rail(body).unwrap();
    let b = rail(&format!(
        "start: {{x_m: 1000, y_m: -20, z_m: 3, heading_deg: 90}}\n{body}"
    ))
    .unwrap();
    for f in a.samples(0.3) {
        let turned = Vector3::new(1000.0 - f.p.y, -20.0 + f.p.x, 3.0 + f.p.z);
        assert!((b.frame(f.s).p - turned).norm() < 1e-10);
    }
}

/// Joints: still an arc length, still one curve, and the alignment's own grade stays as it was.
#[test]
fn joints_disturb_the_curve_by_what_they_are() {
    let smooth = rail("horizontal: [{kind: line, length_m: 60}]").unwrap();
    let rough =
        rail("horizontal: [{kind: line, length_m: 60}]\njoints: {every_m: 3, step_m: 0.001}")
            .unwrap();
    for s in [1.0, 2.9, 4.0, 5.9, 10.0, 58.0] {
        assert_eq!(rough.grade(s), smooth.grade(s));
        let piece = (s / 3.0) as i32;
        let height = if piece % 2 == 1 { 0.001 } else { 0.0 };
        assert!(
            (rough.frame(s).p.z - height).abs() < 1e-5,
            "s = {s}: {}",
            rough.frame(s).p.z
        );
        assert!((rough.frame(s).p.x - s).abs() < 0.002);
    }
    let mut last = rough.frame(0.0);
    for f in rough.samples(1e-4) {
        assert!(
            (f.p - last.p).norm() <= f.s - last.s + 1e-12
                && (f.t - last.t).norm() < 24.0 * (f.s - last.s) + 1e-12
        );
        last = f;
    }
}

/// Every edge belongs to two triangles that run through it in opposite directions, and the volume is that of the sweep:
/// section area times length of the centroid's path, and the centroid is the rail's line (Pappus).
#[test]
fn the_mesh_is_closed_and_has_the_volume_of_the_sweep() {
    for name in ["winding.yaml", "level_200m.yaml"] {
        let r = load(name);
        let chunks = r.mesh(0.05, 50.0);
        let mut volume = 0.0;
        for m in &chunks {
            assert!(m.ends_m[1] - m.ends_m[0] <= 50.0 + 1e-9);
            let mut edges = std::collections::BTreeMap::new();
            let at = |i: u32| Vector3::from(m.vertices[i as usize]);
            for [a, b, c] in &m.triangles {
                for edge in [(a, b), (b, c), (c, a)] {
                    *edges.entry(edge).or_insert(0) += 1;
                }
                let o = at(0);
                volume += (at(*a) - o).cross(&(at(*b) - o)).dot(&(at(*c) - o)) / 6.0;
            }
            assert!(
                edges
                    .iter()
                    .all(|((a, b), n)| *n == 1 && edges.contains_key(&(*b, *a)))
            );
        }
        let expected = r.profile().unwrap().area() * r.length();
        assert!(
            (volume / expected - 1.0).abs() < 2e-4,
            "{name}: {volume} for {expected}"
        );
        assert_eq!(
            (chunks[0].ends_m[0], chunks[chunks.len() - 1].ends_m[1]),
            (0.0, r.length())
        );
    }
    // straight rail needs no sections inside
    assert_eq!(
        load("level_200m.yaml").mesh(0.05, 300.0)[0].vertices.len(),
        24
    );
}

#[test]
fn far_from_the_origin_nothing_is_lost_but_the_last_digits() {
    let body = "horizontal: [{kind: arc, radius_m: 4, angle_deg: 300, easement_m: 2}]\nvertical: [{kind: arc, radius_m: 20, to_grade_deg: 20}]";
    let near = rail(body).unwrap();
    let far = rail(&format!("start: {{x_m: 1e6, y_m: -1e6}}\n{body}")).unwrap();
    let offset = Vector3::new(1e6, -1e6, 0.0);
    for f in near.samples(0.37) {
        let g = far.frame(f.s);
        assert!(
            (g.p - offset - f.p).norm() < 1e-9
                && (g.t - f.t).norm() < 1e-15
                && (g.k - f.k).norm() < 1e-15
        );
        let p = g.p + g.l * 0.05 - g.u * 0.06;
        for away in [0.0, 0.003, 0.1] {
            assert!((far.track(&p, &mut Cursor::at(f.s - away)).s - f.s).abs() < 2e-9);
        }
    }
}
