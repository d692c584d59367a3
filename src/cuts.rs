//! How a survey is cut: few tiles, since what lies at their borders is worked twice, and small enough for the memory.

use crate::curvature::InstructionSet;
use crate::index::Index;
use crate::passes::{Survey, tiles_at_once};
use crate::settings::Settings;
use crate::tile::{CoreSize, NormalField, Plan, TileMesh};

/// Largest core of the curvature pass, triangles. With larger ones every tile takes new pages from the system; with
/// smaller ones halos weigh more.
const LARGEST_CURVATURE_CORE: f64 = 5e5;
/// Largest core of the grain pass, triangles: what a crash can cost, and with its halos what local numbers can hold.
pub(crate) const LARGEST_CORE: f64 = 6e7;
/// Triangles of a core of the grain pass with its halos, for each of the core, where nothing is known of the grains.
const WITH_WIDE_HALO: f64 = 1.6;
/// Share of the memory that the tiles of a survey that is cut are made for: the rest is for second looks, for what was
/// found, and for what the allocator keeps. So peaks are alike for surveys of all sizes.
const SHARE_OF_CUT: f64 = 0.8;
/// Triangles of a curvature core with its halo, for each of the core.
const WITH_HALO: f64 = 1.1;
/// Widths of a grain that are worked once more along a border between two cores, halos and second looks together.
/// Measured on beds of 10 and 100 million triangles, in 2 to 21 tiles.
const WIDTHS_AT_BORDER: f64 = 7.0;
/// Work in halos, for each triangle of the survey, up to which it is cut into more tiles than memory asks for. The
/// loops within a tile run on all threads as well, so that more would be gained for the clock alone.
const WORTH_A_CUT: f64 = 0.2;
/// Core, triangles, below which memory is rather given to one tile than to several at once.
const LEAST_OF_SEVERAL: f64 = 1e6;
/// Survey that is not cut for the sake of threads, triangles: to look how wide its grains are would cost too much.
const LEAST_TO_CUT: u64 = 8_000_000;

/// The size of cores in the passes that store one number for each vertex, if `threads` tiles are worked at once in
/// `memory` bytes.
pub fn curvature_core(index: &Index, settings: &Settings, threads: usize, memory: u64) -> CoreSize {
    if settings.work.tile_size_m > 0.0 {
        return CoreSize::square(index, settings.work.tile_size_m);
    }
    let fit = memory as f64 / threads as f64 / NormalField::footprint_bytes(1) as f64 / WITH_HALO;
    let shared = index.scale.triangles as f64 / threads as f64;
    CoreSize::holding(index, fit.min(shared.max(2.5e5)).min(LARGEST_CURVATURE_CORE), threads)
}

/// How large the cores of the grain pass may be.
#[derive(Debug, Clone, Copy)]
pub struct GrainCores {
    /// The largest that memory allows.
    pub largest: CoreSize,
    /// Whether they may be smaller, if grains are narrow enough, so that all threads are busy.
    pub divisible: bool,
}

/// The largest cores of the grain pass that fit into `memory` bytes, with as many at once as keep `threads` busy.
pub fn grain_cores(index: &Index, settings: &Settings, threads: usize, memory: u64) -> GrainCores {
    if settings.work.tile_size_m > 0.0 {
        return GrainCores { largest: CoreSize::square(index, settings.work.tile_size_m), divisible: false };
    }
    let triangles = index.scale.triangles;
    let at_once = tiles_at_once(threads);
    let Cuts { mut least, divisible } = Cuts::of(triangles, at_once, memory);
    loop {
        let largest = CoreSize::holding(index, triangles as f64 / least, at_once);
        let plan = Plan::new(index, largest);
        let survey = Survey { index, plan: &plan, instructions: InstructionSet::best() };
        // The halos of small cores are wider than the rest of them.
        let fits = survey.largest_bytes(settings) as f64 <= SHARE_OF_CUT * memory as f64;
        if fits || least == 1.0 || (largest.columns, largest.rows) == (1, 1) {
            return GrainCores { largest, divisible };
        }
        least *= 1.3;
    }
}

/// How often a survey is cut.
#[derive(Debug, PartialEq)]
struct Cuts {
    /// The fewest tiles that memory allows; 1 for a survey that needs no cut.
    least: f64,
    /// Whether there may be more, for the sake of threads.
    divisible: bool,
}

impl Cuts {
    fn of(triangles: u64, at_once: usize, memory: u64) -> Cuts {
        let all = TileMesh::footprint_bytes(triangles) as f64 / memory as f64;
        if all <= 1.0 && triangles as f64 <= LARGEST_CORE {
            // Halos must fit as well if it is cut.
            let divisible = at_once > 1 && triangles >= LEAST_TO_CUT && all * WITH_WIDE_HALO <= 1.0;
            return Cuts { least: 1.0, divisible };
        }
        let one_at_once = all / SHARE_OF_CUT * WITH_WIDE_HALO;
        // More at once would be too small to be worked with their halos: others may wait.
        let affordable = (triangles as f64 / one_at_once / LEAST_OF_SEVERAL) as usize;
        let by_memory = one_at_once * at_once.min(affordable).max(1) as f64;
        Cuts { least: by_memory.max(triangles as f64 / LARGEST_CORE).max(2.0), divisible: false }
    }
}

impl GrainCores {
    /// The size of cores where most grains are not wider than `usual_width_m`: as small as keeps all threads busy,
    /// if what is then worked in halos is little.
    pub fn size(&self, index: &Index, threads: usize, usual_width_m: Option<f64>) -> CoreSize {
        let Some(width_m) = usual_width_m.filter(|_| self.divisible) else { return self.largest };
        let width_cells = width_m / index.grid.cell_m;
        let triangles = index.scale.triangles as f64;
        let at_once = tiles_at_once(threads);
        (2..=at_once)
            .rev()
            .map(|tiles| CoreSize::holding(index, triangles / tiles as f64, at_once))
            .filter(|size| size.columns <= self.largest.columns && size.rows <= self.largest.rows)
            .find(|size| WIDTHS_AT_BORDER * width_cells * size.border(&index.grid) <= WORTH_A_CUT)
            .unwrap_or(self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GIB: u64 = 1 << 30;

    #[test]
    fn a_survey_is_cut_only_where_memory_or_the_cost_of_a_crash_asks_for_it() {
        let cuts = |triangles: u64, threads, memory| Cuts::of(triangles, tiles_at_once(threads), memory);
        assert_eq!(cuts(1_000_000, 2, GIB), Cuts { least: 1.0, divisible: false });
        assert_eq!(cuts(10_000_000, 1, GIB), Cuts { least: 1.0, divisible: false });
        assert_eq!(cuts(10_000_000, 2, 2 * GIB), Cuts { least: 1.0, divisible: false });
        assert_eq!(cuts(10_000_000, 8, 2 * GIB), Cuts { least: 1.0, divisible: true });
        // Whole it fits, with halos it would not.
        assert_eq!(cuts(11_000_000, 2, GIB), Cuts { least: 1.0, divisible: false });
        assert_eq!(cuts(0, 8, GIB), Cuts { least: 1.0, divisible: false });
        // However much memory there is, a tile's numbers and what a crash may cost are bounded.
        assert!((cuts(2_000_000_000, 1, 1000 * GIB).least - 33.3).abs() < 0.1);
        for (triangles, threads, memory) in [(100_000_000, 2, GIB), (100_000_000, 64, 8 * GIB), (15_000_000, 1, GIB)] {
            let tile = triangles as f64 / cuts(triangles, threads, memory).least;
            let at_once = tiles_at_once(threads) as u64;
            let bytes = TileMesh::footprint_bytes((tile * WITH_WIDE_HALO) as u64) * at_once;
            assert!(bytes <= memory && !cuts(triangles, threads, memory).divisible, "{triangles}: {bytes} of {memory}");
        }
        // Little memory is not shared out among tiles that are mostly halo.
        assert_eq!(cuts(1_000_000, 16, 60 << 20), cuts(1_000_000, 1, 60 << 20));
    }
}
