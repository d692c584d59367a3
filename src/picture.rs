//! A shaded view of a mesh from above, as a picture.

use crate::geometry::DVec3;
use gdal::DriverManager;
use gdal::raster::{Buffer, RasterCreationOptions};
use std::path::{Path, PathBuf};

/// Nothing under this pixel.
const NOTHING: u32 = u32::MAX;
/// Colour where there is no surface.
const BACKGROUND: [u8; 3] = [24, 24, 28];
/// From where the light comes: high in the north-west, as on a map.
const LIGHT: DVec3 = DVec3::new(-0.48, 0.48, 0.734);
/// Light in the shade.
const AMBIENT: f64 = 0.3;

/// An RGB picture, rows from the north, pixels from the west.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue of each pixel.
    pub pixels: Vec<[u8; 3]>,
    /// The triangle that is seen in each pixel; `u32::MAX` where there is none.
    triangle: Vec<u32>,
}

/// A picture that could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// GDAL refused.
    #[error(
        "{}: cannot write the picture of {width} x {height} pixels: {source}\nhelp: check that the folder exists, can be written and has room",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Why.
        source: gdal::errors::GdalError,
    },
}

impl Picture {
    /// Draws a line wherever the class (grain, true stone) of the seen triangle changes.
    pub fn draw_outlines(&mut self, class_of_triangle: &dyn Fn(usize) -> i64, color: [u8; 3]) {
        let class = |at: usize| match self.triangle[at] {
            NOTHING => i64::MIN,
            triangle => class_of_triangle(triangle as usize),
        };
        let mut line = Vec::new();
        for row in 0..self.height.saturating_sub(1) {
            for column in 0..self.width.saturating_sub(1) {
                let at = row * self.width + column;
                if class(at) != class(at + 1) || class(at) != class(at + self.width) {
                    line.push(at);
                }
            }
        }
        line.into_iter().for_each(|at| self.pixels[at] = color);
    }
}

/// The mesh from above, shaded by a light in the north-west: orthographic, the highest surface wins.
///
/// `vertices` are metres (x east, y north, z up); `width_px` is brought into 1 to 8192. Triangles that
/// refer to missing vertices or to coordinates that are no numbers are left out.
pub fn top_view(
    vertices: &[[f32; 3]],
    triangles: &[[u32; 3]],
    color_of_triangle: &dyn Fn(usize) -> [u8; 3],
    width_px: usize,
) -> Picture {
    let points: Vec<DVec3> = vertices.iter().map(|v| DVec3::from_array(v.map(f64::from))).collect();
    let finite = || points.iter().copied().filter(|p| p.is_finite());
    let low = finite().fold(DVec3::INFINITY, DVec3::min);
    let high = finite().fold(DVec3::NEG_INFINITY, DVec3::max);
    let width = width_px.clamp(1, 8192);
    let size = (high - low).max(DVec3::splat(1e-9));
    let scale = if size.is_finite() { width as f64 / size.x } else { 1.0 };
    let height = if size.is_finite() { ((size.y * scale).ceil() as usize).clamp(1, 8192) } else { 1 };
    let on_picture =
        points.iter().map(|p| DVec3::new((p.x - low.x) * scale, (high.y - p.y) * scale, p.z)).collect::<Vec<_>>();
    let mut canvas = Canvas::new(width, height);
    for (id, triangle) in triangles.iter().enumerate() {
        canvas.cover(id as u32, triangle, &on_picture);
    }
    canvas.paint(triangles, &vertex_normals(&points, triangles), color_of_triangle)
}

fn vertex_normals(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; points.len()];
    for triangle in triangles {
        if let Some([a, b, c]) = corners(points, triangle) {
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&v| normals[v as usize] += normal);
        }
    }
    normals
}

fn corners(points: &[DVec3], triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
    let get = |v: u32| points.get(v as usize).copied().filter(|p| p.is_finite());
    Some([get(triangle[0])?, get(triangle[1])?, get(triangle[2])?])
}

/// Which triangle is seen in each pixel, at what height and where in the triangle.
struct Canvas {
    width: usize,
    height: usize,
    z: Vec<f64>,
    triangle: Vec<u32>,
    weights: Vec<[f32; 2]>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Canvas {
        let count = width * height;
        let (z, weights) = (vec![f64::NEG_INFINITY; count], vec![[0.0; 2]; count]);
        Canvas { width, height, z, triangle: vec![NOTHING; count], weights }
    }

    fn cover(&mut self, id: u32, triangle: &[u32; 3], points: &[DVec3]) {
        let Some([a, b, c]) = corners(points, triangle) else { return };
        let twice_area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if twice_area == 0.0 {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let span = |low: f64, high: f64, limit: usize| {
            ((low - 0.5).ceil().max(0.0) as usize)..(((high - 0.5).floor() + 1.0).max(0.0) as usize).min(limit)
        };
        for row in span(low.y, high.y, self.height) {
            for column in span(low.x, high.x, self.width) {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let v = ((x - a.x) * (c.y - a.y) - (c.x - a.x) * (y - a.y)) / twice_area;
                let w = ((b.x - a.x) * (y - a.y) - (x - a.x) * (b.y - a.y)) / twice_area;
                let z = a.z + v * (b.z - a.z) + w * (c.z - a.z);
                let at = row * self.width + column;
                if v >= 0.0 && w >= 0.0 && v + w <= 1.0 && z > self.z[at] {
                    self.z[at] = z;
                    self.triangle[at] = id;
                    self.weights[at] = [v as f32, w as f32];
                }
            }
        }
    }

    fn paint(self, triangles: &[[u32; 3]], normals: &[DVec3], color: &dyn Fn(usize) -> [u8; 3]) -> Picture {
        let pixel = |(&id, &[v, w]): (&u32, &[f32; 2])| {
            if id == NOTHING {
                return BACKGROUND;
            }
            let [a, b, c] = triangles[id as usize].map(|v| normals[v as usize].normalize_or_zero());
            let (v, w) = (f64::from(v), f64::from(w));
            let normal = (a * (1.0 - v - w) + b * v + c * w).normalize_or_zero();
            let light = AMBIENT + (1.25 - AMBIENT) * normal.dot(LIGHT).max(0.0);
            color(id as usize).map(|channel| (f64::from(channel) * light).min(255.0) as u8)
        };
        let pixels = self.triangle.iter().zip(&self.weights).map(pixel).collect();
        Picture { width: self.width, height: self.height, pixels, triangle: self.triangle }
    }
}

/// Writes the picture as PNG.
///
/// # Errors
/// The file cannot be created or written.
pub fn write_png(picture: &Picture, path: &Path) -> Result<(), PictureError> {
    encode(picture, path).map_err(|source| PictureError::Write {
        path: path.to_owned(),
        width: picture.width,
        height: picture.height,
        source,
    })
}

fn encode(picture: &Picture, path: &Path) -> gdal::errors::Result<()> {
    let memory = DriverManager::get_driver_by_name("MEM")?;
    let dataset = memory.create_with_band_type::<u8, _>("", picture.width, picture.height, 3)?;
    for channel in 0..3 {
        let samples = picture.pixels.iter().map(|p| p[channel]).collect();
        let mut buffer = Buffer::new((picture.width, picture.height), samples);
        dataset.rasterband(channel + 1)?.write((0, 0), (picture.width, picture.height), &mut buffer)?;
    }
    let png = DriverManager::get_driver_by_name("PNG")?;
    dataset.create_copy(&png, path, &RasterCreationOptions::default())?.close()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_higher_of_two_surfaces_is_seen_and_the_border_between_classes_is_drawn() {
        let vertices = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let mut all = vertices.to_vec();
        all.extend([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]]);
        let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6]];
        let mut picture = top_view(&all, &triangles, &|t| [[100, 0, 0], [0, 100, 0], [0, 0, 100]][t], 40);
        assert_eq!((picture.width, picture.height), (40, 40));
        let south_west = picture.pixels[38 * 40 + 1];
        assert!(south_west[2] > 0 && south_west[0] == 0, "{south_west:?}");
        assert!(picture.pixels[2 * 40 + 1][1] > 0 && picture.pixels[38 * 40 + 38][0] > 0);
        picture.draw_outlines(&|t| t as i64, [255, 255, 255]);
        assert!(picture.pixels.iter().filter(|p| **p == [255; 3]).count() > 40);
    }
}
