//! The swept I-beam as triangles, for static colliders and for viewing.

use super::profile::PARTS;
use super::{Cursor, Rail};

/// A closed surface of triangles, outward sides counter-clockwise.
#[derive(Clone, Debug, Default)]
pub struct RailMesh {
    /// Chainages at which it begins and ends, m.
    #[cfg(test)]
    pub ends_m: [f64; 2],
    /// Vertices in the world, m.
    pub vertices: Vec<[f64; 3]>,
    /// Triangles, as indices into the vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl Rail {
    /// The swept I-beam in chunks of at most `chunk_m`, each closed; nothing on a road. Cross-sections lie at most
    /// `step_m` apart where the rail is curved (the chord is then step²/8R off), and only at the ends where it is
    /// straight.
    pub(crate) fn mesh(&self, step_m: f64, chunk_m: f64) -> Vec<RailMesh> {
        let Some(profile) = self.profile() else {
            return Vec::new();
        };
        let chunks = super::pieces(self.length(), chunk_m);
        let border = |i: usize| {
            if i == chunks {
                self.length()
            } else {
                self.length() * i as f64 / chunks as f64
            }
        };
        (0..chunks)
            .map(|i| self.chunk(&profile.outline, border(i), border(i + 1), step_m))
            .collect()
    }

    fn chunk(&self, outline: &[[f64; 2]], from_m: f64, to_m: f64, step_m: f64) -> RailMesh {
        let n = outline.len() as u32;
        let mut mesh = RailMesh {
            #[cfg(test)]
            ends_m: [from_m, to_m],
            ..RailMesh::default()
        };
        let mut cursor = Cursor::at(from_m);
        let cuts = self.nodes.cuts(from_m, to_m, step_m);
        for s in &cuts {
            let f = self.frame_at(*s, &mut cursor);
            mesh.vertices.extend(
                outline
                    .iter()
                    .map(|[l, u]| <[f64; 3]>::from(f.p + f.l * *l + f.u * *u)),
            );
        }
        let last = cuts.len() as u32 - 1;
        for section in 0..last {
            let (a, b) = (section * n, (section + 1) * n);
            for i in 0..n {
                let j = (i + 1) % n;
                mesh.triangles.push([a + i, a + j, b + j]);
                mesh.triangles.push([a + i, b + j, b + i]);
            }
        }
        for [a, b, c] in cap() {
            // the outline runs counter-clockwise seen against t: as it is at the far end, turned round at the near end
            mesh.triangles.push([a, c, b]);
            mesh.triangles
                .push([last * n + a, last * n + b, last * n + c]);
        }
        mesh
    }
}

/// Triangles of the cross-section, counter-clockwise.
fn cap() -> impl Iterator<Item = [u32; 3]> {
    PARTS.iter().flat_map(|part| {
        part[1..]
            .windows(2)
            .map(|w| [part[0] as u32, w[0] as u32, w[1] as u32])
    })
}
