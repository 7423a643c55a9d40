//! Clearance: least distance of moving shapes to fixed ones, for the record and to enable collision detection only when
//! needed.
//!
//! Touching is rare and costs five times as much as everything else in a step, so colliders are disabled while nothing
//! can touch.

use parry3d::bounding_volume::{Aabb, BoundingVolume};
use parry3d::math::{Pose, Vector};
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query;
use parry3d::shape::SharedShape;

/// Fixed shapes in the world with a bounding-volume tree for distance queries.
pub struct FixedShapes {
    shapes: Vec<(Pose, SharedShape)>,
    boxes: Vec<Aabb>,
    tree: Bvh,
}

impl FixedShapes {
    /// Makes the set of fixed shapes.
    pub fn new(shapes: Vec<(Pose, SharedShape)>) -> Self {
        let boxes: Vec<Aabb> = shapes
            .iter()
            .map(|(pose, s)| s.compute_aabb(pose))
            .collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::default(), &boxes);
        Self {
            shapes,
            boxes,
            tree,
        }
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Least distance of a shape to any of these, m, where it is below `reach`; else `reach`.
    pub fn distance(&self, pose: &Pose, shape: &SharedShape, reach: f64) -> f64 {
        if self.shapes.is_empty() {
            return reach;
        }
        let own = shape.compute_aabb(pose);
        let wide = own.loosened(reach);
        let mut least = reach;
        for i in self.tree.intersect_aabb(&wide) {
            let i = i as usize;
            if gap(&own, &self.boxes[i]) < least {
                let (p, s) = &self.shapes[i];
                if let Ok(d) = query::distance(pose, shape.as_ref(), p, s.as_ref()) {
                    least = least.min(d.distance);
                }
            }
        }
        least
    }
}

/// Distance of two boxes, m.
fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (a.mins - b.maxs)
        .max(b.mins - a.maxs)
        .max(Vector::ZERO)
        .length()
}
