//! The manifest of an index: what a later run needs to use it again.

use super::cells::{CellGrid, CellStarts};
use super::colors::Colors;
use super::identity::Numbers;
use super::seal::Seal;
use super::{COLORS, CORNERS, Columns, Index, POSITIONS, Scale, TRIANGLE_INPUTS, VALENCES, VERTEX_INPUTS};
use crate::store::{Column, Shelf, StoreError, fail_point};
use serde::{Deserialize, Serialize};
use std::hash::Hasher;
use std::path::Path;
use twox_hash::XxHash3_64;

const MANIFEST: &str = "manifest";
const VERTEX_STARTS: &str = "vertex_starts";
const TRIANGLE_STARTS: &str = "triangle_starts";

/// Must change when the meaning of a column does.
const FORMAT: u32 = 3;

#[derive(Serialize, Deserialize)]
struct Manifest {
    format: u32,
    identity: String,
    grid: CellGrid,
    scale: Scale,
    wide: bool,
    full_color: Option<f64>,
    /// XXH3-64 of the first triangle and the first vertex of each cell.
    starts: [u64; 2],
    /// Of the columns.
    seals: Vec<Seal>,
}

impl Index {
    /// Makes an index that was built on a shelf fit to be opened again: its columns are flushed to the disk, and
    /// then its manifest is written. `identity` says what it is an index of.
    ///
    /// # Errors
    /// The disk says no.
    pub fn keep(&self, shelf: &Shelf, identity: &str) -> Result<(), StoreError> {
        for (name, cells) in [(VERTEX_STARTS, &self.vertices), (TRIANGLE_STARTS, &self.triangles)] {
            let column: Column<u64> = shelf.create(name, cells.starts().len() as u64)?;
            column.write(0, cells.starts().iter().copied())?;
            column.sync()?;
        }
        let columns = &self.columns;
        columns.positions.sync()?;
        columns.valences.sync()?;
        columns.corners.sync()?;
        columns.vertex_inputs.sync()?;
        columns.triangle_inputs.sync()?;
        if let Some(colors) = &columns.colors {
            colors.sync()?;
        }
        let manifest = Manifest {
            format: FORMAT,
            identity: identity.to_owned(),
            grid: self.grid.clone(),
            scale: self.scale,
            wide: columns.corners.is_wide(),
            full_color: columns.colors.as_ref().map(Colors::full),
            starts: self.starts_checksums(),
            seals: self.seals.clone(),
        };
        // Plain numbers and a text can always be put into bytes.
        let bytes = postcard::to_extend(&manifest, Vec::new()).unwrap_or_default();
        fail_point("index.before_manifest");
        shelf.put(MANIFEST, &bytes)
    }

    /// Opens the index on a shelf, if there is a whole one of this identity. All of it is read once and held
    /// against its checksums: a damaged one would give other grains.
    pub fn open(shelf: &Shelf, identity: &str) -> Option<Index> {
        let bytes = shelf.get(MANIFEST)?;
        let manifest: Manifest = postcard::from_bytes(&bytes).ok()?;
        if manifest.format != FORMAT || manifest.identity != identity {
            return None;
        }
        let (scale, wide) = (manifest.scale, manifest.wide);
        let cells = manifest.grid.len() as u64 + 1;
        let starts = |name| -> Option<CellStarts> {
            let mut starts = Vec::new();
            shelf.open::<u64>(name, cells).ok()?.read(0..cells, &mut starts).ok()?;
            Some(CellStarts::new(starts))
        };
        let index = Index {
            triangles: starts(TRIANGLE_STARTS)?,
            vertices: starts(VERTEX_STARTS)?,
            grid: manifest.grid,
            scale,
            columns: Columns {
                positions: shelf.open(POSITIONS, scale.vertices).ok()?,
                valences: shelf.open(VALENCES, scale.vertices).ok()?,
                corners: Numbers::open(shelf, CORNERS, scale.triangles, wide).ok()?,
                vertex_inputs: Numbers::open(shelf, VERTEX_INPUTS, scale.vertices, wide).ok()?,
                triangle_inputs: Numbers::open(shelf, TRIANGLE_INPUTS, scale.triangles, wide).ok()?,
                colors: match manifest.full_color {
                    Some(full) => Some(Colors::open(shelf, COLORS, scale.vertices, full).ok()?),
                    None => None,
                },
            },
            seals: manifest.seals,
        };
        let whole = index.starts_checksums() == manifest.starts
            && index.seals.iter().all(|seal| seal.fits(&index.columns).unwrap_or(false));
        whole.then_some(index)
    }

    fn starts_checksums(&self) -> [u64; 2] {
        [&self.triangles, &self.vertices].map(|cells| {
            let mut hash = XxHash3_64::new();
            cells.starts().iter().for_each(|start| hash.write(&start.to_le_bytes()));
            hash.finish()
        })
    }

    /// Whether a folder holds an index that was kept, of whatever survey.
    pub fn is_kept_in(folder: &Path) -> bool {
        folder.join(MANIFEST).exists()
    }

    /// Makes sure that nobody opens the index on a shelf any more: it is about to be made anew.
    pub fn forget(shelf: &Shelf) {
        shelf.remove(MANIFEST);
    }
}
