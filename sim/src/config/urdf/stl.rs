//! Triangle meshes from STL files, text or binary.

use crate::config::file::{input_error, read_bytes};
use crate::error::Error;
use std::collections::BTreeMap;
use std::path::Path;

/// Vertices, m, and triangles.
pub type StlMesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

const HEADER: usize = 84;
const FACET: usize = 50;

/// Read a mesh; corners that coincide become one vertex.
pub fn read(path: &Path) -> Result<StlMesh, Error> {
    let bytes = read_bytes(path)?;
    let corners = binary(&bytes).or_else(|| text(&bytes)).ok_or_else(|| {
        input_error(
            path,
            "",
            "neither a text nor a binary STL file",
            "text begins with `solid` and holds three `vertex x y z` lines a facet; binary holds 84 + 50·n bytes",
        )
    })?;
    let flaw = if corners.is_empty() {
        "the mesh has no triangle"
    } else if corners.iter().flatten().any(|x| !x.is_finite()) {
        "a vertex is not a finite number"
    } else {
        return Ok(weld(&corners));
    };
    Err(input_error(
        path,
        "",
        flaw,
        "export the mesh again, in metres",
    ))
}

/// Corners of all triangles, if the size of the file fits its count of triangles.
fn binary(bytes: &[u8]) -> Option<Vec<[f64; 3]>> {
    let count = u32::from_le_bytes(bytes.get(80..HEADER)?.try_into().ok()?) as usize;
    let facets = bytes.get(HEADER..)?;
    if count.checked_mul(FACET) != Some(facets.len()) {
        return None;
    }
    let number = |b: &[u8]| b.try_into().map(|b| f64::from(f32::from_le_bytes(b))).ok();
    let mut corners = Vec::with_capacity(3 * count);
    for facet in facets.chunks_exact(FACET) {
        for corner in facet[12..48].chunks_exact(12) {
            corners.push([
                number(&corner[..4])?,
                number(&corner[4..8])?,
                number(&corner[8..])?,
            ]);
        }
    }
    Some(corners)
}

/// Corners of all triangles of a text file.
fn text(bytes: &[u8]) -> Option<Vec<[f64; 3]>> {
    // the name behind `solid` is in the code page of the program that wrote it
    let text = String::from_utf8_lossy(bytes).to_ascii_lowercase();
    let text = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    if !text.starts_with("solid") {
        return None;
    }
    let mut corners = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        if words.next() == Some("vertex") {
            let mut number = || words.next()?.parse::<f64>().ok();
            corners.push([number()?, number()?, number()?]);
        }
    }
    corners.len().is_multiple_of(3).then_some(corners)
}

fn weld(corners: &[[f64; 3]]) -> StlMesh {
    let mut seen = BTreeMap::new();
    let mut vertices = Vec::new();
    let mut index = |c: &[f64; 3]| {
        *seen
            .entry(c.map(|x| (x + 0.0).to_bits()))
            .or_insert_with(|| {
                vertices.push(*c);
                vertices.len() as u32 - 1
            })
    };
    let triangles = corners
        .chunks_exact(3)
        .map(|t| [index(&t[0]), index(&t[1]), index(&t[2])])
        .filter(|[a, b, c]| a != b && b != c && a != c)
        .collect();
    (vertices, triangles)
}

#[allow(clippy::unwrap_used)]
#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[[f32; 3]; 3]; 4] = [
        [[0., 0., 0.], [0., 1., 0.], [1., 0., 0.]],
        [[0., 0., 0.], [1., 0., 0.], [0., 0., 1.]],
        [[0., 0., 0.], [0., 0., 1.], [0., 1., 0.]],
        [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
    ];

    /// Volume enclosed by an outward-facing mesh, by the divergence theorem.
    fn volume((vertices, triangles): &StlMesh) -> f64 {
        triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| nalgebra::Vector3::from(vertices[i as usize]));
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// The name may be in any code page, the words in capitals, a byte order mark before them.
    #[test]
    fn text_of_other_programs() {
        let mut plain = b"solid name\n".to_vec();
        for v in TETRAHEDRON.iter().flatten() {
            plain.extend(format!("vertex {:e} {:e} {:e}\n", v[0], v[1], v[2]).into_bytes());
        }
        let expected = text(&plain).unwrap();
        assert_eq!(expected.len(), 12);
        for byte in 0x80..=0xFF {
            let named = [&b"solid Tr\t"[..], &[byte], &plain[10..]].concat();
            assert_eq!(text(&named).unwrap(), expected);
        }
        assert_eq!(text(&plain.to_ascii_uppercase()).unwrap(), expected);
        assert_eq!(
            text(&[&b"\xEF\xBB\xBF"[..], &plain].concat()).unwrap(),
            expected
        );
    }

    #[test]
    fn text_and_binary_say_the_same() {
        let mut text = String::from("solid t\n");
        let mut bin = vec![0u8; 80];
        bin.extend(4u32.to_le_bytes());
        for t in TETRAHEDRON {
            text += "facet normal 0 0 0\nouter loop\n";
            bin.extend([0u8; 12]);
            for v in t {
                text += &format!("vertex {} {} {}\n", v[0], v[1], v[2]);
                bin.extend(v.iter().flat_map(|x| x.to_le_bytes()));
            }
            text += "endloop\nendfacet\n";
            bin.extend([0u8; 2]);
        }
        let folder = std::env::temp_dir().join(format!("monorig-stl-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (a, b) = (folder.join("a.stl"), folder.join("b.stl"));
        std::fs::write(&a, &text).unwrap();
        std::fs::write(&b, &bin).unwrap();
        let (ma, mb) = (read(&a).unwrap(), read(&b).unwrap());
        assert_eq!(ma, mb);
        assert_eq!((ma.0.len(), ma.1.len()), (4, 4));
        assert!((volume(&ma) - 1.0 / 6.0).abs() < 1e-12);

        // Every shortened binary file and every broken text file is refused or still a mesh; none panics.
        for n in 0..bin.len() {
            std::fs::write(&b, &bin[..n]).unwrap();
            assert!(read(&b).is_err(), "{n} bytes");
        }
        std::fs::write(&a, text.replace("vertex 1", "vertex x")).unwrap();
        assert!(read(&a).is_err());
        std::fs::write(&a, text.replace("vertex 1", "vertex NaN")).unwrap();
        assert!(read(&a).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
