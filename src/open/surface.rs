//! What every later stage may ask of a survey, whatever its files are.

use super::Reach;
use crate::geometry::DVec3;
use std::ops::Range;

/// A triangulated surface: vertices and triangles by global number, in the order of the input.
///
/// The numbers are the identity of everything: neighbours tie-break by them, components are named by
/// them, tiles are stitched by them.
pub trait Surface: Sync {
    /// Number of vertices.
    fn vertices(&self) -> u64;
    /// Number of triangles.
    fn triangles(&self) -> u64;
    /// Position of a vertex, local metres.
    fn position(&self, vertex: u64) -> DVec3;
    /// Lowest and highest corner of the box of all vertices, local metres, where it is known.
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        None
    }
    /// The three vertices of a triangle, counter-clockwise seen from outside.
    fn triangle(&self, triangle: u64) -> [u64; 3];
    /// What stands for full colour in [`Surface::raw_color`], if the survey has colours. Where it is 255, colours are
    /// whole numbers of one byte.
    fn full_color(&self) -> Option<f64>;
    /// Colour of a vertex as the input has it: red, green, blue. Zero without colours.
    fn raw_color(&self, vertex: u64) -> [f32; 3];
    /// Lets go of what was read and is not needed soon: a pass over a survey larger than memory says so from
    /// time to time. Reading goes on as before.
    fn release(&self) {}

    /// Puts the positions of a range of vertices in place of what `to` holds.
    fn positions(&self, vertices: Range<u64>, to: &mut Vec<DVec3>) {
        to.clear();
        to.extend(vertices.map(|v| self.position(v)));
    }
    /// Puts the colours of a range of vertices in place of what `to` holds.
    fn raw_colors(&self, vertices: Range<u64>, to: &mut Vec<[f32; 3]>) {
        to.clear();
        to.extend(vertices.map(|v| self.raw_color(v)));
    }
    /// Puts the vertices of a range of triangles in place of what `to` holds.
    fn corner_numbers(&self, triangles: Range<u64>, to: &mut Vec<[u64; 3]>) {
        to.clear();
        to.extend(triangles.map(|t| self.triangle(t)));
    }

    /// The three corners of a triangle, local metres.
    fn corners(&self, triangle: u64) -> [DVec3; 3] {
        self.triangle(triangle).map(|v| self.position(v))
    }
}

impl Surface for Reach {
    fn vertices(&self) -> u64 {
        self.vertices()
    }
    fn triangles(&self) -> u64 {
        self.triangles()
    }
    fn position(&self, vertex: u64) -> DVec3 {
        self.position(vertex)
    }
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        // Subtraction and multiplication round without changing which is lower.
        let (min, max) = self.input_bounds();
        Some((self.frame().local(min), self.frame().local(max)))
    }
    fn triangle(&self, triangle: u64) -> [u64; 3] {
        self.triangle(triangle)
    }
    fn full_color(&self) -> Option<f64> {
        self.full_color()
    }
    fn raw_color(&self, vertex: u64) -> [f32; 3] {
        self.raw_color(vertex)
    }
    fn positions(&self, vertices: Range<u64>, to: &mut Vec<DVec3>) {
        self.positions(vertices, to);
    }
    fn raw_colors(&self, vertices: Range<u64>, to: &mut Vec<[f32; 3]>) {
        self.raw_colors(vertices, to);
    }
    fn corner_numbers(&self, triangles: Range<u64>, to: &mut Vec<[u64; 3]>) {
        self.corner_numbers(triangles, to);
    }
    fn release(&self) {
        self.release();
    }
}

/// A surface held in memory, in local metres.
#[derive(Debug, Clone, Default)]
pub struct MemorySurface {
    /// Vertex positions, local metres.
    pub positions: Vec<DVec3>,
    /// Triangles, as numbers of vertices.
    pub triangles: Vec<[u64; 3]>,
    /// Colours of the vertices in 0 to 255; empty for none.
    pub colors: Vec<[u8; 3]>,
}

impl Surface for MemorySurface {
    fn vertices(&self) -> u64 {
        self.positions.len() as u64
    }
    fn triangles(&self) -> u64 {
        self.triangles.len() as u64
    }
    fn position(&self, vertex: u64) -> DVec3 {
        self.positions[vertex as usize]
    }
    fn triangle(&self, triangle: u64) -> [u64; 3] {
        self.triangles[triangle as usize]
    }
    fn full_color(&self) -> Option<f64> {
        (!self.colors.is_empty()).then_some(255.0)
    }
    fn raw_color(&self, vertex: u64) -> [f32; 3] {
        self.colors.get(vertex as usize).copied().unwrap_or_default().map(f32::from)
    }
}
