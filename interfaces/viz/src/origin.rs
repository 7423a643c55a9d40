//! Origin of what is drawn: the start of the rail. Viewers draw in single precision, and survey coordinates of millions
//! of metres would tear the train apart (4.5·10⁶ m have a step of 0.5 m).

use monorig_sim::record::Layout;
use nalgebra::Vector3;

/// The start of the rail in the world, m: the origin of all drawn coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Origin(Vector3<f64>);

impl Origin {
    /// Returns the first sample of the rail as the origin; without a rail, the origin of the world.
    pub fn of(layout: &Layout<'_>) -> Self {
        Self(layout.rail.first().map_or(Vector3::zeros(), |f| f.p))
    }

    /// A given one.
    #[cfg(test)]
    pub fn at(place: Vector3<f64>) -> Self {
        Self(place)
    }

    /// Returns the origin in the world, m.
    pub fn world(&self) -> Vector3<f64> {
        self.0
    }

    /// A place in the world as it is drawn.
    pub fn point(&self, place: &Vector3<f64>) -> [f32; 3] {
        single(&(place - self.0))
    }
}

/// A place in the world on the plan: the viewer's second axis points down.
pub fn plan_point(origin: &Origin, place: &[f64; 3]) -> [f32; 2] {
    let [x, y, _] = origin.point(&Vector3::from(*place));
    [x, -y]
}

/// A direction, a size or a place relative to something near, in single precision.
pub fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}
