//! A closed surface of triangles in space, from an STL file: what lies inside, and the shell of wall particles under it.
//!
//! The shell lies on the lattice, so the surface is met to half a spacing: a slope becomes a staircase.

use std::collections::HashMap;
use std::path::Path;

use crate::lattice::SHELL_LAYERS;
use crate::obstacle::ObstacleParticle;
use crate::vector::Vector;

/// A closed surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Corners of the triangles, `[t, 3]` m.
    triangles: Vec<[[f64; 3]; 3]>,
    min: [f64; 3],
    max: [f64; 3],
}

/// Why a file is no closed surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// Missing, or no STL.
    #[error("cannot read {file}: {cause}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system or the reader says.
        cause: String,
    },
    /// An edge that does not join two triangles of opposite sense.
    #[error(
        "the surface in {file} is not closed: {open} edges do not join two triangles, one from {from:?} to {to:?} m"
    )]
    NotClosed {
        /// The file.
        file: String,
        /// Number of such edges.
        open: usize,
        /// Start of the first, m.
        from: [f64; 3],
        /// Its end, m.
        to: [f64; 3],
    },
}

impl Surface {
    /// Reads an STL file, text or binary, and scales its lengths to metres.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn read(path: &Path, scale: f64) -> Result<Self, SurfaceError> {
        let file = path.display().to_string();
        let mesh = std::fs::File::open(path)
            .and_then(|file| stl_io::read_stl(&mut std::io::BufReader::new(file)))
            .map_err(|cause| SurfaceError::Unreadable { file: file.clone(), cause: cause.to_string() })?;
        let points: Vec<[f64; 3]> = mesh
            .vertices
            .iter()
            .map(|&vertex| <[f32; 3]>::from(vertex).map(|x| f64::from(x) * scale))
            .collect();
        let faces: Vec<[usize; 3]> = mesh.faces.iter().map(|face| face.vertices).collect();
        Self::new(&points, &faces, file)
    }

    /// Takes triangles by their corners; `file` only names them.
    ///
    /// # Errors
    /// [`SurfaceError::NotClosed`].
    pub fn new(points: &[[f64; 3]], faces: &[[usize; 3]], file: String) -> Result<Self, SurfaceError> {
        let mut edges: HashMap<(usize, usize), i64> = HashMap::new();
        for face in faces {
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                // An edge run through once in each sense adds up to nothing.
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        let mut open: Vec<_> = edges.iter().filter(|edge| *edge.1 != 0).map(|edge| *edge.0).collect();
        open.sort_unstable();
        if let Some(&(a, b)) = open.first() {
            let (from, to) = (points[a], points[b]);
            return Err(SurfaceError::NotClosed { file, open: open.len(), from, to });
        }
        if faces.is_empty() {
            let cause = "it holds no triangle".to_owned();
            return Err(SurfaceError::Unreadable { file, cause });
        }
        let triangles: Vec<_> = faces.iter().map(|face| face.map(|corner| points[corner])).collect();
        let corners = || triangles.iter().flatten();
        let bound =
            |k: usize, start: f64, pick: fn(f64, f64) -> f64| corners().map(|x| x[k]).fold(start, pick);
        let min = std::array::from_fn(|k| bound(k, f64::INFINITY, f64::min));
        let max = std::array::from_fn(|k| bound(k, f64::NEG_INFINITY, f64::max));
        Ok(Self { triangles, min, max })
    }

    /// The box around it, m.
    pub fn bounds<const D: usize>(&self) -> (Vector<D>, Vector<D>) {
        (std::array::from_fn(|k| self.min[k]), std::array::from_fn(|k| self.max[k]))
    }

    /// Volume inside, m3: a third of the flux of x through the triangles.
    pub fn volume(&self) -> f64 {
        let six = |[a, b, c]: &[[f64; 3]; 3]| {
            let minor = |p: usize, q: usize| b[p] * c[q] - b[q] * c[p];
            a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
        };
        (self.triangles.iter().map(six).sum::<f64>() / 6.0).abs()
    }

    /// Whether a point lies inside: an odd number of passages on the way to it along x.
    pub fn contains<const D: usize>(&self, x: &Vector<D>) -> bool {
        let passed = self.passages(x[1], x[D - 1]);
        passed.iter().filter(|&&at| at < x[0]).count() % 2 == 1
    }

    /// Where the line along x at (y, z) passes the surface, m, rising.
    fn passages(&self, y: f64, z: f64) -> Vec<f64> {
        // Off the lattice's symmetric places, where lines run along edges.
        let size = self.max[1] - self.min[1] + self.max[2] - self.min[2];
        let (y, z) = (y + 1.234_567e-7 * size, z + 2.345_678e-7 * size);
        let mut passages: Vec<f64> =
            self.triangles.iter().filter_map(|corners| passage(corners, y, z)).collect();
        passages.sort_by(f64::total_cmp);
        passages
    }

    /// Wall particles on the lattice inside, three layers deep.
    pub fn fill<const D: usize>(&self, spacing: f64) -> Vec<ObstacleParticle<D>> {
        let count: [usize; 3] =
            std::array::from_fn(|k| ((self.max[k] - self.min[k]) / spacing).ceil().max(1.0) as usize);
        let at = |k: usize, number: usize| self.min[k] + (number as f64 + 0.5) * spacing;
        let index = |[a, b, c]: [usize; 3]| a + count[0] * (b + count[1] * c);
        let mut inside = vec![false; count.iter().product()];
        for c in 0..count[2] {
            for b in 0..count[1] {
                for pair in self.passages(at(1, b), at(2, c)).chunks_exact(2) {
                    for a in (0..count[0]).filter(|&a| pair[0] < at(0, a) && at(0, a) < pair[1]) {
                        inside[index([a, b, c])] = true;
                    }
                }
            }
        }
        let reach = SHELL_LAYERS as i64;
        let is_wall = |at: [usize; 3]| {
            let ball = (0..(2 * reach + 1).pow(3)).map(|n| {
                [n, n / (2 * reach + 1), n / (2 * reach + 1).pow(2)].map(|n| n % (2 * reach + 1) - reach)
            });
            let mut near = ball.filter(|o| o.iter().map(|k| k * k).sum::<i64>() <= reach * reach);
            near.any(|offset| {
                let there: [i64; 3] = std::array::from_fn(|k| at[k] as i64 + offset[k]);
                let exists = (0..3).all(|k| (0..count[k] as i64).contains(&there[k]));
                !exists || !inside[index(there.map(|k| k as usize))]
            })
        };
        let mut particles = Vec::new();
        for number in 0..inside.len() {
            let place = [number % count[0], number / count[0] % count[1], number / (count[0] * count[1])];
            if inside[number] && is_wall(place) {
                particles.push(ObstacleParticle {
                    position: std::array::from_fn(|k| at(k, place[k])),
                    weight: 1.0,
                    facing: [1.0; D],
                    director: [0.0; D],
                });
            }
        }
        particles
    }
}

/// x at which the line (y, z) passes a triangle, if it does.
fn passage(corners: &[[f64; 3]; 3], y: f64, z: f64) -> Option<f64> {
    let side = |k: usize| {
        let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        (b[1] - a[1]) * (z - a[2]) - (b[2] - a[2]) * (y - a[1])
    };
    let sides = [side(0), side(1), side(2)];
    let inside = sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0);
    let area: f64 = sides.iter().sum();
    inside.then(|| (0..3).map(|k| sides[k] / area * corners[k][0]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with edges a along the axes.
    fn tetrahedron(a: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
        let points = vec![[0.0; 3], [a, 0.0, 0.0], [0.0, a, 0.0], [0.0, 0.0, a]];
        (points, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn inside_and_outside_are_told_apart() {
        let (points, faces) = tetrahedron(1.0);
        let surface = Surface::new(&points, &faces, "t.stl".to_owned()).unwrap();
        assert!((surface.volume() - 1.0 / 6.0).abs() < 1e-12);
        assert!(surface.contains(&[0.2, 0.2, 0.2]));
        assert!(!surface.contains(&[0.5, 0.5, 0.5]) && !surface.contains(&[-0.1, 0.2, 0.2]));
    }

    #[test]
    fn the_shell_is_hollow_and_has_the_volume_of_the_body_where_the_body_is_small() {
        let (points, faces) = tetrahedron(1.0);
        let surface = Surface::new(&points, &faces, "t.stl".to_owned()).unwrap();
        let solid = surface.fill::<3>(0.05).len() as f64 * 0.05f64.powi(3);
        assert!((solid * 6.0 - 1.0).abs() < 0.1, "{solid}");
        let fine = surface.fill::<3>(0.01).len() as f64 * 0.01f64.powi(3);
        assert!(fine * 6.0 < 0.7, "{fine}");
    }

    #[test]
    fn a_missing_triangle_is_named_by_an_edge() {
        let (points, faces) = tetrahedron(2.0);
        let error = Surface::new(&points, &faces[..3], "t.stl".to_owned()).unwrap_err();
        assert!(matches!(error, SurfaceError::NotClosed { open: 3, .. }), "{error}");
        assert!(error.to_string().contains("2.0"), "{error}");
    }
}
