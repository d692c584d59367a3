//! The files of a survey as one surface.

use crate::geometry::DVec3;
use crate::open::{Bits, Surface};
use std::ops::Range;

/// A survey in which vertices of different files at the same place are one: triangles name the earliest of them, and
/// the others are used by no triangle. Everything else is as in the files.
pub struct Welded<'a> {
    surface: &'a dyn Surface,
    /// Vertices that became an earlier one, in order, with that one.
    aliases: Vec<(u64, u64)>,
    /// From the first of these to the last: whether it is one of them.
    first: u64,
    len: u64,
    is_alias: Bits,
}

impl<'a> Welded<'a> {
    /// `aliases` must ascend by their first numbers.
    pub(super) fn new(surface: &'a dyn Surface, aliases: Vec<(u64, u64)>) -> Welded<'a> {
        let first = aliases.first().map_or(0, |a| a.0);
        let len = aliases.last().map_or(0, |a| a.0 + 1 - first);
        let is_alias = Bits::new(len);
        aliases.iter().for_each(|a| is_alias.set(a.0 - first));
        Welded { surface, aliases, first, len, is_alias }
    }

    /// The vertices that became an earlier one, in order, with that one.
    pub fn aliases(&self) -> &[(u64, u64)] {
        &self.aliases
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> u64 {
        Bits::bytes(self.len) + self.aliases.len() as u64 * size_of::<(u64, u64)>() as u64
    }

    /// The vertex that stands for a vertex.
    #[inline]
    pub fn representative(&self, vertex: u64) -> u64 {
        let at = vertex.wrapping_sub(self.first);
        if at >= self.len || !self.is_alias.get(at) {
            return vertex;
        }
        self.aliases.binary_search_by_key(&vertex, |a| a.0).map_or(vertex, |i| self.aliases[i].1)
    }
}

impl std::fmt::Debug for Welded<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Welded").field("aliases", &self.aliases.len()).finish_non_exhaustive()
    }
}

impl Surface for Welded<'_> {
    fn vertices(&self) -> u64 {
        self.surface.vertices()
    }
    fn triangles(&self) -> u64 {
        self.surface.triangles()
    }
    fn position(&self, vertex: u64) -> DVec3 {
        self.surface.position(vertex)
    }
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.surface.bounds()
    }
    fn triangle(&self, triangle: u64) -> [u64; 3] {
        self.surface.triangle(triangle).map(|v| self.representative(v))
    }
    fn full_color(&self) -> Option<f64> {
        self.surface.full_color()
    }
    fn raw_color(&self, vertex: u64) -> [f32; 3] {
        self.surface.raw_color(vertex)
    }
    fn positions(&self, vertices: Range<u64>, to: &mut Vec<DVec3>) {
        self.surface.positions(vertices, to);
    }
    fn raw_colors(&self, vertices: Range<u64>, to: &mut Vec<[f32; 3]>) {
        self.surface.raw_colors(vertices, to);
    }
    fn corner_numbers(&self, triangles: Range<u64>, to: &mut Vec<[u64; 3]>) {
        self.surface.corner_numbers(triangles, to);
        if !self.aliases.is_empty() {
            to.iter_mut().flatten().for_each(|v| *v = self.representative(*v));
        }
    }
    fn release(&self) {
        self.surface.release();
    }
}
