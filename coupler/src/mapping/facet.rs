//! One facet of a surface and the place on it nearest to a point, by its own shape functions.

use rstar::{AABB, PointDistance, RTreeObject};

pub(super) type Point = [f64; 3];

/// One facet in a tree of boxes.
pub(super) struct Facet {
    pub(super) number: usize,
    pub(super) face: usize,
    pub(super) nodes: Vec<usize>,
    /// Places of these, m.
    pub(super) corners: Vec<Point>,
}

impl RTreeObject for Facet {
    type Envelope = AABB<Point>;

    /// A bilinear facet lies in the box of its corners.
    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.corners)
    }
}

impl Facet {
    /// Mean length of the edges, m.
    pub(super) fn size(&self) -> f64 {
        let count = self.corners.len();
        let edges = if count == 2 { 1 } else { count };
        let edge = |k: usize| minus(&self.corners[(k + 1) % count], &self.corners[k]);
        (0..edges).map(|k| dot(&edge(k), &edge(k)).sqrt()).sum::<f64>() / edges as f64
    }

    /// Unit vectors along the facet at right angles; in 2-D the second is not used.
    pub(super) fn tangents(&self) -> [Point; 2] {
        let unit = |v: Point| v.map(|component| component / dot(&v, &v).sqrt());
        let first = unit(minus(&self.corners[1], &self.corners[0]));
        let other = minus(self.corners.last().expect("a facet has corners"), &self.corners[0]);
        let along = dot(&other, &first);
        let second: Point = std::array::from_fn(|axis| other[axis] - along * first[axis]);
        [first, if self.corners.len() == 2 { second } else { unit(second) }]
    }

    /// Along the outward normal, of any length.
    pub(super) fn outwards(&self) -> Point {
        let corner = |k: usize| &self.corners[k];
        match self.corners.len() {
            2 => {
                let [x, y, _] = minus(corner(1), corner(0));
                [y, -x, 0.0]
            }
            3 => cross(&minus(corner(1), corner(0)), &minus(corner(2), corner(0))),
            _ => cross(&minus(corner(2), corner(0)), &minus(corner(3), corner(1))),
        }
    }

    /// Shape functions at the place on it nearest to `point`.
    pub(super) fn nearest(&self, point: &Point) -> Vec<f64> {
        match self.corners.len() {
            2 => {
                let t = segment_parameter(point, &self.corners[0], &self.corners[1]);
                vec![1.0 - t, t]
            }
            3 => triangle_weights(point, &self.corners),
            _ => quadrilateral_weights(point, &self.corners),
        }
    }
}

impl PointDistance for Facet {
    fn distance_2(&self, point: &Point) -> f64 {
        let off = minus(point, &combine(&self.corners, &self.nearest(point)));
        dot(&off, &off)
    }
}

pub(super) fn padded(point: &[f64]) -> Point {
    std::array::from_fn(|axis| point.get(axis).copied().unwrap_or_default())
}

fn segment_parameter(point: &Point, a: &Point, b: &Point) -> f64 {
    let edge = minus(b, a);
    (dot(&minus(point, a), &edge) / dot(&edge, &edge)).clamp(0.0, 1.0)
}

fn triangle_weights(point: &Point, corners: &[Point]) -> Vec<f64> {
    let (u, v, w) =
        (minus(&corners[1], &corners[0]), minus(&corners[2], &corners[0]), minus(point, &corners[0]));
    let (uu, uv, vv, wu, wv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v), dot(&w, &u), dot(&w, &v));
    let determinant = uu * vv - uv * uv;
    let (s, t) = ((wu * vv - wv * uv) / determinant, (wv * uu - wu * uv) / determinant);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return vec![1.0 - s - t, s, t];
    }
    let edges = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
        let t = segment_parameter(point, &corners[a], &corners[b]);
        let mut weights = vec![0.0; 3];
        (weights[a], weights[b]) = (1.0 - t, t);
        let off = minus(point, &combine(corners, &weights));
        (dot(&off, &off), weights)
    });
    let nearest = edges.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.expect("a triangle has edges").1
}

/// Gauss-Newton on the local coordinates, kept in the facet; exact in one step on parallelograms.
fn quadrilateral_weights(point: &Point, corners: &[Point]) -> Vec<f64> {
    const SIGNS: [(f64, f64); 4] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let (mut xi, mut eta) = (0.0_f64, 0.0_f64);
    let shape = |xi: f64, eta: f64| SIGNS.map(|(a, b)| 0.25 * (1.0 + a * xi) * (1.0 + b * eta)).to_vec();
    for _ in 0..20 {
        let off = minus(point, &combine(corners, &shape(xi, eta)));
        let along = combine(corners, &SIGNS.map(|(a, b)| 0.25 * a * (1.0 + b * eta)));
        let up = combine(corners, &SIGNS.map(|(a, b)| 0.25 * b * (1.0 + a * xi)));
        let (uu, uv, vv) = (dot(&along, &along), dot(&along, &up), dot(&up, &up));
        let (ru, rv) = (dot(&off, &along), dot(&off, &up));
        let determinant = uu * vv - uv * uv;
        let next_xi = (xi + (ru * vv - rv * uv) / determinant).clamp(-1.0, 1.0);
        let next_eta = (eta + (rv * uu - ru * uv) / determinant).clamp(-1.0, 1.0);
        let moved = (next_xi - xi).abs() + (next_eta - eta).abs();
        (xi, eta) = (next_xi, next_eta);
        if moved < 1e-14 {
            break;
        }
    }
    shape(xi, eta)
}

pub(super) fn combine(corners: &[Point], weights: &[f64]) -> Point {
    std::array::from_fn(|axis| {
        corners.iter().zip(weights).map(|(corner, weight)| weight * corner[axis]).sum()
    })
}

pub(super) fn minus(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

pub(super) fn dot(a: &Point, b: &Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: &Point, b: &Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
