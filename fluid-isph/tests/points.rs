//! The fluid's own points in place of a dummy mesh: laid out as in the mesh, and the water cannot tell the two apart.

#![expect(clippy::unwrap_used, reason = "a failing helper must fail the test")]

mod common;

use common::{at_rest, floor_plate, outline, upright_plate};
use fluid_isph::body_layout::{LayoutRules, embed_particles};
use fluid_isph::kernel::Kernel;
use fluid_isph::offer::Offer;
use fluid_isph::scene::{Scene, Tank, WaterBox};
use fluid_isph::{Fluid, Motion, Structure};
use protocol::case::BoxFace;
use protocol::interface::{BodyMesh, PointWall, Response};

/// The tank of the dam break with its wall, or a tank with a floor plate.
fn scene<const D: usize>(tank: Tank<D>, spacing: f64, wet: [bool; 2]) -> Scene<D> {
    let water = WaterBox { min: tank.min, max: tank.min.map(|x| x + 0.04), velocity: [0.0; D] };
    let mut scene = Scene::new(tank, vec![water], spacing);
    scene.body_wet = Some(wet);
    scene
}

fn offer<const D: usize>(scene: &Scene<D>, mesh: &BodyMesh, wet: &[BoxFace]) -> Offer<D> {
    let kernel = Kernel::new(scene.kernel, scene.particle_spacing);
    Offer::lay_out(&outline(mesh, wet), LayoutRules::new(scene, &kernel)).unwrap()
}

/// Places and volumes are those in the cells of the mesh, in the same order.
fn compare<const D: usize>(scene: &Scene<D>, mesh: &BodyMesh, wet: &[BoxFace]) -> Offer<D> {
    let kernel = Kernel::new(scene.kernel, scene.particle_spacing);
    let expected = embed_particles(mesh, LayoutRules::new(scene, &kernel)).unwrap();
    let offer = offer(scene, mesh, wet);
    assert_eq!(offer.particle_count(), expected.len());
    assert_eq!(expected.len() % offer.layers, 0);
    for (k, particle) in expected.iter().enumerate() {
        let x = particle.position(mesh);
        assert!((0..D).all(|axis| (offer.position[k][axis] - x[axis]).abs() < 1e-12), "particle {k}: {x:?}");
        assert!((offer.volume[k] / particle.volume - 1.0).abs() < 1e-12, "particle {k}");
    }
    offer
}

const UPRIGHT: [BoxFace; 3] = [BoxFace::Left, BoxFace::Right, BoxFace::Top];

fn dam_tank() -> Tank<2> {
    Tank { min: [0.0; 2], max: [0.584, 1.0], open: [[false; 2], [false, true]] }
}

#[test]
fn the_particles_are_those_of_a_dummy_mesh() {
    // The wall of the dam break, as the case has it.
    let wall = upright_plate((0.292, 0.012, 0.08), 16, Response::Robin);
    for (spacing, layers) in [(0.006, 2), (0.004, 3), (0.003, 4)] {
        let offer = compare(&scene(dam_tank(), spacing, [true; 2]), &wall, &UPRIGHT);
        assert_eq!(offer.layers, layers);
    }
    // A floor between two side walls, continued below its dry face; ghost rows at all four edges.
    let tank =
        Tank { min: [0.0, -0.1, 0.0], max: [0.2, 0.3, 0.1], open: [[false; 2], [true; 2], [false; 2]] };
    let floor = floor_plate((0.2, 0.02, Some(0.1)), 7, (Response::Given, 1.0));
    let offer = compare(&scene(tank, 0.01, [false, true]), &floor, &[BoxFace::Top]);
    assert_eq!((offer.layers, offer.particle_count()), (3, 3 * (20 + 6) * (10 + 6)));
}

/// Areas add up to the wet area; each marker lies in its face, off the edges.
#[test]
fn the_markers_cover_the_wet_faces() {
    let wall = upright_plate((0.292, 0.012, 0.08), 16, Response::Robin);
    let plane = offer(&scene(dam_tank(), 0.003, [true; 2]), &wall, &UPRIGHT);
    assert_eq!(plane.area.len(), 2 * 27 + 4);
    check_markers(&plane, 2.0 * 0.08 + 0.012, &wall);
    let tank =
        Tank { min: [0.0, -0.1, 0.0], max: [0.2, 0.3, 0.1], open: [[false; 2], [true; 2], [false; 2]] };
    let floor = floor_plate((0.2, 0.02, Some(0.1)), 7, (Response::Given, 1.0));
    let wet = [BoxFace::Top, BoxFace::Right, BoxFace::Front];
    let space = offer(&scene(tank, 0.009, [false, true]), &floor, &wet);
    assert_eq!(space.area.len(), 22 * 11 + 2 * 11 + 22 * 2);
    check_markers(&space, 0.2 * 0.1 + 0.02 * 0.1 + 0.2 * 0.02, &floor);
}

fn check_markers<const D: usize>(offer: &Offer<D>, wet_area: f64, mesh: &BodyMesh) {
    let total: f64 = offer.area.iter().sum();
    assert!((total / wet_area - 1.0).abs() < 1e-12, "{total} of {wet_area} m2");
    let region = outline(mesh, &[]).region;
    for x in &offer.position[offer.particle_count()..] {
        let on = (0..D).filter(|&k| x[k] == region.min[k] || x[k] == region.max[k]).count();
        let within = (0..D).all(|k| region.min[k] <= x[k] && x[k] <= region.max[k]);
        assert!(on == 1 && within, "{x:?}");
    }
    let points = offer.points();
    assert_eq!(points.markers(), (offer.particle_count()..offer.len()).collect::<Vec<_>>());
}

/// Still water 0.25 m deep on the left of a wall from 0.25 to 0.3 m, on the floor.
fn basin() -> Scene<2> {
    let tank = Tank { min: [0.0; 2], max: [0.5, 0.4], open: [[false; 2], [false, true]] };
    let water = WaterBox { min: [0.0; 2], max: [0.25; 2], velocity: [0.0; 2] };
    let mut scene = Scene::new(tank, vec![water], 0.025);
    scene.body_wet = Some([true; 2]);
    scene
}

/// Outward normals of the face nearest to each point of the basin's wall.
fn nearest_normals(offer: &Offer<2>) -> Vec<f64> {
    let of = |x: &[f64; 2]| {
        let to = [(x[0] - 0.25, [-1.0, 0.0]), (0.3 - x[0], [1.0, 0.0]), (0.3 - x[1], [0.0, 1.0])];
        to.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
    };
    offer.position.iter().flat_map(of).collect()
}

/// Runs both and compares them: the wall's particles one by one, and force and moment of what goes out. In a mesh of one cell
/// the places agree to the last bit; with more the rounding of places alone, seen through the pressure solve, is 1e-4.
fn compare_runs(response: Response) -> (Fluid<2>, Offer<2>) {
    let mut mesh = upright_plate((0.25, 0.05, 0.3), 1, response);
    mesh.response_mass.fill(20.0);
    let offer = offer(&basin(), &mesh, &UPRIGHT);
    let wall = PointWall { response, response_mass: vec![20.0; offer.len()] };
    let mut in_mesh = Fluid::new(basin(), Some(&Structure::Mesh(mesh.clone()))).unwrap();
    let mut at_points = Fluid::new(basin(), Some(&Structure::Points(offer.clone(), wall))).unwrap();
    let (still, normals) = (vec![0.0; mesh.reference_position.len()], nearest_normals(&offer));
    let (points, rest) = (offer.position.as_flattened(), vec![0.0; 2 * offer.len()]);
    for _ in 0..200 {
        in_mesh.advance(5e-4, Some(at_rest(&mesh.reference_position, &still))).unwrap();
        let motion = Motion { normal: Some(&normals), ..at_rest(points, &rest) };
        at_points.advance(5e-4, Some(motion)).unwrap();
    }
    let columns = in_mesh.walls().body();
    for wall in columns.clone() {
        let [expected, found] = [&in_mesh, &at_points].map(|fluid| fluid.walls().pressure[wall]);
        let close = |side: usize| (expected[side] - found[side]).abs() <= 1e-10 * 2000.0;
        assert!(close(0) && close(1), "{wall}: {expected:?} {found:?}");
    }
    let expected = resultant(in_mesh.pair_force(), &mesh.reference_position);
    let found = resultant(at_points.pair_force(), points);
    for k in 0..3 {
        assert!((found[k] - expected[k]).abs() < 1e-10 * expected[0].abs(), "{expected:?} {found:?}");
    }
    assert!(at_points.pair_force()[2 * columns.len()..].iter().all(|&force| force == 0.0));
    (at_points, offer)
}

/// Force, N/m, and moment about the origin, N.
fn resultant(force: &[f64], position: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (f, x) in force.as_chunks::<2>().0.iter().zip(position.as_chunks::<2>().0) {
        let arm = x[0] * f[1] - x[1] * f[0];
        sum = [sum[0] + f[0], sum[1] + f[1], sum[2] + arm];
    }
    sum
}

#[test]
fn water_does_not_tell_points_from_a_mesh() {
    let (fluid, offer) = compare_runs(Response::Given);
    let force = resultant(fluid.pair_force(), offer.position.as_flattened())[0];
    // Ten rows deep: of the lowest one's push the floor's particles beneath the wall take a part.
    assert!((force / (0.5 * 9810.0 * 0.25 * 0.25) - 1.0).abs() < 0.05, "{force} N/m");
    // p = rho g (H - z) at the markers of the wet side, nothing at the others.
    for (x, &pressure) in offer.position[offer.particle_count()..].iter().zip(fluid.marker_pressure()) {
        let depth = if x[0] == 0.25 { (0.25 - x[1]).max(0.0) } else { 0.0 };
        assert!((pressure - 9810.0 * depth).abs() < 0.02 * 2452.5, "{pressure} Pa at {x:?}");
    }
}

#[test]
fn nor_at_a_wall_that_gives_way() {
    compare_runs(Response::Robin);
}

/// The director, which tells one side of the wall from the other, turns with the wall, whatever the normals near its top.
#[test]
fn the_director_turns_with_the_columns() {
    let mesh = upright_plate((0.25, 0.05, 0.3), 1, Response::Given);
    let offer = offer(&basin(), &mesh, &UPRIGHT);
    let wall = PointWall { response: Response::Given, response_mass: vec![0.0; offer.len()] };
    let mut fluid = Fluid::new(basin(), Some(&Structure::Points(offer.clone(), wall))).unwrap();
    // Away from the water, by a right angle about the wall's foot at (0.3, 0).
    let turned: Vec<f64> = offer.position.iter().flat_map(|x| [0.3 + x[1], 0.3 - x[0]]).collect();
    let (rest, upwards) = (vec![0.0; turned.len()], [0.0, 1.0].repeat(offer.len()));
    fluid.advance(1e-4, Some(Motion { normal: Some(&upwards), ..at_rest(&turned, &rest) })).unwrap();
    let walls = fluid.walls();
    for director in &walls.director[walls.body()] {
        assert!(director[0].abs() < 1e-12 && (director[1] + 1.0).abs() < 1e-12, "{director:?}");
    }
}
