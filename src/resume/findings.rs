//! What tiles found, on disk until all are done: memory for tiles is free again when they are read.

use crate::error::Error;
use crate::stitch::TileFinding;
use crate::store::{Ledger, Shelf, StoreError};
use crate::tile::Plan;

/// Records: the side of a tile, and behind it the tiles by their number.
const SIDE: u64 = 0;
const TILES: u64 = 1;

/// The findings of a run so far.
#[derive(Debug)]
pub struct Findings {
    ledger: Ledger,
}

impl Findings {
    pub(super) fn open(shelf: &Shelf, name: &str, identity: &str) -> Result<Findings, StoreError> {
        Ok(Findings { ledger: shelf.ledger_of(name, identity)?.0 })
    }

    /// The side of the tiles whose records are here, metres; otherwise `side_m`, which it is from now on.
    ///
    /// # Errors
    /// The disk says no.
    pub fn side_m(&mut self, side_m: f64) -> Result<f64, StoreError> {
        if let Some(position) = self.ledger.position(SIDE)
            && let Ok(bytes) = self.ledger.read(position)?.payload.try_into()
        {
            return Ok(f64::from_le_bytes(bytes));
        }
        self.ledger.append(SIDE, &side_m.to_le_bytes())?;
        Ok(side_m)
    }

    /// The tiles of the plan that have no finding, by their place in it.
    pub fn missing(&self, plan: &Plan) -> Vec<usize> {
        let missing = |job: &usize| self.ledger.position(TILES + plan.tiles[*job].id).is_none();
        (0..plan.tiles.len()).filter(missing).collect()
    }

    /// Records what a tile found.
    ///
    /// # Errors
    /// The disk says no.
    pub fn add(&mut self, finding: &TileFinding) -> Result<(), Error> {
        self.ledger.append(TILES + finding.report.tile, &finding.to_record()?)?;
        Ok(())
    }

    /// Flushes them to the disk.
    ///
    /// # Errors
    /// The disk says no.
    pub fn sync(&mut self) -> Result<(), StoreError> {
        self.ledger.sync()
    }

    /// All findings, in the order of the plan.
    ///
    /// # Errors
    /// The disk says no, or gives other bytes than it was given.
    pub fn all(&self, plan: &Plan) -> Result<Vec<TileFinding>, Error> {
        plan.tiles
            .iter()
            .filter_map(|tile| self.ledger.position(TILES + tile.id))
            .map(|position| Ok(TileFinding::from_record(&self.ledger.read(position)?.payload)?))
            .collect()
    }
}
