//! Visible shapes of a car.

use super::car_file::CarFile;
use crate::train::{Geometry, Shape};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

const PAINT: [f32; 4] = [0.35, 0.02, 0.03, 1.0];
const GLASS: [f32; 4] = [0.05, 0.06, 0.08, 1.0];
const RUBBER: [f32; 4] = [0.02, 0.02, 0.02, 1.0];

/// Distance by which the wheels stand out of the body, so that both are visible, m.
const PROTRUSION_M: f64 = 0.02;

/// A body, a cabin on it, and four wheels that turn. `nose_m`: from the car's origin to its front, m.
pub(super) fn shapes(car: &CarFile, nose_m: f64) -> Vec<Shape> {
    let (w, [length, width, height]) = (&car.wheels, car.body.size_m.map(f64::from));
    let (radius, middle) = (w.radius_m.get(), nose_m - 0.5 * length);
    let block = |link: &str, at: [f64; 3], size: [f64; 3], rgba| Shape {
        link: link.into(),
        pose: Isometry3::translation(at[0], at[1], at[2]),
        geometry: Geometry::Box(size.into()),
        rgba,
        collides: false,
        spins: None,
    };
    let (floor, belt) = (0.6 * radius, 0.6 * height);
    let mut shapes = vec![
        block(
            "body",
            [middle, 0.0, 0.5 * (floor + belt)],
            [length, width, belt - floor],
            PAINT,
        ),
        block(
            "cabin",
            [middle - 0.05 * length, 0.0, 0.5 * (belt + height)],
            [0.55 * length, 0.85 * width, height - belt],
            GLASS,
        ),
    ];
    let (tread, places) = (0.22, [w.front_axle_m.get(), -w.rear_axle_m.get()]);
    for (axle, x) in places.into_iter().enumerate() {
        for (side, y) in [0.5, -0.5].into_iter().enumerate() {
            shapes.push(Shape {
                link: format!(
                    "wheel_{}_{}",
                    ["front", "rear"][axle],
                    ["left", "right"][side]
                ),
                // the cylinder's axis, z, to the left (a turn by −90° about x), so that a positive angle rolls forward
                pose: Isometry3::from_parts(
                    Translation3::new(x, y * (width - tread + 2.0 * PROTRUSION_M), radius),
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2),
                ),
                geometry: Geometry::Cylinder(radius, tread),
                rgba: RUBBER,
                collides: false,
                spins: Some((axle, side)),
            });
        }
    }
    shapes
}
