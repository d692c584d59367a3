//! A point cloud with the triangles that were laid over it.

use super::error::OpenError;
use super::mapped::MappedFile;
use super::stamp::Stamp;
use super::{Reach, Surface};
use crate::geometry::DVec3;
use std::fs::File;
use std::ops::Range;

/// The points of a survey of clouds, and triangles between them.
#[derive(Debug)]
pub struct DrapedCloud<'a> {
    reach: &'a Reach,
    triangles: MappedFile,
    wide: bool,
}

impl<'a> DrapedCloud<'a> {
    /// A cloud with triples of its points, little-endian, of 32 bits, or of 64 where `wide`.
    ///
    /// # Errors
    /// The system refuses to map the file.
    pub fn new(reach: &'a Reach, triangles: &File, wide: bool) -> Result<DrapedCloud<'a>, OpenError> {
        let unreadable = |source| OpenError::Surface { source };
        let stamp = Stamp::of(&triangles.metadata().map_err(unreadable)?);
        let triangles = MappedFile::of_scratch(triangles, stamp).map_err(unreadable)?;
        Ok(DrapedCloud { reach, triangles, wide })
    }

    /// The points.
    pub fn reach(&self) -> &'a Reach {
        self.reach
    }

    fn number_bytes(&self) -> usize {
        if self.wide { 8 } else { 4 }
    }

    #[inline]
    fn corners(&self, record: &[u8]) -> [u64; 3] {
        let number = |i: usize| match self.wide {
            true => u64::from_le_bytes(std::array::from_fn(|k| record[8 * i + k])),
            false => u64::from(u32::from_le_bytes(std::array::from_fn(|k| record[4 * i + k]))),
        };
        [number(0), number(1), number(2)]
    }
}

impl Surface for DrapedCloud<'_> {
    fn vertices(&self) -> u64 {
        self.reach.vertices()
    }
    fn triangles(&self) -> u64 {
        (self.triangles.len() / (3 * self.number_bytes())) as u64
    }
    fn position(&self, vertex: u64) -> DVec3 {
        self.reach.position(vertex)
    }
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        Surface::bounds(self.reach)
    }
    fn triangle(&self, triangle: u64) -> [u64; 3] {
        let bytes = 3 * self.number_bytes();
        self.corners(&self.triangles[triangle as usize * bytes..])
    }
    fn full_color(&self) -> Option<f64> {
        self.reach.full_color()
    }
    fn raw_color(&self, vertex: u64) -> [f32; 3] {
        self.reach.raw_color(vertex)
    }
    fn positions(&self, vertices: Range<u64>, to: &mut Vec<DVec3>) {
        self.reach.positions(vertices, to);
    }
    fn raw_colors(&self, vertices: Range<u64>, to: &mut Vec<[f32; 3]>) {
        self.reach.raw_colors(vertices, to);
    }
    fn corner_numbers(&self, triangles: Range<u64>, to: &mut Vec<[u64; 3]>) {
        let bytes = 3 * self.number_bytes();
        let of_range = &self.triangles[triangles.start as usize * bytes..triangles.end as usize * bytes];
        to.clear();
        to.extend(of_range.chunks_exact(bytes).map(|record| self.corners(record)));
    }
    fn release(&self) {
        self.reach.release();
        self.triangles.release();
    }
}
