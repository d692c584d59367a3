//! What tiles found, on disk until all are done: memory for tiles is free again when they are read.

use super::{record_core, recorded_core};
use crate::error::Error;
use crate::stitch::TileFinding;
use crate::store::{Ledger, Shelf, StoreError};
use crate::tile::{CoreSize, Plan};

/// Records: the size of a core, and behind it the tiles by their number.
const SIZE: u64 = 0;
const TILES: u64 = 1;

/// The findings of a run so far.
#[derive(Debug)]
pub struct Findings {
    ledger: Ledger,
    /// The size of cores, until it is recorded with the first tile.
    size: Option<CoreSize>,
}

impl Findings {
    pub(super) fn open(shelf: &Shelf, name: &str, identity: &str) -> Result<Findings, StoreError> {
        Ok(Findings { ledger: shelf.ledger_of(name, identity)?.0, size: None })
    }

    /// The size of the cores whose records are here; otherwise `size`, which it is from the first record on: a run
    /// that was ended because a tile was too large must not begin with that tile again.
    ///
    /// # Errors
    /// The disk says no.
    pub fn core(&mut self, size: CoreSize) -> Result<CoreSize, StoreError> {
        let recorded = recorded_core(&self.ledger, SIZE)?;
        self.size = Some(size).filter(|_| recorded.is_none());
        Ok(recorded.unwrap_or(size))
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
        if let Some(size) = self.size.take() {
            record_core(&mut self.ledger, SIZE, size)?;
        }
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
