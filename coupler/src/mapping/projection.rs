//! Nearest projection: every node of the fluid's side follows the point of the solid's surface nearest to it, by the
//! facet's own shape functions (linear on segments and triangles, bilinear on quadrilaterals); points off the surface
//! turn with it.

use std::collections::{BTreeMap, BTreeSet};

use protocol::interface::{Facets, InterfaceMarker, Surface};
use rstar::primitives::GeomWithData;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use super::couple::{Couple, Place};
use super::{MappingError, Rows, Sparse};
use crate::dummy_mesh::DummyMesh;

type Point = [f64; 3];

/// Where to project: node positions `[n, D]` m and the facets over them, in a tree of boxes.
struct Target<'a> {
    dimension: usize,
    position: &'a [f64],
    tree: RTree<Shape>,
}

/// One facet in the tree.
struct Shape {
    /// Number of the facet.
    facet: usize,
    face: usize,
    nodes: Vec<usize>,
    corners: Vec<Point>,
}

impl RTreeObject for Shape {
    type Envelope = AABB<Point>;

    /// A bilinear facet lies in the box of its corners.
    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.corners)
    }
}

impl Shape {
    /// Mean length of the edges, m.
    fn size(&self) -> f64 {
        let count = self.corners.len();
        let edges = if count == 2 { 1 } else { count };
        let edge = |k: usize| minus(&self.corners[(k + 1) % count], &self.corners[k]);
        (0..edges).map(|k| dot(&edge(k), &edge(k)).sqrt()).sum::<f64>() / edges as f64
    }

    /// Unit vectors along the facet at right angles; in 2-D the second is not used.
    fn tangents(&self) -> [Point; 2] {
        let unit = |v: Point| v.map(|component| component / dot(&v, &v).sqrt());
        let first = unit(minus(&self.corners[1], &self.corners[0]));
        let other = minus(self.corners.last().expect("a facet has corners"), &self.corners[0]);
        let along = dot(&other, &first);
        let second: Point = std::array::from_fn(|axis| other[axis] - along * first[axis]);
        [first, if self.corners.len() == 2 { second } else { unit(second) }]
    }
}

impl PointDistance for Shape {
    fn distance_2(&self, point: &Point) -> f64 {
        let off = minus(point, &combine(&self.corners, &facet_weights(point, &self.corners)));
        dot(&off, &off)
    }
}

/// Distance from the surface below which a point lies on it, relative to the size of the body.
const ON_SURFACE: f64 = 1e-9;

/// Nodes of a patch beside the corners of its facet at most.
const MOST_OTHERS: usize = 12;

/// Samples of a footprint along one direction at most.
const MOST_SAMPLES: f64 = 16.0;

/// Rows of points, `[n, D]` m, that are as wide as `width` says, m.
pub(super) fn rows(
    points: &[f64],
    width: impl Fn(usize) -> f64,
    surface: &Surface,
) -> Result<(Rows, Vec<Couple>), MappingError> {
    if surface.facets.is_empty() {
        return Err(MappingError::NoFacet);
    }
    let dimension = surface.dimension;
    let target = Target::new(dimension, &surface.reference_position, &surface.facets);
    let size = surface.reference_position.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let mut rows = Rows::new();
    // The points off the surface, facet by facet.
    let mut hanging: BTreeMap<usize, Vec<(usize, Point)>> = BTreeMap::new();
    for (number, point) in points.chunks_exact(dimension).enumerate() {
        let (shape, weights) = target.nearest(point, None).expect("there is a facet");
        // Not one more for the sake of round-off.
        let row = match (width(number) / shape.size() * (1.0 - 1e-9)).min(MOST_SAMPLES).ceil() {
            count if count > 1.0 => target.footprint((shape, &weights), width(number), count),
            _ => shape.nodes.iter().copied().zip(weights).collect(),
        };
        let foot = row.iter().fold([0.0; 3], |foot, &(node, weight)| {
            let x = target.node(node);
            std::array::from_fn(|axis| foot[axis] + weight * x[axis])
        });
        let offset = minus(&padded(point), &foot);
        if dot(&offset, &offset).sqrt() > ON_SURFACE * size {
            hanging.entry(shape.facet).or_default().push((number, offset));
        }
        rows.push(row);
    }
    let patches = Patches::new(&target, surface);
    let couple = |(&facet, points): (&usize, &Vec<(usize, Point)>)| {
        let reach = points.iter().map(|(_, offset)| dot(offset, offset).sqrt()).fold(0.0, f64::max);
        let corners = surface.facets.facet(facet);
        Couple::new(dimension, (corners.len(), &patches.around(facet, reach)), points)
    };
    let couples = hanging.iter().filter_map(couple).collect();
    Ok((rows, couples))
}

/// The nodes of a surface, to be found by face and place.
struct Patches<'a> {
    target: &'a Target<'a>,
    facets: &'a Facets,
    tree: RTree<GeomWithData<Point, InterfaceMarker>>,
}

impl<'a> Patches<'a> {
    fn new(target: &'a Target<'a>, surface: &'a Surface) -> Self {
        let markers = surface.facets.markers().into_iter();
        let tree = markers.map(|marker| GeomWithData::new(target.node(marker.node), marker)).collect();
        Self { target, facets: &surface.facets, tree: RTree::bulk_load(tree) }
    }

    /// The corners of a facet, then other nodes of its face within `reach` m of its centre: all, or as many of them as the
    /// noise of a rotation asks for.
    fn around(&self, facet: usize, reach: f64) -> Vec<Place> {
        let corners = self.facets.facet(facet);
        let mut nodes = corners.to_vec();
        let places: Vec<_> = corners.iter().map(|&node| self.target.node(node)).collect();
        let centre = combine(&places, &vec![1.0 / corners.len() as f64; corners.len()]);
        let near = self.tree.locate_within_distance(centre, reach * reach).map(|found| found.data);
        let is_other = |marker: &InterfaceMarker| {
            marker.face == self.facets.face[facet] && !corners.contains(&marker.node)
        };
        let others: BTreeSet<_> = near.filter(is_other).map(|marker| marker.node).collect();
        nodes.extend(others.iter().step_by(others.len().div_ceil(MOST_OTHERS).max(1)));
        nodes.into_iter().map(|node| (node, self.target.node(node))).collect()
    }
}

/// For every point the solid's markers at its foot, on the face under it, with weights.
pub fn feet(points: &[f64], surface: &Surface) -> Vec<Vec<(usize, f64)>> {
    let dimension = surface.dimension;
    let target = Target::new(dimension, &surface.reference_position, &surface.facets);
    let markers = surface.facets.markers();
    let foot = |point: &[f64]| target.nearest(point, None).map_or(Vec::new(), |at| at_markers(&markers, at));
    points.chunks_exact(dimension).map(foot).collect()
}

/// For every marker of the solid the markers of the fluid's side, on the same face, that give its traction, with weights.
pub fn marker_rows(dummy: &DummyMesh, surface: &Surface) -> Sparse {
    let dimension = surface.dimension;
    let target = Target::new(dimension, dummy.reference_position(), dummy.facets());
    let markers = dummy.facets().markers();
    let row = |marker: InterfaceMarker| {
        let point = &surface.reference_position[marker.node * dimension..][..dimension];
        target.nearest(point, Some(marker.face)).map_or(Vec::new(), |at| at_markers(&markers, at))
    };
    Sparse::pack(surface.facets.markers().into_iter().map(row).collect())
}

/// The markers at the corners of a facet, with the weights of these.
fn at_markers(markers: &[InterfaceMarker], (shape, weights): (&Shape, Vec<f64>)) -> Vec<(usize, f64)> {
    let marker = |&node: &usize| {
        let found = markers.binary_search(&InterfaceMarker { face: shape.face, node });
        found.expect("every facet node has a marker of its face")
    };
    shape.nodes.iter().map(marker).zip(weights).collect()
}

impl<'a> Target<'a> {
    fn new(dimension: usize, position: &'a [f64], facets: &Facets) -> Self {
        let mut target = Self { dimension, position, tree: RTree::new() };
        let shape = |facet: usize| {
            let nodes = facets.facet(facet).to_vec();
            let corners = nodes.iter().map(|&node| target.node(node)).collect();
            Shape { facet, face: facets.face[facet], nodes, corners }
        };
        target.tree = RTree::bulk_load((0..facets.len()).map(shape).collect());
        target
    }

    fn node(&self, node: usize) -> Point {
        padded(&self.position[node * self.dimension..][..self.dimension])
    }

    /// The mean row of `count` samples (in space its square) of a footprint of this width, m, about a foot on a facet.
    fn footprint(&self, (shape, weights): (&Shape, &[f64]), width: f64, count: f64) -> Vec<(usize, f64)> {
        let foot = combine(&shape.corners, weights);
        let [first, second] = shape.tangents();
        let steps = |is_wanted: bool| if is_wanted { count as usize } else { 1 };
        let place = |step: usize, steps: usize| width * ((step as f64 + 0.5) / steps as f64 - 0.5);
        let (along, up) = (steps(true), steps(self.dimension == 3));
        let mut row = BTreeMap::new();
        for (i, j) in (0..along).flat_map(|i| (0..up).map(move |j| (i, j))) {
            let (a, b) = (place(i, along), place(j, up));
            let sample: Point = std::array::from_fn(|axis| foot[axis] + a * first[axis] + b * second[axis]);
            let (under, weights) =
                self.nearest(&sample[..self.dimension], Some(shape.face)).expect("the face has a facet");
            for (&node, weight) in under.nodes.iter().zip(weights) {
                *row.entry(node).or_insert(0.0) += weight / (along * up) as f64;
            }
        }
        row.into_iter().collect()
    }

    /// The facet (of one face only, if given) nearest to `point`, and its shape functions at the nearest place; none without
    /// a facet.
    fn nearest(&self, point: &[f64], face: Option<usize>) -> Option<(&Shape, Vec<f64>)> {
        let point = padded(point);
        let mut by_distance = self.tree.nearest_neighbor_iter(point);
        let nearest = by_distance.find(|shape| face.is_none_or(|face| shape.face == face))?;
        Some((nearest, facet_weights(&point, &nearest.corners)))
    }
}

fn padded(point: &[f64]) -> Point {
    std::array::from_fn(|axis| point.get(axis).copied().unwrap_or_default())
}

/// Shape functions at the point of the facet nearest to `point`.
fn facet_weights(point: &Point, corners: &[Point]) -> Vec<f64> {
    match corners.len() {
        2 => {
            let t = segment_parameter(point, &corners[0], &corners[1]);
            vec![1.0 - t, t]
        }
        3 => triangle_weights(point, corners),
        _ => quadrilateral_weights(point, corners),
    }
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

fn combine(corners: &[Point], weights: &[f64]) -> Point {
    std::array::from_fn(|axis| {
        corners.iter().zip(weights).map(|(corner, weight)| weight * corner[axis]).sum()
    })
}

fn minus(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn dot(a: &Point, b: &Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
