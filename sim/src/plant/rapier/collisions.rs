//! Collisions of cabs, beam, load and drive units with rail and obstacles, and the clearance to obstacles.
//!
//! Touching is rare, and looking for it in every step costs several times as much as everything else in it. So
//! colliders sleep, and are woken by cheap distance checks.

use super::convert::{self, pose_to_rapier, shared_shape};
use crate::plant::obstacles::ObstacleBox;
use crate::plant::rapier::clearance::FixedShapes;
use crate::plant::train::body_state::BodyState;
use crate::rail::{Rail, profile::Profile};
use crate::train::Body;
use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::{
    ColliderBuilder, ColliderHandle, Group, InteractionGroups, InteractionTestMode, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle, SharedShape,
};

/// Margin: collisions are computed while a part of the train could come this close to another shape before the next
/// check. Checks are `CHECK_PERIOD_S` apart or farther, as far as distances up to the reach allow.
const COLLIDER_REACH_M: f64 = 0.3;
const COLLIDER_MARGIN_M: f64 = 0.01;
const CHECK_PERIOD_S: f64 = 0.02;
/// Upper bounds of the speed along the rail, and of the speed across it of suspended bodies, m/s.
const MAX_SPEED_MPS: f64 = 6.0;
const MAX_SWAY_MPS: f64 = 0.3;
/// Largest clearance that is computed, m.
const MAX_CLEARANCE_M: f64 = 5.0;
/// Friction of steel and rock where parts touch.
const FRICTION: f64 = 0.4;
/// Pieces of rail given to the collision detection, m.
const RAIL_PIECE_M: f64 = 2.0;
/// Distance of the cross-sections of their mesh, m.
const RAIL_STEP_M: f64 = 0.5;

const TRAIN: Group = Group::GROUP_1;
const LOAD: Group = Group::GROUP_2;
const RAIL: Group = Group::GROUP_3;
const OBSTACLES: Group = Group::GROUP_4;

/// A part of the train that can touch something.
struct ContactPart {
    body: usize,
    pose: Pose,
    shape: SharedShape,
    collider: ColliderHandle,
    suspended: bool,
}

impl ContactPart {
    /// Returns the present pose of the collider.
    fn placed(&self, bodies: &[BodyState]) -> Pose {
        convert::pose(&bodies[self.body]) * self.pose
    }
}

/// Colliders of the train, and the fixed shapes it can touch.
pub struct Collisions {
    parts: Vec<ContactPart>,
    rail_hull: FixedShapes,
    obstacles: FixedShapes,
    enabled: bool,
    next_check_s: f64,
}

impl Collisions {
    /// Insert rail and obstacles; the train's parts are added body by body.
    pub fn new(physics: &mut PhysicsWorld, rail: &Rail, obstacles: &[ObstacleBox]) -> Self {
        let (rail_hull, obstacles) = insert_fixed_shapes(physics, rail, obstacles);
        Self {
            parts: Vec::new(),
            rail_hull,
            obstacles,
            enabled: false,
            next_check_s: 0.0,
        }
    }

    /// Add the colliding shapes of body `index`.
    pub fn add(
        &mut self,
        physics: &mut PhysicsWorld,
        handle: RigidBodyHandle,
        index: usize,
        body: &Body,
        is_load: bool,
    ) {
        let suspended = body.stations.is_empty();
        let own = if is_load { LOAD } else { TRAIN };
        // Rail-bound bodies would collide with the rail for ever; suspended ones may touch it.
        let with = if suspended {
            OBSTACLES | RAIL
        } else {
            OBSTACLES
        };
        for shape in body.shapes.iter().filter(|s| s.collides) {
            let Some((s, turn)) = shared_shape(&shape.geometry) else {
                continue;
            };
            let pose = pose_to_rapier(&shape.pose) * turn;
            let collider = ColliderBuilder::new(s.clone())
                .position(pose)
                .density(0.0)
                .friction(FRICTION)
                .collision_groups(groups(own, with))
                .enabled(false);
            let collider =
                physics
                    .colliders
                    .insert_with_parent(collider, handle, &mut physics.bodies);
            self.parts.push(ContactPart {
                body: index,
                pose,
                shape: s,
                collider,
                suspended,
            });
        }
    }

    /// Enables the colliders if a contact is possible before the next check, else disables them.
    pub fn update_colliders(&mut self, physics: &mut PhysicsWorld, bodies: &[BodyState], t_s: f64) {
        if t_s < self.next_check_s {
            return;
        }
        let (mut to_blocks, mut to_rail) = (COLLIDER_REACH_M, COLLIDER_REACH_M);
        for part in &self.parts {
            let pose = part.placed(bodies);
            to_blocks = self.obstacles.distance(&pose, &part.shape, to_blocks);
            if part.suspended {
                to_rail = self.rail_hull.distance(&pose, &part.shape, to_rail);
            }
        }
        let wait = f64::min(
            (to_blocks - COLLIDER_MARGIN_M) / MAX_SPEED_MPS,
            (to_rail - COLLIDER_MARGIN_M) / MAX_SWAY_MPS,
        );
        self.next_check_s = t_s + wait.max(CHECK_PERIOD_S);
        let enabled = wait <= CHECK_PERIOD_S;
        if enabled != self.enabled {
            self.enabled = enabled;
            for part in &self.parts {
                if let Some(c) = physics.colliders.get_mut(part.collider) {
                    c.set_enabled(enabled);
                }
            }
        }
    }

    /// True if the contact solver is on: something could touch.
    pub fn enabled(&self) -> bool {
        self.enabled
    }

    /// Least distance to obstacles and walls, m; infinite when there are none within reach.
    pub fn clearance(&self, bodies: &[BodyState]) -> f64 {
        if self.obstacles.is_empty() {
            return f64::INFINITY;
        }
        let mut least = MAX_CLEARANCE_M;
        for part in &self.parts {
            least = self
                .obstacles
                .distance(&part.placed(bodies), &part.shape, least);
        }
        if least < MAX_CLEARANCE_M {
            least
        } else {
            f64::INFINITY
        }
    }
}

fn groups(of: Group, with: Group) -> InteractionGroups {
    InteractionGroups::new(of, with, InteractionTestMode::And)
}

/// The rail as a fixed body of mesh pieces, obstacles and walls as boxes; the same shapes for questions of distance.
fn insert_fixed_shapes(
    physics: &mut PhysicsWorld,
    rail: &Rail,
    obstacles: &[ObstacleBox],
) -> (FixedShapes, FixedShapes) {
    let fixed = physics.bodies.insert(RigidBodyBuilder::fixed());
    let mut insert = |pose: Pose, shape: &SharedShape, of: Group| {
        let collider = ColliderBuilder::new(shape.clone())
            .position(pose)
            .friction(FRICTION)
            .collision_groups(groups(of, TRAIN | LOAD));
        physics
            .colliders
            .insert_with_parent(collider, fixed, &mut physics.bodies);
    };
    for piece in rail.mesh(RAIL_STEP_M, RAIL_PIECE_M) {
        let points = piece
            .vertices
            .iter()
            .map(|v| Vector::new(v[0], v[1], v[2]))
            .collect();
        if let Ok(shape) = SharedShape::trimesh(points, piece.triangles) {
            insert(Pose::IDENTITY, &shape, RAIL);
        }
    }
    let mut boxes = Vec::new();
    for b in obstacles {
        let shape = SharedShape::cuboid(b.size.x / 2.0, b.size.y / 2.0, b.size.z / 2.0);
        let pose = pose_to_rapier(&b.pose);
        insert(pose, &shape, OBSTACLES);
        boxes.push((pose, shape));
    }
    // Distances to the rail are those to boxes around it: cheap, and some millimetres too near in the tightest curves.
    let size = rail.profile().map_or([0.0; 2], Profile::bounding_box);
    let frames = rail.samples(RAIL_STEP_M);
    let hull = frames.windows(2).map(|w| {
        let middle = ObstacleBox::between(&w[0], &w[1], size);
        let half = middle.size / 2.0;
        (
            pose_to_rapier(&middle.pose),
            SharedShape::cuboid(half.x, half.y, half.z),
        )
    });
    (FixedShapes::new(hull.collect()), FixedShapes::new(boxes))
}
