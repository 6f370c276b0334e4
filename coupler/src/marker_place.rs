//! The interface markers in the place the wall has over a step: the normal and the area of each.
//!
//! Both follow from the motion alone, so they are found while the water moves.

use protocol::interface::Facets;

use crate::parallel;

/// The Gauss points of a quadrilateral are at xi, eta = -+ 1/sqrt(3).
const GAUSS: f64 = 0.577_350_269_189_625_8;
/// Its shape functions there: of the corner nearest to the point, of the two beside it, of the one opposite.
const NEAR: f64 = 0.25 * (1.0 + GAUSS) * (1.0 + GAUSS);
const BESIDE: f64 = 0.25 * (1.0 + GAUSS) * (1.0 - GAUSS);
const FAR: f64 = 0.25 * (1.0 - GAUSS) * (1.0 - GAUSS);

/// Values kept of a facet: its area vector and the areas of up to four corners.
const OF_FACET: usize = 7;

/// Normals and areas at the markers.
pub struct MarkerPlace {
    nodes_per_facet: usize,
    /// Nodes of the facets, `[f, nodes_per_facet]`.
    nodes: Vec<u32>,
    /// Where the corners of each marker begin in `corners`, and the end of the last.
    starts: Vec<u32>,
    /// The corners of facets that meet in each marker: four times the facet plus the corner.
    corners: Vec<u32>,
    /// Outward area vector of each facet and the integrals of its corners' shape functions, m2.
    facets: Vec<f64>,
    /// See [`MarkerPlace::markers`].
    markers: Vec<f64>,
}

impl MarkerPlace {
    /// The markers of these facets, with their nodes at `position`, `[n, D]` m.
    pub fn new(facets: &Facets, position: &[f64]) -> Self {
        let corner_markers = facets.corner_markers();
        let count = corner_markers.iter().max().map_or(0, |last| last + 1);
        let mut meeting = vec![Vec::new(); count];
        for (corner, &marker) in corner_markers.iter().enumerate() {
            let (facet, corner) = (corner / facets.nodes_per_facet, corner % facets.nodes_per_facet);
            meeting[marker].push((4 * facet + corner) as u32);
        }
        let mut starts = vec![0];
        starts.extend(meeting.iter().scan(0, |end, corners| {
            *end += corners.len() as u32;
            Some(*end)
        }));
        let mut place = Self {
            nodes_per_facet: facets.nodes_per_facet,
            nodes: facets.nodes.iter().map(|&node| node as u32).collect(),
            starts,
            corners: meeting.concat(),
            facets: vec![0.0; facets.len() * OF_FACET],
            markers: vec![0.0; count * 4],
        };
        place.follow(position);
        place
    }

    /// Of each marker the unit outward normal, the area-weighted mean over the facets that meet (in 2-D its third component
    /// is 0), and the integral of its shape function over the surface, m2; these areas add up to the wet area.
    pub fn markers(&self) -> &[[f64; 4]] {
        self.markers.as_chunks().0
    }

    /// Moves the markers to where the nodes are now, `[n, D]` m.
    pub fn follow(&mut self, position: &[f64]) {
        match self.nodes_per_facet {
            2 => self.follow_all::<2, 2>(position),
            3 => self.follow_all::<3, 3>(position),
            _ => self.follow_all::<3, 4>(position),
        }
    }

    fn follow_all<const D: usize, const N: usize>(&mut self, position: &[f64]) {
        let (nodes, position) = (self.nodes.as_chunks::<N>().0, position.as_chunks::<D>().0);
        parallel::fill(&mut self.facets, |facet| {
            facet_values(nodes[facet].map(|node| padded(position[node as usize])))
        });
        let facets = self.facets.as_chunks::<OF_FACET>().0;
        let (starts, corners) = (&self.starts, &self.corners);
        parallel::fill(&mut self.markers, |marker| {
            let (mut vector, mut area) = ([0.0; 3], 0.0);
            for &corner in &corners[starts[marker] as usize..starts[marker + 1] as usize] {
                let facet = &facets[(corner / 4) as usize];
                (0..3).for_each(|axis| vector[axis] += facet[axis]);
                area += facet[3 + (corner % 4) as usize];
            }
            let length = norm(vector);
            [vector[0] / length, vector[1] / length, vector[2] / length, area]
        });
    }

    /// Wet area, m2 (in 2-D length, m).
    pub fn total_area(&self) -> f64 {
        let vectors = self.facets.as_chunks::<OF_FACET>().0.iter();
        vectors.map(|[x, y, z, ..]| (x * x + y * y + z * z).sqrt()).sum()
    }
}

fn padded<const D: usize>(point: [f64; D]) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < D { point[axis] } else { 0.0 })
}

/// Area vector and areas of the corners.
fn facet_values<const N: usize>(points: [[f64; 3]; N]) -> [f64; OF_FACET] {
    let (vector, corners) = match points.as_slice() {
        [a, b] => segment(*a, *b),
        [a, b, c] => triangle(*a, *b, *c),
        [a, b, c, d] => quadrilateral([*a, *b, *c, *d]),
        _ => unreachable!("facets have two to four nodes"),
    };
    let mut values = [0.0; OF_FACET];
    values[..3].copy_from_slice(&vector);
    values[3..].copy_from_slice(&corners);
    values
}

fn segment(a: [f64; 3], b: [f64; 3]) -> ([f64; 3], [f64; 4]) {
    let normal = [b[1] - a[1], a[0] - b[0], 0.0];
    (normal, [0.5 * norm(normal); 4])
}

fn triangle(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> ([f64; 3], [f64; 4]) {
    let normal = cross(minus(b, a), minus(c, a)).map(|component| 0.5 * component);
    (normal, [norm(normal) / 3.0; 4])
}

/// With the diagonals d and the warp w = p0 - p1 + p2 - p3 the normal at the Gauss point nearest to a corner is
/// (d1 x d2 +- d x w / sqrt(3)) / 8, d the diagonal that does not end there.
fn quadrilateral([p0, p1, p2, p3]: [[f64; 3]; 4]) -> ([f64; 3], [f64; 4]) {
    let (first, second) = (minus(p2, p0), minus(p3, p1));
    let warp: [f64; 3] = std::array::from_fn(|axis| p0[axis] - p1[axis] + p2[axis] - p3[axis]);
    let normal = cross(first, second);
    let size = |diagonal: [f64; 3], side: f64| {
        let turn = cross(diagonal, warp);
        let at_point = std::array::from_fn(|axis| normal[axis] + side * GAUSS * turn[axis]);
        0.125 * norm(at_point)
    };
    let sizes = [size(second, 1.0), size(first, 1.0), size(second, -1.0), size(first, -1.0)];
    let corner = |k: usize| {
        NEAR * sizes[k] + BESIDE * (sizes[(k + 1) % 4] + sizes[(k + 3) % 4]) + FAR * sizes[(k + 2) % 4]
    };
    (normal.map(|component| 0.5 * component), [corner(0), corner(1), corner(2), corner(3)])
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use protocol::interface::add_traction_forces;

    use super::*;

    #[test]
    fn what_a_pressure_at_a_marker_weighs_is_the_sum_of_its_nodal_forces() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.3], [2.2, 3.0, 0.0], [-0.4, 2.5, 0.5]];
        for count in 2..=4 {
            let dimension = if count == 2 { 2 } else { 3 };
            let position: Vec<f64> = corners[..count].iter().flat_map(|x| &x[..dimension]).copied().collect();
            let facets = Facets { nodes_per_facet: count, nodes: (0..count).collect(), face: vec![0] };
            let place = MarkerPlace::new(&facets, &position);
            for marker in 0..count {
                let mut traction = vec![0.0; count * dimension];
                traction[marker * dimension] = 1.0;
                let mut force = vec![0.0; count * dimension];
                add_traction_forces(&facets, &facets.corner_markers(), &position, &traction, &mut force);
                let total: f64 = force.iter().step_by(dimension).sum();
                let area = place.markers()[marker][3];
                assert!((area - total).abs() < 1e-14, "{count}: {area} {total}");
            }
        }
    }

    #[test]
    fn a_uniform_pressure_on_a_warped_quadrilateral_pushes_with_its_area_vector() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.1, 0.3], [2.2, 3.0, 0.0], [-0.4, 2.5, 0.5]];
        // Half the cross product of the diagonals (2.2, 3, 0) and (-2.4, 2.4, 0.2).
        let (vector, _) = quadrilateral(corners);
        for (found, exact) in vector.iter().zip([0.3, -0.22, 6.24]) {
            assert!((found - exact).abs() < 1e-14, "{vector:?}");
        }
    }
}
