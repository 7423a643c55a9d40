//! The track: the rail coloured by its slope, the roadway below it, chainage marks, zones, and the plan of the whole.

use crate::colours::of_grade;
use crate::origin::{Origin, plan_point, single};
use crate::stream::{MessageStream, entity};
use monorig_sim::error::Error;
use monorig_sim::rail::RailFrame;
use monorig_sim::record::Layout;
use nalgebra::Vector3;
use re_sdk_types::archetypes::{LineStrips2D, LineStrips3D, Mesh3D, Points2D, Points3D};
use re_sdk_types::components::{Color, Radius};

/// Frames of rail in one mesh: long rails stay quick to draw, since what is out of sight is left out.
const FRAMES_PER_MESH: usize = 200;
const LINE: [u8; 3] = [110, 120, 140];
const GROUND: [u8; 3] = [42, 46, 54];
const GRID: [u8; 3] = [78, 84, 96];
const MARK: [u8; 3] = [200, 205, 215];
const ZONE: [u8; 3] = [190, 90, 220];
/// Between two marks, m.
const MARK_M: f64 = 10.0;
/// More marks than this have no label, but every tenth: they would hide the picture.
const MAX_LABELS: usize = 60;
/// Half the width of a roadway, m.
const HALF_WIDTH_M: f64 = 2.2;
/// Floor of a roadway below the rail, m; below the lane of a car.
const FLOOR_M: f64 = 3.2;
const LANE_M: f64 = 0.03;
/// Height of labels and zones over the rail, m: labels do not hide the train.
const ABOVE_M: f64 = 0.9;

/// Everything of the track. It stands still.
pub fn log(stream: &mut MessageStream, layout: &Layout<'_>, origin: &Origin) -> Result<(), Error> {
    let frames = layout.rail;
    if frames.len() < 2 {
        return Ok(());
    }
    let car = layout
        .channels
        .iter()
        .any(|c| c.path.starts_with("truth/road/"));
    let floor_m = if car { LANE_M } else { FLOOR_M };
    line(stream, frames, origin)?;
    rail(stream, frames, layout.profile, origin)?;
    ground(stream, frames, floor_m, origin)?;
    marks(stream, frames, origin)?;
    zones(stream, layout, origin)?;
    plan(stream, layout, origin)
}

fn line(stream: &mut MessageStream, frames: &[RailFrame], origin: &Origin) -> Result<(), Error> {
    let line = frames.iter().map(|f| origin.point(&f.p));
    stream.fixed(
        entity(["world", "track", "line"]),
        &LineStrips3D::new([line.collect::<Vec<_>>()])
            .with_colors([colour(LINE)])
            .with_radii([Radius::new_ui_points(1.0)]),
    )
}

/// The beam, coloured by its slope.
fn rail(
    stream: &mut MessageStream,
    frames: &[RailFrame],
    profile: &[[f64; 2]],
    origin: &Origin,
) -> Result<(), Error> {
    if profile.len() < 3 {
        return Ok(());
    }
    for (i, frames) in pieces(frames).enumerate() {
        let sweep = sweep(frames, profile, origin);
        let mesh = Mesh3D::new(sweep.positions)
            .with_vertex_normals(sweep.normals)
            .with_vertex_colors(sweep.colours)
            .with_triangle_indices(sweep.triangles);
        stream.fixed(
            entity(["world", "track", "rail", &format!("{i:04}")]),
            &mesh,
        )?;
    }
    Ok(())
}

/// Parts of the rail; neighbours share a frame, so that there is no gap.
fn pieces(frames: &[RailFrame]) -> impl Iterator<Item = &[RailFrame]> {
    (0..frames.len() - 1).step_by(FRAMES_PER_MESH).map(|first| {
        let last = (first + FRAMES_PER_MESH).min(frames.len() - 1);
        &frames[first..=last]
    })
}

/// The floor of the roadway with a line across every 10 m of chainage.
fn ground(
    stream: &mut MessageStream,
    frames: &[RailFrame],
    floor_m: f64,
    origin: &Origin,
) -> Result<(), Error> {
    let edges = |f: &RailFrame| {
        let left = Vector3::new(f.l.x, f.l.y, 0.0);
        let left = left.try_normalize(1e-9).unwrap_or(Vector3::y()) * HALF_WIDTH_M;
        let middle = f.p - floor_m * Vector3::z();
        [
            origin.point(&(middle + left)),
            origin.point(&(middle - left)),
        ]
    };
    for (i, frames) in pieces(frames).enumerate() {
        let positions: Vec<_> = frames.iter().flat_map(edges).collect();
        let quads = 0..frames.len() as u32 - 1;
        let triangles = quads.flat_map(|k| {
            let a = 2 * k;
            [[a, a + 1, a + 2], [a + 1, a + 3, a + 2]]
        });
        let up = vec![[0.0, 0.0, 1.0]; positions.len()];
        let mesh = Mesh3D::new(positions)
            .with_vertex_normals(up)
            .with_triangle_indices(triangles)
            .with_albedo_factor(*colour(GROUND));
        stream.fixed(entity(["world", "ground", &format!("{i:04}")]), &mesh)?;
    }
    let across = at_marks(frames).map(|f| edges(f).to_vec());
    let sides = [0, 1].map(|side| frames.iter().map(|f| edges(f)[side]).collect::<Vec<_>>());
    let grid = LineStrips3D::new(across.chain(sides))
        .with_colors([colour(GRID)])
        .with_radii([Radius::new_ui_points(0.8)]);
    stream.fixed(entity(["world", "ground", "grid"]), &grid)
}

/// The frames at chainages 10 m, 20 m …
fn at_marks(frames: &[RailFrame]) -> impl Iterator<Item = &RailFrame> {
    let (first, last) = match frames {
        [first, .., last] => (first.s, last.s),
        _ => (0.0, 0.0),
    };
    let numbers = (first / MARK_M).ceil() as i64..=(last / MARK_M).floor() as i64;
    numbers.filter_map(move |n| frames.get(index_at(frames, n as f64 * MARK_M)))
}

/// Index of the first frame at or behind a chainage, m.
fn index_at(frames: &[RailFrame], chainage_m: f64) -> usize {
    let index = frames.partition_point(|f| f.s < chainage_m - 1e-6);
    index.min(frames.len().saturating_sub(1))
}

fn marks(stream: &mut MessageStream, frames: &[RailFrame], origin: &Origin) -> Result<(), Error> {
    let all: Vec<&RailFrame> = at_marks(frames).collect();
    let every = if all.len() > MAX_LABELS { 10 } else { 1 };
    let labelled: Vec<_> = all.iter().step_by(every).collect();
    let above = |f: &RailFrame| origin.point(&(f.p + ABOVE_M * f.u));
    let ticks = all.iter().map(|f| vec![origin.point(&f.p), above(f)]);
    let ticks = LineStrips3D::new(ticks)
        .with_colors([colour(MARK)])
        .with_radii([0.02]);
    stream.fixed(entity(["world", "track", "marks"]), &ticks)?;
    let labels = labelled.iter().map(|f| format!("{:.0} m", f.s));
    let labels = Points3D::new(labelled.iter().map(|f| above(f)))
        .with_labels(labels)
        .with_show_labels(true)
        .with_colors([colour(MARK)])
        .with_radii([0.03]);
    stream.fixed(entity(["world", "track", "chainage"]), &labels)
}

/// Stretches of rail on which a part of the scenario acts.
fn zones(stream: &mut MessageStream, layout: &Layout<'_>, origin: &Origin) -> Result<(), Error> {
    if layout.zones.is_empty() {
        return Ok(());
    }
    let strips = layout.zones.iter().map(|zone| {
        let [from, to] = [zone.from_m, zone.to_m].map(|s| index_at(layout.rail, s));
        let frames = layout.rail.get(from..=to).unwrap_or_default().iter();
        let above = frames.map(|f| origin.point(&(f.p + ABOVE_M / 4.0 * f.u)));
        above.collect::<Vec<_>>()
    });
    let strips = LineStrips3D::new(strips)
        .with_colors([colour(ZONE)])
        .with_radii([0.06])
        .with_labels(layout.zones.iter().map(|z| z.what.as_str()));
    stream.fixed(entity(["world", "track", "zones"]), &strips)
}

/// The track from above, with its start.
fn plan(stream: &mut MessageStream, layout: &Layout<'_>, origin: &Origin) -> Result<(), Error> {
    let on_plan = |f: &RailFrame| plan_point(origin, &f.p.into());
    // one strip between two frames, so that each has the colour of its slope
    let pairs = layout.rail.windows(2);
    let strips = pairs
        .clone()
        .map(|pair| pair.iter().map(on_plan).collect::<Vec<_>>());
    let colours = pairs.map(|pair| slope_colour(&pair[0]));
    let line = LineStrips2D::new(strips)
        .with_colors(colours)
        .with_radii([Radius::new_ui_points(1.5)]);
    stream.fixed(entity(["plan", "track"]), &line)?;
    let ends = [layout.rail.first(), layout.rail.last()];
    let ends: Vec<&RailFrame> = ends.into_iter().flatten().collect();
    let labels = ends.iter().map(|f| format!("{:.0} m", f.s));
    let ends = Points2D::new(ends.iter().map(|f| on_plan(f)))
        .with_labels(labels)
        .with_colors([colour(MARK)])
        .with_radii([Radius::new_ui_points(3.0)]);
    stream.fixed(entity(["plan", "ends"]), &ends)
}

/// The middle of the plan and half of the side of a square round it, m.
pub fn plan_square(layout: &Layout<'_>, origin: &Origin) -> ([f32; 2], f32) {
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for f in layout.rail {
        for (k, x) in plan_point(origin, &f.p.into()).into_iter().enumerate() {
            low[k] = low[k].min(x);
            high[k] = high[k].max(x);
        }
    }
    if layout.rail.is_empty() {
        return ([0.0; 2], 10.0);
    }
    let middle = [0, 1].map(|k| (low[k] + high[k]) / 2.0);
    let side = (high[0] - low[0]).max(high[1] - low[1]).max(10.0);
    (middle, 0.55 * side)
}

fn slope_colour(frame: &RailFrame) -> Color {
    let [r, g, b, a] = of_grade(frame.t.z.clamp(-1.0, 1.0).asin());
    Color::from_unmultiplied_rgba(r, g, b, a)
}

fn colour([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}

/// A surface of triangles.
struct Sweep {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<Color>,
    triangles: Vec<[u32; 3]>,
}

/// A closed outline (l, u), counter-clockwise, moved along the frames. Each side of the outline has vertices of its
/// own, so that edges stay sharp; normals and the order of the corners point outwards.
fn sweep(frames: &[RailFrame], outline: &[[f64; 2]], origin: &Origin) -> Sweep {
    let mut out = Sweep {
        positions: Vec::new(),
        normals: Vec::new(),
        colours: Vec::new(),
        triangles: Vec::new(),
    };
    let sides = outline.len() as u32;
    for (row, f) in frames.iter().enumerate() {
        let colour = slope_colour(f);
        for i in 0..outline.len() {
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            let normal = f.l * (b[1] - a[1]) - f.u * (b[0] - a[0]);
            let normal = normal.try_normalize(1e-12).unwrap_or(f.u);
            for [l, u] in [a, b] {
                out.positions.push(origin.point(&(f.p + f.l * l + f.u * u)));
                out.normals.push(single(&normal));
                out.colours.push(colour);
            }
        }
        if row + 1 < frames.len() {
            for side in 0..sides {
                let a = 2 * (row as u32 * sides + side);
                let (b, a_next, b_next) = (a + 1, a + 2 * sides, a + 2 * sides + 1);
                out.triangles.push([a, b, a_next]);
                out.triangles.push([b, b_next, a_next]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(n: usize, step: f64) -> Vec<RailFrame> {
        (0..n)
            .map(|i| RailFrame {
                s: i as f64 * step,
                p: Vector3::new(i as f64 * step, 0.0, 0.0),
                t: Vector3::x(),
                l: Vector3::y(),
                u: Vector3::z(),
                k: Vector3::zeros(),
            })
            .collect()
    }

    fn vec(p: [f32; 3]) -> Vector3<f64> {
        Vector3::new(p[0] as f64, p[1] as f64, p[2] as f64)
    }

    /// Area = perimeter × length; volume by the divergence theorem = area of the outline × length less the open ends,
    /// which lie in planes through x = 0 and x = L: ∮ x n_x vanishes on the sides, so y n_y and z n_z give it each.
    #[test]
    fn sweep_has_the_area_and_encloses_the_volume_of_the_beam() {
        let outline = [
            [-0.5, -0.2],
            [0.5, -0.2],
            [0.1, 0.0],
            [0.5, 0.2],
            [-0.5, 0.2],
            [-0.1, 0.0],
        ];
        let out = sweep(&straight(5, 0.75), &outline, &Origin::at(Vector3::zeros()));
        let (mut area, mut volume) = (0.0, 0.0);
        for t in &out.triangles {
            let [a, b, c] = t.map(|i| vec(out.positions[i as usize]));
            let n = (b - a).cross(&(c - a)) / 2.0;
            area += n.norm();
            volume += n.y * (a.y + b.y + c.y) / 3.0;
            for i in t {
                let normal = vec(out.normals[*i as usize]);
                assert!(
                    (normal.dot(&n.normalize()) - 1.0).abs() < 1e-6,
                    "normal points elsewhere"
                );
            }
        }
        let side = |i: usize| {
            let (a, b): ([f64; 2], [f64; 2]) = (outline[i], outline[(i + 1) % 6]);
            (a, b)
        };
        let perimeter: f64 = (0..6)
            .map(side)
            .map(|(a, b)| (b[0] - a[0]).hypot(b[1] - a[1]))
            .sum();
        let section: f64 = (0..6)
            .map(side)
            .map(|(a, b)| (a[0] * b[1] - b[0] * a[1]) / 2.0)
            .sum();
        assert!((area - 3.0 * perimeter).abs() < 1e-5);
        assert!((volume - 3.0 * section).abs() < 1e-5);
    }

    #[test]
    fn marks_stand_at_whole_tens_of_metres() {
        let marks: Vec<f64> = at_marks(&straight(90, 0.5)).map(|f| f.s).collect();
        assert_eq!(marks, [0.0, 10.0, 20.0, 30.0, 40.0]);
    }
}
