//! Spacing and divergence on disk, with a record of which tiles are done.

use super::{record_core, recorded_core};
use crate::index::Index;
use crate::store::{Column, Ledger, Shelf, StoreError, fail_point};
use crate::tile::{CoreSize, Plan};
use std::hash::Hasher;
use std::ops::Range;
use twox_hash::XxHash3_64;

const LEDGER: &str = "tiles";
const DIVERGENCE: &str = "divergence";
/// Records: the size of a core, the spacing, and behind them the tiles by their number.
const SIZE: u64 = 0;
const SPACING: u64 = 1;
const TILES: u64 = 2;

/// What is known of a survey's curvature.
#[derive(Debug)]
pub struct Curvature {
    divergence: Column<f64>,
    tiles: Ledger,
}

impl Curvature {
    pub(super) fn open(shelf: &Shelf, identity: &str, index: &Index) -> Result<Curvature, StoreError> {
        let (mut ledger, _) = shelf.ledger(LEDGER, identity)?;
        let divergence = match shelf.open(DIVERGENCE, index.scale.vertices) {
            Ok(divergence) => divergence,
            Err(_) => {
                // Records without their values are worth nothing.
                drop(ledger);
                shelf.remove(LEDGER);
                ledger = shelf.ledger(LEDGER, identity)?.0;
                shelf.create(DIVERGENCE, index.scale.vertices)?
            }
        };
        Ok(Curvature { divergence, tiles: ledger })
    }

    /// The size of the cores whose records are here; otherwise `size`, which it is from now on.
    ///
    /// # Errors
    /// The disk says no.
    pub fn core(&mut self, size: CoreSize) -> Result<CoreSize, StoreError> {
        if let Some(recorded) = recorded_core(&self.tiles, SIZE)? {
            return Ok(recorded);
        }
        record_core(&mut self.tiles, SIZE, size)?;
        Ok(size)
    }

    /// The spacing, metres: the recorded one, or the one that `measure` finds, which is recorded.
    ///
    /// # Errors
    /// Those of `measure`, and the disk's.
    pub fn spacing_m<E: From<StoreError>>(&mut self, measure: impl FnOnce() -> Result<f64, E>) -> Result<f64, E> {
        if let Some(position) = self.tiles.position(SPACING) {
            let record = self.tiles.read(position)?;
            if let Ok(bytes) = record.payload.try_into() {
                return Ok(f64::from_le_bytes(bytes));
            }
        }
        let found = measure()?;
        self.tiles.append(SPACING, &found.to_le_bytes())?;
        Ok(found)
    }

    /// The tiles of the plan that are not done, by their place in it. Values that do not fit their checksum, as
    /// after a power cut, are not done.
    ///
    /// # Errors
    /// The disk says no.
    pub fn missing(&self, index: &Index, plan: &Plan) -> Result<Vec<usize>, StoreError> {
        let mut missing = Vec::new();
        for (job, tile) in plan.tiles.iter().enumerate() {
            let recorded = match self.tiles.position(TILES + tile.id) {
                Some(position) => Some(self.tiles.read(position)?.payload),
                None => None,
            };
            let whole = match recorded {
                Some(payload) => {
                    let mut values = Vec::new();
                    for run in index.vertices.ranges(&index.grid, &tile.core) {
                        self.divergence.read(run, &mut values)?;
                    }
                    payload == checksum(&values)
                }
                None => false,
            };
            if !whole {
                missing.push(job);
            }
        }
        Ok(missing)
    }

    /// Keeps the values of a tile: its runs of vertices, and behind one another the values of all.
    ///
    /// # Errors
    /// The disk says no.
    pub fn add(&mut self, tile: u64, runs: &[Range<u64>], values: &[f64]) -> Result<(), StoreError> {
        let mut rest = values;
        for run in runs {
            let (of_run, after) = rest.split_at((run.end - run.start) as usize);
            self.divergence.write(run.start, of_run.iter().copied())?;
            rest = after;
        }
        fail_point("curvature.before_record");
        self.tiles.append(TILES + tile, &checksum(values)).map(|_| ())
    }

    /// Flushes all of it to the disk.
    ///
    /// # Errors
    /// The disk says no.
    pub fn sync(&mut self) -> Result<(), StoreError> {
        self.divergence.sync()?;
        self.tiles.sync()
    }

    /// Divergence by vertex, 1/m; only of tiles that are done.
    pub fn divergence(&self) -> &Column<f64> {
        &self.divergence
    }
}

fn checksum(values: &[f64]) -> [u8; 8] {
    let mut hash = XxHash3_64::new();
    for piece in values.chunks(1 << 12) {
        let bytes: Vec<u8> = piece.iter().flat_map(|v| v.to_le_bytes()).collect();
        hash.write(&bytes);
    }
    hash.finish().to_le_bytes()
}
