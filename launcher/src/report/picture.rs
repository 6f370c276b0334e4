//! Pictures of the flow and the structure at an instant, drawn from the field files as PNG.
//!
//! Water is coloured by its speed, the structure is drawn in its current place. In 3-D the view is oblique, far
//! things first.

use std::path::Path;

use protocol::vtk::{self, Frame};

/// Share of the depth that an oblique view shows sideways and upwards.
const OBLIQUE: (f32, f32) = (0.35, 0.22);
const WIDTH: usize = 900;
/// Radius a particle is drawn with, in spacings: neighbours overlap a little.
const RADIUS: f32 = 0.62;
/// Share of the particles that the scales of height and speed cover: a few drops do not set them.
const COVERED: f32 = 0.997;
const BACKGROUND: [u8; 3] = [250, 250, 248];
const STRUCTURE: [u8; 3] = [178, 74, 42];
const EDGE: [u8; 3] = [128, 50, 26];
const WALL: [u8; 3] = [90, 96, 104];

/// What all pictures of a run have in common.
pub(super) struct View {
    /// Lower left corner of the picture, m.
    origin: (f32, f32),
    scale: f32,
    height: usize,
    /// Radius of a particle, m.
    radius: f32,
    /// Speed drawn lightest, m/s.
    fastest: f32,
    /// The tank: least and greatest corner, m.
    tank: ([f32; 3], [f32; 3]),
}

struct Canvas {
    width: usize,
    pixels: Vec<u8>,
}

fn project(point: [f32; 3]) -> (f32, f32) {
    (point[0] + OBLIQUE.0 * point[2], point[1] + OBLIQUE.1 * point[2])
}

fn points(frame: &Frame) -> impl Iterator<Item = [f32; 3]> + '_ {
    frame.points.chunks_exact(3).map(|p| [p[0], p[1], p[2]])
}

fn speeds(frame: &Frame) -> Vec<f32> {
    let velocity = frame.column("velocity_m_s").unwrap_or_default();
    velocity.chunks_exact(3).map(|v| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()).collect()
}

/// The value that nearly all of the values do not exceed; 0 without values.
fn nearly_all(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    let index = (COVERED * values.len() as f32) as usize;
    values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or_default()
}

impl View {
    /// A view that shows the tank up to the highest water of all frames; `particle` is the particle size, m.
    pub(super) fn new(frames: &[Frame], tank: ([f32; 3], [f32; 3]), particle: f32) -> Self {
        let (least, mut greatest) = tank;
        let heights = frames.iter().flat_map(points).map(|p| p[1]).collect();
        greatest[1] = greatest[1].min(nearly_all(heights) + 4.0 * particle).max(least[1] + 4.0 * particle);
        let (left, bottom) = project(least);
        let (right, upper) = project(greatest);
        let scale = (WIDTH - 20) as f32 / (right - left);
        let height = ((upper - bottom) * scale) as usize + 20;
        let fastest = nearly_all(frames.iter().flat_map(speeds).collect()).max(1e-6);
        let margin = 10.0 / scale;
        Self {
            origin: (left - margin, bottom - margin),
            scale,
            height: height.clamp(60, 1200),
            radius: RADIUS * particle,
            fastest,
            tank: (least, greatest),
        }
    }

    /// Speed drawn lightest, m/s.
    pub(super) fn fastest(&self) -> f32 {
        self.fastest
    }

    /// The picture as PNG bytes.
    pub(super) fn draw(&self, water: Option<&Frame>, solid: Option<&Frame>) -> Vec<u8> {
        let mut canvas = Canvas { width: WIDTH, pixels: BACKGROUND.repeat(WIDTH * self.height) };
        self.draw_tank(&mut canvas);
        // Everything in one list from far to near: (depth, what).
        let mut discs: Vec<([f32; 3], [u8; 3])> = Vec::new();
        if let Some(frame) = water {
            let colours = speeds(frame).into_iter().map(|speed| water_colour(speed / self.fastest));
            discs.extend(points(frame).zip(colours.chain(std::iter::repeat(water_colour(0.0)))));
        }
        discs.sort_by(|a, b| b.0[2].total_cmp(&a.0[2]));
        for (point, colour) in discs {
            self.disc(&mut canvas, point, colour);
        }
        if let Some(frame) = solid {
            self.draw_solid(&mut canvas, frame);
        }
        canvas.encode()
    }

    fn pixel(&self, point: [f32; 3]) -> (f32, f32) {
        let (x, y) = project(point);
        ((x - self.origin.0) * self.scale, self.height as f32 - (y - self.origin.1) * self.scale)
    }

    fn draw_tank(&self, canvas: &mut Canvas) {
        let (least, greatest) = self.tank;
        let corner = |x: bool, y: bool| {
            [if x { greatest[0] } else { least[0] }, if y { greatest[1] } else { least[1] }, least[2]]
        };
        for (from, to) in
            [((false, true), (false, false)), ((false, false), (true, false)), ((true, false), (true, true))]
        {
            let (from, to) = (self.pixel(corner(from.0, from.1)), self.pixel(corner(to.0, to.1)));
            canvas.line(from, to, WALL);
        }
    }

    fn disc(&self, canvas: &mut Canvas, point: [f32; 3], colour: [u8; 3]) {
        let (x, y) = self.pixel(point);
        let radius = (self.radius * self.scale).max(0.8);
        let reach = radius.ceil() as i64;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (px, py) = (x as i64 + dx, y as i64 + dy);
                let (ex, ey) = (px as f32 + 0.5 - x, py as f32 + 0.5 - y);
                if ex * ex + ey * ey <= radius * radius {
                    canvas.set(px, py, colour);
                }
            }
        }
    }

    /// Every cell is filled by its nodes' polygon: quadrilaterals and triangles as they are, solids by all their faces.
    fn draw_solid(&self, canvas: &mut Canvas, frame: &Frame) {
        let node = |index: usize| -> [f32; 3] { std::array::from_fn(|axis| frame.points[3 * index + axis]) };
        let faces: &[&[usize]] = match frame.nodes_per_cell {
            3 => &[&[0, 1, 2]],
            8 => &[&[0, 1, 2, 3], &[4, 5, 6, 7], &[0, 1, 5, 4], &[2, 3, 7, 6], &[1, 2, 6, 5], &[0, 3, 7, 4]],
            4 if points(frame).any(|p| p[2] != 0.0) => &[&[0, 1, 2], &[0, 1, 3], &[1, 2, 3], &[0, 2, 3]],
            4 => &[&[0, 1, 2, 3]],
            _ => return,
        };
        let mut cells: Vec<_> = frame.connectivity.chunks_exact(frame.nodes_per_cell).collect();
        let depth = |cell: &[usize]| cell.iter().map(|&index| node(index)[2]).sum::<f32>();
        cells.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        for cell in cells {
            for face in faces {
                let polygon: Vec<_> = face.iter().map(|&corner| self.pixel(node(cell[corner]))).collect();
                canvas.polygon(&polygon, STRUCTURE);
                for (index, &from) in polygon.iter().enumerate() {
                    canvas.line(from, polygon[(index + 1) % polygon.len()], EDGE);
                }
            }
        }
    }
}

/// Deep blue at rest to nearly white at the greatest speed.
fn water_colour(share: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 4] =
        [[18.0, 52.0, 110.0], [32.0, 108.0, 178.0], [92.0, 176.0, 214.0], [226.0, 243.0, 246.0]];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let low = (place as usize).min(STOPS.len() - 2);
    let part = place - low as f32;
    std::array::from_fn(|i| (STOPS[low][i] * (1.0 - part) + STOPS[low + 1][i] * part) as u8)
}

impl Canvas {
    fn set(&mut self, x: i64, y: i64, colour: [u8; 3]) {
        if x >= 0 && (x as usize) < self.width && y >= 0 {
            let at = 3 * (y as usize * self.width + x as usize);
            if let Some(pixel) = self.pixels.get_mut(at..at + 3) {
                pixel.copy_from_slice(&colour);
            }
        }
    }

    fn line(&mut self, from: (f32, f32), to: (f32, f32), colour: [u8; 3]) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0) as usize;
        for step in 0..=steps {
            let share = step as f32 / steps as f32;
            let (x, y) = (from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1));
            (0..2).for_each(|thick| self.set(x as i64 + thick, y as i64 + thick, colour));
        }
    }

    /// Fills a polygon by the even-odd rule.
    fn polygon(&mut self, corners: &[(f32, f32)], colour: [u8; 3]) {
        let low = corners.iter().map(|c| c.1).fold(f32::INFINITY, f32::min).floor() as i64;
        let high = corners.iter().map(|c| c.1).fold(f32::NEG_INFINITY, f32::max).ceil() as i64;
        for y in low..=high {
            let at = y as f32 + 0.5;
            let mut cuts = Vec::new();
            for (index, &a) in corners.iter().enumerate() {
                let b = corners[(index + 1) % corners.len()];
                if (a.1 <= at) != (b.1 <= at) {
                    cuts.push(a.0 + (at - a.1) / (b.1 - a.1) * (b.0 - a.0));
                }
            }
            cuts.sort_by(f32::total_cmp);
            for pair in cuts.chunks_exact(2) {
                (pair[0].round() as i64..=pair[1].round() as i64).for_each(|x| self.set(x, y, colour));
            }
        }
    }

    fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let height = self.pixels.len() / 3 / self.width;
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&self.pixels));
        written.expect("writing a picture to memory cannot fail");
        bytes
    }
}

/// The frames of one participant: time (s) and file, from its `.pvd`.
pub(super) fn frames(fields: &Path, name: &str) -> Vec<(f64, std::path::PathBuf)> {
    let text = std::fs::read_to_string(fields.join(name)).unwrap_or_default();
    let attribute = |line: &str, name: &str| {
        let rest = line.split_once(&format!("{name}=\""))?.1;
        Some(rest.split_once('"')?.0.to_owned())
    };
    let entry = |line: &str| {
        let time = attribute(line, "timestep")?.parse().ok()?;
        Some((time, fields.join(attribute(line, "file")?)))
    };
    text.lines().filter_map(entry).collect()
}

/// Reads a frame; a missing or damaged one is no picture.
pub(super) fn read(path: &Path) -> Option<Frame> {
    vtk::read(path).ok()
}
