//! Places the obstacles and roadway walls of a scenario as boxes in the world.

use crate::config::scenario::Scenario;
use crate::error::Error;
use crate::plant::obstacles::ObstacleBox;
use crate::rail::Rail;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// The obstacles of a scenario, each placed on the rail's frame at its chainage, and the walls of its roadway.
pub fn place(scenario: &Scenario, rail: &Rail) -> Result<Vec<ObstacleBox>, Error> {
    let mut boxes = Vec::new();
    for (i, o) in scenario.file.obstacles.iter().enumerate() {
        if o.at_m.get() > rail.length() {
            return Err(scenario.error(
                format!("obstacles[{i}].at_m"),
                format!(
                    "the obstacle is at {} m, beyond the end of the track",
                    o.at_m.get()
                ),
                format!("a chainage from 0 to {} m", rail.end_m()),
            ));
        }
        let size = Vector3::new(o.size_m[0].get(), o.size_m[1].get(), o.size_m[2].get());
        boxes.push(box_at(
            rail,
            o.at_m.get(),
            [o.left_m.get(), o.up_m.get()],
            size,
        ));
    }
    if let Some(r) = &scenario.file.roadway {
        let (width, above, below) = (r.width_m.get(), r.above_m.get(), r.below_m.get());
        let height = above + below;
        let middle = (above - below) / 2.0;
        let wall = WALL_THICKNESS_M;
        let pieces = libm::ceil(rail.length() / WALL_PIECE_M) as usize;
        for i in 0..pieces {
            let at = (i as f64 + 0.5) * WALL_PIECE_M;
            let long = Vector3::new(WALL_PIECE_M, wall, height);
            for side in [-1.0, 1.0] {
                boxes.push(box_at(
                    rail,
                    at,
                    [side * (width + wall) / 2.0, middle],
                    long,
                ));
            }
            boxes.push(box_at(
                rail,
                at,
                [0.0, -below - wall / 2.0],
                Vector3::new(WALL_PIECE_M, width, wall),
            ));
        }
    }
    Ok(boxes)
}

/// Walls and floor follow the rail in pieces of this length, m.
const WALL_PIECE_M: f64 = 2.0;
/// Thickness of walls and floor, m.
const WALL_THICKNESS_M: f64 = 0.1;

/// A box on the rail's frame at chainage `s`, its middle off the rail's line by `off` (left, up), m.
fn box_at(rail: &Rail, s: f64, off: [f64; 2], size: Vector3<f64>) -> ObstacleBox {
    let f = rail.frame(s);
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[f.t, f.l, f.u]));
    let at = f.p + f.l * off[0] + f.u * off[1];
    ObstacleBox {
        pose: Isometry3::from_parts(at.into(), UnitQuaternion::from_rotation_matrix(&turn)),
        size,
    }
}
