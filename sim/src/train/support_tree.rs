//! Support tree: which bodies carry each suspended body.

use super::{ConnectionKind, Train};

impl Train {
    /// Steps from each body up to the rail: 0 for rail-bound bodies, `usize::MAX` for bodies that hang from nothing.
    fn depths(&self) -> Vec<usize> {
        let mut depth: Vec<usize> = self
            .bodies
            .iter()
            .map(|b| if b.stations.is_empty() { usize::MAX } else { 0 })
            .collect();
        for _ in &self.bodies {
            for c in self
                .connections
                .iter()
                .filter(|c| c.kind != ConnectionKind::Drawbar)
            {
                let near = depth[c.a].min(depth[c.b]).saturating_add(1);
                depth[c.a] = depth[c.a].min(near);
                depth[c.b] = depth[c.b].min(near);
            }
        }
        depth
    }

    /// Every suspended body with the bodies that carry it, those nearest to the rail first.
    pub(crate) fn suspended_bodies(&self) -> Vec<(usize, Vec<usize>)> {
        let depth = self.depths();
        let mut hanging: Vec<usize> = (0..self.bodies.len())
            .filter(|i| depth[*i] > 0 && depth[*i] < usize::MAX)
            .collect();
        hanging.sort_by_key(|i| depth[*i]);
        hanging.iter().map(|i| (*i, self.supports(*i))).collect()
    }

    /// The bodies that carry body `i`, each once per hanger or chain: none for a rail-bound body.
    pub fn supports(&self, i: usize) -> Vec<usize> {
        let depth = self.depths();
        self.connections
            .iter()
            .filter(|c| c.kind != ConnectionKind::Drawbar)
            .filter_map(|c| match () {
                () if c.a == i => Some(c.b),
                () if c.b == i => Some(c.a),
                () => None,
            })
            .filter(|&other| depth[other] < depth[i])
            .collect()
    }
}
