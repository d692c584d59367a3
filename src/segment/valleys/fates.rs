//! Fates: which cores form a grain, and what of that is certain.

use super::NONE;
use super::joins::Joined;
use super::judge::{Judged, Kind};
use crate::geometry::PlanBox;

/// What becomes of the cores of a tile.
pub struct Fates {
    /// The lowest core of the grain that each core belongs to; [`NONE`] for those that are part of none.
    pub group: Vec<u32>,
    /// Whether everything about a grain is known, by its lowest core.
    pub known: Vec<bool>,
}

impl Fates {
    /// Of cores that were judged and joined. `whole` tells of which nothing that grew from them touches what is unknown.
    pub fn of(judged: &[Judged], joined: &Joined, whole: Vec<bool>, max_grain_m: f64) -> Fates {
        let count = judged.len();
        let (mut known, mut stone, mut bounds) = (vec![true; count], vec![false; count], vec![PlanBox::EMPTY; count]);
        for (core, Judged { kind, bounds: own, .. }) in judged.iter().enumerate() {
            let group = joined.root[core] as usize;
            known[group] &= match kind {
                Kind::Sheet => true,
                Kind::Open => false,
                Kind::Stone | Kind::Fragment => whole[core] && joined.known[core],
            };
            stone[group] |= matches!(kind, Kind::Stone | Kind::Open);
            bounds[group].merge(own);
        }
        let is_none = |group: usize| {
            let too_wide = max_grain_m > 0.0 && bounds[group].width_m() > max_grain_m;
            // A fragment that is not known to be joined to nothing may yet be part of a stone.
            too_wide || (!stone[group] && known[group])
        };
        let group = joined.root.iter().map(|&group| if is_none(group as usize) { NONE } else { group }).collect();
        Fates { group, known }
    }
}
