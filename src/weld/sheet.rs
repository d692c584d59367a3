//! Which files lie where: squares in plan, kept only where there is something.

use crate::geometry::{DVec3, PlanBox};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Squares of a page along each side.
const PAGE: u32 = 64;
/// Most pages for each vertex: a page that nothing lies on costs little, but not nothing.
const PAGES_PER_VERTEX: f64 = 1.0 / 32.0;
/// As many pages may be there in any case.
const LEAST_PAGES: f64 = 4096.0;
/// No file lies there.
const NOBODY: u32 = 0;
/// More than one file does.
const SEVERAL: u32 = u32::MAX;

type Page = OnceLock<Box<[AtomicU32]>>;

/// For each square: nobody, one file, or several.
#[derive(Debug)]
pub(super) struct Sheet {
    min: [f64; 2],
    side_m: f64,
    size: [u32; 2],
    pages: Vec<Page>,
}

impl Sheet {
    /// Squares over a box in plan, of a side of `side_m`; wider where these would be far more than the vertices.
    pub(super) fn over(area: &PlanBox, side_m: f64, vertices: u64) -> Sheet {
        let pages = |side_m: f64, axis: usize| {
            ((area.max[axis] - area.min[axis]) / (side_m * f64::from(PAGE))).floor().max(0.0) + 1.0
        };
        let most = (vertices as f64 * PAGES_PER_VERTEX).clamp(LEAST_PAGES, f64::from(u32::MAX >> 8));
        let mut side_m = side_m;
        while pages(side_m, 0) * pages(side_m, 1) > most {
            side_m *= 1.25;
        }
        let size = [0, 1].map(|axis| pages(side_m, axis) as u32);
        let pages = (0..size[0] as usize * size[1] as usize).map(|_| Page::new()).collect();
        Sheet { min: area.min, side_m, size, pages }
    }

    /// Side of a square, metres.
    pub(super) fn side_m(&self) -> f64 {
        self.side_m
    }

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> u64 {
        let made = self.pages.iter().filter(|page| page.get().is_some()).count();
        (self.pages.len() * size_of::<Page>() + made * (PAGE * PAGE) as usize * size_of::<AtomicU32>()) as u64
    }

    // Every step rounds without changing which of two coordinates is lower, so that what lies within a tolerance
    // of a point lies in the squares between those of the tolerance's ends.
    #[inline]
    fn along(&self, coordinate: f64, axis: usize) -> u32 {
        let at = ((coordinate - self.min[axis]) / self.side_m).max(0.0) as u32;
        at.min(self.size[axis] * PAGE - 1)
    }

    #[inline]
    fn number(&self, [column, row]: [u32; 2]) -> u64 {
        let page = u64::from(row / PAGE) * u64::from(self.size[0]) + u64::from(column / PAGE);
        page * u64::from(PAGE * PAGE) + u64::from(row % PAGE * PAGE + column % PAGE)
    }

    /// The square that holds a point.
    #[inline]
    pub(super) fn square(&self, p: DVec3) -> u64 {
        self.number([self.along(p.x, 0), self.along(p.y, 1)])
    }

    /// Says that a file has a vertex within a tolerance of here.
    #[inline]
    pub(super) fn mark(&self, p: DVec3, tolerance_m: f64, file: u32) {
        let columns = self.along(p.x - tolerance_m, 0)..=self.along(p.x + tolerance_m, 0);
        let rows = self.along(p.y - tolerance_m, 1)..=self.along(p.y + tolerance_m, 1);
        for row in rows {
            for column in columns.clone() {
                self.mark_square(self.number([column, row]), file + 1);
            }
        }
    }

    #[inline]
    fn mark_square(&self, square: u64, owner: u32) {
        let squares = u64::from(PAGE * PAGE);
        let page = self.pages[(square / squares) as usize]
            .get_or_init(|| (0..squares).map(|_| AtomicU32::new(NOBODY)).collect());
        let square = &page[(square % squares) as usize];
        let known = square.load(Ordering::Relaxed);
        if known == owner || known == SEVERAL {
            return;
        }
        if let Err(other) = square.compare_exchange(NOBODY, owner, Ordering::Relaxed, Ordering::Relaxed)
            && other != owner
        {
            square.store(SEVERAL, Ordering::Relaxed);
        }
    }

    /// Whether several files lie in a square.
    #[inline]
    pub(super) fn is_shared(&self, square: u64) -> bool {
        let squares = u64::from(PAGE * PAGE);
        let page = self.pages[(square / squares) as usize].get();
        page.is_some_and(|page| page[(square % squares) as usize].load(Ordering::Relaxed) == SEVERAL)
    }

    /// Where a square lies, local metres.
    pub(super) fn outline(&self, square: u64) -> PlanBox {
        let squares = u64::from(PAGE * PAGE);
        let (page, within) = (square / squares, square % squares);
        let across = u64::from(self.size[0]);
        let column = page % across * u64::from(PAGE) + within % u64::from(PAGE);
        let row = page / across * u64::from(PAGE) + within / u64::from(PAGE);
        let min = [self.min[0] + column as f64 * self.side_m, self.min[1] + row as f64 * self.side_m];
        PlanBox { min, max: min.map(|v| v + self.side_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_shared_once_two_files_come_within_the_tolerance_of_it() {
        let sheet = Sheet::over(&PlanBox { min: [-3.0, 2.0], max: [200.0, 150.0] }, 0.5, 1_000_000);
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        sheet.mark(at(10.1, 10.1), 0.01, 0);
        sheet.mark(at(10.2, 10.2), 0.01, 0);
        assert!(!sheet.is_shared(sheet.square(at(10.1, 10.1))));
        // Just beyond the border of the square, which lies at 10.5.
        sheet.mark(at(10.505, 10.2), 0.01, 3);
        assert!(sheet.is_shared(sheet.square(at(10.499, 10.2))));
        assert!(!sheet.is_shared(sheet.square(at(10.505, 10.2))));
        assert!(!sheet.is_shared(sheet.square(at(199.0, 149.0))));
    }

    #[test]
    fn the_outline_of_a_square_holds_what_is_in_it() {
        let sheet = Sheet::over(&PlanBox { min: [-3.0, 2.0], max: [200.0, 150.0] }, 0.7, 1_000_000);
        for i in 0..500 {
            let p = DVec3::new(-3.0 + 0.406 * f64::from(i), 2.0 + 0.296 * f64::from(i), 1.0);
            let square = sheet.outline(sheet.square(p));
            assert!(square.margin_m(p) > -1e-9, "{p} {square:?}");
        }
    }

    #[test]
    fn a_stray_vertex_far_away_makes_wider_squares_and_not_more_of_them() {
        let sheet = Sheet::over(&PlanBox { min: [0.0, 0.0], max: [1e5, 1e5] }, 0.01, 1000);
        assert!(sheet.bytes() < 1 << 20, "{}", sheet.bytes());
        assert!(sheet.side_m() > 1.0);
    }
}
