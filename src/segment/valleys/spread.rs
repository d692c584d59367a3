//! Labels that spread from their sources over ground that is not known everywhere.

use super::cores::Ground;
use super::flood::{FAR, Flood};
use super::neighbours::Neighbours;
use super::{NONE, UNKNOWN};
use rayon::prelude::*;

/// How far each vertex lies from what is known, and from what is in doubt.
pub struct Spread {
    known: Flood,
    /// None where everything is known.
    doubt: Option<Flood>,
}

/// With which distance each source begins, and which vertices are in doubt.
pub type Sources<'s> = (&'s (dyn Fn(usize) -> Option<u16> + Sync), &'s (dyn Fn(usize) -> bool + Sync));

impl Spread {
    /// Nothing has spread yet.
    pub fn over(ground: &Ground) -> Spread {
        let dry = || Flood::dry(ground.neighbours.len());
        Spread { known: dry(), doubt: ground.unknown.map(|_| dry()) }
    }

    /// Spreads as far as `reach` parts; or goes on, with more sources and more in doubt than before (see [`Flood::rise`]).
    pub fn rise(
        &mut self,
        neighbours: &Neighbours,
        (start, in_doubt): Sources,
        reach: u16,
        cost: impl Fn(usize, usize) -> Option<u32> + Sync,
    ) {
        self.known.rise(neighbours, start, reach, &cost);
        if let Some(doubt) = &mut self.doubt {
            doubt.rise(neighbours, |v| in_doubt(v).then_some(0), reach, &cost);
        }
    }

    /// What spread to each vertex: the label of its source, [`NONE`], or [`UNKNOWN`] where something in doubt could be
    /// as near.
    pub fn labels(&self, label: impl Fn(usize) -> u32 + Sync) -> Vec<u32> {
        let of = |v: usize| {
            let doubt = self.doubt.as_ref().map_or(FAR, |doubt| doubt.distance[v]);
            match self.known.distance[v] {
                distance if doubt <= distance && doubt != FAR => UNKNOWN,
                _ => self.known.source(v).map_or(NONE, &label),
            }
        };
        (0..self.known.distance.len()).into_par_iter().with_min_len(1 << 12).map(of).collect()
    }
}
