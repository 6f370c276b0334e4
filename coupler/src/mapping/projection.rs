//! Nearest projection: every node of the fluid's side follows the point of the solid's surface nearest to it, by the
//! facet's own shape functions (linear on segments and triangles, bilinear on quadrilaterals); points off the surface
//! turn with it.

use std::collections::BTreeMap;

use protocol::interface::{Facets, InterfaceMarker, Surface};
use rstar::RTree;

use super::couple::{Couple, Place};
use super::facet::{Facet, Point, combine, dot, minus, padded};
use super::{MappingError, Rows, Sparse};
use crate::dummy_mesh::DummyMesh;

/// Where to project: node positions `[n, D]` m and the facets over them, by face.
struct Target<'a> {
    dimension: usize,
    position: &'a [f64],
    faces: BTreeMap<usize, RTree<Facet>>,
    /// Distance below which a point lies on the surface, m.
    round_off: f64,
}

/// The place of a surface nearest to a point: its facet, the shape functions there, and the way from it to the point, m.
struct Foot<'t> {
    facet: &'t Facet,
    weights: Vec<f64>,
    offset: Point,
}

/// A facet, and the points that hang on it: number and offset, m.
type Hanging<'t> = (&'t Facet, Vec<(usize, Point)>);

/// Distance from the surface below which a point lies on it, relative to the size of the body.
const ON_SURFACE: f64 = 1e-9;

/// Cosine between the ways to two faces of a body from a point inside, above which they do not lie on opposite sides of it.
const OPPOSITE: f64 = -0.7;

/// How far a patch reaches from the middle of its facet, in levers of the farthest point on it: its rotation carries at most
/// half the noise of its nodes to that.
const LEVERS: f64 = 2.0;

/// Samples of a footprint along one direction at most.
const MOST_SAMPLES: f64 = 16.0;

/// Rows of the nodes of a mesh, `[n, D]` m, all of which follow the place of the surface nearest to them.
pub(super) fn rows(points: &[f64], surface: &Surface) -> Result<(Rows, Vec<Couple>), MappingError> {
    tie(points, surface, |target, _, point| vec![(target.nearest(point), 1.0, 0.0)])
}

/// Rows of points without a mesh, `[n, D]` m, as wide as `widths` says, m. Those between two faces of a body keep their place
/// between these, as in a cell from the one to the other.
pub(super) fn rows_of_points(
    points: &[f64],
    widths: &[f64],
    surface: &Surface,
) -> Result<(Rows, Vec<Couple>), MappingError> {
    tie(points, surface, |target, number, point| match target.between(point) {
        Some((near, far)) => {
            let share = near.distance() / (near.distance() + far.distance());
            vec![(near, 1.0 - share, widths[number]), (far, share, widths[number])]
        }
        None => vec![(target.nearest(point), 1.0, widths[number])],
    })
}

/// Ties each point to its feet, each with its share and its width, m; a point that is off their mean hangs on the first.
fn tie<'s>(
    points: &[f64],
    surface: &'s Surface,
    feet: impl for<'t> Fn(&'t Target<'s>, usize, &Point) -> Vec<(Foot<'t>, f64, f64)>,
) -> Result<(Rows, Vec<Couple>), MappingError> {
    if surface.facets.is_empty() {
        return Err(MappingError::NoFacet);
    }
    let dimension = surface.dimension;
    let target = Target::new(dimension, &surface.reference_position, &surface.facets);
    let mut rows = Rows::new();
    // The points off the surface, facet by facet.
    let mut hanging: BTreeMap<usize, Hanging<'_>> = BTreeMap::new();
    for (number, point) in points.chunks_exact(dimension).map(padded).enumerate() {
        let feet = feet(&target, number, &point);
        let mut row = BTreeMap::new();
        for (foot, share, width) in &feet {
            for (node, weight) in target.footprint(foot, *width) {
                *row.entry(node).or_insert(0.0) += share * weight;
            }
        }
        let mean = row.iter().fold([0.0; 3], |mean, (&node, weight)| {
            let x = target.node(node);
            std::array::from_fn(|axis| mean[axis] + weight * x[axis])
        });
        let offset = minus(&point, &mean);
        if dot(&offset, &offset).sqrt() > target.round_off {
            let facet = feet[0].0.facet;
            hanging.entry(facet.number).or_insert((facet, Vec::new())).1.push((number, offset));
        }
        rows.push(row.into_iter().collect());
    }
    let couple = |(facet, points): &Hanging<'_>| {
        let lever = points.iter().map(|(_, offset)| dot(offset, offset).sqrt()).fold(0.0, f64::max);
        Couple::new(dimension, (facet.nodes.len(), &target.patch(facet, LEVERS * lever)), points)
    };
    let couples = hanging.values().filter_map(couple).collect();
    Ok((rows, couples))
}

/// For every point the solid's markers at its foot, on the face under it, with weights.
pub fn feet(points: &[f64], surface: &Surface) -> Vec<Vec<(usize, f64)>> {
    if surface.facets.is_empty() {
        return vec![Vec::new(); points.len() / surface.dimension];
    }
    let target = Target::new(surface.dimension, &surface.reference_position, &surface.facets);
    let markers = surface.facets.markers();
    let foot = |point: &[f64]| target.nearest(&padded(point)).at_markers(&markers);
    points.chunks_exact(surface.dimension).map(foot).collect()
}

/// For every marker of the solid the markers of the fluid's side, on the same face, that give its traction, with weights.
pub fn marker_rows(dummy: &DummyMesh, surface: &Surface) -> Sparse {
    let dimension = surface.dimension;
    let target = Target::new(dimension, dummy.reference_position(), dummy.facets());
    let markers = dummy.facets().markers();
    let row = |marker: InterfaceMarker| {
        let point = padded(&surface.reference_position[marker.node * dimension..][..dimension]);
        target.nearest_on(marker.face, &point).map_or(Vec::new(), |foot| foot.at_markers(&markers))
    };
    Sparse::pack(surface.facets.markers().into_iter().map(row).collect())
}

impl Foot<'_> {
    fn distance(&self) -> f64 {
        dot(&self.offset, &self.offset).sqrt()
    }

    /// Whether the point lies on the inner side of the facet.
    fn is_inside(&self) -> bool {
        dot(&self.offset, &self.facet.outwards()) < 0.0
    }

    /// Whether the point lies between this place and another.
    fn is_opposite(&self, other: &Self) -> bool {
        dot(&self.offset, &other.offset) < OPPOSITE * self.distance() * other.distance()
    }

    /// The markers at the corners of the facet, with the weights of these.
    fn at_markers(&self, markers: &[InterfaceMarker]) -> Vec<(usize, f64)> {
        let marker = |&node: &usize| {
            let found = markers.binary_search(&InterfaceMarker { face: self.facet.face, node });
            found.expect("every facet node has a marker of its face")
        };
        self.facet.nodes.iter().map(marker).zip(self.weights.iter().copied()).collect()
    }
}

impl<'a> Target<'a> {
    fn new(dimension: usize, position: &'a [f64], facets: &Facets) -> Self {
        let mut by_face: BTreeMap<usize, Vec<Facet>> = BTreeMap::new();
        for (number, &face) in facets.face.iter().enumerate() {
            let nodes = facets.facet(number).to_vec();
            let corners =
                nodes.iter().map(|node| padded(&position[node * dimension..][..dimension])).collect();
            by_face.entry(face).or_default().push(Facet { number, face, nodes, corners });
        }
        let faces = by_face.into_iter().map(|(face, facets)| (face, RTree::bulk_load(facets))).collect();
        let size = position.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        Self { dimension, position, faces, round_off: ON_SURFACE * size }
    }

    fn node(&self, node: usize) -> Point {
        padded(&self.position[node * self.dimension..][..self.dimension])
    }

    /// The place of the surface nearest to a point; of equally near ones that of the first face.
    fn nearest(&self, point: &Point) -> Foot<'_> {
        let feet = self.faces.keys().filter_map(|&face| self.nearest_on(face, point));
        feet.min_by(|a, b| a.distance().total_cmp(&b.distance())).expect("there is a facet")
    }

    /// The same of one face; none without a facet.
    fn nearest_on(&self, face: usize, point: &Point) -> Option<Foot<'_>> {
        let facet = self.faces.get(&face)?.nearest_neighbor(*point)?;
        let weights = facet.nearest(point);
        let offset = minus(point, &combine(&facet.corners, &weights));
        Some(Foot { facet, weights, offset })
    }

    /// The places on two faces that a point inside lies between, the nearer first: of all such pairs the one across the
    /// thinnest part of the body.
    fn between(&self, point: &Point) -> Option<(Foot<'_>, Foot<'_>)> {
        let is_inside = |foot: &Foot<'_>| foot.is_inside() && foot.distance() > self.round_off;
        let mut feet: Vec<_> = self.faces.keys().filter_map(|&face| self.nearest_on(face, point)).collect();
        feet.sort_by(|a, b| a.distance().total_cmp(&b.distance()));
        if !is_inside(feet.first()?) {
            return None;
        }
        feet.retain(is_inside);
        let pairs = (0..feet.len()).flat_map(|far| (0..far).map(move |near| (near, far)));
        let across = |&(near, far): &(usize, usize)| feet[near].distance() + feet[far].distance();
        let opposite = pairs.filter(|&(near, far)| feet[near].is_opposite(&feet[far]));
        let (near, far) = opposite.min_by(|a, b| across(a).total_cmp(&across(b)))?;
        // The later one first, so that the earlier one keeps its number.
        let far = feet.swap_remove(far);
        Some((feet.swap_remove(near), far))
    }

    /// The corners of a facet, and the nodes of its face nearest to the places `reach` m from its middle along and up.
    fn patch(&self, facet: &Facet, reach: f64) -> Vec<Place> {
        let count = facet.nodes.len();
        let middle = combine(&facet.corners, &vec![1.0 / count as f64; count]);
        let mut nodes = facet.nodes.clone();
        for (tangent, way) in
            facet.tangents()[..self.dimension - 1].iter().flat_map(|t| [(t, reach), (t, -reach)])
        {
            let place = std::array::from_fn(|axis| middle[axis] + way * tangent[axis]);
            let foot = self.nearest_on(facet.face, &place).expect("the face has a facet");
            let by_weight = |a: &usize, b: &usize| foot.weights[*a].total_cmp(&foot.weights[*b]);
            let corner = (0..foot.weights.len()).max_by(by_weight).expect("a facet has corners");
            let node = foot.facet.nodes[corner];
            if !nodes.contains(&node) {
                nodes.push(node);
            }
        }
        nodes.into_iter().map(|node| (node, self.node(node))).collect()
    }

    /// The mean row of samples (in space a square of them) of a footprint of this width, m, about a foot: one for each facet
    /// along it.
    fn footprint(&self, foot: &Foot<'_>, width: f64) -> Vec<(usize, f64)> {
        let Foot { facet, weights, .. } = foot;
        // Not one more for the sake of round-off.
        let count = (width / facet.size() * (1.0 - 1e-9)).min(MOST_SAMPLES).ceil();
        if count <= 1.0 {
            return facet.nodes.iter().copied().zip(weights.iter().copied()).collect();
        }
        let middle = combine(&facet.corners, weights);
        let [first, second] = facet.tangents();
        let steps = |is_wanted: bool| if is_wanted { count as usize } else { 1 };
        let place = |step: usize, steps: usize| width * ((step as f64 + 0.5) / steps as f64 - 0.5);
        let (along, up) = (steps(true), steps(self.dimension == 3));
        let mut row = BTreeMap::new();
        for (i, j) in (0..along).flat_map(|i| (0..up).map(move |j| (i, j))) {
            let (a, b) = (place(i, along), place(j, up));
            let sample: Point = std::array::from_fn(|axis| middle[axis] + a * first[axis] + b * second[axis]);
            let under = self.nearest_on(facet.face, &sample).expect("the face has a facet");
            for (&node, weight) in under.facet.nodes.iter().zip(under.weights) {
                *row.entry(node).or_insert(0.0) += weight / (along * up) as f64;
            }
        }
        row.into_iter().collect()
    }
}
