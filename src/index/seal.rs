//! Seals: checksums of the columns, taken while they are written.

use super::Columns;
use super::shards::Shard;
use crate::store::StoreError;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What one shard wrote. The seals of all shards cover the columns.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Seal {
    vertices: Range<u64>,
    triangles: Range<u64>,
    /// XXH3-64 of the shard's part of positions, vertex inputs, colours (0 without), valences, corners, triangle inputs.
    checksums: [u64; 6],
}

/// Seals of all shards, from the checksums of their vertices (positions, inputs, colours) and of their triangles
/// (valences, corners, inputs).
pub(super) fn of_shards(shards: &[Shard], vertices: &[[u64; 3]], triangles: Vec<(Range<u64>, [u64; 3])>) -> Vec<Seal> {
    let mut seals = Vec::with_capacity(shards.len());
    for ((shard, &[a, b, c]), (triangles, [d, e, f])) in shards.iter().zip(vertices).zip(triangles) {
        seals.push(Seal { vertices: shard.vertices.clone(), triangles, checksums: [a, b, c, d, e, f] });
    }
    seals
}

impl Seal {
    /// Whether the columns still hold what the shard wrote.
    pub(super) fn fits(&self, columns: &Columns) -> Result<bool, StoreError> {
        let (vertices, triangles) = (|| self.vertices.clone(), || self.triangles.clone());
        let found = [
            columns.positions.checksum(vertices())?,
            columns.vertex_inputs.checksum(vertices())?,
            columns.colors.as_ref().map_or(Ok(0), |colors| colors.checksum(vertices()))?,
            columns.valences.checksum(vertices())?,
            columns.corners.checksum(triangles())?,
            columns.triangle_inputs.checksum(triangles())?,
        ];
        Ok(found == self.checksums)
    }
}
