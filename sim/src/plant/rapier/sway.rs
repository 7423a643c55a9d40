//! The swing of the load on its chains.

use crate::train::Train;
use nalgebra::Vector3;

/// The load below the middle of the upper anchors of its chains.
#[derive(Clone, Copy, Debug)]
pub struct Sway {
    pub(super) load: usize,
    pub(super) above: usize,
    pub(super) anchor: Vector3<f64>,
}

impl Sway {
    /// None if no load is on chains.
    pub fn of(train: &Train) -> Option<Self> {
        let load = train.load?;
        let above = *train.supports(load).first()?;
        let anchors: Vec<Vector3<f64>> = train
            .connections
            .iter()
            .filter_map(|c| match () {
                () if c.a == load && c.b == above => Some(c.anchor_b),
                () if c.b == load && c.a == above => Some(c.anchor_a),
                () => None,
            })
            .collect();
        Some(Self {
            load,
            above,
            anchor: anchors.iter().sum::<Vector3<f64>>() / anchors.len() as f64,
        })
    }
}
